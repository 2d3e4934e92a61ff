//! Special handling of peers that depart from the standard, and only of those.

use super::*;
use crate::peer::{Assignment, Implementation as Known};
use crate::wire::{DataControl, Kind};

const CODE: [u8; 2] = [0x01, 0x4B];

fn assigned(profile: Known) -> Config {
    Config {
        profiles: vec![Assignment {
            id: PEER.whole_subsystem(),
            profile,
        }],
        ..Config::default()
    }
}

fn message(octets: usize) -> Bytes {
    let rest = (0..octets - CODE.len()).map(|octet| octet as u8);
    CODE.into_iter().chain(rest).collect()
}

/// A large message as JAUS++ cuts it. It marks no last fragment if the message fills them all.
fn of_jauspp(first: u16, message: &Bytes) -> Vec<Frame> {
    let body = &message[CODE.len()..];
    let count = body.len().div_ceil(1571);
    let pieces = body.chunks(1571).enumerate();
    pieces
        .map(|(index, piece)| {
            let data = match index {
                0 => DataControl::First,
                _ if index + 1 == count && piece.len() < 1571 => DataControl::Last,
                _ => DataControl::Middle,
            };
            Frame {
                flags: Flags::default().with_data(data),
                sequence: first + index as u16,
                payload: [&CODE, piece].concat().into(),
                ..from_peer(b"")
            }
        })
        .collect()
}

fn payloads(rig: &mut Rig) -> Vec<Bytes> {
    rig.received().into_iter().map(|it| it.payload).collect()
}

#[test]
fn a_message_of_jauspp_that_fills_its_fragments_is_whole_with_the_next_message() {
    let mut rig = Rig::new();
    let full = message(2 + 2 * 1571);
    for frame in of_jauspp(5, &full) {
        rig.hear(&frame);
    }
    assert_eq!(payloads(&mut rig), Vec::<Bytes>::new());
    // JAUS++ reuses the number of the last fragment for its next message.
    rig.hear(&Frame {
        sequence: 6,
        destination: JausId::EVERYONE,
        ..from_peer(QUERY_IDENTIFICATION)
    });
    let next = Bytes::from_static(QUERY_IDENTIFICATION);
    assert_eq!(payloads(&mut rig), [full.clone(), next]);
    assert_eq!(rig.endpoint.unfinished(), 0);
    // A message whose end was lost does not count as complete.
    for frame in of_jauspp(20, &full) {
        rig.hear(&frame);
    }
    rig.hear(&Frame {
        sequence: 22,
        ..from_peer(QUERY_IDENTIFICATION)
    });
    assert_eq!(payloads(&mut rig).len(), 1);
}

#[test]
fn a_strict_peers_fragments_are_never_whole_without_a_last_one() {
    let mut rig = Rig::new();
    let octets = message(2 * 1573);
    let parts = [(DataControl::First, 1), (DataControl::Middle, 2)];
    for ((data, sequence), part) in parts.into_iter().zip(octets.chunks(1573)) {
        rig.hear(&Frame {
            flags: Flags::default().with_data(data),
            sequence,
            payload: Bytes::copy_from_slice(part),
            ..from_peer(b"")
        });
    }
    rig.hear(&Frame {
        sequence: 2,
        ..from_peer(QUERY_IDENTIFICATION)
    });
    assert_eq!(payloads(&mut rig).len(), 1, "the query alone");
}

