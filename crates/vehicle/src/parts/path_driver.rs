//! The local path segment driver: drives along curves by commanding the local vector driver.

use std::convert::Infallible;
use std::time::{Duration, Instant};

use super::drivers::{
    FaultMonitor, Language, Next, Order, RemotePlatform, RemotePlatformSettings, Sense, guard,
    shut_down,
};
use super::{Part, PartError, Slot};
use crate::ground::StageBoard;
use crate::mobility::Vehicle;
use crate::motion::{Frame, Limits, Motion, Pilot};
use jaus::messages::mobility::{SetLocalVector, local_vector_driver, set_local_vector};

/// Drives along the segments of a list, by headings and speeds of the vector driver, with what the
/// pose sensor reports.
///
/// It offers Local Path Segment Driver, List Manager and Stage, behind Management and Access
/// Control. Vector driver and sensor are found in its own subsystem.
#[derive(Debug, Clone, PartialEq)]
pub struct PathDriver {
    /// What the vehicle can do at most, and how well it slows down.
    pub limits: Limits,
    /// It stops when the pose is older than this.
    pub stale: Duration,
    /// The authority with which it controls the vector driver.
    pub authority: u8,
    /// After how many seconds control ends unless its client asks for it again; 0 for never.
    pub control_timeout: u8,
}

impl Default for PathDriver {
    fn default() -> Self {
        Self {
            limits: Limits {
                // What is left after the delays of the drivers below.
                deceleration: 1.0,
                ..Limits::default()
            },
            stale: Duration::from_millis(600),
            authority: 100,
            control_timeout: 3,
        }
    }
}

impl PathDriver {
    /// How often the sensor is asked to report, in hertz.
    const HZ: f64 = 25.0;
}

impl Part for PathDriver {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let remote_platform = RemotePlatform::new(RemotePlatformSettings {
            limits: self.limits,
            stale: self.stale,
            by_heading: true,
        });
        let vehicle = Vehicle::new(Pilot::new(remote_platform.clone(), Frame::default()));
        let board = StageBoard::default();
        let component = slot
            .component("Local Path Segment Driver")
            .management(guard(self.control_timeout))
            .offer(vehicle.list_manager())
            .offer(vehicle.local_path_segment_driver())
            .offer(board.service())
            .live_on(slot.port)?;
        let poses = Sense::pose(&component, Self::HZ)?;
        let own = component.clone();
        let next = Next {
            component,
            vehicle,
            remote_platform: remote_platform.clone(),
            board,
            language: Vectors,
            authority: self.authority,
            // A list is executed once, and on purpose.
            settling: Duration::ZERO,
            sensors: FaultMonitor::default(),
        };
        tokio::select! {
            end = poses.steer(&remote_platform) => end,
            end = next.run() => end,
            end = shut_down(&own) => end,
        }
    }
}

/// Speaks to the vector driver.
struct Vectors;

impl Language for Vectors {
    type Command = SetLocalVector;
    const URN: &'static str = local_vector_driver::URN;
    const NAME: &'static str = "local vector driver";
    const PAUSE: Duration = Duration::from_millis(80);

    fn command(&mut self, _: Instant, order: Order, _: &Motion) -> SetLocalVector {
        let Order::Heading { heading, speed } = order else {
            return self.halt();
        };
        SetLocalVector {
            speed: set_local_vector::Speed::new(speed).unwrap_or_default(),
            heading: set_local_vector::Heading::new(heading).ok(),
            ..SetLocalVector::default()
        }
    }

    /// Speed 0, straight on.
    fn halt(&mut self) -> SetLocalVector {
        SetLocalVector::default()
    }
}
