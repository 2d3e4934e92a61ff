//! Acknowledgements in both directions.

use super::*;

fn request() -> Frame {
    let flags = Flags::new(Priority::High)
        .with_acknowledgement(Acknowledgement::Request)
        .with_broadcast(Broadcast::Global);
    Frame {
        flags,
        sequence: 7,
        ..from_peer(QUERY_IDENTIFICATION)
    }
}

fn answer(to: &Frame, acknowledgement: Acknowledgement) -> Frame {
    let flags = Flags::default().with_acknowledgement(acknowledgement);
    Frame {
        flags,
        sequence: to.sequence,
        ..Frame::new(to.destination, to.source, Bytes::new())
    }
}

#[test]
fn a_request_is_acknowledged_at_once_to_where_it_came_from() {
    let mut rig = Rig::new();
    rig.hear(&request());
    let flags = Flags::new(Priority::High).with_acknowledgement(Acknowledgement::Positive);
    let expected = Frame {
        flags,
        sequence: 7,
        ..Frame::new(US, PEER, Bytes::new())
    };
    assert_eq!(rig.sent(), [(To::Peer(path(PEER_HOST).peer), expected)]);
    assert_eq!(rig.received().len(), 1);
}

#[test]
fn a_repeated_request_is_acknowledged_again_but_not_delivered_again() {
    let mut rig = Rig::new();
    for _copy in 0..4 {
        rig.hear(&request());
        rig.pass(Duration::from_millis(105));
    }
    assert_eq!(
        (rig.sent().len(), rig.received().len()),
        (4, 1),
        "Junior's timing of retries"
    );
    assert_eq!(rig.count(Counter::AcknowledgementsSent), 4);
}

#[test]
fn an_offer_of_header_compression_is_acknowledged_without_it() {
    let mut rig = Rig::new();
    // The request with compression flags 1, and number and length after the size.
    let mut datagram = judp::encode(&request()).unwrap().to_vec();
    datagram[1] = 0x40;
    datagram[2] += 2;
    datagram.splice(4..4, [0, 12]);
    rig.hear_octets(PEER_HOST, datagram.into());
    let (_, answer) = rig.sent().remove(0);
    assert!(answer.is_acknowledgement() && answer.is_plausible());
    assert_eq!(rig.received().len(), 1);
}

#[test]
fn a_request_to_a_busy_component_is_left_alone_until_it_has_room() {
    let mut rig = Rig::new();
    rig.inbox.full.push(US);
    rig.hear(&request());
    assert!(rig.sent().is_empty() && rig.received().is_empty());
    assert_eq!(rig.count(Counter::ReceiverBusy), 1);
    let without = Frame {
        flags: Flags::default(),
        sequence: 8,
        ..request()
    };
    rig.hear(&without);
    assert_eq!(rig.received().len(), 1, "nobody would repeat this one");
    rig.inbox.full.clear();
    rig.hear(&request());
    assert_eq!((rig.sent().len(), rig.received().len()), (1, 1));
}

#[test]
fn a_repeated_request_is_acknowledged_although_the_mailbox_is_full_by_now() {
    let mut rig = Rig::new();
    rig.hear(&request());
    rig.inbox.full.push(US);
    rig.pass(Duration::from_millis(105));
    rig.hear(&request());
    assert_eq!((rig.sent().len(), rig.received().len()), (2, 1));
    assert_eq!(rig.count(Counter::ReceiverBusy), 0);
}

#[test]
fn a_request_to_many_is_not_acknowledged() {
    let mut rig = Rig::new();
    rig.hear(&Frame {
        destination: JausId::EVERYONE,
        ..request()
    });
    assert_eq!((rig.transmits(), rig.received().len()), (vec![], 1));
}

#[test]
fn a_request_for_somebody_else_is_not_acknowledged() {
    let mut rig = Rig::new();
    rig.hear(&Frame {
        destination: id("101.1.9"),
        ..request()
    });
    assert_eq!(rig.transmits(), []);
}

#[test]
fn an_older_header_is_acknowledged_with_its_own_and_its_code() {
    let mut rig = Rig::new();
    let flags = Flags::default().with_acknowledgement(Acknowledgement::Request);
    for version in [Version::As5669, Version::Ra] {
        rig.hear(&Frame {
            version,
            flags,
            ..from_peer(QUERY_IDENTIFICATION)
        });
        let (_, answer) = rig.sent().remove(0);
        assert_eq!((answer.version, answer.code()), (version, Some(0x2B00)));
        assert!(answer.is_acknowledgement() && answer.payload.len() == 2);
        rig.pass(Duration::from_secs(1));
    }
}

#[test]
fn an_acknowledged_message_is_told_and_not_sent_again() {
    let mut rig = Rig::new();
    rig.meet_peer();
    let message = rig
        .send(Outgoing {
            acknowledge: true,
            ..to_peer()
        })
        .unwrap();
    let (_, sent) = rig.sent().remove(0);
    assert_eq!(sent.flags.acknowledgement(), Acknowledgement::Request);
    assert!(rig.endpoint.poll_timeout().is_some());
    rig.hear(&answer(&sent, Acknowledgement::Positive));
    assert_eq!(rig.events(), [Event::Acknowledged { message, by: PEER }]);
    assert_eq!(rig.endpoint.poll_timeout(), None);
    rig.pass(Duration::from_secs(10));
    assert_eq!(rig.transmits(), []);
}

