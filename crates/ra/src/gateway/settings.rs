//! What is chosen about a gateway.

use std::collections::BTreeSet;
use std::time::Duration;

use crate::{ids, node};

/// The settings of a [`Gateway`](super::Gateway).
#[derive(Debug, Clone)]
pub struct Settings {
    /// What the gateway's subsystem is called, on both sides.
    pub name: String,
    /// Who is who across the two networks.
    pub ids: ids::Settings,
    /// Which JAUS subsystems RA systems see.
    pub show: Show,
    /// How long a client waits for an answer from the other side.
    pub patience: Duration,
    /// The most authority that is claimed of RA components, whatever a JAUS client has.
    pub authority: u8,
    /// Control of an RA component ends this long after the client's last Request Control, with a
    /// quarter's grace: whole seconds to 255, zero for never.
    pub timeout: Duration,
    /// The most RA components that JAUS sees.
    pub max_components: usize,
    /// How long changes of a JAUS subsystem are gathered before RA systems are told.
    pub gather: Duration,
    /// How we are present among RA systems.
    pub ra: node::Settings,
}

/// Which JAUS subsystems RA systems see.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Show {
    /// All that have a number there.
    #[default]
    All,
    /// These alone.
    Only(BTreeSet<u16>),
}

impl Show {
    /// Whether a subsystem is among them.
    #[must_use]
    pub fn includes(&self, subsystem: u16) -> bool {
        match self {
            Self::All => true,
            Self::Only(some) => some.contains(&subsystem),
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            name: "RA gateway".to_owned(),
            ids: ids::Settings::default(),
            show: Show::All,
            patience: Duration::from_secs(1),
            authority: u8::MAX,
            timeout: Duration::from_secs(4),
            max_components: 253,
            gather: Duration::from_millis(300),
            ra: node::Settings::default(),
        }
    }
}
