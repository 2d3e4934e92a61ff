//! A running node: links, endpoint and attached components on tokio.
//!
//! A node runs in one task. On a current-thread runtime, components, endpoint and sockets share one
//! thread, which is the fastest setup. Only rare operations that may block run on a blocking
//! thread: listing the host's interfaces, and reopening sockets and serial ports.
//!
//! ```
//! use bytes::Bytes;
//! use jaus::address::JausId;
//! use jaus::endpoint::Outgoing;
//! use jaus::node::{Config, Node};
//!
//! # #[tokio::main(flavor = "current_thread")]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // Two nodes on this host, which find each other by multicast.
//! let vehicle = Node::start(Config::loopback(101, 1))?;
//! let operator = Node::start(Config::loopback(102, 1))?;
//! let mut driver = vehicle.attach(33)?;
//! let mut console = operator.attach(1)?;
//!
//! let query_heartbeat = Bytes::from_static(&[0x02, 0x22]);
//! console.send(Outgoing::new(console.id(), driver.id(), query_heartbeat))?;
//!
//! let query = driver.recv().await.ok_or("the node has stopped")?;
//! assert_eq!(query.source, JausId::new(102, 1, 1));
//! let report_heartbeat = Bytes::from_static(&[0x02, 0x42]);
//! driver.send(Outgoing::new(driver.id(), query.source, report_heartbeat))?;
//! assert!(console.recv().await.is_some());
//!
//! vehicle.shutdown().await;
//! operator.shutdown().await;
//! # Ok(())
//! # }
//! ```

mod awaiting;
mod clock;
mod components;
mod config;
mod core;
mod driver;
mod error;
mod events;
mod follower;
mod host;
mod link;
mod links;
mod local;
mod mailbox;
mod port;
mod progress;
mod resident;
mod tap;

use std::net::SocketAddr;
#[cfg(unix)]
use std::path::PathBuf;
use std::sync::Arc;

pub use self::clock::{now, sleep_until, time_of_day};
pub use self::components::{ComponentEvent, Departure};
pub use self::config::{
    Config, ConfigError, Delivery, LocalUser, LocalUserError, PeerAddress, Tcp, units,
};
pub use self::error::{HostError, SendError, StartError, Undelivered};
pub use self::events::{DecisionRecorder, EventStream, Recorder};
pub use self::host::{Host, HostEvent, HostEvents};
pub use self::mailbox::{MailboxCounters, MailboxLimits};
pub use self::port::{Port, Sender};
pub use self::resident::Resident;
pub use self::tap::{Content, Passage, Tap, Tapped, Way};
pub use crate::endpoint::{AttachError, Limits, Routing};
pub use crate::link::local::{Address, Local, Process};

use self::core::Shared;
use self::driver::Driver;
use self::follower::follow;
use self::link::Link;
use self::links::Links;
use self::local::serve;
use crate::address::JausId;
use crate::counters::Count;
use crate::endpoint::{self, Event, LinkId};
use crate::link::custom::CustomLink;
use crate::link::interface::Changes;
#[cfg(unix)]
use crate::link::junior;
use crate::link::local::Listener;
#[cfg(feature = "serial")]
use crate::link::serial;
use crate::link::{Interface, tcp, udp};

/// A handle to a running node. Cheap to clone.
///
/// The node runs until [`shutdown`](Self::shutdown), or until its last handle and its last
/// [`Port`] are dropped.
///
/// ```
/// use jaus::node::{Config, Node};
///
/// # #[tokio::main(flavor = "current_thread")]
/// # async fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let node = Node::start(Config::loopback(101, 1))?;
/// let driver = node.attach(33)?;
/// assert_eq!(driver.id().to_string(), "101.1.33");
/// assert!(!node.links().is_empty());
/// node.shutdown().await;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Node {
    guard: Arc<Guard>,
}

/// Stops the node when the last handle and the last port are gone.
#[derive(Debug)]
struct Guard(Arc<Shared>);

impl Drop for Guard {
    fn drop(&mut self) {
        self.0.lock().stop();
    }
}

impl Node {
    /// Opens the links and starts the node's task on the current tokio runtime.
    ///
    /// # Errors
    /// [`StartError`] gives the reason and the remedy. Nothing is left running.
    pub fn start(config: Config) -> Result<Self, StartError> {
        Self::start_with(config, Vec::new())
    }

