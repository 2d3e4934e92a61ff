//! Faults of a scenario: changing conditions, cuts, restarts, address changes, components that do
//! not read, forged senders; and their ends.

use std::net::SocketAddr;
use std::time::Instant;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::wire::{Acknowledgement, Flags, Frame, Framing};

use crate::ledger::FORGED;
use crate::nodes::{Nodes, components};
use crate::plan::conditions;
use crate::sim::{Conditions, Host, Random};
use crate::totals::Counts;

/// A lasting fault.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Lasting {
    /// No datagrams pass between two nodes.
    Cut(Host, Host),
    /// A node's components do not read.
    Unread(Host),
}

/// The faults of a scenario.
#[derive(Default)]
pub(crate) struct Faults {
    /// Lasting faults with their end times, in order of end.
    lasting: Vec<(Instant, Lasting)>,
    pub(crate) counts: Counts,
}

impl Faults {
    /// Longest cut, in milliseconds.
    const CUT: u64 = 4000;
    /// Longest pause of reading, in milliseconds.
    const UNREAD: u64 = 2000;
    /// The counted events.
    const NAMES: [&str; 5] = ["cuts", "restarts", "moves", "pauses", "forged"];

    pub(crate) fn new() -> Self {
        Self {
            lasting: Vec::new(),
            counts: Self::NAMES.map(|name| (name, 0)).into(),
        }
    }

    /// Injects a random fault.
    pub(crate) fn strike(&mut self, random: &mut Random, nodes: &mut Nodes) {
        let node = random.below(nodes.len());
        match random.below(22) {
            0..8 => {
                let conditions = conditions(random, nodes.plan.is_corrupting);
                nodes.note(&format!("{conditions:?}"));
                nodes.network.set_conditions(conditions);
            }
            8..13 => {
                let other = random.below(nodes.len());
                if other != node {
                    let cut = Lasting::Cut(Host(node.min(other)), Host(node.max(other)));
                    self.begin(random, nodes, cut);
                }
            }
            13..16 => {
                self.count("restarts");
                nodes.restart(random, node);
            }
            16 | 17 => {
                self.count("moves");
                nodes.network.readdress(Host(node));
                nodes.note(&format!("{node} has another address"));
            }
            18 | 19 => self.begin(random, nodes, Lasting::Unread(Host(node))),
            _ if nodes.plan.is_forging => self.forge(random, nodes, node),
            _ => {}
        }
    }

    fn count(&mut self, name: &'static str) {
        *self.counts.entry(name).or_default() += 1;
    }

    fn begin(&mut self, random: &mut Random, nodes: &mut Nodes, fault: Lasting) {
        if self.lasting.iter().any(|&(_, other)| other == fault) {
            return;
        }
        let longest = match fault {
            Lasting::Cut(..) => Self::CUT,
            Lasting::Unread(_) => Self::UNREAD,
        };
        self.count(match fault {
            Lasting::Cut(..) => "cuts",
            Lasting::Unread(_) => "pauses",
        });
        let end = nodes.network.now() + random.up_to_millis(longest);
        self.lasting.push((end, fault));
        self.lasting.sort_unstable_by_key(|&(end, _)| end);
        set(nodes, fault, true);
    }

    /// When the next lasting fault ends.
    pub(crate) fn next_end(&self) -> Option<Instant> {
        self.lasting.first().map(|&(end, _)| end)
    }

    /// Ends the lasting faults that are due.
    pub(crate) fn end_due(&mut self, nodes: &mut Nodes) {
        let now = nodes.network.now();
        while let Some(&(end, fault)) = self.lasting.first()
            && end <= now
        {
            self.lasting.remove(0);
            set(nodes, fault, false);
        }
    }

    /// Ends all faults: the wire is good from now on.
    pub(crate) fn end_all(&mut self, nodes: &mut Nodes) {
        for (_, fault) in self.lasting.drain(..) {
            set(nodes, fault, false);
        }
        nodes.network.set_conditions(Conditions::good());
        nodes.note("the wire is good");
    }

    /// Sends a message from an outside host in the name of a node's component.
    fn forge(&mut self, random: &mut Random, nodes: &mut Nodes, victim: usize) {
        self.count("forged");
        let to = random.below(nodes.len());
        let everyone = [JausId::EVERYONE, random.choose(&components(to))];
        let frame = Frame {
            flags: Flags::default().with_acknowledgement(match random.happens(300) {
                true => Acknowledgement::Request,
                false => Acknowledgement::None,
            }),
            sequence: random.number() as u16,
            ..Frame::new(
                random.choose(&components(victim)),
                random.choose(&everyone),
                forged_payload(random),
            )
        };
        let datagram = Framing::Judp.encode(&frame).expect("a short message");
        let forger = SocketAddr::from(([10, 0, 9, 9], 3794));
        nodes.network.inject(forger, Host(to), &datagram);
    }
}

fn forged_payload(random: &mut Random) -> Bytes {
    let mut payload = FORGED.to_le_bytes().to_vec();
    payload.extend_from_slice(&random.number().to_le_bytes());
    payload.into()
}

fn set(nodes: &mut Nodes, fault: Lasting, is_broken: bool) {
    let what = match fault {
        Lasting::Cut(one, other) => {
            nodes.network.set_cut(one, other, is_broken);
            format!("the wire between {one:?} and {other:?} is cut: {is_broken}")
        }
        Lasting::Unread(host) => {
            nodes.set_read(host, !is_broken);
            format!("the components of {host:?} read: {}", !is_broken)
        }
    };
    nodes.note(&what);
}
