//! Invalid settings of a node.

use super::InvalidDelivery;
use crate::address::ParseIdError;
use crate::link::InvalidGroup;

/// An invalid setting.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// 0 is no subsystem, 65535 is the wildcard.
    #[error("subsystem {0} is out of range: choose a number from 1 to 65534")]
    Subsystem(u16),
    /// 0 is no node, 255 is the wildcard.
    #[error("node {0} is out of range: choose a number from 1 to 254")]
    Node(u8),
    /// Too small for a packet, or more than one holds.
    #[error("payload_limit {0} is out of range: choose from 64 to 4079 octets")]
    PayloadLimit(usize),
    /// Less than a packet, more than there are fragments for, or too much memory for a small board.
    #[error(
        "max_message {message} is out of range: choose from {payload} (payload_limit) to \
        {longest}"
    )]
    MaxMessage {
        /// The configured length in octets.
        message: usize,
        /// [`Config::payload_limit`](super::Config::payload_limit).
        payload: usize,
        /// The limit in octets: 16 MiB, and no more fragments than there are sequence numbers.
        longest: usize,
    },
    /// A table without room, or too large.
    #[error("max_peers {0} is out of range: choose from 1 to 65536")]
    MaxPeers(usize),
    /// A rate of zero.
    #[error(
        "{key} = {{ per_second = {per_second}, burst = {burst} }} is out of range: choose at \
         least 1 for each"
    )]
    Rate {
        /// Section and key.
        key: &'static str,
        /// The rate per second.
        per_second: u32,
        /// The burst.
        burst: u32,
    },
    /// A listener that accepts no connection.
    #[error(
        "tcp.max_accepted or tcp.max_per_address 0 admits no connections: choose 1 or more, or \
         remove tcp.listen"
    )]
    MaxAccepted,
    /// Junior delivers only to its own clients.
    #[error(
        "routing.forward and junior exclude each other: Junior does not deliver to components \
         behind its clients. Remove one of them"
    )]
    JuniorForward,
    /// A serial line carries nothing at 0 bits per second.
    #[error(
        "baud {baud} of the serial line {device} is invalid: choose the rate of both ends, such \
         as 19200 or 115200"
    )]
    Baud {
        /// The device.
        device: String,
        /// The configured rate.
        baud: u32,
    },
    /// Neither one nor two stop bits.
    #[error("stop_bits {stop_bits} of the serial line {device} is invalid: choose 1 or 2")]
    StopBits {
        /// The device.
        device: String,
        /// The configured number.
        stop_bits: u8,
    },
    /// Two lines on one device.
    #[error("the serial port {0} appears twice: remove one entry")]
    SerialTwice(String),
    /// A mailbox without room.
    #[error("a mailbox must hold at least 1 message")]
    Mailbox,
    /// A setting of the section `delivery`.
    #[error(transparent)]
    Delivery(InvalidDelivery),
    /// Not a multicast group.
    #[error(transparent)]
    Group(InvalidGroup),
    /// The id of a peer is invalid.
    #[error("the id of a peer: {0}")]
    PeerId(ParseIdError),
    /// Not the address of a peer.
    #[error(
        "`{0}` is not a peer's address: write the address of one host, with a port if it is not \
         3794, such as 192.168.7.2, 192.168.7.2:3795, [fd00::2]:3795 or (IPv6's link-local \
         addresses need the interface) [fe80::2%eth0]:3794"
    )]
    Peer(String),
}
