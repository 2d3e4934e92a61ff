//! The application's handle for a session.

use tokio::sync::watch;

use super::clients::{Begun, Hold, Ticket};
use super::driver::Command;
use super::{Component, SessionError};
use crate::address::JausId;
use crate::codec::Message;
use crate::service::{Audience, Retake, SessionId, SessionOrder, SessionState};

/// Control of any one member of an audience, kept through its restarts. Created by
/// [`Component::session`]. Dropping it releases control.
///
/// The session finds a member, takes control, makes it ready and watches it. Its
/// [state](Self::state) says whether commands can be sent, and if not, why. After a loss it begins
/// anew as its [`Retake`] policy says, with the same member if that is present. After an emergency
/// or another client's control it does so in standby: the application decides when to
/// [`resume`](Self::resume).
///
/// To control one component without a search and without beginning anew, see
/// [`Control`](super::Control).
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
    /// [`SessionError::Lost`] if the session does not take control again by itself.
    /// [`SessionError::Standby`] if the peer is under control and is not to be made ready.
    pub async fn ready(&mut self) -> Result<JausId, SessionError> {
        self.wait(|state| match state {
            SessionState::Ready(peer) => Some(Ok(peer)),
            SessionState::Lost {
                peer,
                why,
                continues: false,
            } => Some(Err(SessionError::Lost { peer, why })),
            SessionState::Standby(peer) => Some(Err(SessionError::Standby(peer))),
            _ => None,
        })
        .await
    }

    /// Makes the peer ready, now and after restarts, and waits until it is.
    ///
    /// # Errors
    /// [`SessionError::Lost`] if the peer is lost at present, for instance because of an emergency.
    /// Otherwise as [`ready`](Self::ready).
    pub async fn resume(&mut self) -> Result<JausId, SessionError> {
        if let Err(lost @ SessionError::Lost { .. }) = self.check() {
            return Err(lost);
        }
        self.order(SessionOrder::Resume).await?;
        // The order ends this state.
        self.wait(|state| (!matches!(state, SessionState::Standby(_))).then_some(Ok(())))
            .await?;
        self.ready().await
    }

    /// Puts the peer into standby, now and after restarts, and waits until it reports that.
    ///
    /// # Errors
    /// [`SessionError::Lost`] if the peer is lost.
    pub async fn standby(&mut self) -> Result<JausId, SessionError> {
        self.order(SessionOrder::Standby).await?;
        self.wait(|state| match state {
            SessionState::Standby(peer) => Some(Ok(peer)),
            SessionState::Lost { peer, why, .. } => Some(Err(SessionError::Lost { peer, why })),
            _ => None,
        })
        .await
    }

    /// Takes control again, at once. [`Retake`] says when that is needed.
    ///
    /// # Errors
    /// [`SessionError::Stopped`].
    pub async fn retake(&self) -> Result<(), SessionError> {
        self.order(SessionOrder::Retake).await
    }

    /// The peer, if it obeys commands.
    ///
    /// # Errors
    /// The reason if it does not.
    pub fn check(&self) -> Result<JausId, SessionError> {
        match self.state() {
            SessionState::Ready(peer) => Ok(peer),
            SessionState::Engaging => Err(SessionError::Engaging),
            SessionState::Standby(peer) => Err(SessionError::Standby(peer)),
            SessionState::Lost { peer, why, .. } => Err(SessionError::Lost { peer, why }),
            SessionState::Released => Err(SessionError::Stopped),
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
        let Self {
            ticket, mut state, ..
        } = self;
        drop(ticket);
        // An error means that the component has stopped, which has released control.
        let _ = state.wait_for(|it| *it == SessionState::Released).await;
    }

    async fn order(&self, order: SessionOrder) -> Result<(), SessionError> {
        let commands = &self.component.shared.commands;
        let sent = commands.send(Command::Session(self.id, order)).await;
        sent.map_err(|_| SessionError::Stopped)
    }

    async fn wait<T>(
        &mut self,
        is_over: impl Fn(SessionState) -> Option<Result<T, SessionError>>,
    ) -> Result<T, SessionError> {
        let state = self.state.wait_for(|it| is_over(*it).is_some()).await;
        let state = *state.map_err(|_| SessionError::Stopped)?;
        is_over(state).unwrap_or(Err(SessionError::Stopped))
    }
}

impl Component {
    /// Begins a session: finds a member of the audience, takes control of it, makes it ready, and
    /// keeps it so through restarts. `authority` is from 0 to 255; the higher one wins.
    ///
    /// ```no_run
    /// # use jaus::component::{Audience, Component, Retake, SessionError};
    /// # use jaus::messages::mobility::{SetWrenchEffort, primitive_driver};
    /// # async fn drive(operator: Component) -> Result<(), SessionError> {
    /// let driver = Audience::from(primitive_driver::LATEST).in_subsystem(101);
    /// let mut session = operator.session(driver, 127, Retake::Unopposed).await?;
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
        authority: u8,
        retake: Retake,
    ) -> Result<Session, SessionError> {
        let audience = audience.into();
        let begun = self.hold(|reply| Hold::Session {
            audience,
            authority,
            retake,
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
