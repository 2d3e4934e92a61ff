//! What a subsystem says of itself: nodes, components, names and services.

use std::fmt;
use std::net::IpAddr;

use crate::RaId;

/// A subsystem, ours or another's.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Subsystem {
    /// 1 ..= 254.
    pub id: u8,
    /// Its name, at most 79 octets on the wire; empty if it did not say.
    pub name: String,
    /// Its nodes.
    pub nodes: Vec<Node>,
}

/// A node of a subsystem.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Node {
    /// 1 ..= 254.
    pub id: u8,
    /// Its name; empty if it did not say.
    pub name: String,
    /// Its components.
    pub components: Vec<Component>,
}

/// A component of a node.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Component {
    /// Its type, 1 ..= 254.
    pub component: u8,
    /// Which of several of that type, 1 ..= 254.
    pub instance: u8,
    /// Its name; empty if it did not say.
    pub name: String,
    /// Its services; empty if it did not say.
    pub services: Vec<Service>,
}

/// A service: the messages of one kind that a component understands and sends.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Service {
    /// 0 for the core services, else the number of the component type.
    pub kind: u16,
    /// What it understands.
    pub inputs: Vec<Command>,
    /// What it sends.
    pub outputs: Vec<Command>,
}

/// A message of a service.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Command {
    /// The message (command) code.
    pub code: u16,
    /// Which optional fields; 0 for messages without presence vector.
    pub presence: u32,
}

impl Subsystem {
    /// Its components with their ids.
    pub fn components(&self) -> impl Iterator<Item = (RaId, &Component)> + '_ {
        self.nodes.iter().flat_map(move |node| {
            let id = |c: &Component| RaId::new(self.id, node.id, c.component, c.instance);
            node.components.iter().map(move |c| (id(c), c))
        })
    }
}

/// Why a subsystem cannot be shown.
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
    /// The same node or component twice.
    #[error("{0} is there twice: give each component an instance of its own")]
    Twice(RaId),
    /// More than a message can hold.
    #[error("{0} has more {1} than one message can tell: at most 255")]
    TooMany(RaId, &'static str),
    /// A subsystem of that number is heard from elsewhere.
    #[error("subsystem {0} is there already{1}: give ours another number")]
    Taken(u8, Where),
}

/// Where somebody was heard, if that is known; reads as the end of a clause.
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
