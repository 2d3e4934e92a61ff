//! The cost of many subscriptions, compared with that of the same number of queries.

use std::hint::black_box;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::Received;
use jaus::messages::core::{CreateEvent, Event, QueryHeartbeatPulse, ReportHeartbeatPulse};
use jaus::service::{Discovery, Kind, Liveness, Profile, Scope, Stack, Timing, Transport};
use jaus::wire::{Broadcast, Priority};
use jaus_test_kit::figures::Figures;

use crate::quantile;

const US: JausId = JausId::new(101, 1, 1);
const CLIENTS: u16 = 10;

pub(crate) fn measure(turns: usize, figures: &mut Figures) {
    figures.table(
        "Processor time of a message, without a network",
        [
            "subscriptions",
            "answer to a query (ns)",
            "report of an event (ns)",
            "ratio",
        ],
    );
    for subscriptions in [1, 100, 1000] {
        let (mut queries, mut events) = (Vec::new(), Vec::new());
        for _turn in 0..=turns {
            queries.push(answer_queries());
            events.push(fire_events(subscriptions));
        }
        let [query, event] = [queries, events].map(|mut times| {
            times.sort_by(f64::total_cmp);
            quantile(&times, 0.5)
        });
        figures.row([
            &subscriptions.to_string(),
            &format!("{query:.0}"),
            &format!("{event:.0}"),
            &format!("{:.2}", event / query),
        ]);
    }
}

fn stack(now: Instant) -> Stack {
    let profile = Profile::new(Kind::Vehicle, "Bench");
    let discovery = Discovery::new(US, profile, Scope::Nobody, Timing::default(), 1);
    let mut stack = Stack::new(
        discovery,
        vec![Box::new(Transport), Box::new(Liveness::new())],
    );
    stack.start(now);
    drain(&mut stack, 0);
    stack
}

/// Takes all messages; returns how many have this code. Others keep the clients supervised.
fn drain(stack: &mut Stack, code: u16) -> usize {
    let mut messages = 0;
    while let Some(message) = stack.poll_transmit() {
        messages += usize::from(message.payload.starts_with(&code.to_le_bytes()));
        black_box(message);
    }
    messages
}

fn from(source: JausId, payload: Bytes) -> Received {
    Received {
        source,
        destination: US,
        to: US,
        priority: Priority::Standard,
        broadcast: Broadcast::None,
        payload,
        sequence: None,
        path: None,
        acknowledged: false,
    }
}

const fn client(number: u16) -> JausId {
    JausId::new(1000 + number % CLIENTS, 1, 1)
}

/// Nanoseconds per query, over a thousand queries.
fn answer_queries() -> f64 {
    let now = Instant::now();
    let mut stack = stack(now);
    let query = QueryHeartbeatPulse.encode().unwrap();
    let start = Instant::now();
    for number in 0..1000 {
        stack.handle_message(now, &from(client(number), query.clone()));
        assert_eq!(drain(&mut stack, ReportHeartbeatPulse::CODE), 1);
    }
    start.elapsed().as_nanos() as f64 / 1000.0
}

/// Nanoseconds per report over at least a thousand reports, with this number of subscriptions.
fn fire_events(subscriptions: u16) -> f64 {
    let mut now = Instant::now();
    let mut stack = stack(now);
    for number in 0..subscriptions {
        // The queries must differ, or all create the same event. Octets behind a query are ignored.
        let mut query = QueryHeartbeatPulse.encode().unwrap().to_vec();
        query.extend((number / CLIENTS).to_le_bytes());
        let mut create = CreateEvent {
            query_message: query.into(),
            ..CreateEvent::default()
        };
        create.set_requested_periodic_rate_hz(10.0).unwrap();
        let payload = create.encode().unwrap();
        stack.handle_message(now, &from(client(number), payload));
    }
    drain(&mut stack, 0);
    assert_eq!(stack.event_count(), usize::from(subscriptions));
    let (mut reports, mut took) = (0, Duration::ZERO);
    while reports < 1000 {
        now += Duration::from_millis(101);
        let start = Instant::now();
        stack.handle_timeout(now);
        let fired = drain(&mut stack, Event::CODE);
        took += start.elapsed();
        assert_eq!(fired, usize::from(subscriptions));
        reports += fired;
        // A silent client would be asked whether it still exists.
        for number in 0..subscriptions.min(CLIENTS) {
            let alive = ReportHeartbeatPulse.encode().unwrap();
            stack.handle_message(now, &from(client(number), alive));
        }
    }
    took.as_nanos() as f64 / reports as f64
}
