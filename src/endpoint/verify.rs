//! Address verification: challenges that prove a peer's address, and a budget for unverified
//! addresses.
//!
//! A query with a forged source makes the endpoint send to a host that has asked for nothing. So
//! all traffic to unverified addresses is limited, per network address and in total. Long before
//! the limit is reached, a [challenge](super::peers) asks for a proof, which costs an honest peer
//! nothing. Connections and serial lines count as verified. Forwarded traffic is not limited, as it
//! does not exceed the incoming traffic.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::time::{Duration, Instant};

use bytes::Bytes;
use tracing::{debug, warn};

use super::arrival::Arrival;
use super::peers::{CHALLENGE, CHALLENGE_FLAGS, Decision, Heard, Probe};
use super::{Counter, Endpoint, Event, Path};
use crate::address::JausId;
use crate::wire::Frame;

/// A challenge reuses an old sequence number, at least this many and at most twice as many numbers
/// ago. No message awaits such a number, and a peer's duplicate detection does not confuse it with
/// those of coming messages.
const NUMBERS_AGO: u16 = 1 << 14;
/// The shortest interval between two warnings of a kind. The counters show how often it happens.
const WARNING_INTERVAL: Duration = Duration::from_secs(60);

/// Rate-limited warnings to the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Warning {
    PeerMoved,
    PeerConflict,
    IdConflict,
    TableFull,
    PinnedElsewhere,
    BoundElsewhere,
    NotGranted,
    OwnNotGranted,
    Reserved,
    Bridged,
    Unverified,
}

/// When each warning was last logged.
#[derive(Debug, Default)]
pub(super) struct Warnings([Option<Instant>; 11]);

impl Warnings {
    /// Whether a warning may be logged again.
    pub(super) fn is_due(&mut self, now: Instant, warning: Warning) -> bool {
        let last = &mut self.0[warning as usize];
        let due = last.is_none_or(|at| now.saturating_duration_since(at) >= WARNING_INTERVAL);
        if due {
            *last = Some(now);
        }
        due
    }
}

impl Endpoint {
    /// Learns a sender's route, if there is room for it.
    pub(super) fn learn(&mut self, arrival: Arrival<'_>) -> Result<(), Counter> {
        let Arrival { frame, now, .. } = arrival;
        let (id, version) = (frame.source, frame.version);
        let path = self.where_it_reads(id, arrival.path);
        let is_stream = !self.egress.is_datagram(path);
        let local = self.challenger(frame.destination);
        let arrival = Arrival { path, ..arrival };
        match self.peers.hear(arrival, is_stream, local.is_some())? {
            Heard::Known => {}
            Heard::New { evicted } => {
                if let Some(forgotten) = evicted {
                    self.counters.add(Counter::PeersEvicted);
                    self.announce(Event::PeerForgotten { id: forgotten });
                    if self.warnings.is_due(now, Warning::TableFull) {
                        warn!(
                            %forgotten, newcomer = %id, from = %path.peer,
                            "the peer table is full: raise limits.max_peers, or find the sender of forged ids"
                        );
                    }
                }
                debug!(%id, ?path, %version, "peer learned");
                self.announce(Event::PeerLearned { id, path, version });
            }
            Heard::Elsewhere {
                incumbent,
                was_verified,
                moved,
                contested,
            } => {
                if moved {
                    self.announce_move(now, id, incumbent, path);
                }
                if contested && let Some(local) = local {
                    let rival = Some((path, is_stream));
                    self.begin_challenge(now, id, local, (incumbent, was_verified), rival);
                }
            }
        }
        Ok(())
    }

    fn announce_move(&mut self, now: Instant, id: JausId, from: Path, to: Path) {
        debug!(%id, ?from, ?to, "peer moved");
        self.announce(Event::PeerMoved { id, from, to });
        if self.warnings.is_due(now, Warning::PeerMoved) {
            warn!(%id, from = %from.peer, to = %to.peer, "a peer moved to another address");
        }
    }

    /// The local component that challenges a peer which has written to `destination`.
    fn challenger(&self, destination: JausId) -> Option<JausId> {
        if self.components.contains(&destination) {
            return Some(destination);
        }
        self.components.first().copied()
    }

    /// Challenges an unverified peer, unless it may not be challenged now.
    pub(super) fn challenge(&mut self, now: Instant, id: JausId) {
        if let Some(local) = self.challenger(id)
            && let Some((incumbent, _)) = self.route(id)
        {
            self.begin_challenge(now, id, local, (incumbent, false), None);
        }
    }

