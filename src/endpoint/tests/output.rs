//! Outgoing datagrams: pacing, packing and batches.

use super::wire::{Conditions, Wire, large, reliable};
use super::*;

const OTHER: JausId = JausId::new(42, 1, 2);

fn with_packing(packing: Packing) -> Rig {
    let mut rig = Rig::with(Config {
        packing,
        ..Config::default()
    });
    rig.meet_peer();
    rig
}

fn messages(transmit: &Transmit) -> Vec<Frame> {
    judp::frames(transmit.payload.clone())
        .unwrap()
        .map(Result::unwrap)
        .collect()
}

fn unreliable(payload: Bytes, priority: Priority) -> Outgoing {
    Outgoing {
        priority,
        payload,
        ..to_peer()
    }
}

#[test]
fn a_large_message_leaves_no_faster_than_receivers_empty_their_buffers() {
    let mut rig = Rig::new();
    rig.meet_peer();
    let begin = rig.now;
    rig.send(unreliable(large(1 << 20), Priority::Standard))
        .unwrap();
    let burst = rig.transmits().len();
    let occupied = |datagrams: usize| datagrams * 2304;
    assert!((72..=92).contains(&burst), "{burst} datagrams at once");
    assert!(occupied(burst) <= 212_992);
    let mut sent = burst;
    while let Some(timeout) = rig.endpoint.poll_timeout() {
        assert!(timeout > rig.now);
        rig.pass(timeout - rig.now);
        let more = rig.transmits().len();
        assert!(occupied(more) <= 212_992, "{more} datagrams at once");
        sent += more;
    }
    assert_eq!(sent, 736);
    let took = rig.now - begin;
    let expected = Duration::from_secs_f64(occupied(736 - burst) as f64 / 200e6);
    assert!(
        took >= expected * 9 / 10 && took <= expected * 11 / 10,
        "{took:?} and not {expected:?}"
    );
}

#[test]
fn small_messages_do_not_queue_behind_a_large_one_that_is_paced() {
    let mut rig = Rig::new();
    rig.meet_peer();
    rig.send(unreliable(large(8 << 20), Priority::Standard))
        .unwrap();
    rig.transmits();
    rig.send(to_peer()).unwrap();
    assert_eq!(rig.transmits().len(), 1, "at once");
    rig.send(unreliable(large(100_000), Priority::High))
        .unwrap();
    rig.pass(Duration::from_millis(1));
    let sent = rig.sent();
    assert!(sent.len() > 10);
    let priorities = sent.iter().map(|(_, frame)| frame.flags.priority());
    assert!(
        priorities.is_sorted_by(|a, b| a >= b),
        "the urgent one overtakes"
    );
}

#[test]
fn without_pacing_everything_leaves_at_once() {
    let mut rig = Rig::with(Config {
        pacing: None,
        ..Config::default()
    });
    rig.meet_peer();
    rig.send(unreliable(large(1 << 20), Priority::Standard))
        .unwrap();
    assert_eq!(rig.transmits().len(), 736);
    assert_eq!(rig.endpoint.poll_timeout(), None);
}

#[test]
fn a_large_message_to_an_unknown_address_waits_for_it_though_nobody_asked_for_acknowledgements() {
    let mut wire = Wire::new(1, Conditions::default());
    let payload = large(1 << 20);
    wire.send(unreliable(payload.clone(), Priority::Standard));
    assert_eq!(wire.datagrams[0], 1);
    wire.run_for(Duration::from_secs(9));
    assert!(wire.delivered() == [payload]);
    assert_eq!(wire.results(), [], "no result was requested");
}

#[test]
fn what_waits_anyway_shares_a_datagram() {
    let mut rig = with_packing(Packing::Within(Duration::ZERO));
    for number in 0..200_u8 {
        let payload = Bytes::copy_from_slice(&[0x02, 0x22, number]);
        rig.send(unreliable(payload, Priority::Standard)).unwrap();
    }
    let transmits = rig.transmits();
    let lengths: Vec<_> = transmits.iter().map(|t| t.payload.len()).collect();
    assert_eq!(lengths, [1 + 84 * 17, 1 + 84 * 17, 1 + 32 * 17]);
    let numbers: Vec<_> = transmits
        .iter()
        .flat_map(messages)
        .map(|frame| frame.payload[2])
        .collect();
    assert!(numbers.into_iter().eq(0..200));
}

