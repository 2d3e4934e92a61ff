//! Interoperation with Junior: its duplicate detection, its restarts, and its messages for unknown
//! ids.

use std::collections::HashMap;

use super::*;
use crate::peer::{Assignment, Implementation as Known};
use crate::wire::DataControl;

const CODE: [u8; 2] = [0xF0, 0xD7];
/// Octets of a Junior fragment.
const FRAGMENT: usize = 4079;
/// Junior's flags, as recorded: standard priority, acknowledgement requested.
const WANTED: Flags = Flags(0x11);
/// The same, as a global broadcast.
const CALL: Flags = Flags(0x19);

/// How long Junior remembers a sequence number, with its settings file and without.
const REMEMBERED: [Duration; 2] = [Duration::from_secs(3), Duration::from_secs(10)];

fn message(octets: usize) -> Bytes {
    let rest = (0..octets - CODE.len()).map(|octet| (octet / 251 + octet) as u8);
    CODE.into_iter().chain(rest).collect()
}

/// Junior's memory of the sequence numbers of one id. A message with a remembered number is
/// acknowledged and dropped.
struct Memory {
    heard: HashMap<u16, Instant>,
    time: Duration,
    dropped: usize,
}

impl Memory {
    fn hear(&mut self, now: Instant, number: u16) {
        match self.heard.get(&number) {
            Some(&before) if now - before <= self.time => self.dropped += 1,
            _ => {
                self.heard.insert(number, now);
            }
        }
    }
}

#[test]
fn a_restarted_node_uses_no_sequence_number_that_junior_remembers() {
    let started = Duration::from_millis(1_795_294_742_000);
    for time in REMEMBERED {
        let mut junior = Memory {
            heard: HashMap::new(),
            time,
            dropped: 0,
        };
        let begin = Rig::new().now;
        // A command that is run repeatedly: greeting, 1 MiB, end.
        for run in 0..40 {
            let alive = Duration::from_millis(200) * run;
            let mut rig = Rig::with(Config {
                first_sequence: first_sequence_at(started + alive),
                profiles: vec![Assignment {
                    id: PEER,
                    profile: Known::Junior,
                }],
                ..Config::default()
            });
            rig.now = begin + alive;
            rig.meet_peer();
            rig.send(to_peer()).unwrap();
            rig.send(Outgoing {
                payload: message(1 << 20),
                ..to_peer()
            })
            .unwrap();
            let mut sent = 0;
            while sent < 1 + 258 {
                for (_, frame) in rig.sent() {
                    junior.hear(rig.now, frame.sequence);
                    sent += 1;
                }
                rig.pass(Duration::from_millis(1));
            }
        }
        assert_eq!(junior.dropped, 0, "remembered for {time:?}");
    }
}

/// The frames in which a Junior process sends an acknowledged message with these numbers. The very
/// first is broadcast, because its engine has just started as well.
fn of_junior(first: u16, message: &Bytes) -> Vec<Frame> {
    let pieces = message.chunks(FRAGMENT).enumerate();
    let last = message.len().div_ceil(FRAGMENT) - 1;
    let frame = |(index, piece): (usize, &[u8])| {
        let sequence = first + index as u16;
        let data = match index {
            _ if last == 0 => DataControl::Single,
            0 => DataControl::First,
            _ if index == last => DataControl::Last,
            _ => DataControl::Middle,
        };
        let flags = if sequence == 1 { CALL } else { WANTED };
        Frame {
            flags: flags.with_data(data),
            sequence,
            payload: Bytes::copy_from_slice(piece),
            ..from_peer(b"")
        }
    };
    pieces.map(frame).collect()
}

/// Checks that all frames were acknowledged; returns the lengths delivered.
fn lengths_of(rig: &mut Rig, frames: &[Frame]) -> Vec<usize> {
    for frame in frames {
        rig.hear(frame);
        rig.pass(Duration::from_millis(2));
    }
    let acknowledged = rig
        .sent()
        .iter()
        .filter(|(_, it)| it.flags == Flags(0x31))
        .count();
    assert_eq!(acknowledged, frames.len());
    rig.received().iter().map(|it| it.payload.len()).collect()
}

