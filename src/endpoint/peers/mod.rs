//! The peer table: routes learned from received messages, and configured ones.
//!
//! Each peer has one record. The table is bounded, and each network address can hold a limited
//! share of it ([`places`]).

mod challenges;
mod evidence;
mod places;
mod route;
mod state;
#[cfg(test)]
mod tests;

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;
use std::time::Instant;

use jaus_limits::Tally;

use super::arrival::Arrival;
use super::rate::Origin;
use super::share::Ages;
use super::{Config, Counter, LinkId, Path, StaticPeer};
use crate::address::JausId;
use crate::wire::{Frame, Version};
pub(super) use challenges::Decision;
use places::Standing;
pub use route::RouteState;
use route::has_own_number;
pub(super) use route::{CHALLENGE, CHALLENGE_FLAGS, Challenge, Probe, is_challenge};
use state::PeerState;
pub use state::{Peer, Traffic};

/// The result of [`Peers::hear`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Heard {
    /// Nothing new.
    Known,
    /// A new peer, for which another may have been evicted.
    New { evicted: Option<JausId> },
    /// A peer heard on another path than before.
    Elsewhere {
        /// Its path so far.
        incumbent: Path,
        was_verified: bool,
        /// Whether its route has changed.
        moved: bool,
        /// Whether a challenge must show on which of the two paths it is.
        contested: bool,
    },
}

/// The table of peers.
#[derive(Debug, Default)]
pub(super) struct Peers {
    states: HashMap<JausId, PeerState>,
    /// The eviction order. It catches up with the times at which peers were heard only during a
    /// search, so that receiving a message costs nothing.
    order: Ages<Standing>,
    /// The number of peers of each network address.
    held: Tally<Origin>,
    /// The number of verified peers on each path.
    proven: Tally<Path>,
    /// The challenges in progress, by deadline.
    due: BTreeSet<(Instant, JausId)>,
    /// The number of challenges that each network address has caused.
    caused: Tally<Origin>,
    /// Peers with a configured address.
    pub(super) configured: Vec<StaticPeer>,
    config: Arc<Config>,
}

impl Peers {
    pub(super) fn new(config: Arc<Config>) -> Self {
        Self {
            configured: config.static_peers.clone(),
            config,
            ..Self::default()
        }
    }

    fn is_full(&self) -> bool {
        self.states.len() >= self.config.limits.max_peers.max(1)
    }

    /// The record of a peer, if its address is known.
    pub(super) fn get(&self, id: JausId) -> Option<&PeerState> {
        self.states.get(&id)
    }

    /// Adds a record, and enters it in the accounts.
    fn insert(&mut self, mut state: PeerState) {
        state.placed = state.peer.last_heard;
        self.account(&state, true);
        self.states.insert(state.peer.id, state);
    }

    /// Removes a record, also from the accounts.
    pub(super) fn remove(&mut self, id: JausId) -> Option<PeerState> {
        let state = self.states.remove(&id)?;
        self.account(&state, false);
        Some(state)
    }

    /// Enters a record in the accounts, or takes it out of them.
    fn account(&mut self, state: &PeerState, enters: bool) {
        let (id, path) = (state.peer.id, state.peer.path);
        let placed = (state.placed, id);
        self.order.set(path.into(), state.standing, placed, enters);
        self.held.count(path.into(), enters);
        if state.peer.route == RouteState::Verified {
            self.proven.count(path, enters);
        }
        if let Some(challenge) = &state.challenge {
            self.caused.count(challenge.cause(), enters);
            let due = (challenge.due, id);
            if enters {
                self.due.insert(due);
            } else {
                self.due.remove(&due);
            }
        }
    }

    /// Changes a record in a way that matters to the accounts.
    fn change<T>(&mut self, id: JausId, change: impl FnOnce(&mut PeerState) -> T) -> Option<T> {
        let mut state = self.remove(id)?;
        let changed = change(&mut state);
        self.insert(state);
        Some(changed)
    }

    /// Whether we have neither sent to a peer nor received an acknowledgement from it.
    pub(super) fn is_stranger(&self, id: JausId) -> bool {
        let has_history = |state: &PeerState| state.standing > Standing::Heard;
        !self.get(id).is_some_and(has_history)
    }

