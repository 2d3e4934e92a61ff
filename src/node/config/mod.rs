//! The configuration of a node: from code, from flags, or (feature `serde`) from a TOML file such
//! as
//!
//! ```toml
//! subsystem = 101
//! node = 1
//! interfaces = ["eth0", "10.0.3.2"]    # or "all" (the default), or "loopback"
//! ip = "4"                             # the default; or "6", or "both"
//! port = 3794                          # 0: any free one
//! port_taken = "use-free"              # or "refuse" (the default)
//! group = "239.255.0.1:3794"           # or "off"
//! group6 = "[ff12::efff:1]:3794"       # the same for IPv6
//! broadcast = "auto"                   # where there is no multicast; or "on", or "off"
//! ttl = 16
//! peers = ["192.168.7.2", "192.168.7.3:3795", "[fe80::2%eth0]:3794"]
//! local = "default"                    # or a path, or "off" (the default)
//! local_group = true                   # also for processes of this process's group
//! local_users = ["camera observe"]     # what the processes of each user may do
//! junior = "/tmp"                      # through Junior's node manager in the place of UDP (Unix)
//! max_message = "4MiB"                 # sizes: octets, or with a unit (see `units`)
//!
//! [mailbox]
//! messages = 1024
//! octets = "2MiB"
//!
//! [tcp]                                # by default there are no connections
//! listen = "0.0.0.0"                   # port 3794; or "10.0.0.5:3795"
//! connect = ["10.0.0.7", "102.255.255@10.0.0.8:3794"]
//!
//! [[profile]]                          # what a peer is that cannot be recognised (see `peer`)
//! id = "7.255.255"
//! profile = "jaus++"
//!
//! [[serial]]                           # one for each serial line (feature `serial`)
//! device = "/dev/ttyUSB0"
//! baud = 115200                        # the default
//! parity = "none"                      # the default; or "odd", "even"
//! stop_bits = 1                        # the default; or 2
//! flow_control = "none"                # the default; or "hardware"
//! ```
//!
//! The larger sections have their own files here.

mod delivery;
mod error;
mod limits;
mod local_user;
mod peer;
mod tcp;
#[cfg(test)]
mod tests;
pub mod units;

use std::net::SocketAddr;
#[cfg(unix)]
use std::path::PathBuf;

pub use self::delivery::Delivery;
pub use self::error::ConfigError;
use self::error::{in_range, not_zero};
pub use self::local_user::{LocalUser, LocalUserError};
pub use self::peer::PeerAddress;
pub use self::tcp::Tcp;
use super::mailbox::MailboxLimits;
use crate::address::JausId;
use crate::endpoint::{self, Access, Limits, PAYLOAD_LIMITS, Pacing, Routing};
use crate::link::local::{Address, Local};
#[cfg(feature = "serial")]
use crate::link::serial::Settings as SerialLine;
use crate::link::udp::{self, Broadcasts, PortTaken};
use crate::link::{Group, Group6, Interfaces, Ip};
use crate::peer::Assignment;

const LONGEST_MESSAGE: usize = 16 << 20;
/// Sequence numbers have 16 bits, and 0 is not used.
const MOST_FRAGMENTS: usize = u16::MAX as usize;

