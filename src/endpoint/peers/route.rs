//! How far it is proven where a peer is, and the challenges that prove it.
//!
//! A datagram's source address can be forged, and so can the id in it. So a path counts as
//! verified only when the peer has acknowledged along it what was sent along it. Where an id
//! is heard on two paths, both are challenged: with a query that wants an acknowledgement and has
//! an unpredictable sequence number, which nobody else can acknowledge.

use std::time::{Duration, Instant};

use crate::address::JausId;
use crate::endpoint::Path;
use crate::endpoint::rate::Origin;
use crate::wire::{Acknowledgement, Flags, Frame, Priority};

/// A challenge is a Query Heartbeat Pulse, which every peer understands and which changes nothing.
/// Its priority tells an endpoint that the query is not for the component, which never sees it: no
/// other peer is known to ask for a heartbeat so urgently, and our services ask at high priority.
pub(in crate::endpoint) const CHALLENGE: &[u8] = b"\x02\x22";
pub(in crate::endpoint) const CHALLENGE_FLAGS: Flags =
    Flags::new(Priority::SafetyCritical).with_acknowledgement(Acknowledgement::Request);
/// How often a challenge is sent before it counts as not answered.
const TRIES: u32 = 3;
/// The time between two tries; the decision comes as long after the last.
pub(super) const TRY_INTERVAL: Duration = Duration::from_millis(300);
/// An incumbent that was silent for so long before the challenge need not be waited for.
pub(super) const SILENT: Duration = Duration::from_secs(10);

/// How far it is proven that a peer is where its messages seem to come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum RouteState {
    /// It was heard from there, and anybody could have sent that.
    #[default]
    Unverified,
    /// It has acknowledged what was sent there, is at the other end of a connection, or is
    /// configured.
    Verified,
    /// It was silent for as long as a message waited for its acknowledgement. Messages to it go to
    /// the group until it is heard again.
    Stale,
}

/// A query to one path, and the number that its acknowledgement must have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::endpoint) struct Probe {
    pub(in crate::endpoint) path: Path,
    pub(in crate::endpoint) number: u16,
}

/// Why a peer is challenged, and in whose name.
#[derive(Clone, Copy, Debug)]
pub(in crate::endpoint) struct Doubt {
    /// The local component that asks.
    pub(in crate::endpoint) local: JausId,
    /// Where the peer was before.
    pub(in crate::endpoint) incumbent: Path,
    pub(in crate::endpoint) was_verified: bool,
    /// Where else its id is heard; `None` if the one path is to be proven.
    pub(in crate::endpoint) rival: Option<Path>,
    pub(in crate::endpoint) rival_is_stream: bool,
}

/// A challenge under way.
#[derive(Clone, Copy, Debug)]
pub(in crate::endpoint) struct Challenge {
    pub(in crate::endpoint) doubt: Doubt,
    pub(in crate::endpoint) incumbent: Probe,
    pub(in crate::endpoint) rival: Option<Probe>,
    /// Whether messages go to the rival meanwhile.
    pub(in crate::endpoint) was_provisional: bool,
    /// Whether an answer by the rival decides without waiting for the incumbent.
    pub(super) at_once: bool,
    pub(super) rival_answered: bool,
    pub(super) incumbent_heard: bool,
    pub(super) incumbent_answered: bool,
    pub(super) tries: u32,
    pub(super) due: Instant,
}

/// What a challenge has shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::endpoint) enum Finding {
    /// The peer is where it was, and has proven it.
    Stays,
    /// Nothing else than before is known.
    Unanswered,
    /// The peer is where the rival is.
    Moves { verified: bool },
}

impl Challenge {
    /// The network address because of which it began.
    pub(super) fn cause(&self) -> Origin {
        self.rival.unwrap_or(self.incumbent).path.into()
    }

    /// An acknowledgement with this number came along `path`. `None` if it is not the one that is
    /// waited for, or does not decide yet.
    pub(super) fn handle_answer(
        &mut self,
        local: JausId,
        number: u16,
        path: Path,
    ) -> Option<Answer> {
        let probe = Probe { path, number };
        if local != self.doubt.local {
            return None;
        }
        if probe == self.incumbent {
            self.incumbent_answered = true;
        } else if Some(probe) == self.rival {
            self.rival_answered = true;
        } else {
            return None;
        }
        // Where nothing hangs on it, both have time to answer: a peer may be reached by two ways.
        Some(match (self.incumbent_answered, self.rival_answered) {
            (true, true) => Answer::Decides(Finding::Stays),
            (true, false) if self.at_once || self.rival.is_none() => {
                Answer::Decides(Finding::Stays)
            }
            (false, true) if self.at_once => Answer::Decides(Finding::Moves { verified: true }),
            _ => Answer::Counts,
        })
    }

    /// Whether an answer with that number is the rival's.
    pub(super) fn has_proven_rival(&self, number: u16) -> bool {
        self.rival.is_some_and(|rival| rival.number == number)
    }

    /// The time for an answer is over: `None` if the challenge is to be sent once more.
    pub(super) fn handle_timeout(&mut self, now: Instant) -> Option<Finding> {
        if self.tries < TRIES {
            self.tries += 1;
            self.due = now + TRY_INTERVAL;
            return None;
        }
        Some(match self.rival {
            _ if self.incumbent_answered => Finding::Stays,
            Some(_) if self.incumbent_heard => Finding::Unanswered,
            Some(_) if self.rival_answered => Finding::Moves { verified: true },
            Some(_) if !self.doubt.was_verified => Finding::Moves { verified: false },
            _ => Finding::Unanswered,
        })
    }
}

/// What an acknowledgement is for a challenge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::endpoint) enum Answer {
    /// It was waited for, and the other path has time to answer yet.
    Counts,
    Decides(Finding),
}

/// Whether a message is a challenge, and not for the component that it is addressed to.
pub(in crate::endpoint) fn is_challenge(frame: &Frame) -> bool {
    frame.flags == CHALLENGE_FLAGS && frame.payload == CHALLENGE && frame.destination.is_unicast()
}

/// Whether a frame has its sender's next number: an acknowledgement has that of what it
/// acknowledges, and a challenge an old one.
pub(super) fn has_own_number(frame: &Frame) -> bool {
    !frame.flags.acknowledgement().is_answer() && !is_challenge(frame)
}
