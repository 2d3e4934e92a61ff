//! Which subscription or cancellation a message of Events belongs to, and the numbers of requests.

use std::time::Duration;

use super::subscriptions::{Notice, confirm, event_of, fire, notices, status, subscribe, up};
use super::{Bench, OTHER, PEER};
use crate::address::JausId;
use crate::codec::Message;
use crate::messages::core::{
    CancelEvent, ConfirmEventRequest, CreateEvent, RejectEventRequest, ReportEventTimeout,
    ReportStatus,
};
use crate::service::{CannotSubscribe, Patience, Topic, When};

/// A subscription to a report on change, which differs from others in its query.
fn numbered(peer: JausId, number: u8) -> Topic {
    Topic {
        peer,
        query: [0x02, 0x24, number, 0].to_vec().into(),
        ..status(When::OnChange)
    }
}

/// The numbers of the requests sent since the last call, to whichever peer.
fn requests(bench: &mut Bench) -> Vec<u8> {
    let sent = std::mem::take(&mut bench.sent).into_iter();
    let creates = sent.filter_map(|(_, octets)| CreateEvent::decode(&octets).ok());
    creates.map(|create| create.request_id).collect()
}

#[test]
fn a_cancellation_is_sent_four_times_at_half_second_intervals() {
    let (mut bench, id) = up(When::OnChange);
    bench.stack.unsubscribe(bench.now, id);
    for expected in [1, 1, 1, 1, 0, 0] {
        bench.collect();
        assert_eq!(bench.sent::<CancelEvent>().len(), expected);
        bench.run_ms(499);
        assert_eq!(bench.sent::<CancelEvent>(), []);
        bench.run_ms(1);
    }
}

#[test]
fn events_messages_of_another_peer_change_nothing() {
    let (mut bench, _) = up(When::hz(1.0));
    bench.hear(OTHER, &ReportEventTimeout { timeout: 1.into() });
    let report = ReportStatus::default().encode().unwrap();
    bench.hear(OTHER, &event_of(7, 0, report));
    for request_id in 0..=u8::MAX {
        let confirm = ConfirmEventRequest {
            request_id,
            event_id: 9,
            ..ConfirmEventRequest::default()
        };
        bench.hear(OTHER, &confirm);
        let reject = RejectEventRequest {
            request_id,
            ..RejectEventRequest::default()
        };
        bench.hear(OTHER, &reject);
    }
    assert_eq!(notices(&mut bench), []);
    bench.sent.clear();
    for sequence in 0..30 {
        fire(&mut bench, 7, sequence);
        bench.run_ms(1000);
    }
    assert_eq!(bench.sent::<CreateEvent>(), [], "no lifetime, no renewal");
    assert_eq!(notices(&mut bench), vec![Notice::Report { lost: 0 }; 30]);
}

#[test]
fn an_event_that_came_early_belongs_to_the_subscription_of_its_peer() {
    let mut bench = Bench::new();
    subscribe(&mut bench, &numbered(OTHER, 1));
    subscribe(&mut bench, &numbered(PEER, 1));
    let numbers = requests(&mut bench);
    fire(&mut bench, 3, 0);
    for (source, request_id) in [OTHER, PEER].into_iter().zip(numbers) {
        let confirm = ConfirmEventRequest {
            request_id,
            event_id: 3,
            ..ConfirmEventRequest::default()
        };
        bench.hear(source, &confirm);
    }
    let report = Notice::Report { lost: 0 };
    let expected = [Notice::Up(None), Notice::Up(None), report];
    assert_eq!(notices(&mut bench), expected);
}

