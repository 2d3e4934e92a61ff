//! One flow on its own: its window, its timers, and which packets count as lost.

use bytes::Bytes;

use super::*;
use crate::wire::Flags;

const US: JausId = JausId::new(101, 1, 1);
const SIBLING: JausId = JausId::new(101, 1, 2);
const PEER: JausId = JausId::new(42, 1, 1);
/// The longest payload of a packet.
const LIMIT: usize = 1000;
const SECOND: Duration = Duration::from_secs(1);

const fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

/// A flow to [`PEER`], whose address is known, with a clock.
struct Rig {
    flow: Flow,
    numbers: Numbers,
    now: Instant,
    queued: u64,
}

impl Rig {
    fn new(initial_window: usize) -> Self {
        Self::with(&Config {
            initial_window,
            ..Config::default()
        })
    }

    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn with(config: &Config) -> Self {
        let mut flow = Flow::new(config);
        flow.known = true;
        Self {
            flow,
            numbers: Numbers::after(0),
            now: Instant::now(),
            queued: 0,
        }
    }

    fn queue(&mut self, source: JausId, priority: Priority, length: usize) -> MessageHandle {
        self.queued += 1;
        let handle = MessageHandle(self.queued);
        let whole = Frame {
            flags: Flags::new(priority),
            ..Frame::new(source, PEER, Bytes::from(vec![7; length]))
        };
        self.flow.push(self.now, handle, whole, true);
        handle
    }

    /// Queues as many messages of one packet each.
    fn queue_many(&mut self, count: usize) {
        for _message in 0..count {
            self.queue(US, Priority::Standard, 10);
        }
    }

    fn send_one(&mut self, priority: Priority) -> Option<(u16, u32)> {
        let begin = |length| (Cut::new(length, LIMIT, false), Version::As5669a);
        let taken = self
            .flow
            .take(self.now, priority, &mut self.numbers, begin)?;
        Some((taken.0.sequence, taken.1))
    }

    /// The packets that the window allows now, each with the number of its transmissions.
    fn send(&mut self) -> Vec<(u16, u32)> {
        let mut sent = Vec::new();
        while let Some(priority) = self.flow.wants() {
            sent.extend(self.send_one(priority));
        }
        sent
    }

    fn acknowledge(&mut self, sequences: impl IntoIterator<Item = u16>) {
        for sequence in sequences {
            self.flow.acknowledge(self.now, sequence);
        }
    }

    fn in_flight(&self) -> usize {
        self.flow.status().in_flight
    }

    /// The time until the flow is to be checked.
    fn pause(&self) -> Option<Duration> {
        self.flow.deadline().map(|at| at - self.now)
    }

    fn pass(&mut self, time: Duration) {
        self.now += time;
        self.flow.handle_timeout(self.now);
    }

    fn outcomes(&mut self) -> Vec<(MessageHandle, u32, Option<Unacknowledged>)> {
        let outcomes = self.flow.outcomes.drain(..);
        outcomes
            .map(|(id, it, why)| (id, it.acknowledged, why))
            .collect()
    }
}

#[test]
fn urgent_packets_exceed_the_window_by_their_reserve() {
    let mut rig = Rig::new(4);
    for (priority, expected) in [
        (Priority::Low, 4),
        (Priority::Standard, 0),
        (Priority::High, 8),
        (Priority::SafetyCritical, 24),
    ] {
        for _message in 0..100 {
            rig.queue(US, priority, 10);
        }
        assert_eq!(rig.send().len(), expected, "{priority:?}");
    }
    assert_eq!(rig.in_flight(), 4 + 32);
    assert_eq!(rig.flow.status().messages, 400);
}

#[test]
fn one_packet_seeks_a_destination_whose_address_is_unknown() {
    let mut rig = Rig::new(4);
    rig.flow.known = false;
    rig.queue_many(3);
    assert_eq!(rig.send(), [(1, 1)]);
    rig.acknowledge([1]);
    assert_eq!(rig.send(), [(2, 1)]);
}

#[test]
fn only_the_next_message_counts_as_about_to_begin() {
    let mut rig = Rig::new(4);
    assert!(!rig.flow.begins_more_than(0), "there is none");
    rig.queue(US, Priority::Low, 1500);
    assert!(rig.flow.begins_more_than(1499) && !rig.flow.begins_more_than(1500));
    rig.queue(US, Priority::High, 100);
    assert!(!rig.flow.begins_more_than(100), "it goes first");
    rig.send_one(Priority::High);
    rig.send_one(Priority::Low);
    assert!(!rig.flow.begins_more_than(0), "it has begun");
}

