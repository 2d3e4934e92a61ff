//! What a session's thread shares with the nodes, publishers and subscriptions of the application.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::{Notify, watch};

use super::backlog::Backlog;
use crate::graph::{Attachment, Endpoint, Graph, NodeName};

/// What a session's thread shares with the application.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) domain: u32,
    state: Mutex<State>,
    /// Wakes the thread.
    work: Condvar,
    changes: watch::Sender<u64>,
    ended: watch::Sender<bool>,
}

#[derive(Debug, Default)]
pub(super) struct State {
    /// The id of the zenoh session, once it is open.
    pub(super) session: Option<String>,
    pub(super) is_connected: bool,
    pub(super) is_closing: bool,
    pub(super) graph: Graph,
    /// What the application wants to exist.
    pub(super) wanted: BTreeMap<u64, Entity>,
    /// The entities that were added or removed since the thread looked.
    pub(super) touched: BTreeSet<u64>,
    /// The publishers that have messages to send, in turn.
    pub(super) ready: VecDeque<u64>,
    next_id: u64,
}

/// A node, or a publisher or subscription of a node.
#[derive(Debug)]
pub(super) struct Entity {
    pub(super) node_id: u64,
    pub(super) node: NodeName,
    pub(super) role: Role,
}

#[derive(Debug)]
pub(super) enum Role {
    Node,
    Publisher {
        topic: Topic,
        outgoing: Backlog<Outgoing>,
    },
    Subscription {
        topic: Topic,
        inbox: Arc<Inbox>,
    },
}

/// A topic with its key.
#[derive(Clone, Debug)]
pub(super) struct Topic {
    pub(super) key: String,
    pub(super) endpoint: Endpoint,
}

/// A message to publish, with the time of sending in nanoseconds since 1970.
#[derive(Debug)]
pub(super) struct Outgoing {
    pub(super) octets: Vec<u8>,
    pub(super) stamp: i64,
}

/// The received messages of a subscription.
#[derive(Debug)]
pub(super) struct Inbox {
    /// The key of the topic, for the log.
    key: String,
    backlog: Mutex<Backlog<Incoming>>,
    filled: Notify,
    malformed: AtomicU64,
}

/// A message before it is decoded.
#[derive(Debug)]
pub(super) struct Incoming {
    pub(super) attachment: Attachment,
    pub(super) arrival: Instant,
    pub(super) octets: Vec<u8>,
}

impl Inbox {
    pub(super) fn new(key: String, depth: u64) -> Self {
        Self {
            key,
            backlog: Mutex::new(Backlog::new(depth)),
            filled: Notify::new(),
            malformed: AtomicU64::new(0),
        }
    }

    /// Counts a message that cannot be used. The first one is a warning.
    pub(super) fn refuse(&self, reason: &str) {
        let topic = &self.key;
        if self.malformed.fetch_add(1, Ordering::Relaxed) == 0 {
            let counted = "further ones are only counted";
            tracing::warn!(%topic, "a message cannot be read: {reason} ({counted})");
        } else {
            tracing::debug!(%topic, "a message cannot be read: {reason}");
        }
    }

    pub(super) fn malformed(&self) -> u64 {
        self.malformed.load(Ordering::Relaxed)
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Backlog<Incoming>> {
        self.backlog.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn push(&self, incoming: Incoming) {
        let length = incoming.octets.len();
        self.lock().push(incoming, length);
        self.filled.notify_one();
    }

    /// Takes the oldest message, or waits for one.
    pub(super) async fn pop(&self) -> Incoming {
        loop {
            let filled = self.filled.notified();
            let next = self.lock().pop();
            match next {
                Some(next) => return next,
                None => filled.await,
            }
        }
    }
}

impl Shared {
    pub(super) fn new(domain: u32) -> Self {
        Self {
            domain,
            state: Mutex::default(),
            work: Condvar::new(),
            changes: watch::Sender::new(0),
            ended: watch::Sender::new(false),
        }
    }

    /// The state. A panic elsewhere leaves it usable: every change is complete.
    pub(super) fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the state, and wakes the thread.
    pub(super) fn with<T>(&self, change: impl FnOnce(&mut State) -> T) -> T {
        let result = change(&mut self.lock());
        self.work.notify_one();
        result
    }

    /// Waits until the thread may have something to do, at most this long.
    pub(super) fn wait<'a>(
        &self,
        state: MutexGuard<'a, State>,
        limit: Duration,
    ) -> MutexGuard<'a, State> {
        let waited = self.work.wait_timeout(state, limit);
        waited.unwrap_or_else(PoisonError::into_inner).0
    }

    pub(super) fn close(&self) {
        self.with(|state| state.is_closing = true);
    }

    pub(super) fn end(&self) {
        self.ended.send_replace(true);
    }

    pub(super) fn ended(&self) -> watch::Receiver<bool> {
        self.ended.subscribe()
    }

    /// Tells the application that connection or graph changed.
    pub(super) fn announce_change(&self) {
        self.changes.send_modify(|number| *number += 1);
    }

    pub(super) fn changes(&self) -> watch::Receiver<u64> {
        self.changes.subscribe()
    }

    /// Adds an entity: a node, or with `node`, a part of that node. Returns its id.
    pub(super) fn add(&self, node: Option<u64>, name: NodeName, role: Role) -> u64 {
        self.with(|state| {
            let id = state.next_id;
            state.next_id += 1;
            let entity = Entity {
                node_id: node.unwrap_or(id),
                node: name,
                role,
            };
            state.wanted.insert(id, entity);
            state.touched.insert(id);
            id
        })
    }

    pub(super) fn remove(&self, id: u64) {
        self.with(|state| {
            state.wanted.remove(&id);
            state.touched.insert(id);
        });
    }
}
