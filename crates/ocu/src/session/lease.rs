//! The operator's control lease on the vehicle: which parts are wanted, and a session with each of
//! them.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

use super::client::Client;
use super::hold::Hold;
use crate::orders::Reply;
use crate::picture::Picture;
use crate::role::Role;
use crate::state;
use jaus::address::JausId;
use jaus::component::{Session, SessionError, SessionLoss, SessionState, TargetState};
use jaus::service::State;

/// The control lease: wanted and held parts.
#[derive(Default)]
pub(super) struct Lease {
    wanted: Wanted,
    /// The state of held parts, also after they restart: ready, as found, or standby because their
    /// previous client is lost. `None` from the start of this station until the operator or the
    /// vehicle's reported state has decided it.
    target: Option<TargetState>,
    holds: BTreeMap<JausId, Hold>,
    /// Requesters of control, waiting for the answers of the parts.
    waiting: Vec<Reply>,
}

/// The parts to control.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Wanted {
    #[default]
    Nothing,
    /// All drivers and the planner: the operator drives.
    Everything,
    /// The planner only, which controls the drivers itself.
    Planner,
}

impl Wanted {
    const fn takes_in(self, role: Role) -> bool {
        match self {
            Self::Nothing => false,
            Self::Everything => role.is_commanded(),
            Self::Planner => matches!(role, Role::Planner),
        }
    }
}

impl Lease {
    /// Limit of waiting requesters. Further ones are answered immediately.
    const MOST_WAITING: usize = 64;

    pub(super) const fn wanted(&self) -> Wanted {
        self.wanted
    }

    pub(super) fn is_ready(&self) -> bool {
        self.target == Some(TargetState::Ready)
    }

    /// Keeps the vehicle ready if this operator left it ready before the station restarted. Decided
    /// when control is taken, or as soon as the driver reports its controller.
    fn go_on_ready(&mut self, picture: &Picture, own: JausId) {
        if self.target.is_some() || self.wanted == Wanted::Nothing {
            return;
        }
        let known = picture.find(Role::PrimitiveDriver);
        let known = known.and_then(|id| Some((id, picture.parts().get(&id)?)));
        let Some((id, driver)) = known else {
            return;
        };
        // Immediately after the grant, the picture may still show its state under another client.
        let is_ready = match self.held(id) {
            Some(session) => session.check().is_ok(),
            None => driver.is(State::Ready),
        };
        match driver.reported_controller() {
            Some(holder) if holder != Some(own) => self.set_target(TargetState::AsFound),
            Some(_) if is_ready => self.set_target(TargetState::Ready),
            _ => {}
        }
    }

    /// The session with a part, if the part is held.
    pub(super) fn held(&self, part: JausId) -> Option<Arc<Session>> {
        self.holds.get(&part)?.held()
    }

    /// Whether a part has ended control by itself and is not yet under control again: it has restarted, or
    /// begins anew for another reason.
    pub(super) fn has_ended(&self, part: JausId) -> bool {
        let state = self.holds.get(&part).map(Hold::state);
        matches!(state, Some(SessionState::Lost { why, .. }) if match why {
            SessionLoss::Dropped => true,
            SessionLoss::State(_) => why.is_technical(),
            _ => why.is_restart(),
        })
    }

    /// The sessions with all held parts.
    pub(super) fn all_held(&self) -> Vec<Arc<Session>> {
        let parts = self.holds.keys();
        parts.filter_map(|part| self.held(*part)).collect()
    }

    /// Why a wanted part is not held, or not ready although it should be.
    pub(super) fn obstacle(&self, part: JausId) -> Option<String> {
        let state = self.holds.get(&part)?.state();
        let is_obstacle = match state {
            SessionState::Lost { .. } => true,
            SessionState::Standby(_) => self.is_ready(),
            _ => false,
        };
        is_obstacle.then(|| state.to_string())
    }

    /// Takes control. The reply follows when every part has answered.
    pub(super) fn take(
        &mut self,
        wanted: Wanted,
        reply: Reply,
        picture: &Picture,
        client: &mut Client,
    ) {
        self.wanted = wanted;
        // Request lost parts again, regardless of the controller.
        let is_lost = |hold: &Hold| matches!(hold.state(), SessionState::Lost { .. });
        self.holds.retain(|_, hold| !is_lost(hold));
        if self.waiting.len() < Self::MOST_WAITING {
            self.waiting.push(reply);
        } else {
            reply(Err("too many pending requests for control".to_owned()));
        }
        self.handle_time(picture, client);
    }

    /// Changes the wanted parts without a waiting requester. Returns the sessions to release.
    pub(super) fn want(&mut self, wanted: Wanted, picture: &Picture) -> Vec<Arc<Session>> {
        self.wanted = wanted;
        self.let_go(picture)
    }

    /// Takes control of everything for standby, because the vehicle's driving client is lost.
    pub(super) fn want_stopped(&mut self, picture: &Picture) {
        drop(self.want(Wanted::Everything, picture));
        self.set_target(TargetState::Standby);
    }

