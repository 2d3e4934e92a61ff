//! Notices that a peer has restarted: by the [`Incarnation`] that it tells, and if it does not tell
//! any, by its sequence numbers.
//!
//! Junior and JAUS++ have one counter for each component, and begin at 1 and 0 each time they start.
//! So a peer has restarted when a number is among the [first](Counter::FRESH), is neither the next
//! one nor a late one, and a second number agrees with it. What is not a restart:
//!
//! * The counter wraps. A number is the next one if it is at most [`REACH`] ahead, and one more for
//!   each millisecond since the newest arrived: a component does not send more. So a restart that
//!   happens within that distance of the wrap is not noticed.
//! * A message is late, because the network has delayed or its sender has retransmitted it. No
//!   message is more than [`MEMORY`](super::order::MEMORY) late, so a number counts as late unless it was overtaken that
//!   long ago. A restart in the first 4 s to 8 s is therefore not noticed.
//! * A message arrives twice: its number is the newest or a late one.
//!
//! Peers that restart unnoticed are subject to the other limits on motion, which are longer.
//!
//! Junior counts anew before each message of several fragments where it does not detect duplicates, which
//! FKIE's settings turn off. A component takes that for a restart of its controller, and stops: it cannot
//! ask who else the controller still is. A client asks the component who its controller is, and goes on.

use std::time::Instant;

use super::Incarnation;
use super::order::{MEMORY, Mark, REACH, Settled, number_of};
use crate::endpoint::Received;

/// Whether one peer is still the one that it was.
#[derive(Debug, Default)]
pub(super) struct RestartWatch {
    /// Its incarnation, if it has told it.
    incarnation: Option<Incarnation>,
    counter: Counter,
}

/// What a message says about its sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sameness {
    /// It goes on as before.
    Same,
    /// It may have restarted: its next message will show.
    Doubtful,
    /// It has restarted.
    Restarted,
}

impl RestartWatch {
    /// Watches a peer of this incarnation, if that is known.
    pub(super) fn of(incarnation: Option<Incarnation>) -> Self {
        Self {
            incarnation,
            counter: Counter::default(),
        }
    }

    /// The peer's incarnation, if it has told it.
    pub(super) const fn incarnation(&self) -> Option<Incarnation> {
        self.incarnation
    }

    /// Whether the peer counts its messages: some products leave the number at 0.
    pub(super) fn is_counting(&self) -> bool {
        self.counter.newest.is_some_and(|newest| newest.number != 0)
    }

    /// Notes a message of the peer. After a restart the new one is watched.
    pub(super) fn note(&mut self, now: Instant, message: &Received) -> Sameness {
        if let Some(told) = Incarnation::told_in(&message.payload) {
            let before = self.incarnation.replace(told);
            return match before.is_some_and(|before| before != told) {
                true => Sameness::Restarted,
                false => Sameness::Same,
            };
        }
        match number_of(message).filter(|_| self.incarnation.is_none()) {
            Some(number) => self.counter.note(now, number),
            None => Sameness::Same,
        }
    }
}

/// The sequence numbers of one peer.
#[derive(Debug)]
struct Counter {
    newest: Option<Mark>,
    /// What is behind this is not late.
    settled: Settled,
    /// The last number, if it may be of a new counter.
    fresh: Option<Mark>,
}

impl Default for Counter {
    fn default() -> Self {
        Self {
            newest: None,
            settled: Settled::after(MEMORY),
            fresh: None,
        }
    }
}

impl Counter {
    /// How many messages a peer may send after its start before the one that shows the restart.
    const FRESH: u16 = 64;

