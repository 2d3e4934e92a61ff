//! Who is said to be what: profiles by id, for peers that cannot be recognised.

use super::Peer;
use crate::address::JausId;

/// That whoever has such an id is such a peer, whatever is seen of it.
///
/// ```toml
/// [[profile]]
/// id = "7.255.255"        # every component of subsystem 7
/// profile = "jaus++"
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Assignment {
    /// The id, which may hold the wildcards 65535 and 255.
    pub id: JausId,
    /// What it is. [`Peer::Standard`] keeps it from being taken for anything else.
    pub profile: Peer,
}

impl Assignment {
    /// The profile of an id: of all that fit it the first counts.
    #[must_use]
    pub fn find(all: &[Self], id: JausId) -> Option<Peer> {
        let fits = |assignment: &&Self| assignment.id.matches(id);
        all.iter().find(fits).map(|assignment| assignment.profile)
    }
}
