//! The application's handle for a session.

use std::time::Duration;

use tokio::sync::watch;
use tokio::time::timeout;

use super::clients::{Begun, Hold, Instruction, Ticket};
use super::{Component, SessionError};
use crate::address::JausId;
use crate::codec::Message;
use crate::service::{
    Audience, SessionId, SessionOrder, SessionSettings, SessionState, TargetState,
};

/// The status of a peer under control is reported again within this time, even if reports are lost.
const STATUS_LIMIT: Duration = Duration::from_millis(500);

/// Control of any one member of an audience, kept through its restarts. Created by
/// [`Component::session`]. Dropping it releases control.
///
/// The session finds a member, takes control, brings it into the [`TargetState`] and watches it. Its
/// [state](Self::state) says whether commands can be sent, and if not, why. After a loss it begins
/// anew as its [`Retake`](super::Retake) policy says, with the same member if that is present. After an emergency
/// or another client's control it does so in standby: the application decides when to
/// [`resume`](Self::resume).
///
/// To control one component without a search and without beginning anew, see
/// [`Control`](super::Control).
///
/// ```no_run
/// # use jaus::component::{Session, SessionError, SessionState};
/// # use jaus::messages::mobility::SetWrenchEffort;
/// # async fn example(mut session: Session) -> Result<(), SessionError> {
/// loop {
///     match session.state() {
///         SessionState::Ready(_) => session.send(&SetWrenchEffort::default())?,
///         other => println!("no commands now: {other:?}"),
///     }
///     session.changed().await?;
/// }
/// # }
/// ```
#[derive(Debug)]
pub struct Session {
    /// Dropped before the component.
    ticket: Ticket,
    component: Component,
    id: SessionId,
    state: watch::Receiver<SessionState>,
}

impl Session {
    /// Its state.
    #[must_use]
    pub fn state(&self) -> SessionState {
        *self.state.borrow()
    }

    /// Waits until the state changes, and returns it.
    ///
    /// # Errors
    /// [`SessionError::Stopped`].
    pub async fn changed(&mut self) -> Result<SessionState, SessionError> {
        let changed = self.state.changed().await;
        changed.map_err(|_| SessionError::Stopped)?;
        Ok(*self.state.borrow_and_update())
    }

    /// Waits until a peer is ready, however often it is lost meanwhile, and returns its id.
    ///
    /// # Errors
    /// [`SessionError::State`] if the session does not take control again by itself, or if the peer
    /// is under control and is not to be made ready.
    pub async fn ready(&self) -> Result<JausId, SessionError> {
        self.wait(|state| match state {
            SessionState::Ready(peer) => Some(Ok(peer)),
            SessionState::Standby(_)
            | SessionState::Lost {
                continues: false, ..
            } => Some(Err(state)),
            _ => None,
        })
        .await
    }

    /// Makes the peer ready, now and after restarts, and waits until it is.
    ///
    /// This is a decision about the peer as it is: while the peer is lost, the state in which it will
    /// be found again is not known, so the target state stays as it is. An application that decides
    /// in advance uses [`set_target`](Self::set_target).
    ///
    /// # Errors
    /// [`SessionError::State`] if the peer is lost or disabled at present, for instance because of
    /// an emergency. Otherwise as [`ready`](Self::ready).
    pub async fn resume(&self) -> Result<JausId, SessionError> {
        // The end of an emergency may not have been reported to this session yet.
        let is_disabled = |state| matches!(state, SessionState::Disabled { .. });
        let enabled = self.wait(|state| (!is_disabled(state)).then_some(Ok(())));
        let _ = timeout(STATUS_LIMIT, enabled).await;
        let state = self.state();
        if is_disabled(state) || matches!(state, SessionState::Lost { .. }) {
            return Err(SessionError::State(state));
        }
        self.set_target(TargetState::Ready)?;
        // The order ends this state.
        self.wait(|state| (!matches!(state, SessionState::Standby(_))).then_some(Ok(())))
            .await?;
        self.ready().await
    }

    /// Puts the peer into standby, now and after restarts, and waits until it reports that.
    ///
    /// # Errors
    /// [`SessionError::State`] if the peer is lost or disabled.
    pub async fn standby(&self) -> Result<JausId, SessionError> {
        self.set_target(TargetState::Standby)?;
        self.wait(|state| match state {
            SessionState::Standby(peer) => Some(Ok(peer)),
            SessionState::Lost { .. } | SessionState::Disabled { .. } => Some(Err(state)),
            _ => None,
        })
        .await
    }

