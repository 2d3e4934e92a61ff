//! Large messages in fragments.

use super::wire::{large, reliable};
use super::*;
use crate::wire::DataControl;

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
            shortfall: Shortfall {
                destination: PEER,
                reason: Unacknowledged::TimedOut,
                acknowledged: 1425,
                length: 1425 * 3,
            },
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

/// Acknowledged fragments are not repeated, however long their sender retries the rest in vain.
#[test]
fn a_part_of_a_message_waits_for_the_rest_while_its_sender_sends_fragments() {
    let mut rig = Rig::new();
    let message = large(600);
    let of_message = fragments(1, &message, 200);
    of_message[..2].iter().for_each(|frame| rig.hear(frame));
    for other in &fragments(100, &large(900), 200)[..4] {
        rig.pass(Config::default().reassembly_timeout * 2 / 3);
        rig.hear(other);
    }
    rig.hear(&of_message[2]);
    assert_eq!(payloads(&mut rig), [message]);
    rig.pass(Config::default().reassembly_timeout);
    assert_eq!(rig.count(Counter::FragmentsForgotten), 1);
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
    assert!((400..2000).contains(&rig.endpoint.unfinished()));
    let timeout = Config::default().reassembly_timeout;
    assert_eq!(rig.endpoint.poll_timeout(), Some(rig.now + timeout));
    rig.pass(timeout);
    assert_eq!(rig.endpoint.unfinished(), 0);
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
    const COST: usize = 200 + 64 + 256;
    let config = Config {
        max_reassembly_per_sender: 2 * COST,
        max_reassembly: 4 * COST,
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
        "a third is beyond the sender's bound"
    );
    assert_eq!([hear("42.1.2", 10), hear("42.1.2", 20)], [1, 1]);
    assert_eq!(hear("42.1.3", 10), 2, "a fifth is beyond the bound for all");
}

#[test]
fn what_invented_senders_leave_behind_is_bounded() {
    let config = Config {
        max_reassembly: 1 << 20,
        limits: Limits {
            new_ids_per_address: Rate::new(u32::MAX, u32::MAX),
            ..Limits::default()
        },
        ..Config::default()
    };
    let mut rig = Rig::with(config);
    let whole = large(3000);
    for number in 0..20_000_u32 {
        let sender = JausId::new(1 + (number % 10_000) as u16, 7, 7);
        let mut frame = fragments((number * 7) as u16, &whole, 1000).remove(number as usize % 3);
        frame.source = sender;
        rig.hear(&frame);
        rig.now += Duration::from_micros(10);
        assert!(rig.endpoint.reassembly.cost() <= 1 << 20);
        rig.events();
    }
    assert!(rig.count(Counter::FragmentsForgotten) > 15_000);
    rig.pass(Config::default().reassembly_timeout);
    assert_eq!(rig.endpoint.reassembly.cost(), 0);
}

#[test]
fn as_many_fragments_as_there_are_numbers_make_a_message_even_backwards() {
    let message = large(65_535 * 64);
    for backwards in [false, true] {
        let mut rig = Rig::new();
        let mut fragments = fragments(1, &message, 64);
        if backwards {
            fragments.reverse();
        }
        fragments.iter().for_each(|frame| rig.hear(frame));
        assert!(payloads(&mut rig) == std::slice::from_ref(&message));
        assert_eq!(rig.endpoint.reassembly.cost(), 0);
    }
}

#[test]
fn messages_of_several_priorities_are_put_together_side_by_side() {
    let mut rig = Rig::new();
    let (slow, quick) = (large(900), large(600));
    let mut urgent = fragments(50, &quick, 300);
    for frame in &mut urgent {
        frame.flags = frame.flags.with_priority(Priority::High);
    }
    let slow_ones = fragments(1, &slow, 300);
    for frame in [
        &slow_ones[0],
        &urgent[0],
        &slow_ones[1],
        &urgent[1],
        &slow_ones[2],
    ] {
        rig.hear(frame);
    }
    assert_eq!(payloads(&mut rig), [quick, slow]);
}

