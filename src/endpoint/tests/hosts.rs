//! Fragments with one id from several hosts: forged, on two paths, or from a peer that moves.

use super::wire::large;
use super::*;

const ELSEWHERE: u8 = 66;

/// The fragments of a large message from [`PEER`] that requests acknowledgements.
fn parts(message: &Bytes) -> Vec<Frame> {
    let cut = large::Cut::new(message.len(), 1000, false);
    let ask = Flags::default().with_acknowledgement(Acknowledgement::Request);
    let part = |index| {
        let (data, payload) = cut.fragment(message, index);
        Frame {
            flags: ask.with_data(data),
            sequence: 1000 + index as u16,
            ..Frame::new(PEER, US, payload)
        }
    };
    (0..cut.count()).map(part).collect()
}

/// The same numbers and lengths, with other octets.
fn forged(part: &Frame) -> Frame {
    Frame {
        payload: vec![0xEE; part.payload.len()].into(),
        ..part.clone()
    }
}

fn payloads(rig: &mut Rig) -> Vec<Bytes> {
    let messages = rig.received().into_iter();
    messages.map(|message| message.payload).collect()
}

/// Receives a fragment from a host; returns whether it was acknowledged.
fn is_acknowledged(rig: &mut Rig, host: u8, part: &Frame) -> bool {
    rig.hear_from(host, part);
    let sent = rig.sent();
    sent.iter().any(|(_, frame)| frame.is_acknowledgement())
}

#[test]
fn forged_parts_spoil_no_message_whenever_they_come() {
    let message = large(10_000);
    let parts = parts(&message);
    for count in 0..=parts.len() {
        let mut rig = Rig::new();
        rig.meet_peer();
        for part in &parts[..count] {
            assert!(is_acknowledged(&mut rig, PEER_HOST, part));
        }
        for part in &parts {
            rig.hear_from(ELSEWHERE, &forged(part));
        }
        rig.transmits();
        for part in &parts[count..] {
            assert!(is_acknowledged(&mut rig, PEER_HOST, part));
        }
        assert!(payloads(&mut rig).contains(&message), "after {count} parts");
    }
}

#[test]
fn parts_from_elsewhere_are_refused_and_not_acknowledged() {
    let message = large(10_000);
    let parts = parts(&message);
    let mut rig = Rig::new();
    rig.meet_peer();
    rig.hear(&parts[0]);
    rig.transmits();
    assert!(!is_acknowledged(&mut rig, ELSEWHERE, &forged(&parts[1])));
    assert_eq!(rig.count(Counter::PartFromElsewhere), 1);
}

/// Sends a peer's fragments from another host until they are acknowledged, and answers challenges
/// at the given hosts.
fn insist(rig: &mut Rig, parts: &[Frame], answers_at: &[u8]) {
    let mut left = parts.to_vec();
    for _try in 0..20 {
        let mut acknowledged = Vec::new();
        for part in &left {
            rig.hear_from(ELSEWHERE, part);
            for (to, frame) in rig.sent() {
                if frame.is_acknowledgement() {
                    acknowledged.push(frame.sequence);
                    continue;
                }
                let reached = answers_at
                    .iter()
                    .find(|&&host| to == To::Peer(path(host).peer));
                if let Some(&host) = reached {
                    let flags = Flags::default().with_acknowledgement(Acknowledgement::Positive);
                    let answer = Frame {
                        flags,
                        sequence: frame.sequence,
                        ..Frame::new(PEER, US, Bytes::new())
                    };
                    rig.hear_from(host, &answer);
                }
            }
        }
        left.retain(|part| !acknowledged.contains(&part.sequence));
        rig.pass(Duration::from_millis(100));
    }
    assert!(left.is_empty());
}

#[test]
fn a_message_goes_on_where_its_sender_has_moved_to() {
    let message = large(10_000);
    let parts = parts(&message);
    let mut rig = Rig::new();
    rig.meet_peer();
    parts[..5].iter().for_each(|part| rig.hear(part));
    rig.transmits();
    insist(&mut rig, &parts[5..], &[ELSEWHERE]);
    assert_eq!(payloads(&mut rig), [message]);
    assert_eq!(rig.endpoint.reassembly.cost(), 0);
}

#[test]
fn a_message_that_is_sent_again_is_delivered_once_whoever_has_forged_its_numbers() {
    let message = large(10_000);
    let parts = parts(&message);
    let mut rig = Rig::new();
    rig.meet_peer();
    for part in &parts[..parts.len() - 1] {
        rig.hear_from(ELSEWHERE, &forged(part));
    }
    for _time in 0..2 {
        parts.iter().for_each(|part| rig.hear(part));
        rig.pass(Duration::from_millis(100));
    }
    assert_eq!(payloads(&mut rig), [message]);
}

#[test]
fn copies_that_come_by_a_second_way_make_no_peer_doubtful() {
    let mut rig = Rig::new();
    rig.meet_peer();
    for part in &parts(&large(10_000)) {
        rig.hear(part);
        rig.hear_from(ELSEWHERE, part);
    }
    assert_eq!(rig.count(Counter::ChallengesSent), 0);
    assert_eq!(payloads(&mut rig).len(), 1);
}

#[test]
fn a_message_that_comes_by_two_ways_is_delivered_once_whichever_is_first() {
    let message = large(10_000);
    let parts = parts(&message);
    for order in 0..1_u32 << parts.len() {
        let mut rig = Rig::new();
        rig.meet_peer();
        for (index, part) in parts.iter().enumerate() {
            let hosts = if order & 1 << index == 0 {
                [PEER_HOST, ELSEWHERE]
            } else {
                [ELSEWHERE, PEER_HOST]
            };
            for host in hosts {
                rig.hear_from(host, part);
                rig.now += Duration::from_micros(50);
            }
        }
        let delivered = payloads(&mut rig);
        assert_eq!(delivered.len(), 1, "in the order {order:b}");
        assert!(delivered[0] == message);
    }
}

#[test]
fn a_peer_that_is_reached_by_two_ways_gets_its_message_through_by_either() {
    let message = large(10_000);
    let mut rig = Rig::new();
    rig.meet_peer();
    let parts = parts(&message);
    insist(&mut rig, &parts[..5], &[PEER_HOST, ELSEWHERE]);
    assert_eq!(rig.endpoint.peers().next().unwrap().path, path(PEER_HOST));
    for part in &parts[5..] {
        assert!(is_acknowledged(&mut rig, PEER_HOST, part));
    }
    assert_eq!(payloads(&mut rig), [message]);
}
