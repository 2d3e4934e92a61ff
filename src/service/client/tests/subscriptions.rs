//! Subscriptions: creation, renewal, outage and recovery, cancellation.

use std::time::Duration;

use bytes::Bytes;

use super::{Bench, OTHER, PEER};
use crate::codec::Message;
use crate::messages::core::create_event::EventType;
use crate::messages::core::{
    CancelEvent, ConfirmEventRequest, CreateEvent, Event, QueryControl, QueryEventTimeout,
    QueryStatus, RejectEventRequest, ReportControl, ReportEventTimeout, ReportIdentification,
    ReportStatus, UpdateEvent,
};
use crate::service::{
    CannotSubscribe, Event as StackEvent, Outage, Patience, Scope, SubscriptionEnd, SubscriptionId,
    SubscriptionNews, Topic, When,
};

pub(super) fn status(when: When) -> Topic {
    Topic {
        peer: PEER,
        query: QueryStatus {}.encode().expect("a query"),
        report: ReportStatus::CODE,
        when,
    }
}

fn control(when: When) -> Topic {
    Topic {
        peer: PEER,
        query: QueryControl {}.encode().expect("a query"),
        report: ReportControl::CODE,
        when,
    }
}

pub(super) fn subscribe(bench: &mut Bench, topic: &Topic) -> SubscriptionId {
    let subscribed = bench.stack.subscribe(bench.now, topic, Patience::default());
    bench.collect();
    subscribed.expect("nothing is in the way")
}

/// Confirms a request as event `event_id` at a rate of `hz`.
pub(super) fn confirm(bench: &mut Bench, request_id: u8, event_id: u8, hz: f64) {
    let mut confirm = ConfirmEventRequest {
        request_id,
        event_id,
        ..ConfirmEventRequest::default()
    };
    confirm.set_confirmed_periodic_rate_hz(hz).expect("a rate");
    bench.hear(PEER, &confirm);
}

/// Confirms all requests since the last call; returns how many there were.
fn confirm_all(bench: &mut Bench, event_id: u8, hz: f64) -> usize {
    let asked = bench.sent::<CreateEvent>();
    for create in &asked {
        confirm(bench, create.request_id, event_id, hz);
    }
    asked.len()
}

pub(super) fn event_of(event_id: u8, sequence_number: u8, report_message: Bytes) -> Event {
    Event {
        event_id,
        sequence_number,
        report_message,
    }
}

pub(super) fn fire(bench: &mut Bench, event: u8, sequence: u8) {
    let report = ReportStatus::default().encode().expect("a report");
    bench.hear(PEER, &event_of(event, sequence, report));
}

/// A notification in short form.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Notice {
    Up(Option<u32>),
    Report { lost: u8 },
    Down(Outage),
    Ended(SubscriptionEnd),
}

pub(super) fn notices(bench: &mut Bench) -> Vec<Notice> {
    let events = bench.events().into_iter();
    events
        .filter_map(|event| match event {
            StackEvent::Subscription(_, news) => Some(match news {
                SubscriptionNews::Up { hz } => Notice::Up(hz.map(|hz| hz.round() as u32)),
                SubscriptionNews::Report { lost, .. } => Notice::Report { lost },
                SubscriptionNews::Down { why, .. } => Notice::Down(why),
                SubscriptionNews::Ended(end) => Notice::Ended(end),
            }),
            _ => None,
        })
        .collect()
}

/// A bench with a confirmed subscription, event 7.
pub(super) fn up(when: When) -> (Bench, SubscriptionId) {
    let mut bench = Bench::new();
    let id = subscribe(&mut bench, &status(when));
    let hz = match when {
        When::Periodic { hz, .. } => hz,
        When::OnChange => 0.0,
    };
    assert_eq!(confirm_all(&mut bench, 7, hz), 1);
    assert!(matches!(notices(&mut bench)[..], [Notice::Up(_)]));
    (bench, id)
}

#[test]
fn an_event_is_created_as_it_was_asked_for() {
    let mut bench = Bench::new();
    subscribe(&mut bench, &status(When::hz(10.0)));
    subscribe(&mut bench, &status(When::OnChange));
    let [periodic, on_change] = &bench.sent::<CreateEvent>()[..] else {
        panic!("two events are to be created");
    };
    assert_eq!(periodic.event_type, EventType::PERIODIC_SC);
    assert!((periodic.requested_periodic_rate_hz() - 10.0).abs() < 0.01);
    assert_eq!(periodic.query_message[..], [0x02, 0x20]);
    assert_eq!(on_change.event_type, EventType::EVERY_CHANGE);
    assert_eq!(on_change.requested_periodic_rate_hz(), 0.0);
    assert_ne!(periodic.request_id, on_change.request_id);
}

