//! Large messages in fragments.

use super::*;
use crate::wire::DataControl;

/// A message whose octets are all different from their neighbours'.
fn large(length: usize) -> Bytes {
    let octets = (0..length).map(|index| (index % 251) as u8);
    [0x01, 0x4B]
        .into_iter()
        .chain(octets)
        .take(length)
        .collect()
}

/// The fragments of a large message from [`PEER`], beginning with number `first`.
fn fragments(first: u16, message: &Bytes, part: usize) -> Vec<Frame> {
    let cut = large::Cut::new(message.len(), part, false);
    (0..cut.count())
        .map(|index| {
            let (data, payload) = cut.fragment(message, index);
            Frame {
                flags: Flags::default().with_data(data),
                sequence: first.wrapping_add(index as u16),
                ..Frame::new(PEER, US, payload)
            }
        })
        .collect()
}

fn payloads(rig: &mut Rig) -> Vec<Bytes> {
    rig.received()
        .into_iter()
        .map(|received| received.payload)
        .collect()
}

#[test]
fn a_large_message_is_sent_in_consecutive_fragments() {
    let mut rig = Rig::new();
    rig.meet_peer();
    let message = large(1425 * 3 + 1);
    rig.send(Outgoing {
        payload: message.clone(),
        ..to_peer()
    })
    .unwrap();
    let sent = rig.sent();
    let controls: Vec<_> = sent.iter().map(|(_, frame)| frame.flags.data()).collect();
    use DataControl::{First, Last, Middle};
    assert_eq!(controls, [First, Middle, Middle, Last]);
    let numbers: Vec<_> = sent.iter().map(|(_, frame)| frame.sequence).collect();
    assert_eq!(numbers, [1, 2, 3, 4]);
    let octets: Vec<u8> = sent
        .iter()
        .flat_map(|(_, frame)| frame.payload.to_vec())
        .collect();
    assert_eq!(octets, message);
}

#[test]
fn a_message_of_just_the_limit_is_sent_whole() {
    let mut rig = Rig::new();
    rig.meet_peer();
    rig.send(Outgoing {
        payload: large(1425),
        ..to_peer()
    })
    .unwrap();
    let sent = rig.sent();
    assert_eq!(
        (sent.len(), sent[0].1.flags.data()),
        (1, DataControl::Single)
    );
}

#[test]
fn the_numbers_of_a_large_message_do_not_go_round_within_it() {
    let mut rig = Rig::with(Config {
        first_sequence: 65_533,
        ..Config::default()
    });
    rig.meet_peer();
    rig.send(Outgoing {
        payload: large(1425 * 2),
        ..to_peer()
    })
    .unwrap();
    rig.send(Outgoing {
        payload: large(1425 * 2),
        ..to_peer()
    })
    .unwrap();
    let numbers: Vec<_> = rig.sent().iter().map(|(_, frame)| frame.sequence).collect();
    assert_eq!(numbers, [65_534, 65_535, 1, 2]);
}

#[test]
fn a_large_message_with_acknowledgement_is_told_when_all_of_it_is_acknowledged() {
    let mut rig = Rig::new();
    rig.meet_peer();
    let payload = large(1425 * 3);
    let message = rig
        .send(Outgoing {
            acknowledge: true,
            payload,
            ..to_peer()
        })
        .unwrap();
    let flags = Flags::default().with_acknowledgement(Acknowledgement::Positive);
    for (index, (_, sent)) in rig.sent().into_iter().enumerate() {
        rig.hear(&Frame {
            flags,
            sequence: sent.sequence,
            ..from_peer(b"")
        });
        let expected = if index == 2 {
            vec![Event::Acknowledged { message, by: PEER }]
        } else {
            vec![]
        };
        assert_eq!(rig.events(), expected);
    }
    let payload = large(1425 * 3);
    let message = rig
        .send(Outgoing {
            acknowledge: true,
            payload,
            ..to_peer()
        })
        .unwrap();
    let acknowledged = rig.sent().remove(0).1;
    rig.hear(&Frame {
        flags,
        sequence: acknowledged.sequence,
        ..from_peer(b"")
    });
    rig.pass(Config::default().acknowledge_patience);
    assert_eq!(
        rig.events(),
        [Event::NotAcknowledged {
            message,
            destination: PEER,
            reason: Unacknowledged::TimedOut,
            acknowledged: 1425,
            length: 1425 * 3,
        }]
    );
    assert_eq!(rig.endpoint.poll_timeout(), None);
}

