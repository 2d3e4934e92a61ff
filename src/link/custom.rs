//! Links whose transport another crate provides, such as the secure link of `jaus-secure`.
//!
//! Such a link carries JUDP datagrams unchanged. Its remote ends are sessions: the link has
//! authenticated them, so the endpoint relies on their routes without a challenge. A node gets its
//! custom links from [`Node::start_with`](crate::node::Node::start_with) and polls them in its own
//! task.

use std::fmt;
use std::task::{Context, Poll};
use std::time::Instant;

use bytes::Bytes;

use crate::address::JausId;
use crate::counters::Count;
use crate::endpoint::{SessionId, Transmit};
use crate::rights::Acceptance;

/// A link of another crate.
///
/// None of the methods may block. Those that get a [`Context`] arrange a wake-up if they have more
/// to do. `now` is the node's clock ([`node::now`](crate::node::now)).
pub trait CustomLink: fmt::Debug + Send {
    /// Its name in logs, reports and metrics. It should differ from those of other kinds of links.
    fn name(&self) -> &str;

    /// Its counters so far, for reports and metrics: always the same ones, even if they are zero.
    fn counters(&self) -> Vec<Count> {
        Vec::new()
    }

    /// Of a bridge, what the components of its other side may do: see
    /// [`LinkProfile::bridged`](crate::endpoint::LinkProfile::bridged).
    fn bridged(&self) -> Option<Acceptance> {
        None
    }

    /// Queues a datagram from the endpoint: for one session, or for all of them
    /// ([`To::Group`](crate::endpoint::To::Group)).
    fn transmit(&mut self, transmit: &Transmit);

    /// Sends what is queued; ready when nothing is left.
    fn poll_flush(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<()>;

    /// The next event; pending if there is none.
    fn poll_receive(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<Arrival>;

    /// When the link needs a turn even if nothing arrives.
    fn poll_timeout(&self) -> Option<Instant>;

    /// Starts to close all sessions, or goes on closing them. Ready when the remote ends know.
    fn hang_up(&mut self) -> Poll<()>;
}

/// An event on a custom link.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// A JUDP datagram was received. The link has checked that its messages come from ids for which
    /// the session may speak.
    Datagram {
        /// The session that it came from.
        session: SessionId,
        /// The datagram.
        octets: Bytes,
    },
    /// The session has ended.
    Closed(SessionId),
    /// From now on these ids, with wildcards, are those of the remote ends of this link: the node believes
    /// no other link's messages from them, unless its settings bind the id to where they come from.
    Speaks(Vec<JausId>),
}
