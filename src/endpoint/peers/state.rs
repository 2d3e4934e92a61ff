//! All that is known of one peer.

use std::time::{Duration, Instant};

use super::places::Place;
use super::{Challenge, RouteState};
use crate::address::JausId;
use crate::endpoint::Path;
use crate::peer::{self, Recogniser};
use crate::wire::{Frame, Version};

/// What was seen of a peer says nothing about who is heard after so long.
const EVIDENCE_LIFE: Duration = Duration::from_secs(600);
/// A number below the first, after one that was this much higher but not close to where numbers
/// go round, is of a process that was started again.
const FIRST_NUMBERS: u16 = 16;
const STEP_BACK: u16 = 256;
const LAST_NUMBERS: u16 = 60_000;

/// A peer whose address was learned, and what was counted about it since.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Peer {
    /// Who.
    pub id: JausId,
    /// Where: the source of its latest valid message. Peers behind a router have its address.
    pub path: Path,
    /// How far it is proven that it is there.
    pub route: RouteState,
    /// The header of that message. What we send to it has the same.
    pub version: Version,
    /// When the first message came.
    pub first_heard: Instant,
    /// When the latest message came.
    pub last_heard: Instant,
    /// What it is: what was configured, or what it was recognised as for sure.
    pub profile: peer::Peer,
    /// Messages from it, fragments and acknowledgements among them, without duplicates.
    pub received: Traffic,
    /// Messages that components of ours sent to it alone.
    pub sent: Traffic,
    /// Messages of it that came more than once.
    pub duplicates: u64,
    /// How often something was sent to it again for want of an acknowledgement.
    pub retransmissions: u64,
    /// Messages to it that were given up for want of an acknowledgement.
    pub lost: u64,
    /// The smoothed time between sending something to it and its acknowledgement; `None` before the
    /// first measurement.
    pub round_trip: Option<Duration>,
}

/// Messages and their octets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// How many messages.
    pub messages: u64,
    /// Octets of their payloads.
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
pub(super) struct PeerState {
    pub(super) peer: Peer,
    /// Its place in the order of eviction.
    pub(super) place: Place,
    /// Its latest sequence number, counted on over all rounds, once one was heard.
    pub(super) latest: Option<u32>,
    /// Who it is.
    pub(super) recogniser: Recogniser,
    /// Where else it has answered a challenge since it began.
    pub(super) also_at: Vec<Path>,
    /// When it was heard last where it is.
    pub(super) heard_on_route: Instant,
    pub(super) challenge: Option<Challenge>,
    /// Until when it is not challenged again, nor moved.
    pub(super) settled_until: Option<Instant>,
    /// The path on which a challenge timed out, and when it may be challenged again.
    pub(super) unanswered: Option<(Path, Instant)>,
}

impl PeerState {
    pub(super) fn new(
        now: Instant,
        path: Path,
        frame: &Frame,
        number: Option<u32>,
        place: Place,
    ) -> Self {
        let mut received = Traffic::default();
        received.add(frame.payload.len());
        let mut recogniser = Recogniser::new();
        recogniser.handle_frame(frame, 0);
        Self {
            peer: Peer {
                id: frame.source,
                path,
                route: RouteState::Unverified,
                version: frame.version,
                first_heard: now,
                last_heard: now,
                profile: peer::Peer::Standard,
                received,
                sent: Traffic::default(),
                duplicates: 0,
                retransmissions: 0,
                lost: 0,
                round_trip: None,
            },
            place,
            latest: number,
            recogniser,
            also_at: Vec::new(),
            heard_on_route: now,
            challenge: None,
            settled_until: None,
            unanswered: None,
        }
    }

    /// A frame came from where the peer is, after `silence`; `number` is where its sender is in its
    /// own numbers, if it tells.
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
        // Whoever may not be the peer teaches nothing about it.
        if self
            .challenge
            .is_none_or(|challenge| challenge.rival.is_none())
        {
            self.recogniser.handle_frame(frame, 0);
        }
    }

    /// The peer begins anew: what was seen of it before says nothing about it.
    pub(super) fn begin_anew(&mut self, frame: &Frame, number: Option<u32>) {
        self.latest = number.or(self.latest);
        self.heard_on_route = self.peer.last_heard;
        self.also_at.clear();
        self.recogniser = Recogniser::new();
        self.recogniser.handle_frame(frame, 0);
    }
}