/// All settings of a node. Everything except the id has a default.
///
/// ```
/// use jaus::node::Config;
///
/// let config = Config::new(101, 1).interfaces(["eth0"]).peer("192.168.7.2".parse()?);
/// assert_eq!(config.validate(), Ok(()));
/// # Ok::<(), jaus::node::ConfigError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
#[non_exhaustive]
pub struct Config {
    /// The subsystem number, 1 to 65534: the vehicle or station that this node is part of.
    pub subsystem: u16,
    /// The node number within the subsystem, 1 to 254.
    pub node: u8,
    /// The interfaces to open UDP links on. An empty list disables UDP, which is allowed with TCP
    /// connections, serial lines or a local address.
    pub interfaces: Interfaces,
    /// The IP versions to use on them.
    pub ip: Ip,
    /// The UDP port of this node; 0 selects any free one.
    pub port: u16,
    /// What to do if the port is taken.
    pub port_taken: PortTaken,
    /// The multicast group with which nodes find each other.
    pub group: Group,
    /// The same with IPv6.
    pub group6: Group6,
    /// When to use a network's broadcast address instead of the group, or in addition to it.
    pub broadcast: Broadcasts,
    /// The TTL of multicast datagrams; 0 keeps them on this host.
    pub ttl: u8,
    /// The receive buffer to request from the kernel for each socket, in octets.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "units::read_size"))]
    pub receive_buffer: usize,
    /// Peers that also get all multicast traffic by unicast.
    pub peers: Vec<PeerAddress>,
    /// The limit of payload octets in one packet, 64 to 4079. The default, 1425, keeps a packet
    /// within one Ethernet frame.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "units::read_size"))]
    pub payload_limit: usize,
    /// The longest message to send or receive, in octets, up to 16 MiB. Messages longer than
    /// `payload_limit` travel in fragments.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "units::read_size"))]
    pub max_message: usize,
    /// The mailbox limits of each component.
    pub mailbox: MailboxLimits,
    /// The local address where component processes of this host may attach, if any.
    pub local: Local,
    /// Whether processes of this process's group may attach there too, so that the parts of a vehicle
    /// run as users of their own. Concerns sockets of the file system.
    pub local_group: bool,
    /// What the programs of each user may do that attach there, in the words of
    /// [`rights`](crate::rights): `["planner control=255", "camera 101.1.40 observe"]`, for any
    /// user `*`. The first entry for a user counts, and a user without one may not attach. Without entries,
    /// and for root and the user of this process, there are no limits.
    pub local_users: Vec<LocalUser>,
    /// The folder of Junior's sockets, `/tmp` in a default installation. If set, the components are
    /// clients of the node manager of a Junior on this host, and the node opens no UDP itself:
    /// Junior determines interfaces, port, group and peers.
    #[cfg(unix)]
    pub junior: Option<PathBuf>,
    /// TCP connections, to and from other nodes.
    pub tcp: Tcp,
    /// Serial lines.
    #[cfg(feature = "serial")]
    pub serial: Vec<SerialLine>,
    /// Acknowledged messages, packing and pacing.
    pub delivery: Delivery,
    /// The profiles of peers that cannot be recognised by their messages.
    pub profile: Vec<Assignment>,
    /// Whether to forward messages for other nodes between the links.
    pub routing: Routing,
    /// Which senders this node accepts.
    pub access: Access,
    /// Limits of what this node accepts from others.
    pub limits: Limits,
}

impl Default for Config {
    fn default() -> Self {
        Self::new(0, 0)
    }
}

impl Config {
    /// The default settings: all interfaces, port 3794, group 239.255.0.1:3794.
    #[must_use]
    pub fn new(subsystem: u16, node: u8) -> Self {
        let udp = udp::Settings::default();
        let endpoint = endpoint::Config::default();
        Self {
            subsystem,
            node,
            interfaces: Interfaces::All,
            ip: Ip::default(),
            port: udp.port,
            port_taken: udp.port_taken,
            group: udp.group,
            group6: udp.group6,
            broadcast: udp.broadcast,
            ttl: udp.ttl,
            receive_buffer: udp.receive_buffer,
            peers: Vec::new(),
            payload_limit: endpoint.payload_limit,
            max_message: endpoint.max_message,
            mailbox: MailboxLimits::default(),
            local: Local::Off,
            local_group: false,
            local_users: Vec::new(),
            #[cfg(unix)]
            junior: None,
            tcp: Tcp::default(),
            #[cfg(feature = "serial")]
            serial: Vec::new(),
            delivery: Delivery::default(),
            profile: Vec::new(),
            routing: Routing::default(),
            access: Access::default(),
            limits: Limits::default(),
        }
    }

    /// A node that stays on this host, on any free port. It needs no network and no privileges, and
    /// any number of them run side by side.
    #[must_use]
    pub fn loopback(subsystem: u16, node: u8) -> Self {
        Self {
            interfaces: Interfaces::Loopback,
            port: 0,
            ..Self::new(subsystem, node)
        }
    }

    /// Uses only these interfaces, each given by name or address.
    #[must_use]
    pub fn interfaces<S: Into<String>>(mut self, only: impl IntoIterator<Item = S>) -> Self {
        self.interfaces = Interfaces::Only(only.into_iter().map(Into::into).collect());
        self
    }

    /// Uses this UDP port; 0 selects any free one.
    #[must_use]
    pub const fn port(mut self, port: u16) -> Self {
        self.port = port;
        self
    }

    /// Uses any free port if the configured one is taken.
    #[must_use]
    pub const fn or_any_free_port(mut self) -> Self {
        self.port_taken = PortTaken::UseFree;
        self
    }

    /// Uses this multicast group, or none.
    #[must_use]
    pub const fn group(mut self, group: Group) -> Self {
        self.group = group;
        self
    }

    /// Serves component processes of this host at this address.
    #[must_use]
    pub fn local(mut self, address: Address) -> Self {
        self.local = Local::At(address);
        self
    }

    /// Makes the components clients of the Junior on this host with its sockets in this folder.
    #[cfg(unix)]
    #[must_use]
    pub fn junior(mut self, folder: impl Into<PathBuf>) -> Self {
        self.junior = Some(folder.into());
        self
    }

    /// Disables UDP. The node uses the configured TCP connections, serial lines and local address.
    #[must_use]
    pub fn without_udp(self) -> Self {
        self.interfaces::<String>([])
    }

