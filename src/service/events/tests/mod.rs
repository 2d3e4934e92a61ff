//! Tests of the events of a whole component, in virtual time.

mod bounds;
mod commands;
mod published;

use std::ops::{Deref, DerefMut};
use std::sync::Arc;
use std::sync::atomic::{AtomicU16, Ordering};
use std::time::Duration;

use bytes::Bytes;

use super::{EventSettings, INVALID_EVENT};
use crate::address::JausId;
use crate::codec::{Message, ServiceId};
use crate::messages::core::create_event::EventType;
use crate::messages::core::*;
use crate::service::stack_rig::StackRig;
use crate::service::{AccessControl, Handlers, Liveness, Management, Transport};

const CLIENT: JausId = JausId::new(42, 1, 1);
const OTHER: JausId = JausId::new(42, 2, 1);
const SECOND: Duration = Duration::from_secs(1);

/// A test service whose report contains a number that the test sets.
const COUNTER: ServiceId = ServiceId {
    urn: "urn:test:Counter",
    major: 1,
    minor: 0,
};

struct Rig {
    rig: StackRig,
    number: Arc<AtomicU16>,
}

impl Deref for Rig {
    type Target = StackRig;

    fn deref(&self) -> &StackRig {
        &self.rig
    }
}

impl DerefMut for Rig {
    fn deref_mut(&mut self) -> &mut StackRig {
        &mut self.rig
    }
}

impl Rig {
    fn new() -> Self {
        Self::with(EventSettings::default())
    }

    fn with(settings: EventSettings) -> Self {
        let number = Arc::new(AtomicU16::new(0));
        let shown = number.clone();
        let counter = Handlers::new(COUNTER).receive(move |_: QueryElement, query, context| {
            let element_count = shown.load(Ordering::Relaxed);
            context.reply(query, &ReportElementCount { element_count });
        });
        let services: Vec<Box<dyn crate::service::Service>> = vec![
            Box::new(Transport),
            Box::new(Liveness::new()),
            Box::new(counter),
        ];
        let rig = StackRig::new(services, |stack| {
            let lasting = AccessControl::new().timeout(0);
            let management = Management::new().access_control(lasting);
            stack.event_settings(settings).management(management)
        });
        Self { rig, number }
    }

    fn set(&mut self, number: u16) -> Vec<(JausId, Bytes)> {
        self.number.store(number, Ordering::Relaxed);
        let now = self.now;
        self.stack.announce(now, QueryElement::CODE);
        self.said()
    }

    fn create(&mut self, client: JausId, create: &CreateEvent) -> Vec<(JausId, Bytes)> {
        self.hear(client, create)
    }
}

fn periodic<Q: Message>(request_id: u8, hertz: f64, query: &Q) -> CreateEvent {
    let mut create = CreateEvent {
        request_id,
        event_type: EventType(0),
        query_message: query.encode().unwrap(),
        ..CreateEvent::default()
    };
    create.set_requested_periodic_rate_hz(hertz).unwrap();
    create
}

fn on_change(request_id: u8) -> CreateEvent {
    CreateEvent {
        request_id,
        event_type: EventType(1),
        query_message: QueryElement { element_uid: 7 }.encode().unwrap(),
        ..CreateEvent::default()
    }
}

/// The first reply of that type.
fn answer<M: Message>(said: &[(JausId, Bytes)]) -> M {
    said.iter()
        .find_map(|(_, octets)| M::decode(octets).ok())
        .unwrap_or_else(|| panic!("no {} among {said:?}", M::NAME))
}

fn events(said: &[(JausId, Bytes)]) -> Vec<Event> {
    said.iter()
        .filter_map(|(_, octets)| Event::decode(octets).ok())
        .collect()
}

fn count_in(event: &Event) -> u16 {
    let report = ReportElementCount::decode(&event.report_message).unwrap();
    report.element_count
}

