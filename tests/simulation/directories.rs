//! Discovery over a bad wire, with nodes that restart and die: once the wire is good, all
//! directories are equal and correct.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::endpoint::{Config, Endpoint, Routing};
use jaus::service::{
    Change, Directory, Discovery, Event, Kind, Liveness, Profile, Scope, Service, Stack, Timing,
};

use crate::sim::{Conditions, Event as EndpointEvent, Host, Network, OwnedEndpoint, Owner, Random};
use crate::totals::Counts;

/// Duration of the faults.
const TROUBLE: Duration = Duration::from_secs(60);
const ACTIONS: usize = 15;
/// On a good wire, all directories are correct within this time.
const AGREED: Duration = Duration::from_secs(240);
/// Interval of the checks.
const LOOK: Duration = Duration::from_secs(1);
/// The counted events.
const NAMES: [&str; 8] = [
    "cuts",
    "restarts",
    "deaths",
    "routed runs",
    "components found",
    "components lost",
    "directories that agree",
    "seconds until they did",
];

/// Runs the scenario of a seed; an error names the incorrect directory.
pub(crate) fn run(seed: u64) -> Result<Counts, String> {
    let mut world = World::new(seed);
    let start = world.network.now();
    let mut times: Vec<_> = (0..ACTIONS)
        .map(|_| world.random.up_to_millis(TROUBLE.as_millis() as u64))
        .collect();
    times.sort_unstable();
    for time in times {
        let now = world.network.now();
        world
            .network
            .run_for((start + time).saturating_duration_since(now));
        world.act();
    }
    world.heal();
    world.run_until_agreed()?;
    Ok(world.counts())
}

/// Components and their services in a directory.
type Listing = BTreeMap<JausId, Vec<String>>;

/// The two components of a node.
struct Components {
    stacks: Vec<Stack>,
    counts: Counts,
}

struct World {
    random: Random,
    network: Network<Components>,
    is_routed: bool,
    /// One entry per node: whether it is dead.
    is_dead: Vec<bool>,
    counts: Counts,
}

fn ids(node: usize) -> [JausId; 2] {
    let subsystem = 101 + node as u16 / 2;
    let node = 1 + (node % 2) as u8;
    [1, 7].map(|component| JausId::new(subsystem, node, component))
}

impl Components {
    fn new(now: Instant, node: usize, seed: u64) -> Self {
        let stack = |id: JausId| {
            let mut profile = Profile::new(Kind::Vehicle, format!("Rover {}", id.subsystem()));
            profile.component = format!("Component {id}");
            let discovery = Discovery::new(id, profile, Scope::System, Timing::default(), seed);
            let services: Vec<Box<dyn Service>> = match id.component() {
                1 => vec![Box::new(Liveness::new())],
                _ => Vec::new(),
            };
            let mut stack = Stack::new(discovery, services);
            stack.start(now);
            stack
        };
        Self {
            stacks: ids(node).map(stack).into(),
            counts: Counts::new(),
        }
    }

    fn settle(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        for stack in &mut self.stacks {
            while let Some(message) = stack.poll_transmit() {
                // The other component may be gone.
                let _ = endpoint.send(now, message);
            }
            while let Some(event) = stack.poll_event() {
                let name = match event {
                    Event::Change(Change::Found(_)) => "components found",
                    Event::Change(Change::Lost(..)) => "components lost",
                    _ => continue,
                };
                *self.counts.entry(name).or_default() += 1;
            }
        }
    }
}

impl Owner for Components {
    fn handle_event(&mut self, now: Instant, endpoint: &mut OwnedEndpoint, event: EndpointEvent) {
        if let EndpointEvent::Received(message) = event {
            let mut stacks = self.stacks.iter_mut();
            if let Some(stack) = stacks.find(|stack| stack.id() == message.to) {
                stack.handle_message(now, &message);
            }
            self.settle(now, endpoint);
        }
    }

    fn handle_timeout(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        let is_due = |stack: &&mut Stack| stack.poll_timeout().is_some_and(|due| due <= now);
        for stack in self.stacks.iter_mut().filter(is_due) {
            stack.handle_timeout(now);
        }
        self.settle(now, endpoint);
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.stacks.iter().filter_map(Stack::poll_timeout).min()
    }
}

fn told(directory: &Directory) -> Listing {
    let components = directory.components().map(|component| {
        let mut services: Vec<_> = component.offered().map(|it| it.urn.clone()).collect();
        services.sort_unstable();
        (component.id, services)
    });
    components.collect()
}