    /// Notes the number of a message. After a restart the new counter is watched.
    fn note(&mut self, now: Instant, number: u16) -> Sameness {
        let mark = Mark { number, at: now };
        let Some(newest) = self.newest else {
            self.begin(mark);
            return Sameness::Same;
        };
        self.settled.note(Mark { at: now, ..newest });
        if is_next(newest, mark) {
            self.newest = Some(mark);
            self.fresh = None;
            return Sameness::Same;
        }
        // One that repeats its number, as some do that do not count, says nothing new.
        let is_repeated = |fresh: Mark| fresh.number == number && fresh.is_recent(now);
        if self.is_late(newest, number) || self.fresh.is_some_and(is_repeated) {
            return Sameness::Same;
        }
        let before = self.fresh.take().filter(|fresh| fresh.is_recent(now));
        let agrees = |fresh: Mark| {
            // The second may have overtaken the first.
            let apart = fresh.ahead(number).min(mark.ahead(fresh.number));
            (1..=Self::FRESH).contains(&apart)
        };
        if before.is_some_and(agrees) {
            self.begin(mark);
            return Sameness::Restarted;
        }
        if number < Self::FRESH {
            self.fresh = Some(mark);
            return Sameness::Doubtful;
        }
        // A gap that is not understood, for instance after a node counts for other components.
        self.begin(mark);
        Sameness::Same
    }

    /// Watches a counter from this number on.
    fn begin(&mut self, mark: Mark) {
        *self = Self {
            newest: Some(mark),
            ..Self::default()
        };
        self.settled.note(mark);
    }

    /// Whether a number may be one of those before the newest that were delayed.
    fn is_late(&self, newest: Mark, number: u16) -> bool {
        match self.settled.number {
            Some(settled) => number.wrapping_sub(settled) <= newest.number.wrapping_sub(settled),
            None => newest.number.wrapping_sub(number) < 1 << 15,
        }
    }
}

