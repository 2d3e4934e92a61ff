//! The local path segment driver: follows curves by commanding the local vector driver.

use std::convert::Infallible;
use std::time::{Duration, Instant};

use super::drivers::{
    FaultMonitor, Language, Next, Order, RemotePlatform, RemotePlatformSettings, Sense, guard,
    shut_down,
};
use super::{Part, PartError, Slot};
use crate::ground::StageBoard;
use crate::mobility::Vehicle;
use crate::motion::{Fence, FenceConfig, Frame, JumpCheck, Limits, Motion, Pilot};
use jaus::messages::mobility::{SetLocalVector, local_vector_driver, set_local_vector};

/// Follows the segments of a list by sending headings and speeds to the vector driver, based on the
/// pose sensor's reports.
///
/// It offers Local Path Segment Driver, List Manager and Stage, with Management and Access Control.
/// It finds vector driver and sensor in its own subsystem.
#[derive(Debug, Clone, PartialEq)]
pub struct PathDriver {
    /// Limits of the vehicle, including its deceleration.
    pub limits: Limits,
    /// Maximum age of the pose. The vehicle stops when it is older.
    pub stale: Duration,
    /// Dimensions and delays by which it keeps to the operating zones.
    pub fence: FenceConfig,
    /// Whether it needs a range sensor from the start. Otherwise it needs one from its first scan on.
    pub needs_range_sensor: bool,
    /// The authority used to control the vector driver.
    pub authority: u8,
    /// Control timeout in seconds unless the client renews control; 0 disables it.
    pub control_timeout: u8,
}

impl Default for PathDriver {
    fn default() -> Self {
        Self {
            limits: Limits {
                // Reduced to allow for the delays of the drivers below.
                deceleration: 1.0,
                ..Limits::default()
            },
            stale: Duration::from_millis(600),
            fence: FenceConfig::default(),
            needs_range_sensor: false,
            authority: 100,
            control_timeout: 3,
        }
    }
}

impl PathDriver {
    /// Report rate requested from the sensor, in hertz.
    const HZ: f64 = 25.0;
    /// Scan rate requested from the range sensor, in hertz.
    const SCANS: f64 = 10.0;

    /// Sets the vehicle's least turning radius in metres; 0 if it turns on the spot.
    #[must_use]
    pub const fn turning_radius(mut self, radius: f64) -> Self {
        self.limits.turning_radius = radius;
        self
    }
}

impl Part for PathDriver {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let remote_platform = RemotePlatform::new(RemotePlatformSettings {
            limits: self.limits,
            noise: JumpCheck::RECKONED,
            stale: self.stale,
            needs_scan: self.needs_range_sensor,
            by_heading: true,
        });
        let fence = Fence::new(self.fence);
        let pilot = Pilot::new(remote_platform.clone(), Frame::default());
        let vehicle = Vehicle::new(pilot.with_fence(fence.clone()));
        let board = StageBoard::default();
        let component = slot
            .component("Local Path Segment Driver")
            .management(guard(self.control_timeout))
            .offer(vehicle.list_manager())
            .offer(vehicle.local_path_segment_driver())
            .offer(board.service())
            .live_on(slot.port)?;
        slot.telemetry.attach(&component);
        let poses = Sense::pose(&component, Self::HZ)?;
        let zones = Sense::zones(&component)?;
        let scans = Sense::scans(&component, Self::SCANS)?;
        let own = component.clone();
        let next = Next {
            component,
            vehicle,
            remote_platform: remote_platform.clone(),
            fence: fence.clone(),
            board,
            language: Vectors,
            authority: self.authority,
            // A list is executed once, on explicit command, so nothing has to settle.
            settling: Duration::ZERO,
            sensors: FaultMonitor::default(),
        };
        tokio::select! {
            end = poses.steer(&remote_platform) => end,
            end = zones.enclose(&fence) => end,
            end = scans.watch(&remote_platform, &fence) => end,
            end = next.run() => end,
            end = shut_down(&own) => end,
        }
    }
}

/// Command interface of the vector driver.
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

    /// Speed 0, straight ahead.
    fn halt(&mut self) -> SetLocalVector {
        SetLocalVector::default()
    }
}
