//! Peer profiles, from the configuration or from observed behaviour.
//!
//! Evidence is tied to a peer's address: it is dropped when the peer moves, restarts its sequence
//! numbers or is silent for long.

use super::{PeerState, Peers, RouteState};
use crate::address::JausId;
use crate::endpoint::Path;
use crate::peer::{self, Assignment, LargeStyle, Recogniser};

impl Peers {
    /// The profile of a peer: the configured one, or the one recognised with certainty.
    pub(in crate::endpoint) fn profile(&self, id: JausId) -> peer::Implementation {
        self.assigned_or(id, Recogniser::certain)
    }

    /// The same, but falls back to a presumed profile, for uses where a wrong guess does little
    /// harm.
    pub(in crate::endpoint) fn presumed(&self, id: JausId) -> peer::Implementation {
        self.assigned_or(id, Recogniser::presumed)
    }

    fn assigned_or(
        &self,
        id: JausId,
        by: fn(&Recogniser) -> peer::Implementation,
    ) -> peer::Implementation {
        let recognised = || self.get(id).map(|state| by(&state.recogniser));
        self.assigned(id).or_else(recognised).unwrap_or_default()
    }

    fn assigned(&self, id: JausId) -> Option<peer::Implementation> {
        Assignment::find(&self.config.profiles, id)
    }

    /// Whether to avoid answering a peer on the TCP connections that it opened: its profile says
    /// so, or it shows the habit that goes with it.
    pub(in crate::endpoint) fn is_deaf_on_its_connections(&self, id: JausId) -> bool {
        let has_habit = |state: &PeerState| state.recogniser.repeats_version();
        self.profile(id).is_deaf_on_its_connections()
            || self.assigned(id).is_none() && self.get(id).is_some_and(has_habit)
    }

    /// How a peer cuts large messages, if known. A peer configured as standard cuts them as the
    /// standard says.
    pub(in crate::endpoint) fn large_style(&self, id: JausId) -> Option<LargeStyle> {
        let style = self.profile(id).large_style();
        style.or_else(|| self.assigned(id).map(|_| LargeStyle::Standard))
    }

    /// Whether large messages to a peer repeat the code in each fragment; `None` if they must wait
    /// for an answer. Any sender can make a peer look as if it wanted that, so its address must be
    /// verified.
    pub(in crate::endpoint) fn repeats_code(&self, id: JausId) -> Option<bool> {
        let is_verified = |state: &PeerState| state.peer.route == RouteState::Verified;
        let repeats = self.large_style(id) == Some(LargeStyle::RepeatedCode);
        let is_sure = || self.assigned(id).is_some() || self.get(id).is_some_and(is_verified);
        (!repeats || is_sure()).then_some(repeats)
    }

    /// Passes evidence other than an accepted frame, which arrived on path `from`, to the peer's
    /// recogniser.
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
