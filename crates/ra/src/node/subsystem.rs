//! Description of a subsystem: nodes, components, names and services.

use std::fmt;
use std::net::IpAddr;

use crate::RaId;

/// A local or peer subsystem.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RaSubsystemEntry {
    /// 1 ..= 254.
    pub id: u8,
    /// Its name, at most 79 octets on the wire; empty if not reported.
    pub name: String,
    /// Its nodes.
    pub nodes: Vec<RaNodeEntry>,
}

/// A node of a subsystem.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RaNodeEntry {
    /// 1 ..= 254.
    pub id: u8,
    /// Its name; empty if not reported.
    pub name: String,
    /// Its components.
    pub components: Vec<RaComponentEntry>,
}

/// A component of a node.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RaComponentEntry {
    /// Its type, 1 ..= 254.
    pub component: u8,
    /// Instance number within the type, 1 ..= 254.
    pub instance: u8,
    /// Its name; empty if not reported.
    pub name: String,
    /// Its services; empty if not reported.
    pub services: Vec<RaServiceEntry>,
}

/// A service: the messages of one kind that a component receives and sends.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RaServiceEntry {
    /// 0 for the core services, else the number of the component type.
    pub kind: u16,
    /// Received messages.
    pub inputs: Vec<Command>,
    /// Sent messages.
    pub outputs: Vec<Command>,
}

/// A message of a service.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Command {
    /// The message (command) code.
    pub code: u16,
    /// Supported optional fields; 0 for messages without presence vector.
    pub presence: u32,
}

impl RaSubsystemEntry {
    /// Its components with their ids.
    pub fn components(&self) -> impl Iterator<Item = (RaId, &RaComponentEntry)> + '_ {
        self.nodes.iter().flat_map(move |node| {
            let id = |c: &RaComponentEntry| RaId::new(self.id, node.id, c.component, c.instance);
            node.components.iter().map(move |c| (id(c), c))
        })
    }
}

/// Reason why a subsystem cannot be announced.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BadSubsystem {
    /// A number is out of range.
    #[error("{what} {number} is out of range: use 1 to 254")]
    OutOfRange {
        /// Which number.
        what: &'static str,
        /// Its value.
        number: u8,
    },
    /// Duplicate node or component.
    #[error("{0} appears twice: give each component its own instance")]
    Twice(RaId),
    /// More than a message can hold.
    #[error("{0} has more {1} than a message can list: at most 255")]
    TooMany(RaId, &'static str),
    /// A peer already uses the subsystem number.
    #[error("subsystem {0} exists already{1}: give ours another number")]
    Taken(u8, Where),
}

/// The address of a peer, if known; displays as the end of a clause.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Where(pub Option<IpAddr>);

impl fmt::Display for Where {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(address) => write!(f, ", at {address}"),
            None => Ok(()),
        }
    }
}
