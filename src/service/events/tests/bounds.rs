//! Rejected events, and the limits of the event table.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use bytes::Bytes;

use super::super::rejecting::{INVALID_EVENT, rejection};
use super::{CLIENT, COUNTER, OTHER, Rig, SECOND, answer, events, on_change, periodic};
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::{LinkId, Path};
use crate::messages::core::create_event::EventType;
use crate::messages::core::reject_event_request::ResponseCode;
use crate::messages::core::*;
use crate::service::stack_rig::StackRig;
use crate::service::{EventSettings, Handlers};

/// JAUS++ reads the presence vector, request id, code and, if the first presence bit is set, 80
/// octets of text.
#[test]
fn a_rejection_is_one_that_jauspp_reads_too() {
    let mut rig = Rig::new();
    let said = rig.hear(
        CLIENT,
        &CancelEvent {
            request_id: 9,
            event_id: 77,
        },
    );
    let [(to, octets)] = &said[..] else {
        panic!("one answer: {said:?}")
    };
    assert_eq!(*to, CLIENT);
    let [0xF4, 0x01, presence, request, code, ref text @ ..] = octets[..] else {
        panic!("{octets:?}")
    };
    assert_eq!((presence & 1, request, code), (1, 9, 6));
    assert_eq!(text.len(), 80);
    assert!(text.starts_with(b"you have no event"));
    let strict: RejectEventRequest = answer(&said);
    assert_eq!(strict.response_code, Some(ResponseCode(6)));
}

#[test]
fn what_nobody_could_answer_is_refused() {
    let rate = |create: CreateEvent, hertz| {
        let mut create = create;
        create.set_requested_periodic_rate_hz(hertz).unwrap();
        create
    };
    let query = |octets: &'static [u8]| CreateEvent {
        query_message: Bytes::from_static(octets),
        ..periodic(9, 1.0, &QueryStatus)
    };
    let kind = |kind| CreateEvent {
        event_type: EventType(kind),
        ..periodic(9, 1.0, &QueryStatus)
    };
    for (what, create, why) in [
        (
            "a report",
            query(&[0x02, 0x44, 0, 0]),
            ResponseCode::MESSAGE_NOT_SUPPORTED,
        ),
        (
            "a command",
            query(&[0x02, 0x00]),
            ResponseCode::MESSAGE_NOT_SUPPORTED,
        ),
        (
            "an unknown query",
            query(&[0xFF, 0x2F]),
            ResponseCode::MESSAGE_NOT_SUPPORTED,
        ),
        (
            "half a query",
            query(&[0x1A, 0x24]),
            ResponseCode::MESSAGE_NOT_SUPPORTED,
        ),
        (
            "events",
            query(&[0xF0, 0x21, 3, 0]),
            ResponseCode::MESSAGE_NOT_SUPPORTED,
        ),
        ("nothing", query(&[]), ResponseCode::INVALID_EVENT_SETUP),
        (
            "a query without an end",
            query(&[0x02; 0x2000]),
            ResponseCode::MESSAGE_NOT_SUPPORTED,
        ),
        (
            "a long query",
            query(&[0x22; 0x2000]),
            ResponseCode::INVALID_EVENT_SETUP,
        ),
        (
            "the longest query, which is unknown",
            query(&[0x22; 1024]),
            ResponseCode::MESSAGE_NOT_SUPPORTED,
        ),
        (
            "a query that is too long",
            query(&[0x22; 1025]),
            ResponseCode::INVALID_EVENT_SETUP,
        ),
        (
            "an unknown type",
            kind(2),
            ResponseCode::INVALID_EVENT_SETUP,
        ),
        (
            "no rate",
            rate(periodic(9, 1.0, &QueryStatus), 0.0),
            ResponseCode::INVALID_EVENT_SETUP,
        ),
    ] {
        let mut rig = Rig::new();
        let said = rig.create(CLIENT, &create);
        let reject: RejectEventRequest = answer(&said);
        assert_eq!(
            (reject.request_id, reject.response_code),
            (9, Some(why)),
            "{what}"
        );
        assert_eq!((said.len(), rig.stack.event_count()), (1, 0), "{what}");
    }
}

#[test]
fn a_rejection_says_why_in_words() {
    for (why, words) in [
        (ResponseCode::CONNECTION_REFUSED, "no room"),
        (ResponseCode::INVALID_EVENT_SETUP, "invalid event type"),
        (
            ResponseCode::MESSAGE_NOT_SUPPORTED,
            "this component does not answer",
        ),
        (INVALID_EVENT, "you have no event"),
        (ResponseCode(99), "refused"),
    ] {
        let text = format!("{:?}", rejection(1, why).error_message);
        assert!(text.contains(words), "{text}");
    }
}

