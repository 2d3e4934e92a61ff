//! The eviction order of the full peer table, and the share of each network address.
//!
//! A new peer evicts a peer of the network address that holds the most, if that holds at least two
//! more than the newcomer's. Peers that have only sent to us go first, then those that we have sent
//! to, then those that have acknowledged a message; among equals the one silent for longest. A peer
//! that has acknowledged a message is not evicted within 60 s of its last message, unless its
//! address holds more than a quarter of the table. If no peer can be evicted, the new one is
//! refused. Forged ids therefore mostly replace each other.

use std::time::{Duration, Instant};

use super::{PeerState, Peers};
use crate::address::JausId;
use crate::endpoint::Path;
use crate::endpoint::rate::Origin;

/// Our history with a peer, which determines the eviction order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Standing {
    #[default]
    Heard,
    SpokenTo,
    /// It has acknowledged one of our messages.
    Answered,
}

impl Standing {
    pub(super) const ALL: [Self; 3] = [Self::Heard, Self::SpokenTo, Self::Answered];

    /// How long a peer must have been silent to be evicted.
    pub(super) const fn silence(self) -> Duration {
        match self {
            Self::Heard | Self::SpokenTo => Duration::ZERO,
            Self::Answered => Duration::from_secs(60),
        }
    }
}

impl Peers {
    /// Whether an id is known or can be added: there is room, or a peer can be evicted.
    pub(in crate::endpoint) fn has_room_for(
        &mut self,
        now: Instant,
        id: JausId,
        from: Path,
    ) -> bool {
        self.get(id).is_some() || !self.is_full() || self.next_to_go(now, from.into()).is_some()
    }

    /// The peer to evict for a new one from a network address. An address that holds a quarter of
    /// the table gets no more of it, and makes room for addresses that hold less.
    pub(super) fn next_to_go(&mut self, now: Instant, newcomer: Origin) -> Option<JausId> {
        let limit = self.config.limits.max_peers;
        let (most, holder) = self.held.largest()?;
        let own = self.held.of(newcomer);
        let (is_excessive, own_is) = (most * 4 > limit, own * 4 > limit);
        if most > own + 1 {
            let found = Standing::ALL.into_iter().find_map(|standing| {
                let silence = if is_excessive {
                    Duration::ZERO
                } else {
                    standing.silence()
                };
                self.longest_silent(now, Some(holder), standing, silence)
            });
            if found.is_some() {
                return found;
            }
        }
        let of = own_is.then_some(newcomer);
        Standing::ALL
            .into_iter()
            .find_map(|standing| self.longest_silent(now, of, standing, standing.silence()))
    }

    /// The peer of a standing that was heard longest ago, if it was silent for long enough. Peers
    /// heard since they got their position move to the end, so a search costs no more than the
    /// messages heard.
    fn longest_silent(
        &mut self,
        now: Instant,
        of: Option<Origin>,
        standing: Standing,
        silence: Duration,
    ) -> Option<JausId> {
        loop {
            let (heard, id) = self.order.oldest(of, standing)?;
            if self.get(id)?.peer.last_heard > heard {
                self.change(id, |_| ());
                continue;
            }
            return (now.saturating_duration_since(heard) >= silence).then_some(id);
        }
    }

    pub(super) fn raise(&mut self, id: JausId, standing: Standing) {
        let is_below = |state: &PeerState| state.standing < standing;
        if self.get(id).is_some_and(is_below) {
            self.change(id, |state| state.standing = standing);
        }
    }
}
