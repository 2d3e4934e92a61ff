//! The tree of subsystems, nodes, components and services for pages.

use super::state::{Tree, TreeComponent, TreeNode, TreeService, TreeSubsystem};
use jaus::service::{self, Directory, Identification, Offer};

/// Maximum number of components in a snapshot.
const MOST: usize = 1000;

pub(super) fn of(directory: &Directory) -> Tree {
    let mut left = MOST;
    let all = directory.subsystems();
    let subsystems = all.map(|(id, known)| subsystem(id, known, &mut left));
    Tree {
        subsystems: subsystems.collect(),
    }
}

fn subsystem(id: u16, known: &service::SubsystemEntry, left: &mut usize) -> TreeSubsystem {
    let identification = known.identification();
    TreeSubsystem {
        subsystem: id,
        name: name(identification),
        kind: identification.map_or_else(String::new, |it| it.kind.to_string()),
        nodes: known
            .nodes()
            .map(|(id, known)| node(id, known, left))
            .collect(),
    }
}

fn node(id: u8, known: &service::NodeEntry, left: &mut usize) -> TreeNode {
    let components: Vec<_> = known.components().take(*left).map(component).collect();
    *left -= components.len();
    TreeNode {
        node: id,
        name: name(known.identification()),
        components,
    }
}

fn component(known: &service::ComponentEntry) -> TreeComponent {
    TreeComponent {
        id: known.id.to_string(),
        name: name(known.identification.as_ref()),
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
