//! The nodes of a scenario on their networks, across restarts.

use jaus::address::JausId;
use jaus::endpoint::{Config, Counter, Endpoint, MessageHandle, Outgoing, SendError};

use crate::ledger::{Ledger, Life};
use crate::plan::Plan;
use crate::sim::seeds::is_traced;
use crate::sim::{Conditions, Event, Host, Mailbox, Network, Random};
use crate::totals::Counts;

pub(crate) struct Nodes {
    pub(crate) plan: Plan,
    pub(crate) network: Network,
    /// Number of restarts of each node.
    lives: Vec<u32>,
    /// Whether a node's components have ever stopped reading.
    has_rested: Vec<bool>,
    /// Counts of the endpoints that are gone.
    past: Counts,
}

/// The components of a node.
pub(crate) fn components(node: usize) -> [JausId; 2] {
    let subsystem = 101 + node as u16;
    [JausId::new(subsystem, 1, 1), JausId::new(subsystem, 1, 2)]
}

/// The reported counters of the endpoints.
const COUNTERS: [(&str, Counter); 6] = [
    ("packets sent again", Counter::Retransmissions),
    ("duplicates dropped", Counter::Duplicate),
    ("forwarded", Counter::MessagesForwarded),
    ("kept from going in circles", Counter::NotTheWayBack),
    ("acknowledgements sent", Counter::AcknowledgementsSent),
    ("peers forgotten", Counter::PeersEvicted),
];

impl Nodes {
    pub(crate) fn new(random: &mut Random, plan: Plan, conditions: Conditions) -> Self {
        let mut network = Network::new(random.number(), conditions);
        if is_traced() {
            network.trace().print();
        }
        for (node, node_plan) in plan.nodes.iter().enumerate() {
            let endpoint = endpoint(random, node, &node_plan.config);
            let host = network.join_networks(&node_plan.networks, endpoint, Mailbox::default());
            network.set_max_segments(host, node_plan.max_segments);
        }
        Self {
            lives: vec![0; plan.nodes.len()],
            has_rested: vec![false; plan.nodes.len()],
            plan,
            network,
            past: Counts::new(),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.lives.len()
    }

    pub(crate) fn note(&mut self, what: &str) {
        let now = self.network.now();
        self.network.trace().note(now, format_args!("{what}"));
    }

    pub(crate) fn life(&self, node: usize) -> Life {
        (node, self.lives[node])
    }

    /// Sets whether the components of a node read messages.
    pub(crate) fn set_read(&mut self, host: Host, reads: bool) {
        self.has_rested[host.0] |= !reads;
        self.network.set_read(host, reads);
    }

    pub(crate) fn lives(&self) -> &[u32] {
        &self.lives
    }

    pub(crate) fn restart(&mut self, random: &mut Random, node: usize) {
        self.past = self.counts();
        self.lives[node] += 1;
        let endpoint = endpoint(random, node, &self.plan.nodes[node].config);
        self.network
            .restart(Host(node), endpoint, Mailbox::default());
        self.note(&format!("{node} is restarted"));
    }

    pub(crate) fn send(
        &mut self,
        node: usize,
        message: Outgoing,
    ) -> Result<MessageHandle, SendError> {
        self.network
            .act(Host(node), |now, _, endpoint| endpoint.send(now, message))
    }

    /// The components that match a message's destination, with their nodes' lives.
    pub(crate) fn receivers(&self, message: &Outgoing) -> Vec<(JausId, Life)> {
        let everyone = (0..self.len()).flat_map(|node| components(node).map(|id| (id, node)));
        everyone
            .filter(|&(id, _)| {
                message.destination.matches(id)
                    && !(message.destination.has_wildcard() && id == message.source)
            })
            .map(|(id, node)| (id, self.life(node)))
            .collect()
    }

    /// Whether every message must reach a node on a good wire: it has room for messages of all
    /// others at once, and there is one route to it. With several routes, a large message that
    /// arrives on more than one of them may time out.
    pub(crate) fn is_reached(&self, node: usize) -> bool {
        let plan = &self.plan.nodes[node];
        let has_room = !plan.is_forgetful && plan.config.limits.max_peers >= 4 * self.len();
        has_room && !self.plan.has_loop()
    }

    /// Writes each endpoint's counters into the trace.
    pub(crate) fn note_counters(&mut self) {
        for node in 0..self.len() {
            let counters = self.network.endpoint(Host(node)).counters().to_string();
            self.note(&format!("{node} counts {counters}"));
        }
    }

    /// Reports all output to the ledger, deliveries first.
    pub(crate) fn report_to(&mut self, ledger: &mut Ledger) -> Result<(), String> {
        let mut news = Vec::new();
        for node in 0..self.len() {
            let life = self.life(node);
            let has_room = self.plan.nodes[node].config.limits.max_peers >= 4 * self.len();
            let is_strict = has_room && !self.has_rested[node];
            for (at, event) in std::mem::take(&mut self.network.owner(Host(node)).events) {
                match event {
                    Event::Received(received) => ledger.receive(at, life, &received, is_strict)?,
                    Event::News(event) => news.push((life, event)),
                }
            }
        }
        news.iter()
            .try_for_each(|(life, event)| ledger.learn(*life, event))
    }

    /// The endpoints' counters, including those of replaced endpoints.
    pub(crate) fn counts(&mut self) -> Counts {
        let mut counts = self.past.clone();
        for (name, counter) in COUNTERS {
            let sum: u64 = (0..self.len())
                .map(|node| self.network.endpoint(Host(node)).counters().get(counter))
                .sum();
            *counts.entry(name).or_default() += sum;
        }
        counts
    }
}

fn endpoint(random: &mut Random, node: usize, config: &Config) -> Endpoint {
    let mut endpoint = Endpoint::new(Config {
        first_sequence: random.number() as u16,
        ..config.clone()
    });
    for id in components(node) {
        endpoint.attach(id).expect("an id of one component");
    }
    endpoint
}
