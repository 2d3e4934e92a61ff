//! What may be sent to an address before it is verified.

use super::wire::{large, reliable};
use super::*;

/// A rig that knows [`PEER`] and has this budget for its address.
fn rig(burst: u32) -> Rig {
    let mut rig = Rig::with(Config {
        payload_limit: 1000,
        unverified_address: Rate::new(1, burst),
        ..Config::default()
    });
    rig.hear(&from_peer(QUERY_HEARTBEAT));
    rig
}

fn unreliable(length: usize) -> Outgoing {
    Outgoing {
        payload: large(length),
        ..to_peer()
    }
}

#[test]
fn a_large_message_uses_up_the_octets_of_all_its_headers_too() {
    // Three fragments with 15 octets of header each; and a challenge of 17 octets.
    let both = 2 * (2500 + 3 * 15) + 17;
    for (burst, refused) in [(both, 0), (both - 1, 1)] {
        let mut rig = rig(burst);
        for _message in 0..2 {
            rig.send(unreliable(2500)).unwrap();
        }
        assert_eq!(rig.count(Counter::UnverifiedBudget), refused);
        assert_eq!(rig.sent().len(), 7 - 3 * refused as usize);
    }
}

#[test]
fn a_peer_is_challenged_when_a_quarter_of_the_budget_is_used_up() {
    for (length, challenges) in [(984, 0), (985, 1)] {
        let mut rig = rig(4000);
        rig.send(unreliable(length)).unwrap();
        assert_eq!(rig.count(Counter::ChallengesSent), challenges);
        assert_eq!(rig.sent().len(), 1 + challenges as usize);
    }
}

#[test]
fn a_message_longer_than_half_the_budget_waits_for_a_proof() {
    for message in [unreliable, |length| reliable(large(length))] {
        for (length, waits) in [(2000, false), (2001, true)] {
            let mut rig = rig(4000);
            rig.send(message(length)).unwrap();
            let sent = rig.sent();
            let is_challenge = |(_, frame): &(To, Frame)| frame.payload == QUERY_HEARTBEAT;
            assert_eq!(sent.iter().all(is_challenge), waits, "{length}");
        }
    }
}

#[test]
fn with_a_proof_there_is_no_budget() {
    for message in [unreliable, |length| reliable(large(length))] {
        let mut rig = rig(100);
        rig.vouch_for(PEER);
        rig.send(message(10_000)).unwrap();
        assert_eq!(rig.sent().len(), 10);
        assert_eq!(rig.count(Counter::ChallengesSent), 0);
    }
}