#[test]
fn a_large_message_of_a_restarted_junior_arrives_despite_repeated_numbers_and_octets() {
    // The peer may be recognised by its fragments, or count as standard.
    let anybody = Assignment {
        id: PEER,
        profile: Known::Standard,
    };
    for profiles in [Vec::new(), vec![anybody]] {
        let mut rig = Rig::with(Config {
            profiles,
            ..Config::default()
        });
        // As recorded: three times 10 KiB, and 3.07 s later another process with 100 KiB whose
        // second fragment is the same.
        let small = [1, 4, 7]
            .map(|first| of_junior(first, &message(10_240)))
            .concat();
        assert_eq!(lengths_of(&mut rig, &small), [10_240; 3]);
        rig.pass(Duration::from_millis(3070) - Duration::from_millis(18));
        let large = of_junior(1, &message(102_400));
        assert_eq!(lengths_of(&mut rig, &large), [102_400]);
        // The same large message again.
        rig.pass(Duration::from_millis(2500));
        assert_eq!(lengths_of(&mut rig, &large), [102_400]);
    }
}

#[test]
fn fragments_retransmitted_by_junior_are_delivered_once_even_during_reassembly() {
    let mut rig = Rig::new();
    let frames = of_junior(1, &message(102_400));
    // Each fragment four times, as if no acknowledgement arrived.
    for frame in &frames {
        for _try in 0..4 {
            rig.hear(frame);
            rig.pass(Duration::from_millis(100));
        }
    }
    let lengths: Vec<_> = rig.received().iter().map(|it| it.payload.len()).collect();
    assert_eq!(lengths, [102_400]);
    // The end again, after the message has been delivered.
    for frame in &frames[24..] {
        rig.hear(frame);
    }
    assert_eq!(rig.received(), []);
    assert_eq!(rig.endpoint.unfinished(), 0);
}

#[test]
fn a_junior_program_restarted_beside_its_engine_is_heard() {
    for (profile, heard) in [(Known::Junior, 2), (Known::Fkie, 2), (Known::Standard, 1)] {
        let mut rig = Rig::with(Config {
            profiles: vec![Assignment { id: PEER, profile }],
            ..Config::default()
        });
        // Junior's engine knows our address: nothing is broadcast.
        let first = Frame {
            flags: WANTED,
            ..from_peer(QUERY_HEARTBEAT)
        };
        rig.hear(&first);
        for _repeated in 0..3 {
            rig.pass(Duration::from_millis(100));
            rig.hear(&first);
        }
        rig.pass(Duration::from_millis(2000));
        rig.hear(&first);
        assert_eq!(rig.received().len(), heard, "{profile}");
    }
}

/// Receives a frame by unicast or multicast, whatever its flags say.
fn hear_as_sent(rig: &mut Rig, frame: &Frame, to_all: bool) {
    let datagram = judp::encode(frame).unwrap();
    let from = path(PEER_HOST);
    if to_all {
        rig.hear_datagram(
            Ingress {
                path: from,
                to_all: true,
            },
            datagram,
        );
    } else {
        rig.hear_datagram(from, datagram);
    }
}

#[test]
fn a_broadcast_without_its_flag_is_recognised_by_its_multicast_address() {
    // As recorded from fkie's node manager in Python.
    let call = Frame {
        flags: WANTED,
        ..from_peer(QUERY_HEARTBEAT)
    };
    for (to_all, heard) in [(true, 2), (false, 1)] {
        let mut rig = Rig::new();
        for _process in 0..2 {
            hear_as_sent(&mut rig, &call, to_all);
            rig.pass(Duration::from_millis(1500));
        }
        assert_eq!(rig.received().len(), heard, "to everybody: {to_all}");
        assert_eq!(rig.sent().len(), 2, "both are acknowledged");
    }
}

#[test]
fn a_peer_that_broadcasts_without_the_flag_from_number_1_gets_junior_sized_fragments() {
    let fragments = |to_all: bool, first: u16| {
        let mut rig = Rig::new();
        let call = Frame {
            flags: WANTED,
            sequence: first,
            ..from_peer(QUERY_HEARTBEAT)
        };
        hear_as_sent(&mut rig, &call, to_all);
        rig.vouch_for(PEER);
        rig.sent();
        rig.send(Outgoing {
            payload: message(102_400),
            ..to_peer()
        })
        .unwrap();
        rig.sent()[0].1.payload.len()
    };
    assert_eq!(fragments(true, 1), FRAGMENT);
    assert_eq!(fragments(true, 2), 1425, "anybody may call");
    assert_eq!(fragments(false, 1), 1425, "anybody may begin with 1");
}