#[test]
fn messages_to_different_places_do_not_share_a_datagram() {
    let mut rig = with_packing(Packing::Within(Duration::ZERO));
    rig.hear_from(
        9,
        &Frame {
            source: OTHER,
            ..from_peer(QUERY_HEARTBEAT)
        },
    );
    for destination in [PEER, OTHER, PEER, JausId::EVERYONE] {
        rig.send(Outgoing {
            destination,
            ..to_peer()
        })
        .unwrap();
    }
    let transmits = rig.transmits();
    let places: Vec<_> = transmits
        .iter()
        .map(|it| (it.to, messages(it).len()))
        .collect();
    let to = |host| To::Peer(path(host).peer);
    assert_eq!(places, [(to(PEER_HOST), 2), (to(9), 1), (To::Group, 1)]);
}

#[test]
fn messages_wait_for_others_as_long_as_is_said_but_not_the_safety_critical() {
    let mut rig = with_packing(Packing::Within(Duration::from_millis(5)));
    rig.send(to_peer()).unwrap();
    rig.pass(Duration::from_millis(3));
    rig.send(unreliable(
        Bytes::from_static(QUERY_HEARTBEAT),
        Priority::High,
    ))
    .unwrap();
    assert_eq!(rig.transmits(), []);
    let stop = unreliable(
        Bytes::from_static(QUERY_HEARTBEAT),
        Priority::SafetyCritical,
    );
    rig.send(stop).unwrap();
    let urgent = rig.transmits();
    assert_eq!((urgent.len(), messages(&urgent[0]).len()), (1, 1));
    rig.pass(Duration::from_millis(2));
    let transmits = rig.transmits();
    assert_eq!((transmits.len(), messages(&transmits[0]).len()), (1, 2));
    assert_eq!(transmits[0].priority, Priority::High);
    assert_eq!(rig.endpoint.poll_timeout(), None);
}

#[test]
fn a_full_datagram_does_not_wait() {
    let mut rig = with_packing(Packing::Within(Duration::from_millis(5)));
    let half = || unreliable(large(700), Priority::Standard);
    (0..3).for_each(|_| drop(rig.send(half())));
    let transmits = rig.transmits();
    assert_eq!((transmits.len(), messages(&transmits[0]).len()), (1, 2));
    rig.pass(Duration::from_millis(5));
    assert_eq!(rig.transmits().len(), 1);
}

#[test]
fn messages_share_a_datagram_up_to_its_last_octet() {
    for (length, datagrams) in [(711, 1), (712, 2)] {
        let mut rig = with_packing(Packing::Within(Duration::ZERO));
        for length in [700, length] {
            rig.send(unreliable(large(length), Priority::Standard))
                .unwrap();
        }
        assert_eq!(rig.transmits().len(), datagrams, "{length}");
    }
}

#[test]
fn older_headers_are_not_packed() {
    let mut rig = with_packing(Packing::Within(Duration::from_millis(5)));
    rig.hear(&Frame {
        version: Version::As5669,
        ..from_peer(QUERY_IDENTIFICATION)
    });
    rig.send(to_peer()).unwrap();
    rig.send(to_peer()).unwrap();
    assert_eq!(rig.transmits().len(), 2);
}

fn segmenting() -> LinkProfile {
    LinkProfile {
        max_segments: 64,
        ..LinkProfile::judp(path(OUR_HOST).peer.socket())
    }
}

#[test]
fn fragments_leave_several_at_once_where_the_link_takes_them_so() {
    let mut rig = Rig::new();
    rig.meet_peer();
    rig.endpoint.add_link(WIRE, segmenting());
    let payload = large(100_000);
    rig.send(unreliable(payload.clone(), Priority::Standard))
        .unwrap();
    let transmits = rig.transmits();
    let shapes: Vec<_> = transmits
        .iter()
        .map(|t| (t.payload.len(), t.segment))
        .collect();
    // 70 fragments of 1425 octets and one of 250; the kernel accepts 45 in one call.
    let expected = [(45 * 1440, Some(1440)), (25 * 1440 + 265, Some(1440))];
    assert_eq!(shapes, expected);
    assert_eq!(rig.count(Counter::DatagramsSent), 71);
    let octets: Vec<u8> = transmits
        .iter()
        .flat_map(|t| t.payload.chunks(1440))
        .flat_map(|datagram| messages_of(datagram).payload)
        .collect();
    assert_eq!(octets, payload);
}

fn messages_of(datagram: &[u8]) -> Frame {
    let mut frames = judp::frames(Bytes::copy_from_slice(datagram)).unwrap();
    frames.next().unwrap().unwrap()
}