#[test]
fn a_periodic_event_is_confirmed_and_keeps_its_rate() {
    let mut rig = Rig::new();
    let said = rig.create(CLIENT, &periodic(1, 10.0, &QueryHeartbeatPulse));
    let confirm: ConfirmEventRequest = answer(&said);
    assert_eq!((confirm.request_id, confirm.event_id), (1, 1));
    assert!((confirm.confirmed_periodic_rate_hz() - 10.0).abs() < 0.01);
    let first = &events(&said)[0];
    assert_eq!((first.event_id, first.sequence_number), (1, 0));
    let report = ReportHeartbeatPulse.encode().unwrap();
    assert_eq!(first.report_message, report);
    let said = rig.run(60 * SECOND);
    assert!(said.len().abs_diff(600) <= 1, "{} in a minute", said.len());
    for (i, (at, to, octets)) in said.iter().enumerate() {
        let event = Event::decode(octets).unwrap();
        assert_eq!((*to, event.sequence_number), (CLIENT, (i + 1) as u8));
        let expected = (i + 1) as f64 / confirm.confirmed_periodic_rate_hz();
        assert!(
            (at.as_secs_f64() - expected).abs() < 1e-6,
            "beat {i} at {at:?}"
        );
    }
}

#[test]
fn a_late_wake_up_leaves_beats_out_and_keeps_to_the_others() {
    let mut rig = Rig::new();
    rig.create(CLIENT, &periodic(1, 10.0, &QueryHeartbeatPulse));
    rig.now += Duration::from_millis(1050);
    let now = rig.now;
    rig.stack.handle_timeout(now);
    assert_eq!(rig.said().len(), 1, "ten beats were missed");
    let said = rig.run(Duration::from_millis(100));
    assert_eq!(said.len(), 1);
    assert!(
        (said[0].0.as_secs_f64() - 0.05).abs() < 0.01,
        "{:?}",
        said[0].0
    );
}

#[test]
fn a_wake_up_that_is_late_by_whole_beats_reports_once() {
    let mut rig = Rig::new();
    rig.create(CLIENT, &periodic(1, 10.0, &QueryHeartbeatPulse));
    let period = rig.stack.poll_timeout().unwrap() - rig.now;
    assert_eq!(rig.pass(2 * period).len(), 1);
    assert_eq!(rig.stack.poll_timeout(), Some(rig.now + period));
}

#[test]
fn creating_the_same_again_changes_the_rate_and_not_the_number_of_streams() {
    let mut rig = Rig::new();
    for (request, hertz) in [(1, 1.0), (2, 5.0), (3, 5.0)] {
        let said = rig.create(CLIENT, &periodic(request, hertz, &QueryHeartbeatPulse));
        let confirm: ConfirmEventRequest = answer(&said);
        assert_eq!((confirm.request_id, confirm.event_id), (request, 1));
    }
    assert!(rig.run(10 * SECOND).len().abs_diff(50) <= 1);
    let said = rig.create(CLIENT, &periodic(4, 1.0, &QueryStatus));
    assert_eq!(
        answer::<ConfirmEventRequest>(&said).event_id,
        2,
        "another query"
    );
    let said = rig.create(OTHER, &periodic(1, 1.0, &QueryHeartbeatPulse));
    assert_eq!(
        answer::<ConfirmEventRequest>(&said).event_id,
        1,
        "another client"
    );
}

#[test]
fn the_same_query_can_be_reported_periodically_and_on_change() {
    let mut rig = Rig::new();
    let query = QueryElement { element_uid: 7 };
    for (create, id) in [(periodic(1, 2.0, &query), 1), (on_change(2), 2)] {
        let confirm: ConfirmEventRequest = answer(&rig.create(CLIENT, &create));
        assert_eq!(confirm.event_id, id);
    }
    let query = query.encode().unwrap();
    let subscribed: Vec<_> = rig.stack.subscribed().collect();
    let (periodic, on_change) = (subscribed[0], subscribed[1]);
    assert_eq!((periodic.0, on_change), (&query, (&query, None)));
    assert!(periodic.1.is_some_and(|hertz| (hertz - 2.0).abs() < 0.01));
    assert_eq!((subscribed.len(), rig.stack.event_count()), (2, 2));
}

#[test]
fn a_client_is_probed_only_while_it_has_events() {
    let cancel = CancelEvent {
        request_id: 2,
        event_id: 1,
    };
    for (is_cancelled, expected) in [(false, true), (true, false)] {
        let mut rig = Rig::new();
        rig.create(CLIENT, &on_change(1));
        if is_cancelled {
            rig.hear(CLIENT, &cancel);
        }
        rig.now += 5 * SECOND;
        let now = rig.now;
        rig.stack.handle_timeout(now);
        let sent: Vec<_> = std::iter::from_fn(|| rig.stack.poll_transmit()).collect();
        let is_probe = |octets: &Bytes| QueryHeartbeatPulse::decode(octets).is_ok();
        assert_eq!(sent.iter().any(|it| is_probe(&it.payload)), expected);
    }
}

