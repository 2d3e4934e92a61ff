//! What generated services need from the stack that runs them, and what they give to it.
//!
//! The generated module of a service has a trait `Service`, which the application implements, and a
//! struct `Server`, which passes messages to it. The stack knows a `Server` as a [`Provider`], and
//! the `Server` knows the stack as a [`Call`]. Neither does I/O.

use alloc::vec::Vec;

use super::error::DecodeError;
use super::machine::Outcome;
use super::message::{Message, ServiceId};
use super::query::Query;

/// A service that a component can offer: generated `Server`s, and others over the same calls.
pub trait Provider<C> {
    /// The versions of the service that it handles, newest first.
    fn offers(&self) -> Vec<ServiceId>;

    /// The commands that must be guarded.
    fn hazards(&self) -> Hazards {
        Hazards::default()
    }

    /// An offered version with a message whose layout is not handled, and the message's name.
    fn unhandled_version(&self) -> Option<(ServiceId, &'static str)> {
        None
    }

    /// An offered version with a query that is neither answered nor declined, and the query's name.
    fn unanswered_query(&self) -> Option<(ServiceId, &'static str)> {
        None
    }

    /// Whether it answers the query with this code, so that clients can subscribe to the answers. Of the
    /// queries that the library knows, none needs to say so.
    fn answers(&self, query: u16) -> bool {
        let _ = query;
        false
    }

    /// Handles the message of the call. `None` if the service has no message with this code.
    fn receive(&mut self, code: u16, call: &mut C) -> Option<Result<(), DecodeError>>;

    /// Stops everything that its commands move.
    fn stop(&mut self, call: &mut C) {
        let _ = call;
    }

    /// Handles an [event of its own](InternalEvent).
    fn handle_event(&mut self, number: u16, call: &mut C) {
        let _ = (number, call);
    }

    /// Follows the component's control to a state, which is given by the path that it has in the
    /// state machine of Management. The first call starts the service's own state machine.
    fn follow(&mut self, path: &[&str], call: &mut C) {
        let _ = (path, call);
    }
}

/// One call of a [`Provider`]: the message, and the stack's part in handling it.
pub trait Call: Sized {
    /// Decodes the message, and passes it on if its sender may send it now.
    ///
    /// # Errors
    /// If the octets are no message of this type.
    fn receive<M: Message>(
        &mut self,
        handle: impl FnOnce(M, &mut Self),
    ) -> Result<(), DecodeError> {
        self.step(|message, call| {
            handle(message, call);
            Outcome::Handled
        })
    }

    /// Like [`receive`](Self::receive), for a message that a state machine may not accept.
    ///
    /// # Errors
    /// If the octets are no message of this type.
    fn step<M: Message>(
        &mut self,
        step: impl FnOnce(M, &mut Self) -> Outcome,
    ) -> Result<(), DecodeError>;

    /// Decodes a query, and replies with the report, if any.
    ///
    /// # Errors
    /// If the octets are no query of this type.
    fn answer<Q: Query>(
        &mut self,
        answer: impl FnOnce(Q, &mut Self) -> Option<Q::Report>,
    ) -> Result<(), DecodeError>;

    /// Replies to the sender of the message. Without effect in a call without a message.
    fn send<M: Message>(&mut self, message: &M);

    /// Like [`send`](Self::send), without the optional fields that the query in the call does not
    /// request.
    fn send_report<Q: Query>(&mut self, report: Q::Report);

    /// Whether the sender of the message is the client in control.
    fn is_controlling_client(&self) -> bool;
}

/// The guarded commands of a service.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Hazards {
    /// A command that moves something, such as Set Wrench Effort.
    pub acts_on: Option<&'static str>,
    /// A command that configures something, such as Set Local Pose.
    pub set_up_by: Option<&'static str>,
    /// Whether the service stops everything that the commands move when told to.
    pub stops: bool,
}

/// An event of a service's state machine that the service raises itself, such as a timeout. The
/// generated enums `Internal` implement it.
pub trait InternalEvent: Copy {
    /// Its number among the service's own events.
    fn number(self) -> u16;
}
