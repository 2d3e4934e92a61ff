//! Control of a component and its states: the services Access Control and Management (AS5710) as
//! one state machine, because Management only adds states to Access Control.
//!
//! | state | controlled by a client | what a component does |
//! |---|---|---|
//! | [`Initialize`](State::Initialize) | never | starts up, if [configured](Management::initializes) |
//! | [`Standby`](State::Standby) | maybe | nothing; the initial state, and the one to fall back to |
//! | [`Ready`](State::Ready) | always | acts |
//! | [`Emergency`](State::Emergency) | maybe | nothing, until each client that set one clears it |
//! | [`Failure`](State::Failure), [`Shutdown`](State::Shutdown) | never | nothing any more |
//!
//! A component with Access Control alone is always ready. Losing control (release, timeout, dead
//! client; not a takeover by another client) leads from Ready to Standby.
//!
//! # Where the sources disagree
//!
//! * **During an emergency** the published state machines lose the application's report that it is
//!   initialized or has failed. Here the report takes effect after the emergency, because the
//!   application will not repeat it.
//! * **After an emergency** the published state machines of 1.1 return to the previous state, so
//!   that clearing sets a vehicle in motion; others (fkie) go to Standby. This one goes to Standby:
//!   the client in control must send Resume. Control itself is kept, as in 1.1.
//! * **Release in an emergency** is refused with Not Available whether or not the client is in
//!   control, as the judges of the public competitions expect.
//! * **The timeout** is 4 s by default and has a quarter of it as grace, so that a client that does
//!   not renew loses control after 5 s. JAUS++ clients renew every 1.25 s, four times in that
//!   period. The public competitions' judging tool requests control once and never renews: for
//!   that, set the timeout to 0.
//! * **An emergency** ends when each client that set one has cleared it, as in the standard. A dead
//!   client cannot, nor one that never existed because its id was forged. So the client in control
//!   may also clear emergencies whose setter has shown no life for 4 s. If no client is in control,
//!   control can be requested for that purpose. The vehicle's own emergency
//!   ([`Condition::Stopped`]), as of a stop input, is one more, which no client clears. The
//!   application on the vehicle can end all emergencies ([`Condition::Safe`]).
//! * **Clear Emergency with the code [`CLEAR_ALL`]**, which the standard reserves, ends those of
//!   other clients as well. Only a component of the own node may send it, or a client over a link
//!   that authenticates its ids and has a rule for this code. From others it clears as any code.

mod access;
mod management;

pub use crate::rights::CLEAR_ALL;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::order::{Mark, number_of};
use super::{Handled, Outbox, Standing, State, code_of, read};
use crate::address::JausId;
use crate::codec::{Message, ServiceId};
use crate::endpoint::Received;
use crate::messages::core::{self, QueryIncarnation, RequestControl, report_timeout};

/// Settings of Access Control.
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
    /// The default of [`timeout`](Self::timeout), in seconds.
    pub const TIMEOUT: u8 = 4;

    /// Obeys any client with an authority of at least 1. Control ends when the client has not
    /// requested it again for 1.25 × [`TIMEOUT`](Self::TIMEOUT).
    #[must_use]
    pub const fn new() -> Self {
        Self {
            authority: 1,
            timeout: Self::TIMEOUT,
        }
    }

    /// The default authority. Clients with a lower one do not get control.
    #[must_use]
    pub const fn authority(mut self, code: u8) -> Self {
        self.authority = code;
        self
    }

    /// The timeout of control in seconds, counted from the client's last request; 0 disables it.
    /// Control ends a quarter of it late. A client that has answered Query Heartbeat Pulse before
    /// and no longer does loses control after 4 s in any case. For a client that never did, 0 means
    /// that only standby, release or an emergency stops the component.
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

/// Settings of Management, which includes Access Control: clients start and stop the component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Management {
    access: AccessControl,
    initializes: bool,
}

impl Management {
    /// Starts in standby, with the default [`AccessControl`].
    #[must_use]
    pub const fn new() -> Self {
        Self {
            access: AccessControl::new(),
            initializes: false,
        }
    }

    /// Sets the settings of Access Control.
    #[must_use]
    pub const fn access_control(mut self, access: AccessControl) -> Self {
        self.access = access;
        self
    }

    /// Starts in [`State::Initialize`], and returns there on each reset, until the application
    /// reports [`Condition::Initialized`].
    #[must_use]
    pub const fn initializes(mut self) -> Self {
        self.initializes = true;
        self
    }
}

/// The application's report of its own condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Condition {
    /// It is ready for work: it has finished [`State::Initialize`], or repaired the cause of
    /// [`State::Failure`]. Has no effect in other states.
    Initialized,
    /// Something is broken. Has no effect during shutdown.
    Failed,
    /// The component stops by itself, as by a stop input: an emergency begins that no client can
    /// clear.
    Stopped,
    /// The reason of [`Stopped`](Self::Stopped) is over: its emergency ends. Those that clients have
    /// set remain.
    StopReleased,
    /// The person responsible for the component on site has checked it. All emergencies end,
    /// including those of clients that are gone and will not clear theirs.
    Safe,
}

