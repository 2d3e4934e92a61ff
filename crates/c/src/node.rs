//! Nodes: settings and start; and the node of this host.

use std::ffi::c_char;
use std::sync::{Mutex, MutexGuard};

use jaus::link::Group;
use jaus::node::{Address, Config, Host, Node, StartError};
use jaus_binding::{Place, lock};

use crate::argument::{check_out, put, text};
use crate::runtime::Runtime;
use crate::status::{Failure, JausStatus, check_may_wait, run};
use crate::table::Table;
use crate::types::JausNode;

pub(crate) static NODES: Table<NodeEntry> = Table::new("node");

/// A node of the program.
pub(crate) struct NodeEntry {
    pub(crate) runtime: Runtime,
    stage: Mutex<Stage>,
}

/// What there is of a node.
enum Stage {
    Settings(Box<Config>),
    Runs(Place),
    Ended,
}

impl NodeEntry {
    fn add(stage: Stage) -> Result<JausNode, Failure> {
        NODES.check_room()?;
        let id = Table::<Self>::reserve();
        let runtime = Runtime::start()?;
        let stage = Mutex::new(stage);
        NODES.insert(id, Self { runtime, stage });
        Ok(JausNode { id })
    }

    fn stage(&self) -> MutexGuard<'_, Stage> {
        lock(&self.stage)
    }

    /// Where components run.
    pub(crate) fn place(&self) -> Result<Place, Failure> {
        match &*self.stage() {
            Stage::Settings(_) => Err(Failure::new(
                JausStatus::WrongState,
                "the node does not run: call jaus_node_start first",
            )),
            Stage::Ended => Err(Failure::new(JausStatus::Stopped, "the node has stopped")),
            Stage::Runs(place) => Ok(place.clone()),
        }
    }

    /// Changes the settings before the start.
    fn set(&self, change: impl FnOnce(Config) -> Result<Config, Failure>) -> Result<(), Failure> {
        let mut stage = self.stage();
        let Stage::Settings(config) = &mut *stage else {
            let text = "the node runs: make settings before jaus_node_start";
            return Err(Failure::new(JausStatus::WrongState, text));
        };
        **config = change((**config).clone())?;
        Ok(())
    }

    fn start(&self) -> Result<(), Failure> {
        check_may_wait()?;
        let mut stage = self.stage();
        let Stage::Settings(config) = &*stage else {
            return Err(Failure::new(
                JausStatus::WrongState,
                "the node was started before",
            ));
        };
        let config = (**config).clone();
        let started = self.runtime.wait(async { Node::start(config) })?;
        *stage = Stage::Runs(Place::Node(started.map_err(|error| not_started(&error))?));
        Ok(())
    }

    /// Closes its links.
    pub(crate) fn end(&self) -> Result<(), Failure> {
        let stage = std::mem::replace(&mut *self.stage(), Stage::Ended);
        if let Stage::Runs(Place::Node(node)) = stage {
            self.runtime.wait(node.shutdown())?;
        }
        Ok(())
    }
}

fn not_started(error: &StartError) -> Failure {
    Failure::of(JausStatus::NotStarted, error)
}

fn parse<T: std::str::FromStr<Err: std::fmt::Display>>(text: &str) -> Result<T, Failure> {
    text.parse()
        .map_err(|error: T::Err| Failure::argument(error.to_string()))
}

fn change(
    node: JausNode,
    change: impl FnOnce(Config) -> Result<Config, Failure>,
) -> Result<(), Failure> {
    NODES.get(node.id)?.set(change)
}

/// Creates a node with default settings: all interfaces, UDP port 3794. `subsystem` is 1 to 65534,
/// `number` 1 to 254. Start it with `jaus_node_start`, and free it with `jaus_node_free`.
///
/// # Safety
/// `node` is null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_node_create(
    subsystem: u16,
    number: u8,
    node: *mut JausNode,
) -> JausStatus {
    run(|| {
        check_out(node, "node")?;
        let config = Config::new(subsystem, number);
        config
            .validate()
            .map_err(|error| Failure::argument(error.to_string()))?;
        let created = NodeEntry::add(Stage::Settings(Box::new(config)))?;
        // SAFETY: as the caller guarantees.
        unsafe { put(node, created, "node") }
    })
}

/// Uses the node of this host, which another process runs, such as `jaus node --local`. `address` is
/// `default`, the path of a socket, or a port of loopback such as `127.0.0.1:37940`. Components connect
/// when they start, and again whenever the node is back.
///
/// # Safety
/// `address` is null, or a text that ends with a 0. `node` is null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_node_of_host(
    address: *const c_char,
    node: *mut JausNode,
) -> JausStatus {
    run(|| {
        check_out(node, "node")?;
        // SAFETY: as the caller guarantees.
        let address: Address = parse(unsafe { text(address, "address") }?)?;
        let created = NodeEntry::add(Stage::Runs(Place::Host(Host::at(address))))?;
        // SAFETY: as the caller guarantees.
        unsafe { put(node, created, "node") }
    })
}

/// Keeps the node on this host, on any free port, for tests and trials.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_node_use_loopback(node: JausNode) -> JausStatus {
    run(|| {
        change(node, |config| {
            let loopback = Config::loopback(config.subsystem, config.node);
            let mut config = config.port(loopback.port);
            config.interfaces = loopback.interfaces;
            Ok(config)
        })
    })
}

/// Uses only this interface, by name or address; several calls add several.
///
/// # Safety
/// `interface` is null, or a text that ends with a 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_node_use_interface(
    node: JausNode,
    interface: *const c_char,
) -> JausStatus {
    run(|| {
        // SAFETY: as the caller guarantees.
        let interface = unsafe { text(interface, "interface") }?.to_owned();
        change(node, |mut config| {
            use jaus::link::Interfaces::Only;
            match &mut config.interfaces {
                Only(known) => known.push(interface),
                other => *other = Only(vec![interface]),
            }
            Ok(config)
        })
    })
}

/// Uses this UDP port; 0 selects any free one.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_node_use_port(node: JausNode, port: u16) -> JausStatus {
    run(|| change(node, |config| Ok(config.port(port))))
}

/// Uses this multicast group, such as `239.255.0.1:3794`, or none (`off`).
///
/// # Safety
/// `group` is null, or a text that ends with a 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_node_use_group(node: JausNode, group: *const c_char) -> JausStatus {
    run(|| {
        // SAFETY: as the caller guarantees.
        let group: Group = parse(unsafe { text(group, "group") }?)?;
        change(node, |config| Ok(config.group(group)))
    })
}

/// Also sends multicast traffic to this peer by unicast, such as `192.168.7.2:3794`.
///
/// # Safety
/// `peer` is null, or a text that ends with a 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_node_add_peer(node: JausNode, peer: *const c_char) -> JausStatus {
    run(|| {
        // SAFETY: as the caller guarantees.
        let peer = parse(unsafe { text(peer, "peer") }?)?;
        change(node, |config| Ok(config.peer(peer)))
    })
}

/// Serves the component processes of this host at this address; see `jaus_node_of_host`.
///
/// # Safety
/// `address` is null, or a text that ends with a 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_node_serve_host(
    node: JausNode,
    address: *const c_char,
) -> JausStatus {
    run(|| {
        // SAFETY: as the caller guarantees.
        let address: Address = parse(unsafe { text(address, "address") }?)?;
        change(node, |config| Ok(config.local(address)))
    })
}

/// Opens the links of a node. Not in a callback.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_node_start(node: JausNode) -> JausStatus {
    run(|| NODES.get(node.id)?.start())
}
