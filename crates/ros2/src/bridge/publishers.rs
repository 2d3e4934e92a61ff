//! The publishers of `cmd_vel`: which of their commands are fresh, and which publishers have to pause
//! before they may move the vehicle. It does no I/O and reads no clock.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::ports::Command;
use crate::graph::Gid;

/// Why a command is too old to be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Outdated {
    /// A command with this sequence number or a later one arrived before.
    #[error("it was sent before another command that has arrived")]
    Reordered,
    /// It took longer than the fastest one by more than the timeout.
    #[error(
        "it was delayed by more than --timeout; if the clock of its host was set, pause for 10 s"
    )]
    Late,
    /// Its publisher has disappeared.
    #[error("its publisher has left the ROS network")]
    PublisherGone,
    /// There are too many publishers.
    #[error("more than 64 publishers send velocities")]
    TooManyPublishers,
}

/// The publishers that were heard lately.
#[derive(Debug)]
pub(super) struct Publishers {
    timeout: Duration,
    known: BTreeMap<Gid, Publisher>,
}

#[derive(Debug)]
struct Publisher {
    /// The last command of any kind, or the end of the publisher.
    heard: Instant,
    last: Option<Last>,
    /// The last command that moves, after which the publisher has neither stopped nor paused.
    moved: Option<Instant>,
    is_blocked: bool,
    /// It was silent for the time of a pause while it was blocked. If its next number shows that it went on
    /// sending, the network was interrupted and it is still blocked.
    is_silent: bool,
    gone: Option<Instant>,
}

/// The last command that was fresh.
#[derive(Debug, Clone, Copy)]
struct Last {
    arrival: Instant,
    sequence: i64,
    stamp: i64,
    /// How much longer than the fastest command it took, in nanoseconds. The offset of the clocks, and
    /// with it the whole delay, is unknown.
    excess: i128,
}

impl Publishers {
    /// The most publishers.
    const MOST: usize = 64;
    /// A publisher is forgotten after this silence. By then zenoh has closed a connection that was
    /// interrupted, so that nothing from before it can arrive.
    const SILENCE: Duration = Duration::from_secs(10);
    /// One that was blocked before its silence is known for longer.
    const LONG_SILENCE: Duration = Duration::from_secs(600);
    /// The shortest pause of a blocked publisher, also with a shorter timeout.
    const SHORTEST_PAUSE: Duration = Duration::from_millis(500);
    /// One part in this many of the time passed is not counted as delay, because clocks drift.
    const DRIFT: i128 = 1000;

    pub(super) const fn new(timeout: Duration) -> Self {
        Self {
            timeout,
            known: BTreeMap::new(),
        }
    }

    /// Checks that a command is fresh. `moves` is whether it is anything but a zero, and counts even
    /// if it is not fresh.
    pub(super) fn check(
        &mut self,
        now: Instant,
        command: &Command,
        moves: bool,
    ) -> Result<(), Outdated> {
        self.handle_time(now);
        let timeout = self.timeout;
        let publisher = self.entry(now, command.publisher);
        let publisher = publisher.ok_or(Outdated::TooManyPublishers)?;
        let silence = now.saturating_duration_since(publisher.heard);
        publisher.heard = now;
        if moves {
            publisher.moved = Some(now);
        }
        if publisher.gone.is_some() {
            return Err(Outdated::PublisherGone);
        }
        if now >= command.arrival + timeout {
            return Err(Outdated::Late);
        }
        let before = publisher.last;
        publisher.last = Some(match before {
            Some(last) if silence < Self::SILENCE => last.followed_by(command, timeout)?,
            _ => Last::first(command),
        });
        let went_on = before.is_some_and(|last| command.sequence > last.sequence.saturating_add(1));
        publisher.is_blocked |= std::mem::take(&mut publisher.is_silent) && went_on;
        if !moves {
            publisher.moved = None;
            publisher.is_blocked = false;
        }
        Ok(())
    }

    /// Whether a publisher has to stop or pause before it may move the vehicle.
    pub(super) fn is_blocked(&self, publisher: Gid) -> bool {
        let known = self.known.get(&publisher);
        known.is_some_and(|it| it.is_blocked)
    }

    /// Blocks all publishers that send commands now, until each has stopped or paused.
    pub(super) fn block(&mut self, now: Instant) {
        self.handle_time(now);
        for publisher in self.known.values_mut() {
            publisher.is_blocked = publisher.moved.is_some();
        }
    }

    /// Refuses the commands of a publisher that arrive after its end.
    pub(super) fn handle_gone(&mut self, now: Instant, publisher: Gid) {
        self.handle_time(now);
        if let Some(publisher) = self.entry(now, publisher) {
            publisher.heard = now;
            publisher.gone = Some(now);
        }
    }

