//! The flags of every command that goes on the network: who we are, and where.

use std::fs;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::{Args, ValueEnum};
use jaus::address::JausId;
use jaus::component::{Builder, Component, Kind};
use jaus::link::{Group, Interfaces};
use jaus::node::{Config, Peer};
use serde::Deserialize;

use crate::failure::Failure;

#[derive(Args)]
#[command(next_help_heading = "Network")]
pub(crate) struct Network {
    /// Our id, SUBSYSTEM.NODE.COMPONENT or SUBSYSTEM.NODE (then component 1)
    #[arg(long, value_name = "ID")]
    id: Option<OwnId>,

    /// What our subsystem is called
    #[arg(long)]
    name: Option<String>,

    /// What our subsystem is
    #[arg(long, value_enum)]
    kind: Option<SubsystemKind>,

    /// Use only this interface, by name or IPv4 address (repeatable) [default: all that are up]
    #[arg(long, value_name = "INTERFACE", conflicts_with = "loopback")]
    interface: Vec<String>,

    /// Stay on this host: no network is needed, and nothing leaves
    #[arg(long)]
    loopback: bool,

    /// Our UDP port; 0 takes any free one [default: 3794, or any free one if that is taken]
    #[arg(long)]
    port: Option<u16>,

    /// The multicast group by which nodes find each other, or off [default: 239.255.0.1:3794]
    #[arg(long, value_name = "ADDRESS")]
    group: Option<Group>,

    /// How many routers multicast may pass [default: 16]
    #[arg(long)]
    ttl: Option<u8>,

    /// Speak to this address by unicast too, where multicast does not reach (repeatable)
    ///
    /// ADDRESS, ADDRESS:PORT or ID@ADDRESS:PORT, for example 192.168.7.2 or 102.255.255@192.168.7.2
    #[arg(long, value_name = "PEER")]
    peer: Vec<Peer>,

    /// Take the settings from a TOML file; flags come on top
    ///
    /// It has the keys id, name and kind as the flags, and those of a node: interfaces, port,
    /// group, ttl, peers, for example
    ///   id = "101.1.1"
    ///   name = "Rover"
    ///   interfaces = ["eth0"]
    ///   peers = ["192.168.7.2"]
    #[arg(long, value_name = "FILE", verbatim_doc_comment)]
    config: Option<PathBuf>,
}

/// What a command goes on the network with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Settings {
    /// Our component's id.
    pub(crate) id: JausId,
    /// What our subsystem is, if somebody said.
    pub(crate) kind: Option<SubsystemKind>,
    /// What it is called, if somebody said.
    pub(crate) name: Option<String>,
    /// The node to run.
    pub(crate) node: Config,
}

impl Settings {
    /// A component with this kind and name, where neither flags nor file say otherwise.
    pub(crate) fn component(&self, kind: Kind, name: &str) -> Builder {
        let kind = self.kind.map_or(kind, Kind::from);
        Component::builder(kind, self.name.as_deref().unwrap_or(name))
    }
}

impl From<SubsystemKind> for Kind {
    fn from(kind: SubsystemKind) -> Self {
        match kind {
            SubsystemKind::Vehicle => Self::Vehicle,
            SubsystemKind::Ocu => Self::OperatorControlUnit,
            SubsystemKind::Other => Self::OtherSubsystem,
        }
    }
}

/// Our own id: one component, so no wildcards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
struct OwnId(JausId);

impl FromStr for OwnId {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let whole = match text.matches('.').count() {
            1 => format!("{text}.1"),
            _ => text.to_owned(),
        };
        let id: JausId = whole.parse().map_err(|error| format!("{error}"))?;
        if id.is_unicast() {
            return Ok(Self(id));
        }
        Err(format!(
            "{id} is not one component: choose a subsystem from 1 to 65534, a node and a component from 1 to 254"
        ))
    }
}

impl TryFrom<String> for OwnId {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum SubsystemKind {
    /// Something that moves or acts
    Vehicle,
    /// An operator control unit
    Ocu,
    /// Anything else
    Other,
}

/// The keys of a settings file that are not a node's own.
#[derive(Debug, Default, Deserialize)]
struct Presentation {
    id: Option<OwnId>,
    name: Option<String>,
    kind: Option<SubsystemKind>,
}

impl Network {
    /// The settings of the file and the flags; `id` stands in where neither names one.
    pub(crate) fn settings(&self, id: JausId) -> Result<Settings, Failure> {
        let (presentation, mut node) = match &self.config {
            Some(path) => read(path)?,
            None => (
                Presentation::default(),
                Config::new(0, 0).or_any_free_port(),
            ),
        };
        let id = match (self.id, presentation.id) {
            (Some(OwnId(id)), _) | (None, Some(OwnId(id))) => id,
            (None, None) => id,
        };
        (node.subsystem, node.node) = (id.subsystem(), id.node());
        self.apply_to(&mut node);
        node.validate()
            .map_err(|error| Failure::new(error.to_string()))?;
        Ok(Settings {
            id,
            kind: self.kind.or(presentation.kind),
            name: self.name.clone().or(presentation.name),
            node,
        })
    }

    /// Lays the flags over what the file says.
    fn apply_to(&self, node: &mut Config) {
        if self.loopback {
            node.interfaces = Interfaces::Loopback;
        } else if !self.interface.is_empty() {
            node.interfaces = Interfaces::Only(self.interface.clone());
        }
        if let Some(port) = self.port {
            // Who names a port wants that one.
            node.port = port;
            node.port_taken = jaus::link::udp::PortTaken::Refuse;
        }
        if let Some(group) = self.group {
            node.group = group;
        }
        if let Some(ttl) = self.ttl {
            node.ttl = ttl;
        }
        node.peers.extend(&self.peer);
    }
}

/// Reads a settings file: our own keys are taken out, the others are the node's.
fn read(path: &Path) -> Result<(Presentation, Config), Failure> {
    let text = fs::read_to_string(path).map_err(|error| Failure::file(path, &error))?;
    let wrong = |error: toml::de::Error| Failure::new(format!("{}: {error}", path.display()));
    let mut table: toml::Table = toml::from_str(&text).map_err(wrong)?;
    let own = ["id", "name", "kind"]
        .into_iter()
        .filter_map(|key| table.remove_entry(key));
    let own: toml::Table = own.collect();
    let presentation = own.try_into().map_err(wrong)?;
    let node = table.try_into().map_err(wrong)?;
    Ok((presentation, node))
}

/// An id for a command that runs for a moment and needs none of its own choice: subsystems from
/// 60000 on, where nobody numbers vehicles. It differs from run to run, so that two people who use
/// the tool at the same time do not meet.
pub(crate) fn passing_id() -> JausId {
    let random = RandomState::new().build_hasher().finish();
    let [subsystem, node, component, ..] = random.to_le_bytes();
    JausId::new(
        60_000 + u16::from(subsystem),
        node % 254 + 1,
        component % 254 + 1,
    )
}
