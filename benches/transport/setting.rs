//! Arrangements of two components of the benchmark, and the nodes that they need.

use jaus::address::JausId;

use crate::child::Process;
use crate::place::Place;
use crate::placement::{Placement, Side};
use crate::roles::Role;
use crate::run::folder;

/// How two components of the benchmark are arranged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Setting {
    /// Each runs its own node.
    OwnNodes,
    /// Both are attached to one node in a third process.
    OneNode,
    /// Each is attached to its own node; the two nodes run in two more processes.
    TwoNodes,
}

impl Setting {
    pub(crate) const ALL: [Self; 3] = [Self::OwnNodes, Self::OneNode, Self::TwoNodes];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::OwnNodes => "two components with a node of their own",
            Self::OneNode => "two component processes on one node",
            Self::TwoNodes => "two component processes on two nodes",
        }
    }

    /// The ids of the two components. They differ between settings, because all are in one group.
    pub(crate) const fn ids(self) -> [JausId; 2] {
        match self {
            Self::OwnNodes => [JausId::new(101, 1, 33), JausId::new(102, 1, 33)],
            Self::OneNode => [JausId::new(103, 1, 33), JausId::new(103, 1, 34)],
            Self::TwoNodes => [JausId::new(104, 1, 33), JausId::new(105, 1, 33)],
        }
    }

    /// Starts the nodes; returns the places of the two components.
    pub(crate) fn start(self, placement: Placement) -> (Vec<Process>, [Place; 2]) {
        let node = |id: JausId, side| {
            let place = Place::On(folder().join(format!("{self:?}-{side:?}.sock")));
            let role = Role::Node(id, place.clone());
            (Process::start(&role, &placement.of(side)), place)
        };
        let [ours, theirs] = self.ids();
        match self {
            Self::OwnNodes => (Vec::new(), [Place::Own, Place::Own]),
            Self::OneNode => {
                let (process, place) = node(ours, Side::Ours);
                (vec![process], [place.clone(), place])
            }
            Self::TwoNodes => {
                let ((one, here), (two, there)) =
                    (node(ours, Side::Ours), node(theirs, Side::Theirs));
                (vec![one, two], [here, there])
            }
        }
    }
}