#[test]
fn what_is_left_of_a_message_is_not_put_into_one_that_has_its_numbers_again() {
    let mut rig = Rig::new();
    let (torn, whole) = (large(1000), large(1400));
    let mut left = fragments(5, &torn, 200);
    left.remove(2);
    left.iter().for_each(|frame| rig.hear(frame));
    // Many numbers later, but within the time for which fragments are kept.
    for round in 0..8_u16 {
        let first = 1000 + round * 8000;
        fragments(first, &large(400), 200)
            .iter()
            .for_each(|frame| rig.hear(frame));
    }
    payloads(&mut rig);
    fragments(3, &whole, 200)
        .iter()
        .for_each(|frame| rig.hear(frame));
    assert_eq!(payloads(&mut rig), [whole]);
}

/// As JAUS++ cuts: the code and 1571 more octets in each fragment.
fn of_jauspp(first: u16, message: &Bytes) -> Vec<Frame> {
    let cut = large::Cut::new(message.len(), 1573, true);
    (0..cut.count())
        .map(|index| {
            let (data, payload) = cut.fragment(message, index);
            Frame {
                flags: Flags::default().with_data(data),
                sequence: first + index as u16,
                ..Frame::new(PEER, US, payload)
            }
        })
        .collect()
}

#[test]
fn the_code_that_jauspp_repeats_is_left_out_and_repeated_to_it_from_then_on() {
    let mut rig = Rig::new();
    rig.meet_peer();
    let message = large(5000);
    of_jauspp(1, &message)
        .iter()
        .for_each(|frame| rig.hear(frame));
    assert_eq!(payloads(&mut rig), std::slice::from_ref(&message));
    for acknowledge in [false, true] {
        rig.send(Outgoing {
            acknowledge,
            ..reliable(message.clone())
        })
        .unwrap();
        let sent = rig.sent();
        assert_eq!(sent.len(), 4);
        assert!(sent.iter().all(|(_, frame)| frame.code() == Some(0x4B01)));
        let octets: usize = sent.iter().map(|(_, frame)| frame.payload.len()).sum();
        assert_eq!(octets, message.len() + 3 * 2);
    }
}

#[test]
fn octets_that_happen_to_repeat_are_not_taken_for_a_repeated_code() {
    let mut rig = Rig::new();
    let zeros = Bytes::from(vec![0; 5000]);
    fragments(1, &zeros, 1425)
        .iter()
        .for_each(|frame| rig.hear(frame));
    assert_eq!(payloads(&mut rig), std::slice::from_ref(&zeros));
    let configured = Config {
        profiles: vec![crate::peer::Assignment {
            id: JausId::EVERYONE,
            profile: crate::peer::Implementation::Standard,
        }],
        ..Config::default()
    };
    let mut rig = Rig::with(configured);
    fragments(1, &zeros, 1573)
        .iter()
        .for_each(|frame| rig.hear(frame));
    assert_eq!(payloads(&mut rig), [zeros], "even of JAUS++'s length");
}

#[test]
fn large_messages_go_to_older_headers_with_the_code_in_each_fragment_and_come_back_whole() {
    for version in [Version::As5669, Version::Ra] {
        for acknowledge in [false, true] {
            let mut rig = Rig::new();
            rig.hear(&Frame {
                version,
                ..from_peer(QUERY_HEARTBEAT)
            });
            rig.vouch_for(PEER);
            rig.events();
            let message = large(5000);
            rig.send(Outgoing {
                acknowledge,
                ..reliable(message.clone())
            })
            .unwrap();
            let sent = rig.sent();
            assert_eq!(sent.len(), 4);
            let mut other = Rig::new();
            other.endpoint.detach(US);
            other.endpoint.attach(PEER).unwrap();
            for (_, frame) in &sent {
                assert_eq!((frame.version, frame.code()), (version, Some(0x4B01)));
                assert!(frame.payload.len() <= 1425);
                other.hear_from(OUR_HOST + 7, frame);
            }
            assert_eq!(payloads(&mut other), [message]);
        }
    }
}

