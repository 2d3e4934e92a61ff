//! Carrier: accepted and dropped datagrams, and transmission.

use std::time::Duration;

use super::*;
use jaus::endpoint::Rate;
use jaus::wire::ra::MAX_DATA;

const US: RaId = RaId::new(30, 1, 33, 1);
const PEER: RaId = RaId::new(10, 1, 35, 1);

#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
fn start() -> Instant {
    Instant::now()
}

fn from(host: u8) -> SocketAddr {
    SocketAddr::from(([10, 77, 0, host], 40_000))
}

fn hear(carrier: &mut Carrier, now: Instant, host: u8, datagram: &Bytes) -> Vec<Message> {
    carrier.handle_datagram(now, from(host), datagram.clone())
}

fn carrier(settings: Settings) -> Carrier {
    let mut carrier = Carrier::new(settings);
    carrier.set_components(US.subsystem, [US, RaId::new(30, 1, 1, 1)]);
    carrier
}

fn fields() -> Fields {
    Fields {
        priority: 6,
        acknowledgement: Acknowledgement::None,
        service_connection: false,
        experimental: false,
        code: 0x4402,
        destination: US,
        source: PEER,
        data_flag: 0,
        data_size: 0,
        sequence: 0,
    }
}

fn packet(fields: Fields, data: &[u8]) -> Bytes {
    let data_size = data.len();
    packet::datagram(
        Dialect::Opc,
        &Header::new(&Fields {
            data_size,
            ..fields
        }),
        data,
    )
}

/// Counters after one datagram.
fn counted(datagram: &[u8]) -> Vec<Counter> {
    let mut carrier = carrier(Settings::default());
    let datagram = Bytes::copy_from_slice(datagram);
    hear(&mut carrier, start(), 1, &datagram);
    let counted = carrier.counters().iter().filter(|&(_, number)| number > 0);
    counted.map(|(counter, _)| counter).skip(1).collect()
}

#[test]
fn what_was_recorded_from_openjaus_is_read_and_answered_in_its_framing() {
    let opc = b"JAUS01.0\x06\x02\x00\x2B\x01\x21\x01\x1E\x01\x01\x01\x0A\x01\x00\x00\x00\x02";
    let judp =
        b"\x01\x00\x00\x00\x11\x06\x02\x00\x2B\x01\x21\x01\x1E\x01\x01\x01\x0A\x01\x00\x00\x00\x02";
    for recorded in [opc.as_slice(), judp] {
        let mut carrier = carrier(Settings::default());
        let recorded = Bytes::copy_from_slice(recorded);
        let messages = hear(&mut carrier, start(), 1, &recorded);
        let [query] = messages.as_slice() else {
            panic!("{messages:?}")
        };
        let asker = RaId::new(10, 1, 1, 1);
        assert_eq!((query.source, query.destination), (asker, US));
        assert_eq!((query.code, &query.data[..]), (0x2B00, &[2][..]));
        let back = Message::new(US, asker, 0x2B00, Bytes::from_static(&[2]));
        carrier.send(&back).unwrap();
        let sent = carrier.poll_transmit().unwrap();
        let port_of_all = SocketAddr::from(([10, 77, 0, 1], 3794));
        assert_eq!(sent.to, To::Address(port_of_all));
        let ids = recorded.len() - 13..recorded.len() - 5;
        assert_eq!(sent.datagram[..ids.start], recorded[..ids.start]);
        assert_eq!(sent.datagram[ids.end..], recorded[ids.end..]);
    }
}

