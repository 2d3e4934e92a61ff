//! A scenario from a seed: who is there, what they send, and what goes wrong meanwhile.

use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::endpoint::{Config, Counter, Endpoint, Event, LinkProfile, Outgoing, Pacing, Packing};
use jaus::wire::Priority;

use crate::ledger::{Ledger, Life};
use crate::sim::seeds::is_traced;
use crate::sim::{Conditions, Host, Mailbox, Network, Random, Socket, WIRE};

/// The longest message.
const LONGEST: usize = 100 << 10;
/// When the traffic ends.
const TRAFFIC: u64 = 3000;
/// What happens until then, at the most.
const MOST_ACTIONS: usize = 40;
/// After the last action the network rests by then: a packet is tried for some time, 20 times, with
/// up to 2 seconds between.
const REST: Duration = Duration::from_secs(60);
/// So many packets may be on their way above the window when they are urgent.
const URGENT: usize = 32;

/// What was done in a run, to tell runs from each other.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Summary {
    digest: u64,
    delivered: u64,
    acknowledged: u64,
    given_up: u64,
}

/// Runs the scenario of a seed; tells which promise was broken.
pub(crate) fn run(seed: u64) -> Result<Summary, String> {
    let mut world = World::new(seed);
    let mut times: Vec<Duration> = (0..5 + world.random.below(MOST_ACTIONS - 5))
        .map(|_| world.random.up_to_millis(TRAFFIC))
        .collect();
    times.sort_unstable();
    let start = world.network.now();
    for time in times {
        world.run_until(start + time)?;
        world.act()?;
    }
    world.come_to_rest()
}

struct World {
    random: Random,
    network: Network,
    hosts: Vec<Host>,
    config: Config,
    /// How often each node was restarted.
    lives: Vec<u32>,
    ledger: Ledger,
    cuts: Vec<(Instant, Host, Host)>,
    /// Whether little memory makes receivers forget what they have acknowledged.
    forgetful: bool,
    /// Packets that were sent for the first time.
    packets: u64,
    segments: usize,
}

/// The components of a node.
fn components(host: usize) -> [JausId; 2] {
    let subsystem = 101 + host as u16;
    [JausId::new(subsystem, 1, 1), JausId::new(subsystem, 1, 2)]
}

fn conditions(random: &mut Random) -> Conditions {
    let fastest = random.choose(&[50, 1000, 20_000]);
    let spread = random.choose(&[1, 1000, 20_000]);
    let micros = Duration::from_micros;
    let socket = |random: &mut Random| Socket {
        speed: random.choose(&[1 << 20, 10 << 20]),
        buffer: random.choose(&[16 << 10, 70_000, 212_992]),
    };
    Conditions {
        latency: micros(fastest)..micros(fastest + spread),
        lost: random.choose(&[0, 0, 10, 50, 150, 300]),
        repeated: random.choose(&[0, 0, 20, 200]),
        detoured: random.choose(&[0, 0, 50, 200]),
        detour: Duration::from_millis(50),
        mtu: random.choose(&[usize::MAX, usize::MAX, usize::MAX, 1472, 200]),
        socket: random.happens(400).then(|| socket(random)),
    }
}

/// Settings that a seed chooses; `true` if there is so little room that messages are forgotten.
fn config(random: &mut Random) -> (Config, bool) {
    let mut config = Config {
        payload_limit: random.choose(&[1425, 1425, 256, 4079]),
        max_window: random.choose(&[512, 512, 4]),
        max_peers: random.choose(&[1024, 1024, 3]),
        pacing: random.choose(&[Some(Pacing::default()), None]),
        packing: random.choose(&[
            Packing::Off,
            Packing::Off,
            Packing::Within(Duration::ZERO),
            Packing::Within(Duration::from_millis(2)),
        ]),
        ..Config::default()
    };
    if random.happens(500) {
        let long = Duration::from_secs(60);
        config.duplicate_window = long;
        config.retransmission_window = long;
        config.first_contact_window = long;
    }
    let forgetful = random.happens(100);
    if forgetful {
        config.max_reassembly_per_sender = 40_000;
        config.max_reassembly = 60_000;
    }
    (config, forgetful)
}

