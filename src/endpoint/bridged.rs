//! Bridged ids: those of the other side of a bridge that no grant names and gives rights.
//!
//! Each gives way to a component of this side with its id: as soon as that is heard, the route over the bridge
//! is gone, and the messages of the other side are refused until the component has been silent for [`ID_HELD`].

use std::time::Duration;

use tracing::warn;

use super::arrival::Arrival;
use super::verify::Warning;
use super::{Counter, Endpoint, Event, Path};
use crate::address::JausId;

/// How long the id of a component that has fallen silent is kept from the other side of a bridge.
pub const ID_HELD: Duration = Duration::from_secs(600);

impl Endpoint {
    /// Whether an id gives way to a component on another link if it comes by this path.
    fn is_bridged(&self, id: JausId, path: Path) -> bool {
        let link = self.egress.links.get(&path.link);
        let accept = link.and_then(|link| link.bridged.as_ref());
        accept.is_some_and(|accept| !accept.trusts(id))
    }

    /// The path on which a sender is known, if one of both is that of a bridge and the other is not.
    fn known_on_other_side(&self, Arrival { frame, path, .. }: Arrival<'_>) -> Option<Path> {
        let known = self.peers.get(frame.source)?.peer.path;
        let is_bridged = |path| self.is_bridged(frame.source, path);
        (is_bridged(known) != is_bridged(path)).then_some(known)
    }

    /// Refuses a message of the other side from the id of a component of this side.
    pub(super) fn refuse_bridged(&mut self, arrival: Arrival<'_>) -> Result<(), Counter> {
        let (id, now) = (arrival.frame.source, arrival.now);
        let is_held = || {
            let heard = self.peers.get(id).map(|state| state.peer.last_heard);
            heard.is_some_and(|at| now.saturating_duration_since(at) < ID_HELD)
        };
        if !self.is_bridged(id, arrival.path)
            || self.known_on_other_side(arrival).is_none()
            || !is_held()
        {
            return Ok(());
        }
        if self.warnings.is_due(now, Warning::Bridged) {
            warn!(%id, from = %arrival.path.peer, "refused: a component of this side has this id");
        }
        Err(Counter::ReservedId)
    }

    /// Forgets the route over the bridge to an id that a component of this side uses now.
    pub(super) fn forget_bridged(&mut self, arrival: Arrival<'_>) {
        let Some(from) = self.known_on_other_side(arrival) else {
            return;
        };
        let (id, to) = (arrival.frame.source, arrival.path);
        self.peers.remove(id);
        self.announce(Event::PeerMoved { id, from, to });
    }
}
