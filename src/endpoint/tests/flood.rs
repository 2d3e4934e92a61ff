//! Floods of invented senders: bounded cost, and undisturbed conversations.

use super::*;
use crate::rights::Verdict;
use crate::wire::DataControl;

const FLOOD: u32 = 100_000;
const SOURCES: u32 = 10_000;
/// Packets of the flood between two messages of the conversation.
const BETWEEN: u32 = 50;

/// The id of an invented sender.
fn invented(number: u32) -> JausId {
    let number = number % SOURCES;
    JausId::new(1000 + (number / 250) as u16, 1, (number % 250 + 1) as u8)
}

/// A packet of the flood, in alternating kinds.
fn packet(number: u32) -> Frame {
    use crate::wire::DataControl::{First, Middle};
    let ask = Flags::default().with_acknowledgement(Acknowledgement::Request);
    let flags = match number % 5 {
        0 => Flags::default(),
        1 => ask,
        2 => Flags::default().with_data(First),
        3 => Flags::default().with_data(Middle),
        _ => Flags::default().with_acknowledgement(Acknowledgement::Positive),
    };
    let payload = match number % 5 {
        4 => Bytes::new(),
        _ => Bytes::from(vec![number as u8; 40]),
    };
    Frame {
        flags,
        sequence: (number * 31) as u16,
        ..Frame::new(invented(number), US, payload)
    }
}

/// A message of [`PEER`] that requests an acknowledgement and contains a number.
fn said(number: u32) -> Frame {
    let [one, two, three, four] = number.to_le_bytes();
    let ask = Flags::default().with_acknowledgement(Acknowledgement::Request);
    Frame {
        flags: ask,
        sequence: number as u16,
        ..Frame::new(PEER, US, vec![2, 0x22, one, two, three, four].into())
    }
}

/// Floods an endpoint from `hosts` addresses, 100 packets per millisecond, while [`PEER`] and
/// [`US`] talk. Each of the peer's messages arrives twice, as if not acknowledged.
fn flood(hosts: u32, config: Config) -> Rig {
    let mut rig = Rig::with(config);
    rig.hear(&from_peer(QUERY_HEARTBEAT));
    rig.vouch_for(PEER);
    rig.send(to_peer()).unwrap();
    let _ = (rig.events(), rig.received(), rig.transmits());
    let mut heard = 0;
    for number in 0..FLOOD {
        let host = SocketAddr::from((
            [
                172,
                16,
                (number % hosts / 250) as u8,
                (number % hosts % 250) as u8,
            ],
            4000,
        ));
        let from = Path {
            link: WIRE,
            peer: host.into(),
        };
        let datagram = judp::encode(&packet(number)).unwrap();
        rig.hear_datagram(from, datagram);
        if number % BETWEEN == 0 {
            let turn = number / BETWEEN;
            rig.hear(&said(turn));
            if turn >= 200 {
                rig.hear(&said(turn - 200));
            }
            let from_peer = |message: &&Received| message.source == PEER;
            let received = rig.received();
            let mine: Vec<_> = received.iter().filter(from_peer).collect();
            assert_eq!(mine.len(), 1, "each message once, at {number}");
            assert_eq!(mine[0].payload[2..], turn.to_le_bytes());
            heard += 1;
            rig.send(to_peer()).unwrap();
            let peer = To::Peer(path(PEER_HOST).peer);
            let to_peer = rig.sent().into_iter().filter(|(to, _)| *to == peer).count();
            assert!(
                to_peer >= 2,
                "our message and an acknowledgement, at {number}"
            );
        }
        rig.now += Duration::from_micros(10);
    }
    assert_eq!(heard, FLOOD / BETWEEN);
    rig
}

/// Checks the default bounds: 1024 peers, 1024 buckets, 40 960 fingerprints and 32 MiB of
/// fragments. [`PEER`] must still be known.
fn is_bounded(rig: &Rig) {
    let config = Config::default();
    assert!(rig.endpoint.peers().count() <= config.limits.max_peers);
    assert!(rig.endpoint.gate.new_ids.len() <= config.limits.max_peers);
    assert!(rig.endpoint.heard.len() <= config.max_recent * 5 / 2);
    assert!(rig.endpoint.reassembly.cost() <= config.max_reassembly);
    assert!(rig.endpoint.peers().any(|peer| peer.id == PEER));
}