    /// Starts the node with links of other crates, in addition to those of its configuration. An
    /// empty list of interfaces then leaves it with these alone.
    ///
    /// # Errors
    /// As [`start`](Self::start).
    pub fn start_with(config: Config, links: Vec<Box<dyn CustomLink>>) -> Result<Self, StartError> {
        config.validate()?;
        let runtime = tokio::runtime::Handle::try_current().map_err(|_| StartError::NoRuntime)?;
        let config = Arc::new(config);
        let links = Links::open(&config, links)?;
        let listener = match &config.local {
            Local::Off => None,
            Local::At(address) => Some(Listener::open(address, config.local_group)?),
        };
        let follows = links.follows();
        let local_place = listener.as_ref().map(Listener::place);
        let shared = Arc::new(Shared::new(config, links, local_place));
        runtime.spawn(Driver(shared.clone()).run());
        if follows {
            runtime.spawn(follow(shared.clone(), Changes::open()));
        }
        if let Some(listener) = listener {
            let place = listener.place();
            tracing::info!(place, "components of this host may attach");
            let listening = shared.listening.subscribe();
            runtime.spawn(serve(shared.clone(), listening, listener));
        }
        let guard = Arc::new(Guard(shared));
        Ok(Self { guard })
    }

    /// The configuration that it was started with.
    #[must_use]
    pub fn config(&self) -> &Config {
        &self.shared().config
    }

    /// The local address where component processes of this host may attach, if enabled.
    #[must_use]
    pub fn local_place(&self) -> Option<&str> {
        self.shared().local_place.as_deref()
    }

    /// Attaches a component, by its number within the node, 1 to 254.
    ///
    /// # Errors
    /// If the number does not name a single component, or is already attached.
    pub fn attach(&self, component: u8) -> Result<Port, AttachError> {
        let config = self.config();
        self.attach_as(JausId::new(config.subsystem, config.node, component))
    }

    /// Attaches a component under any id, including one of another subsystem or node: for gateways,
    /// which represent components elsewhere.
    ///
    /// # Errors
    /// If the id does not name a single component, or is already attached, here or (with
    /// [`Config::junior`]) as another client of Junior.
    pub fn attach_as(&self, id: JausId) -> Result<Port, AttachError> {
        let mailbox = self.shared().attach(id, None)?;
        Ok(Port::new(id, mailbox, self.guard.clone()))
    }

    /// The open UDP links; none after the node has stopped. Reads the host's socket table, so do
    /// not call it many times a second.
    #[must_use]
    pub fn links(&self) -> Vec<LinkReport> {
        let report = |(link, udp): (LinkId, &udp::UdpLink)| {
            let report = LinkReport {
                link,
                interface: udp.interface().clone(),
                local: udp.local(),
                group: udp.group(),
                counters: *udp.counters(),
                kernel_drops: None,
            };
            (report, udp.inodes().to_vec())
        };
        let (mut reports, inodes): (Vec<_>, Vec<_>) =
            self.shared().lock().links.udp().map(report).unzip();
        // Without the lock, which must not be held during system calls for information.
        let drops = udp::kernel_drops(inodes.iter().map(Vec::as_slice));
        for (report, drops) in reports.iter_mut().zip(drops) {
            report.kernel_drops = drops;
        }
        reports
    }

    /// The TCP connections, if configured and the node has not stopped.
    #[must_use]
    pub fn tcp(&self) -> Option<TcpReport> {
        let core = self.shared().lock();
        core.links.open.iter().find_map(|(&id, link)| match link {
            Link::Tcp(link) => Some(TcpReport {
                link: id,
                listening: link.local(),
                connections: link.connections().collect(),
                counters: link.counters(),
            }),
            _ => None,
        })
    }

    /// The link through Junior's node manager, if configured and the node has not stopped.
    #[cfg(unix)]
    #[must_use]
    pub fn junior(&self) -> Option<JuniorReport> {
        let core = self.shared().lock();
        core.links.open.iter().find_map(|(&id, link)| match link {
            Link::Junior(link) => Some(JuniorReport {
                link: id,
                folder: link.folder().to_owned(),
                is_registered: link.is_registered(),
                counters: link.counters(),
            }),
            _ => None,
        })
    }

    /// The serial lines, in the order of the configuration; none after the node has stopped.
    #[cfg(feature = "serial")]
    #[must_use]
    pub fn serial_lines(&self) -> Vec<SerialReport> {
        let core = self.shared().lock();
        let report = |(&id, link): (&LinkId, &Link)| match link {
            Link::Serial(line) => Some(SerialReport {
                link: id,
                settings: line.settings().clone(),
                is_open: line.is_open(),
                counters: line.counters(),
            }),
            _ => None,
        };
        core.links.open.iter().filter_map(report).collect()
    }

    /// The links of other crates ([`start_with`](Self::start_with)); none after the node has
    /// stopped.
    #[must_use]
    pub fn custom_links(&self) -> Vec<CustomReport> {
        let core = self.shared().lock();
        let report = |(&id, link): (&LinkId, &Link)| match link {
            Link::Custom(link) => Some(CustomReport {
                link: id,
                name: link.name().to_owned(),
                counters: link.counters(),
            }),
            _ => None,
        };
        core.links.open.iter().filter_map(report).collect()
    }

    /// The peers whose addresses are known, in order of their ids.
    #[must_use]
    pub fn peers(&self) -> Vec<endpoint::Peer> {
        self.shared().lock().endpoint.peers().collect()
    }

