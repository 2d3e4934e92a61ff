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

use super::peers::{
    Answer, CHALLENGE, CHALLENGE_FLAGS, Challenge, Doubt, Finding, Heard, Probe, Sighting,
};
use super::rate::{Bucket, Buckets, Origin};
use super::{Config, Counter, Endpoint, Event, Path, Rate};
use crate::address::JausId;
use crate::wire::{Frame, Framing};

/// A challenge reuses an old sequence number, at least this many and at most twice as many numbers
/// ago. No message awaits such a number, and a peer's duplicate detection does not confuse it with
/// those of coming messages.
const NUMBERS_AGO: u16 = 1 << 14;
/// The shortest interval between two warnings of a kind.
const WARNING_INTERVAL: Duration = Duration::from_secs(10);

/// The budget for traffic to unverified addresses.
#[derive(Debug)]
pub(super) struct Budget {
    by_address: Buckets<Origin>,
    total: Bucket,
    total_rate: Rate,
}

impl Budget {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            by_address: Buckets::new(config.unverified_address, config.max_peers),
            total: Bucket::default(),
            total_rate: config.unverified_total,
        }
    }

    fn take(&mut self, now: Instant, to: Origin, octets: usize) -> bool {
        let octets = u32::try_from(octets).unwrap_or(u32::MAX);
        self.by_address.take_many(now, to, octets)
            && self.total.take_many(now, self.total_rate, octets)
    }

    /// Whether an address has used a quarter of its burst.
    fn is_in_use(&self, now: Instant, to: Origin) -> bool {
        self.by_address.owed(now, &to) >= self.by_address.rate().burst / 4
    }
}

/// Rate-limited warnings to the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Warning {
    PeerMoved,
    PeerConflict,
    IdConflict,
    TableFull,
    PinnedElsewhere,
    Unverified,
}

