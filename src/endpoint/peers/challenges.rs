//! The challenges in progress: their deadlines, their limits and their outcome.

use std::collections::{BTreeSet, HashMap};
use std::time::{Duration, Instant};

use super::places::Standing;
use super::{Answer, Challenge, Doubt, Finding, Peers, Probe, RouteState, route};
use crate::address::JausId;
use crate::endpoint::Path;
use crate::endpoint::rate::Origin;
use crate::peer::Recogniser;
use crate::wire::Frame;

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
    shares: HashMap<Origin, usize>,
}

impl Challenges {
    /// Whether traffic from an address may start one more challenge.
    pub(super) fn has_room(&self, cause: Origin) -> bool {
        let share = self.shares.get(&cause).copied().unwrap_or_default();
        self.due.len() < MOST && share < MOST_OF_ADDRESS
    }

    pub(super) fn begin(&mut self, due: Instant, id: JausId, cause: Origin) {
        self.due.insert((due, id));
        *self.shares.entry(cause).or_default() += 1;
    }

    pub(super) fn postpone(&mut self, id: JausId, from: Instant, to: Instant) {
        self.due.remove(&(from, id));
        self.due.insert((to, id));
    }

    pub(super) fn end(&mut self, due: Instant, id: JausId, cause: Origin) {
        self.due.remove(&(due, id));
        if let Some(share) = self.shares.get_mut(&cause) {
            *share -= 1;
            if *share == 0 {
                self.shares.remove(&cause);
            }
        }
    }

    /// The challenge that is due first.
    pub(super) fn first(&self) -> Option<(Instant, JausId)> {
        self.due.first().copied()
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

    /// Records a challenge sent with these probes: to the peer's path and, if it has a rival, to
    /// both.
    pub(in crate::endpoint) fn begin_challenge(
        &mut self,
        now: Instant,
        id: JausId,
        doubt: Doubt,
        incumbent: Probe,
        rival: Option<Probe>,
    ) {
        let Some(state) = self.states.get_mut(&id) else {
            return;
        };
        let silence = now.saturating_duration_since(state.heard_on_route);
        let is_near = |rival: Probe| rival.path.is_near(incumbent.path);
        let due = now + route::TRY_INTERVAL;
        let challenge = Challenge {
            doubt,
            incumbent,
            rival,
            was_provisional: rival.is_some_and(|rival| rival.path == state.peer.path),
            at_once: rival.is_some_and(is_near) || silence >= route::SILENT,
            rival_answered: doubt.rival_is_stream,
            incumbent_heard: false,
            incumbent_answered: false,
            tries: 1,
            due,
        };
        self.challenges.begin(due, id, challenge.cause());
        state.challenge = Some(challenge);
    }

    /// Processes an acknowledgement that no message awaits: the challenge that it belongs to, if
    /// any, and its effect.
    pub(in crate::endpoint) fn answer_challenge(
        &mut self,
        now: Instant,
        frame: &Frame,
        from: Path,
    ) -> Option<(Answer, Challenge)> {
        let state = self.states.get_mut(&frame.source)?;
        let challenge = state.challenge.as_mut()?;
        let answer = challenge.handle_answer(frame.destination, frame.sequence, from)?;
        let challenge = *challenge;
        if challenge.has_proven_rival(frame.sequence) && !state.also_at.contains(&from) {
            if state.also_at.len() == MOST_WAYS {
                state.also_at.remove(0);
            }
            state.also_at.push(from);
        }
        let is_at_home = state.peer.path == challenge.incumbent.path;
        if let Answer::Decides(finding) = answer {
            self.settle(now, frame.source, finding);
        } else if challenge.incumbent_answered && is_at_home {
            self.set_route(frame.source, challenge.incumbent.path, RouteState::Verified);
        }
        self.raise(frame.source, Standing::Answered);
        Some((answer, challenge))
    }

    /// The next challenge that is due: the peer, the challenge and its finding; `None` as finding
    /// if it must be sent again.
    pub(in crate::endpoint) fn next_due(
        &mut self,
        now: Instant,
    ) -> Option<(JausId, Challenge, Option<Finding>)> {
        let (due, id) = self.challenges.first()?;
        if due > now {
            return None;
        }
        let challenge = self.states.get_mut(&id)?.challenge.as_mut()?;
        let finding = challenge.handle_timeout(now);
        let challenge = *challenge;
        match finding {
            Some(finding) => self.settle(now, id, finding),
            None => self.challenges.postpone(id, due, challenge.due),
        }
        Some((id, challenge, finding))
    }

    /// When the next challenge is due.
    pub(in crate::endpoint) fn next_deadline(&self) -> Option<Instant> {
        self.challenges.first().map(|(due, _)| due)
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
            _ => (before, RouteState::of(challenge.doubt.was_verified)),
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
        self.challenges.end(challenge.due, id, challenge.cause());
        Some(challenge)
    }
}