impl World {
    fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let conditions = Conditions {
            lost: random.choose(&[0, 50, 200]),
            repeated: random.choose(&[0, 100]),
            ..Conditions::poor()
        };
        let mut network = Network::new(random.number(), conditions);
        if crate::sim::seeds::is_traced() {
            network.trace().print();
        }
        let is_routed = random.happens(400);
        let count = 3 + random.below(3);
        for node in 0..count {
            let networks: &[u8] = match (is_routed, node) {
                (false, _) => &[0],
                (true, 0) => &[0, 1],
                (true, _) => &[(node % 2) as u8],
            };
            let components = Components::new(network.now(), node, random.number());
            network.join_networks(networks, endpoint(node, networks.len() > 1), components);
        }
        let mut counts: Counts = NAMES.map(|name| (name, 0)).into();
        counts.insert("routed runs", is_routed.into());
        Self {
            random,
            network,
            is_routed,
            is_dead: vec![false; count],
            counts,
        }
    }

    fn any(&mut self) -> usize {
        self.random.below(self.is_dead.len())
    }

    fn count(&mut self, name: &'static str) {
        *self.counts.entry(name).or_default() += 1;
    }

    fn act(&mut self) {
        let (node, other) = (self.any(), self.any());
        match self.random.below(8) {
            0..4 if node != other => {
                self.count("cuts");
                let is_cut = self.random.happens(700);
                self.network.set_cut(Host(node), Host(other), is_cut);
            }
            4..6 => {
                self.count("restarts");
                self.restart(node);
            }
            // A dead router would leave two separate networks.
            6 if node > 0 => {
                self.count("deaths");
                self.is_dead[node] = true;
                self.network.kill(Host(node));
            }
            _ => {}
        }
    }

    fn restart(&mut self, node: usize) {
        self.keep_counts(node);
        let components = Components::new(self.network.now(), node, self.random.number());
        let forward = self.is_routed && node == 0;
        self.network
            .restart(Host(node), endpoint(node, forward), components);
        self.is_dead[node] = false;
    }

    /// Ends all faults; dead nodes stay dead.
    fn heal(&mut self) {
        self.network.set_conditions(Conditions::good());
        let count = self.is_dead.len();
        for (one, other) in (0..count).flat_map(|one| (0..one).map(move |other| (one, other))) {
            self.network.set_cut(Host(one), Host(other), false);
        }
    }

    fn run_until_agreed(&mut self) -> Result<(), String> {
        let end = self.network.now() + AGREED;
        loop {
            self.network.run_for(LOOK);
            *self.counts.entry("seconds until they did").or_default() += LOOK.as_secs();
            match self.check() {
                Err(_) if self.network.now() < end => {}
                judged => return judged,
            }
        }
    }

    /// Checks that the directory of every running component is correct.
    fn check(&mut self) -> Result<(), String> {
        let living = (0..self.is_dead.len()).filter(|&node| !self.is_dead[node]);
        let living: Vec<_> = living.collect();
        let mut known = Vec::new();
        for node in living {
            let stacks = &self.network.owner(Host(node)).stacks;
            known.extend(stacks.iter().map(|it| (it.id(), told(&it.directory()))));
        }
        let own = |(id, told): &(JausId, Listing)| (*id, told[id].clone());
        let truth: Listing = known.iter().map(own).collect();
        if let Some((id, told)) = known.iter().find(|(_, told)| *told != truth) {
            return Err(format!("{id} knows {told:?}, and the truth is {truth:?}"));
        }
        *self.counts.entry("directories that agree").or_default() += known.len() as u64;
        Ok(())
    }

    fn keep_counts(&mut self, node: usize) {
        for (name, count) in std::mem::take(&mut self.network.owner(Host(node)).counts) {
            *self.counts.entry(name).or_default() += count;
        }
    }

    fn counts(mut self) -> Counts {
        (0..self.is_dead.len()).for_each(|node| self.keep_counts(node));
        self.counts
    }
}

fn endpoint(node: usize, forward: bool) -> Endpoint {
    let mut endpoint = Endpoint::new(Config {
        routing: Routing {
            forward,
            ..Routing::default()
        },
        ..Config::default()
    });
    for id in ids(node) {
        endpoint.attach(id).expect("a component");
    }
    endpoint
}