#[test]
fn a_flood_from_one_address_is_kept_out_and_a_conversation_goes_on() {
    let rig = flood(1, Config::default());
    is_bounded(&rig);
    let learned = 1024 + 64 * 2;
    assert!(rig.count(Counter::NewIdRate) > u64::from(FLOOD) * 8 / 10);
    assert!(rig.count(Counter::PeersEvicted) <= learned);
}

#[test]
fn a_flood_from_many_addresses_pushes_out_only_itself() {
    let rig = flood(10_000, Config::default());
    is_bounded(&rig);
    assert!(rig.count(Counter::PeersEvicted) > 0);
    assert!(
        rig.count(Counter::NewIdRate) > 0,
        "most find no bucket of their own"
    );
}

#[test]
fn with_configured_rates_a_flood_is_cut_off_at_the_gate() {
    let config = Config {
        limits: Limits {
            messages_per_address: Some(Rate::new(10_000, 1000)),
            ..Limits::default()
        },
        ..Config::default()
    };
    let rig = flood(1, config);
    let passed = u64::from(FLOOD) - rig.count(Counter::MessageRate);
    assert!((9_000..=13_000).contains(&passed), "{passed} in a second");
}

#[test]
fn who_is_denied_is_not_heard() {
    let access = Access {
        deny_networks: vec!["10.0.0.2".parse().unwrap()],
        allow_subsystems: vec!["42".parse().unwrap()],
        ..Access::default()
    };
    let mut rig = Rig::with(Config {
        access,
        ..Config::default()
    });
    rig.hear(&from_peer(QUERY_HEARTBEAT));
    rig.hear_from(
        3,
        &Frame {
            source: id("43.1.1"),
            ..from_peer(QUERY_HEARTBEAT)
        },
    );
    assert!(rig.is_silent());
    let denied = [Counter::NetworkDenied, Counter::SubsystemDenied];
    assert_eq!(denied.map(|counter| rig.count(counter)), [1, 1]);
    rig.hear_from(3, &from_peer(QUERY_HEARTBEAT));
    assert_eq!(rig.received().len(), 1);
}

/// Of a plain link; secure links have rules for each key.
#[test]
fn who_has_no_right_to_a_message_is_refused_and_counted() {
    let grant = |text: &str| text.parse().unwrap();
    let access = Access {
        grants: vec![grant("42 control=99"), grant("43 observe")],
        ..Access::default()
    };
    let mut rig = Rig::with(Config {
        access,
        ..Config::default()
    });
    let request = |authority: u8| Bytes::from(vec![0x0D, 0x00, authority]);
    let query = Bytes::from_static(QUERY_HEARTBEAT);
    for (number, (source, payload, is_heard)) in [
        ("42.1.1", request(99), true),
        ("42.1.1", request(100), false),
        ("43.1.1", query.clone(), true),
        ("43.1.1", request(1), false),
        ("44.1.1", query, false),
        // No definition has it.
        ("42.1.1", Bytes::from_static(b"\xBC\xDA"), false),
    ]
    .into_iter()
    .enumerate()
    {
        rig.hear(&Frame {
            sequence: number as u16,
            ..Frame::new(id(source), US, payload)
        });
        assert_eq!(!rig.received().is_empty(), is_heard, "{number}");
    }
    assert_eq!(rig.count(Counter::NotGranted), 4);
}

/// A rig whose operators of subsystem 42 may observe.
fn watched() -> Rig {
    let access = Access {
        grants: vec!["42 observe".parse().unwrap()],
        ..Access::default()
    };
    let mut rig = Rig::with(Config {
        access,
        ..Config::default()
    });
    rig.endpoint.record_decisions();
    rig
}

fn decisions(rig: &mut Rig) -> Vec<(String, u64)> {
    let decided = std::iter::from_fn(|| rig.endpoint.poll_decision());
    decided
        .map(|it| (it.decision.to_string(), it.times))
        .collect()
}

fn request_control() -> Frame {
    from_peer(b"\x0D\x00\x64")
}

