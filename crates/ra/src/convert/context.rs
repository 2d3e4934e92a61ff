//! Context of a conversion besides the message.

use super::super::RaId;
use super::super::ids::{IdTable, RaComponent};
use jaus::address::JausId;

/// What is known of the sending or receiving component. Most conversions do not depend on it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Context<'a> {
    /// Id mapping, for messages that name a component. Only [claimed](IdTable::claim) subsystems
    /// are recognised.
    pub ids: Option<&'a IdTable>,
    /// Type of the RA component that sends or receives the message, or type that our component is
    /// shown as.
    pub part: Option<RaComponent>,
    /// Minor version of our service, if the layout depends on it, as for the vector drivers.
    /// Default 1.
    pub minor: Option<u8>,
}

impl Context<'_> {
    /// JAUS id of the component with this RA id, on either side.
    pub(super) fn jaus_id(self, id: RaId) -> Option<JausId> {
        self.ids?.known_to_jaus(id)
    }

    /// RA id of the component with this JAUS id, on either side.
    pub(super) fn ra_id(self, id: JausId) -> Option<RaId> {
        self.ids?.known_to_ra(id)
    }
}