#[test]
fn a_first_fragment_that_is_repeated_late_does_not_undo_the_message() {
    let mut rig = Rig::new();
    let message = large(600);
    let mut fragments = fragments(1, &message, 200);
    for fragment in &mut fragments {
        fragment.flags = fragment
            .flags
            .with_acknowledgement(Acknowledgement::Request);
    }
    rig.hear(&fragments[0]);
    rig.hear(&fragments[1]);
    // Our acknowledgement of the first fragment was lost, and so were its next copies.
    rig.pass(Config::default().retransmission_window);
    rig.hear(&fragments[0]);
    rig.hear(&fragments[2]);
    assert_eq!(payloads(&mut rig), [message]);
}

/// The sender's node sends more urgent messages first, from any of its components.
#[test]
fn what_was_acknowledged_is_kept_while_its_host_has_something_else_acknowledged() {
    let wish = |mut frame: Frame| {
        let flags = frame.flags.with_acknowledgement(Acknowledgement::Request);
        frame.flags = flags;
        frame
    };
    for (is_acknowledged, kept) in [(true, true), (false, false)] {
        let mut rig = Rig::new();
        let message = large(600);
        let parts = fragments(1, &message, 200).into_iter();
        let parts: Vec<_> = parts
            .map(|part| if is_acknowledged { wish(part) } else { part })
            .collect();
        parts[..2].iter().for_each(|part| rig.hear(part));
        for number in 100..110 {
            rig.pass(Config::default().reassembly_timeout / 2);
            let mut urgent = wish(from_peer(b"\x01\xD7"));
            (urgent.source, urgent.sequence) = (id("42.1.2"), number);
            rig.hear(&urgent);
        }
        payloads(&mut rig);
        rig.hear(&parts[2]);
        assert_eq!(payloads(&mut rig).contains(&message), kept);
        rig.pass(Config::default().reassembly_timeout * 2);
        assert_eq!(rig.endpoint.unfinished(), 0);
    }
}

#[test]
fn what_was_acknowledged_is_kept_while_the_sender_waits_longest() {
    let config = Config::default();
    let patience = config.acknowledge_patience + Duration::from_secs(2);
    assert!(config.reassembly_timeout > patience);
}

#[test]
fn parts_that_are_sent_to_everybody_make_one_message_however_long_they_took() {
    let mut rig = Rig::new();
    let flags = |frame: Frame| Frame {
        flags: frame
            .flags
            .with_acknowledgement(Acknowledgement::Request)
            .with_broadcast(Broadcast::Global),
        ..frame
    };
    let parts: Vec<_> = fragments(7, &large(2000), 1425)
        .into_iter()
        .map(flags)
        .collect();
    let [first, last] = &parts[..] else {
        panic!("two parts");
    };
    rig.hear(first);
    rig.pass(Duration::from_millis(1200));
    rig.hear(last);
    assert_eq!(rig.received().len(), 1);
    rig.pass(Duration::from_millis(400));
    rig.hear(first);
    rig.hear(last);
    assert_eq!(rig.received(), [], "its acknowledgements were lost");
}

#[test]
fn the_arrival_of_each_part_of_an_unfinished_message_is_passed_on() {
    let mut rig = Rig::new();
    let parts = fragments(7, &large(3000), 1000);
    let mut expected = Vec::new();
    for part in &parts[..2] {
        rig.pass(Duration::from_millis(20));
        rig.hear(part);
        expected.push((rig.now, PEER, US));
    }
    rig.hear(&parts[2]);
    assert_eq!((payloads(&mut rig).len(), &rig.inbox.parts), (1, &expected));
}

#[test]
fn of_a_message_above_the_limit_not_all_fragments_are_acknowledged() {
    let mut rig = Rig::with(Config {
        max_message: 3000,
        ..Config::default()
    });
    let mut parts = fragments(10, &large(4000), 1000);
    for part in &mut parts {
        part.flags = part.flags.with_acknowledgement(Acknowledgement::Request);
    }
    let mut acknowledged = BTreeSet::new();
    for _ in 0..4 {
        parts.iter().for_each(|part| rig.hear(part));
        let answers = rig.sent().into_iter();
        let answers = answers.filter(|(_, it)| it.is_acknowledgement());
        acknowledged.extend(answers.map(|(_, it)| it.sequence));
        rig.pass(Duration::from_millis(300));
    }
    assert!(acknowledged.into_iter().eq(10..13));
    assert!(payloads(&mut rig).is_empty());
}