impl World {
    fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let (config, forgetful) = config(&mut random);
        let ledger = Ledger::new(&mut random, 2 * LONGEST);
        let mut network = Network::new(random.number(), conditions(&mut random));
        if is_traced() {
            network.trace().print();
        }
        let count = 2 + random.below(3);
        let mut world = Self {
            segments: random.choose(&[1, 16]),
            random,
            network,
            hosts: Vec::new(),
            config,
            lives: vec![0; count],
            ledger,
            cuts: Vec::new(),
            forgetful,
            packets: 0,
        };
        for host in 0..count {
            let endpoint = world.endpoint(host);
            let joined = world.network.join(endpoint, Mailbox::default());
            world.hosts.push(joined);
            world.set_segments(joined);
        }
        world
    }

    fn endpoint(&mut self, host: usize) -> Endpoint {
        let mut endpoint = Endpoint::new(Config {
            first_sequence: self.random.number() as u16,
            ..self.config.clone()
        });
        for id in components(host) {
            endpoint.attach(id).expect("an id of one component");
        }
        endpoint
    }

    fn set_segments(&mut self, host: Host) {
        let profile = LinkProfile {
            max_segments: self.segments,
            ..LinkProfile::judp([self.network.address(host)])
        };
        self.network.endpoint(host).add_link(WIRE, profile);
    }

    fn note(&mut self, what: &str) {
        let now = self.network.now();
        self.network.trace().note(now, format_args!("{what}"));
    }

    fn life(&self, host: usize) -> Life {
        (host, self.lives[host])
    }

    fn run_until(&mut self, end: Instant) -> Result<(), String> {
        while let Some(&(heal, one, other)) = self.cuts.first()
            && heal <= end
        {
            self.network
                .run_for(heal.saturating_duration_since(self.network.now()));
            self.network.set_cut(one, other, false);
            self.cuts.remove(0);
            self.note(&format!(
                "the wire between {one:?} and {other:?} works again"
            ));
        }
        self.network
            .run_for(end.saturating_duration_since(self.network.now()));
        self.look()
    }

    fn act(&mut self) -> Result<(), String> {
        match self.random.below(100) {
            0..8 => {
                let conditions = conditions(&mut self.random);
                self.note(&format!("{conditions:?}"));
                self.network.set_conditions(conditions);
            }
            8..14 => self.cut(),
            14..17 => self.restart()?,
            _ => self.send(),
        }
        Ok(())
    }

    fn any_host(&mut self) -> usize {
        self.random.below(self.hosts.len())
    }

    fn cut(&mut self) {
        let (one, other) = (self.any_host(), self.any_host());
        let (one, other) = (self.hosts[one], self.hosts[other]);
        if one == other
            || self
                .cuts
                .iter()
                .any(|cut| (cut.1, cut.2) == (one, other) || (cut.1, cut.2) == (other, one))
        {
            return;
        }
        let heal = self.network.now() + self.random.up_to_millis(4000);
        self.network.set_cut(one, other, true);
        self.cuts.push((heal, one, other));
        self.cuts.sort_unstable_by_key(|&(heal, ..)| heal);
        self.note(&format!("the wire between {one:?} and {other:?} is cut"));
    }

    fn restart(&mut self) -> Result<(), String> {
        let host = self.any_host();
        self.look()?;
        self.lives[host] += 1;
        let endpoint = self.endpoint(host);
        self.network
            .restart(self.hosts[host], endpoint, Mailbox::default());
        self.set_segments(self.hosts[host]);
        self.note(&format!("{host} is restarted"));
        Ok(())
    }

    fn send(&mut self) {
        let (host, to) = (self.any_host(), self.any_host());
        let source = self.random.choose(&components(host));
        let random = &mut self.random;
        // As many short ones as long ones.
        let length = (2 << random.below(16)) + random.below(500);
        let payload = self.ledger.payload(random, length.min(LONGEST));
        let broadcast = random.happens(100);
        let destination = match random.choose(&components(to)) {
            _ if broadcast => JausId::EVERYONE,
            id => id,
        };
        let message = Outgoing {
            acknowledge: !broadcast && random.happens(600),
            priority: random.choose(&Priority::ALL),
            ..Outgoing::new(source, destination, payload)
        };
        self.hand_in(host, message);
    }

    fn hand_in(&mut self, host: usize, message: Outgoing) {
        let everyone = (0..self.hosts.len()).flat_map(|host| components(host).map(|id| (id, host)));
        let receivers = everyone
            .filter(|&(id, _)| {
                message.destination.matches(id)
                    && !(message.destination.has_wildcard() && id == message.source)
            })
            .map(|(id, host)| (id, self.life(host)))
            .collect();
        let config = &self.config;
        let window = if message.acknowledge || message.payload.len() > config.payload_limit {
            config.first_contact_window
        } else {
            config.duplicate_window
        };
        let fragments = message.payload.len().div_ceil(config.payload_limit);
        let (now, life) = (self.network.now(), self.life(host));
        let code = &message.payload[..2];
        let what = format!(
            "{host} hands in {code:02x?}, {} octets, {} for {}, acknowledged: {}",
            message.payload.len(),
            message.priority,
            message.destination,
            message.acknowledge
        );
        self.note(&what);
        let handle = self.network.act(self.hosts[host], |now, _, endpoint| {
            endpoint.send(now, message.clone())
        });
        match handle {
            Ok(handle) => {
                self.packets += fragments as u64;
                self.ledger
                    .enter(now, (life, handle), message, receivers, Some(window));
            }
            Err(error) => self.note(&format!("refused: {error}")),
        }
    }

    /// Judges all that has come out, and the memory that is used.
    fn look(&mut self) -> Result<(), String> {
        let forgetful = self.forgetful;
        let mut news = Vec::new();
        for (host, &name) in self.hosts.iter().enumerate() {
            let life = (host, self.lives[host]);
            for (at, event) in std::mem::take(&mut self.network.owner(name).events) {
                match event {
                    Event::Received(received) => self.ledger.receive(at, life, &received)?,
                    event => news.push((life, event)),
                }
            }
        }
        for (life, event) in news {
            self.ledger
                .learn(life, &event, |_| forgetful, &self.lives)?;
        }
        for host in 0..self.hosts.len() {
            self.check_memory(host)?;
        }
        Ok(())
    }

    fn check_memory(&mut self, host: usize) -> Result<(), String> {
        let (config, endpoint) = (&self.config, self.network.endpoint(self.hosts[host]));
        let peers = endpoint.peers().count();
        if peers > config.max_peers {
            return Err(format!("node {host} knows {peers} peers"));
        }
        let unfinished = endpoint.unfinished();
        if unfinished > config.max_reassembly {
            return Err(format!("node {host} keeps {unfinished} octets"));
        }
        for id in (0..self.lives.len()).flat_map(components) {
            let Some(flow) = endpoint.flow(id) else {
                continue;
            };
            if flow.window > config.max_window || flow.in_flight > config.max_window + URGENT {
                return Err(format!("node {host} sends too much at once: {flow:?}"));
            }
        }
        Ok(())
    }

    fn come_to_rest(mut self) -> Result<Summary, String> {
        let limit = self.network.now() + REST;
        while let Some(&(heal, ..)) = self.cuts.first() {
            self.run_until(heal)?;
        }
        // Each look costs time; nothing that it would see in between goes away.
        while self.network.step() {
            if self.network.now() > limit {
                return Err("the network does not come to rest".to_owned());
            }
        }
        self.look()?;
        self.ledger.close(&self.lives)?;
        // Each packet of a message and each answer may be tried that often, and to many.
        let (carried, most) = (self.network.carried(), 100 + self.packets * 80);
        if carried > most {
            return Err(format!("{carried} datagrams for {} packets", self.packets));
        }
        for host in self.hosts.clone() {
            let endpoint = self.network.endpoint(host);
            if endpoint.unfinished() > 0 {
                return Err(format!(
                    "{host:?} keeps {} octets for ever",
                    endpoint.unfinished()
                ));
            }
            if endpoint.counters().get(Counter::Malformed) > 0 {
                return Err(format!("{host:?} got what it cannot read"));
            }
        }
        Ok(Summary {
            digest: self.network.trace().digest(),
            delivered: self.ledger.delivered,
            acknowledged: self.ledger.acknowledged,
            given_up: self.ledger.given_up,
        })
    }
}
