//! Which challenges are under way, and when to look at them.

use std::collections::{BTreeSet, HashMap};
use std::time::Instant;

use crate::address::JausId;
use crate::endpoint::rate::Origin;

/// The most challenges under way.
const MOST: usize = 256;
/// The most of them because of what one network address has sent.
const MOST_OF_ADDRESS: usize = 32;

/// The challenges under way, in the order of their times, and the share of each network address.
#[derive(Debug, Default)]
pub(super) struct Challenges {
    due: BTreeSet<(Instant, JausId)>,
    shares: HashMap<Origin, usize>,
}

impl Challenges {
    /// Whether one more may begin because of what came from an address.
    pub(super) fn has_room(&self, cause: Origin) -> bool {
        let share = self.shares.get(&cause).copied().unwrap_or_default();
        self.due.len() < MOST && share < MOST_OF_ADDRESS
    }

    pub(super) fn begin(&mut self, due: Instant, id: JausId, cause: Origin) {
        self.due.insert((due, id));
        *self.shares.entry(cause).or_default() += 1;
    }

    pub(super) fn postpone(&mut self, id: JausId, from: Instant, to: Instant) {
        self.due.remove(&(from, id));
        self.due.insert((to, id));
    }

    pub(super) fn end(&mut self, due: Instant, id: JausId, cause: Origin) {
        self.due.remove(&(due, id));
        if let Some(share) = self.shares.get_mut(&cause) {
            *share -= 1;
            if *share == 0 {
                self.shares.remove(&cause);
            }
        }
    }

    /// The one to look at next.
    pub(super) fn first(&self) -> Option<(Instant, JausId)> {
        self.due.first().copied()
    }
}