    /// Puts parts that are taken from another operator into standby.
    pub(super) fn stand_by(&mut self) {
        self.set_target(TargetState::Standby);
    }

    /// Whether the vehicle was stopped because its driving client was lost, and its drivers are
    /// held.
    pub(super) fn is_stopped(&self, picture: &Picture) -> bool {
        self.target == Some(TargetState::Standby) && self.state(picture).held
    }

    /// Releases everything. Returns the sessions to release.
    pub(super) fn release(&mut self, picture: &Picture) -> Vec<Arc<Session>> {
        self.target = Some(TargetState::AsFound);
        self.want(Wanted::Nothing, picture)
    }

    /// Decides whether held parts act on commands.
    pub(super) fn set_ready(&mut self, ready: bool) {
        match ready {
            true => self.set_target(TargetState::Ready),
            false if self.target == Some(TargetState::Standby) => {}
            false => self.set_target(TargetState::AsFound),
        }
    }

    fn set_target(&mut self, target: TargetState) {
        let is_new = self.target.replace(target) != Some(target);
        for hold in self.holds.values_mut() {
            hold.set_target(target, is_new);
        }
    }

    /// Handles the begin of a session.
    pub(super) fn handle_begun(&mut self, part: JausId, begun: Result<Session, SessionError>) {
        match begun {
            Ok(session) => {
                // Of a part that is no longer wanted, the session is dropped, which releases it.
                if let Some(hold) = self.holds.get_mut(&part) {
                    hold.begin(session, self.target.unwrap_or(TargetState::AsFound));
                }
            }
            Err(error) => tracing::warn!(%part, %error, "no session"),
        }
    }

    /// Begins sessions with wanted parts, and releases unwanted ones.
    pub(super) fn handle_time(&mut self, picture: &Picture, client: &mut Client) {
        drop(self.let_go(picture));
        let parts = picture.parts().iter();
        for (&id, _) in parts.filter(|(_, part)| self.wanted.takes_in(part.role)) {
            if let Entry::Vacant(vacant) = self.holds.entry(id) {
                vacant.insert(Hold::default());
                client.begin(id);
            }
        }
        self.go_on_ready(picture, client.component().id());
        for hold in self.holds.values_mut() {
            hold.log();
            hold.resume();
        }
        self.answer(picture);
    }

    /// Removes parts that are unwanted or absent. Returns the sessions to release.
    fn let_go(&mut self, picture: &Picture) -> Vec<Arc<Session>> {
        let mut free = Vec::new();
        let wanted = self.wanted;
        self.holds.retain(|id, hold| {
            let part = picture.parts().get(id);
            let keeps = part.is_some_and(|part| wanted.takes_in(part.role));
            if !keeps {
                free.extend(hold.take());
            }
            keeps
        });
        free
    }

    /// Answers the requesters once every part has answered.
    fn answer(&mut self, picture: &Picture) {
        let asking = |hold: &Hold| {
            matches!(
                hold.state(),
                SessionState::Seeking | SessionState::Requesting(_)
            )
        };
        if self.waiting.is_empty() || self.holds.values().any(asking) {
            return;
        }
        let state = self.state(picture);
        for reply in self.waiting.drain(..) {
            reply(if state.held {
                Ok(())
            } else if self.wanted == Wanted::Nothing {
                Err("control was released in the meantime".to_owned())
            } else {
                Err(state.reason.clone())
            });
        }
    }

    /// The part without which the operator cannot act.
    fn principal(&self, picture: &Picture) -> Option<JausId> {
        let driver = || picture.find(Role::PrimitiveDriver);
        let planner = || picture.find(Role::Planner);
        match self.wanted {
            Wanted::Planner => planner(),
            Wanted::Everything | Wanted::Nothing => driver().or_else(planner),
        }
    }

    /// Snapshot for pages.
    pub(super) fn state(&self, picture: &Picture) -> state::Control {
        let principal = self.principal(picture);
        let held = principal.is_some_and(|part| self.held(part).is_some());
        let wanted = self.wanted != Wanted::Nothing;
        let reason = if wanted && principal.is_none() {
            "the vehicle has no primitive driver and no planner".to_owned()
        } else {
            self.reasons(picture)
        };
        state::Control {
            held,
            wanted,
            reason,
            ..state::Control::default()
        }
    }

    /// Whether another client has taken control of the part without which the operator cannot act.
    pub(super) fn is_taken(&self, picture: &Picture) -> bool {
        let principal = self
            .principal(picture)
            .and_then(|part| self.holds.get(&part));
        let state = principal.map(Hold::state);
        matches!(state, Some(SessionState::Lost { why, .. }) if why.is_opposition())
    }

    fn reasons(&self, picture: &Picture) -> String {
        let reasons = self.holds.iter().filter_map(|(id, hold)| {
            let SessionState::Lost { why, .. } = hold.state() else {
                return None;
            };
            let role = picture.parts().get(id).map_or(Role::Other, |it| it.role);
            Some(format!("{}: {why}", role.words()))
        });
        reasons.collect::<Vec<_>>().join("; ")
    }
}
