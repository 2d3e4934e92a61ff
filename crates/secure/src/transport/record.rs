//! What an audit log should hold of the sessions of a node.

use std::net::SocketAddr;

use jaus::address::JausId;
use jaus::rights::{Decision, Weight, Weighted};
use quinn_proto::ConnectionError;

use crate::authority::Rejection;
use crate::key::PublicKey;

/// Something worth an entry in an audit log.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Record {
    /// The name of the peer's key in the trust file; `None` if the key is not trusted.
    pub peer: Option<String>,
    /// The peer's key, as far as it is known.
    pub key: Option<PublicKey>,
    /// The peer's address.
    pub address: SocketAddr,
    /// What happened.
    pub act: Act,
}

/// What happened.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Act {
    /// A session was established.
    Connected,
    /// A session has ended.
    Disconnected {
        /// The reason.
        reason: String,
    },
    /// No session was established.
    HandshakeFailed(Fault),
    /// A message came from an id that another program with the same key uses.
    DisputedId {
        /// The id.
        source: JausId,
        /// The destination.
        destination: JausId,
    },
    /// A rule decided about a message of the peer, or a component about its control.
    Decided(Decision),
}

impl Weighted for Record {
    fn weight(&self) -> Weight {
        match &self.act {
            Act::HandshakeFailed(_) | Act::DisputedId { .. } => Weight::Refusal,
            Act::Decided(decision) => decision.weight(),
            Act::Connected | Act::Disconnected { .. } => Weight::Evidence,
        }
    }
}

/// Why no session was established.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The peer's key is not trusted here.
    #[error("the key {0} is not trusted here")]
    UntrustedKey(PublicKey),
    /// The peer's certificate, or the proof of its key, is refused here.
    #[error(transparent)]
    Rejected(Rejection),
    /// The peer ended the handshake, most often because it does not trust the key of this node.
    #[error("the peer refused the handshake ({0})")]
    RefusedByPeer(String),
    /// Nothing came from the peer.
    #[error("no answer")]
    NoAnswer,
    /// Any other reason.
    #[error("{0}")]
    Other(String),
}

impl Fault {
    pub(super) fn of(error: &ConnectionError, rejection: Option<Rejection>) -> Self {
        match (rejection, error) {
            (Some(Rejection::UntrustedKey(key)), _) => Self::UntrustedKey(key),
            (Some(rejection), _) => Self::Rejected(rejection),
            (None, ConnectionError::ConnectionClosed(_)) => Self::RefusedByPeer(shortened(error)),
            (None, ConnectionError::TimedOut) => Self::NoAnswer,
            (None, _) => Self::Other(shortened(error)),
        }
    }

    /// What to do about it, unless only the reason itself tells.
    #[must_use]
    pub const fn remedy(&self) -> Option<&'static str> {
        match self {
            Self::UntrustedKey(_) => Some(
                "compare the key with what `jaus keys show` prints on the peer's host, then `jaus keys trust` it",
            ),
            Self::RefusedByPeer(_) => Some(
                "on the peer's host, `jaus keys trust` the key that `jaus keys show` prints here; \
                 the log of the peer names the key that it refused; of a certificate, the peer's \
                 authority, revocation list and clock decide",
            ),
            Self::NoAnswer => Some(
                "is the peer running with --secure-listen, and does its firewall let this UDP port \
                 pass?",
            ),
            Self::Rejected(_) | Self::Other(_) => None,
        }
    }
}

/// The text of an error, cut to a length for the log: an unauthenticated peer chooses part of it.
fn shortened(error: &ConnectionError) -> String {
    error.to_string().chars().take(120).collect()
}