#[test]
fn the_confirmed_rate_is_told() {
    let mut bench = Bench::new();
    subscribe(&mut bench, &status(When::hz(50.0)));
    confirm_all(&mut bench, 7, 25.0);
    assert_eq!(notices(&mut bench), [Notice::Up(Some(25))]);
}

#[test]
fn a_lost_confirmation_is_asked_for_with_the_same_request() {
    let mut bench = Bench::new();
    subscribe(&mut bench, &status(When::hz(1.0)));
    bench.run_ms(600);
    let asked = bench.sent::<CreateEvent>();
    assert_eq!(asked.len(), 2);
    assert_eq!(asked[0], asked[1]);
    confirm(&mut bench, asked[1].request_id, 7, 1.0);
    assert_eq!(notices(&mut bench), [Notice::Up(Some(1))]);
}

#[test]
fn a_report_that_is_ahead_of_its_confirmation_is_not_lost() {
    let mut bench = Bench::new();
    subscribe(&mut bench, &status(When::OnChange));
    fire(&mut bench, 7, 0);
    assert_eq!(notices(&mut bench), []);
    assert_eq!(confirm_all(&mut bench, 7, 0.0), 1);
    assert_eq!(
        notices(&mut bench),
        [Notice::Up(None), Notice::Report { lost: 0 }]
    );
}

#[test]
fn who_neither_confirms_nor_rejects_is_given_up() {
    let mut bench = Bench::new();
    subscribe(&mut bench, &status(When::hz(1.0)));
    bench.run_ms(1500);
    let [Notice::Ended(SubscriptionEnd::NoAnswer(failure))] = notices(&mut bench)[..] else {
        panic!("it is to be given up");
    };
    assert_eq!((failure.peer, failure.tries), (PEER, 3));
    bench.sent.clear();
    bench.run_ms(60_000);
    assert_eq!(bench.sent, []);
}

#[test]
fn a_rejection_ends_it_with_the_reason() {
    let mut bench = Bench::new();
    subscribe(&mut bench, &status(When::hz(1.0)));
    let request_id = bench.sent::<CreateEvent>()[0].request_id;
    let reject = RejectEventRequest {
        request_id,
        response_code: Some(5.into()),
        error_message: None,
    };
    bench.hear(PEER, &reject);
    let [Notice::Ended(end)] = &notices(&mut bench)[..] else {
        panic!("it is rejected");
    };
    assert_eq!(
        end.to_string(),
        "the peer refuses it: it has no events for this message (code 5)"
    );
}

#[test]
fn a_rate_below_what_is_of_use_is_refused_and_cancelled() {
    let mut bench = Bench::new();
    subscribe(&mut bench, &status(When::hz(50.0).at_least(20.0)));
    confirm_all(&mut bench, 7, 10.0);
    assert!(matches!(
        notices(&mut bench)[..],
        [Notice::Ended(SubscriptionEnd::TooSlow { .. })]
    ));
    assert_eq!(bench.sent::<CancelEvent>()[0].event_id, 7);
}

/// Confirms the requests of one minute; returns how many there were.
fn renewals_in_a_minute(bench: &mut Bench, hz: f64) -> usize {
    let mut renewals = 0;
    // Three times 256 steps, so that the numbers wrap around.
    for step in 0..768_u32 {
        bench.run(Duration::from_micros(78_125));
        renewals += confirm_all(bench, 7, hz);
        if hz > 0.0 {
            fire(bench, 7, step as u8);
        }
    }
    renewals
}

#[test]
fn what_is_sent_on_change_is_renewed_because_its_end_would_not_be_noticed() {
    let (mut bench, _) = up(When::OnChange);
    assert_eq!(renewals_in_a_minute(&mut bench, 0.0), 3);
    assert_eq!(notices(&mut bench), []);
}

#[test]
fn a_periodic_event_is_renewed_three_times_in_its_lifetime_if_it_has_one() {
    let (mut bench, _) = up(When::hz(10.0));
    assert_eq!(renewals_in_a_minute(&mut bench, 10.0), 0);
    bench.hear(PEER, &ReportEventTimeout { timeout: 1.into() });
    assert_eq!(renewals_in_a_minute(&mut bench, 10.0), 3);
    bench.hear(PEER, &ReportEventTimeout { timeout: 0.into() });
    assert_eq!(renewals_in_a_minute(&mut bench, 10.0), 0);
}

