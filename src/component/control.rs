//! Control over a peer in the hands of an application.

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

/// How long a peer may take to reach a state …
const STATE_LIMIT: Duration = Duration::from_secs(1);
/// … and how often it is asked meanwhile.
const STATE_PAUSE: Duration = Duration::from_millis(100);

/// Exclusive control over a component. Made by [`Component::control`]; it renews itself, and
/// dropping it gives control back.
///
/// Control can be lost at any time: to a client with a greater authority, to an emergency, to a
/// broken network. It is not asked for again by itself, because whoever took it had a reason.
#[derive(Debug)]
pub struct Control {
    /// Dropped before the component is.
    ticket: Ticket,
    component: Component,
    peer: JausId,
    condition: watch::Receiver<Condition>,
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
        self.check().is_ok()
    }

    /// Waits until control is lost, and says why. Waits for ever while it is held.
    pub async fn lost(&mut self) -> ControlError {
        let over = self.condition.wait_for(|now| *now != Condition::Held).await;
        drop(over);
        match self.check() {
            Err(error) => error,
            Ok(()) => ControlError::Stopped,
        }
    }

    /// Sends a command and forgets it.
    ///
    /// # Errors
    /// If control is lost, or the message could not be sent.
    pub fn send<M: Message>(&self, command: &M) -> Result<(), ControlError> {
        self.check()?;
        Ok(self.component.send(self.peer, command)?)
    }

    /// Sends a command until the peer acknowledges it. That says that the peer has it, not that it
    /// has carried it out.
    ///
    /// # Errors
    /// If control is lost, or the message is not known to have arrived.
    pub async fn deliver<M: Message>(&self, command: &M) -> Result<(), ControlError> {
        self.check()?;
        Ok(self.component.deliver(self.peer, command).await?)
    }

    /// Makes the peer act on commands, and waits until it says that it is ready.
    ///
    /// # Errors
    /// If control is lost, or the peer does not say so.
    pub async fn resume(&self) -> Result<(), ManageError> {
        self.manage(&Resume {}, State::Ready).await
    }

    /// Makes the peer stop and wait, and waits until it says that it does.
    ///
    /// # Errors
    /// If control is lost, or the peer does not say so.
    pub async fn standby(&self) -> Result<(), ManageError> {
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
        self.check()?;
        self.component.bring(self.peer, command, wanted).await
    }

    /// The same as [`is_held`](Self::is_held), with the reason.
    ///
    /// # Errors
    /// If control is lost: why.
    pub fn check(&self) -> Result<(), ControlError> {
        match *self.condition.borrow() {
            Condition::Held if self.condition.has_changed().is_ok() => Ok(()),
            Condition::Lost(why) => Err(ControlError::Lost {
                peer: self.peer,
                why,
            }),
            Condition::Held | Condition::Released => Err(ControlError::Stopped),
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
        self.bring(peer, &set, State::Emergency).await
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
        self.tell_until(peer, &clear, over).await.map(drop)
    }

    /// Tells a peer to be in a state, until it says that it is.
    async fn bring<M: Message>(
        &self,
        peer: JausId,
        command: &M,
        wanted: State,
    ) -> Result<(), ManageError> {
        let reached = |state: u8| state == wanted as u8;
        match self.tell_until(peer, command, reached).await? {
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
        peer: JausId,
        command: &M,
        wanted: impl Fn(u8) -> bool,
    ) -> Result<u8, ManageError> {
        let start = Instant::now();
        loop {
            self.send(peer, command).map_err(ControlError::from)?;
            let report: ReportStatus = self.query(peer, &QueryStatus {}).await?;
            let found = report.status.0;
            if wanted(found) || start.elapsed() > STATE_LIMIT {
                return Ok(found);
            }
            tokio::time::sleep(STATE_PAUSE).await;
        }
    }
}
