//! Messages that their senders no longer wait for.

use super::wire::{Conditions, Wire, large, reliable};
use super::*;

#[test]
fn a_cancelled_message_is_never_sent_again() {
    let mut rig = Rig::new();
    rig.meet_peer();
    let handle = rig
        .send(reliable(Bytes::from_static(QUERY_IDENTIFICATION)))
        .unwrap();
    assert_eq!(rig.sent().len(), 1);
    assert!(rig.endpoint.cancel(PEER, handle));
    assert_eq!(rig.endpoint.poll_timeout(), None, "nothing is due");
    rig.pass(Duration::from_millis(500));
    assert_eq!(rig.sent(), []);
    assert_eq!(
        rig.endpoint.poll_event(),
        None,
        "nobody waits for the result"
    );
    assert_eq!(rig.count(Counter::MessagesCancelled), 1);
    assert_eq!(rig.endpoint.flow(PEER).unwrap().in_flight, 0);
    assert!(!rig.endpoint.cancel(PEER, handle), "only once");
}

#[test]
fn a_cancelled_message_that_waits_is_not_sent_at_all() {
    let mut rig = Rig::new();
    rig.meet_peer();
    let messages: Vec<_> = (0..40)
        .map(|_| {
            rig.send(reliable(Bytes::from_static(QUERY_IDENTIFICATION)))
                .unwrap()
        })
        .collect();
    let first = rig.sent().len();
    assert_eq!(
        first,
        Config::default().initial_window,
        "the window is full"
    );
    for &message in &messages {
        assert!(rig.endpoint.cancel(PEER, message));
    }
    assert_eq!(rig.sent(), []);
    // The window is free for the next one, and its numbers are not those of the cancelled ones.
    rig.send(reliable(Bytes::from_static(QUERY_IDENTIFICATION)))
        .unwrap();
    assert_eq!(rig.sent().len(), 1);
}

#[test]
fn the_fragments_of_a_cancelled_message_end_and_harm_no_other() {
    for seed in 0..20 {
        let conditions = Conditions {
            loss: 100,
            jitter: Duration::from_millis(2),
            ..Conditions::default()
        };
        let mut wire = Wire::new(seed, conditions);
        let (before, after) = (large(20_000), large(30_000));
        wire.send(reliable(before.clone()));
        let cancelled = wire.send(reliable(large(400_000)));
        let last = wire.send(reliable(after.clone()));
        wire.run_for(Duration::from_millis(3));
        assert!(wire.ends[0].cancel(PEER, cancelled), "seed {seed}");
        wire.run_for(Duration::from_secs(60));
        let mut delivered = wire.delivered();
        delivered.sort_by_key(Bytes::len);
        assert!(delivered == [before, after], "seed {seed}");
        let told = Event::Acknowledged {
            message: last,
            by: PEER,
        };
        assert!(wire.results().contains(&told), "seed {seed}");
        assert_eq!(
            wire.ends[1].unfinished(),
            0,
            "what arrived of it was dropped"
        );
    }
}
