//! The global driver: holds headings and drives to waypoints on the globe by commanding the
//! primitive driver.

use std::convert::Infallible;
use std::time::Duration;

use super::drivers::{
    FaultMonitor, GlobalPoses, Next, RemotePlatform, RemotePlatformSettings, Sense, guard,
    shut_down,
};
use super::vector_driver::Efforts;
use super::{Part, PartError, Slot};
use crate::ground::StageBoard;
use crate::mobility::Vehicle;
use crate::motion::{Fence, FenceConfig, Frame, Limits, Pilot};

/// Holds a speed and a heading from true north, or drives to a waypoint on the globe, by sending
/// efforts to the primitive driver, based on the reports of the global pose sensor and the velocity
/// sensor.
///
/// It offers Global Vector Driver, Global Waypoint Driver and Stage, with Management and Access
/// Control. It finds primitive driver and sensors in its own subsystem. Operating zones are in the
/// vehicle's local frame, so while there are zones it needs the local pose sensor too.
#[derive(Debug, Clone, PartialEq)]
pub struct GlobalDriver {
    /// Limits of the vehicle. Speed and yaw rate are those of full effort.
    pub limits: Limits,
    /// Maximum age of pose and velocity. The vehicle stops when they are older.
    pub stale: Duration,
    /// Dimensions and delays by which it keeps to the operating zones.
    pub fence: FenceConfig,
    /// Greatest standard error of the position in metres. The vehicle stops when it is exceeded, and
    /// when the position jumps by more than twice this.
    pub max_rms: f64,
    /// The authority used to control the primitive driver.
    pub authority: u8,
    /// Control timeout in seconds unless the client renews control; 0 disables it.
    pub control_timeout: u8,
}

impl Default for GlobalDriver {
    fn default() -> Self {
        Self {
            limits: Limits {
                // Reduced to allow for the delay of the driver below.
                deceleration: 1.0,
                ..Limits::default()
            },
            stale: Duration::from_millis(600),
            fence: FenceConfig::default(),
            max_rms: 5.0,
            authority: 100,
            control_timeout: 3,
        }
    }
}

impl GlobalDriver {
    /// Report rate requested from the sensors, in hertz.
    const HZ: f64 = 25.0;

    /// Sets the vehicle's least turning radius in metres; 0 if it turns on the spot.
    #[must_use]
    pub const fn turning_radius(mut self, radius: f64) -> Self {
        self.limits.turning_radius = radius;
        self
    }
}

impl Part for GlobalDriver {
    async fn run(self, slot: Slot) -> Result<Infallible, PartError> {
        let remote_platform = RemotePlatform::new(RemotePlatformSettings {
            limits: self.limits,
            noise: GlobalPoses::noise(self.max_rms),
            stale: self.stale,
            needs_scan: false,
            by_heading: false,
        });
        let fence = Fence::located_elsewhere(self.fence, &self.limits);
        // The first pose determines the frame.
        let pilot = Pilot::new(remote_platform.clone(), Frame::default());
        let vehicle = Vehicle::new(pilot.with_fence(fence.clone()));
        let board = StageBoard::default();
        let component = slot
            .component("Global Driver")
            .management(guard(self.control_timeout))
            .offer(vehicle.global_vector_driver())
            .offer(vehicle.global_waypoint_driver())
            .offer(board.service())
            .live_on(slot.port)?;
        slot.telemetry.attach(&component);
        let poses = Sense::global_pose(&component, Self::HZ)?;
        let zones = Sense::zones(&component)?;
        let local_poses = Sense::pose(&component, Self::HZ)?;
        let velocities = Sense::velocity(&component, Self::HZ)?;
        let global = GlobalPoses::new(remote_platform.clone(), vehicle.clone(), self.max_rms);
        let own = component.clone();
        let next = Next {
            component,
            vehicle: vehicle.clone(),
            remote_platform: remote_platform.clone(),
            fence: fence.clone(),
            board,
            language: Efforts::new(self.limits),
            authority: self.authority,
            // A client may repeat a vector for as long as it likes.
            settling: Duration::from_secs(1),
            sensors: FaultMonitor::default(),
        };
        tokio::select! {
            end = poses.steer(global) => end,
            end = velocities.steer(&remote_platform) => end,
            end = zones.enclose(&fence) => end,
            end = local_poses.locate(&fence, &own) => end,
            end = next.run() => end,
            end = shut_down(&own) => end,
        }
    }
}
