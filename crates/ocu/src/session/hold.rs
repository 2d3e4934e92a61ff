//! The lease of one part of a vehicle.

use std::sync::Arc;

use jaus::component::{Session, SessionState, TargetState};

/// The session with one part.
#[derive(Default)]
pub(super) struct Hold {
    /// `None` until the session has begun.
    session: Option<Arc<Session>>,
    /// Whether the vehicle was resumed since this part was ready. A part that reports the end of
    /// an emergency later than others, or is under control later, would otherwise stand by for good.
    resuming: bool,
    /// The state that was logged.
    logged: Option<SessionState>,
}

impl Hold {
    /// Takes the session that has begun. A second one is dropped, which releases it.
    pub(super) fn begin(&mut self, session: Session, target: TargetState) {
        if self.session.is_none() {
            direct(&session, target);
            self.session = Some(Arc::new(session));
        }
    }

    pub(super) fn state(&self) -> SessionState {
        let session = self.session.as_ref();
        session.map_or(SessionState::Seeking, |it| it.state())
    }

    /// The session, if the part is held.
    pub(super) fn held(&self) -> Option<Arc<Session>> {
        let session = self.session.as_ref()?;
        session.state().held().map(|_| Arc::clone(session))
    }

    /// Removes the session.
    pub(super) fn take(&mut self) -> Option<Arc<Session>> {
        self.session.take()
    }

    /// Sets the state of the part, and orders it if it is new.
    pub(super) fn set_target(&mut self, target: TargetState, is_new: bool) {
        self.resuming = target == TargetState::Ready;
        if is_new && let Some(session) = &self.session {
            direct(session, target);
        }
    }

    /// Makes it ready if the operator resumed the vehicle while it could not be.
    pub(super) fn resume(&mut self) {
        let state = self.state();
        if !self.resuming || !matches!(state, SessionState::Ready(_) | SessionState::Standby(_)) {
            return;
        }
        self.resuming = false;
        if let (SessionState::Standby(_), Some(session)) = (state, &self.session) {
            direct(session, TargetState::Ready);
        }
    }

    /// Logs a new state.
    pub(super) fn log(&mut self) {
        let state = self.state();
        if self.logged.replace(state) != Some(state) {
            tracing::info!("{state}");
        }
    }
}

/// Orders the state of a part. Without its component, the session has no further use.
fn direct(session: &Session, target: TargetState) {
    if let Err(error) = session.set_target(target) {
        tracing::debug!(%error, "not ordered");
    }
}
