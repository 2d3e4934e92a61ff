//! Control over a peer in the hands of an application.

use std::time::{Duration, Instant};

use tokio::sync::watch;

use super::clients::Ticket;
use super::{Component, ControlError, DeliverError, ManageError};
use crate::address::JausId;
use crate::codec::Message;
use crate::messages::core::{
    ClearEmergency, QueryStatus, ReportStatus, Reset, Resume, SetEmergency, Standby,
};
use crate::service::{ControlLost, State};

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

/// How control is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Condition {
    Held,
    Lost(ControlLost),
    /// The peer has been told, or will never answer.
    Released,
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
        self.deliver(command).await?;
        self.component.await_state(self.peer, wanted).await
    }

    fn check(&self) -> Result<(), ControlError> {
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
        self.deliver(peer, &set).await.map_err(undelivered)?;
        self.await_state(peer, State::Emergency).await
    }

    /// Takes an emergency back that this component has set. The peer stays as it is if another
    /// component has set one, too.
    ///
    /// # Errors
    /// If the peer does not have the message.
    pub async fn clear_emergency(&self, peer: JausId) -> Result<(), ManageError> {
        let clear = ClearEmergency {
            emergency_code: 1.into(),
        };
        self.deliver(peer, &clear).await.map_err(undelivered)
    }

    /// Asks a peer for its status until it is the wanted one, for a second at least: what is
    /// big takes a moment to change.
    async fn await_state(&self, peer: JausId, wanted: State) -> Result<(), ManageError> {
        let start = Instant::now();
        loop {
            let report: ReportStatus = self.query(peer, &QueryStatus {}).await?;
            if report.status.0 == wanted as u8 {
                return Ok(());
            }
            if start.elapsed() > STATE_LIMIT {
                let found = report.status.0;
                return Err(ManageError::State {
                    peer,
                    wanted,
                    found,
                });
            }
            tokio::time::sleep(STATE_PAUSE).await;
        }
    }
}

fn undelivered(error: DeliverError) -> ManageError {
    ControlError::from(error).into()
}
