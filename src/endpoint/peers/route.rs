//! Route verification: the states of a route, and the challenges that verify it.
//!
//! A datagram's source address can be forged, and so can the source id. A path therefore counts as
//! verified only when the peer has acknowledged on it a message sent on it. If an id is heard on
//! two paths, both are challenged, with a query that requests an acknowledgement and has an
//! unpredictable sequence number, which no other host can acknowledge.

use std::iter;
use std::time::{Duration, Instant};

use crate::address::JausId;
use crate::endpoint::Path;
use crate::endpoint::rate::Origin;
use crate::wire::{Acknowledgement, Flags, Frame, Priority};

/// A challenge is a Query Heartbeat Pulse, which every peer understands and which changes nothing.
/// Its priority tells an endpoint not to deliver the query to the component: no other peer is known
/// to query heartbeats at this priority, and our services query at high priority.
pub(in crate::endpoint) const CHALLENGE: &[u8] = b"\x02\x22";
pub(in crate::endpoint) const CHALLENGE_FLAGS: Flags =
    Flags::new(Priority::SafetyCritical).with_acknowledgement(Acknowledgement::Request);
/// How often a challenge is sent before it counts as unanswered.
const TRIES: u32 = 3;
/// The interval between two tries; the decision follows after the same interval.
pub(super) const TRY_INTERVAL: Duration = Duration::from_millis(300);
/// An incumbent that was silent for this long before the challenge need not be waited for.
pub(super) const SILENT: Duration = Duration::from_secs(10);

/// How far it is verified that a peer is where its messages seem to come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum RouteState {
    /// It was heard there, but any host could have sent that.
    #[default]
    Unverified,
    /// It has acknowledged a message sent there, is the remote end of a connection, or is
    /// configured.
    Verified,
    /// It was silent for as long as a message waited for its acknowledgement. Messages to it go to
    /// the group until it is heard again.
    Stale,
}

/// A query on one path.
#[derive(Clone, Copy, Debug)]
pub(in crate::endpoint) struct Probe {
    pub(in crate::endpoint) path: Path,
    /// The number that its acknowledgement must have.
    pub(in crate::endpoint) number: u16,
    /// Whether the peer has shown that it is there.
    pub(in crate::endpoint) answered: bool,
}

/// A challenge in progress.
#[derive(Clone, Copy, Debug)]
pub(in crate::endpoint) struct Challenge {
    /// The local component that sends it.
    pub(in crate::endpoint) local: JausId,
    /// On the peer's known path.
    pub(super) incumbent: Probe,
    /// Whether that path was verified before.
    pub(super) was_verified: bool,
    /// On the other path where its id is heard; `None` if the only path is to be verified.
    pub(super) rival: Option<Probe>,
    /// Whether the first answer decides, without waiting for the other path.
    pub(super) at_once: bool,
    pub(super) incumbent_heard: bool,
    pub(super) tries: u32,
    pub(super) due: Instant,
}

/// The outcome of a challenge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Finding {
    /// The peer is on its known path, and has proven it.
    Stays,
    /// Nothing new is known.
    Unanswered,
    /// The peer is on the rival path.
    Moves { verified: bool },
}

impl Challenge {
    /// The network address that caused it.
    pub(super) fn cause(&self) -> Origin {
        self.rival.unwrap_or(self.incumbent).path.into()
    }

    /// The queries: one or two.
    pub(in crate::endpoint) fn probes(&self) -> impl Iterator<Item = Probe> + use<> {
        [Some(self.incumbent), self.rival].into_iter().flatten()
    }

    /// Processes an acknowledgement with this number that arrived on `path`. Returns whether the
    /// challenge awaits it.
    pub(super) fn handle_answer(&mut self, local: JausId, number: u16, path: Path) -> bool {
        let mut probes = iter::once(&mut self.incumbent).chain(&mut self.rival);
        let probe = probes.find(|probe| (probe.path, probe.number) == (path, number));
        let Some(probe) = probe.filter(|_| local == self.local) else {
            return false;
        };
        probe.answered = true;
        true
    }

    /// The finding after an answer, unless the other path still has time to answer.
    pub(super) fn early_finding(&self) -> Option<Finding> {
        // If nothing is at stake, both have time to answer: a peer may be reachable on two paths.
        let rival_answered = self.rival.is_some_and(|rival| rival.answered);
        match (self.incumbent.answered, rival_answered) {
            (true, true) => Some(Finding::Stays),
            (true, false) if self.at_once || self.rival.is_none() => Some(Finding::Stays),
            (false, true) if self.at_once => Some(Finding::Moves { verified: true }),
            _ => None,
        }
    }

    /// Handles the end of a try: `None` if the challenge must be sent again.
    pub(super) fn handle_timeout(&mut self, now: Instant) -> Option<Finding> {
        if self.tries < TRIES {
            self.tries += 1;
            self.due = now + TRY_INTERVAL;
            return None;
        }
        Some(match self.rival {
            _ if self.incumbent.answered => Finding::Stays,
            Some(_) if self.incumbent_heard => Finding::Unanswered,
            Some(rival) if rival.answered => Finding::Moves { verified: true },
            Some(_) if !self.was_verified => Finding::Moves { verified: false },
            _ => Finding::Unanswered,
        })
    }
}

/// Whether a message is a challenge, which is not delivered to the component that it is addressed
/// to.
pub(in crate::endpoint) fn is_challenge(frame: &Frame) -> bool {
    frame.flags == CHALLENGE_FLAGS && frame.payload == CHALLENGE && frame.destination.is_unicast()
}

/// Whether a frame carries its sender's next number: an acknowledgement repeats the number that it
/// acknowledges, and a challenge reuses an old one.
pub(super) fn has_own_number(frame: &Frame) -> bool {
    !frame.flags.acknowledgement().is_answer() && !is_challenge(frame)
}
