//! Whose entries of a bounded table count together, so that one host cannot fill it.

use std::net::IpAddr;

use crate::endpoint::{LinkId, Received, Remote, SessionId, quota_address};

/// The origin of an entry, such as a request that waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Share {
    /// A component of the same node.
    Here,
    /// A network address, or a network that one host may own entirely.
    Address(IpAddr),
    /// A serial line.
    Line(LinkId),
    /// An authenticated session.
    Session(LinkId, SessionId),
}

impl Share {
    /// The origin of a message.
    #[must_use]
    pub fn of(received: &Received) -> Self {
        let Some(path) = received.path else {
            return Self::Here;
        };
        match path.peer {
            Remote::Line => Self::Line(path.link),
            Remote::Session(session) => Self::Session(path.link, session),
            Remote::Socket(address) => Self::Address(quota_address(address.ip())),
        }
    }
}
