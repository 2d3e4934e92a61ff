//! Datagrams to whole messages and back: framings, addresses, large messages, bounds.

mod settings;

use std::net::SocketAddr;

use bytes::Bytes;

pub use settings::{Dialect, Settings};

use super::message::BadId;

/// Where a datagram is to be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum To {
    /// The multicast group, which is 224.1.0.1 by default.
    Group,
    /// One host.
    Address(SocketAddr),
}

/// A datagram to be sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Transmit {
    /// Where to.
    pub to: To,
    /// Its octets.
    pub datagram: Bytes,
}

/// Why a message was not sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// Its source is of no subsystem that is announced.
    #[error("the source {0} is of no announced subsystem: announce the subsystem first")]
    NotOurs(super::RaId),
    /// Its source or destination is none.
    #[error("{0}")]
    BadId(#[from] BadId),
    /// Nothing was heard of the destination's subsystem, so that its address is not known.
    #[error("subsystem {0} was not heard, so its address is not known: wait until it appears")]
    Unknown(u8),
    /// The data is above [`Settings::max_message`].
    #[error("{length} octets of data are above the limit of {limit}")]
    TooLong {
        /// Octets of its data.
        length: usize,
        /// Octets that are allowed.
        limit: usize,
    },
    /// The priority is none.
    #[error("{0} is no priority: use 0 to 15")]
    Priority(u8),
    /// Too many datagrams wait to be sent.
    #[error("too many datagrams wait to be sent: poll them, or send less")]
    QueueFull,
}
