//! Settings of a gateway.

use std::collections::BTreeSet;
use std::time::Duration;

use jaus::address::JausId;
use jaus::rights::{Acceptance, Grant, Rules};

use crate::{ids, node};

/// The settings of a [`Gateway`](super::Gateway).
#[derive(Debug, Clone)]
pub struct Settings {
    /// Name of the gateway's subsystem, on both sides.
    pub name: String,
    /// Id mapping between the two networks.
    pub ids: ids::Settings,
    /// JAUS subsystems visible to RA systems.
    pub show: Show,
    /// Timeout of a client's query to the other side.
    pub patience: Duration,
    /// Maximum authority claimed of RA components, whatever authority a JAUS client has.
    pub authority: u8,
    /// Timeout of control over an RA component after the client's last Request Control, plus a
    /// quarter as grace: whole seconds up to 255, zero for no timeout.
    pub timeout: Duration,
    /// Maximum number of RA components visible to JAUS.
    pub max_components: usize,
    /// How long changes of a JAUS subsystem are collected before RA systems are notified.
    pub gather: Duration,
    /// What RA components may send to JAUS components, by their JAUS ids. Others than these are not heard. By
    /// default all may observe, which includes to set an emergency.
    pub grants: Acceptance,
    /// Settings of the RA node.
    pub ra: node::Settings,
}

/// Selection of the JAUS subsystems visible to RA systems.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Show {
    /// All subsystems with an RA number.
    #[default]
    All,
    /// Only these.
    Only(BTreeSet<u16>),
}

impl Show {
    /// Whether the selection includes a subsystem.
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
            // A client that may look may stop.
            grants: Acceptance::new([Grant {
                ids: JausId::EVERYONE,
                rules: Rules::default(),
            }]),
            ra: node::Settings::default(),
        }
    }
}
