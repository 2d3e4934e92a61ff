//! Network flags of all commands: our id, and the interfaces, addresses and peers to use.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::endpoint::{AccessEntry, Binding};
use jaus::link::custom::CustomLink;
#[cfg(unix)]
use jaus::link::junior::DEFAULT_FOLDER;
use jaus::link::local::record::Reason;
use jaus::link::udp::PortTaken;
use jaus::link::{Group, Interfaces};
use jaus::node::{Address, Config, Host, HostError, Node, PeerAddress, Port, Sender};
use jaus::rights::Grant;
use jaus_audit::AuditLog;

use super::audit::{AuditFlags, PlainLinks};
use super::failure::Failure;
use super::identity::OwnId;
pub use super::identity::{Identity, SubsystemKind};
use super::log_level::LogLevel;
use super::permissions::table_with;
#[cfg(feature = "secure")]
use super::secure::{Secure, SecureFlags};
use super::settings;

#[derive(Args, Debug)]
#[command(next_help_heading = "Network")]
#[expect(
    missing_docs,
    reason = "it would become the help text of the struct that flattens it"
)]
pub struct Network {
    /// Our id, SUBSYSTEM.NODE.COMPONENT or SUBSYSTEM.NODE (then component 1) [default: 101.1.1 for
    /// `jaus node`, 42.1.1 for `jaus judge`; one from subsystem 60000 on for other commands]
    #[arg(long, value_name = "ID")]
    id: Option<OwnId>,

    /// Use only this interface, by name or IPv4 address (repeatable) [default: all that are up]
    #[arg(long, value_name = "INTERFACE", conflicts_with = "loopback")]
    interface: Vec<String>,

    /// Use the loopback interface only; without --port, any free port
    #[arg(long)]
    loopback: bool,

    /// Our UDP port; 0 for any free one [default: 3794; if that is taken, `jaus node` fails and the
    /// other commands use any free one]
    #[arg(long)]
    port: Option<u16>,

    /// The multicast group for discovery, or off [default: 239.255.0.1:3794]
    #[arg(long, value_name = "ADDRESS")]
    group: Option<Group>,

    /// The TTL of multicast [default: 16]
    #[arg(long)]
    ttl: Option<u8>,

    /// Also send by unicast to this address, where multicast does not reach (repeatable)
    ///
    /// ADDRESS, ADDRESS:PORT or ID@ADDRESS:PORT, for example 192.168.7.2 or 102.255.255@192.168.7.2
    #[arg(long, value_name = "PEER")]
    peer: Vec<PeerAddress>,

    /// Accept messages only from these senders: a subsystem, a range of them, or a network, for
    /// example 60, 200-299 or 192.168.7.0/24 (repeatable)
    ///
    /// Subsystems and networks are two lists: with both, a sender must be on both.
    #[arg(long, value_name = "SENDERS")]
    allow: Vec<AccessEntry>,

    /// Refuse messages from these senders, also if --allow names them (repeatable)
    #[arg(long, value_name = "SENDERS")]
    deny: Vec<AccessEntry>,

    /// Accept messages with these ids only from this network, for example 60.255.255@192.168.7.2;
    /// 255 and 65535 are wildcards (repeatable)
    #[arg(long, value_name = "IDS@NETWORK")]
    bind: Vec<Binding>,

    /// What these ids may do that come by plain links: "60 control=127" or "65535.255.255 observe"; the
    /// first that matches counts, and others are refused (repeatable)
    ///
    /// Ids are not proven on plain links. `jaus keys trust --help` has the words.
    #[arg(long, value_name = "IDS RULES")]
    grant: Vec<Grant>,

    /// Decide on messages of one's own, too, by what the JSIDL file or directory states of them: for
    /// --grant, as --secure-jsidl for secure links (repeatable)
    #[arg(long, value_name = "PATH")]
    grant_jsidl: Vec<PathBuf>,

