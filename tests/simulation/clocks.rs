//! Clocks of two hosts: the offset measured over JAUS Time holds under loss, delays that differ by
//! direction, and steps of a clock.

use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::{Config, Endpoint, Outgoing};
use jaus::messages::core::report_time::TimeStamp;
use jaus::messages::core::{QueryTime, ReportTime};
use jaus::service::{ClockEstimator, Exchange};

use crate::sim::{Conditions, Event, Host, Network, OwnedEndpoint, Owner, WallClock};

const CLIENT: JausId = JausId::new(42, 1, 1);
const SERVER: JausId = JausId::new(101, 1, 1);

/// A component that answers queries for its time, and measures that of the other.
struct Station {
    id: JausId,
    clock: WallClock,
    /// When the outstanding query was sent.
    asked_at: Option<Instant>,
    estimator: ClockEstimator,
    stepped: u32,
}

impl Station {
    fn ask(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        self.asked_at = Some(now);
        let query = QueryTime::all().encode().expect("a query");
        // There may be no route yet.
        let _ = endpoint.send(now, Outgoing::new(self.id, SERVER, query));
    }

    fn report(&self) -> ReportTime {
        ReportTime {
            time_stamp: Some(TimeStamp::at(self.clock.since_1970())),
            date_stamp: None,
        }
    }
}

impl Owner for Station {
    fn handle_event(&mut self, now: Instant, endpoint: &mut OwnedEndpoint, event: Event) {
        let Event::Received(message) = event else {
            return;
        };
        if QueryTime::decode(&message.payload).is_ok() {
            let report = self.report().encode().expect("a report");
            let _ = endpoint.send(now, Outgoing::new(self.id, message.source, report));
        } else if let (Ok(report), Some(asked_at)) =
            (ReportTime::decode(&message.payload), self.asked_at.take())
        {
            let own = self.clock.since_1970();
            let exchange = self.estimator.handle_report(asked_at, now, own, &report);
            self.stepped += u32::from(exchange == Exchange::Stepped);
        }
    }
}

/// A client and a server that know each other's addresses.
fn world(seed: u64, conditions: Conditions) -> (Network<Station>, Host, Host) {
    let mut network = Network::new(seed, Conditions::good());
    let mut join = |id: JausId| {
        let mut endpoint = Endpoint::new(Config::default());
        endpoint.attach(id).expect("a free id");
        network.join_with(endpoint, |clock| Station {
            id,
            clock,
            asked_at: None,
            estimator: ClockEstimator::default(),
            stepped: 0,
        })
    };
    let (client, server) = (join(CLIENT), join(SERVER));
    let hello = QueryTime::all().encode().expect("a query");
    let everyone = JausId::new(u16::MAX, u8::MAX, u8::MAX);
    for (host, id) in [(client, CLIENT), (server, SERVER)] {
        let sent = network.send(host, Outgoing::new(id, everyone, hello.clone()));
        sent.expect("a multicast");
    }
    network.run_for(Duration::from_secs(2));
    network.set_conditions(conditions);
    (network, client, server)
}

/// Seconds that the server's clock is ahead.
fn true_offset(network: &Network<Station>, client: Host, server: Host) -> f64 {
    let [own, peer] = [client, server].map(|host| network.clock(host).since_1970().as_secs_f64());
    peer - own
}

/// Sends a query every two seconds, and checks each estimate.
fn measure(network: &mut Network<Station>, client: Host, server: Host, queries: u32) {
    for _ in 0..queries {
        network.act(client, |now, station, endpoint| station.ask(now, endpoint));
        network.run_for(Duration::from_secs(2));
        let truth = true_offset(network, client, server);
        if let Some(offset) = network.owner(client).estimator.offset() {
            let error = (offset.seconds - truth).abs();
            assert!(error <= offset.uncertainty + 1e-6, "{error} s: {offset:?}");
        }
    }
}

#[test]
fn the_offset_of_clocks_holds_under_loss_and_uneven_delays() {
    let conditions = Conditions {
        latency: Duration::from_millis(1)..Duration::from_millis(400),
        lost: 300,
        ..Conditions::good()
    };
    for seed in 0..20 {
        let (mut network, client, server) = world(seed, conditions.clone());
        network.step_clock(server, 1_234_567_000);
        measure(&mut network, client, server, 60);
        let station = network.owner(client);
        assert_eq!(station.stepped, 0);
        let offset = station.estimator.offset().expect("some answers");
        assert!(offset.uncertainty < 0.2, "seed {seed}: {offset:?}");
    }
}

#[test]
fn a_step_of_the_servers_or_the_clients_clock_is_noticed() {
    for (seed, who) in [(1, 0), (2, 1)] {
        let (mut network, client, server) = world(seed, Conditions::good());
        measure(&mut network, client, server, 10);
        assert_eq!(network.owner(client).stepped, 0);
        network.step_clock([client, server][who], -7_500_000_000);
        measure(&mut network, client, server, 10);
        assert_eq!(network.owner(client).stepped, 1);
        let offset = network.owner(client).estimator.offset();
        assert_eq!(offset.map(|it| it.steps), Some(1));
    }
}
