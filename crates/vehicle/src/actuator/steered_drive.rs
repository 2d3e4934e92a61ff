//! One drive and steered front wheels, as in a car.

use std::time::Instant;

use super::motion_monitor::MonitoredDrive;
use super::{Actuator, Command, Drivetrain, Steering, WheelsConfig};
use crate::motion::{Ackermann, Effort, Limits, Velocity};

/// The drive of the rear axle, and the steering of the front axle.
#[derive(Debug)]
pub struct SteeredDrive<A, S> {
    drive: MonitoredDrive<A>,
    steering: S,
    geometry: Ackermann,
    /// Distance between left and right wheels in metres.
    track: f64,
    /// Speed of the drive at full propulsion, in metres per second.
    top: f64,
    /// Travel of the drive at the last reading, in metres.
    driven: f64,
    /// Travel of the left and the right rear wheel, in metres.
    travel: (f64, f64),
}

impl<A: Actuator, S: Steering> SteeredDrive<A, S> {
    pub(super) const fn new(
        drive: A,
        steering: S,
        config: &WheelsConfig,
        geometry: Ackermann,
    ) -> Self {
        Self {
            drive: MonitoredDrive::new(drive, "drive", config.top),
            steering,
            geometry,
            track: config.track,
            top: config.top,
            driven: 0.0,
            travel: (0.0, 0.0),
        }
    }

    /// Drives at a speed in metres per second along a curvature in radians per metre.
    fn drive_at(&mut self, speed: f64, curvature: f64, brake: f64) {
        self.steering.steer(self.geometry.angle(curvature));
        self.drive.command(Command {
            drive: (speed / self.top).clamp(-1.0, 1.0),
            brake,
        });
    }
}

impl<A: Actuator, S: Steering> Drivetrain for SteeredDrive<A, S> {
    /// The rear wheels' travel follows from that of the drive and the steering angle.
    fn handle_time(&mut self, now: Instant) {
        self.drive.handle_time(now);
        self.steering.handle_time(now);
        let driven = self.drive.travel();
        let way = driven - std::mem::replace(&mut self.driven, driven);
        let curvature = self.geometry.curvature(self.steering.angle());
        let lead = way * curvature * self.track / 2.0;
        self.travel.0 += way + lead;
        self.travel.1 += way - lead;
    }

    /// Without speed, the wheels keep their angle.
    fn drive(&mut self, velocity: Velocity) {
        if velocity.x == 0.0 {
            return self.stop();
        }
        self.drive_at(velocity.x, velocity.yaw / velocity.x, 0.0);
    }

    fn push(&mut self, effort: Effort, limits: &Limits) {
        let curvature = effort.turn.clamp(-1.0, 1.0) / limits.turning_radius;
        self.drive_at(limits.speed_at(effort.forward), curvature, effort.brake);
    }

    fn stop(&mut self) {
        self.drive.command(Command::STOP);
    }

    fn travel(&self) -> (f64, f64) {
        self.travel
    }

    fn fault(&self) -> Option<String> {
        self.drive.fault().or_else(|| self.steering.fault())
    }
}
