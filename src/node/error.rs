//! Why a node cannot start.

use std::net::Ipv4Addr;

use super::{ConfigError, Peer};
use crate::link;

/// Why a node was not started. Nothing of it runs.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// A setting is out of its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A link cannot be opened.
    #[error(transparent)]
    Link(#[from] link::Error),
    /// A peer lies behind an interface that was not chosen.
    #[error(
        "the peer {peer} is reached from {local}, and that is none of the chosen interfaces \
         ({chosen}): add `{local}` to them, or leave the peer out"
    )]
    PeerOutOfReach {
        /// The peer.
        peer: Peer,
        /// The address of this host that leads to it.
        local: Ipv4Addr,
        /// The interfaces that were chosen.
        chosen: link::Available,
    },
    /// There is no tokio runtime to run on.
    #[error(
        "a node runs on a tokio runtime with I/O and time enabled: start it within one \
         (`#[tokio::main]`, or `Runtime::enter`)"
    )]
    NoRuntime,
}
