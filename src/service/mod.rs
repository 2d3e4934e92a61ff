//! Services as state machines that do no I/O and read no clock.
//!
//! A component is a [`Stack`] of services. The stack is fed with what arrives and with the time;
//! it says what to send, what the application should know, and when to wake it. So the same code
//! runs on a node, in a simulation of a hundred nodes, and in a test of one message.
//!
//! | service | what it does here |
//! |---|---|
//! | [`Transport`] | is listed; the endpoint does its work |
//! | [`Liveness`] | answers Query Heartbeat Pulse, sends a heartbeat if asked to |
//! | [`Time`] | tells the time, and lets the client in control set it |
//! | [`ListManager`] | keeps a list of elements that drivers work off |
//! | [`Discovery`] | says who we are, finds out who the others are, keeps the [`Directory`] |
//! | Events ([`EventSettings`]) | sends the answer to any query of the component, at a rate or on every change |
//! | [`AccessControl`], [`Management`] | say who may command, and stop everything in an emergency |
//! | [`Handlers`] | whatever an application offers, one function per message |
//!
//! Beside its services a stack is a client of others: it [asks](Stack::ask),
//! [subscribes](Stack::subscribe) and [takes control](Stack::request_control), and keeps what it has
//! been given until it is not wanted any more.

mod calendar;
mod client;
#[cfg(test)]
mod contest;
mod context;
mod control;
mod directory;
mod discovery;
mod events;
mod guard;
mod handlers;
mod inquiries;
mod life;
mod list;
mod liveness;
#[cfg(test)]
mod machines;
mod outbox;
#[cfg(any(test, feature = "arbitrary"))]
pub mod rig;
mod safety;
mod share;
mod stack;
#[cfg(test)]
mod stack_rig;
mod standing;
mod time;
mod transport;

use std::time::Instant;

use crate::address::JausId;
use crate::codec::ServiceId;
use crate::endpoint::Received;

pub use calendar::Date;
pub use client::{
    CannotSubscribe, ControlId, ControlLost, ControlNews, ControlRefused, Outage, Rejection,
    SubscriptionEnd, SubscriptionId, SubscriptionNews, Topic, When,
};
pub use context::Context;
pub use control::{AccessControl, Condition, Management};
pub use directory::{Component, Directory, Identification, Kind, Level, Node, Offer, Subsystem};
pub use discovery::{Change, Discovery, Loss, NodeDirectory, Profile, Refused, Scope, Timing};
pub use events::EventSettings;
pub use guard::{MotionGuard, MotionPolicy, StopCause, Validity};
pub use handlers::Handlers;
pub use inquiries::{Inquiry, NoAnswer, Patience};
pub use life::{Life, Rank};
pub use list::{ElementList, Elements, ListManager};
pub use liveness::Liveness;
pub use outbox::Outbox;
pub use safety::{Hazards, UnsafeService};
pub use stack::{Event, Stack};
pub use standing::{Controller, Standing, State};
pub use time::{Time, TimeOfDay};
pub use transport::Transport;

/// One service of a component.
pub trait Service: Send {
    /// What the component says that it offers, the newest version first.
    fn offers(&self) -> Vec<ServiceId>;

    /// A message for this component has arrived. The first service that says
    /// [`Handled::Yes`] gets it; the others do not see it.
    fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled;

    /// The time of [`poll_timeout`](Self::poll_timeout) has come.
    fn handle_timeout(&mut self, now: Instant, context: &mut Context<'_>) {
        let _ = (now, context);
    }

    /// The one stop: whatever this service moves must stand still, and must not move again without
    /// a new command. Called when control or readiness is lost, in an emergency, on a fault, and
    /// when the component ends or panics; also when nothing moves.
    fn handle_stop(&mut self, cause: &StopCause, context: &mut Context<'_>) {
        let _ = (cause, context);
    }

    /// The component's [`Standing`] was `before` until now, and is the context's from now on:
    /// control was taken or lost, or the state changed. What had to stop has
    /// [stopped](Self::handle_stop).
    fn handle_standing(&mut self, now: Instant, before: &Standing, context: &mut Context<'_>) {
        let _ = (now, before, context);
    }

    /// The client on whose life a motion depends now: it is asked for signs of life four times a
    /// second.
    fn depends_on(&self) -> Option<JausId> {
        None
    }

    /// Whether a command that moves something is in force.
    fn is_moving(&self) -> bool {
        false
    }

    /// Which commands this service takes, and how it stops: what it needs beside it to be safe.
    fn hazards(&self) -> Hazards {
        Hazards::default()
    }

    /// Whether this service tells the end of the commands with this code, with [`Context::ended`]:
    /// clients may have them carried out as command events (AS5710 1.1).
    fn tells_end_of(&self, command: u16) -> bool {
        let _ = command;
        false
    }

    /// When this service wants to be woken.
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

/// Whether a message was a service's business.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Handled {
    /// It was, be it well-formed or not.
    Yes,
    /// It was not.
    No,
}

/// The message code at the head of a payload.
#[must_use]
pub fn code_of(payload: &[u8]) -> Option<u16> {
    payload.first_chunk().map(|&code| u16::from_le_bytes(code))
}

/// Decodes a message that has the right code, and traces what cannot be read: a peer's mistake is
/// no error of ours.
#[must_use]
pub fn read<M: crate::codec::Message>(received: &Received) -> Option<M> {
    M::decode(&received.payload)
        .inspect_err(|error| {
            tracing::debug!(source = %received.source, %error, "message cannot be read");
        })
        .ok()
}
