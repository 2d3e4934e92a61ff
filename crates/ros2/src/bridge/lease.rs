//! Control of one component of the vehicle: requested when it is wanted, released when it is not, and
//! never taken again by itself.

use std::sync::Arc;

use jaus::address::JausId;
use jaus::component::{
    Component, ControlRefused, Retake, Session, SessionError, SessionLoss, SessionSettings,
    SessionState, TargetState,
};

use super::drive::Access;
use super::rights::Said;
use super::vehicle::Role;

/// The control of a component that the bridge wants or has.
#[derive(Debug, Default)]
pub(super) struct Lease {
    phase: Phase,
    /// The state that was logged.
    logged: Option<SessionState>,
    /// Why control was last refused or lost; empty while there is no reason.
    obstacle: String,
    /// What the component has said about control since the last look.
    said: Option<(JausId, Said)>,
}

#[derive(Debug, Default)]
enum Phase {
    #[default]
    Free,
    /// Until the session has begun.
    Beginning(Target),
    Begun {
        target: Target,
        session: Arc<Session>,
        /// Whether it was ready. From then on, the component is not made ready again: its standby
        /// has a reason.
        was_ready: bool,
        /// What it said last about control.
        said: Option<Said>,
    },
}

/// A component, and the service by which it is commanded.
pub(super) type Target = (JausId, Role);

impl Lease {
    /// Requests or releases control. Returns the component with which a session has to be
    /// [begun](begin).
    pub(super) fn want(&mut self, target: Option<Target>) -> Option<JausId> {
        if self.target() == target {
            return None;
        }
        // Dropping the session releases control.
        self.phase = target.map_or(Phase::Free, Phase::Beginning);
        self.logged = None;
        if target.is_some() {
            self.obstacle.clear();
        }
        target.map(|(peer, _)| peer)
    }

    /// Handles the begin of a session.
    pub(super) fn handle_begun(&mut self, peer: JausId, begun: Result<Session, SessionError>) {
        // Otherwise it is no longer wanted, and dropping it releases control.
        let target = match self.phase {
            Phase::Beginning(target) if target.0 == peer => target,
            _ => return,
        };
        match begun {
            Ok(session) => {
                self.phase = Phase::Begun {
                    target,
                    session: Arc::new(session),
                    was_ready: false,
                    said: None,
                };
            }
            Err(error) => {
                self.phase = Phase::Free;
                self.obstacle = error.to_string();
            }
        }
    }

    /// The access to the component; `None` if it is not wanted.
    pub(super) fn access(&mut self) -> Option<Access> {
        let Phase::Begun {
            session,
            was_ready,
            said,
            target: (peer, _),
        } = &mut self.phase
        else {
            return self.target().map(|_| Access::Pending);
        };
        let state = session.state();
        if self.logged.replace(state) != Some(state) {
            tracing::info!("{state}");
        }
        let access = match state {
            SessionState::Seeking | SessionState::Requesting(_) | SessionState::Preparing(_) => {
                Access::Pending
            }
            SessionState::Ready(_) => Access::Ready,
            SessionState::Standby(_)
            | SessionState::Disabled { .. }
            | SessionState::Lost { .. }
            | SessionState::Released => Access::Lost,
        };
        if access == Access::Ready && !std::mem::replace(was_ready, true) {
            // Fails only if the component has stopped, which releases control.
            let _ = session.set_target(TargetState::AsFound);
        }
        let says = match (state, *said) {
            (state, None | Some(Said::Refused | Said::Ended)) if state.held().is_some() => {
                Some(Said::Granted)
            }
            (SessionState::Lost { why, .. }, None) if is_answer(why) => Some(Said::Refused),
            (SessionState::Lost { .. }, Some(Said::Granted)) => Some(Said::Ended),
            _ => None,
        };
        if says.is_some() {
            *said = says;
            self.said = says.map(|says| (*peer, says));
        }
        if access == Access::Lost {
            self.obstacle = state.to_string();
        }
        Some(access)
    }

    /// What the component has said about control since the last call.
    pub(super) fn take_said(&mut self) -> Option<(JausId, Said)> {
        self.said.take()
    }

    /// The session if the component obeys, and the service by which it is commanded.
    pub(super) fn session(&self) -> Option<(&Arc<Session>, Role)> {
        match &self.phase {
            Phase::Begun {
                session, target, ..
            } if session.check().is_ok() => Some((session, target.1)),
            _ => None,
        }
    }

    const fn target(&self) -> Option<Target> {
        match &self.phase {
            Phase::Free => None,
            Phase::Beginning(target) | Phase::Begun { target, .. } => Some(*target),
        }
    }

    /// Why control was last refused or lost; empty while there is no reason.
    pub(super) fn obstacle(&self) -> &str {
        &self.obstacle
    }

    /// The state of control, for people.
    pub(super) fn description(&self) -> String {
        match &self.phase {
            Phase::Free if self.obstacle.is_empty() => "not wanted".to_owned(),
            Phase::Free => self.obstacle.clone(),
            Phase::Beginning((peer, _)) => format!("control of {peer} is requested"),
            Phase::Begun { session, .. } => session.state().to_string(),
        }
    }
}

/// Whether a component has refused control, or does not answer.
const fn is_answer(why: SessionLoss) -> bool {
    matches!(why, SessionLoss::Refused(why) if !matches!(why, ControlRefused::NoAnswer(_)))
}

/// Begins a session that takes control once, and makes the component ready if it may.
pub(super) async fn begin(
    component: &Component,
    peer: JausId,
    authority: u8,
    may_resume: bool,
) -> Result<Session, SessionError> {
    let target = match may_resume {
        true => TargetState::Ready,
        false => TargetState::AsFound,
    };
    let settings = SessionSettings::new(authority)
        .retake(Retake::Never)
        .target(target);
    component.session(peer, settings).await
}

#[cfg(test)]
mod tests {
    use super::*;

    const PEER: JausId = JausId::new(101, 1, 33);

    #[test]
    fn a_component_that_is_commanded_by_another_service_gets_another_session() {
        let mut lease = Lease::default();
        let primitive = Some((PEER, Role::PrimitiveDriver));
        assert_eq!(lease.want(primitive), Some(PEER));
        assert_eq!(lease.want(primitive), None);
        assert_eq!(lease.want(Some((PEER, Role::VelocityDriver))), Some(PEER));
        assert_eq!(lease.want(None), None);
        assert_eq!(lease.target(), None);
    }
}