#[test]
fn acknowledgements_leave_several_at_once() {
    let mut rig = Rig::new();
    rig.meet_peer();
    rig.endpoint.add_link(WIRE, segmenting());
    for sequence in 1..=10 {
        let flags = Flags::default().with_acknowledgement(Acknowledgement::Request);
        rig.hear(&Frame {
            flags,
            sequence,
            ..from_peer(QUERY_IDENTIFICATION)
        });
    }
    let transmits = rig.transmits();
    assert_eq!(transmits.len(), 1);
    assert_eq!(
        (transmits[0].payload.len(), transmits[0].segment),
        (150, Some(15))
    );
}

#[test]
fn two_large_messages_to_two_places_take_turns_without_tearing_the_batches() {
    let mut rig = Rig::with(Config {
        initial_window: 128,
        ..Config::default()
    });
    rig.meet_peer();
    rig.hear_from(
        9,
        &Frame {
            source: OTHER,
            ..from_peer(QUERY_HEARTBEAT)
        },
    );
    rig.vouch_for(OTHER);
    rig.endpoint.add_link(WIRE, segmenting());
    for destination in [PEER, OTHER] {
        rig.send(Outgoing {
            destination,
            ..reliable(large(64 * 1425))
        })
        .unwrap();
    }
    let transmits = rig.transmits();
    let places: Vec<_> = transmits
        .iter()
        .map(|t| (t.to, t.payload.len() / 1440))
        .collect();
    let to = |host| To::Peer(path(host).peer);
    let expected = [(PEER_HOST, 32), (9, 32), (PEER_HOST, 32), (9, 32)];
    assert_eq!(places, expected.map(|(host, count)| (to(host), count)));
}

#[test]
fn datagrams_to_three_places_all_leave_with_packing_and_segments_together() {
    let mut rig = with_packing(Packing::Within(Duration::ZERO));
    rig.endpoint.add_link(WIRE, segmenting());
    let peers = [1, 2, 3].map(|component| JausId::new(43, 1, component));
    for (host, source) in (20..).zip(peers) {
        let heard = from_peer(QUERY_HEARTBEAT);
        rig.hear_from(host, &Frame { source, ..heard });
    }
    for _round in 0..3 {
        for destination in peers {
            rig.send(Outgoing {
                destination,
                ..to_peer()
            })
            .unwrap();
        }
    }
    let transmits = rig.transmits();
    let there = |host| To::Peer(path(host).peer);
    let octets = |host| -> usize {
        let mine = transmits.iter().filter(|it| it.to == there(host));
        mine.map(|it| messages(it).len()).sum()
    };
    assert_eq!([20, 21, 22].map(octets), [3; 3]);
}

#[test]
fn packed_datagrams_of_one_length_leave_together_and_lose_no_message() {
    let mut rig = with_packing(Packing::Within(Duration::ZERO));
    rig.endpoint.add_link(WIRE, segmenting());
    let lengths = [3, 900, 3, 1400, 700, 700, 20];
    for (number, length) in (0..210_u8).zip(lengths.into_iter().cycle()) {
        let mut payload = vec![number; length];
        payload[..2].copy_from_slice(QUERY_HEARTBEAT);
        rig.send(unreliable(payload.into(), Priority::Standard))
            .unwrap();
    }
    let transmits = rig.transmits();
    assert!(transmits.iter().any(|it| it.segment.is_some()));
    let numbers = transmits.iter().flat_map(|it| {
        let octets = it.segment.unwrap_or(it.payload.len());
        let datagrams = it.payload.chunks(octets);
        datagrams.flat_map(|datagram| {
            let frames = judp::frames(Bytes::copy_from_slice(datagram)).unwrap();
            frames.map(|frame| frame.unwrap().payload[2])
        })
    });
    assert!(numbers.eq(0..210));
    assert_eq!(rig.count(Counter::StaleOctets), 0);
}

#[test]
fn what_waits_for_a_link_that_is_removed_is_counted() {
    let mut rig = with_packing(Packing::Within(Duration::from_millis(5)));
    rig.send(unreliable(large(10 * 1425), Priority::Standard))
        .unwrap();
    rig.send(unreliable(large(1425), Priority::Standard))
        .unwrap();
    (0..3).for_each(|_| drop(rig.send(to_peer())));
    rig.endpoint.remove_link(WIRE);
    let fragments_and_messages = 10 + 4;
    assert_eq!(rig.count(Counter::LinkGone), fragments_and_messages);
    assert_eq!(
        (rig.transmits(), rig.endpoint.poll_timeout()),
        (vec![], None)
    );
    rig.endpoint.add_link(WIRE, segmenting());
    rig.hear(&from_peer(QUERY_HEARTBEAT));
    assert!(
        (0..1024).all(|_| rig.send(to_peer()).is_ok()),
        "nothing left"
    );
}

