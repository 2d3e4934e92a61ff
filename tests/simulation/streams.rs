//! Subscriptions over a bad wire with restarts: a stream runs at its rate, or its client knows that
//! it is down; at the end there are no more events than subscriptions.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::endpoint::{Config, Endpoint};
use jaus::service::{
    Discovery, Event, Kind, Patience, Profile, Scope, Stack, SubscriptionId, SubscriptionNews,
    Timing, Topic, When,
};

use crate::producer::{Habits, Producer};
use crate::sim::{Conditions, Event as EndpointEvent, Host, Network, OwnedEndpoint, Owner, Random};
use crate::totals::Counts;
use crate::vehicle::Vehicle;

const PRODUCER: JausId = JausId::new(101, 1, 1);
const CLIENTS: [JausId; 2] = [JausId::new(42, 1, 1), JausId::new(43, 1, 1)];
/// The counted events.
const NAMES: [&str; 4] = ["times up", "times down", "reports", "ended"];
/// Duration of the faults.
const TROUBLE: Duration = Duration::from_secs(120);
/// The time limit for recovery: the longest pause of a client, and the time after which a producer
/// drops an event that is not renewed.
const REST: Duration = Duration::from_secs(70);
/// How long the rate of streams is measured afterwards.
const MEASURED: Duration = Duration::from_secs(20);
const ACTIONS: usize = 40;
/// A pause may follow the first report of a stream.
const BEGINNING: Duration = Duration::from_millis(2500);

/// Runs the scenario of a seed; an error names the broken promise.
pub(crate) fn run(seed: u64) -> Result<Counts, String> {
    let mut world = World::new(seed);
    let start = world.network.now();
    let mut times: Vec<_> = (0..ACTIONS)
        .map(|_| world.random.up_to_millis(TROUBLE.as_millis() as u64))
        .collect();
    times.sort_unstable();
    for time in times {
        let now = world.network.now();
        world.run_for((start + time).saturating_duration_since(now))?;
        world.act();
    }
    world.come_to_rest()?;
    Ok(world.counts())
}

/// A client with its records of its subscriptions.
struct Client {
    stack: Stack,
    streams: BTreeMap<SubscriptionId, Stream>,
    counts: Counts,
    /// Whether it has subscribed to anything; before that it ignores events.
    has_subscribed: bool,
}

/// A client's record of a subscription.
struct Stream {
    topic: Topic,
    up: bool,
    /// When it last came up; before that, when it was subscribed to.
    since: Instant,
    sign: Instant,
    reports: u32,
    broken: Option<String>,
}

enum Party {
    Client(Box<Client>),
    Producer(Producer),
    Vehicle(Box<Vehicle>),
}

struct World {
    random: Random,
    network: Network<Party>,
    /// `None` if the producer is a component of this library.
    habits: Option<Habits>,
    conditions: Conditions,
    producer: Host,
    clients: [Host; 2],
}

impl Client {
    fn party(now: Instant, id: JausId) -> Party {
        let profile = Profile::new(Kind::OperatorControlUnit, "Operator");
        let discovery = Discovery::new(id, profile, Scope::Nobody, Timing::default(), 1);
        let mut stack = Stack::new(discovery, Vec::new());
        stack.start(now);
        Party::Client(Box::new(Self {
            stack,
            streams: BTreeMap::new(),
            counts: NAMES.map(|name| (name, 0)).into(),
            has_subscribed: false,
        }))
    }

    fn settle(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        while let Some(message) = self.stack.poll_transmit() {
            // There may be no route to the producer yet.
            let _ = endpoint.send(now, message);
        }
        while let Some(event) = self.stack.poll_event() {
            if let Event::Subscription(id, news) = event {
                self.note(now, id, &news);
            }
        }
    }

    fn note(&mut self, now: Instant, id: SubscriptionId, news: &SubscriptionNews) {
        let Some(stream) = self.streams.get_mut(&id) else {
            return;
        };
        let name = match news {
            SubscriptionNews::Up { .. } => "times up",
            SubscriptionNews::Report { .. } => "reports",
            SubscriptionNews::Down { .. } => "times down",
            SubscriptionNews::Ended(_) => "ended",
        };
        *self.counts.entry(name).or_default() += 1;
        match news {
            SubscriptionNews::Up { .. } => {
                stream.up = true;
                (stream.since, stream.sign) = (now, now);
            }
            SubscriptionNews::Report { .. } => {
                if !stream.up {
                    stream.broken = Some(format!("{id:?} is down, and yet a report comes"));
                }
                stream.reports += 1;
                stream.sign = now;
            }
            SubscriptionNews::Down { .. } => stream.up = false,
            SubscriptionNews::Ended(_) => {
                self.streams.remove(&id);
            }
        }
    }
}