#[test]
fn a_peer_is_asked_how_long_events_last_together_with_the_event() {
    let mut bench = Bench::new();
    subscribe(&mut bench, &status(When::hz(1.0)));
    assert_eq!(bench.sent::<QueryEventTimeout>().len(), 1);
    bench.run_ms(60_000);
    assert_eq!(bench.sent::<QueryEventTimeout>().len(), 2);
}

#[test]
fn a_renewal_brings_the_last_report_once_more_and_that_is_no_change() {
    let (mut bench, _) = up(When::OnChange);
    fire(&mut bench, 7, 0);
    bench.run_ms(20_000);
    assert_eq!(confirm_all(&mut bench, 7, 0.0), 1);
    fire(&mut bench, 7, 1);
    assert_eq!(notices(&mut bench), [Notice::Report { lost: 0 }]);
    fire(&mut bench, 7, 2);
    assert_eq!(notices(&mut bench), [Notice::Report { lost: 0 }]);
}

#[test]
fn a_confirmation_that_nobody_asked_for_may_be_the_end_of_the_event() {
    let (mut bench, _) = up(When::OnChange);
    bench.run_ms(10_000);
    confirm(&mut bench, 1, 7, 0.0);
    bench.run_ms(400);
    assert_eq!(confirm_all(&mut bench, 7, 0.0), 1);
    assert_eq!(notices(&mut bench), []);
}

#[test]
fn reports_on_change_are_down_when_nobody_confirms_them() {
    let (mut bench, _) = up(When::OnChange);
    bench.run_ms(30_000);
    assert_eq!(notices(&mut bench), [Notice::Down(Outage::Unconfirmed)]);
    bench.run_ms(600_000);
    assert!(confirm_all(&mut bench, 3, 0.0) > 100);
    assert_eq!(notices(&mut bench), [Notice::Up(None)]);
}

#[test]
fn when_discovery_loses_the_peer_it_is_down_and_asked_for_when_the_peer_is_found() {
    let mut bench = Bench::looking_for(Scope::System);
    let identified = ReportIdentification {
        query_type: 4.into(),
        r#type: 60001.into(),
        identification: "Rover".into(),
    };
    bench.hear(PEER, &identified);
    subscribe(&mut bench, &status(When::OnChange));
    // A rate of 0 counts as silence: the subscription goes down before its first renewal.
    confirm_all(&mut bench, 7, 0.0);
    assert_eq!(notices(&mut bench), [Notice::Up(None)]);
    bench.run_ms(19_000);
    assert_eq!(notices(&mut bench), [Notice::Down(Outage::PeerLost)]);
    bench.run_ms(60_000);
    bench.sent.clear();
    bench.hear(PEER, &identified);
    bench.run_ms(0);
    assert_eq!(confirm_all(&mut bench, 7, 0.0), 1, "not only after a pause");
    assert_eq!(notices(&mut bench), [Notice::Up(None)]);
}

#[test]
fn a_peer_that_speaks_again_after_a_silence_is_asked_at_once_and_not_for_every_word() {
    let (mut bench, _) = up(When::hz(10.0));
    fire(&mut bench, 7, 0);
    bench.run_ms(6000);
    bench.sent.clear();
    // During a pause between two attempts, which has become long.
    bench.hear(PEER, &QueryStatus {});
    bench.run_ms(0);
    let asked = bench.sent::<CreateEvent>();
    assert_eq!(asked.len(), 1);
    for _ in 0..40 {
        bench.hear(PEER, &QueryStatus {});
        bench.run_ms(100);
    }
    assert!(bench.sent::<CreateEvent>().len() <= 1);
    confirm(&mut bench, asked[0].request_id, 7, 10.0);
    assert_eq!(
        notices(&mut bench)[2..],
        [Notice::Up(Some(10))],
        "after the report and its end"
    );
}

#[test]
fn a_peer_that_restarted_and_does_not_offer_the_report_yet_is_asked_again() {
    let (mut bench, _) = up(When::OnChange);
    bench.run_ms(20_000);
    let request_id = bench.sent::<CreateEvent>()[0].request_id;
    let reject = RejectEventRequest {
        request_id,
        ..RejectEventRequest::default()
    };
    bench.hear(PEER, &reject);
    assert!(matches!(
        notices(&mut bench)[..],
        [Notice::Down(Outage::Refused(_))]
    ));
    bench.run_ms(5200);
    assert_eq!(confirm_all(&mut bench, 7, 0.0), 1);
    assert_eq!(notices(&mut bench), [Notice::Up(None)]);
}