    /// Attach to this host's node (`jaus node --local`) instead of running our own; ADDRESS is its
    /// local link's [default: the usual place]
    #[arg(
        long,
        value_name = "ADDRESS",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "default",
        conflicts_with_all = [
            "interface", "loopback", "port", "group", "ttl", "peer", "allow", "deny", "bind",
            "grant", "grant_jsidl",
        ],
    )]
    attach: Option<Address>,

    /// Connect through a Junior node manager on this host instead of our own UDP; FOLDER holds
    /// Junior's sockets [default: /tmp]
    #[cfg(unix)]
    #[arg(
        long,
        value_name = "FOLDER",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = DEFAULT_FOLDER,
        conflicts_with_all = ["loopback", "attach"],
    )]
    junior: Option<PathBuf>,

    /// Read settings from a TOML file; flags take precedence
    ///
    /// For example:
    ///   id = "101.1.1"                  # our id: for `jaus node` only
    ///   name = "Rover"
    ///   kind = "vehicle"
    ///   interfaces = ["eth0"]           # or "all", or "loopback"
    ///   port = 3794
    ///   port_taken = "refuse"           # or "use-free"
    ///   group = "239.255.0.1:3794"      # or "off"
    ///   ttl = 16
    ///   peers = ["192.168.7.2", "102.255.255@192.168.7.3:3795"]
    #[arg(long, value_name = "FILE", verbatim_doc_comment)]
    config: Option<PathBuf>,

    #[cfg(feature = "secure")]
    #[command(flatten)]
    secure: SecureFlags,

    #[command(flatten)]
    audit: AuditFlags,
}

impl Network {
    /// For a node that others are to find: its component's id, the identity from the settings file,
    /// and the settings. `default` is the id if none is chosen.
    pub fn for_node(&self, default: JausId) -> Result<(JausId, Identity, Config), Failure> {
        let (identity, node) = self.settings()?;
        let id = self.chosen_id(&identity, &node).unwrap_or(default);
        Ok((id, identity, self.with_flags(node, id)?))
    }

    /// For the examination of a node before its start: its id, if chosen, and its settings with another.
    pub fn for_examination(&self, passing: JausId) -> Result<(Option<JausId>, Config), Failure> {
        let (identity, node) = self.settings()?;
        let id = self.chosen_id(&identity, &node);
        Ok((id, self.with_flags(node, passing)?))
    }

    /// Whether a settings file is chosen.
    pub const fn has_file(&self) -> bool {
        self.config.is_some()
    }

    /// The id from a flag or the file.
    fn chosen_id(&self, identity: &Identity, node: &Config) -> Option<JausId> {
        // A file may also set the node's own keys for its id.
        let of_node = (node.subsystem, node.node) != (0, 0);
        let of_node = of_node.then(|| OwnId(JausId::new(node.subsystem, node.node, 1)));
        let id = self.id.or(identity.id).or(of_node);
        id.map(|OwnId(id)| id)
    }

    /// For a short-lived command beside other nodes: a temporary id, whatever the file says, and
    /// any free port unless a flag names one.
    fn for_a_moment(&self) -> Result<(JausId, Config), Failure> {
        self.for_a_moment_as(passing_id())
    }

    /// The same, for a command with a default id.
    fn for_a_moment_as(&self, usual: JausId) -> Result<(JausId, Config), Failure> {
        let (_, node) = self.settings()?;
        let id = self.id.map_or(usual, |OwnId(id)| id);
        let node = self.with_flags(node.or_any_free_port(), id)?;
        Ok((id, node))
    }

    /// The same, for a command that reads its node's counters and therefore runs its own node.
    pub fn for_own_node(&self, command: &str) -> Result<(JausId, Config), Failure> {
        self.for_own_node_as(passing_id(), command)
    }

    /// The same, for a command with a default id.
    pub fn for_own_node_as(
        &self,
        usual: JausId,
        command: &str,
    ) -> Result<(JausId, Config), Failure> {
        if self.attach.is_some() {
            return Err(Failure::new(format!(
                "`{command}` runs its own node: omit --attach"
            )));
        }
        self.for_a_moment_as(usual)
    }

