//! The errors of a node: at start, when sending, and when attaching from another process.

use std::net::IpAddr;

use super::{ConfigError, PeerAddress};
use crate::address::JausId;
use crate::endpoint::{self, Shortfall};
use crate::link;
use crate::link::local::record::Reason;

/// Why a node was not started. Nothing is left running.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// A setting is out of its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A link cannot be opened.
    #[error(transparent)]
    Link(#[from] link::Error),
    /// The folder of Junior's sockets cannot be used.
    #[cfg(unix)]
    #[error(transparent)]
    Junior(#[from] link::junior::Error),
    /// Component processes of this host cannot be served.
    #[error(transparent)]
    Local(#[from] link::local::Error),
    /// A serial port cannot be used.
    #[cfg(feature = "serial")]
    #[error(transparent)]
    Serial(#[from] link::serial::SerialError),
    /// A peer lies behind an interface that is not selected.
    #[error(
        "the peer {peer} is reached from {local}, which is not one of the chosen interfaces \
         ({chosen}): add `{local}`, or remove the peer"
    )]
    PeerOutOfReach {
        /// The peer.
        peer: PeerAddress,
        /// The address of this host on the route to it.
        local: IpAddr,
        /// The selected interfaces.
        chosen: link::Available,
    },
    /// There is no tokio runtime to run on.
    #[error(
        "a node needs a tokio runtime with I/O and time enabled: start it within one \
         (`#[tokio::main]`, or `Runtime::enter`)"
    )]
    NoRuntime,
}

impl StartError {
    /// Whether another program has a port or socket of the node at present, so that a later start may succeed.
    #[must_use]
    pub const fn is_taken(&self) -> bool {
        match self {
            Self::Link(error) => error.is_taken(),
            Self::Local(error) => matches!(error, link::local::Error::Served(..)),
            _ => false,
        }
    }
}

/// Why a message was not sent. No part of it was.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SendError {
    /// The node's endpoint rejected it.
    #[error(transparent)]
    Endpoint(#[from] endpoint::SendError),
    /// The component is attached to the host's node, and the connection is down at present.
    #[error("{0} is not connected to the node of this host; it reconnects when the node is back")]
    NotConnected(JausId),
    /// The host's node takes messages more slowly than the component sends them.
    #[error("{octets} octets are already queued for the node of this host: send more slowly")]
    Busy {
        /// The waiting octets.
        octets: usize,
    },
}

/// Why the delivery of a message is not confirmed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Undelivered {
    /// It was not sent.
    #[error(transparent)]
    NotSent(#[from] SendError),
    /// The host's node rejected it, with this text as the reason.
    #[error("the node of this host did not send it: {0}")]
    Rejected(String),
    /// It was sent, but not or not completely acknowledged.
    #[error(transparent)]
    NotAcknowledged(#[from] Shortfall),
    /// A newer setpoint or a stop for the same component was sent meanwhile. The message may have
    /// arrived before.
    #[error("a newer setpoint or a stop has superseded it")]
    Superseded,
    /// The component or its node ended before the outcome was known. The message may have arrived.
    #[error("the node was lost before it reported the delivery")]
    Lost,
}

/// Why a component could not be attached to the host's node.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HostError {
    /// The node cannot be reached.
    #[error(transparent)]
    Link(#[from] link::local::Error),
    /// The node refused the component.
    #[error("the node of this host refused: {words}")]
    Refused {
        /// The reason, for programs.
        reason: Reason,
        /// The reason, for people.
        words: String,
    },
}