/// The control over one component. Without settings it obeys anyone and answers no message.
#[derive(Debug, Default)]
pub(super) struct Control {
    access: Option<AccessControl>,
    management: Option<Management>,
    standing: Standing,
    /// When control ends unless it is renewed.
    deadline: Option<Instant>,
    /// The number of the last request by which the client in control got or renewed it.
    requested: Option<u16>,
    /// The clients that have set an emergency and not cleared it.
    /// By the clients that have set them, with the last request of each.
    emergencies: BTreeMap<JausId, Option<Mark>>,
    /// Whether more emergencies were set than the table holds.
    more_emergencies: bool,
    /// Whether the component has stopped by itself.
    is_stopped: bool,
    /// The state to return to after an emergency.
    resting: State,
}

impl Control {
    pub(super) fn with_access_control(settings: AccessControl) -> Self {
        Self {
            access: Some(settings),
            standing: Standing {
                exclusive: true,
                least_authority: settings.authority,
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

    /// Handles a message; `is_alive` tells whether a client shows life.
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
            self.handle_management(now, code, message, is_alive, out)
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
            // Control continues through an emergency.
            self.renew(now);
        } else {
            tracing::info!(id = %out.source(), "control has timed out");
            self.drop_controller(out);
        }
    }

    pub(super) const fn poll_timeout(&self) -> Option<Instant> {
        self.deadline
    }

    /// Handles the loss of a client, as far as discovery can tell.
    pub(super) fn forget(&mut self, client: JausId, out: &mut Outbox) {
        if self.is_controller(client) {
            tracing::info!(id = %out.source(), %client, "the client in control is gone");
            self.drop_controller(out);
        }
    }

    /// Ends the control of a client that has restarted, as its message shows.
    pub(super) fn handle_restarted(&mut self, message: &Received, out: &mut Outbox) {
        if !self.is_controller(message.source) {
            return;
        }
        match code_of(&message.payload) {
            // Its request has overtaken the introduction: it is in control, and must resume.
            Some(QueryIncarnation::CODE) if self.was_requested_after(message) => self.fall_back(),
            // It knows of no control, and a rejection could overtake the answer to its request.
            Some(QueryIncarnation::CODE | RequestControl::CODE) => _ = self.end_control(),
            _ => self.drop_controller(out),
        }
    }

    /// Whether the client has requested control just after this message.
    fn was_requested_after(&self, message: &Received) -> bool {
        /// A node sends few messages between the introduction of a client and its request.
        const NEXT: u16 = 64;
        let numbers = self.requested.zip(number_of(message));
        numbers
            .is_some_and(|(requested, number)| (1..NEXT).contains(&requested.wrapping_sub(number)))
    }

    pub(super) fn is_controller(&self, client: JausId) -> bool {
        self.standing
            .controller
            .is_some_and(|controller| controller.id == client)
    }

    /// Whether the component is ready to move for this client.
    pub(super) fn is_acting_for(&self, client: JausId) -> bool {
        self.has_management() && self.standing.state == State::Ready && self.is_controller(client)
    }

    pub(super) const fn has_management(&self) -> bool {
        self.management.is_some()
    }

    /// Whether control has a timeout.
    pub(super) fn has_timeout(&self) -> bool {
        self.access.is_some_and(|access| access.timeout > 0)
    }

    /// Whether a client has set an emergency and not cleared it.
    pub(super) fn has_emergency_of(&self, client: JausId) -> bool {
        self.emergencies.contains_key(&client)
    }

    /// Whether the application is still initializing, including during an emergency.
    pub(super) fn is_initializing(&self) -> bool {
        self.beneath_emergency() == State::Initialize
    }

    /// Whether the component failed, including during an emergency.
    pub(super) fn has_failed(&self) -> bool {
        self.beneath_emergency() == State::Failure
    }

    const fn beneath_emergency(&self) -> State {
        match self.standing.state {
            State::Emergency => self.resting,
            state => state,
        }
    }

    /// Ends all control because the component ends. With Management no client can regain it.
    pub(super) fn end(&mut self, out: &mut Outbox) {
        self.drop_controller(out);
        if self.management.is_some() {
            self.standing.state = State::Shutdown;
        }
    }

    /// Restarts the timeout.
    fn renew(&mut self, now: Instant) {
        let seconds = self.access.map_or(0, |access| access.timeout);
        let timeout = Duration::from_secs(seconds.into());
        self.deadline = (seconds > 0).then(|| now + timeout + timeout / 4);
    }
}

/// The timeout field of Report Timeout.
fn timeout_field(seconds: u8) -> report_timeout::Timeout {
    report_timeout::Timeout(seconds)
}

/// Decodes a message and acts on it if it decodes.
fn with<M: Message>(message: &Received, act: impl FnOnce(M)) -> Handled {
    if let Some(message) = read(message) {
        act(message);
    }
    Handled::Yes
}