    /// The settings file, if one is chosen.
    #[must_use]
    pub fn file(&self) -> Option<&Path> {
        self.config.as_deref()
    }

    /// The log level of the settings file.
    ///
    /// # Errors
    /// An unreadable file.
    pub fn log_level(&self) -> Result<Option<LogLevel>, Failure> {
        let (identity, _) = self.settings()?;
        Ok(identity.log_level)
    }

    /// Attaches a permanent component: to the host's node or to its own. `usual` is the id if none
    /// is chosen; on the host's node only its component number counts.
    ///
    /// `for_node` changes the settings of a node of our own, which also gets the `links`.
    ///
    /// Waits for the host's node without a timeout: components may be started in any order.
    ///
    /// # Errors
    /// An invalid flag or file, a node that cannot be started, or a node that refuses the
    /// component; links for the host's node.
    pub async fn join(
        &self,
        usual: JausId,
        for_node: impl FnOnce(&mut Config),
        links: Vec<Box<dyn CustomLink>>,
    ) -> Result<Place, Failure> {
        let Some(address) = &self.attach else {
            let (id, identity, mut config) = self.for_node(usual)?;
            for_node(&mut config);
            config.validate().map_err(Failure::of)?;
            let config = config.or_any_free_port();
            let node = self.start_with(config, links, self.audit()?)?;
            let port = node.attach(id.component()).map_err(Failure::of)?;
            return Ok(Place {
                port,
                identity,
                stay: Stay::OnOurs(node),
            });
        };
        if !links.is_empty() {
            return Err(Failure::new(
                "this program opens links of its own, so it runs its own node: omit --attach",
            ));
        }
        let (identity, node) = self.settings()?;
        let id = self.chosen_id(&identity, &node);
        let host = Host::at(address.clone());
        let port = wait_for_host(&host, id, usual.component()).await?;
        let stay = Stay::AtHost(port.sender());
        Ok(Place {
            port,
            identity,
            stay,
        })
    }

    /// Attaches a component for a short-lived command, to the host's node or to its own.
    pub async fn join_for_a_moment(&self) -> Result<(Port, Stay), Failure> {
        let Some(address) = &self.attach else {
            let (id, config) = self.for_a_moment()?;
            let node = self.start(config)?;
            let port = node.attach(id.component()).map_err(Failure::of)?;
            return Ok((port, Stay::OnOurs(node)));
        };
        let host = Host::at(address.clone());
        let port = match self.id {
            Some(OwnId(id)) => host.attach_as(id).await,
            None => attach_somewhere(&host).await,
        };
        let port = port.map_err(Failure::of)?;
        let stay = Stay::AtHost(port.sender());
        Ok((port, stay))
    }

    /// Starts the component of a short-lived command, which only asks others.
    ///
    /// # Errors
    /// As [`join_for_a_moment`](Self::join_for_a_moment).
    pub async fn component_for_a_moment(
        &self,
        command: &str,
    ) -> Result<(Component, Sender, Stay), Failure> {
        let (port, stay) = self.join_for_a_moment().await?;
        let sender = port.sender();
        // On the host's node it names only itself, not the subsystem.
        let subsystem = if stay.is_guest() { "" } else { command };
        let component = Component::builder(Kind::OtherSubsystem, subsystem)
            .component_name(command)
            .live_on(port)
            .map_err(Failure::of)?;
        Ok((component, sender, stay))
    }

    /// The settings of the secure link, if flags or the settings file ask for one.
    ///
    /// # Errors
    /// An unreadable file, or an invalid table.
    #[cfg(feature = "secure")]
    pub fn secure(&self) -> Result<Option<Secure>, Failure> {
        self.secure.settings(self.file())
    }

