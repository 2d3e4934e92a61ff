//! What peers are, by configuration or by what was seen of them.
//!
//! Evidence belongs to where a peer is: it ends when the peer moves, begins its numbers anew or was
//! silent for long.

use super::{PeerState, Peers, RouteState};
use crate::address::JausId;
use crate::endpoint::Path;
use crate::peer::{self, Assignment, LargeStyle, Recogniser};

impl Peers {
    /// What a peer is: what was configured, or what it was recognised as for sure.
    pub(in crate::endpoint) fn profile(&self, id: JausId) -> peer::Peer {
        self.assigned_or(id, Recogniser::certain)
    }

    /// The same, or what it may be taken for where it does little harm if it is something else.
    pub(in crate::endpoint) fn presumed(&self, id: JausId) -> peer::Peer {
        self.assigned_or(id, Recogniser::presumed)
    }

    fn assigned_or(&self, id: JausId, by: fn(&Recogniser) -> peer::Peer) -> peer::Peer {
        let recognised = || self.states.get(&id).map(|state| by(&state.recogniser));
        let assigned = Assignment::find(&self.assigned, id);
        assigned.or_else(recognised).unwrap_or_default()
    }

    /// Whether a peer is better not answered on the TCP connections that it opened: for sure, or by
    /// the habit that makes it so.
    pub(in crate::endpoint) fn is_deaf_on_its_connections(&self, id: JausId) -> bool {
        let is_by_habit = || {
            let state = self.states.get(&id);
            state.is_some_and(|state| state.recogniser.repeats_version())
        };
        let assigned = Assignment::find(&self.assigned, id);
        self.profile(id).is_deaf_on_its_connections() || assigned.is_none() && is_by_habit()
    }

    /// How a peer cuts large messages, if that is known. Who is configured to be no particular peer
    /// keeps to the standard.
    pub(in crate::endpoint) fn large_style(&self, id: JausId) -> Option<LargeStyle> {
        let style = self.profile(id).large_style();
        let assigned = || Assignment::find(&self.assigned, id);
        style.or_else(|| assigned().map(|_| LargeStyle::Standard))
    }

    /// Whether large messages to a peer repeat their code in each fragment. Anybody can make a
    /// peer look as if it wanted that, so it is done only where the peer's address is proven.
    pub(in crate::endpoint) fn wants_repeated_code(&self, id: JausId) -> bool {
        self.large_style(id) == Some(LargeStyle::RepeatedCode) && self.trusts_evidence(id)
    }

    /// Whether a peer's large messages must wait until it is known how to cut them.
    pub(in crate::endpoint) fn awaits_proof(&self, id: JausId) -> bool {
        self.large_style(id) == Some(LargeStyle::RepeatedCode) && !self.trusts_evidence(id)
    }

    fn trusts_evidence(&self, id: JausId) -> bool {
        let is_verified = |state: &PeerState| state.peer.route == RouteState::Verified;
        Assignment::find(&self.assigned, id).is_some()
            || self.states.get(&id).is_some_and(is_verified)
    }

    /// Something else about a peer than a frame that was taken, and that came along `from`, may
    /// tell who it is.
    pub(in crate::endpoint) fn recognise(
        &mut self,
        id: JausId,
        from: Path,
        by: impl FnOnce(&mut Recogniser),
    ) {
        if let Some(state) = self.states.get_mut(&id)
            && state.peer.path == from
        {
            by(&mut state.recogniser);
        }
    }
}
