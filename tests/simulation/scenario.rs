//! A scenario from a seed: nodes send during faults; then all faults end, and every later message
//! must arrive.

use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::endpoint::Outgoing;
use jaus::wire::Priority;

use crate::faults::Faults;
use crate::judges::{check_bounds, check_carried, check_rest};
use crate::ledger::Ledger;
use crate::nodes::{Nodes, components};
use crate::plan::{Plan, conditions};
use crate::sim::Random;
use crate::totals::Counts;

/// The longest message.
const LONGEST: usize = 100 << 10;
/// The longest message after all faults.
const LONGEST_AFTER_HEALING: usize = 20_000;
/// Duration of the faults, in milliseconds.
const TROUBLE: u64 = 3000;
/// Limit of actions in that time.
const MOST_ACTIONS: usize = 40;
/// Time limit for the network to become idle after the last action: each packet of a large message
/// is sent up to 20 times, with up to 2 seconds between.
const REST: Duration = Duration::from_secs(240);
/// Pause between the end of the faults and the next message: windows and duplicate memories have
/// expired.
const PAUSE: Duration = Duration::from_secs(10);
/// How often the number of datagrams is checked, so that a storm fails and does not run for ever.
const SLICE: Duration = Duration::from_millis(5);
/// After each component's first message, all nodes know each other's addresses within this time.
const ACQUAINTANCE: Duration = Duration::from_secs(1);

/// Result of a run, to compare runs.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Summary {
    digest: u64,
    pub(crate) counts: Counts,
}

/// Runs the scenario of a seed; an error names the broken promise.
pub(crate) fn run(seed: u64) -> Result<Summary, String> {
    let mut world = World::new(seed);
    let mut times: Vec<Duration> = (0..5 + world.random.below(MOST_ACTIONS - 5))
        .map(|_| world.random.up_to_millis(TROUBLE))
        .collect();
    times.sort_unstable();
    let start = world.nodes.network.now();
    for time in times {
        world.run_until(start + time)?;
        world.act()?;
    }
    world.heal()?;
    world.send_to_all()?;
    world.come_to_rest()?;
    Ok(world.summary())
}

struct World {
    random: Random,
    nodes: Nodes,
    faults: Faults,
    ledger: Ledger,
    /// Number of packets sent for the first time.
    packets: u64,
}