#[test]
fn to_jauspp_no_packet_is_longer_than_it_takes_and_numbers_do_not_go_round() {
    let config = |profile| Config {
        payload_limit: 4079,
        first_sequence: 65_530,
        ..assigned(profile)
    };
    for (profile, longest, repeats) in [
        (Known::JausPlusPlus, 1425, true),
        (Known::Junior, 4079, false),
        (Known::Standard, 4079, false),
    ] {
        let mut rig = Rig::with(config(profile));
        rig.meet_peer();
        let large = message(20_000);
        rig.send(Outgoing {
            payload: large.clone(),
            ..to_peer()
        })
        .unwrap();
        let sent: Vec<_> = rig.sent().into_iter().map(|(_, frame)| frame).collect();
        assert_eq!(sent[0].payload.len(), longest, "{profile}");
        assert_eq!(
            sent.iter().all(|frame| frame.payload.starts_with(&CODE)),
            repeats,
            "{profile}"
        );
        let skip = if repeats { 2 } else { 0 };
        let joined = crate::wire::large::join(sent.iter().map(|frame| &frame.payload), skip);
        assert_eq!(joined, large);
        let numbers: Vec<_> = sent.iter().map(|frame| frame.sequence).collect();
        assert!(numbers[0] > 0, "{numbers:?}");
        let consecutive = |pair: &[u16]| pair[1] == pair[0] + 1;
        assert!(numbers.windows(2).all(consecutive), "{numbers:?}");
    }
}

#[test]
fn who_is_recognised_for_sure_is_treated_so_and_shown() {
    let mut rig = Rig::new();
    rig.meet_peer();
    let profile = |rig: &Rig| rig.endpoint.peers().next().unwrap().profile;
    assert_eq!(profile(&rig), Known::Standard);
    // Stale octets alone are not sufficient; together with a registration from another subsystem
    // they are.
    let stale = Frame {
        sequence: 901,
        ..from_peer(QUERY_HEARTBEAT)
    };
    let octets = [&judp::encode(&stale).unwrap()[..], b"\x01\x4Burn:"].concat();
    rig.hear_octets(PEER_HOST, octets.into());
    assert_eq!(profile(&rig), Known::Standard);
    let registration = b"\x00\x0B\x01\x18urn:jaus:jss:core:Events\x01\x00";
    rig.hear(&Frame {
        sequence: 902,
        ..from_peer(registration)
    });
    assert_eq!(profile(&rig), Known::JausPlusPlus);
    rig.send(Outgoing {
        payload: message(4000),
        ..to_peer()
    })
    .unwrap();
    let repeats = |(_, frame): &(To, Frame)| frame.payload.starts_with(&CODE);
    assert!(rig.sent().iter().all(repeats));
}

#[test]
fn who_is_configured_is_what_it_is_said_to_be() {
    let mut rig = Rig::with(assigned(Known::Standard));
    for frame in of_jauspp(1, &message(5000)) {
        rig.hear(&frame);
    }
    let [joined] = &payloads(&mut rig)[..] else {
        panic!("one message")
    };
    assert_eq!(joined.len(), 5000 + 3 * 2, "no code is left out");
    assert_eq!(
        rig.endpoint.peers().next().unwrap().profile,
        Known::Standard
    );
}

/// A link for incoming connections.
const CONNECTIONS: LinkId = LinkId(1);

fn add_connections(rig: &mut Rig) {
    let stream = LinkProfile {
        framing: crate::wire::Framing::Jtcp,
        ..LinkProfile::default()
    };
    rig.endpoint.add_link(CONNECTIONS, stream);
}

/// The links on which a peer is answered after a query on its connection.
fn links_of_answer(rig: &mut Rig) -> Vec<LinkId> {
    let connection = Path {
        link: CONNECTIONS,
        peer: SocketAddr::from(([10, 0, 0, PEER_HOST], 33_918)).into(),
    };
    let frame = from_peer(QUERY_IDENTIFICATION);
    rig.endpoint
        .handle_frame(rig.now, connection, &frame, &mut rig.inbox);
    rig.send(to_peer()).unwrap();
    rig.transmits().iter().map(|it| it.link).collect()
}

#[test]
fn jauspp_that_connects_is_answered_where_it_reads() {
    for (profile, expected) in [
        (Known::JausPlusPlus, WIRE),
        (Known::Junior, CONNECTIONS),
        (Known::Standard, CONNECTIONS),
    ] {
        let mut rig = Rig::with(assigned(profile));
        add_connections(&mut rig);
        rig.meet_peer();
        let links = links_of_answer(&mut rig);
        assert_eq!(links, [expected], "{profile}");
    }
}

