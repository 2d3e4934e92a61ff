//! Control over a peer in the hands of an application.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use tokio::sync::watch;

use super::clients::{Condition, Ticket};
use super::{Component, ControlError, ManageError};
use crate::address::JausId;
use crate::codec::Message;
use crate::messages::core::{
    ClearEmergency, QueryStatus, ReportStatus, Reset, Resume, SetEmergency, Standby,
};
use crate::service::State;
use crate::wire::Priority;

/// How long a peer may take to reach a state …
const STATE_LIMIT: Duration = Duration::from_secs(1);
/// … and how often it is asked meanwhile.
const STATE_PAUSE: Duration = Duration::from_millis(100);

/// Exclusive control over a component. Made by [`Component::control`]; it renews itself, and
/// dropping it gives control back.
///
/// Control can be lost at any time: to a client with a greater authority, to an emergency, to a
/// restart of the peer, to a broken network. It is not requested again automatically, because
/// another client may have had a reason to take it.
///
/// While control is held the peer's status is asked for five times a second. After
/// [`resume`](Self::resume) commands can be sent as long as the peer says that it is ready.
#[derive(Debug)]
pub struct Control {
    /// Dropped before the component is.
    ticket: Ticket,
    component: Component,
    peer: JausId,
    condition: watch::Receiver<Condition>,
    /// Whether the application has made the peer ready, and not put it into standby since.
    expects_ready: AtomicBool,
}

impl Control {
    pub(super) const fn new(
        ticket: Ticket,
        component: Component,
        peer: JausId,
        condition: watch::Receiver<Condition>,
    ) -> Self {
        Self {
            ticket,
            component,
            peer,
            condition,
            expects_ready: AtomicBool::new(false),
        }
    }

    /// What is controlled.
    #[must_use]
    pub const fn peer(&self) -> JausId {
        self.peer
    }

    /// Whether control is held, as far as is known now.
    #[must_use]
    pub fn is_held(&self) -> bool {
        self.check_held().is_ok()
    }

    /// Waits until control is lost, and says why. Waits for ever while it is held.
    pub async fn lost(&mut self) -> ControlError {
        let is_over = |now: &Condition| !matches!(now, Condition::Held(_));
        drop(self.condition.wait_for(is_over).await);
        match self.check_held() {
            Err(error) => error,
            Ok(()) => ControlError::Stopped,
        }
    }

    /// Sends a command and forgets it.
    ///
    /// # Errors
    /// Those of [`check`](Self::check), or if the message could not be sent.
    pub fn send<M: Message>(&self, command: &M) -> Result<(), ControlError> {
        self.check()?;
        Ok(self.component.send(self.peer, command)?)
    }

    /// Sends a command until the peer acknowledges it. That says that the peer has it, not that it
    /// has carried it out.
    ///
    /// # Errors
    /// Those of [`check`](Self::check), or if the message is not known to have arrived.
    pub async fn deliver<M: Message>(&self, command: &M) -> Result<(), ControlError> {
        self.check()?;
        Ok(self.component.deliver(self.peer, command).await?)
    }

    /// Makes the peer act on commands, and waits until it says that it is ready.
    ///
    /// # Errors
    /// If control is lost, or the peer does not say so.
    pub async fn resume(&self) -> Result<(), ManageError> {
        self.manage(&Resume {}, State::Ready).await?;
        self.expects_ready.store(true, Ordering::Relaxed);
        Ok(())
    }

    /// Makes the peer stop and wait, and waits until it says that it does.
    ///
    /// # Errors
    /// If control is lost, or the peer does not say so.
    pub async fn standby(&self) -> Result<(), ManageError> {
        self.expects_ready.store(false, Ordering::Relaxed);
        self.manage(&Standby {}, State::Standby).await
    }

    /// Makes the peer begin anew, which ends control.
    ///
    /// # Errors
    /// If control is lost, or the peer does not have it.
    pub async fn reset(self) -> Result<(), ControlError> {
        self.deliver(&Reset {}).await
    }

