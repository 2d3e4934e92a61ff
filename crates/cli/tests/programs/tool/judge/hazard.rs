//! The judge warns of the steps that a peer does not survive, and leaves steps out.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use jaus::codec::Message;
use jaus::messages::core::{UpdateEvent, events, liveness};

use crate::support::{Run, run};
use crate::tool::judge::peer::{Peer, network};

/// Judges a peer in steps B1 to B10. Returns also whether it was sent Update Event.
fn judge(peer: Peer, more: &[&str]) -> (Run, bool) {
    let was_updated = Arc::new(AtomicBool::new(false));
    let noted = Arc::clone(&was_updated);
    let peer = peer.behaves(move |received| {
        let is_it = received
            .payload
            .starts_with(&UpdateEvent::CODE.to_le_bytes());
        noted.fetch_or(is_it, Ordering::Relaxed);
        None
    });
    let flags = network();
    let _peer = peer.start(&flags);
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let judge = [
        "judge",
        "105.1.1",
        "--unicast",
        "--timeout",
        "300ms",
        "--json",
    ];
    let run = run(
        &[&judge[..], &["--only", "B8,B10"], more, &*network].concat(),
        b"",
    );
    (run, was_updated.load(Ordering::Relaxed))
}

/// Confirms an event, so that step B8 comes to its message.
fn like_jauspp() -> Peer {
    use jaus::messages::core::{ConfirmEventRequest, CreateEvent};
    let mut confirmation = ConfirmEventRequest {
        request_id: 1,
        event_id: 7,
        ..ConfirmEventRequest::default()
    };
    confirmation.set_confirmed_periodic_rate_hz(1.0).unwrap();
    let peer = Peer::offering(&[events::URN, liveness::URN]).in_first_versions();
    peer.answers::<CreateEvent>(&confirmation)
}

#[test]
fn jauspp_is_recognised_before_the_step_that_ends_it_and_the_step_can_be_left_out() {
    let (run, was_updated) = judge(like_jauspp(), &[]);
    let warning = "warning: 105.1.1 may be JAUS++ (all its core services have version 1.0), whose \
                   process ends at a message of B8: to leave that out, run the judge with --skip B8";
    assert!(run.stderr.contains(warning), "{run:?}");
    assert!(was_updated, "the warning names the wrong step");

    let (run, was_updated) = judge(like_jauspp(), &["--skip", "B8"]);
    assert_eq!(run.stderr, "", "there is nothing to warn of");
    assert!(!was_updated);
    let lines = run.json();
    let skipped = lines.iter().find(|line| line["step"] == "B8").unwrap();
    assert_eq!(skipped["verdict"], "skipped", "{skipped}");
    assert_eq!(skipped["reason"], "left out by --skip");
}

#[test]
fn what_depends_on_a_step_that_is_left_out_is_skipped_with_the_reason() {
    let (run, _) = judge(like_jauspp(), &["--skip", "B4"]);
    let lines = run.json();
    let skipped = lines.iter().find(|line| line["step"] == "B10").unwrap();
    assert_eq!(skipped["reason"], "depends on B4, which --skip leaves out");
    let end = lines.last().unwrap();
    assert_eq!(
        (&end["ok"], &end["failed"]),
        (&0.into(), &0.into()),
        "{end}"
    );
}

#[test]
fn of_a_peer_that_is_not_recognised_nothing_is_said() {
    let (run, _) = judge(Peer::offering(&[events::URN, liveness::URN]), &[]);
    assert_eq!(run.stderr, "", "{run:?}");
}