#[test]
fn a_number_in_use_with_a_peer_is_not_used_again_with_it() {
    let (mut bench, id) = up(When::OnChange);
    subscribe(&mut bench, &numbered(PEER, 1));
    let living = requests(&mut bench)[0];
    bench.stack.unsubscribe(bench.now, id);
    bench.collect();
    let cancelling = bench.sent::<CancelEvent>()[0].request_id;
    let mut used = |peer| {
        let mut numbers = Vec::new();
        for _time in 0..300 {
            let id = subscribe(&mut bench, &numbered(peer, 2));
            numbers.extend(requests(&mut bench));
            bench.stack.unsubscribe(bench.now, id);
        }
        [living, cancelling].map(|number| numbers.contains(&number))
    };
    assert_eq!(used(PEER), [false, false]);
    assert_eq!(used(OTHER), [true, true], "each peer has its own");
}

#[test]
fn there_is_room_for_1024_subscriptions_in_all() {
    let mut bench = Bench::new();
    let peer = |number: u16| JausId::new(200 + number / 200, 1, 1);
    for number in 0..1024_u16 {
        subscribe(&mut bench, &numbered(peer(number), (number % 200) as u8));
    }
    let one_more = numbered(peer(1024), 24);
    let refused = bench
        .stack
        .subscribe(bench.now, &one_more, Patience::default());
    assert_eq!(refused, Err(CannotSubscribe::TooMany(24)));
}

#[test]
fn stray_events_are_cancelled_ten_times_a_second_and_each_once() {
    let (mut bench, _) = up(When::OnChange);
    bench.sent.clear();
    for (event, pause, cancelled) in [(1, 99, 1), (2, 1, 0), (2, 100, 1), (1, 100, 0), (3, 0, 1)] {
        fire(&mut bench, event, 0);
        let sent = bench.sent::<CancelEvent>();
        let of_event = sent.iter().filter(|it| it.event_id == event);
        assert_eq!(of_event.count(), cancelled, "event {event}");
        bench.run(Duration::from_millis(pause));
        bench.sent.clear();
    }
}

#[test]
fn at_most_256_cancellations_are_in_progress() {
    let mut bench = Bench::new();
    let mut ids = Vec::new();
    for number in 0..257_u16 {
        let peer = JausId::new(200 + number / 200, 1, 1);
        ids.push(subscribe(&mut bench, &numbered(peer, (number % 200) as u8)));
        let confirm = ConfirmEventRequest {
            request_id: requests(&mut bench)[0],
            event_id: (number % 200) as u8,
            ..ConfirmEventRequest::default()
        };
        bench.hear(peer, &confirm);
    }
    for id in ids {
        bench.stack.unsubscribe(bench.now, id);
    }
    bench.collect();
    for expected in [257, 256] {
        let sent = std::mem::take(&mut bench.sent);
        let is_it = |octets| CancelEvent::decode(octets).is_ok();
        let cancelled = sent.iter().filter(|(_, octets)| is_it(octets));
        assert_eq!(cancelled.count(), expected);
        bench.run_ms(500);
    }
}

#[test]
fn a_confirmation_of_one_subscription_leaves_others_with_that_request_alone() {
    let mut bench = Bench::new();
    subscribe(&mut bench, &numbered(PEER, 1));
    subscribe(&mut bench, &numbered(PEER, 2));
    let numbers = requests(&mut bench);
    confirm(&mut bench, numbers[1], 4, 0.0);
    assert_eq!(notices(&mut bench), [Notice::Up(None)]);
    bench.run_ms(500);
    assert_eq!(requests(&mut bench), [numbers[0]], "still not confirmed");
}

#[test]
fn no_request_has_a_number_of_the_applications_own() {
    let mut bench = Bench::new();
    for _ in 0..300 {
        let id = subscribe(&mut bench, &status(When::OnChange));
        let asked = bench.sent::<CreateEvent>();
        assert!(asked[0].request_id < 224, "{}", asked[0].request_id);
        confirm(&mut bench, asked[0].request_id, 7, 0.0);
        bench.stack.unsubscribe(bench.now, id);
        bench.collect();
        let cancelled = bench.sent::<CancelEvent>();
        assert!(cancelled.iter().all(|it| it.request_id < 224));
        bench.run_ms(5000);
        bench.sent.clear();
    }
}
