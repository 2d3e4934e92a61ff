//! Velocity control by effort: feed-forward plus proportional feedback. Wheels that are steered need
//! no feedback: their angle sets the curvature.

use std::time::{Duration, Instant};

use super::{Effort, Limits, Velocity};

/// Controls the velocity of a vehicle through efforts: feed-forward of the effort that sustains the
/// velocity, plus feedback proportional to the error. The setpoint is ramped within the limits.
#[derive(Debug, Clone)]
pub struct Throttle {
    limits: Limits,
    ramp: Option<(Instant, Velocity)>,
}

impl Throttle {
    /// Feedback gain, relative to the effort that sustains the missing velocity.
    const GAIN: f64 = 0.6;
    /// The longest time that the ramp catches up in one call.
    const LONGEST_STEP: Duration = Duration::from_millis(200);

    /// Creates a controller for a vehicle whose full effort reaches the speed and yaw rate of its
    /// limits.
    #[must_use]
    pub const fn new(limits: Limits) -> Self {
        Self { limits, ramp: None }
    }

    /// Restarts the ramp from the next measured velocity.
    pub const fn reset(&mut self) {
        self.ramp = None;
    }

    /// The effort at `now` for a requested and a measured velocity.
    pub fn push(&mut self, now: Instant, wanted: Velocity, measured: &Velocity) -> Effort {
        let limits = self.limits;
        let wanted = limits.clamp(wanted);
        let (before, last) = self.ramp.unwrap_or((now, *measured));
        let step = now
            .saturating_duration_since(before)
            .min(Self::LONGEST_STEP);
        let seconds = step.as_secs_f64();
        let slows = wanted.x.abs() < last.x.abs() || wanted.x * last.x < 0.0;
        let rate = if slows {
            limits.deceleration
        } else {
            limits.acceleration
        };
        let ramped = Velocity::forward(
            approach(last.x, wanted.x, rate * seconds),
            approach(last.yaw, wanted.yaw, limits.yaw_acceleration * seconds),
        );
        self.ramp = Some((now, ramped));
        Effort {
            forward: share(ramped.x, measured.x, limits.speed, limits.reverse),
            turn: match limits.turns_on_the_spot() {
                true => share(ramped.yaw, measured.yaw, limits.yaw_rate, limits.yaw_rate),
                false => curvature(&wanted) * limits.turning_radius,
            },
            ..Effort::default()
        }
    }
}

/// Curvature of a velocity in radians per metre, right positive; 0 without speed.
fn curvature(velocity: &Velocity) -> f64 {
    if velocity.x == 0.0 {
        0.0
    } else {
        velocity.yaw / velocity.x
    }
}

/// The fraction of full effort for a requested and a measured speed. Full effort reaches different
/// speeds forward and backward.
fn share(wanted: f64, measured: f64, ahead: f64, back: f64) -> f64 {
    let missing = wanted - measured;
    let pushed = wanted + Throttle::GAIN * missing;
    let full = if pushed < 0.0 { back } else { ahead };
    let effort = pushed / full.max(f64::MIN_POSITIVE);
    // NaN produces no effort.
    if effort.is_nan() {
        0.0
    } else {
        effort.clamp(-1.0, 1.0)
    }
}

/// Moves a value towards a goal by at most `most`.
fn approach(value: f64, goal: f64, most: f64) -> f64 {
    value + (goal - value).clamp(-most, most)
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;
    use crate::motion::{Drive, Platform, SkidSteer, SkidSteerConfig};

    /// Drives for `seconds` on measurements that are 0.1 s old.
    fn drive(wanted: Velocity, strength: f64, seconds: f64) -> Velocity {
        let mut rover = SkidSteer::new(SkidSteerConfig::default());
        let mut throttle = Throttle::new(Limits::default());
        let mut now = Instant::now();
        let mut measured = vec![Velocity::default(); 3];
        for _ in 0..(seconds * 20.0) as u32 {
            let late = measured.remove(0);
            let mut effort = throttle.push(now, wanted, &late);
            effort.forward *= strength;
            rover.drive(Drive::Effort(effort));
            now += Duration::from_millis(50);
            rover.handle_time(now);
            measured.push(rover.motion().velocity);
        }
        rover.motion().velocity
    }

    #[test]
    fn a_velocity_is_reached_and_kept() {
        let velocity = drive(Velocity::forward(1.0, 0.5), 1.0, 10.0);
        assert!((velocity.x - 1.0).abs() < 0.05, "{velocity:?}");
        assert!((velocity.yaw - 0.5).abs() < 0.05, "{velocity:?}");
    }

    #[test]
    fn a_weak_motor_is_driven_harder() {
        // Feed-forward alone would reach 0.7 m/s.
        let velocity = drive(Velocity::forward(1.0, 0.0), 0.7, 10.0);
        assert!(velocity.x > 0.75, "{velocity:?}");
    }

    #[test]
    fn what_is_wanted_comes_no_faster_than_the_limits_allow() {
        let mut throttle = Throttle::new(Limits::default());
        let now = Instant::now();
        let wanted = Velocity::forward(2.0, 0.0);
        assert_eq!(
            throttle.push(now, wanted, &Velocity::default()).forward,
            0.0
        );
        let soon = now + Duration::from_millis(100);
        let effort = throttle.push(soon, wanted, &Velocity::default());
        assert!((effort.forward - 0.08).abs() < 1e-9, "{effort:?}");
    }

    #[test]
    fn what_is_not_known_pushes_nothing() {
        let mut throttle = Throttle::new(Limits::default());
        let unknown = Velocity::forward(f64::NAN, 0.0);
        let effort = throttle.push(Instant::now(), Velocity::forward(1.0, 0.0), &unknown);
        assert_eq!(effort.forward, 0.0);
    }
}
