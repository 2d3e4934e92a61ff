//! What a conversion may know besides the message.

use super::super::RaId;
use super::super::ids::{IdTable, RaComponent};
use jaus::address::JausId;

/// What is known of the component that a message is from or for. Most messages mean the same
/// without it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Context<'a> {
    /// The ids by which components are seen, for messages that name one: with the subsystems that
    /// have been [claimed](IdTable::claim), for others are not recognised.
    pub ids: Option<&'a IdTable>,
    /// The type of the RA component that sends or receives the message, or as which one of ours
    /// does.
    pub part: Option<RaComponent>,
    /// The minor version of our service, where the layout depends on it: that of the vector
    /// drivers does. Without it, 1.
    pub minor: Option<u8>,
}

impl Context<'_> {
    /// The id by which ours know the component with this RA id, whose it may be.
    pub(super) fn jaus_id(self, id: RaId) -> Option<JausId> {
        self.ids?.known_to_jaus(id)
    }

    /// The id by which RA systems know the component with this JAUS id, whose it may be.
    pub(super) fn ra_id(self, id: JausId) -> Option<RaId> {
        self.ids?.known_to_ra(id)
    }
}
