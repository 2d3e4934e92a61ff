//! The tree of subsystems, nodes, components and services for pages.

use super::state::{Component, Node, Service, Subsystem, Tree};
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

fn subsystem(id: u16, known: &service::Subsystem, left: &mut usize) -> Subsystem {
    let identification = known.identification();
    Subsystem {
        subsystem: id,
        name: name(identification),
        kind: identification.map_or_else(String::new, |it| it.kind.to_string()),
        nodes: known
            .nodes()
            .map(|(id, known)| node(id, known, left))
            .collect(),
    }
}

fn node(id: u8, known: &service::Node, left: &mut usize) -> Node {
    let components: Vec<_> = known.components().take(*left).map(component).collect();
    *left -= components.len();
    Node {
        node: id,
        name: name(known.identification()),
        components,
    }
}

fn component(known: &service::Component) -> Component {
    Component {
        id: known.id.to_string(),
        name: name(known.identification.as_ref()),
        services: known.offered().map(offer).collect(),
    }
}

fn offer(offer: &Offer) -> Service {
    Service {
        urn: offer.urn.clone(),
        version: format!("{}.{}", offer.major, offer.minor),
    }
}

fn name(identification: Option<&Identification>) -> String {
    identification.map_or_else(String::new, |it| it.name.clone())
}
