//! The stick of manual drive of one vehicle: its position, and the dead-man rule that stops the
//! vehicle when pushes cease.

use std::time::{Duration, Instant};

use jaus::codec::OutOfRange;
use jaus::messages::mobility::SetWrenchEffort;

/// Stick position, each axis from -1 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Push {
    forward: f64,
    turn: f64,
}

/// The stick of one vehicle.
#[derive(Debug, Default)]
pub struct Stick {
    phase: Phase,
    /// Whether the driving page fell silent and no page has driven since.
    fell_silent: bool,
}

#[derive(Debug, Default)]
enum Phase {
    /// No page drives, and the vehicle has confirmed it.
    #[default]
    Rest,
    /// A page drives, until its next push is due.
    Driven { push: Push, until: Instant },
    /// No page drives any more, and the vehicle is being stopped.
    Stopping { since: Instant },
}

impl Push {
    /// A released stick.
    pub const NONE: Self = Self {
        forward: 0.0,
        turn: 0.0,
    };

    /// Creates a push. Forward and right are positive; `None` if a value is outside -1 to 1.
    #[must_use]
    pub fn new(forward: f64, turn: f64) -> Option<Self> {
        let possible = |share: f64| (-1.0..=1.0).contains(&share);
        (possible(forward) && possible(turn)).then_some(Self { forward, turn })
    }

    /// Forward, from -1 to 1.
    #[must_use]
    pub const fn forward(self) -> f64 {
        self.forward
    }

    /// Right, clockwise from above, from -1 to 1.
    #[must_use]
    pub const fn turn(self) -> f64 {
        self.turn
    }

    /// The command to a primitive driver. A released stick brakes, because a vehicle without
    /// effort may roll on.
    ///
    /// # Errors
    /// None for a valid push: every field takes -100 to 100 %.
    pub fn effort(self) -> Result<SetWrenchEffort, OutOfRange> {
        let brake = if self == Self::NONE { 100.0 } else { 0.0 };
        let mut effort = SetWrenchEffort::default();
        effort.set_propulsive_linear_effort_x_percent(100.0 * self.forward)?;
        effort.set_propulsive_rotational_effort_z_percent(100.0 * self.turn)?;
        effort.set_resistive_linear_effort_x_percent(brake)?;
        effort.set_resistive_rotational_effort_z_percent(brake)?;
        Ok(effort)
    }
}

impl Stick {
    /// Dead-man timeout: without a push for this time, the vehicle stops. It runs from the operator's
    /// hand: what a push waits on its way to the station is part of it.
    pub const DEAD_MAN: Duration = Duration::from_millis(250);
    /// The page lets go of a hand that gives no sign. By so much its release may be later than the push before.
    const JITTER: Duration = Duration::from_millis(25);
    /// Maximum time to repeat the stop command without an acknowledgement. By then the vehicle's
    /// own timeout has stopped it.
    pub const STOPPING: Duration = Duration::from_secs(3);

    /// Handles a push that has waited for `waited` on its way. When it was sent, the operator's hand counted for
    /// `hand` without another sign. One that has waited for longer than that or than
    /// [`DEAD_MAN`](Self::DEAD_MAN) has no effect.
    pub fn handle_push(&mut self, now: Instant, waited: Duration, hand: Duration, push: Push) {
        self.handle_time(now);
        let counts = Self::DEAD_MAN.min(hand.saturating_add(Self::JITTER));
        let left = counts.saturating_sub(waited);
        if left.is_zero() {
            return;
        }
        self.phase = Phase::Driven {
            push,
            until: now + left,
        };
        self.fell_silent = false;
    }

    /// Releases the stick.
    pub fn stop(&mut self, now: Instant) {
        if matches!(self.phase, Phase::Driven { .. }) {
            self.phase = Phase::Stopping { since: now };
        }
    }

    /// Handles the vehicle's acknowledgement of the stop.
    pub fn handle_stopped(&mut self) {
        if matches!(self.phase, Phase::Stopping { .. }) {
            self.phase = Phase::Rest;
        }
    }

    /// Applies the timeouts: releases a stick without pushes.
    pub fn handle_time(&mut self, now: Instant) {
        match self.phase {
            Phase::Driven { until, .. } if now >= until => {
                self.stop(now);
                self.fell_silent = true;
            }
            Phase::Stopping { since } if now >= since + Self::STOPPING => self.phase = Phase::Rest,
            _ => {}
        }
    }

    /// The setpoint to send now; `None` at rest.
    #[must_use]
    pub fn poll_push(&mut self, now: Instant) -> Option<Push> {
        self.handle_time(now);
        match self.phase {
            Phase::Rest => None,
            Phase::Driven { push, .. } => Some(push),
            Phase::Stopping { .. } => Some(Push::NONE),
        }
    }

    /// Forgets that the page fell silent: its operator is gone.
    pub const fn forget_silence(&mut self) {
        self.fell_silent = false;
    }

    /// Whether driving ended because the page fell silent.
    #[must_use]
    pub const fn fell_silent(&self) -> bool {
        self.fell_silent
    }