    /// Brings the peer into this state, now and after restarts, without waiting for it. While the peer
    /// is lost, it is brought into this state when it is under control again. Ready has no effect
    /// while an emergency is the last that the peer has reported.
    ///
    /// # Errors
    /// [`SessionError::Stopped`].
    pub fn set_target(&self, target: TargetState) -> Result<(), SessionError> {
        self.order(SessionOrder::Target(target))
    }

    /// Takes control again, at once. The [`Retake`](super::Retake) policy says when that is needed.
    ///
    /// # Errors
    /// [`SessionError::Stopped`].
    pub fn retake(&self) -> Result<(), SessionError> {
        self.order(SessionOrder::Retake)
    }

    /// The peer, if it obeys commands.
    ///
    /// # Errors
    /// [`SessionError::State`] if it does not.
    pub fn check(&self) -> Result<JausId, SessionError> {
        match self.state() {
            SessionState::Ready(peer) => Ok(peer),
            other => Err(SessionError::State(other)),
        }
    }

    /// Sends a command without acknowledgement.
    ///
    /// # Errors
    /// Those of [`check`](Self::check), or if the message could not be sent.
    pub fn send<M: Message>(&self, command: &M) -> Result<(), SessionError> {
        let peer = self.check()?;
        Ok(self.component.send(peer, command)?)
    }

    /// Sends a command with retransmission until the peer acknowledges it. The acknowledgement
    /// confirms the arrival, not the execution.
    ///
    /// # Errors
    /// Those of [`check`](Self::check), or if delivery is not confirmed.
    pub async fn deliver<M: Message>(&self, command: &M) -> Result<(), SessionError> {
        let peer = self.check()?;
        Ok(self.component.deliver(peer, command).await?)
    }

    /// Releases control, and waits until the peer confirms or the release times out. Dropping does
    /// the same without waiting.
    pub async fn release(self) {
        let mut state = self.state.clone();
        // The component lives until the end.
        let _component = self.component.clone();
        drop(self);
        // An error means that the component has stopped, which has released control.
        let _ = state.wait_for(|it| *it == SessionState::Released).await;
    }

    fn order(&self, order: SessionOrder) -> Result<(), SessionError> {
        let is_sent = self.ticket.instruct(Instruction::Session(self.id, order));
        is_sent.then_some(()).ok_or(SessionError::Stopped)
    }

    /// Waits for a state that ends an operation, well or not.
    async fn wait<T>(
        &self,
        end: impl Fn(SessionState) -> Option<Result<T, SessionState>>,
    ) -> Result<T, SessionError> {
        let mut states = self.state.clone();
        let state = states.wait_for(|it| end(*it).is_some()).await;
        let state = *state.map_err(|_| SessionError::Stopped)?;
        end(state)
            .unwrap_or(Err(state))
            .map_err(SessionError::State)
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        if let Some(peer) = self.state().held() {
            self.component.release_now(peer);
        }
    }
}

impl Component {
    /// Begins a session: finds a member of the audience, takes control of it, makes it ready, and
    /// keeps it so through restarts. An authority suffices as settings: from 0 to 255; the higher one
    /// wins.
    ///
    /// ```no_run
    /// # use jaus::component::{Audience, Component, SessionError};
    /// # use jaus::messages::mobility::{SetWrenchEffort, primitive_driver};
    /// # async fn drive(operator: Component) -> Result<(), SessionError> {
    /// let driver = Audience::from(primitive_driver::LATEST).in_subsystem(101);
    /// let session = operator.session(driver, 127).await?;
    /// let rover = session.ready().await?;
    /// println!("{rover} is ready");
    /// session.send(&SetWrenchEffort::default())?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`SessionError::Stopped`].
    pub async fn session(
        &self,
        audience: impl Into<Audience>,
        settings: impl Into<SessionSettings>,
    ) -> Result<Session, SessionError> {
        let (audience, settings) = (audience.into(), settings.into());
        let begun = self.hold(|reply| Hold::Session {
            audience,
            settings,
            reply,
        });
        let Begun { id, ticket, state } = begun.await.ok_or(SessionError::Stopped)?;
        Ok(Session {
            ticket,
            component: self.clone(),
            id,
            state,
        })
    }
}