impl World {
    fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let plan = Plan::new(&mut random);
        let ledger = Ledger::new(&mut random, 2 * LONGEST, plan.is_corrupting);
        let conditions = conditions(&mut random, plan.is_corrupting);
        Self {
            nodes: Nodes::new(&mut random, plan, conditions),
            random,
            faults: Faults::new(),
            ledger,
            packets: 0,
        }
    }

    fn run_until(&mut self, end: Instant) -> Result<(), String> {
        while let Some(mended) = self.faults.next_end().filter(|&at| at <= end) {
            self.run_for(mended.saturating_duration_since(self.nodes.network.now()))?;
            self.faults.end_due(&mut self.nodes);
        }
        self.run_for(end.saturating_duration_since(self.nodes.network.now()))?;
        self.look()
    }

    fn run_for(&mut self, time: Duration) -> Result<(), String> {
        let end = self.nodes.network.now() + time;
        while self.nodes.network.now() < end {
            let left = end.saturating_duration_since(self.nodes.network.now());
            self.nodes.network.run_for(left.min(SLICE));
            self.check_carried()?;
        }
        Ok(())
    }

    /// Checks that messages do not multiply.
    fn check_carried(&self) -> Result<(), String> {
        check_carried(&self.nodes, self.packets + self.faults.counts["forged"])
    }

    /// Checks all output, and the memory in use.
    fn look(&mut self) -> Result<(), String> {
        self.nodes.report_to(&mut self.ledger)?;
        check_bounds(&mut self.nodes)
    }

    fn act(&mut self) -> Result<(), String> {
        if self.random.happens(220) {
            // Checked first, because a restart loses unread messages.
            self.look()?;
            self.faults.strike(&mut self.random, &mut self.nodes);
        } else {
            self.send();
        }
        Ok(())
    }

    fn send(&mut self) {
        let random = &mut self.random;
        let (node, to) = (
            random.below(self.nodes.len()),
            random.below(self.nodes.len()),
        );
        // Short and long messages are equally frequent.
        let length = (2 << random.below(16)) + random.below(500);
        let broadcast = random.happens(100);
        let destination = match random.choose(&components(to)) {
            _ if broadcast => JausId::EVERYONE,
            id => id,
        };
        let message = Outgoing {
            acknowledge: !broadcast && random.happens(600),
            priority: random.choose(&Priority::ALL),
            ..Outgoing::new(
                random.choose(&components(node)),
                destination,
                self.ledger.payload(random, length.min(LONGEST)),
            )
        };
        self.hand_in(node, message);
    }

    fn hand_in(&mut self, node: usize, message: Outgoing) {
        let receivers = self.nodes.receivers(&message);
        let config = &self.nodes.plan.nodes[node].config;
        let is_large = message.payload.len() > config.payload_limit;
        let window = if message.acknowledge || is_large {
            config.first_contact_window
        } else {
            config.duplicate_window
        };
        let fragments = message.payload.len().div_ceil(config.payload_limit);
        let what = format!(
            "{node} hands in {:02x?}, {} octets, {} for {}, acknowledged: {}",
            &message.payload[..2],
            message.payload.len(),
            message.priority,
            message.destination,
            message.acknowledge
        );
        self.nodes.note(&what);
        match self.nodes.send(node, message.clone()) {
            Ok(handle) => {
                self.packets += fragments as u64;
                let (now, life) = (self.nodes.network.now(), self.nodes.life(node));
                self.ledger
                    .enter(now, (life, handle), message, receivers, window);
            }
            Err(error) => self.nodes.note(&format!("refused: {error}")),
        }
    }

    /// Ends all faults, and waits for the end of the messages sent before.
    fn heal(&mut self) -> Result<(), String> {
        while let Some(end) = self.faults.next_end() {
            self.run_until(end)?;
        }
        self.rest()?;
        self.faults.end_all(&mut self.nodes);
        self.run_for(PAUSE)?;
        self.look()
    }

    /// Sends a message from every component to all; then one from each node to each single node.
    fn send_to_all(&mut self) -> Result<(), String> {
        self.ledger.expect_all();
        let count = self.nodes.len();
        for (node, source) in (0..count).flat_map(|node| components(node).map(|id| (node, id))) {
            let payload = self.ledger.payload(&mut self.random, 20);
            self.hand_in(node, Outgoing::new(source, JausId::EVERYONE, payload));
        }
        self.run_for(ACQUAINTANCE)?;
        for (node, to) in (0..count).flat_map(|node| (0..count).map(move |to| (node, to))) {
            if !self.nodes.is_reached(node) || !self.nodes.is_reached(to) {
                continue;
            }
            let length = 2 + self.random.below(LONGEST_AFTER_HEALING);
            let payload = self.ledger.payload(&mut self.random, length);
            let [source, destination] = [node, to].map(|it| self.random.choose(&components(it)));
            let message = Outgoing {
                acknowledge: true,
                ..Outgoing::new(source, destination, payload)
            };
            self.hand_in(node, message);
        }
        Ok(())
    }

    fn come_to_rest(&mut self) -> Result<(), String> {
        self.rest()?;
        self.nodes.note_counters();
        let nodes = &self.nodes;
        let is_forgetful = |node: usize| nodes.plan.nodes[node].is_forgetful;
        self.ledger
            .close(nodes.lives(), is_forgetful, |node| nodes.is_reached(node))?;
        check_rest(&mut self.nodes)
    }

    /// Advances until the network is idle. One check at the end suffices: checks are slow, and no
    /// intermediate output gets lost.
    fn rest(&mut self) -> Result<(), String> {
        let limit = self.nodes.network.now() + REST;
        while self.nodes.network.step() {
            if self.nodes.network.now() > limit {
                return Err("the network does not come to rest".to_owned());
            }
            self.check_carried()?;
        }
        self.look()
    }

    fn summary(mut self) -> Summary {
        let mut counts = self.nodes.counts();
        counts.extend(self.ledger.counts);
        counts.extend(self.faults.counts);
        let network = &mut self.nodes.network;
        let harm = network.harm();
        counts.extend([
            ("lost", harm.lost),
            ("cut off", harm.cut),
            ("repeated", harm.repeated),
            ("overtaken", harm.detoured),
            ("corrupted", harm.corrupted),
            ("overflowed", harm.overflowed),
            ("packed", network.packed()),
            ("segmented", network.segmented()),
        ]);
        let is_routed = self.nodes.plan.is_routed();
        counts.insert("routed runs", is_routed.into());
        Summary {
            digest: self.nodes.network.trace().digest(),
            counts,
        }
    }
}
