//! The challenges in progress: their deadlines, their limits and their outcome.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use super::places::Standing;
use super::{Challenge, Finding, Peers, RouteState, route};
use crate::address::JausId;
use crate::endpoint::Path;
use crate::endpoint::arrival::Arrival;
use crate::endpoint::rate::Origin;
use crate::endpoint::share::Tally;
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

/// The challenges in progress, by deadline, and the count for each network address.
#[derive(Debug, Default)]
pub(super) struct Challenges {
    due: BTreeSet<(Instant, JausId)>,
    shares: Tally<Origin>,
}

impl Challenges {
    /// Whether traffic from an address may start one more challenge.
    pub(super) fn has_room(&self, cause: Origin) -> bool {
        self.due.len() < MOST && self.shares.of(cause) < MOST_OF_ADDRESS
    }
}

impl Peers {
    /// Whether traffic from a path may start a challenge of a peer now.
    pub(in crate::endpoint) fn may_challenge(&self, now: Instant, id: JausId, cause: Path) -> bool {
        self.challenges.has_room(cause.into())
            && self.pin(id).is_none()
            && self.states.get(&id).is_some_and(|state| {
                let pause = state.unanswered.filter(|(at, _)| *at == cause);
                let pauses = [state.settled_until, pause.map(|(_, until)| until)];
                state.challenge.is_none() && pauses.into_iter().flatten().all(|until| until <= now)
            })
    }

    pub(in crate::endpoint) fn is_challenged(&self, id: JausId) -> bool {
        let state = self.states.get(&id);
        state.is_some_and(|state| state.challenge.is_some())
    }

    /// Begins a challenge of a peer.
    pub(in crate::endpoint) fn begin_challenge(
        &mut self,
        now: Instant,
        id: JausId,
        challenge: Challenge,
    ) {
        let Some(state) = self.states.get_mut(&id) else {
            return;
        };
        let silence = now.saturating_duration_since(state.heard_on_route);
        let (incumbent, rival) = (challenge.incumbent.path, challenge.rival.map(|it| it.path));
        let challenge = Challenge {
            was_provisional: rival == Some(state.peer.path),
            at_once: rival.is_some_and(|rival| rival.is_near(incumbent))
                || silence >= route::SILENT,
            due: now + route::TRY_INTERVAL,
            ..challenge
        };
        self.challenges.due.insert((challenge.due, id));
        self.challenges.shares.add(challenge.cause(), 1);
        state.challenge = Some(challenge);
    }

    /// Processes an acknowledgement that no message awaits. Returns the challenge that it belongs
    /// to, if any, and its finding, if the acknowledgement decides it.
    pub(in crate::endpoint) fn answer_challenge(
        &mut self,
        arrival: Arrival<'_>,
    ) -> Option<(Challenge, Option<Finding>)> {
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
        if let Some(finding) = finding {
            self.settle(now, frame.source, finding);
        } else if incumbent.answered && state.peer.path == incumbent.path {
            self.set_route(frame.source, incumbent.path, RouteState::Verified);
        }
        self.raise(frame.source, Standing::Answered);
        Some((challenge, finding))
    }

    /// The next challenge that is due: the peer, the challenge and its finding; `None` as finding
    /// if it must be sent again.
    pub(in crate::endpoint) fn next_due(
        &mut self,
        now: Instant,
    ) -> Option<(JausId, Challenge, Option<Finding>)> {
        let &(due, id) = self.challenges.due.first()?;
        if due > now {
            return None;
        }
        let challenge = self.states.get_mut(&id)?.challenge.as_mut()?;
        let finding = challenge.handle_timeout(now);
        let challenge = *challenge;
        match finding {
            Some(finding) => self.settle(now, id, finding),
            None => {
                self.challenges.due.remove(&(due, id));
                self.challenges.due.insert((challenge.due, id));
            }
        }
        Some((id, challenge, finding))
    }

    /// When the next challenge is due.
    pub(in crate::endpoint) fn next_deadline(&self) -> Option<Instant> {
        self.challenges.due.first().map(|&(due, _)| due)
    }

    /// Applies the finding of a challenge.
    fn settle(&mut self, now: Instant, id: JausId, finding: Finding) {
        let Some(challenge) = self.end_challenge(id) else {
            return;
        };
        let Some(state) = self.states.get_mut(&id) else {
            return;
        };
        let before = challenge.incumbent.path;
        let (path, route) = match (finding, challenge.rival) {
            (Finding::Moves { verified }, Some(rival)) => {
                if !rival.path.is_near(before) {
                    state.recogniser = Recogniser::new();
                }
                (rival.path, RouteState::of(verified))
            }
            (Finding::Stays, _) => (before, RouteState::Verified),
            _ => (before, RouteState::of(challenge.was_verified)),
        };
        // Programs that run one after the other may share an id. The next move may follow a
        // verified one at once, and an unanswered challenge must not delay a move.
        match finding {
            Finding::Moves { verified: true } => {}
            Finding::Unanswered if challenge.rival.is_none() => {
                state.unanswered = Some((before, now + UNANSWERED));
            }
            _ => state.settled_until = Some(now + SETTLED),
        }
        self.set_route(id, path, route);
    }

    pub(super) fn end_challenge(&mut self, id: JausId) -> Option<Challenge> {
        let challenge = self.states.get_mut(&id)?.challenge.take()?;
        self.challenges.due.remove(&(challenge.due, id));
        self.challenges.shares.subtract(challenge.cause(), 1);
        Some(challenge)
    }
}
