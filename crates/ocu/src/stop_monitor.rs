//! Whether a vehicle is at rest, and whether it slows down in an emergency. Both come from the
//! measured velocity alone: a reported state says what a component intends, not what the motor does.

use std::time::{Duration, Instant};

use super::state::Velocity;

/// Follows the measured speed of a vehicle.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StopMonitor {
    /// Lowest speed in the present emergency in metres per second, and when it was measured.
    slowest: Option<(f64, Instant)>,
    is_runaway: bool,
}

impl StopMonitor {
    /// A vehicle is at rest below this speed, in metres per second. Odometry of a vehicle at rest is
    /// noisier than zero.
    const REST: f64 = 0.05;
    /// A vehicle in emergency moves above this speed, in metres per second.
    const MOVES: f64 = 0.1;
    /// A vehicle that brakes becomes slower by this much, in metres per second, …
    const PROGRESS: f64 = 0.05;
    /// … within this time.
    const PATIENCE: Duration = Duration::from_secs(1);
    /// Distance from the middle of the vehicle, in metres, at which turning counts as speed.
    const ARM: f64 = 0.5;

    /// Whether a vehicle with this velocity is at rest; `None` if its speed is unknown.
    pub(super) fn at_rest(velocity: &Velocity) -> Option<bool> {
        Some(speed(velocity)? < Self::REST)
    }

    /// Handles a measurement of a vehicle that is in emergency or not.
    pub(super) fn handle_velocity(&mut self, now: Instant, velocity: &Velocity, emergency: bool) {
        let Some(speed) = speed(velocity).filter(|_| emergency) else {
            *self = Self::default();
            return;
        };
        let is_slower = self
            .slowest
            .is_none_or(|(slowest, _)| speed < slowest - Self::PROGRESS);
        if is_slower || speed < Self::MOVES {
            self.slowest = Some((speed, now));
        }
        let since = self.slowest.map_or(now, |(_, at)| at);
        let is_stuck = now.saturating_duration_since(since) >= Self::PATIENCE;
        // Latched until it is at rest: a runaway that slows down on a slope is still one.
        self.is_runaway = speed >= Self::REST && (self.is_runaway || is_stuck);
    }

    /// Whether the vehicle moves in an emergency and does not brake.
    pub(super) const fn is_runaway(&self) -> bool {
        self.is_runaway
    }
}

/// The fastest motion of the vehicle's outline, in metres per second.
pub(super) fn speed(velocity: &Velocity) -> Option<f64> {
    let turning = velocity.yaw_rate.unwrap_or(0.0).abs() * StopMonitor::ARM;
    velocity.x.map(|x| x.abs().max(turning))
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    fn at(x: f64) -> Velocity {
        Velocity {
            x: Some(x),
            yaw_rate: Some(0.0),
            age_ms: 0,
        }
    }

    /// Whether these speeds, measured every 0.1 s of an emergency, end in a runaway.
    fn runs_away(speeds: impl IntoIterator<Item = f64>) -> bool {
        let mut monitor = StopMonitor::default();
        let mut now = Instant::now();
        for speed in speeds {
            monitor.handle_velocity(now, &at(speed), true);
            now += Duration::from_millis(100);
        }
        monitor.is_runaway()
    }

    #[test]
    fn a_vehicle_is_at_rest_only_if_it_neither_moves_nor_turns() {
        assert_eq!(StopMonitor::at_rest(&at(0.0)), Some(true));
        assert_eq!(StopMonitor::at_rest(&at(-0.2)), Some(false));
        let turning = Velocity {
            yaw_rate: Some(-0.5),
            ..at(0.0)
        };
        assert_eq!(StopMonitor::at_rest(&turning), Some(false));
        let unknown = Velocity { x: None, ..at(0.0) };
        assert_eq!(StopMonitor::at_rest(&unknown), None);
    }

    #[test]
    fn a_vehicle_that_brakes_slowly_does_not_run_away_and_one_that_keeps_its_speed_does() {
        let braking = (0..40).map(|step| (2.0 - 0.06 * f64::from(step)).max(0.0));
        assert!(!runs_away(braking));
        assert!(runs_away((0..12).map(|_| 1.7)));
        assert!(!runs_away((0..9).map(|_| 1.7)), "it may still react");
        assert!(runs_away((0..12).map(|_| -0.3)), "backwards");
        let rolls_off = (0..30).map(|step| if step < 10 { 0.0 } else { 0.4 });
        assert!(runs_away(rolls_off));
    }

    #[test]
    fn a_runaway_is_over_when_it_is_at_rest_or_the_emergency_is_cleared() {
        let rests = (0..20).map(|step| if step < 19 { 1.0 } else { 0.0 });
        assert!(!runs_away(rests));
        let slows = (0..20).map(|step| if step < 15 { 1.0 } else { 0.6 });
        assert!(runs_away(slows));
        let mut monitor = StopMonitor::default();
        let now = Instant::now();
        monitor.handle_velocity(now, &at(1.0), true);
        monitor.handle_velocity(now + Duration::from_secs(2), &at(1.0), true);
        assert!(monitor.is_runaway());
        monitor.handle_velocity(now + Duration::from_secs(3), &at(1.0), false);
        assert!(!monitor.is_runaway());
    }
}