#[test]
fn a_packet_is_lost_when_one_sent_three_packets_later_is_acknowledged() {
    let mut rig = Rig::new(8);
    rig.queue_many(8);
    rig.send();
    rig.acknowledge([3]);
    assert_eq!((rig.send(), rig.in_flight()), (vec![], 7));
    rig.acknowledge([4]);
    assert_eq!(rig.in_flight(), 5, "number 1 is lost, and not number 2");
    assert_eq!((rig.send(), rig.in_flight()), (vec![(1, 2)], 6));
    // The retransmission counts from when it was sent, after number 8.
    rig.acknowledge([2, 8, 7, 6, 5]);
    assert_eq!((rig.send(), rig.in_flight()), (vec![], 1));
    rig.acknowledge([1]);
    assert_eq!((rig.in_flight(), rig.pause()), (0, None));
    assert!(rig.flow.is_idle() && rig.outcomes().len() == 8);
}

#[test]
fn the_tolerance_doubles_when_a_packet_was_not_lost_after_all() {
    let mut rig = Rig::new(512);
    let mut first = 1;
    for tolerance in [3, 6, 12, 24, 48, 96, 96] {
        assert_eq!(rig.flow.tolerance, u64::from(tolerance));
        rig.queue_many(usize::from(tolerance) + 1);
        rig.send();
        rig.acknowledge([first + tolerance]);
        assert_eq!(rig.flow.lost.iter().flatten().count(), 1);
        rig.acknowledge((first..first + tolerance).rev());
        assert_eq!((rig.in_flight(), rig.send()), (0, vec![]));
        first += tolerance + 1;
    }
}

#[test]
fn a_retransmission_is_needless_if_its_answer_comes_in_less_than_half_a_round_trip() {
    for (after, tolerance) in [(4, 6), (5, 3), (11, 3)] {
        let mut rig = Rig::new(8);
        rig.queue_many(4);
        rig.send();
        rig.pass(ms(10));
        rig.acknowledge([2, 3, 4]);
        assert_eq!(rig.send(), [(1, 2)]);
        rig.pass(ms(after));
        rig.acknowledge([1]);
        assert_eq!(rig.flow.tolerance, tolerance, "after {after} ms");
        // It could belong to either copy, so it measures nothing.
        assert_eq!(rig.flow.status().round_trip, Some(ms(10)));
    }
}

#[test]
fn the_retransmission_timer_starts_with_the_first_packet_and_with_each_acknowledgement() {
    let mut rig = Rig::new(8);
    rig.queue_many(3);
    rig.send_one(Priority::Standard);
    rig.pass(ms(30));
    rig.send();
    assert_eq!(rig.pause(), Some(ms(70)));
    rig.acknowledge([2]);
    // Once measured, 0 ms: the least timeout.
    assert_eq!(rig.pause(), Some(ms(10)));
    rig.pass(ms(9));
    assert_eq!(rig.in_flight(), 2);
    rig.pass(ms(1));
    assert_eq!(rig.in_flight(), 0, "all count as lost");
    assert_eq!(rig.send(), [(1, 2), (3, 2)]);
    assert_eq!(rig.pause(), Some(ms(20)), "the timeout doubles");
    rig.acknowledge([1, 3]);
    assert_eq!(rig.pause(), None);
}

#[test]
fn the_timeout_has_bounds_for_unknown_addresses_and_for_connections() {
    for (known, connected, expected) in [
        (false, false, [100, 400]),
        (true, false, [100, 800]),
        (true, true, [200, 800]),
    ] {
        let mut rig = Rig::new(8);
        (rig.flow.known, rig.flow.connected) = (known, connected);
        rig.queue_many(1);
        rig.send();
        assert_eq!(rig.pause(), Some(ms(expected[0])));
        (0..3).for_each(|_| rig.flow.round_trip.back_off());
        assert_eq!(rig.pause(), Some(ms(expected[1])));
    }
}

