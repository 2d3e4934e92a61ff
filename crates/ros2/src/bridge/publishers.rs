//! The publishers of `cmd_vel`: which of their commands are fresh, and which publishers have to pause
//! before they may move the vehicle. It does no I/O and reads no clock.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::ports::Command;
use super::sequence::{Run, SILENCE};
use crate::graph::Gid;

/// Why a command is too old to be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Outdated {
    /// A command with this sequence number or a later one arrived before.
    #[error("it was sent before another command that has arrived")]
    Reordered,
    /// Its sequence number is far from those of its publisher. If the next ones continue it, they are used.
    #[error("its sequence number is far from the last one of its publisher")]
    Jumped,
    /// It took longer than the fastest one by more than the timeout.
    #[error(
        "it was delayed by more than --timeout; if the clock of its host was set, pause for 10 s"
    )]
    Late,
    /// Its publisher has disappeared.
    #[error("its publisher has left the ROS network")]
    PublisherGone,
    /// There are too many publishers.
    #[error("more than 64 publishers send velocities, or more than 16 of one session")]
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
    /// The hash of the id of its session.
    session: Gid,
    /// The last command of any kind, or the end of the publisher.
    heard: Instant,
    /// Its commands, the last ones.
    run: Option<Run>,
    /// Commands with its gid whose numbers are far from those. Another node uses its gid, or its numbers have
    /// jumped: nobody can tell, so that none of both keeps the other one out.
    other_run: Option<Run>,
    /// The last command that moves, after which the publisher has neither stopped nor paused.
    moved: Option<Instant>,
    is_blocked: bool,
    /// It was silent for the time of a pause while it was blocked. If its next number shows that it went on
    /// sending, the network was interrupted and it is still blocked.
    is_silent: bool,
    gone: Option<Instant>,
}

impl Publishers {
    /// The most publishers.
    const MOST: usize = 64;
    /// The most publishers of one session.
    const MOST_OF_SESSION: usize = 16;
    /// A publisher is forgotten after this silence.
    const LONG_SILENCE: Duration = Duration::from_secs(600);
    /// The shortest pause of a blocked publisher, also with a shorter timeout.
    const SHORTEST_PAUSE: Duration = Duration::from_millis(500);

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
        let publisher = self.entry(now, command.publisher, Some(command.session));
        let publisher = publisher.ok_or(Outdated::TooManyPublishers)?;
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
        let went_on = publisher.advance(now, command, timeout)?;
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
        if let Some(publisher) = self.entry(now, publisher, None) {
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
        self.known
            .retain(|_, publisher| now < publisher.heard + Self::LONG_SILENCE);
    }

    /// Forgets who has been silent, if the table is full. Who was blocked before stays known.
    fn make_room(&mut self, now: Instant) {
        if self.known.len() >= Self::MOST {
            let stays = |it: &Publisher| it.is_silent || now < it.heard + SILENCE;
            self.known.retain(|_, publisher| stays(publisher));
        }
    }

    /// The publisher, which is added if its session is given and there is room.
    fn entry(
        &mut self,
        now: Instant,
        publisher: Gid,
        session: Option<Gid>,
    ) -> Option<&mut Publisher> {
        if self.known.contains_key(&publisher) {
            return self.known.get_mut(&publisher);
        }
        let session = session?;
        self.make_room(now);
        let of_session = self.known.values().filter(|it| it.session == session);
        let has_room = self.known.len() < Self::MOST && of_session.count() < Self::MOST_OF_SESSION;
        has_room.then(|| {
            self.known.entry(publisher).or_insert(Publisher {
                session,
                heard: now,
                run: None,
                other_run: None,
                moved: None,
                is_blocked: false,
                is_silent: false,
                gone: None,
            })
        })
    }
}

