//! How closely periodic events keep their rate, between two nodes on loopback.

use std::time::{Duration, Instant};

use jaus::codec::Message;
use jaus::component::{Component, Handlers, Kind};
use jaus::endpoint::Outgoing;
use jaus::messages::core::{ConfirmEventRequest, CreateEvent, Event};
use jaus::messages::mobility::{
    QueryVelocityState, QueryVelocityStateExt, ReportVelocityState, velocity_state_sensor,
};
use jaus::node::{Config, Node, Port};
use jaus_test_kit::figures::Figures;

use crate::quantile;

const RATES: [f64; 4] = [1.0, 10.0, 50.0, 100.0];

/// A client's observations of one subscription.
#[derive(Default)]
struct Seen {
    confirmed: f64,
    arrivals: Vec<Instant>,
    lost: u32,
}

pub(crate) fn measure(time: Duration, figures: &mut Figures) {
    figures.table(
        &format!("Rates over {} s, all four at once", time.as_secs()),
        [
            "requested (Hz)",
            "confirmed",
            "kept",
            "error",
            "median jitter (ms)",
            "p99 (ms)",
            "most (ms)",
            "lost",
        ],
    );
    let (started, ready) = std::sync::mpsc::channel();
    std::thread::spawn(move || runtime().block_on(sensor(&started)));
    ready.recv().expect("a sensor");
    let seen = runtime().block_on(listen(time));
    for (rate, seen) in RATES.iter().zip(&seen) {
        row(*rate, seen, figures);
    }
}

fn row(rate: f64, seen: &Seen, figures: &mut Figures) {
    let period = 1.0 / seen.confirmed;
    let intervals = seen.arrivals.windows(2).map(|pair| pair[1] - pair[0]);
    let mut jitter: Vec<f64> = intervals
        .map(|interval| (interval.as_secs_f64() - period).abs() * 1e3)
        .collect();
    jitter.sort_by(f64::total_cmp);
    let (first, last) = (seen.arrivals[0], seen.arrivals[seen.arrivals.len() - 1]);
    let kept = (seen.arrivals.len() - 1) as f64 / (last - first).as_secs_f64();
    let jitter = |share| format!("{:.2}", quantile(&jitter, share));
    figures.row([
        &rate.to_string(),
        &format!("{:.3}", seen.confirmed),
        &format!("{kept:.3}"),
        &format!("{:.3} %", (kept / seen.confirmed - 1.0) * 100.0),
        &jitter(0.5),
        &jitter(0.99),
        &jitter(1.0),
        &seen.lost.to_string(),
    ]);
}

fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .expect("a runtime")
}

async fn sensor(started: &std::sync::mpsc::Sender<()>) {
    let node = Node::start(Config::loopback(101, 1)).expect("a node");
    let mut report = ReportVelocityState::default();
    report.set_velocity_x_m_per_s(1.5).unwrap();
    let sensor = Handlers::new(velocity_state_sensor::LATEST)
        .answer(move |_: QueryVelocityState| report.clone())
        .declines::<QueryVelocityStateExt>();
    let component = Component::builder(Kind::Vehicle, "Bench")
        .offer(sensor)
        .attach(&node, 1)
        .expect("a sensor");
    started.send(()).expect("somebody waits");
    std::future::pending::<()>().await;
    drop(component);
}

async fn listen(time: Duration) -> Vec<Seen> {
    let node = Node::start(Config::loopback(42, 1)).expect("a node");
    let mut port = node.attach(1).expect("a client");
    let mut seen: Vec<Seen> = RATES.iter().map(|_| Seen::default()).collect();
    for (request, &rate) in RATES.iter().enumerate() {
        subscribe(&port, request, rate);
    }
    let mut numbers = [None; RATES.len()];
    let mut sequences = [None; RATES.len()];
    let end = Instant::now() + time + Duration::from_millis(500);
    while let Ok(Some(message)) = tokio::time::timeout_at(end.into(), port.recv()).await {
        let now = Instant::now();
        if let Ok(confirm) = ConfirmEventRequest::decode(&message.payload) {
            let request = usize::from(confirm.request_id);
            numbers[request] = Some(confirm.event_id);
            seen[request].confirmed = confirm.confirmed_periodic_rate_hz();
        } else if let Ok(event) = Event::decode(&message.payload)
            && let Some(which) = numbers.iter().position(|id| *id == Some(event.event_id))
        {
            let expected = sequences[which].map(|before: u8| before.wrapping_add(1));
            let due = expected.unwrap_or(event.sequence_number);
            seen[which].lost += u32::from(event.sequence_number.wrapping_sub(due));
            sequences[which] = Some(event.sequence_number);
            // The first event follows the confirmation at once, independently of the period.
            seen[which].arrivals.push(now);
        }
    }
    seen
}

fn subscribe(port: &Port, request: usize, rate: f64) {
    // Each subscription requests different fields; otherwise the last would replace the others.
    let presence_vector = 1 << request;
    let mut create = CreateEvent {
        request_id: request as u8,
        query_message: QueryVelocityState { presence_vector }.encode().unwrap(),
        ..CreateEvent::default()
    };
    create.set_requested_periodic_rate_hz(rate).unwrap();
    let payload = create.encode().unwrap();
    let sensor = jaus::address::JausId::new(101, 1, 1);
    port.send(Outgoing::new(port.id(), sensor, payload))
        .expect("sent");
}
