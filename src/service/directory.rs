//! The directory: known subsystems, their nodes, their components, and the services of those.
//! [`Discovery`](super::Discovery) maintains it; applications read it.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use crate::address::JausId;
use crate::codec::ServiceId;

/// The tree of everything that discovery has found, including the own component.
///
/// It is small and cheap to clone, so that applications can keep a copy. Copies share unchanged
/// parts.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Directory {
    subsystems: BTreeMap<u16, Arc<SubsystemEntry>>,
}

/// A vehicle, an operator station, or any other system with its own subsystem number.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SubsystemEntry {
    identification: Option<Identification>,
    nodes: BTreeMap<u8, NodeEntry>,
}

/// A computer of a subsystem.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct NodeEntry {
    identification: Option<Identification>,
    components: BTreeMap<u8, ComponentEntry>,
}

/// A program on a node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ComponentEntry {
    /// Its id.
    pub id: JausId,
    /// Kind and name, once reported.
    pub identification: Option<Identification>,
    /// Its services, once reported by it or its subsystem. Components with the same services share
    /// a list.
    pub services: Option<Arc<[Offer]>>,
}

/// Kind and name, as in Report Identification (4B00h).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identification {
    /// What kind of thing it is.
    pub kind: Kind,
    /// Its name for people. May be empty.
    pub name: String,
}

/// The kinds of subsystems, nodes and components in Report Identification (AS5710).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// A subsystem that moves or acts: 10001.
    Vehicle,
    /// An operator control unit: 20001.
    OperatorControlUnit,
    /// A subsystem of another kind: 30001.
    OtherSubsystem,
    /// A node: 40001.
    Node,
    /// A payload: 50001.
    Payload,
    /// A component: 60001.
    Component,
    /// A number that the standard does not define.
    Unknown(u16),
}

/// A service that a component advertises.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Offer {
    /// For example `urn:jaus:jss:core:Discovery`.
    pub urn: String,
    /// Incremented by incompatible changes.
    pub major: u8,
    /// Incremented by additions.
    pub minor: u8,
}

/// The three levels with their own identification.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Level {
    /// The subsystem.
    Subsystem,
    /// The node.
    Node,
    /// The component.
    Component,
}

impl Directory {
    /// All subsystems with their numbers, in order.
    pub fn subsystems(&self) -> impl Iterator<Item = (u16, &SubsystemEntry)> {
        self.subsystems
            .iter()
            .map(|(&id, subsystem)| (id, &**subsystem))
    }

    /// One subsystem.
    #[must_use]
    pub fn subsystem(&self, id: u16) -> Option<&SubsystemEntry> {
        self.subsystems.get(&id).map(|subsystem| &**subsystem)
    }

    /// All components of all subsystems, in order of their ids.
    pub fn components(&self) -> impl Iterator<Item = &ComponentEntry> {
        self.subsystems
            .values()
            .flat_map(|subsystem| subsystem.components())
    }

    /// One component.
    #[must_use]
    pub fn component(&self, id: JausId) -> Option<&ComponentEntry> {
        self.subsystem(id.subsystem())?
            .node(id.node())?
            .component(id.component())
    }

    /// The components that offer a service, in any version.
    pub fn offering<'d>(&'d self, urn: &'d str) -> impl Iterator<Item = &'d ComponentEntry> {
        self.components()
            .filter(move |component| component.offers(urn))
    }

    /// The identification of a subsystem, a node or a component. `id` may be any component in it.
    #[must_use]
    pub fn identification(&self, level: Level, id: JausId) -> Option<&Identification> {
        let subsystem = self.subsystem(id.subsystem())?;
        match level {
            Level::Subsystem => subsystem.identification(),
            Level::Node => subsystem.node(id.node())?.identification(),
            Level::Component => self.component(id)?.identification.as_ref(),
        }
    }

    /// The number of components.
    #[must_use]
    pub fn len(&self) -> usize {
        self.components().count()
    }

