//! The attached components: their mailboxes, their processes, and the events about them.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;
use std::time::Instant;

use super::ComponentReport;
use super::events::EventSender;
use super::mailbox::Mailbox;
use super::tap::Taps;
use crate::address::JausId;
use crate::endpoint::{Received, Sink};
use crate::link::local::Process;
use crate::wire::Priority;

/// An event about a node's components.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum ComponentEvent {
    /// A component was attached.
    Attached {
        /// Its id.
        id: JausId,
        /// Its process; `None` for the node's own process.
        process: Option<Process>,
    },
    /// A component is no longer attached.
    Detached {
        /// Its id.
        id: JausId,
        /// Its process; `None` for the node's own process.
        process: Option<Process>,
        /// The reason.
        why: Departure,
    },
    /// A component was refused.
    Refused {
        /// Its process.
        process: Process,
        /// The reason that was sent to it.
        why: String,
    },
    /// A component process has stopped reading. Its messages wait, up to the limits of its mailbox.
    /// Other components are not affected.
    Stuck {
        /// Its id.
        id: JausId,
        /// Its process.
        process: Process,
    },
    /// A component process that was stuck reads again.
    Resumed {
        /// Its id.
        id: JausId,
        /// The messages that it has lost so far.
        dropped: u64,
    },
}

impl ComponentEvent {
    /// A line of text for people; `None` for components of the node's own process.
    #[must_use]
    pub fn in_words(&self) -> Option<String> {
        match self {
            Self::Attached { id, process } => process
                .as_ref()
                .map(|process| format!("{id} is attached by {process}")),
            Self::Detached { id, process, why } => process
                .as_ref()
                .map(|process| format!("{id} of {process} {why}")),
            Self::Refused { process, why } => Some(format!("{process} was refused: {why}")),
            Self::Stuck { id, process } => Some(format!(
                "{id} of {process} stopped reading; its messages are dropped when its mailbox is \
                 full"
            )),
            Self::Resumed { id, dropped } => Some(format!(
                "{id} reads again; {dropped} messages dropped since it attached"
            )),
        }
    }
}

/// Why a component is no longer attached.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Departure {
    /// It left on purpose.
    Left,
    /// Its process ended, or dropped the connection, without notice.
    Vanished,
    /// It violated the protocol, or the connection failed.
    Failed(String),
    /// The node has stopped.
    Stopped,
}

impl fmt::Display for Departure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Left => f.pad("detached"),
            Self::Vanished => f.pad("disconnected without detaching: its process ended"),
            Self::Failed(why) => write!(f, "was disconnected: {why}"),
            Self::Stopped => f.pad("detached: the node stopped"),
        }
    }
}

/// The attached components of a node, to which the endpoint delivers messages, and the taps.
#[derive(Debug, Default)]
pub(super) struct Components {
    attached: BTreeMap<JausId, Attached>,
    pub(super) events: EventSender<ComponentEvent>,
    pub(super) taps: Taps,
}

#[derive(Debug)]
struct Attached {
    mailbox: Arc<Mailbox>,
    /// Its process, unless it is the node's own.
    process: Option<Process>,
}

impl Components {
    /// The process of a component, unless it is the node's own.
    pub(super) fn process(&self, id: JausId) -> Option<&Process> {
        self.attached.get(&id)?.process.as_ref()
    }

    /// Whether a component is attached with this mailbox.
    pub(super) fn has(&self, id: JausId, mailbox: &Arc<Mailbox>) -> bool {
        let attached = self.attached.get(&id);
        attached.is_some_and(|attached| Arc::ptr_eq(&attached.mailbox, mailbox))
    }

    pub(super) fn reports(&self) -> Vec<ComponentReport> {
        let report = |(&id, attached): (&JausId, &Attached)| ComponentReport {
            id,
            process: attached.process.clone(),
            mailbox: attached.mailbox.counters(),
        };
        self.attached.iter().map(report).collect()
    }

    pub(super) fn add(&mut self, id: JausId, mailbox: Arc<Mailbox>, process: Option<Process>) {
        if let Some(process) = &process {
            tracing::info!(%id, %process, "component attached");
        }
        let event = ComponentEvent::Attached {
            id,
            process: process.clone(),
        };
        self.attached.insert(id, Attached { mailbox, process });
        self.events.send(event);
    }

    pub(super) fn remove(&mut self, id: JausId, why: Departure) {
        let process = self.attached.remove(&id).and_then(|it| it.process);
        if let Some(process) = &process {
            match &why {
                Departure::Left | Departure::Stopped => {
                    tracing::info!(%id, %process, "component detached");
                }
                why => tracing::warn!(%id, %process, %why, "component lost"),
            }
        }
        self.events
            .send(ComponentEvent::Detached { id, process, why });
    }

    /// Detaches all components because the node has stopped, and ends the taps. Returns their ids.
    pub(super) fn end(&mut self) -> impl Iterator<Item = JausId> {
        self.taps.end();
        self.events.end();
        let attached = std::mem::take(&mut self.attached);
        for attached in attached.values() {
            attached.mailbox.close();
        }
        attached.into_keys()
    }
}

impl Sink for Components {
    fn has_room(&self, to: JausId, priority: Priority) -> bool {
        let attached = self.attached.get(&to);
        attached.is_none_or(|attached| attached.mailbox.has_reserve(priority))
    }

    fn deliver(&mut self, message: Received) {
        self.taps.message(&message);
        if let Some(attached) = self.attached.get(&message.to) {
            attached.mailbox.deliver(message);
        }
    }

    fn progress(&mut self, now: Instant, source: JausId, to: JausId) {
        if let Some(attached) = self.attached.get(&to) {
            attached.mailbox.note_progress(now, source);
        }
    }
}