    fn handle_time(&mut self, now: Instant) {
        let (timeout, pause) = (self.timeout, self.timeout.max(Self::SHORTEST_PAUSE));
        for publisher in self.known.values_mut() {
            if publisher.moved.is_some_and(|moved| now >= moved + pause) {
                publisher.moved = None;
                publisher.is_silent |= std::mem::take(&mut publisher.is_blocked);
            }
            publisher.gone = publisher.gone.filter(|gone| now < *gone + timeout);
        }
        self.known.retain(|_, publisher| {
            let silence = match publisher.is_silent {
                true => Self::LONG_SILENCE,
                false => Self::SILENCE,
            };
            now < publisher.heard + silence
        });
    }

    /// The publisher, which is added if there is room.
    fn entry(&mut self, now: Instant, publisher: Gid) -> Option<&mut Publisher> {
        let has_room = self.known.len() < Self::MOST || self.known.contains_key(&publisher);
        has_room.then(|| {
            self.known.entry(publisher).or_insert(Publisher {
                heard: now,
                last: None,
                moved: None,
                is_blocked: false,
                is_silent: false,
                gone: None,
            })
        })
    }
}

impl Last {
    const fn first(command: &Command) -> Self {
        Self {
            arrival: command.arrival,
            sequence: command.sequence,
            stamp: command.stamp,
            excess: 0,
        }
    }

    /// The next command, if it is fresh.
    fn followed_by(self, command: &Command, timeout: Duration) -> Result<Self, Outdated> {
        if command.sequence <= self.sequence {
            return Err(Outdated::Reordered);
        }
        let next = Self::first(command);
        let passed = nanoseconds(self.arrival, command.arrival);
        let between = i128::from(command.stamp) - i128::from(self.stamp);
        if between < 0 {
            // The clock of the publisher was set back: the sequence number says that it is later.
            return Ok(next);
        }
        let drift = passed.max(0) / Publishers::DRIFT;
        let excess = (self.excess + passed - between - drift).max(0);
        let limit = i128::try_from(timeout.as_nanos()).unwrap_or(i128::MAX);
        match excess > limit {
            true => Err(Outdated::Late),
            false => Ok(Self { excess, ..next }),
        }
    }
}

