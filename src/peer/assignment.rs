//! Configured profiles by id, for peers that cannot be recognised.

use super::Peer;
use crate::address::JausId;

/// Assigns a profile to an id, whatever is observed of the peer.
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
    /// The profile. [`Peer::Standard`] prevents the peer from being recognised as anything else.
    pub profile: Peer,
}

impl Assignment {
    /// The profile of an id: the first entry that matches.
    #[must_use]
    pub fn find(all: &[Self], id: JausId) -> Option<Peer> {
        let fits = |assignment: &&Self| assignment.id.matches(id);
        all.iter().find(fits).map(|assignment| assignment.profile)
    }
}
