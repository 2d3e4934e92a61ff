//! The settings of a carrier: bounds and times, with defaults that suit a gateway on a small board.

use std::net::IpAddr;
use std::time::Duration;

use jaus::endpoint::Rate;
use jaus::wire::judp;

/// How a message is put into a datagram.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Dialect {
    /// "JAUS01.0" in front of one message: what OpenJAUS calls OPC.
    #[default]
    Opc,
    /// The first edition of AS5669: a version octet, then each message behind four octets.
    As5669,
}

/// The settings of a carrier. Every table and queue is bounded by one of them.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The UDP port to which everything is sent, whichever port the other side sends from: 3794.
    /// OpenJAUS does the same.
    pub port: u16,
    /// The framings of what goes to the group, and so to those who have not been heard yet. A framing
    /// that somebody is heard to use is added by itself; where others are used, one that nobody
    /// uses is left out nine times of ten. Answers go in the framing of what was heard last.
    pub group_dialects: Vec<Dialect>,
    /// Hosts that multicast does not reach: what goes to the group goes to each of them, too. Who of
    /// them has not been heard yet gets it in the framings of the group, or, if there are none, in
    /// both in turn.
    pub peers: Vec<IpAddr>,
    /// The header versions that are accepted, of 0 (RA 2.x), 1 (3.0 and 3.1) and 2 (3.2 and 3.3).
    pub versions: Vec<u8>,
    /// The most subsystems whose address is remembered; there are no more than 254.
    pub max_subsystems: usize,
    /// The longest data of one message, in octets, that is sent or received. Above 4080 it travels
    /// in several parts.
    pub max_message: usize,
    /// The most octets that are kept of unfinished messages of one subsystem.
    pub max_parts_per_subsystem: usize,
    /// The same for all.
    pub max_parts: usize,
    /// How long the next part of an unfinished message may take.
    pub part_timeout: Duration,
    /// Our own network addresses: what comes from them is our own multicast, come back.
    pub own_addresses: Vec<IpAddr>,
    /// Messages from one address. By default not limited.
    pub messages: Option<Rate>,
    /// The most addresses whose rates are told apart.
    pub max_addresses: usize,
    /// Subsystems from one address that were not heard before.
    pub new_subsystems: Rate,
    /// How long a subsystem must have been silent before it is believed from another address.
    pub address_patience: Duration,
    /// The most datagrams that wait to be sent.
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