#[test]
fn a_renewal_keeps_the_beat_of_a_periodic_event() {
    let mut rig = Rig::new();
    rig.create(CLIENT, &periodic(1, 1.0, &QueryHeartbeatPulse));
    for _renewal in 0..10 {
        rig.run(Duration::from_millis(300));
        let said = rig.create(CLIENT, &periodic(1, 1.0, &QueryHeartbeatPulse));
        assert_eq!(said.len(), 1, "only the confirmation: {said:?}");
        answer::<ConfirmEventRequest>(&said);
    }
    let said = rig.run(10 * SECOND);
    assert!(said.len().abs_diff(10) <= 1, "{} in 10 s", said.len());
    let event = Event::decode(&said[0].2).unwrap();
    assert!((2..=3).contains(&event.sequence_number), "{event:?}");
}

#[test]
fn a_renewal_tells_again_what_has_not_changed_because_it_may_have_got_lost() {
    let mut rig = Rig::new();
    rig.create(CLIENT, &on_change(1));
    rig.now += SECOND;
    let said = rig.create(CLIENT, &on_change(1));
    assert_eq!(events(&said).iter().map(count_in).collect::<Vec<_>>(), [0]);
}

#[test]
fn a_change_is_told_once_and_only_if_it_is_one() {
    let mut rig = Rig::new();
    let said = rig.create(CLIENT, &on_change(1));
    assert_eq!(events(&said).iter().map(count_in).collect::<Vec<_>>(), [0]);
    rig.now += SECOND;
    assert_eq!(
        events(&rig.set(5)).iter().map(count_in).collect::<Vec<_>>(),
        [5]
    );
    rig.now += SECOND;
    assert!(rig.set(5).is_empty(), "announced, and the same");
    assert!(rig.run(60 * SECOND).is_empty());
}

#[test]
fn changes_that_follow_fast_are_told_together_and_the_last_is_not_lost() {
    let mut rig = Rig::with(EventSettings {
        fastest: 10.0,
        ..EventSettings::default()
    });
    rig.create(CLIENT, &on_change(1));
    let mut told = Vec::new();
    for number in 1..=1000 {
        rig.now += Duration::from_millis(1);
        let now = rig.now;
        rig.stack.handle_timeout(now);
        told.extend(events(&rig.set(number)));
    }
    told.extend(events(
        &rig.run(SECOND)
            .into_iter()
            .map(|(_, to, it)| (to, it))
            .collect::<Vec<_>>(),
    ));
    assert!(
        (10..=11).contains(&told.len()),
        "{} in a second",
        told.len()
    );
    assert_eq!(told.last().map(count_in), Some(1000));
}

#[test]
fn management_announces_its_own_changes() {
    let mut rig = Rig::new();
    let status = CreateEvent {
        event_type: EventType(1),
        ..periodic(1, 0.0, &QueryStatus)
    };
    rig.create(CLIENT, &status);
    rig.now += SECOND;
    let emergency = SetEmergency {
        emergency_code: set_emergency::EmergencyCode(1),
    };
    let said = rig.hear(OTHER, &emergency);
    let event = &events(&said)[0];
    let report = ReportStatus::decode(&event.report_message).unwrap();
    assert_eq!(report.status.0, 5);
}

#[test]
fn discovery_announces_what_it_learns() {
    let mut rig = Rig::new();
    let services = QueryServices {
        node_list: Vec::new(),
    };
    let services = CreateEvent {
        event_type: EventType(1),
        ..periodic(1, 0.0, &services)
    };
    rig.create(CLIENT, &services);
    rig.now += SECOND;
    let now = rig.now;
    let time = Handlers::new(time::LATEST).declines::<QueryTime>();
    rig.stack.offer(now, Box::new(time)).unwrap();
    let told = events(&rig.said());
    let report = ReportServices::decode(&told[0].report_message).unwrap();
    let text = format!("{report:?}");
    assert!(text.contains(time::URN), "{text}");
}

