//! A simulated skid-steer vehicle, steered by different speeds of its left and right wheels.

use std::time::{Duration, Instant};

use super::noise::Noise;
use super::{
    Acceleration, CommandDeadline, Drive, Effort, Limits, Motion, Platform, Pose, Velocity, wrap,
};

/// Parameters of a simulated vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkidSteerConfig {
    /// Limits of the vehicle.
    pub limits: Limits,
    /// Wheel slip: standard deviation of the velocity as a fraction of the velocity. 0 disables
    /// slip.
    pub noise: f64,
    /// Seed of the noise. The same seed and the same commands give the same course.
    pub seed: u64,
}

impl Default for SkidSteerConfig {
    fn default() -> Self {
        Self {
            limits: Limits::default(),
            noise: 0.0,
            seed: 1,
        }
    }
}

/// A simulated skid-steer platform on flat ground.
///
/// It is integrated in steps of at most [`STEP`](Self::STEP), and stops on its own 200 ms after its
/// last command ([`CommandDeadline::DEFAULT`]). Speed and yaw rate follow the command within the
/// limits. Full effort converges to full speed, because drag grows with speed.
#[derive(Debug, Clone)]
pub struct SkidSteer {
    config: SkidSteerConfig,
    /// The limits in force, at most those of the configuration.
    limits: Limits,
    command: Drive,
    deadline: CommandDeadline,
    motion: Motion,
    /// Speed and yaw rate of the wheels. Slip is added to give those of the vehicle.
    wheels: (f64, f64),
    slip: (f64, f64),
    noise: Noise,
    time: Option<Instant>,
}

impl SkidSteer {
    /// The longest step of the integration.
    pub const STEP: Duration = Duration::from_millis(10);
    /// The longest time simulated in one call: several times the usual call interval.
    pub const LONGEST_GAP: Duration = Duration::from_millis(100);
    /// Decay rate of slip, per second.
    const SLIP_CHANGE: f64 = 2.0;

    /// Creates a vehicle at rest at the origin of its local frame.
    #[must_use]
    pub fn new(config: SkidSteerConfig) -> Self {
        Self {
            config,
            limits: config.limits,
            command: Drive::Stop,
            deadline: CommandDeadline::new(CommandDeadline::DEFAULT),
            motion: Motion::default(),
            wheels: (0.0, 0.0),
            slip: (0.0, 0.0),
            noise: Noise::new(config.seed),
            time: None,
        }
    }

    fn step(&mut self, seconds: f64) {
        let limits = &self.limits;
        let (speed, turn) = self.wheels;
        let (speed, turn) = match self.command {
            Drive::Stop => (
                // Stopping uses the platform's full braking, even if a client has narrowed the
                // limits.
                approach(speed, 0.0, self.config.limits.deceleration * seconds),
                approach(turn, 0.0, self.config.limits.yaw_acceleration * seconds),
            ),
            Drive::Velocity(wanted) => {
                let wanted = limits.clamp(wanted);
                (
                    self.towards(speed, wanted.x, seconds),
                    approach(turn, wanted.yaw, limits.yaw_acceleration * seconds),
                )
            }
            Drive::Effort(effort) => self.push(effort, seconds),
        };
        self.wheels = (speed, turn);
        self.let_slip(seconds);
        self.integrate(seconds);
    }

    /// Moves a speed towards the commanded one. Deceleration has its own limit.
    fn towards(&self, speed: f64, wanted: f64, seconds: f64) -> f64 {
        let limits = &self.limits;
        let slows = wanted.abs() < speed.abs() || wanted * speed < 0.0;
        let (goal, rate) = if slows {
            let goal = if wanted * speed < 0.0 { 0.0 } else { wanted };
            (goal, limits.deceleration)
        } else {
            (wanted, limits.acceleration)
        };
        approach(speed, goal, rate * seconds)
    }