    /// Whether the directory holds no component.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.subsystems.is_empty()
    }

    /// Adds a component of which only the id is known. Returns whether it is new.
    pub(super) fn insert(&mut self, id: JausId) -> bool {
        if self.component(id).is_some() {
            return false;
        }
        let subsystem = self.subsystems.entry(id.subsystem()).or_default();
        let node = Arc::make_mut(subsystem).nodes.entry(id.node()).or_default();
        let component = ComponentEntry {
            id,
            identification: None,
            services: None,
        };
        node.components.insert(id.component(), component);
        true
    }

    /// Removes a component, and its node and subsystem if they become empty.
    pub(super) fn remove(&mut self, id: JausId) {
        if self.component(id).is_none() {
            return;
        }
        let Some(subsystem) = self.subsystem_mut(id) else {
            return;
        };
        if let Some(node) = subsystem.nodes.get_mut(&id.node()) {
            node.components.remove(&id.component());
            if node.components.is_empty() {
                subsystem.nodes.remove(&id.node());
            }
        }
        if subsystem.nodes.is_empty() {
            self.subsystems.remove(&id.subsystem());
        }
    }

    /// Sets the identification at one level of a known component. Returns whether it has changed.
    pub(super) fn identify(&mut self, level: Level, id: JausId, new: Identification) -> bool {
        if self.identification(level, id) == Some(&new) {
            return false;
        }
        let slot = match level {
            Level::Subsystem => self.subsystem_mut(id).map(|it| &mut it.identification),
            Level::Node => self.node_mut(id).map(|it| &mut it.identification),
            Level::Component => self.component_mut(id).map(|it| &mut it.identification),
        };
        let Some(slot) = slot else {
            return false;
        };
        *slot = Some(new);
        true
    }

    /// Sets the services of a known component. Returns whether they have changed.
    pub(super) fn set_services(&mut self, id: JausId, mut services: Vec<Offer>) -> bool {
        services.sort_unstable();
        services.dedup();
        let known = self.component(id).map(|component| &component.services);
        if known.is_none_or(|known| known.as_deref() == Some(&services[..])) {
            return false;
        }
        let list = self.list(&services).cloned();
        let list = list.unwrap_or_else(|| services.into());
        if let Some(component) = self.component_mut(id) {
            component.services = Some(list);
        }
        true
    }

    /// An existing list with exactly these services, in order. The components of a node mostly
    /// offer the same services.
    pub(super) fn list(&self, services: &[Offer]) -> Option<&Arc<[Offer]>> {
        let mut lists = self.components().filter_map(|it| it.services.as_ref());
        lists.find(|list| ***list == *services)
    }

    /// The subsystem of `id`, for changes. It is copied first if a clone of the directory shares
    /// it.
    fn subsystem_mut(&mut self, id: JausId) -> Option<&mut SubsystemEntry> {
        self.subsystems.get_mut(&id.subsystem()).map(Arc::make_mut)
    }

    fn node_mut(&mut self, id: JausId) -> Option<&mut NodeEntry> {
        self.subsystem_mut(id)?.nodes.get_mut(&id.node())
    }

    fn component_mut(&mut self, id: JausId) -> Option<&mut ComponentEntry> {
        self.node_mut(id)?.components.get_mut(&id.component())
    }
}

impl SubsystemEntry {
    /// Kind and name, once reported.
    #[must_use]
    pub fn identification(&self) -> Option<&Identification> {
        self.identification.as_ref()
    }

    /// Its nodes with their numbers, in order.
    pub fn nodes(&self) -> impl Iterator<Item = (u8, &NodeEntry)> {
        self.nodes.iter().map(|(&id, node)| (id, node))
    }

    /// One of its nodes.
    #[must_use]
    pub fn node(&self, id: u8) -> Option<&NodeEntry> {
        self.nodes.get(&id)
    }

    /// All components of all its nodes.
    pub fn components(&self) -> impl Iterator<Item = &ComponentEntry> {
        self.nodes.values().flat_map(NodeEntry::components)
    }
}

impl NodeEntry {
    /// Kind and name, once reported.
    #[must_use]
    pub fn identification(&self) -> Option<&Identification> {
        self.identification.as_ref()
    }

    /// Its components, in order.
    pub fn components(&self) -> impl Iterator<Item = &ComponentEntry> {
        self.components.values()
    }

    /// One of its components.
    #[must_use]
    pub fn component(&self, id: u8) -> Option<&ComponentEntry> {
        self.components.get(&id)
    }
}

impl ComponentEntry {
    /// Its services. Empty until it has reported them.
    pub fn offered(&self) -> impl Iterator<Item = &Offer> {
        self.services.iter().flat_map(|services| services.iter())
    }

    /// Whether it advertises a service, in any version.
    #[must_use]
    pub fn offers(&self, urn: &str) -> bool {
        self.offered().any(|offer| offer.urn == urn)
    }
}