    /// Challenges a peer on its path, which may be verified, and on the other path where its id is
    /// heard, which may be a stream; unless it may not be challenged now.
    fn begin_challenge(
        &mut self,
        now: Instant,
        id: JausId,
        local: JausId,
        (incumbent, was_verified): (Path, bool),
        rival: Option<(Path, bool)>,
    ) {
        let cause = rival.map_or(incumbent, |(path, _)| path);
        if !self.peers.may_challenge(now, id, cause) {
            return;
        }
        let incumbent = (self.probe(id, local, incumbent, false), was_verified);
        let rival = rival.map(|(path, is_stream)| self.probe(id, local, path, is_stream));
        self.peers.begin_challenge(now, id, local, incumbent, rival);
        self.send_probes(now, id);
    }

    /// A probe with an unpredictable sequence number that no message to the peer awaits.
    fn probe(&mut self, id: JausId, local: JausId, path: Path, answered: bool) -> Probe {
        let latest = self.numbers.peek(1) as u16;
        let number = loop {
            self.probes += 1;
            let mut hasher = DefaultHasher::new();
            (self.config.challenge_key, self.probes).hash(&mut hasher);
            let ago = NUMBERS_AGO + hasher.finish() as u16 % NUMBERS_AGO;
            let number = latest.wrapping_sub(ago);
            if number != 0 && !self.awaits_answer(id, local, number) {
                break number;
            }
        };
        Probe {
            path,
            number,
            answered,
        }
    }

    fn send_probes(&mut self, now: Instant, id: JausId) {
        let Some(challenge) = self.peers.challenge(id) else {
            return;
        };
        let version = self.peers.version(id);
        for probe in challenge.probes() {
            let frame = Frame {
                version,
                flags: CHALLENGE_FLAGS,
                sequence: probe.number,
                ..Frame::new(challenge.local, id, Bytes::from_static(CHALLENGE))
            };
            if self.send_along(now, probe.path, &frame) == Ok(true) {
                self.counters.add(Counter::ChallengesSent);
            }
        }
    }

    /// Processes an acknowledgement that no message awaits. Returns whether a challenge does.
    pub(super) fn receive_challenge_answer(&mut self, arrival: Arrival<'_>) -> bool {
        let answered = self.peers.answer_challenge(arrival);
        if let Some(Some(decision)) = answered {
            self.follow(arrival.now, arrival.frame.source, decision);
        }
        answered.is_some()
    }

    /// Retransmits or decides the challenges that are due.
    pub(super) fn handle_challenges(&mut self, now: Instant) {
        while let Some((id, decision)) = self.peers.next_due(now) {
            match decision {
                Some(decision) => self.follow(now, id, decision),
                None => self.send_probes(now, id),
            }
        }
    }

    /// Acts on the decision of a challenge: packets that waited for it may leave.
    fn follow(&mut self, now: Instant, id: JausId, decision: Decision) {
        let Decision { from, to, refused } = decision;
        self.deliveries.touch(id);
        if from != to {
            self.announce_move(now, id, from, to);
        }
        if let Some(other) = refused {
            self.counters.add(Counter::PeerConflicts);
            self.announce(Event::PeerConflict {
                id,
                path: to,
                other,
            });
            if self.warnings.is_due(now, Warning::PeerConflict) {
                warn!(
                    %id, at = %to.peer, other = %other.peer,
                    "an id is used at two addresses: give each component its own id, or pin it \
                     with peers"
                );
            }
        }
    }

    /// Whether a datagram may be sent to a peer's address; refusals are counted. Starts a challenge
    /// well before the budget runs out.
    pub(super) fn may_send(&mut self, now: Instant, id: JausId, to: Path, octets: usize) -> bool {
        if self.is_free(to) {
            return true;
        }
        let octets = u32::try_from(octets).unwrap_or(u32::MAX);
        let may = self.unverified.take_many(now, to.into(), octets).is_ok()
            && self.unverified_total.take_many(now, (), octets).is_ok();
        let much = self.config.unverified_address.burst / 4;
        if self.unverified.owes(now, &to.into(), much) {
            self.challenge(now, id);
        }
        if !may {
            self.counters.add(Counter::UnverifiedBudget);
            // A busy peer may still answer the challenge.
            let is_asked = self.peers.challenge(id).is_some();
            if !is_asked && self.warnings.is_due(now, Warning::Unverified) {
                warn!(
                    to = %to.peer,
                    "too much traffic for an unverified address: add the peer to `peers` if it is \
                     genuine"
                );
            }
        }
        may
    }

    /// Whether traffic to a path is unlimited.
    pub(super) fn is_free(&self, to: Path) -> bool {
        !self.egress.is_datagram(to) || self.peers.is_proven(to)
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_of_a_kind_is_due_once_a_minute() {
        let (mut warnings, begin) = (Warnings::default(), Instant::now());
        for (after, expected) in [(0, true), (59_999, false), (60_000, true), (119_999, false)] {
            let now = begin + Duration::from_millis(after);
            assert_eq!(warnings.is_due(now, Warning::PeerMoved), expected);
        }
        assert!(warnings.is_due(begin, Warning::Unverified));
    }
}