#[test]
fn messages_on_a_connection_are_not_joined() {
    let mut rig = with_packing(Packing::Within(Duration::from_millis(5)));
    let connection = LinkId(1);
    let profile = LinkProfile {
        framing: crate::wire::Framing::Jtcp,
        ..LinkProfile::default()
    };
    rig.endpoint.add_link(connection, profile);
    let path = Path {
        link: connection,
        ..path(3)
    };
    let source = JausId::new(43, 1, 1);
    let frame = Frame {
        source,
        ..from_peer(QUERY_HEARTBEAT)
    };
    rig.endpoint
        .handle_frame(rig.now, path, &frame, &mut rig.inbox);
    for _message in 0..3 {
        rig.send(Outgoing {
            destination: source,
            ..to_peer()
        })
        .unwrap();
    }
    let sent = rig.transmits();
    assert_eq!(sent.len(), 3, "each in its own message, and at once");
}

#[test]
fn messages_to_one_who_reads_the_first_of_a_datagram_are_not_joined() {
    let mut rig = with_packing(Packing::Within(Duration::from_millis(5)));
    let profile = LinkProfile {
        reads_one: true,
        ..LinkProfile::judp([])
    };
    rig.endpoint.add_link(WIRE, profile);
    rig.meet_peer();
    (0..3).for_each(|_| drop(rig.send(to_peer())));
    assert_eq!(rig.transmits().len(), 3, "each alone, and at once");
}

#[test]
fn a_message_that_is_to_be_acknowledged_does_not_wait_for_others() {
    let [alone, packed] =
        [Packing::Off, Packing::Within(Duration::from_millis(2))].map(|packing| {
            let mut rig = with_packing(packing);
            for number in 0..100_u8 {
                let payload = vec![0x02, 0x22, number].into();
                rig.send(reliable(payload)).unwrap();
            }
            let sent = rig.transmits();
            sent.iter()
                .map(|transmit| messages(transmit).len())
                .sum::<usize>()
        });
    assert_eq!(alone, packed);
    assert!(alone > 1, "{alone}");
}

#[test]
fn what_goes_to_a_link_that_is_gone_is_counted_and_holds_no_place() {
    let mut rig = Rig::with(Config {
        static_peers: vec![StaticPeer {
            id: PEER,
            path: Path {
                link: LinkId(9),
                ..path(9)
            },
            gets_broadcasts: true,
        }],
        queue_limit: 4,
        ..Config::default()
    });
    for _time in 0..10 {
        let everybody = Outgoing {
            destination: JausId::EVERYONE,
            ..to_peer()
        };
        rig.send(everybody).unwrap();
        assert_eq!(rig.transmits().len(), 1);
    }
    assert_eq!(rig.count(Counter::LinkGone), 10);
}

#[test]
fn urgent_messages_leave_several_at_once_and_do_not_wait_for_longer_ones() {
    let mut rig = with_packing(Packing::Within(Duration::ZERO));
    rig.endpoint.add_link(WIRE, segmenting());
    for length in [600, 1400, 1400] {
        rig.send(unreliable(large(length), Priority::SafetyCritical))
            .unwrap();
    }
    let transmits = rig.transmits();
    let shapes = transmits.iter().map(|it| (it.payload.len(), it.segment));
    assert!(shapes.eq([(615, None), (2 * 1415, Some(1415))]));
}

#[test]
fn removing_a_link_leaves_what_waits_on_others() {
    let mut rig = with_packing(Packing::Within(Duration::from_millis(5)));
    let second = LinkProfile::judp(path(OUR_HOST).peer.socket());
    rig.endpoint.add_link(LinkId(1), second);
    rig.send(Outgoing {
        destination: JausId::EVERYONE,
        ..to_peer()
    })
    .unwrap();
    rig.endpoint.remove_link(LinkId(1));
    assert_eq!(rig.count(Counter::LinkGone), 1);
    let due = rig.now + Duration::from_millis(5);
    assert_eq!(rig.endpoint.poll_timeout(), Some(due));
    rig.pass(Duration::from_millis(5));
    let links: Vec<_> = rig.transmits().iter().map(|it| it.link).collect();
    assert_eq!(links, [WIRE]);
    rig.send(to_peer()).unwrap();
    rig.endpoint.remove_link(WIRE);
    assert_eq!(rig.endpoint.poll_timeout(), None);
}