#[test]
fn a_number_that_is_given_twice_means_that_the_first_owner_must_ask_again() {
    let (mut bench, _) = up(When::OnChange);
    subscribe(&mut bench, &status(When::hz(1.0)));
    assert_eq!(confirm_all(&mut bench, 7, 1.0), 1);
    bench.run_ms(500);
    let asked = bench.sent::<CreateEvent>();
    assert_eq!(asked.len(), 1);
    assert_eq!(asked[0].event_type, EventType::EVERY_CHANGE);
}

#[test]
fn events_with_the_same_number_are_told_apart_by_their_reports() {
    let (mut bench, first) = up(When::OnChange);
    let second = subscribe(&mut bench, &control(When::OnChange));
    confirm_all(&mut bench, 7, 0.0);
    bench.events();
    let report = ReportControl::default().encode().expect("a report");
    bench.hear(PEER, &event_of(7, 0, report));
    fire(&mut bench, 7, 0);
    let owners: Vec<_> = bench
        .events()
        .into_iter()
        .filter_map(|event| match event {
            StackEvent::Subscription(id, SubscriptionNews::Report { .. }) => Some(id),
            _ => None,
        })
        .collect();
    assert_eq!(owners, [second, first]);
}

/// Update Event crashes JAUS++.
#[test]
fn no_update_event_is_sent_in_the_whole_life_of_a_subscription() {
    let mut bench = Bench::new();
    let mut sent = Vec::new();
    for hz in [1.0, 5.0] {
        let id = subscribe(&mut bench, &status(When::hz(hz)));
        sent.append(&mut bench.sent);
        let [create] = CreateEvent::decode(&sent[sent.len() - 1].1)
            .map(|it| [it])
            .unwrap();
        confirm(&mut bench, create.request_id, 0, hz);
        fire(&mut bench, 0, 0);
        // The stream stops, is requested again, and returns.
        bench.run_ms(20_000);
        confirm(&mut bench, create.request_id, 0, hz);
        bench.stack.unsubscribe(bench.now, id);
        bench.run_ms(3000);
        sent.append(&mut bench.sent);
    }
    let of = |code: u16| {
        let is_it = |(_, octets): &&(_, Bytes)| octets.starts_with(&code.to_le_bytes());
        sent.iter().filter(is_it).count()
    };
    assert!(of(CreateEvent::CODE) > 4 && of(CancelEvent::CODE) >= 2);
    assert_eq!(of(UpdateEvent::CODE), 0);
}

/// JAUS++ sends the first report of Global Pose four times at once, with the numbers 0 to 3.
#[test]
fn a_first_report_that_comes_four_times_loses_nothing_and_cancels_nothing() {
    let mut bench = Bench::new();
    subscribe(&mut bench, &status(When::hz(5.0)));
    confirm_all(&mut bench, 0, 5.0);
    bench.sent.clear();
    for sequence in 0..4 {
        fire(&mut bench, 0, sequence);
    }
    bench.run_ms(200);
    fire(&mut bench, 0, 4);
    let all = notices(&mut bench);
    assert_eq!(all.len(), 1 + 5, "{all:?}");
    assert!(
        all[1..]
            .iter()
            .all(|news| *news == Notice::Report { lost: 0 })
    );
    assert_eq!(bench.sent::<CancelEvent>(), []);
}

#[test]
fn an_event_that_nobody_wants_is_cancelled_but_not_for_every_copy() {
    let (mut bench, _) = up(When::OnChange);
    for sequence in 0..100 {
        fire(&mut bench, 9, sequence);
        bench.run_ms(1);
    }
    let cancelled = bench.sent::<CancelEvent>();
    assert_eq!(cancelled.len(), 1);
    assert_eq!(cancelled[0].event_id, 9);
    confirm(&mut bench, cancelled[0].request_id, 9, 0.0);
    assert_eq!(notices(&mut bench), []);
    bench.run_ms(10_000);
    assert_eq!(bench.sent::<CancelEvent>(), []);
}

#[test]
fn strangers_that_pour_events_get_ten_answers_a_second_at_most() {
    let (mut bench, _) = up(When::OnChange);
    let report = ReportStatus::default().encode().expect("a report");
    for number in 0..10_000_u32 {
        let event = event_of(number as u8, 0, report.clone());
        bench.hear(OTHER, &event);
        bench.run(Duration::from_micros(100));
    }
    assert!(bench.sent.len() <= 30, "{}", bench.sent.len());
}

