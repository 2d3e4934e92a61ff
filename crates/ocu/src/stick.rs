//! The stick of manual drive: its holder, its position, and the dead-man rule that stops the
//! vehicle when pushes cease.

use std::time::{Duration, Instant};

use jaus::codec::OutOfRange;
use jaus::messages::mobility::SetWrenchEffort;

/// Identifies one page connection, for example the one that holds the stick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PageId(pub u64);

/// Stick position, each axis from -1 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Push {
    forward: f64,
    turn: f64,
}

/// Error: another page is driving.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("another page is driving; it must let go first")]
pub struct Busy;

/// One stick for all pages. The first page to push holds it until it releases it or falls silent.
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
    Driven {
        page: PageId,
        push: Push,
        heard: Instant,
    },
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
    /// Dead-man timeout: without a push for this time, the vehicle stops.
    pub const DEAD_MAN: Duration = Duration::from_millis(300);
    /// Maximum time to repeat the stop command without an acknowledgement. By then the vehicle's
    /// own timeout has stopped it.
    pub const STOPPING: Duration = Duration::from_secs(3);

    /// Handles a push from a page.
    ///
    /// # Errors
    /// If another page holds the stick.
    pub fn handle_push(&mut self, now: Instant, page: PageId, push: Push) -> Result<(), Busy> {
        self.handle_time(now);
        match &self.phase {
            Phase::Driven { page: holder, .. } if *holder != page => Err(Busy),
            _ => {
                self.phase = Phase::Driven {
                    page,
                    push,
                    heard: now,
                };
                self.fell_silent = false;
                Ok(())
            }
        }
    }

    /// Handles a release by a page or its disconnection. Only the holder can release the stick.
    pub fn handle_release(&mut self, now: Instant, page: PageId) {
        if matches!(self.phase, Phase::Driven { page: holder, .. } if holder == page) {
            self.stop(now);
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
            Phase::Driven { heard, .. } if now >= heard + Self::DEAD_MAN => {
                self.stop(now);
                self.fell_silent = true;
            }
            Phase::Stopping { since } if now >= since + Self::STOPPING => self.phase = Phase::Rest,
            _ => {}
        }
    }

    /// Releases the stick, whichever page holds it.
    pub fn stop(&mut self, now: Instant) {
        if matches!(self.phase, Phase::Driven { .. }) {
            self.phase = Phase::Stopping { since: now };
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

    /// Whether driving ended because the page fell silent.
    #[must_use]
    pub const fn fell_silent(&self) -> bool {
        self.fell_silent
    }

    /// The page that drives.
    #[must_use]
    pub const fn driver(&self) -> Option<PageId> {
        match self.phase {
            Phase::Driven { page, .. } => Some(page),
            Phase::Rest | Phase::Stopping { .. } => None,
        }
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

    const ONE: PageId = PageId(1);
    const OTHER: PageId = PageId(2);

    fn ahead() -> Push {
        Push::new(0.5, 0.0).unwrap()
    }

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn what_is_pushed_holds_until_300_ms_of_silence_and_then_the_vehicle_is_stopped() {
        let start = Instant::now();
        let mut stick = Stick::default();
        stick.handle_push(start, ONE, ahead()).unwrap();
        assert_eq!(stick.poll_push(start + ms(299)), Some(ahead()));
        assert!(!stick.fell_silent());
        assert_eq!(stick.poll_push(start + ms(300)), Some(Push::NONE));
        assert_eq!(stick.driven(), None);
        assert!(stick.fell_silent());
        stick.handle_push(start + ms(400), ONE, ahead()).unwrap();
        stick.handle_release(start + ms(500), ONE);
        assert!(!stick.fell_silent(), "it was let go");
    }

    #[test]
    fn every_push_starts_the_time_of_silence_anew() {
        let start = Instant::now();
        let mut stick = Stick::default();
        for step in 0..50 {
            let now = start + ms(100 * step);
            stick.handle_push(now, ONE, ahead()).unwrap();
            assert_eq!(stick.poll_push(now + ms(99)), Some(ahead()));
        }
    }

    #[test]
    fn the_vehicle_is_told_to_stop_until_it_acknowledges_that() {
        let start = Instant::now();
        let mut stick = Stick::default();
        stick.handle_push(start, ONE, ahead()).unwrap();
        stick.handle_release(start + ms(10), ONE);
        assert_eq!(stick.poll_push(start + ms(20)), Some(Push::NONE));
        assert_eq!(stick.poll_push(start + ms(2000)), Some(Push::NONE));
        stick.handle_stopped();
        assert_eq!(stick.poll_push(start + ms(2050)), None);
    }

    #[test]
    fn a_vehicle_that_never_acknowledges_is_left_to_its_own_rule() {
        let start = Instant::now();
        let mut stick = Stick::default();
        stick.handle_push(start, ONE, ahead()).unwrap();
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
        stick.handle_push(start, ONE, ahead()).unwrap();
        stick.stop(start);
        stick.handle_push(start + ms(10), ONE, ahead()).unwrap();
        stick.handle_stopped();
        assert_eq!(stick.poll_push(start + ms(20)), Some(ahead()));
    }

    #[test]
    fn one_page_drives_at_a_time_and_the_next_may_once_the_first_lets_go_or_is_silent() {
        let start = Instant::now();
        let mut stick = Stick::default();
        stick.handle_push(start, ONE, ahead()).unwrap();
        assert_eq!(
            stick.handle_push(start + ms(200), OTHER, ahead()),
            Err(Busy)
        );
        stick.handle_release(start + ms(200), OTHER);
        assert_eq!(stick.driven(), Some(ahead()), "it is not theirs to let go");
        stick.handle_push(start + ms(300), OTHER, ahead()).unwrap();
        assert_eq!(stick.handle_push(start + ms(400), ONE, ahead()), Err(Busy));
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