#[test]
fn fragments_in_any_order_make_the_message() {
    let message = large(1000);
    for order in [[0, 1, 2, 3], [3, 2, 1, 0], [1, 3, 0, 2], [2, 0, 3, 1]] {
        for first in [10, 65_534] {
            let mut rig = Rig::new();
            let fragments = fragments(first, &message, 250);
            order
                .iter()
                .for_each(|&index: &usize| rig.hear(&fragments[index]));
            assert_eq!(
                payloads(&mut rig),
                std::slice::from_ref(&message),
                "{order:?} from {first}"
            );
            assert_eq!(rig.endpoint.poll_timeout(), None, "nothing is left");
        }
    }
}

#[test]
fn messages_of_two_senders_do_not_mix() {
    let mut rig = Rig::new();
    let (one, other) = (large(600), large(900));
    let mut theirs = fragments(1, &other, 300);
    theirs
        .iter_mut()
        .for_each(|frame| frame.source = id("42.1.2"));
    for (mine, theirs) in fragments(1, &one, 200).iter().zip(&theirs) {
        rig.hear(mine);
        rig.hear(theirs);
    }
    assert_eq!(payloads(&mut rig), [one, other]);
}

#[test]
fn a_repeated_fragment_changes_nothing() {
    let mut rig = Rig::new();
    let message = large(600);
    let fragments = fragments(1, &message, 200);
    rig.hear(&fragments[0]);
    rig.hear(&fragments[1]);
    rig.pass(Duration::from_millis(600));
    rig.hear(&fragments[1]);
    rig.hear(&fragments[2]);
    assert_eq!(payloads(&mut rig), [message]);
    assert_eq!(rig.count(Counter::Duplicate), 1);
}

#[test]
fn a_sender_that_begins_anew_is_understood() {
    let mut rig = Rig::new();
    fragments(1, &large(800), 200)[..3]
        .iter()
        .for_each(|frame| rig.hear(frame));
    rig.pass(Duration::from_millis(200));
    let message = large(500);
    fragments(1, &message, 250)
        .iter()
        .for_each(|frame| rig.hear(frame));
    assert_eq!(payloads(&mut rig), [message]);
}

#[test]
fn older_headers_repeat_the_code_in_every_fragment() {
    let mut rig = Rig::new();
    let message = large(600);
    for mut frame in fragments(1, &message, 200) {
        frame.version = Version::As5669;
        if frame.flags.data() != DataControl::First {
            frame.payload = [&message[..2], &frame.payload[..]].concat().into();
        }
        rig.hear(&frame);
    }
    assert_eq!(payloads(&mut rig), [message]);
}

#[test]
fn an_unfinished_message_is_forgotten_in_time() {
    let mut rig = Rig::new();
    let message = large(600);
    let fragments = fragments(1, &message, 200);
    rig.hear(&fragments[0]);
    rig.hear(&fragments[1]);
    assert_eq!(
        rig.endpoint.poll_timeout(),
        Some(rig.now + Config::default().reassembly_timeout)
    );
    rig.pass(Config::default().reassembly_timeout);
    assert_eq!(
        (
            rig.endpoint.poll_timeout(),
            rig.count(Counter::FragmentsForgotten)
        ),
        (None, 1)
    );
    rig.hear(&fragments[2]);
    assert!(payloads(&mut rig).is_empty());
}

#[test]
fn a_message_above_the_limit_is_dropped() {
    let mut rig = Rig::with(Config {
        max_message: 500,
        ..Config::default()
    });
    fragments(1, &large(600), 200)
        .iter()
        .for_each(|frame| rig.hear(frame));
    assert!(payloads(&mut rig).is_empty());
    assert_eq!(rig.count(Counter::MessageTooLong), 1);
}

#[test]
fn unfinished_messages_are_bounded_per_sender_and_in_all() {
    let config = Config {
        max_message: 500,
        max_reassembly: 900,
        ..Config::default()
    };
    let mut rig = Rig::with(config);
    let begin = |source: &str, sequence| Frame {
        source: id(source),
        sequence,
        ..fragments(1, &large(500), 200).remove(0)
    };
    let mut hear = |source, sequence| {
        rig.hear(&begin(source, sequence));
        rig.pass(Duration::from_millis(1));
        rig.count(Counter::FragmentsForgotten)
    };
    assert_eq!([hear("42.1.1", 10), hear("42.1.1", 20)], [0, 0]);
    assert_eq!(
        hear("42.1.1", 30),
        1,
        "a third of 200 octets is beyond the sender's 500"
    );
    assert_eq!([hear("42.1.2", 10), hear("42.1.2", 20)], [1, 1]);
    assert_eq!(
        hear("42.1.3", 10),
        2,
        "a fifth of 200 octets is beyond the 900 in all"
    );
}
