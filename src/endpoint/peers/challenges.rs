//! The challenges in progress: their deadlines, their limits and their outcome.

use std::time::{Duration, Instant};

use super::places::Standing;
use super::route::{self, Finding};
use super::{Challenge, PeerState, Peers, Probe, RouteState};
use crate::address::JausId;
use crate::endpoint::Path;
use crate::endpoint::arrival::Arrival;
use crate::peer::Recogniser;

/// The most challenges in progress.
const MOST: usize = 256;
/// The most challenges caused by traffic from one network address.
const MOST_OF_ADDRESS: usize = 32;
/// The most alternative paths remembered for a peer.
const MOST_WAYS: usize = 4;
/// The pause before a peer is challenged again, after any challenge but a verified move or an
/// unanswered one without a rival.
const SETTLED: Duration = Duration::from_secs(2);
/// How long a path that did not answer is not challenged again.
const UNANSWERED: Duration = Duration::from_secs(10);

/// The decision of a challenge.
#[derive(Clone, Copy, Debug)]
pub(in crate::endpoint) struct Decision {
    /// The peer's path so far.
    pub(in crate::endpoint) from: Path,
    /// Its path from now on.
    pub(in crate::endpoint) to: Path,
    /// The rival's path, unless the peer is there now.
    pub(in crate::endpoint) refused: Option<Path>,
}

impl Peers {
    /// Whether traffic from a path may start one more challenge.
    pub(super) fn has_room_for_challenge(&self, cause: Path) -> bool {
        self.due.len() < MOST && self.caused.of(cause.into()) < MOST_OF_ADDRESS
    }

    /// Whether traffic from a path may start a challenge of a peer now.
    pub(in crate::endpoint) fn may_challenge(&self, now: Instant, id: JausId, cause: Path) -> bool {
        self.has_room_for_challenge(cause)
            && self.pin(id).is_none()
            && self.get(id).is_some_and(|state| {
                let pause = state.unanswered.filter(|(at, _)| *at == cause);
                let pauses = [state.settled_until, pause.map(|(_, until)| until)];
                state.challenge.is_none() && pauses.into_iter().flatten().all(|until| until <= now)
            })
    }

    /// The challenge of a peer in progress.
    pub(in crate::endpoint) fn challenge(&self, id: JausId) -> Option<Challenge> {
        self.get(id)?.challenge
    }

    /// Begins a challenge, sent by the component `local`, of a peer on its path, which may be
    /// verified, and on the path of its rival.
    pub(in crate::endpoint) fn begin_challenge(
        &mut self,
        now: Instant,
        id: JausId,
        local: JausId,
        (incumbent, was_verified): (Probe, bool),
        rival: Option<Probe>,
    ) {
        self.change(id, |state| {
            let silence = now.saturating_duration_since(state.heard_on_route);
            state.challenge = Some(Challenge {
                local,
                incumbent,
                was_verified,
                rival,
                at_once: rival.is_some_and(|rival| rival.path.is_near(incumbent.path))
                    || silence >= route::SILENT,
                incumbent_heard: false,
                tries: 1,
                due: now + route::TRY_INTERVAL,
            });
        });
    }

    /// Processes an acknowledgement that no message awaits. Returns `None` if no challenge does
    /// either, and the decision if this makes one.
    pub(in crate::endpoint) fn answer_challenge(
        &mut self,
        arrival: Arrival<'_>,
    ) -> Option<Option<Decision>> {
        let (frame, now, path) = (arrival.frame, arrival.now, arrival.path);
        let state = self.states.get_mut(&frame.source)?;
        let challenge = state.challenge.as_mut()?;
        if !challenge.handle_answer(frame.destination, frame.sequence, path) {
            return None;
        }
        let challenge = *challenge;
        let incumbent = challenge.incumbent;
        if path != incumbent.path && !state.also_at.contains(&path) {
            if state.also_at.len() == MOST_WAYS {
                state.also_at.remove(0);
            }
            state.also_at.push(path);
        }
        let finding = challenge.early_finding();
        if finding.is_none() && incumbent.answered && state.peer.path == incumbent.path {
            self.set_route(frame.source, incumbent.path, RouteState::Verified);
        }
        let decision = finding.and_then(|finding| self.settle(now, frame.source, finding));
        self.raise(frame.source, Standing::Answered);
        Some(decision)
    }

    /// The next peer whose challenge is due, and the decision; `None` if the challenge must be sent
    /// again.
    pub(in crate::endpoint) fn next_due(
        &mut self,
        now: Instant,
    ) -> Option<(JausId, Option<Decision>)> {
        let &(_, id) = self.due.first().filter(|(due, _)| *due <= now)?;
        let finding = self.change(id, |state| state.challenge.as_mut()?.handle_timeout(now))?;
        let decision = finding.and_then(|finding| self.settle(now, id, finding));
        Some((id, decision))
    }

    /// When the next challenge is due.
    pub(in crate::endpoint) fn next_deadline(&self) -> Option<Instant> {
        self.due.first().map(|&(due, _)| due)
    }

    /// Ends a challenge with this finding.
    fn settle(&mut self, now: Instant, id: JausId, finding: Finding) -> Option<Decision> {
        self.change(id, |state| state.settle(now, finding))?
    }
}

impl PeerState {
    fn settle(&mut self, now: Instant, finding: Finding) -> Option<Decision> {
        let challenge = self.challenge.take()?;
        let (known, from) = (challenge.incumbent.path, self.peer.path);
        let mut refused = challenge.rival.map(|rival| rival.path);
        let (path, route) = match (finding, refused) {
            (Finding::Moves { verified }, Some(rival)) => {
                if !rival.is_near(known) {
                    self.recogniser = Recogniser::default();
                }
                refused = None;
                (rival, RouteState::of(verified))
            }
            (Finding::Stays, _) => (known, RouteState::Verified),
            _ => (known, RouteState::of(challenge.was_verified)),
        };
        // Programs that run one after the other may share an id. The next move may follow a
        // verified one at once, and an unanswered challenge must not delay a move.
        match finding {
            Finding::Moves { verified: true } => {}
            Finding::Unanswered if challenge.rival.is_none() => {
                self.unanswered = Some((known, now + UNANSWERED));
            }
            _ => self.settled_until = Some(now + SETTLED),
        }
        (self.peer.path, self.peer.route) = (path, route);
        Some(Decision {
            from,
            to: path,
            refused,
        })
    }
}