impl Stream {
    /// Checks that a running stream is never silent for longer than eight periods or one second,
    /// whichever is longer, except at its start.
    fn check(&self, now: Instant) -> Result<(), String> {
        if let Some(broken) = &self.broken {
            return Err(broken.clone());
        }
        let When::Periodic { hz, .. } = self.topic.when else {
            return Ok(());
        };
        let limit = Duration::from_secs_f64(4.0 / hz).max(Duration::from_millis(500));
        let silent = now.saturating_duration_since(self.sign);
        // Twice the timeout, because a renewal is a sign of life too, and is not reported.
        let has_begun = now.saturating_duration_since(self.since) > BEGINNING;
        if self.up && has_begun && silent > 2 * limit {
            return Err(format!(
                "{:?} is silent for {silent:?} and not down",
                self.topic
            ));
        }
        Ok(())
    }
}

impl Owner for Party {
    fn handle_event(&mut self, now: Instant, endpoint: &mut OwnedEndpoint, event: EndpointEvent) {
        match self {
            Self::Producer(producer) => producer.handle_event(now, endpoint, event),
            Self::Vehicle(vehicle) => vehicle.handle_event(now, endpoint, event),
            Self::Client(client) => {
                if let EndpointEvent::Received(message) = event {
                    client.stack.handle_message(now, &message);
                    client.settle(now, endpoint);
                }
            }
        }
    }

    fn handle_timeout(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        match self {
            Self::Producer(producer) => producer.handle_timeout(now, endpoint),
            Self::Vehicle(vehicle) => vehicle.handle_timeout(now, endpoint),
            Self::Client(client) => {
                client.stack.handle_timeout(now);
                client.settle(now, endpoint);
            }
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        match self {
            Self::Producer(producer) => producer.poll_timeout(),
            Self::Vehicle(vehicle) => vehicle.poll_timeout(),
            Self::Client(client) => client.stack.poll_timeout(),
        }
    }
}

fn producer(now: Instant, habits: Option<Habits>) -> Party {
    match habits {
        Some(habits) => Party::Producer(Producer::new(PRODUCER, habits)),
        None => Party::Vehicle(Box::new(Vehicle::new(now, PRODUCER))),
    }
}

fn endpoint(id: JausId) -> Endpoint {
    let mut endpoint = Endpoint::new(Config::default());
    endpoint.attach(id).expect("a component");
    endpoint
}

fn conditions(random: &mut Random) -> Conditions {
    Conditions {
        lost: random.choose(&[0, 50, 200]),
        repeated: random.choose(&[0, 50]),
        detoured: random.choose(&[0, 50]),
        detour: Duration::from_millis(60),
        ..Conditions::poor()
    }
}

impl World {
    fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let habits = random.happens(600).then(|| Habits::choose(&mut random));
        let conditions = conditions(&mut random);
        let mut network = Network::new(random.number(), conditions.clone());
        if crate::sim::seeds::is_traced() {
            network.trace().print();
        }
        let now = network.now();
        let producer = network.join(endpoint(PRODUCER), producer(now, habits));
        let clients = CLIENTS.map(|id| network.join(endpoint(id), Client::party(now, id)));
        Self {
            random,
            network,
            habits,
            conditions,
            producer,
            clients,
        }
    }

    fn client(&mut self, host: Host) -> &mut Client {
        match self.network.owner(host) {
            Party::Client(client) => client,
            Party::Producer(_) | Party::Vehicle(_) => panic!("a client is meant"),
        }
    }

    fn act(&mut self) {
        let client = self.random.below(2);
        let host = self.clients[client];
        match self.random.below(20) {
            0..10 => self.subscribe(host),
            10..14 => self.unsubscribe(host),
            14 | 15 => {
                let producer = producer(self.network.now(), self.habits);
                self.network
                    .restart(self.producer, endpoint(PRODUCER), producer);
            }
            16 => {
                let (now, id) = (self.network.now(), CLIENTS[client]);
                self.network
                    .restart(host, endpoint(id), Client::party(now, id));
            }
            cut => self.network.set_cut(self.producer, host, cut < 19),
        }
    }