#[test]
fn without_a_subscription_events_are_the_applications() {
    let mut bench = Bench::new();
    fire(&mut bench, 7, 0);
    assert!(matches!(bench.events()[..], [StackEvent::Message(_)]));
    assert_eq!(bench.sent, []);
}

#[test]
fn what_is_dropped_is_cancelled_until_that_is_confirmed() {
    let (mut bench, id) = up(When::hz(1.0));
    bench.stack.unsubscribe(bench.now, id);
    fire(&mut bench, 7, 0);
    bench.run_ms(600);
    let cancelled = bench.sent::<CancelEvent>();
    assert_eq!(cancelled.len(), 2);
    assert_eq!(cancelled[0], cancelled[1]);
    confirm(&mut bench, cancelled[0].request_id, 7, 0.0);
    bench.run_ms(60_000);
    assert_eq!(bench.sent, []);
    assert_eq!(notices(&mut bench), []);
}

#[test]
fn a_cancellation_that_may_have_hit_another_event_has_that_one_renewed() {
    let (mut bench, id) = up(When::OnChange);
    subscribe(&mut bench, &control(When::OnChange));
    confirm_all(&mut bench, 7, 0.0);
    bench.stack.unsubscribe(bench.now, id);
    bench.collect();
    let request = bench.sent::<CancelEvent>()[0].request_id;
    confirm(&mut bench, request, 7, 0.0);
    bench.run_ms(500);
    assert_eq!(confirm_all(&mut bench, 7, 0.0), 1);
}

#[test]
fn what_cannot_be_asked_for_is_refused_at_once() {
    let mut bench = Bench::new();
    let mut topic = status(When::hz(1.0));
    let mut refusal = |topic: &Topic| {
        bench
            .stack
            .subscribe(bench.now, topic, Patience::default())
            .expect_err("it is to be refused")
    };
    for hz in [0.0, 0.001, -1.0, 1093.0, f64::NAN, f64::INFINITY] {
        topic.when = When::hz(hz);
        assert!(matches!(refusal(&topic), CannotSubscribe::Rate { .. }));
    }
    topic.peer = topic.peer.whole_subsystem();
    assert!(matches!(
        refusal(&topic),
        CannotSubscribe::NotOneComponent(_)
    ));
}

#[test]
fn a_peer_that_gives_every_event_the_same_number_is_asked_in_measure() {
    let (mut bench, _) = up(When::OnChange);
    subscribe(&mut bench, &status(When::hz(1.0)));
    let mut asked = 0;
    for _ in 0..10_000 {
        asked += confirm_all(&mut bench, 7, 1.0);
        bench.run_ms(1);
    }
    assert!(asked < 50, "{asked}");
}

#[test]
fn what_is_subscribed_to_already_is_refused() {
    let (mut bench, id) = up(When::hz(1.0));
    let again = |bench: &mut Bench| {
        let topic = status(When::hz(2.0));
        bench
            .stack
            .subscribe(bench.now, &topic, Patience::default())
    };
    assert_eq!(again(&mut bench), Err(CannotSubscribe::Already));
    bench.stack.unsubscribe(bench.now, id);
    assert!(again(&mut bench).is_ok());
}

#[test]
fn a_number_that_is_wanted_again_is_cancelled_no_more() {
    let (mut bench, id) = up(When::hz(1.0));
    bench.stack.unsubscribe(bench.now, id);
    subscribe(&mut bench, &status(When::hz(2.0)));
    confirm_all(&mut bench, 7, 2.0);
    bench.run_ms(60_000);
    assert_eq!(bench.sent::<CancelEvent>(), []);
}

#[test]
fn there_is_room_for_two_hundred_subscriptions_to_one_peer() {
    let mut bench = Bench::new();
    let numbered = |number: u8| Topic {
        query: [0x02, 0x24, number, 0].to_vec().into(),
        ..status(When::OnChange)
    };
    for number in 0..200 {
        subscribe(&mut bench, &numbered(number));
    }
    let mut requests: Vec<_> = bench
        .sent::<CreateEvent>()
        .iter()
        .map(|create| create.request_id)
        .collect();
    requests.sort_unstable();
    requests.dedup();
    assert_eq!(requests.len(), 200);
    let one_more = bench
        .stack
        .subscribe(bench.now, &numbered(200), Patience::default());
    assert_eq!(one_more, Err(CannotSubscribe::TooMany(200)));
}

#[test]
fn taking_leave_cancels_everything_with_one_word() {
    let (mut bench, _) = up(When::hz(1.0));
    bench.stack.take_leave(bench.now);
    bench.collect();
    assert_eq!(bench.sent::<CancelEvent>().len(), 1);
}