/// Whether a number is one that the sender of the newest can have reached.
fn is_next(newest: Mark, mark: Mark) -> bool {
    let elapsed = mark.at.saturating_duration_since(newest.at).as_millis();
    u128::from(newest.ahead(mark.number)) <= u128::from(REACH) + elapsed
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use std::time::Duration;

    use proptest::prelude::*;

    use super::super::order::MEMORY;
    use super::*;

    struct Rig {
        counter: Counter,
        now: Instant,
    }

    impl Rig {
        /// A peer that has sent these numbers, 20 each second.
        fn after(numbers: impl IntoIterator<Item = u16>) -> Self {
            let (counter, now) = (Counter::default(), Instant::now());
            let mut rig = Self { counter, now };
            let found = rig.note_all(numbers);
            assert!(found.iter().all(|it| *it == Sameness::Same));
            rig
        }

        fn note_all(&mut self, numbers: impl IntoIterator<Item = u16>) -> Vec<Sameness> {
            let note = |number| {
                self.now += Duration::from_millis(50);
                self.counter.note(self.now, number)
            };
            numbers.into_iter().map(note).collect()
        }

        fn notices_restart(&mut self, numbers: impl IntoIterator<Item = u16>) -> bool {
            self.note_all(numbers).contains(&Sameness::Restarted)
        }
    }

    #[test]
    fn two_numbers_of_a_new_counter_are_a_restart() {
        use Sameness::{Doubtful, Restarted, Same};
        for old in [0..400, 20_000..20_400, 50_000..50_400] {
            for [first, second] in [[0, 1], [1, 2], [5, 60], [63, 64]] {
                let mut rig = Rig::after(old.clone());
                let found = rig.note_all([first, second, second + 1]);
                assert_eq!(found, [Doubtful, Restarted, Same], "{old:?} {first}");
            }
        }
    }

    #[test]
    fn a_restart_is_noticed_among_late_messages_and_duplicates() {
        let mut rig = Rig::after(0..400);
        assert!(rig.notices_restart([2, 390, 2, 395, 1]));
    }

    #[test]
    fn a_restart_after_a_pause_is_noticed() {
        let mut rig = Rig::after(20_000..20_400);
        rig.now += Duration::from_secs(20);
        assert!(rig.notices_restart([1, 2]));
    }

    #[test]
    fn one_number_is_no_restart() {
        let mut rig = Rig::after(20_000..20_400);
        let stray = [1, 20_400, 2, 20_401, 3, 3, 20_402];
        assert!(!rig.notices_restart(stray));
        assert!(!rig.notices_restart([1, 66]), "they are not in agreement");
        let mut rig = Rig::after(20_000..20_400);
        assert!(!rig.notices_restart([1]));
        rig.now += MEMORY;
        assert!(!rig.notices_restart([2]), "they are far apart");
    }

    #[test]
    fn a_number_that_is_repeated_raises_one_doubt() {
        let mut rig = Rig::after(1000..1200);
        let found = rig.note_all([0; 40]);
        let doubts = found.iter().filter(|it| **it == Sameness::Doubtful);
        assert_eq!(doubts.count(), 1, "{found:?}");
        assert!(!found.contains(&Sameness::Restarted));
    }

    #[test]
    fn a_counter_that_wraps_is_no_restart() {
        let mut rig = Rig::after(65_000..=65_530);
        assert!(!rig.notices_restart([3, 65_533, 4, 65_535, 0, 5, 6]));
        let mut rig = Rig::after(60_000..=61_500);
        assert!(!rig.notices_restart([3, 4, 5]), "it sends to others, too");
        let mut rig = Rig::after(50_000..=50_400);
        rig.now += Duration::from_secs(16);
        assert!(!rig.notices_restart([3, 4, 5]), "for a while");
    }

    #[test]
    fn late_messages_are_no_restart() {
        // Of a counter that has just wrapped, or just begun.
        for start in [65_500_u16, 0] {
            let numbers = (0..100).map(|it| start.wrapping_add(it));
            let mut rig = Rig::after(numbers);
            assert!(!rig.notices_restart([20, 21, 22, 40, 41, 50]), "{start}");
        }
    }

    #[test]
    fn a_peer_that_does_not_count_never_restarts() {
        let mut rig = Rig::after(vec![0; 400]);
        assert!(!rig.notices_restart([0; 400]));
    }

    /// A message: milliseconds since the one before, how many numbers it is ahead of that, how late
    /// it arrives, and whether it is lost or arrives again later.
    type Sent = (u64, u16, u64, Option<Option<u64>>);

    fn sent() -> impl Strategy<Value = Sent> {
        let pause = prop_oneof![9 => 1..100_u64, 1 => 1000..20_000_u64];
        let delay = || prop_oneof![8 => 0..50_u64, 1 => 0..3000_u64];
        let fate = prop_oneof![
            1 => Just(None),
            7 => Just(Some(None)),
            2 => delay().prop_map(|again| Some(Some(again))),
        ];
        (pause, 1..=u16::MAX, delay(), fate).prop_map(|(pause, share, delay, fate)| {
            // A component sends at most one message a millisecond, to all receivers.
            let ahead = 1 + u64::from(share) * (pause - 1) / u64::from(u16::MAX);
            (pause, ahead as u16, delay, fate)
        })
    }

    /// When which numbers arrive.
    fn arrivals(first: u16, messages: &[Sent]) -> Vec<(u64, u16)> {
        let (mut time, mut number) = (0, first);
        let mut arrivals = Vec::new();
        for &(pause, ahead, delay, fate) in messages {
            time += pause;
            number = number.wrapping_add(ahead);
            if let Some(again) = fate {
                arrivals.push((time + delay, number));
                arrivals.extend(again.map(|again| (time + again, number)));
            }
        }
        arrivals.sort_by_key(|(time, _)| *time);
        arrivals
    }

    proptest! {
        #[test]
        fn no_loss_duplicate_or_order_of_arrival_is_a_restart(
            first: u16,
            messages in prop::collection::vec(sent(), 1..600),
        ) {
            let (mut counter, start) = (Counter::default(), Instant::now());
            for (time, number) in arrivals(first, &messages) {
                let now = start + Duration::from_millis(time);
                prop_assert_ne!(counter.note(now, number), Sameness::Restarted);
            }
        }

        #[test]
        fn a_restart_is_noticed_from_8_s_on_unless_the_counter_is_about_to_wrap(
            first in 100..61_000_u16,
            restarted in 0..60_u16,
            rate in 3..100_u64,
        ) {
            let (mut counter, mut now) = (Counter::default(), Instant::now());
            let count = (rate * 9) as u16;
            prop_assume!(first < u16::MAX - REACH - 200 - count);
            for number in 0..=count {
                now += Duration::from_micros(1_000_000 / rate);
                prop_assert_eq!(counter.note(now, first + number), Sameness::Same);
            }
            prop_assert_eq!(counter.note(now, restarted), Sameness::Doubtful);
            prop_assert_eq!(counter.note(now, restarted + 1), Sameness::Restarted);
        }
    }
}
