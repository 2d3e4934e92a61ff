//! The components of this node that are attached to the endpoint.

use std::collections::BTreeSet;

use crate::address::JausId;
use crate::wire::Broadcast;

/// Why a component cannot be attached.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AttachError {
    /// The id contains a zero or a wildcard.
    #[error(
        "{0} is not a single component: the subsystem must be 1 to 65534, node and component 1 to \
         254 each"
    )]
    NotOneComponent(JausId),
    /// The id is attached already.
    #[error("{0} is attached already: give each component its own id")]
    AlreadyAttached(JausId),
    /// The table is full.
    #[error("the limit of {limit} attached components is reached")]
    TooMany {
        /// [`Config::max_components`](super::Config::max_components).
        limit: usize,
    },
    /// A link cannot serve the id; the text says why.
    #[error("{0}")]
    Link(String),
}

/// The components that a message to `destination` reaches. A local broadcast reaches only those of
/// the sender's subsystem.
pub(super) fn receivers(
    components: &BTreeSet<JausId>,
    source: JausId,
    destination: JausId,
    broadcast: Broadcast,
) -> impl Iterator<Item = JausId> + '_ {
    let (first, last) = if destination.has_wildcard() {
        (JausId::from_u32(0), JausId::EVERYONE)
    } else {
        (destination, destination)
    };
    let in_scope =
        move |id: &JausId| broadcast != Broadcast::Local || id.subsystem() == source.subsystem();
    let ids = components.range(first..=last).copied();
    ids.filter(move |&id| destination.matches(id))
        .filter(in_scope)
}
