//! A drive on each side: the vehicle is steered by their speed difference.

use std::time::Instant;

use super::motion_monitor::MonitoredDrive;
use super::{Actuator, Command, Drivetrain, WheelsConfig};
use crate::motion::{Effort, Limits, Velocity};

/// The drives of the left and the right side.
#[derive(Debug)]
pub struct SideDrives<A> {
    left: MonitoredDrive<A>,
    right: MonitoredDrive<A>,
    /// Distance between left and right wheels in metres.
    track: f64,
    /// Speed of a drive at full propulsion, in metres per second.
    top: f64,
}

impl<A: Actuator> SideDrives<A> {
    pub(super) const fn new(left: A, right: A, config: &WheelsConfig) -> Self {
        Self {
            left: MonitoredDrive::new(left, "left drive", config.top),
            right: MonitoredDrive::new(right, "right drive", config.top),
            track: config.track,
            top: config.top,
        }
    }

    /// Drives both sides at speeds in metres per second. If one side exceeds its top speed, both
    /// slow down so that the curvature is preserved.
    fn drive_at(&mut self, velocity: Velocity, brake: f64) {
        let lead = velocity.yaw * self.track / 2.0;
        let sides = [velocity.x + lead, velocity.x - lead].map(|speed| speed / self.top);
        let most = sides.iter().fold(1.0_f64, |most, it| most.max(it.abs()));
        let [left, right] = sides.map(|share| Command {
            drive: share / most,
            brake,
        });
        self.left.command(left);
        self.right.command(right);
    }
}

impl<A: Actuator> Drivetrain for SideDrives<A> {
    fn handle_time(&mut self, now: Instant) {
        self.left.handle_time(now);
        self.right.handle_time(now);
    }

    fn drive(&mut self, velocity: Velocity) {
        self.drive_at(velocity, 0.0);
    }

    fn push(&mut self, effort: Effort, limits: &Limits) {
        let velocity = Velocity::forward(
            limits.speed_at(effort.forward),
            effort.turn.clamp(-1.0, 1.0) * limits.yaw_rate,
        );
        self.drive_at(velocity, effort.brake.max(effort.turn_brake));
    }

    fn stop(&mut self) {
        self.left.command(Command::STOP);
        self.right.command(Command::STOP);
    }

    fn travel(&self) -> (f64, f64) {
        (self.left.travel(), self.right.travel())
    }

    fn fault(&self) -> Option<String> {
        self.left.fault().or_else(|| self.right.fault())
    }
}
