//! Services as state machines that do no I/O and read no clock.
//!
//! A component is a [`Stack`] of services. Its driver passes in received messages and the current
//! time. The stack returns outgoing messages, events for the application and the time of the next
//! wake-up. So the same code runs on a node, in a simulation of a hundred nodes, and in a test of
//! one message.
//!
//! | service | what it does here |
//! |---|---|
//! | [`Transport`] | is only listed; the endpoint does its work |
//! | [`Liveness`] | answers Query Heartbeat Pulse, and sends a heartbeat if configured |
//! | [`Time`] | reports the time; the client in control may set it |
//! | [`ListManager`] | keeps a list of elements for drivers to execute |
//! | [`Discovery`] | announces this component, finds other components, keeps the [`Directory`] |
//! | Events ([`EventSettings`]) | sends the report of any query of the component, periodically or on every change |
//! | [`AccessControl`], [`Management`] | decide which client may command, and stop everything in an emergency |
//! | [`Handlers`] | the application's own services: a function per message, or a type that implements the service's trait |
//!
//! A stack is also a client of other components: it [queries](Stack::ask),
//! [subscribes](Stack::subscribe), [takes control](Stack::request_control) and
//! [keeps it](Stack::begin_session). It keeps all of them until the application cancels them.

mod audience;
mod call;
mod client;
mod clock_offset;
#[cfg(test)]
mod contest;
mod context;
mod control;
mod directory;
mod discovery;
mod events;
mod freshness;
mod functions;
mod guard;
mod handlers;
mod incarnation;
mod inquiries;
mod life;
mod list;
mod liveness;
#[cfg(test)]
mod machines;
mod order;
mod outbox;
mod publication;
mod restart_watch;
#[cfg(any(test, feature = "arbitrary"))]
pub mod rig;
mod safety;
mod sample_age;
mod share;
mod stack;
#[cfg(test)]
mod stack_rig;
mod standing;
mod time;
mod transport;
mod undecoded;

use std::time::Instant;

use crate::address::JausId;
use crate::codec::ServiceId;
use crate::endpoint::Received;

pub use crate::codec::{Date, Hazards};
pub use audience::Audience;
pub use call::{Call, LaterAnswer};
#[cfg(feature = "node")]
pub(crate) use client::OWN_REQUESTS;
pub use client::{
    CannotSubscribe, ControlId, ControlLost, ControlNews, ControlRefused, Outage, Rejection,
    Retake, SessionId, SessionLoss, SessionOrder, SessionSettings, SessionState, SubscriptionEnd,
    SubscriptionId, SubscriptionNews, TargetState, Topic, When,
};
pub use clock_offset::{Age, ClockEstimator, ClockOffset, Drift, Exchange, MOST_SLEW};
pub use context::Context;
pub use control::{AccessControl, CLEAR_ALL, Condition, Management};
pub use directory::{
    ComponentEntry, Directory, Identification, Kind, Level, NodeEntry, Offer, SubsystemEntry,
};
pub use discovery::{Change, Discovery, Loss, NodeDirectory, Profile, Refused, Scope, Timing};
pub use events::EventSettings;
pub use functions::Functions;
pub use guard::{MotionGuard, MotionPolicy, StopCause, Validity};
pub use handlers::Handlers;
pub use incarnation::Incarnation;
pub use inquiries::{Inquiry, NoAnswer, Patience, QueryOptions, Question};
pub use life::{Life, Rank};
pub use list::{ElementList, Elements, ListManager};
pub use liveness::Liveness;
#[cfg(feature = "node")]
pub(crate) use order::{is_stop, series_of};
pub use outbox::Outbox;
pub use publication::{NotPublished, Publication};
pub use safety::UnsafeService;
pub use sample_age::{SampleAge, SampleStamp};
pub use share::Share;
pub use stack::{Event, Stack};
pub use standing::{Controller, Standing, State};
pub use time::{Time, TimeOfDay};
pub use transport::Transport;
pub use undecoded::{NeedsControl, UndecodedFunctions};

/// One service of a component.
pub trait Service: Send {
    /// The services that the component advertises, newest version first.
    fn offers(&self) -> Vec<ServiceId>;

    /// Handles a message to this component. The first service that returns [`Handled::Yes`]
    /// consumes the message; later services do not see it.
    fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled;

    /// Takes a published report, with which it answers queries from now on, and
    /// [announces](Context::changed) the change. The first service that returns [`Handled::Yes`]
    /// takes it.
    fn handle_publication(
        &mut self,
        publication: &Publication,
        context: &mut Context<'_>,
    ) -> Handled {
        let _ = (publication, context);
        Handled::No
    }

    /// Called when the time of [`poll_timeout`](Self::poll_timeout) has come.
    fn handle_timeout(&mut self, now: Instant, context: &mut Context<'_>) {
        let _ = (now, context);
    }

    /// The one stop: everything that this service moves must stand still, and must not move again
    /// without a new command. Called when control or readiness is lost, in an emergency, on a
    /// fault, and when the component ends or panics. It is also called when nothing moves.
    fn handle_stop(&mut self, cause: &StopCause, context: &mut Context<'_>) {
        let _ = (cause, context);
    }

    /// Called after the component's [`Standing`] has changed from `before` to that of the context:
    /// control was taken or lost, or the state changed. If the change requires a stop,
    /// [`handle_stop`](Self::handle_stop) was called first.
    fn handle_standing(&mut self, now: Instant, before: &Standing, context: &mut Context<'_>) {
        let _ = (now, before, context);
    }

    /// The client whose liveness the current motion depends on. It is probed four times a second.
    fn depends_on(&self) -> Option<JausId> {
        None
    }

    /// Whether a command that moves something is in force.
    fn is_moving(&self) -> bool {
        false
    }

    /// The commands of this service and whether it can stop, for the check that it is safe to
    /// offer.
    fn hazards(&self) -> Hazards {
        Hazards::default()
    }

    /// An offered version with a message whose layout nothing handles, and the message's name.
    fn unhandled_version(&self) -> Option<(ServiceId, &'static str)> {
        None
    }

    /// An offered version with a query that is neither answered nor declined, and the query's name.
    fn unanswered_query(&self) -> Option<(ServiceId, &'static str)> {
        None
    }

    /// Whether it answers the query with this code, so that clients can subscribe to the answers. Of the
    /// queries that the library knows, no service needs to say so.
    fn answers(&self, query: u16) -> bool {
        let _ = query;
        false
    }

    /// Whether this service reports the end of commands with this code, with [`Context::ended`]. If
    /// so, clients may run them as command events (AS5710 1.1).
    fn tells_end_of(&self, command: u16) -> bool {
        let _ = command;
        false
    }

    /// When this service must be woken.
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

/// Whether a service consumed a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Handled {
    /// Consumed, whether well-formed or not.
    Yes,
    /// Not a message of this service.
    No,
}

/// The message code at the head of a payload.
#[must_use]
pub fn code_of(payload: &[u8]) -> Option<u16> {
    payload.first_chunk().map(|&code| u16::from_le_bytes(code))
}

/// Decodes a message whose code is already known. A message that does not decode is a peer's
/// mistake, not an error: it is traced.
#[must_use]
pub fn read<M: crate::codec::Message>(received: &Received) -> Option<M> {
    M::decode(&received.payload)
        .inspect_err(|error| {
            tracing::debug!(source = %received.source, %error, "cannot decode the message");
        })
        .ok()
}
