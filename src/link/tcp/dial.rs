//! A configured peer: the attempts to connect to it, and the messages that wait for a connection.

use bytes::Bytes;
use tokio::net::TcpStream;

use super::settings::{BACKLOG, CONNECT_TIMEOUT, FIRST_PAUSE, LONGEST_PAUSE};
use crate::link::backlog::Backlog;
use crate::link::redial::Redial;
use crate::wire::Priority;

/// A peer to connect to.
#[derive(Debug)]
pub(super) struct Dial {
    pub(super) redial: Redial<TcpStream>,
    /// Messages for the peer during an attempt.
    pub(super) waiting: Backlog<(Priority, Bytes)>,
}

impl Dial {
    pub(super) fn new() -> Self {
        Self {
            redial: Redial::new(false, CONNECT_TIMEOUT, FIRST_PAUSE..=LONGEST_PAUSE),
            waiting: Backlog::new(BACKLOG),
        }
    }

    /// Queues a message for the connection, before the first attempt and during each one. In the
    /// pauses it would wait too long to be useful. Returns how many messages were dropped, this one
    /// or others, or `None` if messages are not queued now.
    pub(super) fn keep(&mut self, priority: Priority, payload: &Bytes) -> Option<u64> {
        let keeps = !self.redial.is_up() && !self.redial.is_pausing();
        let waiting = (priority, payload.clone());
        keeps.then(|| self.waiting.push(priority, payload.len(), waiting))
    }
}
