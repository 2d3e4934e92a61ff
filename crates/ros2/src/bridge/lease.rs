//! Control of one component of the vehicle: requested when it is wanted, released when it is not, and
//! never taken again by itself.

use std::sync::Arc;

use jaus::address::JausId;
use jaus::component::{
    Component, Retake, Session, SessionError, SessionSettings, SessionState, TargetState,
};

use super::drive::Access;

/// The control of a component that the bridge wants or has.
#[derive(Debug, Default)]
pub(super) struct Lease {
    phase: Phase,
    /// The state that was logged.
    logged: Option<SessionState>,
    /// Why control was last refused or lost; empty while there is no reason.
    obstacle: String,
}

#[derive(Debug, Default)]
enum Phase {
    #[default]
    Free,
    /// Until the session has begun.
    Beginning(JausId),
    Begun {
        peer: JausId,
        session: Arc<Session>,
        /// Whether it was ready. From then on, the component is not made ready again: its standby
        /// has a reason.
        was_ready: bool,
    },
}

impl Lease {
    /// Requests or releases control. Returns the component with which a session has to be
    /// [begun](begin).
    pub(super) fn want(&mut self, peer: Option<JausId>) -> Option<JausId> {
        if self.peer() == peer {
            return None;
        }
        // Dropping the session releases control.
        self.phase = peer.map_or(Phase::Free, Phase::Beginning);
        self.logged = None;
        if peer.is_some() {
            self.obstacle.clear();
        }
        peer
    }

    /// Handles the begin of a session.
    pub(super) fn handle_begun(&mut self, peer: JausId, begun: Result<Session, SessionError>) {
        // Otherwise it is no longer wanted, and dropping it releases control.
        if !matches!(self.phase, Phase::Beginning(it) if it == peer) {
            return;
        }
        match begun {
            Ok(session) => {
                self.phase = Phase::Begun {
                    peer,
                    session: Arc::new(session),
                    was_ready: false,
                };
            }
            Err(error) => {
                self.phase = Phase::Free;
                self.obstacle = error.to_string();
            }
        }
    }

    /// How far control is; `None` if it is not wanted.
    pub(super) fn access(&mut self) -> Option<Access> {
        let Phase::Begun {
            session, was_ready, ..
        } = &mut self.phase
        else {
            return self.peer().map(|_| Access::Pending);
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
        if access == Access::Lost {
            self.obstacle = state.to_string();
        }
        Some(access)
    }

    /// The session, if the component obeys.
    pub(super) fn session(&self) -> Option<&Arc<Session>> {
        match &self.phase {
            Phase::Begun { session, .. } if session.check().is_ok() => Some(session),
            _ => None,
        }
    }

    const fn peer(&self) -> Option<JausId> {
        match &self.phase {
            Phase::Free => None,
            Phase::Beginning(peer) | Phase::Begun { peer, .. } => Some(*peer),
        }
    }

    /// Why control was last refused or lost; empty while there is no reason.
    pub(super) fn obstacle(&self) -> &str {
        &self.obstacle
    }

    /// The state of control, for people.
    pub(super) fn words(&self) -> String {
        match &self.phase {
            Phase::Free if self.obstacle.is_empty() => "not wanted".to_owned(),
            Phase::Free => self.obstacle.clone(),
            Phase::Beginning(peer) => format!("control of {peer} is requested"),
            Phase::Begun { session, .. } => session.state().to_string(),
        }
    }
}

/// Begins a session that makes the component ready and takes control once.
pub(super) async fn begin(
    component: &Component,
    peer: JausId,
    authority: u8,
) -> Result<Session, SessionError> {
    let settings = SessionSettings::new(authority)
        .retake(Retake::Never)
        .target(TargetState::Ready);
    component.session(peer, settings).await
}