#[test]
fn who_repeats_the_version_octet_on_a_stream_is_answered_by_datagram_before_it_is_known() {
    for (repeats, expected) in [(true, WIRE), (false, CONNECTIONS)] {
        let mut rig = Rig::new();
        add_connections(&mut rig);
        rig.meet_peer();
        if repeats {
            rig.endpoint.handle_repeated_version(PEER);
        }
        let links = links_of_answer(&mut rig);
        assert_eq!(links, [expected], "repeats: {repeats}");
    }
}

#[test]
fn a_call_of_junior_is_acknowledged_by_the_one_alone_from_its_own_address() {
    let mut rig = Rig::new();
    rig.endpoint.attach(SIBLING).unwrap();
    // Recorded flags: standard priority, global broadcast, acknowledgement requested; for one id.
    let call = Frame {
        flags: Flags(0x19),
        ..from_peer(QUERY_HEARTBEAT)
    };
    rig.hear(&call);
    let received = rig.received();
    assert_eq!(received.len(), 1);
    assert_eq!(received[0].to, US);
    let sent = rig.sent();
    let [(To::Peer(to), answer)] = &sent[..] else {
        panic!("one acknowledgement: {sent:?}")
    };
    assert_eq!(*to, path(PEER_HOST).peer);
    assert_eq!((answer.source, answer.sequence), (US, 1));
    assert_eq!(answer.flags, Flags(0x31), "as Junior answers Junior");
}

#[test]
fn juniors_priority_zero_fault_is_dropped_and_counted_by_its_name() {
    let mut rig = Rig::new();
    rig.meet_peer();
    rig.hear(&Frame {
        flags: Flags(0xFF),
        ..from_peer(QUERY_IDENTIFICATION)
    });
    assert_eq!((rig.events(), rig.received()), (vec![], vec![]));
    assert_eq!(rig.count(Counter::PriorityFault), 1);
    assert_eq!(rig.endpoint.peers().next().unwrap().profile, Known::Junior);
}

#[test]
fn the_first_octet_of_all_that_is_sent_is_zero() {
    let mut rig = Rig::new();
    // An offer of header compression, with its two octets after the size.
    let head = [2, 0x40, 18, 0, 0, 0, 0x19];
    let ids = [US.to_wire(), PEER.to_wire()].concat();
    let octets = [&head[..], &ids, QUERY_HEARTBEAT, &[1, 0]].concat();
    rig.hear_octets(PEER_HOST, octets.into());
    assert_eq!(rig.received().len(), 1);
    rig.vouch_for(PEER);
    for acknowledge in [false, true] {
        for octets in [3, 4000] {
            rig.send(Outgoing {
                payload: message(octets),
                acknowledge,
                ..to_peer()
            })
            .unwrap();
        }
    }
    let sent = rig.sent();
    assert!(sent.len() >= 9, "{}", sent.len());
    assert!(sent.iter().all(|(_, frame)| frame.kind == Kind(0)));
}

#[test]
fn a_zero_stands_for_all_from_those_who_mean_it_so_and_from_nobody_else() {
    let zeros = [id("101.0.0"), id("0.0.0"), id("101.1.0")];
    for (profile, delivered) in [
        (Known::Iop, true),
        (Known::Jts, true),
        (Known::Standard, false),
        (Known::Junior, false),
        (Known::Fkie, false),
    ] {
        for destination in zeros {
            let mut rig = Rig::with(assigned(profile));
            rig.hear(&Frame {
                destination,
                ..from_peer(QUERY_HEARTBEAT)
            });
            let received = rig.received();
            assert_eq!(received.len(), usize::from(delivered), "{profile}");
            let all_of_us = |it: &Received| it.destination == destination.with_zeros_for_all();
            assert!(received.iter().all(all_of_us));
        }
    }
    let mut rig = Rig::with(assigned(Known::Iop));
    rig.hear(&Frame {
        destination: id("102.0.0"),
        ..from_peer(QUERY_HEARTBEAT)
    });
    assert_eq!(rig.received(), [], "another subsystem's");
}

