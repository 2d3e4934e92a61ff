//! Who may command a component, and what it is fit for: the services Access Control and Management
//! (AS5710) as one machine, because the second only adds states to the first.
//!
//! | state | controlled by a client | what a component does |
//! |---|---|---|
//! | [`Initialize`](State::Initialize) | never | gets ready, if it [said so](Management::initializes) |
//! | [`Standby`](State::Standby) | or not | nothing; where it starts, and where it falls back to |
//! | [`Ready`](State::Ready) | always | acts |
//! | [`Emergency`](State::Emergency) | or not | nothing, until each client that set one clears it |
//! | [`Failure`](State::Failure), [`Shutdown`](State::Shutdown) | never | nothing any more |
//!
//! A component with Access Control alone is always ready. Losing control (released, timed out, taken
//! by nobody else, its client gone) leads from Ready to Standby.
//!
//! # Where sources disagree
//!
//! * **During an emergency** the published machines forget that the application has become fit or
//!   has failed. Here it counts when the emergency is over, for nobody would tell it again.
//! * **After an emergency** the published machines of 1.1 go back to where they were, so that
//!   clearing sets a vehicle in motion; others (fkie) go to Standby. We go to Standby: whoever is in
//!   control must say Resume. Control itself is kept, as 1.1 has it.
//! * **Release in an emergency** is refused with Not Available whether the client was in control or
//!   not, as the public contests' judges expect it.
//! * **The timeout** is 4 s by default, and ends control a quarter of it late, so that a client that
//!   does not renew controls nothing after 5 s. JAUS++ clients renew four times in its course. The
//!   public contests' judging tool requests control once and never renews: for that, set it to 0.
//! * **An emergency** ends when each client that set one clears it, as the standard has it. A client
//!   that is dead, or that never existed because its id was forged, cannot: an emergency whose setter
//!   shows no life for 4 s may also be cleared by the client in control, and if nobody is, control
//!   can be had again for that purpose. The application on the vehicle may end all of them
//!   ([`Condition::Safe`]).

mod access;
mod management;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use super::{Handled, Outbox, Standing, State, code_of, read};
use crate::address::JausId;
use crate::codec::{Message, ServiceId};
use crate::endpoint::Received;
use crate::messages::core::{self, report_timeout};

/// How a component can be controlled.
///
/// ```
/// use jaus::service::AccessControl;
///
/// let settings = AccessControl::new().authority(100).timeout(5);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AccessControl {
    authority: u8,
    timeout: u8,
}

impl AccessControl {
    /// After how many seconds control ends by default that its client does not request again.
    pub const TIMEOUT: u8 = 4;

    /// Obeys any client with an authority of at least 1, until it has not requested control for
    /// [`TIMEOUT`](Self::TIMEOUT) and a quarter of it.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            authority: 1,
            timeout: Self::TIMEOUT,
        }
    }

    /// The default authority: clients with less do not get control.
    #[must_use]
    pub const fn authority(mut self, code: u8) -> Self {
        self.authority = code;
        self
    }

    /// After how many seconds control ends unless its client requests it again; 0 for never. A
    /// client that has answered Query Heartbeat Pulse before and answers no more loses control
    /// after 4 s in any case; for one that never did, 0 means that only standby, release or an
    /// emergency stops the component.
    #[must_use]
    pub const fn timeout(mut self, seconds: u8) -> Self {
        self.timeout = seconds;
        self
    }
}

impl Default for AccessControl {
    fn default() -> Self {
        Self::new()
    }
}

/// The life of a component that clients start and stop, which includes Access Control.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Management {
    access: AccessControl,
    initializes: bool,
}

impl Management {
    /// In standby from the beginning, with the usual [`AccessControl`].
    #[must_use]
    pub const fn new() -> Self {
        Self {
            access: AccessControl::new(),
            initializes: false,
        }
    }

    /// How it can be controlled.
    #[must_use]
    pub const fn access_control(mut self, access: AccessControl) -> Self {
        self.access = access;
        self
    }

    /// Begins in [`State::Initialize`], and returns there at each reset, until the application says
    /// that it is done.
    #[must_use]
    pub const fn initializes(mut self) -> Self {
        self.initializes = true;
        self
    }
}

/// What the application tells about its own state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Condition {
    /// It has become fit to work: has done what [`State::Initialize`] is for, or mended what had
    /// led to [`State::Failure`]. Without effect in other states.
    Initialized,
    /// Something is broken; without effect while shutting down.
    Failed,
    /// Whoever is responsible for the component on the spot has seen to it: every emergency is over,
    /// also those of clients that have gone and will not clear theirs.
    Safe,
}

