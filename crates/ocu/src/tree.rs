//! The tree of subsystems, nodes, components and services for pages, including components that
//! discovery has lost recently.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::state::{Tree, TreeComponent, TreeNode, TreeService, TreeSubsystem};
use jaus::address::JausId;
use jaus::service::{self, Directory, Identification, Level, Offer};

/// Maximum number of components in a snapshot.
const MOST: usize = 1000;
/// Condition of a component that discovery has lost.
const GONE: &str = "gone";

/// The components that discovery has lost, until they return.
#[derive(Debug, Default)]
pub(super) struct LostComponents {
    lost: BTreeMap<JausId, Lost>,
}

#[derive(Debug)]
struct Lost {
    component: TreeComponent,
    /// Its subsystem and its node, without their components.
    subsystem: TreeSubsystem,
    node: TreeNode,
    at: Instant,
}

impl LostComponents {
    /// A component that does not return is dropped after this time.
    const KEPT: Duration = Duration::from_secs(300);
    /// Maximum number of components. The oldest is dropped first.
    const MOST: usize = 200;

    /// Handles a change of the discovered components.
    pub(super) fn handle_directory(&mut self, now: Instant, before: &Directory, after: &Directory) {
        self.lost.retain(|id, _| after.component(*id).is_none());
        let lost = before.components();
        for known in lost.filter(|known| after.component(known.id).is_none()) {
            self.lost.insert(known.id, Lost::of(known, before, now));
        }
        while self.lost.len() > Self::MOST {
            let oldest = self.lost.iter().min_by_key(|(_, lost)| lost.at);
            let Some(id) = oldest.map(|(id, _)| *id) else {
                break;
            };
            self.lost.remove(&id);
        }
    }

    pub(super) fn handle_time(&mut self, now: Instant) {
        self.lost
            .retain(|_, lost| now.saturating_duration_since(lost.at) < Self::KEPT);
    }
}

impl Lost {
    fn of(known: &service::ComponentEntry, directory: &Directory, at: Instant) -> Self {
        let id = known.id;
        let at_level = |level| directory.identification(level, id);
        Self {
            component: component(known, GONE),
            subsystem: TreeSubsystem::of(id.subsystem(), at_level(Level::Subsystem)),
            node: TreeNode::of(id.node(), at_level(Level::Node)),
            at,
        }
    }
}

/// The tree of a directory and of the components that it has lost. `condition` returns how a
/// component of the directory is.
pub(super) fn of(
    directory: &Directory,
    lost: &LostComponents,
    condition: impl Fn(JausId) -> &'static str,
) -> Tree {
    let mut subsystems = BTreeMap::new();
    for (id, known) in directory.subsystems() {
        let subsystem = TreeSubsystem::of(id, known.identification());
        let mut nodes = BTreeMap::new();
        for (id, known) in known.nodes() {
            let components = known.components();
            let components = components.map(|it| (it.id, component(it, condition(it.id))));
            let node = TreeNode::of(id, known.identification());
            nodes.insert(id, (node, components.collect::<BTreeMap<_, _>>()));
        }
        subsystems.insert(id, (subsystem, nodes));
    }
    for (id, lost) in &lost.lost {
        let subsystem = subsystems.entry(id.subsystem());
        let (_, nodes) = subsystem.or_insert_with(|| (lost.subsystem.clone(), BTreeMap::new()));
        let node = nodes.entry(id.node());
        let (_, components) = node.or_insert_with(|| (lost.node.clone(), BTreeMap::new()));
        components.insert(*id, lost.component.clone());
    }
    let mut left = MOST;
    let subsystems = subsystems.into_values().map(|(subsystem, nodes)| {
        let nodes = nodes.into_values().map(|(node, components)| {
            let components: Vec<_> = components.into_values().take(left).collect();
            left -= components.len();
            TreeNode { components, ..node }
        });
        TreeSubsystem {
            nodes: nodes.collect(),
            ..subsystem
        }
    });
    Tree {
        subsystems: subsystems.collect(),
    }
}

impl TreeSubsystem {
    fn of(id: u16, identification: Option<&Identification>) -> Self {
        Self {
            subsystem: id,
            name: name(identification),
            kind: identification.map_or_else(String::new, |it| it.kind.to_string()),
            nodes: Vec::new(),
        }
    }
}

impl TreeNode {
    fn of(id: u8, identification: Option<&Identification>) -> Self {
        Self {
            node: id,
            name: name(identification),
            components: Vec::new(),
        }
    }
}

fn component(known: &service::ComponentEntry, state: &'static str) -> TreeComponent {
    TreeComponent {
        id: known.id.to_string(),
        name: name(known.identification.as_ref()),
        state,
        services: known.offered().map(offer).collect(),
    }
}

fn offer(offer: &Offer) -> TreeService {
    TreeService {
        urn: offer.urn.clone(),
        version: format!("{}.{}", offer.major, offer.minor),
    }
}

fn name(identification: Option<&Identification>) -> String {
    identification.map_or_else(String::new, |it| it.name.clone())
}
