//! How long a repetition counts as a duplicate, and which messages are remembered.

use super::*;
use crate::peer::{Assignment, Implementation as Known};

const MILLISECOND: Duration = Duration::from_millis(1);

fn ask() -> Flags {
    Flags::default().with_acknowledgement(Acknowledgement::Request)
}

#[test]
fn a_repetition_is_a_duplicate_within_the_window_of_its_kind() {
    let none = Flags::default();
    let call = Broadcast::Global;
    for (flags, to_all, profile, window) in [
        (none, false, Known::Standard, 100),
        (none.with_broadcast(call), false, Known::Standard, 100),
        (ask(), false, Known::Standard, 3500),
        (ask().with_broadcast(call), false, Known::Standard, 900),
        (ask(), true, Known::Standard, 900),
        (ask(), false, Known::Junior, 900),
        (none, true, Known::Junior, 100),
    ] {
        let window = Duration::from_millis(window);
        for (pause, delivered) in [(window - MILLISECOND, 1), (window, 2)] {
            let mut rig = Rig::with(Config {
                profiles: vec![Assignment { id: PEER, profile }],
                ..Config::default()
            });
            for _time in 0..2 {
                let frame = Frame {
                    flags,
                    ..from_peer(QUERY_IDENTIFICATION)
                };
                let from = Ingress {
                    path: path(PEER_HOST),
                    to_all,
                };
                rig.hear_datagram(from, judp::encode(&frame).unwrap());
                rig.now += pause;
            }
            let row = (flags, to_all, profile, pause);
            assert_eq!(rig.received().len(), delivered, "{row:?}");
        }
    }
}

#[test]
fn each_repetition_restarts_the_window() {
    let mut rig = Rig::new();
    for _second in 0..5 {
        rig.hear(&Frame {
            flags: ask(),
            ..from_peer(QUERY_IDENTIFICATION)
        });
        rig.pass(Duration::from_secs(3));
    }
    assert_eq!(rig.received().len(), 1);
}

#[test]
fn neither_strangers_nor_messages_that_are_not_repeated_push_out_those_that_are() {
    let mut rig = Rig::with(Config {
        max_recent: 4,
        ..Config::default()
    });
    rig.meet_peer();
    let request = Frame {
        flags: ask(),
        ..from_peer(QUERY_IDENTIFICATION)
    };
    rig.hear(&request);
    for sequence in 901..911 {
        rig.hear(&Frame {
            sequence,
            ..from_peer(QUERY_HEARTBEAT)
        });
        let stranger = Frame {
            source: id("43.1.1"),
            sequence,
            ..request.clone()
        };
        rig.hear_from(9, &stranger);
    }
    rig.received();
    rig.hear(&request);
    assert_eq!(rig.received(), []);
    assert!(rig.endpoint.heard.len() <= 4 + 4 + 1 + 1);
}
