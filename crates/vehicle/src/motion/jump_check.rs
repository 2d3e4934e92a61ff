//! Jumps of a pose: changes that no motion of the vehicle explains.

use std::fmt;
use std::time::{Duration, Instant};

use super::{Limits, Pose, wrap};

/// Compares each pose with the previous one, and with one up to a second old, so that many small
/// steps are found as well.
#[derive(Debug, Clone)]
pub(crate) struct JumpCheck {
    /// Greatest speed in metres per second, and yaw rate in radians per second.
    rates: (f64, f64),
    /// Errors of the pose that are no jump, in metres and radians.
    noise: (f64, f64),
    last: Option<(Instant, Pose)>,
    anchor: Option<(Instant, Pose)>,
}

/// A change that no motion explains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Jump {
    /// Distance in metres.
    metres: f64,
    /// Turn in radians, not negative.
    radians: f64,
}

impl Jump {
    /// The change from one pose to another, unless it is within these errors in metres and radians.
    pub(crate) fn between(before: &Pose, after: &Pose, noise: (f64, f64)) -> Option<Self> {
        let jump = Self {
            metres: before.distance(after.x, after.y),
            radians: wrap(after.yaw - before.yaw).abs(),
        };
        (jump.metres > noise.0 || jump.radians > noise.1).then_some(jump)
    }
}

impl JumpCheck {
    /// Error of a pose by dead reckoning that is no jump, in metres and radians.
    pub(crate) const RECKONED: (f64, f64) = (0.3, 0.35);
    /// Slip, noise of the time stamps, and limits that were set too low must not count as jumps.
    const RESERVE: f64 = 2.0;
    /// Age from which a pose is replaced as the anchor.
    const WINDOW: Duration = Duration::from_secs(1);
    /// Longest time for which motion is assumed: a vehicle without a pose has stopped by then.
    const LONGEST: f64 = 2.0;

    /// A check for a vehicle with these limits and a sensor with these errors in metres and radians.
    pub(crate) const fn new(limits: &Limits, noise: (f64, f64)) -> Self {
        Self {
            rates: (limits.speed.max(limits.reverse), limits.yaw_rate),
            noise,
            last: None,
            anchor: None,
        }
    }

    /// Sets the errors that are no jump, in metres and radians.
    pub(crate) const fn set_noise(&mut self, noise: (f64, f64)) {
        self.noise = noise;
    }

    /// Forgets earlier poses: the next one cannot be a jump.
    pub(crate) const fn forget(&mut self) {
        (self.last, self.anchor) = (None, None);
    }

    /// Handles a pose sampled at `at`. Returns the jump that led to it, if there was one. Whether it
    /// counts is up to the caller: the next pose is compared with this one.
    pub(crate) fn handle_pose(&mut self, at: Instant, pose: &Pose) -> Option<Jump> {
        if ![pose.x, pose.y, pose.yaw].iter().all(|it| it.is_finite()) {
            // The next known pose is compared with the last known one.
            return None;
        }
        let before = [self.last, self.anchor].into_iter().flatten();
        let jump = before
            .filter_map(|(since, before)| {
                let seconds = at.saturating_duration_since(since).as_secs_f64();
                self.jump(&before, pose, seconds.min(Self::LONGEST))
            })
            .next();
        self.last = Some((at, *pose));
        let is_due = |(since, _)| at.saturating_duration_since(since) >= Self::WINDOW;
        if jump.is_some() || self.anchor.is_none_or(is_due) {
            self.anchor = self.last;
        }
        jump
    }

    fn jump(&self, before: &Pose, pose: &Pose, seconds: f64) -> Option<Jump> {
        let reach = |rate: f64, noise: f64| noise + Self::RESERVE * rate * seconds;
        let reach = (
            reach(self.rates.0, self.noise.0),
            reach(self.rates.1, self.noise.1),
        );
        Jump::between(before, pose, reach)
    }
}

impl fmt::Display for Jump {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (metres, degrees) = (self.metres, self.radians.to_degrees());
        write!(f, "the pose jumped by {metres:.1} m and {degrees:.0}°")
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_millis(40);

    fn check() -> JumpCheck {
        JumpCheck::new(&Limits::default(), JumpCheck::RECKONED)
    }

    fn turned(x: f64, yaw: f64) -> Pose {
        Pose {
            yaw,
            ..Pose::at(x, 0.0)
        }
    }

    #[test]
    fn motion_at_full_speed_with_gaps_and_slip_is_no_jump() {
        let (mut check, mut at, mut x) = (check(), Instant::now(), 0.0);
        for step in 0..500_u32 {
            // Every tenth report comes half a second late, and one sample has slipped by 0.2 m.
            let gap = if step % 10 == 0 { 13 } else { 1 };
            at += PERIOD * gap;
            x += 2.0 * (PERIOD * gap).as_secs_f64();
            let slip = if step % 7 == 0 { 0.2 } else { 0.0 };
            let yaw = wrap(1.5 * x / 2.0);
            assert_eq!(check.handle_pose(at, &turned(x + slip, yaw)), None);
        }
    }

    #[test]
    fn a_change_beyond_the_limits_is_a_jump_once() {
        for to in [turned(0.6, 0.0), turned(0.0, 1.0), turned(-3.0, -3.0)] {
            let (mut check, at) = (check(), Instant::now());
            assert_eq!(check.handle_pose(at, &turned(0.0, 0.0)), None);
            assert!(check.handle_pose(at + PERIOD, &to).is_some(), "{to:?}");
            assert_eq!(check.handle_pose(at + 2 * PERIOD, &to), None);
        }
    }

    #[test]
    fn many_small_steps_are_a_jump_too() {
        let (mut check, at) = (check(), Instant::now());
        let steps = (0..25_u32).filter_map(|step| {
            let pose = turned(0.4 * f64::from(step), 0.0);
            check.handle_pose(at + PERIOD * step, &pose)
        });
        let jump = steps.last().unwrap();
        assert!(jump.metres > 0.7, "{jump}");
    }

    #[test]
    fn a_pose_that_is_unknown_in_between_hides_no_jump() {
        let (mut check, at) = (check(), Instant::now());
        check.handle_pose(at, &turned(0.0, 0.0));
        assert_eq!(check.handle_pose(at + PERIOD, &Pose::UNKNOWN), None);
        let jump = check.handle_pose(at + 2 * PERIOD, &turned(3.0, 0.0));
        assert!(jump.is_some());
    }

    #[test]
    fn an_outage_explains_no_more_than_two_seconds_of_motion() {
        let (mut check, at) = (check(), Instant::now());
        check.handle_pose(at, &turned(0.0, 0.0));
        let later = at + Duration::from_secs(60);
        let jump = check.handle_pose(later, &turned(9.0, 0.0)).unwrap();
        assert_eq!(jump.to_string(), "the pose jumped by 9.0 m and 0°");
    }
}