    /// Gives control back, and waits until the peer has confirmed that, or has been asked to often
    /// enough. Dropping does the same without waiting.
    pub async fn release(self) {
        let Self {
            ticket,
            mut condition,
            ..
        } = self;
        drop(ticket);
        let ended = |now: &Condition| *now == Condition::Released;
        // An error means that the component has stopped, and took leave then.
        let _ = condition.wait_for(ended).await;
    }

    async fn manage<M: Message>(&self, command: &M, wanted: State) -> Result<(), ManageError> {
        self.check_held()?;
        self.component
            .bring(Priority::High, self.peer, command, wanted)
            .await
    }

    /// Whether commands can be sent.
    ///
    /// # Errors
    /// If control is lost: why. [`ControlError::NotReady`] if the peer was made ready and has said
    /// since that it is in another state; [`resume`](Self::resume) may help.
    pub fn check(&self) -> Result<(), ControlError> {
        self.check_held()?;
        match *self.condition.borrow() {
            Condition::Held(Some(state))
                if state != State::Ready as u8 && self.expects_ready.load(Ordering::Relaxed) =>
            {
                Err(ControlError::NotReady {
                    peer: self.peer,
                    state,
                })
            }
            _ => Ok(()),
        }
    }

    fn check_held(&self) -> Result<(), ControlError> {
        match *self.condition.borrow() {
            Condition::Held(_) if self.condition.has_changed().is_ok() => Ok(()),
            Condition::Lost(why) => Err(ControlError::Lost {
                peer: self.peer,
                why,
            }),
            Condition::Held(_) | Condition::Released => Err(ControlError::Stopped),
        }
    }
}

impl Component {
    /// Stops a peer that offers Management, controlled or not, until
    /// [`clear_emergency`](Self::clear_emergency) from this component; waits until it says that it
    /// has stopped. Anybody may do that.
    ///
    /// # Errors
    /// If the peer does not say that it has stopped.
    pub async fn set_emergency(&self, peer: JausId) -> Result<(), ManageError> {
        let set = SetEmergency {
            emergency_code: 1.into(),
        };
        self.bring(Priority::SafetyCritical, peer, &set, State::Emergency)
            .await
    }

    /// Takes an emergency back that this component has set, and waits until the peer says that it is
    /// over, or for a second: it is not if another component has set one, too.
    ///
    /// # Errors
    /// If the peer does not say how it is.
    pub async fn clear_emergency(&self, peer: JausId) -> Result<(), ManageError> {
        let clear = ClearEmergency {
            emergency_code: 1.into(),
        };
        let over = |state: u8| state != State::Emergency as u8;
        self.tell_until(Priority::SafetyCritical, peer, &clear, over)
            .await
            .map(drop)
    }

    /// Tells a peer to be in a state, until it says that it is.
    async fn bring<M: Message>(
        &self,
        priority: Priority,
        peer: JausId,
        command: &M,
        wanted: State,
    ) -> Result<(), ManageError> {
        let reached = |state: u8| state == wanted as u8;
        match self.tell_until(priority, peer, command, reached).await? {
            found if reached(found) => Ok(()),
            found => Err(ManageError::State {
                peer,
                wanted,
                found,
            }),
        }
    }

    /// Gives a command again and again, for a second at least, until the status is as wanted: what
    /// is big takes a moment to change, and some peers never acknowledge that they were told. Says
    /// what the status is in the end.
    async fn tell_until<M: Message>(
        &self,
        priority: Priority,
        peer: JausId,
        command: &M,
        wanted: impl Fn(u8) -> bool,
    ) -> Result<u8, ManageError> {
        let start = Instant::now();
        loop {
            self.send_with(priority, peer, command)
                .map_err(ControlError::from)?;
            let report: ReportStatus = self.query(peer, &QueryStatus {}).await?;
            let found = report.status.0;
            if wanted(found) || start.elapsed() > STATE_LIMIT {
                return Ok(found);
            }
            tokio::time::sleep(STATE_PAUSE).await;
        }
    }
}
