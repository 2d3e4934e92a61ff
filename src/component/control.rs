//! The application's handle for control over a peer.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::sync::watch;

use super::clients::{Condition, Ticket};
use super::{Component, ControlError, ManageError};
use crate::address::JausId;
use crate::codec::Message;
use crate::messages::core::{
    ClearEmergency, QueryStatus, ReleaseControl, Reset, Resume, SetEmergency, Standby,
};
use crate::node::now;
use crate::service::{CLEAR_ALL, State};
use crate::wire::Priority;

/// How long a peer may take to reach a state …
const STATE_LIMIT: Duration = Duration::from_secs(1);
/// … and the interval of queries meanwhile.
const STATE_PAUSE: Duration = Duration::from_millis(100);

/// Exclusive control over a component. Created by [`Component::control`]. It renews itself;
/// dropping it releases control.
///
/// Control can be lost at any time: to a client with a greater authority, in an emergency, after a
/// restart of the peer, or through a network failure. It is not requested again automatically,
/// because another client may have had a reason to take it.
///
/// While control is held, the peer's status is queried five times a second. After
/// [`resume`](Self::resume), commands can be sent while the peer reports that it is ready.
///
/// ```no_run
/// # use jaus::address::JausId;
/// # use jaus::component::Component;
/// # use jaus::messages::mobility::SetWrenchEffort;
/// # async fn example(operator: Component, rover: JausId) -> Result<(), Box<dyn std::error::Error>> {
/// let mut control = operator.control(rover, 127).await?;
/// control.resume().await?;
/// control.send(&SetWrenchEffort::default())?;
/// println!("{}", control.lost().await);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Control {
    /// Dropped before the component.
    _ticket: Ticket,
    component: Component,
    peer: JausId,
    condition: watch::Receiver<Condition>,
    /// Whether the application has resumed the peer, and not put it into standby since.
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
            _ticket: ticket,
            component,
            peer,
            condition,
            expects_ready: AtomicBool::new(false),
        }
    }

    /// The controlled component.
    #[must_use]
    pub const fn peer(&self) -> JausId {
        self.peer
    }

    /// Whether control is held, as far as known now.
    #[must_use]
    pub fn is_held(&self) -> bool {
        self.check_held().is_ok()
    }

    /// Waits until control is lost, and returns the reason. Pending while control is held.
    pub async fn lost(&mut self) -> ControlError {
        let is_over = |now: &Condition| !matches!(now, Condition::Held(_));
        drop(self.condition.wait_for(is_over).await);
        match self.check_held() {
            Err(error) => error,
            Ok(()) => ControlError::Stopped,
        }
    }

    /// The code of the status that the peer has last reported, as in [`State`]; `None` before its
    /// first report.
    ///
    /// # Errors
    /// The reason if control is lost.
    pub fn status(&self) -> Result<Option<u8>, ControlError> {
        self.check_held()?;
        match *self.condition.borrow() {
            Condition::Held(status) => Ok(status),
            Condition::Lost(_) | Condition::Released => Ok(None),
        }
    }

    /// Waits until the peer reports another status than `known`, and returns it.
    ///
    /// # Errors
    /// The reason when control is lost.
    pub async fn status_after(&self, known: Option<u8>) -> Result<Option<u8>, ControlError> {
        let is_known = |now: &Condition| *now == Condition::Held(known);
        drop(self.condition.clone().wait_for(|it| !is_known(it)).await);
        self.status()
    }

    /// Sends a command without acknowledgement.
    ///
    /// # Errors
    /// Those of [`check`](Self::check), or if the message could not be sent.
    pub fn send<M: Message>(&self, command: &M) -> Result<(), ControlError> {
        self.check()?;
        Ok(self.component.send(self.peer, command)?)
    }

    /// Sends a command with retransmission until the peer acknowledges it. The acknowledgement
    /// confirms the arrival, not the execution.
    ///
    /// # Errors
    /// Those of [`check`](Self::check), or if delivery is not confirmed.
    pub async fn deliver<M: Message>(&self, command: &M) -> Result<(), ControlError> {
        self.check()?;
        Ok(self.component.deliver(self.peer, command).await?)
    }

    /// Makes the peer act on commands, and waits until it reports that it is ready.
    ///
    /// # Errors
    /// If control is lost, or the peer does not report the state.
    pub async fn resume(&self) -> Result<(), ManageError> {
        self.manage(&Resume {}, State::Ready).await?;
        self.expects_ready.store(true, Ordering::Relaxed);
        Ok(())
    }

    /// Puts the peer into standby, and waits until it reports that state.
    ///
    /// # Errors
    /// If control is lost, or the peer does not report the state.
    pub async fn standby(&self) -> Result<(), ManageError> {
        self.expects_ready.store(false, Ordering::Relaxed);
        self.manage(&Standby {}, State::Standby).await
    }

    /// Resets the peer, which ends control.
    ///
    /// # Errors
    /// If control is lost, or delivery is not confirmed.
    pub async fn reset(self) -> Result<(), ControlError> {
        self.deliver(&Reset {}).await
    }

    /// Releases control, and waits until the peer confirms or the release times out. Dropping does
    /// the same without waiting.
    pub async fn release(self) {
        let mut condition = self.condition.clone();
        // The component lives until the end.
        let _component = self.component.clone();
        drop(self);
        let ended = |now: &Condition| *now == Condition::Released;
        // An error means that the component has stopped, which has released control.
        let _ = condition.wait_for(ended).await;
    }

    async fn manage<M: Message>(&self, command: &M, wanted: State) -> Result<(), ManageError> {
        self.check_held()?;
        self.component
            .bring(Priority::High, self.peer, command, wanted)
            .await
    }

    /// Checks that commands can be sent.
    ///
    /// # Errors
    /// The reason if control is lost. [`ControlError::NotReady`] if the peer was resumed and has
    /// since reported another state; [`resume`](Self::resume) may help.
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

