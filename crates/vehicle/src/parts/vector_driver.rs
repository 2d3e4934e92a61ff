//! The local vector driver: holds a speed and a heading by commanding the primitive driver.

use std::convert::Infallible;
use std::time::{Duration, Instant};

use super::drivers::{
    FaultMonitor, Language, Next, Order, RemotePlatform, RemotePlatformSettings, Sense, guard,
    shut_down,
};
use super::{Part, PartError, Slot};
use crate::ground::StageBoard;
use crate::mobility::Vehicle;
use crate::motion::{
    Effort, Fence, FenceConfig, Frame, JumpCheck, Limits, Motion, Pilot, Throttle,
};
use jaus::messages::mobility::{SetWrenchEffort, primitive_driver};

/// Holds the commanded speed and heading by sending efforts to the primitive driver, based on the
/// reports of the pose and the velocity sensor.
///
/// It offers Local Vector Driver and Stage, with Management and Access Control. It finds primitive
/// driver and sensors in its own subsystem.
#[derive(Debug, Clone, PartialEq)]
pub struct VectorDriver {
    /// Limits of the vehicle. Speed and yaw rate are those of full effort.
    pub limits: Limits,
    /// After standing down, commands are accepted again once they have ceased for this time.
    pub silence: Duration,
    /// Maximum age of pose and velocity. The vehicle stops when they are older.
    pub stale: Duration,
    /// Dimensions and delays by which it keeps to the operating zones.
    pub fence: FenceConfig,
    /// Whether it needs a range sensor from the start. Otherwise it needs one from its first scan on.
    pub needs_range_sensor: bool,
    /// The authority used to control the primitive driver.
    pub authority: u8,
    /// Control timeout in seconds unless the client renews control; 0 disables it.
    pub control_timeout: u8,
}

impl Default for VectorDriver {
    fn default() -> Self {
        Self {
            limits: Limits::default(),
            silence: Duration::from_secs(1),
            stale: Duration::from_millis(600),
            fence: FenceConfig::default(),
            needs_range_sensor: false,
            authority: 100,
            control_timeout: 3,
        }
    }
}

impl VectorDriver {
    /// Report rate requested from the sensors, in hertz.
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

impl Part for VectorDriver {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let remote_platform = RemotePlatform::new(RemotePlatformSettings {
            limits: self.limits,
            noise: JumpCheck::RECKONED,
            stale: self.stale,
            needs_scan: self.needs_range_sensor,
            by_heading: false,
        });
        let fence = Fence::new(self.fence);
        let pilot = Pilot::new(remote_platform.clone(), Frame::default());
        let vehicle = Vehicle::new(pilot.with_fence(fence.clone()));
        let board = StageBoard::default();
        let component = slot
            .component("Local Vector Driver")
            .management(guard(self.control_timeout))
            .offer(vehicle.local_vector_driver())
            .offer(board.service())
            .live_on(slot.port)?;
        slot.telemetry.attach(&component);
        let poses = Sense::pose(&component, Self::HZ)?;
        let zones = Sense::zones(&component)?;
        let scans = Sense::scans(&component, Self::SCANS)?;
        let velocities = Sense::velocity(&component, Self::HZ)?;
        let own = component.clone();
        let next = Next {
            component,
            vehicle,
            remote_platform: remote_platform.clone(),
            fence: fence.clone(),
            board,
            language: Efforts::new(self.limits),
            authority: self.authority,
            settling: self.silence,
            sensors: FaultMonitor::default(),
        };
        tokio::select! {
            end = poses.steer(&remote_platform) => end,
            end = velocities.steer(&remote_platform) => end,
            end = zones.enclose(&fence) => end,
            end = scans.watch(&remote_platform, &fence) => end,
            end = next.run() => end,
            end = shut_down(&own) => end,
        }
    }
}

/// Command interface of the primitive driver.
pub(super) struct Efforts(Throttle);

impl Efforts {
    /// Creates the commands to a vehicle whose full effort reaches these limits.
    pub(super) const fn new(limits: Limits) -> Self {
        Self(Throttle::new(limits))
    }
}

impl Language for Efforts {
    type Command = SetWrenchEffort;
    const URN: &'static str = primitive_driver::URN;
    const NAME: &'static str = "primitive driver";
    const PAUSE: Duration = Duration::from_millis(50);

    fn command(&mut self, now: Instant, order: Order, motion: &Motion) -> SetWrenchEffort {
        let Order::Velocity(wanted) = order else {
            return self.halt();
        };
        effort(&self.0.push(now, wanted, &motion.velocity))
    }

    fn halt(&mut self) -> SetWrenchEffort {
        self.0.reset();
        effort(&Effort {
            brake: 1.0,
            turn_brake: 1.0,
            ..Effort::default()
        })
    }
}

fn effort(effort: &Effort) -> SetWrenchEffort {
    use jaus::messages::mobility::set_wrench_effort as fields;
    SetWrenchEffort {
        propulsive_linear_effort_x: fields::PropulsiveLinearEffortX::new(100.0 * effort.forward)
            .ok(),
        propulsive_rotational_effort_z: fields::PropulsiveRotationalEffortZ::new(
            100.0 * effort.turn,
        )
        .ok(),
        resistive_linear_effort_x: fields::ResistiveLinearEffortX::new(100.0 * effort.brake).ok(),
        resistive_rotational_effort_z: fields::ResistiveRotationalEffortZ::new(
            100.0 * effort.turn_brake,
        )
        .ok(),
        ..SetWrenchEffort::default()
    }
}