    /// Accepts TCP connections at this address.
    #[must_use]
    pub const fn tcp_listen(mut self, at: SocketAddr) -> Self {
        self.tcp.listen = Some(at);
        self
    }

    /// Connects to a peer by TCP.
    #[must_use]
    pub fn tcp_connect(mut self, peer: PeerAddress) -> Self {
        self.tcp.connect.push(peer);
        self
    }

    /// Uses a serial line.
    #[cfg(feature = "serial")]
    #[must_use]
    pub fn serial(mut self, line: SerialLine) -> Self {
        self.serial.push(line);
        self
    }

    /// Adds a peer that is also sent to by unicast.
    #[must_use]
    pub fn peer(mut self, peer: PeerAddress) -> Self {
        self.peers.push(peer);
        self
    }

    /// Checks the settings, as far as possible without opening anything.
    ///
    /// # Errors
    /// The first setting that is out of range, and the range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        in_range("subsystem", self.subsystem, 1..=JausId::ANY_SUBSYSTEM - 1)?;
        in_range("node", self.node, 1..=JausId::ANY_NODE - 1)?;
        in_range("payload_limit", self.payload_limit, PAYLOAD_LIMITS)?;
        let longest = LONGEST_MESSAGE.min(self.payload_limit * MOST_FRAGMENTS);
        in_range(
            "max_message",
            self.max_message,
            self.payload_limit..=longest,
        )?;
        not_zero("mailbox.messages", self.mailbox.messages)?;
        #[cfg(unix)]
        if self.junior.is_some() && self.routing.forward {
            return Err(ConfigError::JuniorForward);
        }
        #[cfg(feature = "serial")]
        validate_serial(&self.serial)?;
        if self.tcp.listen.is_some() {
            not_zero("tcp.max_accepted", self.tcp.max_accepted)?;
            not_zero("tcp.max_per_address", self.tcp.max_per_address)?;
        }
        limits::validate(&self.routing, &self.limits)?;
        self.delivery.validate()?;
        self.access.verify_grants()?;
        for user in &self.local_users {
            let verified = user.verify(&self.access.table);
            verified.map_err(|why| ConfigError::LocalUser(user.to_string(), why))?;
        }
        Ok(self.udp().validate()?)
    }

    /// The endpoint's settings. The reassembly buffer has room for two of the longest messages.
    pub(super) fn endpoint(&self, first_sequence: u16) -> endpoint::Config {
        let usual = endpoint::Config::default();
        let delivery = &self.delivery;
        endpoint::Config {
            payload_limit: self.payload_limit,
            max_message: self.max_message,
            max_reassembly: usual.max_reassembly.max(2 * self.max_message),
            acknowledge_patience: delivery.patience,
            max_window: delivery.window,
            max_unacknowledged_octets: delivery.waiting,
            packing: delivery.packing,
            pacing: (delivery.pace_rate > 0).then_some(Pacing {
                burst: delivery.pace_burst,
                rate: delivery.pace_rate as u64,
            }),
            routing: self.routing.clone(),
            access: self.access.clone(),
            limits: self.limits.clone(),
            first_sequence,
            profiles: self.profile.clone(),
            ..usual
        }
    }

    /// Whether links other than UDP are configured.
    pub(super) const fn has_streams(&self) -> bool {
        #[cfg(feature = "serial")]
        if !self.serial.is_empty() {
            return true;
        }
        self.tcp.is_used()
    }

    /// Whether UDP is in use. Junior replaces it, and an empty list of interfaces disables it if
    /// another link or a local address is configured, or the node `has_custom` links.
    pub(super) fn uses_udp(&self, has_custom: bool) -> bool {
        #[cfg(unix)]
        if self.junior.is_some() {
            return false;
        }
        let another_way = has_custom || self.has_streams() || matches!(self.local, Local::At(_));
        self.interfaces != Interfaces::Only(Vec::new()) || !another_way
    }

    pub(super) fn udp(&self) -> udp::Settings {
        udp::Settings {
            port: self.port,
            port_taken: self.port_taken,
            group: self.group,
            group6: self.group6,
            broadcast: self.broadcast,
            ttl: self.ttl,
            receive_buffer: self.receive_buffer,
            ..udp::Settings::default()
        }
    }
}

/// Checks the settings of the serial lines, without opening them.
#[cfg(feature = "serial")]
fn validate_serial(lines: &[SerialLine]) -> Result<(), ConfigError> {
    for (index, line) in lines.iter().enumerate() {
        let device = &line.device;
        not_zero(format_args!("serial line {device}: baud"), line.baud)?;
        in_range(
            format_args!("serial line {device}: stop_bits"),
            line.stop_bits,
            1..=2,
        )?;
        if lines[..index].iter().any(|other| other.device == *device) {
            return Err(ConfigError::SerialTwice(device.clone()));
        }
    }
    Ok(())
}