/// When each warning was last logged.
#[derive(Debug, Default)]
pub(super) struct Warnings([Option<Instant>; 6]);

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
    pub(super) fn learn(&mut self, now: Instant, from: Path, frame: &Frame) -> Result<(), Counter> {
        let (id, version) = (frame.source, frame.version);
        let path = self.where_it_reads(id, from);
        let is_stream = self.framing(path.link) != Framing::Judp;
        let local = self.challenger(frame.destination);
        let heard = self.peers.hear(Sighting {
            now,
            path,
            is_stream,
            can_challenge: local.is_some(),
            frame,
        });
        match heard {
            Heard::Known | Heard::Elsewhere => {}
            Heard::New { evicted } => {
                if let Some(id) = evicted {
                    self.counters.add(Counter::PeersEvicted);
                    self.announce(Event::PeerForgotten { id });
                    if self.warnings.is_due(now, Warning::TableFull) {
                        warn!(
                            forgotten = %id, newcomer = %frame.source, from = %path.peer,
                            "the peer table is full: raise limits.max_peers, or find the sender \
                             of forged ids"
                        );
                    }
                }
                debug!(%id, ?path, %version, "peer learned");
                self.announce(Event::PeerLearned { id, path, version });
            }
            Heard::Moved {
                from,
                contested,
                was_verified,
            } => {
                self.announce_move(now, id, from, path);
                if contested {
                    self.contest(now, id, local, from, was_verified, (path, is_stream));
                }
            }
            Heard::Contested {
                incumbent,
                was_verified,
            } => self.contest(now, id, local, incumbent, was_verified, (path, is_stream)),
            Heard::NoRoom => return Err(Counter::PeersFull),
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
        if self.components.contains(destination) {
            return Some(destination);
        }
        self.components.iter().next()
    }

    /// Challenges both paths on which an id is heard.
    fn contest(
        &mut self,
        now: Instant,
        id: JausId,
        local: Option<JausId>,
        incumbent: Path,
        was_verified: bool,
        (rival, rival_is_stream): (Path, bool),
    ) {
        if let Some(local) = local
            && self.peers.may_challenge(now, id, rival)
        {
            let rival = Some(rival);
            let doubt = Doubt {
                local,
                incumbent,
                was_verified,
                rival,
                rival_is_stream,
            };
            self.begin_challenge(now, id, doubt);
        }
    }

    /// Challenges an unverified peer, unless it may not be challenged now.
    pub(super) fn challenge(&mut self, now: Instant, id: JausId) {
        if let Some(local) = self.challenger(id)
            && let Some((incumbent, _)) = self.route(id)
            && self.peers.may_challenge(now, id, incumbent)
        {
            let doubt = Doubt {
                local,
                incumbent,
                was_verified: false,
                rival: None,
                rival_is_stream: false,
            };
            self.begin_challenge(now, id, doubt);
        }
    }

    fn begin_challenge(&mut self, now: Instant, id: JausId, doubt: Doubt) {
        let incumbent = self.probe(id, doubt.local, doubt.incumbent);
        let rival = doubt.rival.map(|path| self.probe(id, doubt.local, path));
        self.peers.begin_challenge(now, id, doubt, incumbent, rival);
        self.send_probes(now, id, doubt.local, [Some(incumbent), rival]);
    }

    /// A probe with an unpredictable sequence number that no message to the peer awaits.
    fn probe(&mut self, id: JausId, local: JausId, path: Path) -> Probe {
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
        Probe { path, number }
    }

    fn send_probes(&mut self, now: Instant, id: JausId, local: JausId, probes: [Option<Probe>; 2]) {
        let version = self.peers.version(id);
        for Probe { path, number } in probes.into_iter().flatten() {
            let frame = Frame {
                version,
                flags: CHALLENGE_FLAGS,
                sequence: number,
                ..Frame::new(local, id, Bytes::from_static(CHALLENGE))
            };
            if self.send_along(now, path, &frame) == Ok(true) {
                self.counters.add(Counter::ChallengesSent);
            }
        }
    }

    /// Processes an acknowledgement that no message awaits. Returns whether a challenge does.
    pub(super) fn receive_challenge_answer(
        &mut self,
        now: Instant,
        from: Path,
        frame: &Frame,
    ) -> bool {
        let Some((answer, challenge)) = self.peers.answer_challenge(now, frame, from) else {
            return false;
        };
        if let Answer::Decides(finding) = answer {
            self.settle_challenge(now, frame.source, &challenge, finding);
        }
        true
    }

    /// Retransmits or decides the challenges that are due.
    pub(super) fn handle_challenges(&mut self, now: Instant) {
        while let Some((id, challenge, finding)) = self.peers.next_due(now) {
            match finding {
                Some(finding) => self.settle_challenge(now, id, &challenge, finding),
                None => {
                    let probes = [Some(challenge.incumbent), challenge.rival];
                    self.send_probes(now, id, challenge.doubt.local, probes);
                }
            }
        }
    }

    fn settle_challenge(
        &mut self,
        now: Instant,
        id: JausId,
        challenge: &Challenge,
        finding: Finding,
    ) {
        self.deliveries.touch(id);
        let Some(rival) = challenge.rival else {
            return;
        };
        let incumbent = challenge.incumbent.path;
        let (before, after) = match finding {
            Finding::Moves { .. } => (incumbent, rival.path),
            Finding::Stays | Finding::Unanswered => (rival.path, incumbent),
        };
        if challenge.was_provisional == (after == incumbent) {
            self.announce_move(now, id, before, after);
        }
        if after == incumbent {
            self.counters.add(Counter::PeerConflicts);
            self.announce(Event::PeerConflict {
                id,
                path: incumbent,
                other: rival.path,
            });
            if self.warnings.is_due(now, Warning::PeerConflict) {
                warn!(
                    %id, at = %incumbent.peer, other = %rival.path.peer,
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
        let may = self.budget.take(now, to.into(), octets);
        if self.budget.is_in_use(now, to.into()) {
            self.challenge(now, id);
        }
        if !may {
            self.counters.add(Counter::UnverifiedBudget);
            // A busy peer may still answer the challenge.
            let is_asked = self.peers.is_challenged(id);
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
        self.framing(to.link) != Framing::Judp || self.peers.is_proven(to)
    }
}