#[test]
fn a_refused_request_is_answered_and_recorded_once_with_its_number() {
    let mut rig = watched();
    rig.hear(&request_control());
    let answers = rig.sent();
    let (to, answer) = &answers[0];
    assert_eq!((answers.len(), *to), (1, To::Peer(path(PEER_HOST).peer)));
    assert_eq!(answer.payload[..], b"\x0F\x00\x02"[..]);
    assert_eq!((answer.source, answer.destination), (US, PEER));
    for sequence in 2..=5 {
        rig.hear(&Frame {
            sequence,
            ..request_control()
        });
    }
    assert_eq!(rig.endpoint.route(PEER), None, "nothing is learned");
    let decided = decisions(&mut rig);
    assert_eq!(decided.len(), 1);
    assert!(
        decided[0].0.starts_with("RequestControl from 42.1.1"),
        "{decided:?}"
    );
    assert_eq!(decided[0].1, 5);
}

#[test]
fn a_flood_of_refusals_does_not_displace_what_was_done() {
    let mut rig = watched();
    for number in 0..1000_u16 {
        let [low, high] = number.to_le_bytes();
        rig.hear(&Frame {
            sequence: number,
            ..Frame::new(PEER, US, Bytes::from(vec![low, 0xDA + high, 0]))
        });
    }
    rig.hear(&from_peer(b"\x06\x00\x01\x00"));
    let decided = decisions(&mut rig);
    assert!(
        decided.iter().any(|it| it.0.starts_with("SetEmergency")),
        "{decided:?}"
    );
    assert_eq!(decided.len(), 257);
    assert!(rig.count(Counter::DecisionsLost) > 0);
}

#[test]
fn a_message_is_recorded_when_it_is_delivered_and_once() {
    let access = Access {
        grants: vec!["42 control=127 configure".parse().unwrap()],
        ..Access::default()
    };
    let mut rig = Rig::with(Config {
        access,
        ..Config::default()
    });
    rig.endpoint.record_decisions();
    rig.meet_peer();
    let asked = Frame {
        flags: Flags::default().with_acknowledgement(Acknowledgement::Request),
        ..request_control()
    };
    rig.inbox.full = vec![US];
    rig.hear(&asked);
    assert_eq!(decisions(&mut rig), [], "there was no room");
    rig.inbox.full.clear();
    for _ in 0..3 {
        rig.pass(Duration::from_millis(100));
        rig.hear(&asked);
    }
    assert_eq!(
        (rig.received().len(), rig.count(Counter::Duplicate)),
        (1, 2)
    );
    let decided = decisions(&mut rig);
    assert_eq!(decided.len(), 1, "{decided:?}");
    assert_eq!(decided[0].1, 1, "repetitions are not delivered");
    // A large message counts when its last part is there.
    let parts = [
        (DataControl::First, &b"\x0D\x00\x64"[..]),
        (DataControl::Last, b"\x00"),
    ];
    for (number, (data, payload)) in parts.into_iter().enumerate() {
        assert_eq!(decisions(&mut rig), [], "it is not complete");
        rig.hear(&Frame {
            flags: Flags::default().with_data(data),
            sequence: 10 + number as u16,
            ..from_peer(payload)
        });
    }
    assert_eq!((rig.received().len(), decisions(&mut rig).len()), (1, 1));
}

#[test]
fn what_cannot_be_recorded_is_refused_but_stops_are_not() {
    let mut rig = Rig::new();
    rig.endpoint.refuse_commands(true);
    rig.hear(&request_control());
    assert!(rig.received().is_empty());
    rig.hear(&from_peer(b"\x04\x00"));
    assert!(rig.received().is_empty(), "Resume");
    for (number, stop) in [&b"\x06\x00\x01\x00"[..], b"\x03\x00", b"\x12\xD1"]
        .into_iter()
        .enumerate()
    {
        rig.hear(&from_peer(stop));
        assert_eq!(rig.received().len(), 1, "{number}");
    }
    assert_eq!(rig.count(Counter::NotGranted), 2);
}