    fn subscribe(&mut self, host: Host) {
        let random = &mut self.random;
        let query = random.choose(&[[0x02, 0x22], [0x02, 0x20], [0x0D, 0x20], [0x01, 0x20]]);
        let whens = [
            When::hz(1.0),
            When::hz(10.0),
            When::hz(25.0),
            When::OnChange,
        ];
        // A heartbeat never changes.
        let choices = if query == [0x02, 0x22] { 3 } else { 4 };
        let when = random.choose(&whens[..choices]);
        let topic = Topic {
            peer: PRODUCER,
            query: query.to_vec().into(),
            report: u16::from_le_bytes(query) + 0x2000,
            when,
        };
        self.network.act(host, |now, party, endpoint| {
            let Party::Client(client) = party else { return };
            // A second subscription is refused.
            if let Ok(id) = client.stack.subscribe(now, &topic, Patience::default()) {
                let stream = Stream {
                    topic,
                    up: false,
                    since: now,
                    sign: now,
                    reports: 0,
                    broken: None,
                };
                client.streams.insert(id, stream);
                client.has_subscribed = true;
            }
            client.settle(now, endpoint);
        });
    }

    fn unsubscribe(&mut self, host: Host) {
        let place = self.random.below(8);
        self.network.act(host, |now, party, endpoint| {
            let Party::Client(client) = party else { return };
            if let Some(&id) = client.streams.keys().nth(place) {
                client.streams.remove(&id);
                client.stack.unsubscribe(now, id);
                client.settle(now, endpoint);
            }
        });
    }

    fn run_for(&mut self, time: Duration) -> Result<(), String> {
        let step = Duration::from_millis(250);
        let end = self.network.now() + time;
        while self.network.now() < end {
            let left = end.saturating_duration_since(self.network.now());
            self.network.run_for(left.min(step));
            let now = self.network.now();
            for host in self.clients {
                let client = self.client(host);
                client.streams.values().try_for_each(|it| it.check(now))?;
            }
        }
        Ok(())
    }

    /// The clients' counts since their last restart, and their number of streams.
    fn counts(&mut self) -> Counts {
        let mut counts = Counts::new();
        for host in self.clients {
            let client = self.client(host);
            for (&name, &count) in &client.counts {
                *counts.entry(name).or_default() += count;
            }
            *counts.entry("streams after healing").or_default() += client.streams.len() as u64;
        }
        counts
    }

    /// Checks on a good wire that every stream runs at its rate, without surplus events.
    fn come_to_rest(&mut self) -> Result<(), String> {
        self.conditions = Conditions::good();
        self.network.set_conditions(self.conditions.clone());
        for host in self.clients {
            self.network.set_cut(self.producer, host, false);
        }
        self.run_for(REST)?;
        for host in self.clients {
            let client = self.client(host);
            client.streams.values_mut().for_each(|it| it.reports = 0);
        }
        self.run_for(MEASURED)?;
        for (place, host) in self.clients.into_iter().enumerate() {
            let client = self.client(host);
            for stream in client.streams.values() {
                stream.check_rate()?;
            }
            let (wanted, minds) = (client.streams.len(), client.has_subscribed);
            let Party::Producer(producer) = self.network.owner(self.producer) else {
                continue;
            };
            let running = producer.events_of(CLIENTS[place]);
            // A duplicate event from a renewal is only noticed when it fires.
            let multiplies = self.habits.is_some_and(|habits| habits.multiplies);
            let most = if multiplies { 2 * wanted } else { wanted };
            if minds && !(wanted..=most).contains(&running) {
                return Err(format!(
                    "{} has {running} events for {wanted} subscriptions ({:?})",
                    CLIENTS[place], self.habits
                ));
            }
        }
        Ok(())
    }
}

impl Stream {
    fn check_rate(&self) -> Result<(), String> {
        let seconds = MEASURED.as_secs_f64();
        let wanted = match self.topic.when {
            When::Periodic { hz, .. } => hz * seconds,
            When::OnChange => seconds / 3.0,
        };
        // An event on change is repeated with each of up to two renewals.
        let (got, room) = (f64::from(self.reports), (wanted * 0.05).max(2.1));
        if self.up && (got - wanted).abs() <= room {
            return Ok(());
        }
        let up = if self.up { "up" } else { "down" };
        Err(format!(
            "{:?} is {up} and brought {got} reports, not {wanted}",
            self.topic
        ))
    }
}