impl Offer {
    /// Whether it serves a client made for `wanted`: the same service and major version, and at
    /// least the same minor version.
    #[must_use]
    pub fn serves(&self, wanted: ServiceId) -> bool {
        self.urn == wanted.urn && self.major == wanted.major && self.minor >= wanted.minor
    }
}

impl From<ServiceId> for Offer {
    fn from(id: ServiceId) -> Self {
        Self {
            urn: id.urn.to_owned(),
            major: id.major,
            minor: id.minor,
        }
    }
}

impl fmt::Display for Offer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}.{}", self.urn, self.major, self.minor)
    }
}

impl Kind {
    /// The number on the wire.
    #[must_use]
    pub const fn code(self) -> u16 {
        match self {
            Self::Vehicle => 10001,
            Self::OperatorControlUnit => 20001,
            Self::OtherSubsystem => 30001,
            Self::Node => 40001,
            Self::Payload => 50001,
            Self::Component => 60001,
            Self::Unknown(code) => code,
        }
    }

    /// The kind with this number on the wire.
    #[must_use]
    pub const fn from_code(code: u16) -> Self {
        match code {
            10001 => Self::Vehicle,
            20001 => Self::OperatorControlUnit,
            30001 => Self::OtherSubsystem,
            40001 => Self::Node,
            50001 => Self::Payload,
            60001 => Self::Component,
            code => Self::Unknown(code),
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Vehicle => f.pad("vehicle"),
            Self::OperatorControlUnit => f.pad("operator control unit"),
            Self::OtherSubsystem => f.pad("other subsystem"),
            Self::Node => f.pad("node"),
            Self::Payload => f.pad("payload"),
            Self::Component => f.pad("component"),
            Self::Unknown(code) => write!(f, "kind {code}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: JausId = JausId::new(101, 1, 1);
    const B: JausId = JausId::new(101, 1, 2);

    #[test]
    fn a_component_brings_its_node_and_subsystem_and_the_last_one_takes_them_along() {
        let mut directory = Directory::default();
        assert!(directory.insert(A));
        assert!(directory.insert(B));
        assert!(!directory.insert(A));
        assert_eq!(
            directory.components().map(|c| c.id).collect::<Vec<_>>(),
            [A, B]
        );
        directory.remove(A);
        assert!(directory.subsystem(101).is_some());
        directory.remove(B);
        assert!(directory.is_empty());
    }

    #[test]
    fn the_order_in_which_services_are_listed_is_no_news() {
        let offer = |urn: &str| Offer {
            urn: urn.into(),
            major: 1,
            minor: 0,
        };
        let mut directory = Directory::default();
        directory.insert(A);
        assert!(directory.set_services(A, vec![offer("a"), offer("b")]));
        assert!(!directory.set_services(A, vec![offer("b"), offer("a"), offer("a")]));
        assert!(directory.set_services(A, vec![offer("b")]));
        assert!(
            !directory.set_services(B, vec![offer("b")]),
            "B is not in the tree"
        );
    }

    #[test]
    fn a_name_that_is_told_again_is_no_news() {
        let named = |name: &str| Identification {
            kind: Kind::Vehicle,
            name: name.into(),
        };
        let mut directory = Directory::default();
        directory.insert(A);
        for level in [Level::Subsystem, Level::Node, Level::Component] {
            assert!(directory.identify(level, A, named("rover")));
            assert!(!directory.identify(level, A, named("rover")));
            assert_eq!(directory.identification(level, A), Some(&named("rover")));
        }
        assert!(!directory.identify(Level::Component, B, named("rover")));
    }

    #[test]
    fn a_newer_minor_version_serves_a_client_of_an_older_one_but_not_the_other_way_round() {
        let wanted = |minor| ServiceId {
            urn: "urn:a",
            major: 1,
            minor,
        };
        let offer = Offer::from(wanted(1));
        assert!(offer.serves(wanted(0)));
        assert!(offer.serves(wanted(1)));
        assert!(!offer.serves(wanted(2)));
        assert!(!offer.serves(ServiceId {
            urn: "urn:a",
            major: 2,
            minor: 0
        }));
    }

    #[test]
    fn every_kind_keeps_its_number() {
        for code in 0..=u16::MAX {
            assert_eq!(Kind::from_code(code).code(), code);
        }
    }
}