#[test]
fn events_on_discovery_do_not_use_up_the_answers_of_others() {
    let mut rig = Rig::new();
    let who = QueryIdentification {
        query_type: 4.into(),
    };
    for client in 0..4 {
        let client = JausId::new(200 + client, 1, 1);
        rig.create(client, &periodic(1, 250.0, &who));
    }
    let said = rig.run(10 * SECOND);
    assert!(said.len().abs_diff(10_000) <= 10, "{}", said.len());
    answer::<ReportIdentification>(&rig.hear(OTHER, &who));
}

#[test]
fn settings_out_of_all_reason_are_kept_within_what_can_be_told() {
    for (fastest, expected) in [(f64::INFINITY, 1092.0), (0.0, 0.01)] {
        let mut rig = Rig::with(EventSettings {
            fastest,
            reports_per_second: f64::INFINITY,
            ..EventSettings::default()
        });
        let said = rig.create(CLIENT, &periodic(1, 1092.0, &QueryHeartbeatPulse));
        let confirm: ConfirmEventRequest = answer(&said);
        let confirmed = confirm.confirmed_periodic_rate_hz();
        assert!((confirmed - expected).abs() < 0.01, "{fastest}");
        rig.run(SECOND);
    }
}

#[test]
fn what_is_too_fast_is_confirmed_slower() {
    let mut rig = Rig::new();
    let said = rig.create(CLIENT, &periodic(1, 1092.0, &QueryHeartbeatPulse));
    let confirm: ConfirmEventRequest = answer(&said);
    assert!((confirm.confirmed_periodic_rate_hz() - 250.0).abs() < 0.01);
    assert!(rig.run(SECOND).len().abs_diff(250) <= 1);
}

#[test]
fn ten_thousand_subscriptions_are_bounded_for_one_client_and_for_all() {
    let mut rig = Rig::new();
    let refused = |said: &[(JausId, Bytes)]| {
        said.iter()
            .filter_map(|(_, octets)| RejectEventRequest::decode(octets).ok())
            .filter(|it| it.response_code == Some(ResponseCode::CONNECTION_REFUSED))
            .count()
    };
    let element = |i: u16| QueryElement { element_uid: i };
    let mut count = 0;
    for i in 0..1000 {
        count += refused(&rig.create(CLIENT, &periodic(1, 1.0, &element(i))));
    }
    assert_eq!((rig.stack.event_count(), count), (256, 744));
    for i in 0..10_000 {
        let client = JausId::new(1000 + i / 100, 1, 1 + (i % 100) as u8);
        count += refused(&rig.create(client, &periodic(1, 1.0, &QueryStatus)));
    }
    assert_eq!((rig.stack.event_count(), count), (4096, 744 + 6160));
    let said = rig.create(OTHER, &periodic(1, 1.0, &QueryStatus));
    assert_eq!(refused(&said), 1);
}

#[test]
fn the_sum_of_all_rates_is_bounded() {
    let mut rig = Rig::with(EventSettings {
        reports_per_second: 500.0,
        ..EventSettings::default()
    });
    rig.create(CLIENT, &periodic(1, 250.0, &QueryStatus));
    rig.create(CLIENT, &periodic(2, 240.0, &QueryControl));
    let said = rig.create(OTHER, &periodic(3, 20.0, &QueryStatus));
    let reject: RejectEventRequest = answer(&said);
    assert_eq!(reject.response_code, Some(ResponseCode::CONNECTION_REFUSED));
    rig.create(CLIENT, &periodic(4, 1.0, &QueryStatus));
    let said = rig.create(OTHER, &periodic(5, 20.0, &QueryStatus));
    assert_eq!(
        answer::<ConfirmEventRequest>(&said).request_id,
        5,
        "there is room again"
    );
}

#[test]
fn events_that_nobody_renews_expire_if_so_wanted() {
    let mut rig = Rig::with(EventSettings {
        timeout: 1,
        ..EventSettings::default()
    });
    let timeout: ReportEventTimeout = answer(&rig.hear(CLIENT, &QueryEventTimeout));
    assert_eq!(timeout.timeout.0, 1);
    rig.create(CLIENT, &periodic(1, 1.0, &QueryStatus));
    rig.run(50 * SECOND);
    let all = QueryEvents::decode(&Bytes::from_static(&[0xF0, 0x21, 3, 0])).unwrap();
    rig.hear(CLIENT, &all);
    let said = rig.run(120 * SECOND);
    let told: Vec<_> = said.iter().map(|(_, to, it)| (*to, it.clone())).collect();
    assert!(
        events(&told).len().abs_diff(60) <= 1,
        "renewed by asking for it"
    );
    let confirm: ConfirmEventRequest = answer(&told);
    assert_eq!(
        (confirm.request_id, confirm.event_id),
        (1, 1),
        "its end is told"
    );
}