/// From one time to another, which may be earlier.
fn nanoseconds(from: Instant, to: Instant) -> i128 {
    let signed = |time: Duration| i128::try_from(time.as_nanos()).unwrap_or(i128::MAX);
    match to.checked_duration_since(from) {
        Some(later) => signed(later),
        None => -signed(from.saturating_duration_since(to)),
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use proptest::prelude::*;

    use super::super::velocity::Twist;
    use super::*;

    const ONE: Gid = Gid([1; 16]);
    const TIMEOUT: Duration = Duration::from_millis(500);
    const MS: i64 = 1_000_000;

    /// Commands of publishers whose clocks have nothing to do with that of the bridge.
    struct Network {
        start: Instant,
        publishers: Publishers,
    }

    impl Network {
        fn new() -> Self {
            Self {
                start: Instant::now(),
                publishers: Publishers::new(TIMEOUT),
            }
        }

        fn at(&self, ms: u64) -> Instant {
            self.start + Duration::from_millis(ms)
        }

        fn command(&self, arrival: u64, sequence: i64, stamp: i64) -> Command {
            Command {
                publisher: ONE,
                sequence,
                stamp: stamp * MS,
                arrival: self.at(arrival),
                twist: Twist::default(),
            }
        }

        /// Receives a command that moves, all in milliseconds.
        fn receive(&mut self, arrival: u64, sequence: i64, stamp: i64) -> Result<(), Outdated> {
            let command = self.command(arrival, sequence, stamp);
            self.publishers.check(self.at(arrival), &command, true)
        }
    }

    #[test]
    fn a_command_that_is_repeated_or_overtaken_is_refused() {
        let mut network = Network::new();
        assert_eq!(network.receive(0, 7, 0), Ok(()));
        assert_eq!(network.receive(10, 7, 0), Err(Outdated::Reordered));
        assert_eq!(network.receive(20, 6, 20), Err(Outdated::Reordered));
        assert_eq!(network.receive(30, 8, 30), Ok(()));
    }

    #[test]
    fn a_command_that_took_longer_than_others_by_more_than_the_timeout_is_refused() {
        // The clock of the publisher is behind, or ahead.
        for offset in [-3_600_000, 0, 3_600_000] {
            let mut network = Network::new();
            assert_eq!(network.receive(1000, 1, offset + 900), Ok(()));
            assert_eq!(network.receive(1600, 2, offset + 1590), Ok(()), "faster");
            let late = network.receive(2600, 3, offset + 2000);
            assert_eq!(late, Err(Outdated::Late), "{offset}");
            assert_eq!(network.receive(2610, 4, offset + 2200), Ok(()), "{offset}");
            assert_eq!(network.receive(2620, 5, offset + 2610), Ok(()), "{offset}");
        }
    }

    #[test]
    fn a_command_that_waited_in_the_bridge_is_refused() {
        let mut network = Network::new();
        let command = network.command(0, 1, 0);
        let late = network.publishers.check(network.at(500), &command, true);
        assert_eq!(late, Err(Outdated::Late));
    }

    #[test]
    fn a_clock_that_is_set_or_drifts_does_not_stop_its_publisher() {
        let mut network = Network::new();
        assert_eq!(network.receive(0, 1, 60_000), Ok(()));
        assert_eq!(network.receive(100, 2, 0), Ok(()), "set back");
        assert_eq!(network.receive(200, 3, 60_000), Ok(()), "set ahead");
        assert_eq!(network.receive(300, 4, 100), Ok(()), "set back again");
        // 100 ppm for 10 hours: 3.6 s.
        let mut stamp = 100_000;
        for second in 1..36_000_u32 {
            let arrival = 300 + 1000 * u64::from(second);
            stamp += 999_900;
            let mut command = network.command(arrival, 4 + i64::from(second), 0);
            command.stamp = stamp * 1000;
            let now = network.at(arrival);
            assert_eq!(network.publishers.check(now, &command, true), Ok(()));
        }
    }

    #[test]
    fn after_a_long_silence_a_publisher_begins_anew() {
        let mut network = Network::new();
        assert_eq!(network.receive(0, 7, 0), Ok(()));
        assert_eq!(network.receive(10_000, 1, -60_000), Ok(()));
    }

    #[test]
    fn a_silence_in_which_a_blocked_publisher_went_on_sending_is_no_pause() {
        for silence in [500, 9_000, 60_000] {
            let mut network = Network::new();
            assert_eq!(network.receive(0, 7, 0), Ok(()));
            network.publishers.block(network.at(10));
            // The network is back, and the commands in between are lost.
            let back = 10 + silence;
            assert_eq!(network.receive(back, 30, back as i64), Ok(()));
            assert!(network.publishers.is_blocked(ONE), "{silence}");
            // Now it does pause.
            let later = back + 500;
            assert_eq!(network.receive(later, 31, later as i64), Ok(()));
            assert!(!network.publishers.is_blocked(ONE), "{silence}");
        }
    }

    #[test]
    fn the_last_commands_of_a_publisher_that_is_gone_are_refused_for_the_timeout() {
        let mut network = Network::new();
        assert_eq!(network.receive(0, 1, 0), Ok(()));
        network.publishers.handle_gone(network.at(10), ONE);
        let gone = Err(Outdated::PublisherGone);
        assert_eq!(network.receive(20, 2, 20), gone);
        assert_eq!(network.receive(509, 3, 509), gone);
        assert_eq!(network.receive(510, 4, 510), Ok(()), "it is back");
    }

    #[test]
    fn the_table_has_a_bound_and_what_is_not_in_it_is_refused() {
        let mut network = Network::new();
        for number in 0..65 {
            let mut command = network.command(0, 1, 0);
            command.publisher = Gid([number; 16]);
            let checked = network.publishers.check(network.start, &command, true);
            assert_eq!(checked.is_ok(), number < 64, "{number}");
        }
        assert_eq!(network.receive(1, 2, 1), Ok(()), "a known one");
    }

    /// Publisher, sequence number, stamp, milliseconds since the command before, and whether it moves.
    fn commands() -> impl Strategy<Value = Vec<(u8, i64, i64, u64, bool)>> {
        let publisher = prop_oneof![0..3_u8, 0..80_u8];
        let sequence = prop_oneof![0..9_i64, any::<i64>()];
        let passed = prop_oneof![0..300_u64, 0..12_000_u64];
        let command = (publisher, sequence, any::<i64>(), passed, any::<bool>());
        prop::collection::vec(command, 1..100)
    }

    proptest! {
        #[test]
        fn commands_with_any_numbers_and_times_are_refused_or_in_order(commands in commands()) {
            let mut publishers = Publishers::new(TIMEOUT);
            let mut accepted = BTreeMap::new();
            let mut now = Instant::now();
            for (publisher, sequence, stamp, passed, moves) in commands {
                now += Duration::from_millis(passed);
                let publisher = Gid([publisher; 16]);
                let command = Command {
                    publisher,
                    sequence,
                    stamp,
                    arrival: now,
                    twist: Twist::default(),
                };
                let is_fresh = publishers.check(now, &command, moves).is_ok();
                prop_assert!(publishers.known.len() <= Publishers::MOST);
                if is_fresh && let Some((before, at)) = accepted.insert(publisher, (sequence, now)) {
                    prop_assert!(sequence > before || now - at >= Publishers::SILENCE);
                }
            }
        }
    }
}
