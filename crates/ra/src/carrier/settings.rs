//! Settings of a carrier: limits and timing, with defaults that suit a gateway on a small board.

use std::net::IpAddr;
use std::time::Duration;

use jaus::endpoint::Rate;
use jaus::wire::judp;

/// Framing of messages in datagrams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Dialect {
    /// "JAUS01.0" before a single message, called OPC by OpenJAUS.
    #[default]
    Opc,
    /// The first edition of AS5669: a version octet, then each message after four octets.
    As5669,
}

/// Settings of a carrier. Every table and queue has a limit.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The destination UDP port of all datagrams, whatever port the peer sends from: 3794. OpenJAUS
    /// does the same.
    pub port: u16,
    /// The framings of multicasts, and so towards unknown peers. Framings in use by peers are added
    /// automatically; once others are in use, an unused one is sent only every tenth time. Unicasts
    /// use the peer's last framing.
    pub group_dialects: Vec<Dialect>,
    /// Hosts that multicast does not reach: each gets a copy of every multicast. A host that was
    /// not heard yet gets it in the framings of the group or, if there are none, in both in turn.
    pub peers: Vec<IpAddr>,
    /// The accepted header versions, of 0 (RA 2.x), 1 (3.0 and 3.1) and 2 (3.2 and 3.3).
    pub versions: Vec<u8>,
    /// Maximum number of subsystems with known address; there are no more than 254.
    pub max_subsystems: usize,
    /// Maximum data of one message, in octets, sent or received. Messages above 4080 octets are
    /// split into parts.
    pub max_message: usize,
    /// Maximum octets stored for incomplete messages of one subsystem.
    pub max_parts_per_subsystem: usize,
    /// Maximum octets stored for incomplete messages of all subsystems.
    pub max_parts: usize,
    /// Timeout of the next part of an incomplete message.
    pub part_timeout: Duration,
    /// Our own network addresses, to recognise our own multicasts.
    pub own_addresses: Vec<IpAddr>,
    /// Rate limit of messages from one address. None by default.
    pub messages: Option<Rate>,
    /// Maximum number of addresses with their own rate limit.
    pub max_addresses: usize,
    /// Rate limit of new subsystems from one address.
    pub new_subsystems: Rate,
    /// Silence after which a subsystem is accepted from another address.
    pub address_patience: Duration,
    /// Maximum number of queued datagrams.
    pub queue_limit: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            port: judp::PORT,
            group_dialects: vec![Dialect::Opc],
            peers: Vec::new(),
            versions: vec![2],
            max_subsystems: 254,
            max_message: 1 << 20,
            max_parts_per_subsystem: 2 << 20,
            max_parts: 16 << 20,
            part_timeout: Duration::from_secs(3),
            own_addresses: Vec::new(),
            messages: None,
            max_addresses: 1024,
            new_subsystems: Rate::new(8, 64),
            address_patience: Duration::from_secs(5),
            queue_limit: 4096,
        }
    }
}
