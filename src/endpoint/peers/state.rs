//! The record of one peer: its route, statistics, sequence numbers and pending challenge.

use std::time::{Duration, Instant};

use super::places::Standing;
use super::{Challenge, RouteState};
use crate::address::JausId;
use crate::endpoint::Path;
use crate::endpoint::arrival::Arrival;
use crate::peer::{self, Recogniser};
use crate::wire::{Frame, Version};

/// Evidence about a peer expires after this much silence.
const EVIDENCE_LIFE: Duration = Duration::from_secs(600);
/// A sequence number below `FIRST_NUMBERS` shows a restarted process if the number before was at
/// least `STEP_BACK` higher, but below `LAST_NUMBERS`: above that, it is a wraparound.
const FIRST_NUMBERS: u16 = 16;
const STEP_BACK: u16 = 256;
const LAST_NUMBERS: u16 = 60_000;

/// A peer with a learned address, and its statistics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Peer {
    /// The id.
    pub id: JausId,
    /// Its address, to which messages for it go. Peers behind a router have the router's address.
    pub path: Path,
    /// How far that path is verified.
    pub route: RouteState,
    /// The header of its latest message from there. Messages to it use the same header.
    pub version: Version,
    /// When its first message arrived.
    pub first_heard: Instant,
    /// When its latest message arrived.
    pub last_heard: Instant,
    /// Its profile: the configured one, or the one recognised with certainty.
    pub profile: peer::Implementation,
    /// Messages from it, including fragments and acknowledgements, without duplicates.
    pub received: Traffic,
    /// Unicast messages from local components to it.
    pub sent: Traffic,
    /// Duplicates received from it.
    pub duplicates: u64,
    /// Retransmissions to it, because no acknowledgement arrived.
    pub retransmissions: u64,
    /// Messages to it given up, because no acknowledgement arrived.
    pub lost: u64,
    /// The smoothed round trip from transmission to acknowledgement; `None` before the first
    /// measurement.
    pub round_trip: Option<Duration>,
}

/// A count of messages and octets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Number of messages.
    pub messages: u64,
    /// Octets of payload.
    pub octets: u64,
}

impl Traffic {
    pub(super) fn add(&mut self, octets: usize) {
        self.messages += 1;
        self.octets += octets as u64;
    }
}

impl RouteState {
    pub(super) const fn of(verified: bool) -> Self {
        if verified {
            Self::Verified
        } else {
            Self::Unverified
        }
    }
}

/// The record of a peer.
#[derive(Debug)]
pub(in crate::endpoint) struct PeerState {
    pub(in crate::endpoint) peer: Peer,
    pub(super) standing: Standing,
    /// When it was last heard before it got its place in the eviction order.
    pub(super) placed: Instant,
    /// Its latest sequence number, extended over all rounds; `None` before the first.
    pub(super) latest: Option<u32>,
    /// The evidence of what it is.
    pub(super) recogniser: Recogniser,
    /// Other paths on which it has answered a challenge since it started.
    pub(super) also_at: Vec<Path>,
    /// When it was last heard on its route.
    pub(super) heard_on_route: Instant,
    pub(super) challenge: Option<Challenge>,
    /// Until when it is neither challenged again nor moved.
    pub(super) settled_until: Option<Instant>,
    /// The path on which a challenge timed out, and when it may be challenged again.
    pub(super) unanswered: Option<(Path, Instant)>,
}

impl PeerState {
    pub(super) fn new(arrival: Arrival<'_>, route: RouteState, number: Option<u32>) -> Self {
        let (frame, now, path) = (arrival.frame, arrival.now, arrival.path);
        let mut received = Traffic::default();
        received.add(frame.payload.len());
        let mut recogniser = Recogniser::default();
        recogniser.handle_frame(frame, 0);
        Self {
            peer: Peer {
                id: frame.source,
                path,
                route,
                version: frame.version,
                first_heard: now,
                last_heard: now,
                profile: peer::Implementation::Standard,
                received,
                sent: Traffic::default(),
                duplicates: 0,
                retransmissions: 0,
                lost: 0,
                round_trip: None,
            },
            standing: Standing::Heard,
            placed: now,
            latest: number,
            recogniser,
            also_at: Vec::new(),
            heard_on_route: now,
            challenge: None,
            settled_until: None,
            unanswered: None,
        }
    }

    /// Processes a frame that arrived on the peer's route after `silence`; `number` is its extended
    /// sequence number, if it carries its sender's own.
    pub(super) fn hear_on_route(&mut self, frame: &Frame, number: Option<u32>, silence: Duration) {
        self.heard_on_route = self.peer.last_heard;
        self.peer.version = frame.version;
        let restarted = number.is_some()
            && frame.sequence < FIRST_NUMBERS
            && self.latest.is_some_and(|latest| {
                (frame.sequence.saturating_add(STEP_BACK)..LAST_NUMBERS).contains(&(latest as u16))
            });
        if restarted || silence >= EVIDENCE_LIFE {
            return self.begin_anew(frame, number);
        }
        let is_before = |latest: u32| number.is_none_or(|it| it.wrapping_sub(latest) as i32 <= 0);
        if !self.latest.is_some_and(is_before) {
            self.latest = number;
        }
        // A frame that may not be the peer's teaches nothing about it.
        if !self.has_rival() {
            self.recogniser.handle_frame(frame, 0);
        }
    }

    /// Whether its id is also heard on another path, and a challenge decides between the two.
    pub(super) fn has_rival(&self) -> bool {
        self.challenge.is_some_and(|it| it.rival.is_some())
    }

    /// Resets the evidence of a restarted or moved peer.
    pub(super) fn begin_anew(&mut self, frame: &Frame, number: Option<u32>) {
        self.latest = number.or(self.latest);
        self.heard_on_route = self.peer.last_heard;
        self.also_at.clear();
        self.recogniser = Recogniser::default();
        self.recogniser.handle_frame(frame, 0);
    }
}