    /// What the endpoint has received, sent and dropped, with the reasons.
    #[must_use]
    pub fn counters(&self) -> endpoint::Counters {
        self.shared().lock().endpoint.counters().clone()
    }

    /// The attached components, in order of their ids.
    #[must_use]
    pub fn components(&self) -> Vec<ComponentReport> {
        self.shared().lock().components.reports()
    }

    /// Events from now on about components that attach, leave, or stop reading.
    #[must_use]
    pub fn component_events(&self) -> ComponentEvents {
        self.shared().lock().components.events.subscribe()
    }

    /// A tap on all traffic of the node from now on. It holds up to `limit` unread passages (at
    /// least 1, and at most 16 MiB). Beyond that the oldest are dropped and counted.
    #[must_use]
    pub fn tap(&self, limit: usize) -> Tap {
        self.shared().lock().components.taps.open(limit)
    }

    /// The name of a link: its interface, its serial device, `tcp` or `junior`. `None` if the link
    /// is gone.
    #[must_use]
    pub fn link_name(&self, link: LinkId) -> Option<String> {
        let core = self.shared().lock();
        core.links.open.get(&link).map(Link::name)
    }

    /// Events from now on: peers learned and moved, id conflicts, acknowledgements.
    #[must_use]
    pub fn events(&self) -> Events {
        self.shared().lock().events.subscribe()
    }

    /// From now on, passes each decision on a message of a plain link to a recorder, for an audit log:
    /// refused messages, and what concerns control, emergencies and the configuration of components.
    /// Links with sessions record their own. It replaces an earlier recorder.
    pub fn record_decisions(&self, recorder: impl DecisionRecorder + 'static) {
        let recorder = Recorder::new(recorder);
        self.shared().lock().record_decisions(recorder);
    }

    /// Stops the node. First the components of this process stop what they move and release what
    /// they control (1 s at most). Then the node sends queued messages and closes its connections
    /// properly (0.25 s at most for both), and closes the links. Every [`Port::recv`] ends once its
    /// mailbox is read.
    pub async fn shutdown(self) {
        let shared = self.shared();
        shared.residents.close().await;
        shared.lock().stop();
        shared.stopped().await;
        shared.listening.closed().await;
    }

    fn shared(&self) -> &Shared {
        &self.guard.0
    }
}

/// The current state of one component of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ComponentReport {
    /// Its id.
    pub id: JausId,
    /// Its process; `None` for the node's own process.
    pub process: Option<Process>,
    /// Counts of its messages.
    pub mailbox: MailboxCounters,
}

/// The current state of a node's TCP connections.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TcpReport {
    /// Their number in [`Path`](endpoint::Path).
    pub link: LinkId,
    /// The address that accepts connections, if any.
    pub listening: Option<SocketAddr>,
    /// The established connections, in order of their remote addresses.
    pub connections: Vec<tcp::ConnectionReport>,
    /// Counts of connections and messages.
    pub counters: tcp::Counters,
}

/// The current state of a node's link through Junior's node manager.
#[cfg(unix)]
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JuniorReport {
    /// Its number in [`Path`](endpoint::Path).
    pub link: LinkId,
    /// The folder of Junior's sockets.
    pub folder: PathBuf,
    /// Whether the node manager is present and has accepted all components.
    pub is_registered: bool,
    /// Counts of traffic.
    pub counters: junior::Counters,
}

/// The current state of one serial line of a node.
#[cfg(feature = "serial")]
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SerialReport {
    /// Its number in [`Path`](endpoint::Path).
    pub link: LinkId,
    /// Its settings.
    pub settings: serial::Settings,
    /// Whether the port is open at present.
    pub is_open: bool,
    /// Counts of traffic.
    pub counters: serial::Counters,
}

/// The current state of one link of another crate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CustomReport {
    /// Its number in [`Path`](endpoint::Path).
    pub link: LinkId,
    /// Its name.
    pub name: String,
    /// Its counters.
    pub counters: Vec<Count>,
}

/// The current state of one UDP link of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LinkReport {
    /// Its number in [`Path`](endpoint::Path).
    pub link: LinkId,
    /// Its interface.
    pub interface: Interface,
    /// The address that it sends from, and that peers reply to.
    pub local: SocketAddr,
    /// The multicast group that it has joined, or the broadcast address that it uses instead.
    pub group: Option<SocketAddr>,
    /// Counts of traffic.
    pub counters: udp::Counters,
    /// Datagrams that the kernel dropped because the node did not read them in time, if it reports
    /// them.
    pub kernel_drops: Option<u64>,
}

/// A stream of a node's [`Event`]s, until the node is gone.
pub type Events = EventStream<Event>;

/// A stream of the events of a node's components, until the node is gone.
pub type ComponentEvents = EventStream<ComponentEvent>;