    /// The audit log that flags or the settings file name, if any. Services open it, for no two programs can.
    ///
    /// # Errors
    /// An unreadable settings file, an invalid table, or a log that cannot be written.
    pub fn audit(&self) -> Result<Option<AuditLog>, Failure> {
        self.audit.log(self.file())
    }

    /// Refuses a secure link that listens, for a command that runs several nodes or none.
    ///
    /// # Errors
    /// If flags or the settings file name such a link.
    pub fn require_dialling(&self, command: &str) -> Result<(), Failure> {
        #[cfg(feature = "secure")]
        if self.secure()?.is_some_and(|it| !it.only_dials()) {
            return Err(Failure::new(format!(
                "`{command}` connects to the peer: name it by --secure-peer, and omit --secure-listen, \
                 --secure-announce, or choose a settings file without them"
            )));
        }
        #[cfg(not(feature = "secure"))]
        let _ = command;
        Ok(())
    }

    /// Starts a service's node, with a secure link and the audit log if flags or the settings file name them.
    ///
    /// # Errors
    /// A key, trust file or log that cannot be used, or a node that cannot be started.
    pub fn start_service(&self, config: Config) -> Result<Node, Failure> {
        self.start_with(config, Vec::new(), self.audit()?)
    }

    /// The same for a tool. It opens no audit log: a service with the same settings file writes to that.
    ///
    /// # Errors
    /// As [`start_service`](Self::start_service); a flag that names an audit log.
    pub fn start(&self, config: Config) -> Result<Node, Failure> {
        self.audit.refuse_flag()?;
        self.start_with(config, Vec::new(), None)
    }

    fn start_with(
        &self,
        config: Config,
        links: Vec<Box<dyn CustomLink>>,
        log: Option<AuditLog>,
    ) -> Result<Node, Failure> {
        #[cfg(feature = "secure")]
        let (config, links) = match self.secure()? {
            Some(secure) => {
                let config = Secure::restrict(config)?;
                let node = JausId::new(config.subsystem, config.node, 0);
                let link: Box<dyn CustomLink> = Box::new(secure.open(node, log.clone())?);
                (config, links.into_iter().chain([link]).collect())
            }
            None => (config, links),
        };
        let node = Node::start_with(config, links).map_err(Failure::of)?;
        if let Some(log) = log {
            node.record_decisions(PlainLinks(log));
        }
        Ok(node)
    }

    /// The settings of the file, or the defaults.
    fn settings(&self) -> Result<(Identity, Config), Failure> {
        match &self.config {
            Some(path) => settings::read(path),
            None => Ok((Identity::default(), Config::new(0, 0))),
        }
    }

    /// Applies id and flags to the settings.
    fn with_flags(&self, mut node: Config, id: JausId) -> Result<Config, Failure> {
        (node.subsystem, node.node) = (id.subsystem(), id.node());
        if self.loopback {
            node.interfaces = Interfaces::Loopback;
            node.port = 0;
        } else if !self.interface.is_empty() {
            node.interfaces = Interfaces::Only(self.interface.clone());
        }
        if let Some(port) = self.port {
            // A chosen port is not replaced by a free one.
            node.port = port;
            node.port_taken = PortTaken::Refuse;
        }
        node.group = self.group.unwrap_or(node.group);
        node.ttl = self.ttl.unwrap_or(node.ttl);
        node.peers.extend(&self.peer);
        for entry in &self.allow {
            node.access.allow(entry.clone());
        }
        for entry in &self.deny {
            node.access.deny(entry.clone());
        }
        node.access.bind.extend(&self.bind);
        node.access.grants.extend_from_slice(&self.grant);
        node.access.jsidl.extend_from_slice(&self.grant_jsidl);
        node.access.table = table_with(&node.access.jsidl)?;
        #[cfg(unix)]
        if self.junior.is_some() {
            node.junior.clone_from(&self.junior);
        }
        node.validate().map_err(Failure::of)?;
        Ok(node)
    }
}