#[test]
fn an_event_expires_when_its_minutes_have_passed() {
    let mut rig = Rig::with(EventSettings {
        timeout: 2,
        ..EventSettings::default()
    });
    let create = CreateEvent {
        event_type: EventType(1),
        ..periodic(5, 0.0, &QueryStatus)
    };
    rig.create(CLIENT, &create);
    let said = rig.run(300 * SECOND);
    assert_eq!(said.len(), 1, "{said:?}");
    let confirm = ConfirmEventRequest::decode(&said[0].2).unwrap();
    assert_eq!((said[0].0, confirm.request_id), (120 * SECOND, 5));
    assert_eq!(rig.stack.event_count(), 0);
}

/// A network address.
fn at(host: u8) -> Option<Path> {
    let peer = std::net::SocketAddr::from(([10, 0, 0, host], 3794)).into();
    let link = LinkId(0);
    Some(Path { link, peer })
}

#[test]
fn whatever_one_address_takes_under_many_ids_another_can_subscribe() {
    for hertz in [0.1, 200.0] {
        let mut rig = Rig::new();
        let (mut granted, mut refused) = (0, 0);
        for forged in 0..=u8::MAX {
            for request in 0..20 {
                let element_uid = request.into();
                let create = periodic(request, hertz, &QueryElement { element_uid });
                let client = JausId::new(42, 1 + forged / 128, 1 + forged % 128);
                let said = rig.hear_on(at(66), client, &create);
                let said = said.into_iter().find(|(to, _)| *to == client).unwrap();
                granted += usize::from(ConfirmEventRequest::decode(&said.1).is_ok());
                refused += usize::from(RejectEventRequest::decode(&said.1).is_ok());
            }
        }
        assert!(granted <= 4096 && refused > 0, "{granted} granted");
        let honest = JausId::new(43, 1, 1);
        let said = rig.hear_on(at(9), honest, &periodic(1, hertz, &QueryElement::default()));
        let _: ConfirmEventRequest = answer(&said);
    }
}

#[test]
fn a_query_is_answered_once_for_all_clients_that_are_told_together() {
    let asked = Arc::new(AtomicUsize::new(0));
    let count = asked.clone();
    let counter = Handlers::new(COUNTER).receive(move |_: QueryElement, query, context| {
        let element_count = count.fetch_add(1, Ordering::Relaxed) as u16;
        context.reply(query, &ReportElementCount { element_count });
    });
    let mut rig = StackRig::new(vec![Box::new(counter)], |stack| stack);
    for client in 1..=100 {
        let create = CreateEvent {
            event_type: EventType(1),
            ..periodic(1, 0.0, &QueryElement::default())
        };
        rig.hear(JausId::new(42, 1, client), &create);
    }
    rig.pass(SECOND);
    let before = asked.load(Ordering::Relaxed);
    let now = rig.now;
    rig.stack.announce(now, QueryElement::CODE);
    let told = rig.said();
    assert_eq!(told.len(), 100);
    assert_eq!(asked.load(Ordering::Relaxed) - before, 1);
}

#[test]
fn at_its_limit_a_client_can_change_its_events_and_have_no_others() {
    let mut rig = Rig::with(EventSettings {
        per_client: 1,
        reports_per_second: 10.0,
        ..EventSettings::default()
    });
    for (client, create, is_granted) in [
        (CLIENT, periodic(1, 1.0, &QueryStatus), true),
        (CLIENT, periodic(2, 10.0, &QueryStatus), true),
        (CLIENT, on_change(3), false),
        (OTHER, on_change(4), true),
        (OTHER, periodic(5, 1.0, &QueryStatus), false),
        (CLIENT, periodic(6, 9.0, &QueryStatus), true),
    ] {
        let said = rig.create(client, &create);
        let is_confirmed = ConfirmEventRequest::decode(&said[0].1).is_ok();
        assert_eq!(is_confirmed, is_granted, "request {}", create.request_id);
    }
    assert_eq!(rig.stack.event_count(), 2);
}

#[test]
fn an_event_that_becomes_faster_needs_room_for_the_difference() {
    let mut rig = Rig::with(EventSettings {
        reports_per_second: 10.0,
        ..EventSettings::default()
    });
    for (request, hertz, is_granted) in [(1, 6.0, true), (2, 10.0, true), (3, 11.0, false)] {
        let said = rig.create(CLIENT, &periodic(request, hertz, &QueryStatus));
        let is_confirmed = ConfirmEventRequest::decode(&said[0].1).is_ok();
        assert_eq!(is_confirmed, is_granted, "{hertz} Hz");
    }
    let said = rig.create(CLIENT, &periodic(4, 1.0, &QueryControl));
    let _: RejectEventRequest = answer(&said);
}