#[test]
fn a_packet_ends_its_message_after_enough_tries_and_time() {
    let config = Config {
        acknowledge_tries: 3,
        acknowledge_patience: SECOND,
        ..Config::default()
    };
    for (time, tries, ends) in [(1000, 2, false), (999, 3, false), (1000, 3, true)] {
        let mut rig = Rig::with(&config);
        rig.queue_many(1);
        for _repetition in 1..tries {
            rig.send();
            rig.flow.lose(rig.now, 1);
        }
        rig.send();
        rig.now += ms(time);
        rig.flow.lose(rig.now, 1);
        assert_eq!(rig.flow.is_idle(), ends, "{tries} tries in {time} ms");
        assert_eq!(rig.in_flight(), 0);
    }
}

#[test]
fn what_was_acknowledged_of_a_message_is_reported_when_it_ends() {
    let mut rig = Rig::new(8);
    let message = rig.queue(US, Priority::Standard, 2500);
    let waiting = rig.queue(US, Priority::Low, 2500);
    for _fragment in 0..3 {
        rig.send_one(Priority::Standard);
    }
    rig.acknowledge([1, 3]);
    let patience = Config::default().acknowledge_patience;
    rig.pass(patience - ms(1));
    assert_eq!(rig.outcomes(), []);
    rig.pass(ms(1));
    let timed_out = (message, 1500, Some(Unacknowledged::TimedOut));
    let not_sent = (waiting, 0, Some(Unacknowledged::NotSent));
    assert_eq!(rig.outcomes(), [timed_out, not_sent]);
    assert_eq!((rig.in_flight(), rig.pause()), (0, None));
    // The next one gets a sixth of the time, until something is acknowledged.
    rig.queue_many(2);
    rig.send();
    assert_eq!(rig.flow.end_of_patience(), Some(rig.now + patience / 6));
    rig.acknowledge([4]);
    assert_eq!(rig.flow.end_of_patience(), Some(rig.now + patience));
}

#[test]
fn a_refusal_ends_one_message_of_the_sender_that_it_names() {
    let mut rig = Rig::new(8);
    let refused = rig.queue(US, Priority::Standard, 2500);
    rig.queue_many(1);
    rig.send();
    assert_eq!(rig.flow.owner_of(US, 2), Some(refused));
    assert_eq!(rig.flow.owner_of(SIBLING, 2), None);
    rig.flow.refuse(SIBLING, 2);
    assert_eq!((rig.outcomes(), rig.in_flight()), (vec![], 4));
    rig.flow.refuse(US, 2);
    let outcome = (refused, 0, Some(Unacknowledged::Refused));
    assert_eq!((rig.outcomes(), rig.in_flight()), (vec![outcome], 1));
    assert_eq!(rig.pause(), Some(ms(100)), "the other still waits");
    rig.flow.refuse(US, 4);
    assert_eq!((rig.in_flight(), rig.pause()), (0, None));
}

#[test]
fn a_lost_packet_of_a_message_that_is_gone_is_not_sent_again() {
    let mut rig = Rig::new(8);
    let gone = [(), ()].map(|()| rig.queue(SIBLING, Priority::Standard, 1500));
    rig.queue(US, Priority::Standard, 10);
    rig.send();
    rig.flow.lose(rig.now, 1);
    assert_eq!(rig.flow.forget_source(SIBLING), [1500, 1500]);
    assert_eq!((rig.outcomes(), rig.in_flight()), (vec![], 1), "{gone:?}");
    rig.pass(ms(100));
    assert_eq!(rig.send(), [(5, 2)]);
}

#[test]
fn after_a_second_without_traffic_the_window_is_the_initial_one() {
    for (pause, expected) in [(999, 3), (1000, 2)] {
        let mut rig = Rig::new(2);
        rig.queue_many(2);
        rig.send();
        rig.acknowledge([1, 2]);
        assert_eq!(rig.flow.status().window, 3);
        rig.pass(ms(pause));
        rig.queue_many(1);
        assert_eq!(rig.flow.status().window, expected, "after {pause} ms");
    }
}

#[test]
fn a_message_waits_while_a_number_that_it_needs_is_in_flight() {
    for (first, waits) in [(2, true), (3, false)] {
        let mut rig = Rig::new(8);
        rig.numbers.take(first - 1);
        rig.queue_many(1);
        rig.send();
        rig.numbers.take(usize::from(u16::MAX) - first);
        rig.queue_many(1);
        assert_eq!(rig.send_one(Priority::Standard).is_none(), waits);
        rig.acknowledge([first as u16]);
        assert_eq!(rig.send_one(Priority::Standard).is_some(), waits);
    }
}