#[test]
fn sizes_that_lie_versions_flags_and_ids_are_dropped_and_counted() {
    use Counter::*;
    let good = packet(fields(), &[1, 2, 3]);
    assert_eq!(counted(&good), [MessagesReceived]);
    assert_eq!(counted(&good[..good.len() - 1]), [WrongSize], "too short");
    assert_eq!(
        counted(&[&good[..], &[0]].concat()),
        [WrongSize],
        "too long"
    );
    assert_eq!(counted(&good[..20]), [TooShort]);
    assert_eq!(counted(b""), [NotJaus]);
    assert_eq!(counted(b"JAUS02.0"), [NotJaus]);
    assert_eq!(counted(&[2, 0, 17, 0]), [As5669a]);
    assert_eq!(counted(&[1]), [TooShort]);
    assert_eq!(counted(&[1, 1, 0, 0, 16]), [CompressedHeader]);
    for version in [0, 1, 3, 63] {
        let mut octets = good.to_vec();
        octets[9] = version;
        assert_eq!(counted(&octets), [WrongVersion]);
    }
    for data_flag in [3, 5, 9, 15] {
        let odd = packet(
            Fields {
                data_flag,
                ..fields()
            },
            &[],
        );
        assert_eq!(counted(&odd), [UnknownDataFlag]);
    }
    let source = |source| counted(&packet(Fields { source, ..fields() }, &[]));
    assert_eq!(source(RaId::new(10, 0, 35, 1)), [InvalidSource]);
    assert_eq!(source(RaId::new(255, 1, 35, 1)), [InvalidSource]);
    assert_eq!(source(RaId::new(30, 9, 9, 9)), [SubsystemConflict]);
    let to = |destination| {
        counted(&packet(
            Fields {
                destination,
                ..fields()
            },
            &[],
        ))
    };
    assert_eq!(to(RaId::new(30, 1, 0, 1)), [InvalidDestination]);
    assert_eq!(to(RaId::new(30, 1, 34, 1)), [NotForUs]);
    assert_eq!(to(RaId::new(255, 255, 1, 1)), [MessagesReceived]);
    assert_eq!(to(RaId::new(31, 255, 1, 1)), [NotForUs]);
}

#[test]
fn older_versions_are_taken_where_configured() {
    let settings = Settings {
        versions: vec![1, 2],
        ..Settings::default()
    };
    let mut carrier = carrier(settings);
    let mut octets = packet(fields(), &[]).to_vec();
    octets[9] = 1;
    assert_eq!(hear(&mut carrier, start(), 1, &octets.into()).len(), 1);
}

#[test]
fn as5669_datagrams_hold_several_messages() {
    let one = packet::datagram(Dialect::As5669, &Header::new(&fields()), &[]);
    let mut datagram = one.to_vec();
    datagram.extend_from_slice(&one[1..]);
    datagram.extend_from_slice(&[0, 0, 0]);
    let mut carrier = carrier(Settings::default());
    assert_eq!(hear(&mut carrier, start(), 1, &datagram.into()).len(), 2);
    assert_eq!(carrier.counters().get(Counter::TooShort), 1);
}

/// The parts of a large message from a peer.
fn parts_of(data: &[u8], acknowledgement: Acknowledgement) -> Vec<Bytes> {
    let parts = parts::cut(data).map(|(place, sequence, part)| {
        packet(
            Fields {
                data_flag: place.flag(),
                sequence,
                acknowledgement,
                ..fields()
            },
            part,
        )
    });
    parts.collect()
}

#[test]
fn large_messages_are_cut_as_openjaus_does_and_put_together_again() {
    for length in [0, 1, MAX_DATA, MAX_DATA + 1, 3 * MAX_DATA, 100_000] {
        let data: Vec<u8> = (0..length).map(|i| (i % 251) as u8).collect();
        let parts = parts_of(&data, Acknowledgement::None);
        assert_eq!(parts.len(), length.div_ceil(MAX_DATA).max(1));
        let mut carrier = carrier(Settings::default());
        let whole: Vec<_> = parts
            .iter()
            .flat_map(|part| hear(&mut carrier, start(), 1, part))
            .collect();
        let [message] = whole.as_slice() else {
            panic!("{length}: {whole:?}")
        };
        assert_eq!(message.data, data);
        assert_eq!(carrier.unfinished(), 0);
        let back = Message::new(US, PEER, 0x4402, Bytes::from(data));
        carrier.send(&back).unwrap();
        let sent = bursts(&mut carrier, start()).concat();
        let same = sent.iter().zip(&parts);
        let same = same.filter(|(sent, part)| sent.datagram[20 + 4..] == part[20 + 4..]);
        assert_eq!(same.count(), parts.len(), "flags, numbers and data");
    }
}

/// The datagrams of each burst, until none is left.
fn bursts(carrier: &mut Carrier, mut now: Instant) -> Vec<Vec<Transmit>> {
    let mut bursts = Vec::new();
    carrier.settle(now);
    loop {
        bursts.push(std::iter::from_fn(|| carrier.poll_transmit()).collect());
        let Some(wake) = carrier.pace.poll_timeout() else {
            return bursts;
        };
        assert!(
            wake <= now + Duration::from_millis(4),
            "without long pauses"
        );
        now = wake;
        carrier.handle_timeout(now);
    }
}