#[test]
fn what_components_tell_clients_of_plain_links_is_recorded() {
    let mut rig = watched();
    rig.meet_peer();
    for told in [&b"\x0F\x00\x00"[..], b"\x10\x00\x00", QUERY_HEARTBEAT] {
        let told = Outgoing::new(US, PEER, Bytes::from_static(told));
        rig.send(told).unwrap();
    }
    let told = std::iter::from_fn(|| rig.endpoint.poll_decision());
    let told: Vec<_> = told.map(|it| it.decision.verdict).collect();
    assert_eq!(told, [Verdict::Granted, Verdict::Ended]);
}

#[test]
fn a_message_for_others_is_neither_decided_on_nor_answered() {
    let mut rig = watched();
    rig.hear(&Frame {
        destination: id("102.1.1"),
        ..request_control()
    });
    assert_eq!(rig.count(Counter::NotForUs), 1);
    assert!(rig.sent().is_empty() && decisions(&mut rig).is_empty());
}

#[test]
fn a_stop_for_all_reaches_those_that_its_sender_may_reach() {
    let grant = |text: String| text.parse().unwrap();
    let access = Access {
        grants: vec![
            grant(format!("42 with={US},9.9.9")),
            grant("43 with=9.9.9".to_owned()),
        ],
        ..Access::default()
    };
    let mut rig = Rig::with(Config {
        access,
        ..Config::default()
    });
    let stop = Bytes::from_static(b"\x06\0\x01\0");
    for (source, is_heard) in [("42.1.1", true), ("43.1.1", false)] {
        rig.hear(&Frame::new(id(source), JausId::EVERYONE, stop.clone()));
        let heard: Vec<_> = rig.received();
        assert_eq!(!heard.is_empty(), is_heard, "{source}");
    }
    assert_eq!(rig.count(Counter::NotGranted), 0);
}

#[test]
fn a_bound_id_is_refused_from_other_networks_and_counted() {
    let access = Access {
        bind: vec!["42.255.255@10.0.0.2".parse().unwrap()],
        ..Access::default()
    };
    let mut rig = Rig::with(Config {
        access,
        ..Config::default()
    });
    rig.hear_from(3, &from_peer(QUERY_HEARTBEAT));
    assert!(rig.is_silent());
    assert_eq!(rig.count(Counter::BoundElsewhere), 1);
    assert_eq!(rig.endpoint.route(PEER), None, "nothing is learned");
    rig.hear_from(2, &from_peer(QUERY_HEARTBEAT));
    let source = id("43.1.1");
    rig.hear_from(
        3,
        &Frame {
            source,
            ..from_peer(QUERY_HEARTBEAT)
        },
    );
    assert_eq!(rig.received().len(), 2);
    assert_eq!(rig.count(Counter::BoundElsewhere), 1);
}

#[test]
fn a_table_full_of_peers_that_answer_takes_in_nobody_until_one_falls_silent() {
    let mut rig = Rig::with(Config {
        limits: Limits {
            max_peers: 2,
            ..Limits::default()
        },
        ..Config::default()
    });
    let peer = |component| Frame {
        source: JausId::new(42, 1, component),
        ..from_peer(QUERY_HEARTBEAT)
    };
    for component in [1, 2] {
        rig.hear(&peer(component));
        rig.vouch_for(JausId::new(42, 1, component));
    }
    let _ = (rig.events(), rig.received());
    rig.hear(&peer(3));
    assert_eq!(
        (rig.received().len(), rig.count(Counter::PeersFull)),
        (0, 1)
    );
    rig.pass(Duration::from_secs(61));
    rig.hear(&Frame {
        sequence: 2,
        ..peer(2)
    });
    rig.hear(&peer(3));
    let known: Vec<_> = rig
        .endpoint
        .peers()
        .map(|peer| peer.id.component())
        .collect();
    assert_eq!(known, [2, 3]);
}

#[test]
fn ids_that_prove_nothing_lock_nobody_out_however_many_addresses_they_have() {
    let mut rig = Rig::with(Config {
        limits: Limits {
            max_peers: 60,
            ..Limits::default()
        },
        ..Config::default()
    });
    for component in 1..=60 {
        let invented = JausId::new(42, 2, component);
        let query = Frame {
            source: invented,
            ..from_peer(QUERY_HEARTBEAT)
        };
        rig.hear_from(50 + component % 6, &query);
        let answer = Outgoing {
            destination: invented,
            ..to_peer()
        };
        rig.send(answer).unwrap();
    }
    rig.received();
    rig.hear(&from_peer(QUERY_HEARTBEAT));
    assert_eq!(rig.received().len(), 1);
    assert!(rig.endpoint.route(PEER).is_some());
}

