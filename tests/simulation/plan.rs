//! Choices of a seed: the networks and their nodes, the settings of each node, and the possible
//! kinds of faults.

use std::time::Duration;

use jaus::endpoint::{Config, Limits, Pacing, Packing};

use crate::sim::{Conditions, Random, Socket};

pub(crate) struct Plan {
    pub(crate) nodes: Vec<NodePlan>,
    /// The wire changes bits undetected: meanwhile no received message can be trusted.
    pub(crate) is_corrupting: bool,
    /// An outside host sends messages in the names of the nodes' components.
    pub(crate) is_forging: bool,
}

pub(crate) struct NodePlan {
    /// The networks to which it has a link.
    pub(crate) networks: Vec<u8>,
    pub(crate) config: Config,
    /// Limit of datagrams per transmit of its links.
    pub(crate) max_segments: usize,
    /// Whether it has too little memory to remember what it acknowledged of a large message.
    pub(crate) is_forgetful: bool,
}

impl Plan {
    pub(crate) fn new(random: &mut Random) -> Self {
        let has_long_windows = random.happens(500);
        let networks = networks(random);
        let nodes = networks.into_iter().map(|networks| {
            let mut node = NodePlan::new(random, networks);
            if has_long_windows {
                lengthen_windows(&mut node.config);
            }
            node
        });
        Self {
            nodes: nodes.collect(),
            is_corrupting: random.happens(150),
            is_forging: random.happens(200),
        }
    }

    /// Whether there is more than one route between two networks.
    pub(crate) fn has_loop(&self) -> bool {
        self.nodes
            .iter()
            .filter(|it| it.config.routing.forward)
            .count()
            > 1
    }

    /// Whether there are routers.
    pub(crate) fn is_routed(&self) -> bool {
        self.nodes.iter().any(|node| node.config.routing.forward)
    }
}

/// The networks of each node: all on one, or on several with one router between them, with two in
/// parallel, or with three in a ring.
fn networks(random: &mut Random) -> Vec<Vec<u8>> {
    let routers: &[&[u8]] = match random.below(10) {
        0 => &[&[0, 1]],
        1 => &[&[0, 1], &[0, 1]],
        2 => &[&[0, 1], &[1, 2], &[2, 0]],
        _ => &[&[0]],
    };
    let most = routers.iter().flat_map(|it| it.iter()).max();
    let count = 1 + usize::from(*most.unwrap_or(&0));
    let ends = (0..1 + random.below(3)).map(|_| vec![random.below(count) as u8]);
    let ends: Vec<_> = ends.collect();
    routers.iter().map(|it| it.to_vec()).chain(ends).collect()
}

impl NodePlan {
    fn new(random: &mut Random, networks: Vec<u8>) -> Self {
        let mut config = Config {
            payload_limit: random.choose(&[1425, 1425, 256, 4079]),
            max_window: random.choose(&[512, 512, 4]),
            limits: Limits {
                max_peers: random.choose(&[1024, 1024, 1024, 3]),
                ..Limits::default()
            },
            pacing: random.choose(&[
                Some(Pacing::default()),
                Some(Pacing {
                    burst: 20_000,
                    rate: 2_000_000,
                }),
                None,
            ]),
            packing: random.choose(&[
                Packing::Off,
                Packing::Within(Duration::ZERO),
                Packing::Within(Duration::from_millis(2)),
            ]),
            acknowledge_patience: Duration::from_millis(random.choose(&[3000, 3000, 1500])),
            ..Config::default()
        };
        if networks.len() > 1 {
            config.routing.forward = true;
            config.limits.max_peers = 1024;
        }
        let is_forgetful = random.happens(50);
        if is_forgetful {
            config.max_reassembly_per_sender = 40_000;
            config.max_reassembly = 60_000;
        }
        Self {
            networks,
            config,
            max_segments: random.choose(&[1, 16]),
            is_forgetful,
        }
    }
}

/// Extends the time in which copies of a message are recognised to a minute.
fn lengthen_windows(config: &mut Config) {
    let long = Duration::from_secs(60);
    config.duplicate_window = long;
    config.retransmission_window = long;
    config.first_contact_window = long;
}

/// Random conditions of the wire.
pub(crate) fn conditions(random: &mut Random, is_corrupting: bool) -> Conditions {
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
        corrupted: if is_corrupting {
            random.choose(&[0, 5, 50])
        } else {
            0
        },
        mtu: random.choose(&[usize::MAX, usize::MAX, usize::MAX, 1472, 200]),
        socket: random.happens(400).then(|| socket(random)),
    }
}