#[test]
fn numbers_that_count_for_each_destination_are_no_duplicates() {
    let mut rig = Rig::new();
    rig.endpoint.attach(SIBLING).unwrap();
    // As recorded from the judging tool: 1, 2, 3 … to each destination.
    let destinations = [US, SIBLING, US.whole_node(), JausId::EVERYONE];
    for sequence in 1..=3 {
        for destination in destinations {
            rig.hear(&Frame {
                destination,
                sequence,
                ..from_peer(QUERY_HEARTBEAT)
            });
        }
    }
    assert_eq!(rig.received().len(), 3 * (1 + 1 + 2 + 2));
    assert_eq!(rig.count(Counter::Duplicate), 0);
    // Large messages to two destinations with the same numbers do not mix.
    let to = |destination, octet: u8| {
        let piece = |data, sequence, payload: Vec<u8>| Frame {
            destination,
            sequence,
            flags: Flags::default().with_data(data),
            payload: payload.into(),
            ..from_peer(b"")
        };
        [
            piece(DataControl::First, 9, vec![octet; 100]),
            piece(DataControl::Last, 10, vec![octet; 50]),
        ]
    };
    let ([one, two], [three, four]) = (to(US, 1), to(SIBLING, 2));
    for frame in [one, three, two, four] {
        rig.hear(&frame);
    }
    assert_eq!(payloads(&mut rig), [vec![1; 150], vec![2; 150]]);
}

/// The lengths of the fragments of a 100 KiB message, acknowledged packet by packet if requested,
/// and the time they take.
fn fragments_to(profile: Known, acknowledge: bool) -> (Vec<usize>, Duration) {
    let mut rig = Rig::with(assigned(profile));
    rig.meet_peer();
    let begin = rig.now;
    rig.send(Outgoing {
        payload: message(102_400),
        acknowledge,
        ..to_peer()
    })
    .unwrap();
    let mut lengths = Vec::new();
    while lengths.iter().sum::<usize>() < 102_400 {
        for (_, frame) in rig.sent() {
            lengths.push(frame.payload.len());
            if acknowledge {
                let flags = Flags::default().with_acknowledgement(Acknowledgement::Positive);
                let sequence = frame.sequence;
                rig.hear(&Frame {
                    flags,
                    sequence,
                    ..from_peer(b"")
                });
            }
        }
        rig.pass(Duration::from_millis(1));
    }
    (lengths, rig.now - begin)
}

#[test]
fn to_junior_large_messages_have_no_more_fragments_than_it_keeps() {
    for acknowledge in [false, true] {
        for profile in [Known::Junior, Known::Jts, Known::Fkie] {
            let (lengths, _) = fragments_to(profile, acknowledge);
            assert_eq!((lengths[0], lengths.len()), (4079, 26), "{profile}");
        }
        let (lengths, _) = fragments_to(Known::Standard, acknowledge);
        assert_eq!(
            (lengths[0], lengths.len()),
            (1425, 72),
            "others need none of that"
        );
    }
    // Messages that it can keep travel in packets that no router needs to fragment.
    let mut rig = Rig::with(assigned(Known::Junior));
    rig.meet_peer();
    let payload = message(50 * 1425);
    rig.send(Outgoing {
        payload,
        ..to_peer()
    })
    .unwrap();
    assert_eq!(rig.sent()[0].1.payload.len(), 1425);
}

#[test]
fn to_junior_large_messages_leave_no_faster_than_its_buffer_is_emptied() {
    let (_, usual) = fragments_to(Known::Standard, false);
    let (_, gentle) = fragments_to(Known::Junior, false);
    assert!(usual < Duration::from_millis(3), "{usual:?}");
    let expected = Duration::from_millis(10)..Duration::from_millis(40);
    assert!(expected.contains(&gentle), "{gentle:?}");
}

#[test]
fn to_jauspp_large_messages_leave_no_faster_than_it_reads_datagrams() {
    let (fragments, time) = fragments_to(Known::JausPlusPlus, false);
    // Fragments that fit its buffer leave at once; the others at less than its 900 per second.
    let later = fragments.len() as u32 - 28;
    let fastest = Duration::from_secs(1) / 900 * later;
    assert!(
        (fastest..fastest * 2).contains(&time),
        "{later} in {time:?}"
    );
}