#[test]
fn what_passes_between_us_and_a_peer_is_counted() {
    let mut rig = Rig::new();
    rig.hear(&from_peer(QUERY_IDENTIFICATION));
    rig.hear(&from_peer(QUERY_IDENTIFICATION));
    let message = Outgoing {
        acknowledge: true,
        ..to_peer()
    };
    rig.send(message).unwrap();
    let (_, sent) = rig.sent().remove(0);
    rig.pass(Duration::from_millis(150));
    assert_eq!(rig.sent().len(), 1, "sent again");
    rig.now += Duration::from_millis(7);
    let flags = Flags::default().with_acknowledgement(Acknowledgement::Positive);
    rig.hear(&Frame {
        flags,
        sequence: sent.sequence,
        ..from_peer(b"")
    });
    let peer = rig.endpoint.peers().next().unwrap();
    let traffic = |messages, octets| Traffic { messages, octets };
    assert_eq!((peer.received, peer.sent), (traffic(2, 3), traffic(1, 3)));
    assert_eq!(
        (peer.duplicates, peer.retransmissions, peer.lost),
        (1, 1, 0)
    );
    assert_eq!(
        peer.last_heard - peer.first_heard,
        Duration::from_millis(157)
    );
}

#[test]
fn equal_messages_are_told_apart_when_the_numbers_have_gone_round() {
    let mut rig = Rig::new();
    let ask = Flags::default().with_acknowledgement(Acknowledgement::Request);
    let mut delivered = 0;
    for number in 0..140_000_u32 {
        rig.hear(&Frame {
            flags: ask,
            sequence: number as u16,
            ..from_peer(QUERY_HEARTBEAT)
        });
        rig.now += Duration::from_micros(10);
        delivered += rig.received().len();
        let _ = rig.transmits();
    }
    assert_eq!((delivered, rig.count(Counter::Duplicate)), (140_000, 0));
}

#[test]
fn a_duplicate_is_one_whatever_numbers_were_acknowledged_in_between() {
    let mut rig = Rig::new();
    let ask = Flags::default().with_acknowledgement(Acknowledgement::Request);
    let positive = Flags::default().with_acknowledgement(Acknowledgement::Positive);
    let message = Frame {
        flags: ask,
        sequence: 100,
        ..from_peer(QUERY_HEARTBEAT)
    };
    rig.hear(&message);
    for acknowledged in (0..=u16::MAX).step_by(0x3000) {
        rig.hear(&Frame {
            flags: positive,
            sequence: acknowledged,
            ..from_peer(b"")
        });
        rig.hear(&message);
    }
    assert_eq!(rig.received().len(), 1);
}

#[test]
fn half_messages_wrong_sizes_and_wrong_versions_do_nothing() {
    let mut rig = Rig::new();
    let whole = judp::encode(&from_peer(&[0x02; 30])).unwrap();
    for length in 0..whole.len() {
        rig.hear_octets(PEER_HOST, whole.slice(..length));
    }
    for size in 0..=u16::MAX {
        let mut wrong = whole.to_vec();
        wrong[2..4].copy_from_slice(&size.to_le_bytes());
        if usize::from(size) + 1 != whole.len() {
            rig.hear_octets(9, wrong.into());
        }
    }
    for version in (0..=u8::MAX).filter(|&version| version != judp::VERSION_AS5669A) {
        let mut wrong = whole.to_vec();
        wrong[0] = version;
        rig.hear_octets(PEER_HOST, wrong.into());
    }
    let from_here = |message: &Received| message.path == Some(path(PEER_HOST));
    assert!(!rig.received().iter().any(from_here));
    let dropped = [Counter::NotJaus, Counter::Malformed].map(|counter| rig.count(counter));
    assert!(dropped[0] >= 254 && dropped[1] > 60_000, "{dropped:?}");
}