#[test]
fn an_unacknowledged_message_is_sent_again_and_then_given_up() {
    let mut rig = Rig::new();
    rig.meet_peer();
    let message = rig
        .send(Outgoing {
            acknowledge: true,
            ..to_peer()
        })
        .unwrap();
    let first = rig.transmits();
    let begin = rig.now;
    for wait in [100, 200, 400, 800].map(Duration::from_millis) {
        assert_eq!(rig.endpoint.poll_timeout(), Some(rig.now + wait));
        rig.pass(wait - Duration::from_millis(1));
        assert_eq!(rig.transmits(), [], "not before the time");
        rig.pass(Duration::from_millis(1));
        assert_eq!(rig.transmits(), first, "the same again");
    }
    let end = rig.endpoint.poll_timeout().unwrap();
    assert_eq!(end - begin, Config::default().acknowledge_patience);
    rig.pass(end - rig.now);
    assert_eq!(rig.transmits(), []);
    assert_eq!(
        rig.events(),
        [Event::NotAcknowledged {
            message,
            shortfall: Shortfall {
                destination: PEER,
                reason: Unacknowledged::TimedOut,
                acknowledged: 0,
                length: QUERY_IDENTIFICATION.len() as u32,
            },
        }]
    );
    assert_eq!(
        (
            rig.endpoint.poll_timeout(),
            rig.count(Counter::Retransmissions)
        ),
        (None, 4)
    );
}

#[test]
fn a_retry_goes_to_where_the_receiver_is_by_then() {
    let mut rig = Rig::new();
    rig.send(Outgoing {
        acknowledge: true,
        ..to_peer()
    })
    .unwrap();
    assert_eq!(rig.sent()[0].0, To::Group);
    rig.meet_peer();
    rig.pass(Duration::from_millis(100));
    assert_eq!(rig.sent()[0].0, To::Peer(path(PEER_HOST).peer));
}

#[test]
fn a_refused_message_is_told() {
    let mut rig = Rig::new();
    rig.meet_peer();
    let message = rig
        .send(Outgoing {
            acknowledge: true,
            ..to_peer()
        })
        .unwrap();
    let (_, sent) = rig.sent().remove(0);
    rig.hear(&answer(&sent, Acknowledgement::Negative));
    assert_eq!(
        rig.events(),
        [Event::NotAcknowledged {
            message,
            shortfall: Shortfall {
                destination: PEER,
                reason: Unacknowledged::Refused,
                acknowledged: 0,
                length: QUERY_IDENTIFICATION.len() as u32,
            },
        }]
    );
}

#[test]
fn answers_that_nobody_waits_for_are_dropped_quietly() {
    let mut rig = Rig::new();
    rig.meet_peer();
    rig.send(Outgoing {
        acknowledge: true,
        ..to_peer()
    })
    .unwrap();
    let (_, sent) = rig.sent().remove(0);
    let right = answer(&sent, Acknowledgement::Positive);
    rig.hear(&Frame {
        sequence: right.sequence + 1,
        ..right.clone()
    });
    rig.hear(&Frame {
        source: id("42.1.2"),
        ..right.clone()
    });
    let _ = (rig.events(), rig.received());
    rig.hear(&Frame {
        payload: Bytes::from_static(QUERY_HEARTBEAT),
        ..right
    });
    assert!(rig.is_silent());
    assert_eq!(rig.count(Counter::UnawaitedAcknowledgement), 2);
    assert_eq!(rig.count(Counter::AcknowledgementWithPayload), 1);
    assert!(
        rig.endpoint.poll_timeout().is_some(),
        "still waiting for the right one"
    );
}

#[test]
fn a_component_that_leaves_waits_for_nothing() {
    let mut rig = Rig::new();
    rig.meet_peer();
    rig.send(Outgoing {
        acknowledge: true,
        ..to_peer()
    })
    .unwrap();
    rig.endpoint.detach(US);
    assert_eq!(rig.endpoint.poll_timeout(), None);
}

#[test]
fn what_no_link_takes_counts_as_lost_and_is_tried_again_in_time() {
    let mut rig = Rig::new();
    rig.send(Outgoing::new(US, PEER, vec![0; 3000].into()))
        .unwrap();
    rig.endpoint.remove_link(WIRE);
    assert!(rig.transmits().is_empty(), "there is no way");
    for _ in 0..200 {
        rig.pass(Duration::from_millis(100));
        assert!(rig.transmits().is_empty());
        let timeout = rig.endpoint.poll_timeout();
        assert!(timeout.is_none_or(|it| it > rig.now), "what is due is done");
    }
    assert_eq!(rig.count(Counter::MessagesGivenUp), 1);
    assert_eq!(rig.endpoint.poll_timeout(), None);
}