/// What a user can do when a component does not answer.
pub const REMEDY: &str = "List components with `jaus discover`, choose the network with \
    --interface, or name a host that multicast does not reach with --peer; `jaus doctor` finds out \
    what is wrong";

/// Parses the id of a single component.
pub fn one_component(text: &str) -> Result<JausId, String> {
    let id: JausId = text.parse().map_err(|error| format!("{error}"))?;
    match id.is_unicast() {
        true => Ok(id),
        false => Err(format!(
            "{id} is not a single component: choose one that `jaus discover` lists"
        )),
    }
}

/// An attached component.
pub struct Place {
    /// Its port on the node.
    pub port: Port,
    /// Identity of its subsystem, from the settings file.
    pub identity: Identity,
    /// The node that it is attached to.
    pub stay: Stay,
}

/// Attaches to the host's node as soon as it exists and the id is free: a crashed predecessor may
/// still be attached for a moment.
#[expect(
    clippy::disallowed_methods,
    reason = "waits for processes in real time"
)]
async fn wait_for_host(host: &Host, id: Option<JausId>, usual: u8) -> Result<Port, Failure> {
    const PAUSE: Duration = Duration::from_millis(100);
    const LONGEST_PAUSE: Duration = Duration::from_secs(1);
    const TAKEN: u32 = 10;
    let mut pause = PAUSE;
    let (mut taken, mut told) = (0, false);
    loop {
        let attached = match id {
            Some(id) => host.attach_as(id).await,
            None => host.attach(usual).await,
        };
        let error = match attached {
            Ok(port) => return Ok(port),
            Err(error) => error,
        };
        match &error {
            HostError::Link(_) => {}
            HostError::Refused {
                reason: Reason::Taken,
                ..
            } if taken < TAKEN => taken += 1,
            _ => return Err(Failure::of(error)),
        }
        if !std::mem::replace(&mut told, true) {
            tracing::info!("waiting for the node of this host: {error}");
        }
        tokio::time::sleep(pause).await;
        pause = (2 * pause).min(LONGEST_PAUSE);
    }
}

/// The node of a short-lived command's component.
pub enum Stay {
    /// A node of our own.
    OnOurs(Node),
    /// The node of the host.
    AtHost(Sender),
}

impl Stay {
    /// The node, if it runs in this process.
    #[must_use]
    pub fn node(&self) -> Option<Node> {
        match self {
            Self::OnOurs(node) => Some(node.clone()),
            Self::AtHost(_) => None,
        }
    }

    /// Whether the node belongs to another process.
    pub const fn is_guest(&self) -> bool {
        matches!(self, Self::AtHost(_))
    }

    /// Ends it, once the component is dropped.
    #[expect(clippy::disallowed_methods, reason = "ends in real time")]
    pub async fn end(self) {
        match self {
            Self::OnOurs(node) => node.shutdown().await,
            Self::AtHost(sender) => {
                // An unresponsive node needs no goodbye.
                let _ = tokio::time::timeout(FAREWELL, sender.disconnected()).await;
            }
        }
    }
}

const FAREWELL: Duration = Duration::from_millis(250);

/// Attaches under any free number on the host's node, for a command that needs no particular id.
async fn attach_somewhere(host: &Host) -> Result<Port, HostError> {
    const TRIES: usize = 5;
    for _ in 1..TRIES {
        match host.attach(passing_id().component()).await {
            Err(HostError::Refused {
                reason: Reason::Taken,
                ..
            }) => {}
            result => return result,
        }
    }
    host.attach(passing_id().component()).await
}

/// A temporary id: from subsystem 60000 on, where no vehicles are numbered. It differs from call to
/// call, so that simultaneous commands do not collide.
#[must_use]
pub fn passing_id() -> JausId {
    let random = RandomState::new().build_hasher().finish();
    let [subsystem, node, component, ..] = random.to_le_bytes();
    JausId::new(
        60_000 + u16::from(subsystem),
        node % 254 + 1,
        component % 254 + 1,
    )
}
