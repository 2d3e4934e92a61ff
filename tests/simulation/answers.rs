//! A large answer over a slow wire: the query is sent once, and the answer arrives.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::{Config, Endpoint};
use jaus::service::{
    Discovery, Event, Handlers, Kind, NoAnswer, Profile, QueryOptions, Question, Scope, Stack,
    Timing,
};
use jaus_vehicle::messages::ground::{QueryRasterCells, ReportRasterCells, raster_maps};

use crate::sim::{Conditions, Event as EndpointEvent, Host, Network, OwnedEndpoint, Owner, Socket};

const CLIENT: JausId = JausId::new(42, 1, 1);
const SERVER: JausId = JausId::new(101, 1, 1);
const LENGTH: usize = 4 << 20;
/// 10 Mbit/s, with the buffer of a router.
const SLOW: Socket = Socket {
    speed: 1_250_000,
    buffer: 64 << 10,
};

/// A component on a node of its own.
struct Component {
    stack: Stack,
    /// Whether its node tells it of the parts of large messages.
    knows_progress: bool,
    answer: Option<Result<Bytes, NoAnswer>>,
}

impl Component {
    fn settle(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        while let Some(message) = self.stack.poll_transmit() {
            // There may be no route yet.
            let _ = endpoint.send(now, message);
        }
        while let Some(event) = self.stack.poll_event() {
            if let Event::Answer(_, answer) = event {
                self.answer = Some(answer);
            }
        }
    }
}

impl Owner for Component {
    fn handle_event(&mut self, now: Instant, endpoint: &mut OwnedEndpoint, event: EndpointEvent) {
        if let EndpointEvent::Received(message) = event {
            self.stack.handle_message(now, &message);
            self.settle(now, endpoint);
        }
    }

    fn handle_timeout(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        let overdue: Vec<_> = self.stack.overdue(now).collect();
        for peer in overdue.into_iter().filter(|_| self.knows_progress) {
            if let Some(latest) = endpoint.last_fragment(peer, self.stack.id()) {
                self.stack.handle_progress(now, peer, latest);
            }
        }
        self.stack.handle_timeout(now);
        self.settle(now, endpoint);
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.stack.poll_timeout()
    }
}

fn join(network: &mut Network<Component>, id: JausId, services: Vec<Handlers>) -> Host {
    let profile = Profile::new(Kind::Vehicle, "Rover");
    let discovery = Discovery::new(id, profile, Scope::System, Timing::default(), 1);
    let mut stack = Stack::new(discovery, Vec::new());
    for handlers in services {
        let offered = stack.offer(network.now(), Box::new(handlers));
        offered.expect("a service that moves nothing");
    }
    stack.start(network.now());
    let mut endpoint = Endpoint::new(Config::default());
    endpoint.attach(id).expect("an id of one component");
    let component = Component {
        stack,
        knows_progress: true,
        answer: None,
    };
    network.join(endpoint, component)
}

/// Queries the server once for a map; returns the answer and how often the server was asked.
fn ask(knows_progress: bool) -> (Option<Result<Bytes, NoAnswer>>, u32) {
    let conditions = Conditions {
        latency: Duration::from_millis(1)..Duration::from_millis(2),
        socket: Some(SLOW),
        ..Conditions::good()
    };
    let mut network = Network::new(1, conditions);
    let asked = Arc::new(AtomicU32::new(0));
    let count = asked.clone();
    let map =
        Handlers::new(raster_maps::LATEST).receive(move |_: QueryRasterCells, query, context| {
            count.fetch_add(1, Ordering::Relaxed);
            let report = ReportRasterCells {
                cells: vec![7; LENGTH].into(),
                ..ReportRasterCells::default()
            };
            context.reply_until_acknowledged(query, &report);
        });
    join(&mut network, SERVER, vec![map]);
    let client = join(&mut network, CLIENT, Vec::new());
    // They find each other.
    network.run_for(Duration::from_secs(10));
    network.owner(client).knows_progress = knows_progress;
    network.act(client, |now, component, endpoint| {
        let query = QueryRasterCells::default().encode().expect("a query");
        let (report, options) = (ReportRasterCells::CODE, QueryOptions::default());
        component
            .stack
            .ask(now, SERVER, Question::new(query, report), options);
        component.settle(now, endpoint);
    });
    network.run_for(Duration::from_secs(10));
    let answer = network.owner(client).answer.take();
    (answer, asked.load(Ordering::Relaxed))
}

#[test]
fn four_mib_over_ten_mbit_per_second_arrive_at_the_first_request() {
    let (answer, asked) = ask(true);
    let report = answer.expect("an end").expect("a report");
    assert_eq!((report.len() > LENGTH, asked), (true, 1));
}

/// Without the knowledge of progress the query is repeated and given up, so the wire is as slow as
/// the other test says.
#[test]
fn without_progress_the_same_query_is_repeated_and_given_up() {
    let (answer, asked) = ask(false);
    assert!(
        matches!(answer, Some(Err(NoAnswer { tries: 3, .. }))),
        "{answer:?}"
    );
    assert!(asked > 1);
}