#[test]
fn a_large_message_leaves_in_bursts_and_others_do_not_wait_for_it() {
    let mut carrier = carrier(Settings::default());
    hear(&mut carrier, start(), 1, &packet(fields(), &[]));
    let large = Message::new(US, PEER, 0x4A23, vec![7; 30 * MAX_DATA].into());
    let small = Message::new(US, PEER, 0x4402, Bytes::new());
    for message in [&large, &large, &small] {
        carrier.send(message).unwrap();
    }
    let bursts = bursts(&mut carrier, start());
    assert_eq!(bursts[0].len(), 9, "the small one is among the first");
    assert!(bursts[1..].iter().all(|burst| burst.len() <= 8));
    let all = bursts.concat().into_iter();
    let parts = all.filter(|it| it.datagram.len() > MAX_DATA);
    let numbers: Vec<u8> = parts.map(|it| it.datagram[22]).collect();
    let once: Vec<u8> = (0..30).collect();
    assert_eq!(numbers, [once.clone(), once].concat());
}

#[test]
fn middle_parts_may_swap_and_come_twice() {
    let data = vec![7; 4 * MAX_DATA + 1];
    let parts = parts_of(&data, Acknowledgement::None);
    let mut carrier = carrier(Settings::default());
    let mut arrive = |part: usize| hear(&mut carrier, start(), 1, &parts[part]).len();
    let whole: usize = [0, 3, 1, 1, 4, 2].into_iter().map(&mut arrive).sum();
    assert_eq!(whole, 1);
}

#[test]
fn parts_that_contradict_each_other_are_no_message() {
    let parts = parts_of(&[7; 3 * MAX_DATA], Acknowledgement::None);
    let other = parts_of(&[8; 3 * MAX_DATA], Acknowledgement::None);
    let mut carrier = carrier(Settings::default());
    for part in [&parts[0], &parts[1], &other[1], &parts[2]] {
        assert!(hear(&mut carrier, start(), 1, part).is_empty());
    }
    assert_eq!(carrier.counters().get(Counter::PartOutOfOrder), 2);
    assert_eq!(carrier.unfinished(), 0);
    for part in &other {
        hear(&mut carrier, start(), 1, part);
    }
    assert_eq!(carrier.counters().get(Counter::MessagesReceived), 1);
}

#[test]
fn fragments_that_never_end_are_bounded_and_time_out() {
    let settings = Settings {
        max_message: 100_000,
        max_parts_per_subsystem: 50_000,
        max_parts: 120_000,
        ..Settings::default()
    };
    let (now, timeout) = (start(), settings.part_timeout);
    let mut carrier = carrier(settings);
    for subsystem in 1..=20 {
        for code in 0..40 {
            let first = Fields {
                source: RaId::new(subsystem, 1, 1, 1),
                code,
                data_flag: 1,
                ..fields()
            };
            hear(&mut carrier, now, subsystem, &packet(first, &[0; MAX_DATA]));
            assert!(carrier.unfinished() <= 120_000);
        }
    }
    assert!(carrier.counters().get(Counter::PartsForgotten) > 700);
    assert_eq!(carrier.poll_timeout(), Some(now + timeout));
    carrier.handle_timeout(now + timeout);
    assert_eq!((carrier.unfinished(), carrier.poll_timeout()), (0, None));
    assert!(carrier.counters().get(Counter::PartsTimedOut) > 20);

    let part = |data_flag, sequence| {
        let fields = Fields {
            data_flag,
            sequence,
            ..fields()
        };
        packet(fields, &[0; MAX_DATA])
    };
    hear(&mut carrier, now, 1, &part(1, 0));
    for number in 1..100 {
        hear(&mut carrier, now, 1, &part(2, number));
    }
    let dropped = carrier.counters().get(Counter::PartsForgotten);
    assert!(dropped > 700 && carrier.unfinished() <= 50_000);
}

#[test]
fn what_wants_an_acknowledgement_gets_one_if_it_is_for_one_of_us() {
    let mut carrier = carrier(Settings::default());
    let wanted = Fields {
        acknowledgement: Acknowledgement::Request,
        sequence: 0x1234,
        ..fields()
    };
    let messages = hear(&mut carrier, start(), 1, &packet(wanted, &[9]));
    assert!(messages[0].acknowledge);
    let answer = carrier.poll_transmit().unwrap().datagram;
    let expected = Fields {
        acknowledgement: Acknowledgement::Positive,
        destination: PEER,
        source: US,
        ..wanted
    };
    assert_eq!(answer, packet(expected, &[]));
    let to_all = Fields {
        destination: RaId::new(255, 255, 1, 1),
        ..wanted
    };
    assert_eq!(
        hear(&mut carrier, start(), 1, &packet(to_all, &[])).len(),
        1
    );
    assert_eq!(carrier.poll_transmit(), None);
    let answers = Fields {
        acknowledgement: Acknowledgement::Positive,
        ..fields()
    };
    assert!(hear(&mut carrier, start(), 1, &packet(answers, &[])).is_empty());
    assert_eq!(carrier.counters().get(Counter::AcknowledgementsReceived), 1);
}

