//! The register of attached components and their processes, and the events about them.

use std::collections::BTreeMap;
use std::fmt;

use super::events::EventSender;
use crate::address::JausId;
use crate::link::local::Process;

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
            Self::Attached { id, process } => {
                let process = process.as_ref()?;
                Some(format!("{id} is attached by {process}"))
            }
            Self::Detached { id, process, why } => {
                let process = process.as_ref()?;
                Some(format!("{id} of {process} {why}"))
            }
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

/// The attached components of other processes.
#[derive(Debug)]
pub(super) struct Attendance {
    /// The processes of components outside the node's own process.
    processes: BTreeMap<JausId, Process>,
    pub(super) events: EventSender<ComponentEvent>,
}

impl Attendance {
    pub(super) fn new() -> Self {
        Self {
            processes: BTreeMap::new(),
            events: EventSender::new(),
        }
    }

    /// The process of a component, unless it is the node's own.
    pub(super) fn process(&self, id: JausId) -> Option<&Process> {
        self.processes.get(&id)
    }

    pub(super) fn arrive(&mut self, id: JausId, process: Option<Process>) {
        if let Some(process) = &process {
            tracing::info!(%id, %process, "component attached");
            self.processes.insert(id, process.clone());
        }
        self.events.send(ComponentEvent::Attached { id, process });
    }

    pub(super) fn depart(&mut self, id: JausId, why: Departure) {
        let process = self.processes.remove(&id);
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

    /// Detaches all components because the node has stopped.
    pub(super) fn end(&mut self) {
        for id in std::mem::take(&mut self.processes).into_keys() {
            tracing::debug!(%id, "component detached: the node stopped");
        }
        self.events.end();
    }
}