    /// The peers' paths on a link, possibly with repetitions.
    pub(super) fn paths_on(&self, link: LinkId) -> impl Iterator<Item = Path> + '_ {
        let paths = self.states.values().map(|state| state.peer.path);
        paths.filter(move |path| path.link == link)
    }

    /// The configured address of an id: its own entry, or the first pattern that matches it.
    fn pin(&self, id: JausId) -> Option<Path> {
        if self.configured.is_empty() {
            return None;
        }
        let exact = self.configured.iter().find(|pin| pin.id == id);
        let pin = exact.or_else(|| self.configured.iter().find(|pin| pin.id.matches(id)))?;
        Some(pin.path)
    }

    /// Whether an id is configured at another network address.
    pub(super) fn is_pinned_elsewhere(&self, id: JausId, from: Path) -> bool {
        let mut pins = self.configured.iter().filter(|pin| pin.id.matches(id));
        self.pin(id).is_some() && !pins.any(|pin| pin.path.is_near(from))
    }

    /// Whether a peer is verified at another host than this path's, and not at this path's host as
    /// well.
    pub(super) fn is_proven_elsewhere(&self, id: JausId, from: Path) -> bool {
        self.get(id).is_some_and(|state| {
            let mut proven = state.also_at.iter().chain([&state.peer.path]);
            state.peer.route == RouteState::Verified && !proven.any(|path| path.is_near(from))
        })
    }

    /// Whether a peer on a path is verified or configured.
    pub(super) fn is_proven(&self, path: Path) -> bool {
        self.proven.of(path) > 0 || self.configured.iter().any(|pin| pin.path == path)
    }

    /// Records where a message came from, and learns about its sender. `is_stream` says whether the
    /// path is a connection or line, on which both ends have shown that they are present;
    /// `can_challenge` whether a local component could challenge the sender.
    pub(super) fn hear(
        &mut self,
        arrival: Arrival<'_>,
        is_stream: bool,
        can_challenge: bool,
    ) -> Result<Heard, Counter> {
        let Arrival { now, frame, .. } = arrival;
        let pin = self.pin(frame.source);
        let path = pin.unwrap_or(arrival.path);
        let number = self.counted_on(frame);
        let can_challenge = can_challenge && self.has_room_for_challenge(arrival.path);
        let Some(state) = self.states.get_mut(&frame.source) else {
            let route = RouteState::of(is_stream || pin.is_some());
            return self.take_in(PeerState::new(Arrival { path, ..arrival }, route, number));
        };
        let silence = now.saturating_duration_since(state.peer.last_heard);
        state.peer.received.add(frame.payload.len());
        state.peer.last_heard = now;
        let from = state.peer.path;
        if from == path {
            state.hear_on_route(frame, number, silence);
            if state.peer.route == RouteState::Stale {
                self.set_route(frame.source, path, RouteState::Unverified);
            }
            return Ok(Heard::Known);
        }
        if let Some(challenge) = &mut state.challenge {
            challenge.incumbent_heard |= challenge.incumbent.path == path;
            return Ok(Heard::Known);
        }
        let was_verified = state.peer.route == RouteState::Verified;
        let elsewhere = |moved, contested| {
            Ok(Heard::Elsewhere {
                incumbent: from,
                was_verified,
                moved,
                contested,
            })
        };
        if pin.is_some() {
            self.set_route(frame.source, path, RouteState::Verified);
            return elsewhere(true, false);
        }
        if state.settled_until.is_some_and(|until| now < until) {
            return Ok(Heard::Known);
        }
        let is_near = from.is_near(path);
        // A connection shows that a sender is there, not that the id belongs to it.
        let is_free =
            is_near || now.saturating_duration_since(state.heard_on_route) >= route::SILENT;
        let (route, contested) = match state.peer.route {
            RouteState::Unverified if is_stream && is_free => (RouteState::Verified, false),
            RouteState::Unverified if is_free || !can_challenge => {
                (RouteState::Unverified, can_challenge)
            }
            RouteState::Stale => (RouteState::of(is_stream), false),
            RouteState::Verified if is_near && is_stream => (RouteState::Verified, false),
            RouteState::Verified if !can_challenge => return Ok(Heard::Known),
            RouteState::Verified if is_near => (RouteState::Unverified, true),
            RouteState::Unverified | RouteState::Verified => return elsewhere(false, true),
        };
        state.peer.version = frame.version;
        if is_near {
            state.hear_on_route(frame, number, silence);
        } else if !contested {
            state.begin_anew(frame, number);
        }
        self.set_route(frame.source, path, route);
        elsewhere(true, contested)
    }

    /// Adds a peer, if there is room.
    fn take_in(&mut self, state: PeerState) -> Result<Heard, Counter> {
        let mut evicted = None;
        if self.is_full() {
            let oldest = self.next_to_go(state.peer.last_heard, state.peer.path.into());
            self.remove(oldest.ok_or(Counter::PeersFull)?);
            evicted = oldest;
        }
        self.insert(state);
        Ok(Heard::New { evicted })
    }

    /// Changes the path and state of a peer's route.
    fn set_route(&mut self, id: JausId, path: Path, route: RouteState) {
        self.change(id, |state| {
            (state.peer.path, state.peer.route) = (path, route);
        });
    }

    /// Records that a peer has acknowledged a message. If the acknowledgement came on its route,
    /// the route is verified.
    pub(super) fn verify(&mut self, id: JausId, from: Path) {
        self.raise(id, Standing::Answered);
        if let Some(state) = self.get(id)
            && state.peer.path == from
            && !state.has_rival()
            && state.peer.route != RouteState::Verified
        {
            self.change(id, |state| {
                state.peer.route = RouteState::Verified;
                state.challenge = None;
            });
        }
    }

    /// Marks a route as stale if the peer was silent since `since`, while a message waited for its
    /// acknowledgement.
    pub(super) fn lose(&mut self, id: JausId, since: Instant) {
        if let Some(state) = self.get(id)
            && state.peer.last_heard < since
            && self.pin(id).is_none()
        {
            let path = state.peer.path;
            self.set_route(id, path, RouteState::Stale);
        }
    }

    /// The round of the sender's sequence numbers that a frame belongs to; 0 if it does not carry
    /// its sender's next number.
    pub(super) fn round(&self, frame: &Frame) -> u16 {
        self.counted_on(frame)
            .map_or(0, |number| (number >> 16) as u16)
    }

    /// A frame's sequence number extended over all rounds, if it is its sender's next: the
    /// candidate nearest to the sender's latest.
    fn counted_on(&self, frame: &Frame) -> Option<u32> {
        const FIRST_ROUND: u32 = 1 << 16;
        let latest = self.get(frame.source).and_then(|state| state.latest);
        let latest = latest.unwrap_or(FIRST_ROUND | u32::from(frame.sequence));
        let ahead = frame.sequence.wrapping_sub(latest as u16) as i16;
        has_own_number(frame).then(|| latest.wrapping_add_signed(ahead.into()))
    }

    /// Records a unicast message of `octets` from a local component.
    pub(super) fn note_sent(&mut self, id: JausId, octets: usize) {
        self.note(id, |peer| peer.sent.add(octets));
        self.raise(id, Standing::SpokenTo);
    }

    /// Updates a peer's statistics.
    pub(super) fn note(&mut self, id: JausId, change: impl FnOnce(&mut Peer)) {
        if let Some(state) = self.states.get_mut(&id) {
            change(&mut state.peer);
        }
    }

    /// The path and header for `id`, if known. A configured address takes precedence over a learned
    /// one.
    pub(super) fn route(&self, id: JausId) -> Option<(Path, Version)> {
        let learned = self.get(id).map(|state| &state.peer);
        let known = learned.filter(|peer| peer.route != RouteState::Stale);
        let path = self.pin(id).or_else(|| known.map(|peer| peer.path))?;
        Some((path, self.version(id)))
    }

    /// The header that a peer reads.
    pub(super) fn version(&self, id: JausId) -> Version {
        self.get(id)
            .map_or(Version::As5669a, |state| state.peer.version)
    }

    /// The addresses that get a copy of a broadcast to `destination`.
    pub(super) fn broadcast_copies(&self, destination: JausId) -> Vec<Path> {
        let reached = |peer: &&StaticPeer| peer.gets_broadcasts && peer.id.overlaps(destination);
        self.configured
            .iter()
            .filter(reached)
            .map(|peer| peer.path)
            .collect()
    }

    /// Forgets the routes on paths that are gone.
    pub(super) fn forget_paths(&mut self, gone: impl Fn(JausId, Path) -> bool) {
        let ids: Vec<_> = self.states.keys().copied().collect();
        for id in ids {
            let Some(state) = self.get(id) else {
                continue;
            };
            let mut probes = state.challenge.iter().flat_map(Challenge::probes);
            if gone(id, state.peer.path) {
                self.remove(id);
            } else if probes.any(|probe| gone(id, probe.path)) {
                self.change(id, |state| state.challenge = None);
            }
        }
    }

    /// All peers, sorted by id.
    pub(super) fn iter(&self) -> impl Iterator<Item = Peer> + '_ {
        let peers = self.states.values().map(|state| Peer {
            profile: self.profile(state.peer.id),
            ..state.peer
        });
        let mut peers: Vec<_> = peers.collect();
        peers.sort_unstable_by_key(|peer| peer.id);
        peers.into_iter()
    }
}
