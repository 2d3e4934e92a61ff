//! What `jaus doctor` received from the network during its check.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::Directory;
use jaus::endpoint::{Path, Peer};
use jaus::node::LinkReport;

use super::finding::Finding;

/// A subsystem and a node.
pub(super) type NodeId = (u16, u8);

pub(super) const fn node_of(id: JausId) -> NodeId {
    (id.subsystem(), id.node())
}

/// The nodes and systems that were found.
pub(super) struct Heard {
    /// Other components.
    pub(super) peers: Vec<Peer>,
    pub(super) directory: Arc<Directory>,
    pub(super) links: Vec<LinkReport>,
    /// Nodes from which only unicast was received.
    pub(super) mute: BTreeSet<NodeId>,
    pub(super) listened: Duration,
    /// Ids received from more than one address.
    pub(super) moved: BTreeMap<JausId, BTreeSet<Path>>,
    /// Systems of the Reference Architecture.
    pub(super) of_ra: Vec<Finding>,
}
