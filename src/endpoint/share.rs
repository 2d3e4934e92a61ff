//! The oldest entries of bounded tables, of each network address and of all.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use super::rate::Origin;
use crate::address::JausId;

/// Since when an id is in a group, and which.
type Entry = (Instant, JausId);

/// The ids of each group by age: those of each network address and, under `None`, all.
#[derive(Debug, Default)]
pub(super) struct Ages<G>(BTreeMap<(Option<Origin>, G), BTreeSet<Entry>>);

impl<G: Copy + Ord> Ages<G> {
    /// Adds an entry, or removes it.
    pub(super) fn set(&mut self, origin: Origin, group: G, entry: Entry, is_there: bool) {
        for key in [None, Some(origin)].map(|of| (of, group)) {
            let ids = self.0.entry(key).or_default();
            if is_there {
                ids.insert(entry);
            } else {
                ids.remove(&entry);
            }
            if ids.is_empty() {
                self.0.remove(&key);
            }
        }
    }

    /// The oldest of a group, of one network address or of all, and since when it is there.
    pub(super) fn oldest(&self, of: Option<Origin>, group: G) -> Option<Entry> {
        self.0.get(&(of, group))?.first().copied()
    }
}