#[test]
fn an_update_changes_the_rate_of_the_event_that_it_names() {
    let mut rig = Rig::new();
    rig.create(CLIENT, &periodic(1, 1.0, &QueryHeartbeatPulse));
    let mut update = UpdateEvent {
        request_id: 4,
        event_id: 1,
        query_message: QueryHeartbeatPulse.encode().unwrap(),
        ..UpdateEvent::default()
    };
    update.set_requested_periodic_rate_hz(0.5).unwrap();
    let said = rig.hear(CLIENT, &update);
    let confirm: ConfirmEventRequest = answer(&said);
    assert_eq!((confirm.request_id, confirm.event_id), (4, 1));
    assert!((confirm.confirmed_periodic_rate_hz() - 0.5).abs() < 0.01);
    assert!(rig.run(20 * SECOND).len().abs_diff(10) <= 1);
    assert_eq!(events(&rig.hear(CLIENT, &update)), [], "the same again");
    let another = UpdateEvent {
        query_message: QueryStatus.encode().unwrap(),
        ..update.clone()
    };
    let said = rig.hear(CLIENT, &another);
    assert_eq!(events(&said).len(), 1, "the first report of another query");
    let said = rig.hear(OTHER, &update);
    let reject: RejectEventRequest = answer(&said);
    assert_eq!(reject.response_code, Some(INVALID_EVENT), "not its event");
}

#[test]
fn a_cancelled_event_ends_and_others_go_on() {
    let mut rig = Rig::new();
    rig.create(CLIENT, &periodic(1, 1.0, &QueryHeartbeatPulse));
    rig.create(CLIENT, &periodic(2, 1.0, &QueryStatus));
    let cancel = CancelEvent {
        request_id: 7,
        event_id: 1,
    };
    let confirm: ConfirmEventRequest = answer(&rig.hear(CLIENT, &cancel));
    assert_eq!((confirm.request_id, confirm.event_id), (7, 1));
    let said = rig.run(10 * SECOND);
    assert!(said.len().abs_diff(10) <= 1);
    assert!(
        said.iter()
            .all(|(_, _, it)| Event::decode(it).unwrap().event_id == 2)
    );
    let reject: RejectEventRequest = answer(&rig.hear(CLIENT, &cancel));
    assert_eq!(reject.response_code, Some(INVALID_EVENT));
}

#[test]
fn a_client_is_told_of_its_own_events_by_each_question() {
    let mut rig = Rig::new();
    rig.create(CLIENT, &periodic(1, 1.0, &QueryHeartbeatPulse));
    rig.create(CLIENT, &on_change(2));
    rig.create(OTHER, &periodic(3, 1.0, &QueryHeartbeatPulse));
    for (question, expected) in [
        ([0, 0x02, 0x22].as_slice(), vec![1]),
        (&[1, 0], vec![1]),
        (&[1, 1], vec![2]),
        // The requested one first, then the others.
        (&[2, 2], vec![2, 1]),
        (&[2, 9], vec![]),
        (&[3, 0], vec![1, 2]),
    ] {
        let octets = Bytes::from([&[0xF0, 0x21], question].concat());
        let query = QueryEvents::decode(&octets).unwrap();
        let report: ReportEvents = answer(&rig.hear(CLIENT, &query));
        let ids: Vec<u8> = report
            .event_list
            .iter()
            .map(|event| event.event_id)
            .collect();
        assert_eq!(ids, expected, "{question:?}");
    }
}

#[test]
fn the_queries_of_an_own_service_are_subscribed_to_whatever_their_codes_and_its_commands_are_not() {
    let obeyed = Arc::new(AtomicU16::new(0));
    let obeys = obeyed.clone();
    let own = Handlers::undecoded(COUNTER)
        .answer(0xD1F0, |_| Some(Bytes::from_static(&[0xF2, 0xD1, 7])))
        .receive(0xD1F3, move |_, _| {
            obeys.fetch_add(1, Ordering::Relaxed);
        })
        .unwrap();
    let mut rig = StackRig::new(vec![Box::new(own)], |stack| stack);
    let create = |code: u16| CreateEvent {
        query_message: Bytes::copy_from_slice(&code.to_le_bytes()),
        ..on_change(1)
    };
    let said = rig.hear(CLIENT, &create(0xD1F0));
    answer::<ConfirmEventRequest>(&said);
    assert_eq!(events(&said)[0].report_message[2], 7);
    let said = rig.hear(CLIENT, &create(0xD1F3));
    answer::<RejectEventRequest>(&said);
    assert_eq!(obeyed.load(Ordering::Relaxed), 0);
}