#[test]
fn a_subsystem_is_believed_at_one_address_until_it_is_silent() {
    let (now, mut carrier) = (start(), carrier(Settings::default()));
    let heard = packet(fields(), &[]);
    hear(&mut carrier, now, 1, &heard);
    assert!(hear(&mut carrier, now, 2, &heard).is_empty());
    assert_eq!(carrier.counters().get(Counter::AddressConflict), 1);
    let later = now + Duration::from_secs(5);
    assert_eq!(hear(&mut carrier, later, 2, &heard).len(), 1);
    let address = SocketAddr::from(([10, 77, 0, 2], 3794));
    assert_eq!(carrier.address(PEER.subsystem), Some(address));
}

#[test]
fn nobody_can_invent_subsystems_without_end() {
    let settings = Settings {
        new_subsystems: Rate::new(1, 16),
        max_subsystems: 20,
        ..Settings::default()
    };
    let (now, mut carrier) = (start(), carrier(settings));
    for host in [1, 2] {
        for subsystem in 1..=254 {
            let source = RaId::new(subsystem, 1, 35, 1);
            hear(
                &mut carrier,
                now,
                host,
                &packet(Fields { source, ..fields() }, &[]),
            );
        }
    }
    assert_eq!(carrier.known(), 20);
    assert!(carrier.counters().get(Counter::NewSubsystemRate) > 200);
    assert!(carrier.counters().get(Counter::SubsystemsFull) > 0);
}

#[test]
fn everybody_is_told_in_the_framing_that_is_spoken() {
    let mut carrier = carrier(Settings::default());
    let all = RaId::new(255, 255, 1, 1);
    let heartbeat = Message::new(US, all, 0x4202, Bytes::new());
    carrier.send(&heartbeat).unwrap();
    let sent = carrier.poll_transmit().unwrap();
    assert_eq!((sent.to, sent.datagram[0]), (To::Group, b'J'));
    assert_eq!(carrier.poll_transmit(), None);
    let judp = packet::datagram(Dialect::As5669, &Header::new(&fields()), &[]);
    hear(&mut carrier, start(), 1, &judp);
    carrier.send(&heartbeat).unwrap();
    let first: Vec<_> = std::iter::from_fn(|| carrier.poll_transmit())
        .map(|sent| sent.datagram[0])
        .collect();
    assert_eq!(first, [1], "whoever speaks the other would have been heard");
}

#[test]
fn what_cannot_be_sent_says_why() {
    let mut carrier = carrier(Settings {
        queue_limit: 1,
        max_message: 10,
        ..Settings::default()
    });
    let message = Message::new(US, PEER, 1, Bytes::new());
    assert_eq!(carrier.send(&message), Err(SendError::Unknown(10)));
    hear(&mut carrier, start(), 1, &packet(fields(), &[]));
    let nobody = Message {
        source: PEER,
        ..message.clone()
    };
    assert_eq!(carrier.send(&nobody), Err(SendError::NotOurs(PEER)));
    let long = Message {
        data: Bytes::from_static(&[0; 11]),
        ..message.clone()
    };
    assert!(matches!(
        carrier.send(&long),
        Err(SendError::TooLong { .. })
    ));
    assert_eq!(carrier.send(&message), Ok(()));
    assert_eq!(carrier.send(&message), Err(SendError::QueueFull));
}

#[test]
fn a_framing_that_nobody_speaks_is_used_rarely_where_another_is() {
    let mut carrier = carrier(Settings {
        group_dialects: vec![Dialect::Opc, Dialect::As5669],
        ..Settings::default()
    });
    let heartbeat = Message::new(US, RaId::new(255, 255, 1, 1), 0x4202, Bytes::new());
    let sent = |carrier: &mut Carrier| {
        for _ in 0..20 {
            carrier.send(&heartbeat).unwrap();
        }
        let all = std::iter::from_fn(|| carrier.poll_transmit());
        let all: Vec<_> = all.map(|sent| sent.datagram[0]).collect();
        [b'J', 1].map(|first| all.iter().filter(|octet| **octet == first).count())
    };
    assert_eq!(sent(&mut carrier), [20, 20], "nobody was heard");
    hear(&mut carrier, start(), 1, &packet(fields(), &[]));
    assert_eq!(sent(&mut carrier), [20, 2]);
    carrier.forget(PEER.subsystem);
    assert_eq!(sent(&mut carrier), [20, 20]);
}