impl Publisher {
    /// Enters a command that is fresh; returns whether commands are missing before it.
    fn advance(
        &mut self,
        now: Instant,
        command: &Command,
        timeout: Duration,
    ) -> Result<bool, Outdated> {
        let new = Run::new(now, command);
        // Whichever run goes on: if it is ahead of the one before, commands were lost in between.
        let main = self.run.map(|run| run.sequence());
        let went_on = main.is_some_and(|main| command.sequence > main.saturating_add(1));
        let is_next = |run: &&mut Run| run.is_continued_by(command);
        if let Some(run) = self.run.as_mut().filter(is_next) {
            return run.advance(now, command, timeout).map(|()| went_on);
        }
        if let Some(run) = self.other_run.as_mut().filter(is_next) {
            run.advance(now, command, timeout)?;
            std::mem::swap(&mut self.run, &mut self.other_run);
            return Ok(went_on);
        }
        let mut runs = self.run.iter_mut().chain(&mut self.other_run);
        if let Some(run) = runs.find(|run| !run.is_over(now) && run.is_before(command)) {
            run.hear(now);
            return Err(Outdated::Reordered);
        }
        match self.run {
            None => {
                self.run = Some(new);
                Ok(false)
            }
            // Its commands from before have arrived long ago, so this is a new run.
            Some(run) if run.is_over(now) => {
                // An earlier number continues neither: otherwise one could overtake the other.
                let before = self.run.replace(new);
                self.other_run = before.filter(|run| !run.is_before(command));
                Ok(went_on)
            }
            Some(_) => {
                self.other_run = Some(new);
                Err(Outdated::Jumped)
            }
        }
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use proptest::prelude::*;

    use super::super::sequence::FAR;
    use super::super::velocity::Twist;
    use super::*;

    const ONE: Gid = Gid([1; 16]);
    const SESSION: Gid = Gid([9; 16]);
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
                session: SESSION,
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
    fn a_silence_in_which_a_blocked_publisher_sent_many_commands_is_no_pause() {
        for silence in [2_000, 9_000, 60_000] {
            let mut network = Network::new();
            assert_eq!(network.receive(0, 7, 0), Ok(()));
            network.publishers.block(network.at(10));
            let back = 10 + silence;
            // The first one may be refused, because it might be forged.
            let _first = network.receive(back, 900, back as i64);
            let next = network.receive(back + 50, 901, back as i64 + 50);
            assert_eq!(next, Ok(()), "{silence}");
            assert!(network.publishers.is_blocked(ONE), "{silence}");
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
            command.session = Gid([number / 16; 16]);
            let checked = network.publishers.check(network.start, &command, true);
            assert_eq!(checked.is_ok(), number < 64, "{number}");
        }
        assert_eq!(network.receive(1, 2, 1), Ok(()), "a known one");
    }

    #[test]
    fn one_session_has_its_share_of_the_table() {
        let mut network = Network::new();
        for number in 0..17 {
            let mut command = network.command(0, 1, 0);
            command.publisher = Gid([10 + number; 16]);
            let checked = network.publishers.check(network.start, &command, true);
            assert_eq!(checked.is_ok(), number < 16, "{number}");
        }
        let mut command = network.command(0, 1, 0);
        command.session = Gid([8; 16]);
        let other = network.publishers.check(network.start, &command, true);
        assert_eq!(other, Ok(()));
    }

    #[test]
    fn a_forged_number_does_not_keep_its_publisher_out() {
        let near = 1_000_000;
        for forged in [1 << 62, i64::MAX, i64::MIN, near, -near - 1] {
            let mut network = Network::new();
            assert_eq!(network.receive(0, 7, 0), Ok(()));
            for step in 0..100 {
                let at = 50 * (step as u64 + 1);
                let refused = network.receive(at, forged, i64::from(step));
                assert!(refused.is_err(), "{forged}");
                let next = network.receive(at + 1, 8 + i64::from(step), at as i64 + 1);
                assert_eq!(next, Ok(()), "{forged} {step}");
            }
        }
    }

    #[test]
    fn a_number_that_was_forged_first_costs_its_publisher_one_command() {
        let mut network = Network::new();
        assert_eq!(network.receive(0, 1 << 62, 0), Ok(()));
        assert_eq!(network.receive(50, 5, 50), Err(Outdated::Jumped));
        for step in 1..100 {
            let at = 50 * (step + 1);
            assert_eq!(network.receive(at, 5 + step as i64, at as i64), Ok(()));
            // The other one goes on.
            let other = (1 << 62) + step as i64;
            assert_eq!(network.receive(at + 1, other, at as i64), Ok(()));
        }
    }

    #[test]
    fn a_number_that_was_forged_in_a_pause_does_not_keep_its_publisher_out() {
        let mut network = Network::new();
        assert_eq!(network.receive(0, 7, 0), Ok(()));
        for step in 0..100 {
            let at = 60_000 + 50 * step;
            // Within the numbers that an earlier command could have.
            let forged = 500_000 + step as i64;
            assert_eq!(network.receive(at, forged, at as i64), Ok(()));
            let next = network.receive(at + 1, 8 + step as i64, at as i64 + 1);
            assert_eq!(next, Ok(()), "{step}");
        }
    }

    #[test]
    fn a_full_table_forgets_who_is_silent() {
        let mut network = Network::new();
        for number in 0..64 {
            let mut command = network.command(0, 1, 0);
            command.publisher = Gid([10 + number; 16]);
            command.session = Gid([number / 16; 16]);
            let checked = network.publishers.check(network.start, &command, true);
            assert_eq!(checked, Ok(()));
        }
        let full = Err(Outdated::TooManyPublishers);
        assert_eq!(network.receive(9_999, 1, 9_999), full);
        assert_eq!(network.receive(10_000, 2, 10_000), Ok(()));
    }

    #[test]
    fn a_forged_number_that_is_near_is_overtaken_within_seconds() {
        let mut network = Network::new();
        assert_eq!(network.receive(0, 7, 0), Ok(()));
        // The number may be ahead by as much as commands of 1 kHz could have been lost.
        assert_eq!(network.receive(50, 7 + 150, 50), Ok(()));
        let next = |step: u64| (100 + 50 * step, 8 + step as i64, 100 + 50 * step as i64);
        let mut taken = (0..200).filter(|step| {
            let (arrival, sequence, stamp) = next(*step);
            network.receive(arrival, sequence, stamp).is_ok()
        });
        assert_eq!(taken.next(), Some(150), "7.5 s at 20 Hz");
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
                    session: SESSION,
                    sequence,
                    stamp,
                    arrival: now,
                    twist: Twist::default(),
                };
                let is_fresh = publishers.check(now, &command, moves).is_ok();
                prop_assert!(publishers.known.len() <= Publishers::MOST);
                if is_fresh && let Some((before, at)) = accepted.insert(publisher, (sequence, now)) {
                    let is_far = i128::from(before) - i128::from(sequence) > FAR;
                    let is_over = now - at >= SILENCE;
                    prop_assert!(sequence > before || is_far || is_over);
                }
            }
        }
    }
}
