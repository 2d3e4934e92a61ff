//! How a client makes its incarnation known to a component before it requests control of it.

use crate::address::JausId;
use crate::messages::core::QueryIncarnation;
use crate::service::{Directory, Incarnation};

/// How a client tells its incarnation to the peer that it requests control of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::service) enum Introduction {
    /// The peer does not offer [`Incarnation`].
    None,
    /// Before the first request: whether the peer offers it is not known.
    Once(Incarnation),
    /// Before each request until the peer has told its own.
    Always(Incarnation),
}

impl Introduction {
    /// That of a client to this peer.
    pub(in crate::service) fn new(own: Incarnation, directory: &Directory, peer: JausId) -> Self {
        match Incarnation::is_offered_by(directory, peer) {
            Some(false) => Self::None,
            None => Self::Once(own),
            Some(true) => Self::Always(own),
        }
    }

    /// What to send before a request.
    pub(super) const fn take(&mut self) -> Option<QueryIncarnation> {
        match *self {
            Self::None => None,
            Self::Once(own) => {
                *self = Self::None;
                Some(own.query(0))
            }
            Self::Always(own) => Some(own.query(0)),
        }
    }
}