/// The control over one component. Without settings anyone is obeyed, and no message is answered.
#[derive(Debug, Default)]
pub(super) struct Control {
    access: Option<AccessControl>,
    management: Option<Management>,
    standing: Standing,
    /// When control ends unless it is renewed.
    deadline: Option<Instant>,
    /// The clients that have set an emergency and not cleared it.
    emergencies: BTreeSet<JausId>,
    /// Whether there were more than can be remembered.
    more_emergencies: bool,
    /// Where an emergency leads back to.
    resting: State,
}

impl Control {
    pub(super) fn with_access_control(settings: AccessControl) -> Self {
        Self {
            access: Some(settings),
            standing: Standing {
                exclusive: true,
                ..Standing::default()
            },
            ..Self::default()
        }
    }

    pub(super) fn with_management(settings: Management) -> Self {
        let mut control = Self::with_access_control(settings.access);
        control.management = Some(settings);
        control.standing.state = control.first_state();
        control
    }

    pub(super) const fn standing(&self) -> &Standing {
        &self.standing
    }

    pub(super) fn offers(&self) -> Vec<ServiceId> {
        let mut offers = Vec::new();
        if self.access.is_some() {
            offers.extend([core::access_control::V1_1, core::access_control::V1_0]);
        }
        if self.management.is_some() {
            offers.extend([core::management::V1_1, core::management::V1_0]);
        }
        offers
    }

    /// Handles a message; `is_alive` says whether a client shows life.
    pub(super) fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        is_alive: impl Fn(JausId) -> bool,
        out: &mut Outbox,
    ) -> Handled {
        let Some(code) = code_of(&message.payload) else {
            return Handled::No;
        };
        if let Some(access) = self.access
            && self.handle_access(now, access, code, message, &is_alive, out) == Handled::Yes
        {
            return Handled::Yes;
        }
        if self.management.is_some() {
            self.handle_management(code, message, is_alive, out)
        } else {
            Handled::No
        }
    }

    pub(super) fn handle_timeout(&mut self, now: Instant, out: &mut Outbox) {
        let Some(deadline) = self.deadline else {
            return;
        };
        if now < deadline {
            return;
        }
        if self.standing.state == State::Emergency {
            // Control is kept over an emergency.
            self.renew(now);
        } else {
            tracing::info!(id = %out.source(), "control has timed out");
            self.drop_controller(out);
        }
    }

    pub(super) const fn poll_timeout(&self) -> Option<Instant> {
        self.deadline
    }

    /// A client is gone, as far as discovery can tell.
    pub(super) fn forget(&mut self, client: JausId, out: &mut Outbox) {
        if self.is_controller(client) {
            tracing::info!(id = %out.source(), %client, "the client in control is gone");
            self.drop_controller(out);
        }
    }

    pub(super) fn is_controller(&self, client: JausId) -> bool {
        self.standing
            .controller
            .is_some_and(|controller| controller.id == client)
    }

    pub(super) const fn has_management(&self) -> bool {
        self.management.is_some()
    }

    /// Whether control ends that is not renewed.
    pub(super) fn has_timeout(&self) -> bool {
        self.access.is_some_and(|access| access.timeout > 0)
    }

    /// Whether a client has set an emergency that is not over.
    pub(super) fn has_emergency_of(&self, client: JausId) -> bool {
        self.emergencies.contains(&client)
    }

    /// Whether the application is still getting ready, also beneath an emergency.
    pub(super) fn is_initializing(&self) -> bool {
        self.beneath_emergency() == State::Initialize
    }

    /// Whether something is broken, also beneath an emergency.
    pub(super) fn has_failed(&self) -> bool {
        self.beneath_emergency() == State::Failure
    }

    const fn beneath_emergency(&self) -> State {
        match self.standing.state {
            State::Emergency => self.resting,
            state => state,
        }
    }

    /// The component ends: nobody is in control any more, and with Management nobody can be.
    pub(super) fn end(&mut self, out: &mut Outbox) {
        self.drop_controller(out);
        if self.management.is_some() {
            self.standing.state = State::Shutdown;
        }
    }

    /// Begins the timeout anew.
    fn renew(&mut self, now: Instant) {
        let seconds = self.access.map_or(0, |access| access.timeout);
        let timeout = Duration::from_secs(seconds.into());
        self.deadline = (seconds > 0).then(|| now + timeout + timeout / 4);
    }
}

/// The octet of Report Timeout.
fn timeout_field(seconds: u8) -> report_timeout::Timeout {
    report_timeout::Timeout(seconds)
}

/// Reads a message and does something with it, if it can be read.
fn with<M: Message>(message: &Received, act: impl FnOnce(M)) -> Handled {
    if let Some(message) = read(message) {
        act(message);
    }
    Handled::Yes
}
