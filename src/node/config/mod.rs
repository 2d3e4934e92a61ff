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
//! ```
//!
//! Each section has its own file here.

mod delivery;
mod error;
mod limits;
mod peer;
#[cfg(feature = "serial")]
mod serial;
mod tcp;
pub mod units;

#[cfg(unix)]
use std::path::PathBuf;

pub use self::delivery::{Delivery, InvalidDelivery};
pub use self::error::ConfigError;
pub use self::limits::{Limits, Routing};
pub use self::peer::Peer;
pub use self::tcp::{InvalidListen, Listen, Tcp};
use super::mailbox::MailboxLimits;
use crate::address::JausId;
use crate::endpoint::{self, Access, PAYLOAD_LIMITS};
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
    /// connections or serial lines.
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
    /// The limit of routers that multicast may pass.
    pub ttl: u8,
    /// The receive buffer to request from the kernel for each socket, in octets.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "units::read_size"))]
    pub receive_buffer: usize,
    /// Peers that also get all multicast traffic by unicast.
    pub peers: Vec<Peer>,
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
    /// The profiles of peers that cannot be recognised by what they send.
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

    /// Uses these IP versions on the interfaces.
    #[must_use]
    pub const fn ip(mut self, ip: Ip) -> Self {
        self.ip = ip;
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
    pub fn tcp_listen(mut self, at: Listen) -> Self {
        self.tcp.listen = Some(at);
        self
    }

    /// Connects to a peer by TCP.
    #[must_use]
    pub fn tcp_connect(mut self, peer: Peer) -> Self {
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
    pub fn peer(mut self, peer: Peer) -> Self {
        self.peers.push(peer);
        self
    }

    /// Checks the settings, as far as possible without opening anything.
    ///
    /// # Errors
    /// The first setting that is out of range, and the range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        if !(1..JausId::ANY_SUBSYSTEM).contains(&self.subsystem) {
            return Err(ConfigError::Subsystem(self.subsystem));
        }
        if !(1..JausId::ANY_NODE).contains(&self.node) {
            return Err(ConfigError::Node(self.node));
        }
        if !PAYLOAD_LIMITS.contains(&self.payload_limit) {
            return Err(ConfigError::PayloadLimit(self.payload_limit));
        }
        let longest = LONGEST_MESSAGE.min(self.payload_limit * MOST_FRAGMENTS);
        if !(self.payload_limit..=longest).contains(&self.max_message) {
            return Err(ConfigError::MaxMessage {
                message: self.max_message,
                payload: self.payload_limit,
                longest,
            });
        }
        let most = self.tcp.max_accepted.min(self.tcp.max_per_address);
        if self.tcp.listen.is_some() && most == 0 {
            return Err(ConfigError::MaxAccepted);
        }
        #[cfg(unix)]
        if self.junior.is_some() && self.routing.forward {
            return Err(ConfigError::JuniorForward);
        }
        #[cfg(feature = "serial")]
        serial::validate(&self.serial)?;
        limits::validate(&self.routing, &self.limits)?;
        if self.mailbox.messages == 0 {
            return Err(ConfigError::Mailbox);
        }
        self.delivery.validate().map_err(ConfigError::Delivery)?;
        self.udp().validate().map_err(ConfigError::Group)
    }

    /// The endpoint's settings. Its limits leave room for two of the longest messages.
    pub(super) fn endpoint(&self, first_sequence: u16) -> endpoint::Config {
        let usual = endpoint::Config::default();
        self.delivery.apply(endpoint::Config {
            payload_limit: self.payload_limit,
            max_message: self.max_message,
            max_reassembly: usual.max_reassembly.max(2 * self.max_message),
            max_peers: self.limits.max_peers,
            forwarding: self.routing.forward,
            forwarded_broadcasts: self.routing.broadcasts,
            access: self.access.clone(),
            rates: self.limits.rates(),
            first_sequence,
            profiles: self.profile.clone(),
            ..usual
        })
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
    /// another link is configured.
    pub(super) fn uses_udp(&self) -> bool {
        #[cfg(unix)]
        if self.junior.is_some() {
            return false;
        }
        let another_way = self.has_streams() || matches!(self.local, Local::At(_));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_that_name_nobody_or_everybody_are_refused() {
        for (subsystem, node) in [(0, 1), (65535, 1), (1, 0), (1, 255)] {
            let error = Config::new(subsystem, node).validate().unwrap_err();
            assert!(
                error.to_string().contains("choose a number from 1 to"),
                "{error}"
            );
        }
        assert_eq!(Config::new(65534, 254).validate(), Ok(()));
    }

    #[test]
    fn sizes_that_no_packet_has_are_refused() {
        let with = |payload_limit, max_message| {
            let config = Config {
                payload_limit,
                max_message,
                ..Config::new(1, 1)
            };
            config.validate().map_err(|error| error.to_string())
        };
        assert!(with(63, 1000).unwrap_err().contains("64 to 4079"));
        assert!(with(4080, 70_000).unwrap_err().contains("64 to 4079"));
        assert!(with(1000, 999).unwrap_err().contains("from 1000"));
        assert!(with(1000, 16_777_217).unwrap_err().contains("16777216"));
        assert_eq!(with(4079, 16_777_216), Ok(()));
        assert!(with(64, 4_194_240).is_ok());
        assert_eq!(
            with(64, 4_194_241).unwrap_err(),
            "max_message 4194241 is out of range: choose from 64 (payload_limit) to 4194240"
        );
    }
}

#[cfg(test)]
#[cfg(feature = "serde")]
mod toml_tests {
    use super::*;

    fn error(text: &str) -> String {
        toml::from_str::<Config>(text).unwrap_err().to_string()
    }

    #[test]
    fn a_file_may_do_without_udp_where_there_is_another_way() {
        let read = |streams: &str| -> Config {
            toml::from_str(&format!(
                "subsystem = 1\nnode = 1\ninterfaces = []\n{streams}"
            ))
            .unwrap()
        };
        let tcp = read("tcp = { connect = [\"10.0.0.7\"] }");
        let serial = read("[[serial]]\ndevice = \"/dev/ttyUSB0\"");
        assert!(!tcp.uses_udp() && !serial.uses_udp() && read("").uses_udp());
        let local = Config::loopback(1, 1).local(Address::Default);
        assert!(local.uses_udp() && !local.without_udp().uses_udp());
        assert_eq!((tcp.validate(), serial.validate()), (Ok(()), Ok(())));
        let closed = read("tcp = { listen = \"0.0.0.0\", max_accepted = 0 }").validate();
        assert_eq!(closed, Err(ConfigError::MaxAccepted));
    }

    #[test]
    fn a_file_sets_what_it_names_and_leaves_the_rest() {
        let config: Config = toml::from_str(
            r#"
            subsystem = 101
            node = 1
            interfaces = ["eth0", "10.0.3.2"]
            port = 0
            port_taken = "use-free"
            group = "239.255.0.9"
            peers = ["192.168.7.2"]
            [mailbox]
            messages = 10
            "#,
        )
        .unwrap();
        let expected = Config {
            mailbox: MailboxLimits {
                messages: 10,
                ..MailboxLimits::default()
            },
            ..Config::new(101, 1)
                .interfaces(["eth0", "10.0.3.2"])
                .port(0)
                .or_any_free_port()
                .group("239.255.0.9:3794".parse().unwrap())
                .peer("192.168.7.2:3794".parse().unwrap())
        };
        assert_eq!(config, expected);
    }

    #[test]
    fn the_words_for_interfaces_and_group_are_understood() {
        let config: Config = toml::from_str("interfaces = \"loopback\"\ngroup = \"off\"").unwrap();
        assert_eq!(
            (config.interfaces, config.group),
            (Interfaces::Loopback, Group::Off)
        );
        assert_eq!(
            toml::from_str::<Config>("interfaces = \"all\"").unwrap(),
            Config::default()
        );
    }

    #[test]
    fn a_file_says_what_peers_are_that_cannot_be_recognised() {
        let text = "[[profile]]\nid = \"7.255.255\"\nprofile = \"jaus++\"\n\
                    [[profile]]\nid = \"8.1.1\"\nprofile = \"iop\"\n\
                    [delivery]\nrepeat_code_to = [\"9.255.255\"]";
        let config: Config = toml::from_str(text).unwrap();
        let endpoint = config.endpoint(0);
        let found = |id: &str| Assignment::find(&endpoint.profiles, id.parse().unwrap());
        assert_eq!(found("7.1.33"), Some(crate::peer::Peer::JausPlusPlus));
        assert_eq!(found("8.1.1"), Some(crate::peer::Peer::Iop));
        assert_eq!(found("8.1.2"), None);
        assert_eq!(found("9.1.1"), Some(crate::peer::Peer::JausPlusPlus));
        let wrong = error("[[profile]]\nid = \"7.1.1\"\nprofile = \"jauspp\"");
        assert!(
            wrong.contains("line 3") && wrong.contains("\"jaus++\""),
            "{wrong}"
        );
    }

    #[test]
    fn versions_of_ip_and_broadcasts_are_chosen_by_words() {
        let text = "ip = \"both\"\ngroup6 = \"ff15::efff:1\"\nbroadcast = \"off\"\n\
                    peers = [\"[fe80::2%eth0]:9\"]";
        let config: Config = toml::from_str(text).unwrap();
        assert_eq!((config.ip, config.broadcast), (Ip::Both, Broadcasts::Off));
        assert_eq!(config.group6.to_string(), "[ff15::efff:1]:3794");
        assert_eq!(config.peers[0].to_string(), "[fe80::2%eth0]:9");
        assert!(error("ip = \"5\"").contains("expected one of `4`, `6`, `both`"));
        assert!(error("broadcast = \"yes\"").contains("`auto`, `on`, `off`"));
        assert!(error("group6 = \"239.255.0.1\"").contains("[ff12::efff:1]:3794"));
        assert!(error("peers = [\"fe80::2\"]").contains("[fe80::2%eth0]:3794"));
    }

    #[test]
    fn mistakes_in_a_file_are_named_with_their_place() {
        let unknown = error("subsystem = 1\nprot = 3794");
        assert!(
            unknown.contains("line 2") && unknown.contains("unknown field `prot`"),
            "{unknown}"
        );
        let range = error("ttl = 300");
        assert!(range.contains("line 1") && range.contains("300"), "{range}");
        let group = error("group = \"10.0.0.1\"");
        assert!(group.contains("224.0.0.0 to 239.255.255.255"), "{group}");
        let interfaces = error("interfaces = \"eth0\"");
        assert!(interfaces.contains("[\"eth0\"]"), "{interfaces}");
        let peer = error("peers = [\"nobody\"]");
        assert!(peer.contains("`nobody` is not a peer's address"), "{peer}");
    }

    #[test]
    fn what_is_written_is_read_back() {
        let config = Config::loopback(7, 3)
            .peer("10.0.0.2".parse().unwrap())
            .group(Group::Off);
        let text = serde_json::to_string(&config).unwrap();
        assert_eq!(serde_json::from_str::<Config>(&text).unwrap(), config);
    }
}