    /// Speed and yaw rate after a time step under effort, drag and brakes.
    fn push(&self, effort: Effort, seconds: f64) -> (f64, f64) {
        let limits = &self.limits;
        let (speed, turn) = self.wheels;
        let top = if speed < 0.0 {
            limits.reverse
        } else {
            limits.speed
        };
        // Narrowed limits may be 0.
        let (top, fastest) = (top.max(LEAST), limits.yaw_rate.max(LEAST));
        let drive = limits.acceleration * (effort.forward.clamp(-1.0, 1.0) - speed / top);
        let twist = limits.yaw_acceleration * (effort.turn.clamp(-1.0, 1.0) - turn / fastest);
        let brake = limits.deceleration * effort.brake.clamp(0.0, 1.0);
        let turn_brake = limits.yaw_acceleration * effort.turn_brake.clamp(0.0, 1.0);
        let pushed = limits.clamp(Velocity::forward(
            approach(speed + drive * seconds, 0.0, brake * seconds),
            approach(turn + twist * seconds, 0.0, turn_brake * seconds),
        ));
        // Tyre grip limits the combined effect of drag and brakes.
        (
            approach(speed, pushed.x, limits.deceleration * seconds),
            approach(turn, pushed.yaw, limits.yaw_acceleration * seconds),
        )
    }

    /// Slip drifts around 0 without jumps.
    fn let_slip(&mut self, seconds: f64) {
        if self.config.noise == 0.0 {
            return;
        }
        let keep = (-Self::SLIP_CHANGE * seconds).exp();
        let spread = self.config.noise * (1.0 - keep * keep).sqrt();
        self.slip.0 = self.slip.0 * keep + spread * self.noise.normal();
        self.slip.1 = self.slip.1 * keep + spread * self.noise.normal();
    }

    fn integrate(&mut self, seconds: f64) {
        // Not the narrowed limits: a moving vehicle only approaches them gradually.
        let limits = &self.config.limits;
        let before = self.motion.velocity;
        let (speed, turn) = self.wheels;
        let velocity = limits.clamp(Velocity::forward(
            speed * (1.0 + self.slip.0),
            turn * (1.0 + self.slip.1),
        ));
        let pose = &mut self.motion.pose;
        // Midpoint approximation of the arc, accurate enough within one step.
        let heading = pose.yaw + velocity.yaw * seconds / 2.0;
        pose.x += velocity.x * heading.cos() * seconds;
        pose.y += velocity.x * heading.sin() * seconds;
        pose.yaw = wrap(pose.yaw + velocity.yaw * seconds);
        self.motion.velocity = velocity;
        self.motion.acceleration = Acceleration {
            x: (velocity.x - before.x) / seconds,
            // Lateral acceleration in a curve.
            y: velocity.x * velocity.yaw,
            yaw: (velocity.yaw - before.yaw) / seconds,
            ..Acceleration::default()
        };
    }
}

impl Platform for SkidSteer {
    fn handle_time(&mut self, now: Instant) {
        let since = now.saturating_duration_since(self.time.unwrap_or(now));
        self.time = Some(self.time.map_or(now, |time| time.max(now)));
        self.motion.sampled_at = self.time;
        if self.deadline.has_passed(now) {
            self.command = Drive::Stop;
        }
        let mut left = since.min(Self::LONGEST_GAP);
        while !left.is_zero() {
            let step = left.min(Self::STEP);
            self.step(step.as_secs_f64());
            left -= step;
        }
    }

    fn motion(&self) -> Motion {
        self.motion
    }

    fn set_pose(&mut self, pose: Pose) {
        self.motion.pose = Pose {
            yaw: wrap(pose.yaw),
            ..pose
        };
    }

    fn drive(&mut self, command: Drive) {
        self.command = command.or_stop();
        self.deadline.restart(self.time);
    }

    fn limits(&self) -> Limits {
        self.config.limits
    }

    fn set_limits(&mut self, limits: Limits) {
        self.limits = limits.and(&self.config.limits);
    }
}

/// A minimal speed that avoids division by zero.
const LEAST: f64 = 1e-6;

/// Moves a value towards a goal by at most `most`.
fn approach(value: f64, goal: f64, most: f64) -> f64 {
    value + (goal - value).clamp(-most, most)
}