    /// The current push, if a page drives.
    #[must_use]
    pub const fn driven(&self) -> Option<Push> {
        match self.phase {
            Phase::Driven { push, .. } => Some(push),
            Phase::Rest | Phase::Stopping { .. } => None,
        }
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    const AT_ONCE: Duration = Duration::ZERO;
    const HELD: Duration = Duration::MAX;

    fn ahead() -> Push {
        Push::new(0.5, 0.0).unwrap()
    }

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn what_is_pushed_holds_until_250_ms_of_silence_and_then_the_vehicle_is_stopped() {
        let start = Instant::now();
        let mut stick = Stick::default();
        stick.handle_push(start, AT_ONCE, HELD, ahead());
        assert_eq!(stick.poll_push(start + ms(249)), Some(ahead()));
        assert!(!stick.fell_silent());
        assert_eq!(stick.poll_push(start + ms(250)), Some(Push::NONE));
        assert_eq!(stick.driven(), None);
        assert!(stick.fell_silent());
        stick.handle_push(start + ms(400), AT_ONCE, HELD, ahead());
        stick.stop(start + ms(500));
        assert!(!stick.fell_silent(), "it was let go");
        stick.handle_push(start + ms(600), AT_ONCE, HELD, ahead());
        stick.handle_time(start + ms(900));
        stick.forget_silence();
        assert!(!stick.fell_silent(), "the next operator did not");
    }

    #[test]
    fn the_time_that_a_push_waits_on_its_way_is_part_of_the_silence() {
        let start = Instant::now();
        let mut stick = Stick::default();
        stick.handle_push(start, ms(200), HELD, ahead());
        assert_eq!(stick.poll_push(start + ms(49)), Some(ahead()));
        assert_eq!(stick.poll_push(start + ms(50)), Some(Push::NONE));
        stick.handle_push(start + ms(60), ms(250), HELD, ahead());
        assert_eq!(stick.poll_push(start + ms(60)), Some(Push::NONE));
    }

    #[test]
    fn a_push_holds_no_longer_than_the_hand_counts_that_gives_no_sign_any_more() {
        let start = Instant::now();
        let mut stick = Stick::default();
        stick.handle_push(start, AT_ONCE, ms(100), ahead());
        assert_eq!(stick.poll_push(start + ms(124)), Some(ahead()));
        assert_eq!(stick.poll_push(start + ms(125)), Some(Push::NONE));
        assert!(stick.fell_silent());
        stick.handle_push(start + ms(200), ms(100), ms(85), ahead());
        assert_eq!(stick.poll_push(start + ms(209)), Some(ahead()));
        assert_eq!(stick.poll_push(start + ms(210)), Some(Push::NONE));
        stick.handle_push(start + ms(300), ms(100), ms(75), ahead());
        assert_eq!(stick.poll_push(start + ms(300)), Some(Push::NONE));
    }

    #[test]
    fn every_push_starts_the_time_of_silence_anew() {
        let start = Instant::now();
        let mut stick = Stick::default();
        for step in 0..50 {
            let now = start + ms(100 * step);
            stick.handle_push(now, AT_ONCE, HELD, ahead());
            assert_eq!(stick.poll_push(now + ms(99)), Some(ahead()));
        }
    }

    #[test]
    fn the_vehicle_is_told_to_stop_until_it_acknowledges_that() {
        let start = Instant::now();
        let mut stick = Stick::default();
        stick.handle_push(start, AT_ONCE, HELD, ahead());
        stick.stop(start + ms(10));
        assert_eq!(stick.poll_push(start + ms(20)), Some(Push::NONE));
        assert_eq!(stick.poll_push(start + ms(2000)), Some(Push::NONE));
        stick.handle_stopped();
        assert_eq!(stick.poll_push(start + ms(2050)), None);
    }

    #[test]
    fn a_vehicle_that_never_acknowledges_is_left_to_its_own_rule() {
        let start = Instant::now();
        let mut stick = Stick::default();
        stick.handle_push(start, AT_ONCE, HELD, ahead());
        stick.stop(start);
        assert_eq!(
            stick.poll_push(start + Stick::STOPPING - ms(1)),
            Some(Push::NONE)
        );
        assert_eq!(stick.poll_push(start + Stick::STOPPING), None);
    }

    #[test]
    fn a_late_acknowledgement_of_a_stop_does_not_stop_who_drives_again() {
        let start = Instant::now();
        let mut stick = Stick::default();
        stick.handle_push(start, AT_ONCE, HELD, ahead());
        stick.stop(start);
        stick.handle_push(start + ms(10), AT_ONCE, HELD, ahead());
        stick.handle_stopped();
        assert_eq!(stick.poll_push(start + ms(20)), Some(ahead()));
    }

    #[test]
    fn a_stick_is_pushed_no_further_than_it_goes() {
        for (forward, turn) in [
            (1.01, 0.0),
            (0.0, -1.01),
            (f64::NAN, 0.0),
            (0.0, f64::INFINITY),
        ] {
            assert_eq!(Push::new(forward, turn), None, "{forward} {turn}");
        }
        assert!(Push::new(1.0, -1.0).is_some());
    }
}