impl Drop for Control {
    fn drop(&mut self) {
        if self.is_held() {
            self.component.release_now(self.peer);
        }
    }
}

impl Component {
    /// Sends a release at once. The component's task repeats it until it is confirmed; but at the end of
    /// `main` that task does not run any more.
    pub(super) fn release_now(&self, peer: JausId) {
        if self.send(peer, &ReleaseControl {}).is_ok() {
            self.shared.sender.flush();
        }
    }

    /// Sets an emergency at a peer that offers Management, which stops it until this component
    /// calls [`clear_emergency`](Self::clear_emergency). Waits until the peer reports the
    /// emergency. This needs no control.
    ///
    /// # Errors
    /// If the peer does not report the emergency.
    pub async fn set_emergency(&self, peer: JausId) -> Result<(), ManageError> {
        let set = SetEmergency {
            emergency_code: 1.into(),
        };
        self.bring(Priority::SafetyCritical, peer, &set, State::Emergency)
            .await
    }

    /// Clears an emergency that this component has set. Waits until the peer reports its end, but
    /// at most about a second: it continues if another component has set one, too.
    ///
    /// # Errors
    /// If the peer does not report its status.
    pub async fn clear_emergency(&self, peer: JausId) -> Result<(), ManageError> {
        let clear = ClearEmergency {
            emergency_code: 1.into(),
        };
        let over = |state: u8| state != State::Emergency as u8;
        self.tell_until(Priority::SafetyCritical, peer, &clear, over)
            .await
            .map(drop)
    }

    /// Clears the emergencies of all clients, as [`clear_emergency`](Self::clear_emergency) clears
    /// that of this component. A peer obeys a component of its own node, or a client over a secure
    /// link whose key may do so. The peer's own emergency, as of its stop input, remains.
    ///
    /// # Errors
    /// If the peer does not report its status.
    pub async fn clear_all_emergencies(&self, peer: JausId) -> Result<(), ManageError> {
        let clear = ClearEmergency {
            emergency_code: CLEAR_ALL.into(),
        };
        let over = |state: u8| state != State::Emergency as u8;
        self.tell_until(Priority::SafetyCritical, peer, &clear, over)
            .await
            .map(drop)
    }

    /// Sends a state command until the peer reports that state.
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

    /// Repeats a command for at least a second, until the status is as wanted: a large machine
    /// takes a moment to change state, and some peers never acknowledge commands. Returns the last
    /// status.
    async fn tell_until<M: Message>(
        &self,
        priority: Priority,
        peer: JausId,
        command: &M,
        wanted: impl Fn(u8) -> bool,
    ) -> Result<u8, ManageError> {
        let start = now();
        loop {
            self.send_with(priority, peer, command)
                .map_err(ControlError::from)?;
            let report = self.query(peer, &QueryStatus {}).await?;
            let found = report.status.0;
            if wanted(found) || now() - start > STATE_LIMIT {
                return Ok(found);
            }
            tokio::time::sleep(STATE_PAUSE).await;
        }
    }
}
