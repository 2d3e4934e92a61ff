//! The whole G-Bat in one process: three vehicle nodes and the operator's, each part as a task, all
//! on loopback. The parts are those of the programs `jaus-…`.

use std::convert::Infallible;
use std::path::PathBuf;
use std::{fs, process};

use jaus::address::JausId;
use jaus::component::Kind;
use jaus::link::Group;
use jaus::node::{Config, Node};
use jaus_cli::failure::Failure;
use jaus_vehicle::parts::{KnowledgeStore, Part, PartError, Slot};
use jaus_vehicle::sensing::Scenery;
use jaus_view::debug::DebugAddress;
use tokio::task::JoinSet;

use super::network::{OPERATOR, OwnNetwork};
#[cfg(feature = "secure")]
use super::secure::SecureLinks;

/// Name of the vehicle.
pub(super) const NAME: &str = "G-Bat";

/// Nodes with their parts.
pub(super) struct System {
    nodes: Vec<Node>,
    network: OwnNetwork,
    /// File of the knowledge store, kept as long as the demo runs.
    scratch: Scratch,
    /// What the range sensor sees.
    scenery: Scenery,
    parts: JoinSet<(&'static str, PartError)>,
    /// The links between the nodes, if these are secure.
    #[cfg(feature = "secure")]
    secure: Option<SecureLinks>,
}

impl System {
    /// An empty system.
    pub(super) fn new(network: OwnNetwork) -> Self {
        Self {
            nodes: Vec::new(),
            network,
            scratch: Scratch(
                std::env::temp_dir().join(format!("jaus-demo-{}.redb", process::id())),
            ),
            scenery: Scenery::default(),
            parts: JoinSet::new(),
            #[cfg(feature = "secure")]
            secure: None,
        }
    }

    /// Links the nodes by secure links instead of plain JUDP.
    #[cfg(feature = "secure")]
    pub(super) fn secured_by(mut self, links: SecureLinks) -> Self {
        self.secure = Some(links);
        self
    }

    /// The secure links.
    #[cfg(all(test, feature = "secure"))]
    pub(super) fn links(&mut self) -> Option<&mut SecureLinks> {
        self.secure.as_mut()
    }

    /// The flags by which other commands join the system.
    pub(super) fn flags(&self) -> String {
        #[cfg(feature = "secure")]
        if let Some(links) = &self.secure {
            return links.flags();
        }
        self.network.flags()
    }

    /// A knowledge store with the map that the vehicle is shown on.
    pub(super) fn store(&self) -> KnowledgeStore {
        KnowledgeStore {
            file: self.scratch.0.clone(),
            map: Some(KnowledgeStore::fine_demo_map()),
            ..KnowledgeStore::default()
        }
    }

    /// The multicast group, if another demo has the standard one.
    pub(super) fn own_group(&self) -> Option<Group> {
        self.network.is_further().then(|| self.network.group())
    }

    /// The flag by which `jaus watch` finds the debug view.
    pub(super) fn watch_flags(&self) -> String {
        self.network.watch_flags()
    }

    /// Where the debug view is served, unless another program serves one there.
    pub(super) fn debug_address(&self) -> DebugAddress {
        self.network.debug()
    }

    /// The obstacles around the vehicle.
    pub(super) fn scenery(&self) -> Scenery {
        self.scenery.clone()
    }

    /// Adds a node on loopback.
    pub(super) fn node(&mut self, subsystem: u16, number: u8) -> Result<Node, Failure> {
        let node = self.start_node(subsystem, number)?;
        self.nodes.push(node.clone());
        Ok(node)
    }

    fn start_node(&mut self, subsystem: u16, number: u8) -> Result<Node, Failure> {
        #[cfg(feature = "secure")]
        if let Some(links) = &self.secure {
            return links.start(subsystem, number);
        }
        let config = Config::loopback(subsystem, number).group(self.network.group());
        Node::start(config).map_err(Failure::of)
    }

    /// Adds a part under a component number of a node.
    pub(super) fn start(
        &mut self,
        node: &Node,
        number: u8,
        name: &'static str,
        part: impl Part,
    ) -> Result<JausId, Failure> {
        let port = node.attach(number).map_err(Failure::of)?;
        let id = port.id();
        let (kind, subsystem) = match id.subsystem() {
            OPERATOR => (Kind::OperatorControlUnit, "Operator"),
            _ => (Kind::Vehicle, NAME),
        };
        let slot = Slot::new(port, node.clone(), kind, subsystem);
        self.parts.spawn(async move {
            let Err(error): Result<Infallible, _> = part.run(slot).await;
            (name, error)
        });
        Ok(id)
    }

    /// Waits for a part to fail.
    pub(super) async fn failure(&mut self) -> Failure {
        match self.parts.join_next().await {
            Some(Ok((name, error))) => Failure::new(format!("the {name} failed: {error}")),
            Some(Err(error)) => Failure::new(format!("a component's task failed: {error}")),
            None => std::future::pending().await,
        }
    }

    /// Stops all parts, then the nodes.
    pub(super) async fn stop(mut self) {
        self.parts.shutdown().await;
        for node in self.nodes {
            node.shutdown().await;
        }
        #[cfg(feature = "secure")]
        if let Some(links) = self.secure {
            links.stop().await;
        }
    }
}

/// A file that is removed at the end.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        // It may not exist.
        let _ = fs::remove_file(&self.0);
    }
}
