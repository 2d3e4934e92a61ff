//! One call of a service that is handled by functions or by a generated server: the message, the
//! service's view of its component, and the guard of commands.

use std::ops::{Deref, DerefMut};
use std::time::{Duration, Instant};

use super::handlers::Timers;
use super::{Context, Standing, Validity};
use crate::address::JausId;
use crate::codec::machine::Outcome;
use crate::codec::{self, DecodeError, EncodeError, InternalEvent, Message, Query};
use crate::endpoint::{Outgoing, Received};

/// One call of a service: the [`Context`], the message if there is one, and the time.
#[derive(Debug)]
pub struct Call<'a> {
    context: Context<'a>,
    now: Instant,
    received: Option<&'a Received>,
    timers: &'a mut Timers,
    validity: Option<Validity>,
    /// Whether a command that moves something was accepted.
    accepted: bool,
}

impl<'a> Call<'a> {
    pub(super) const fn new(
        now: Instant,
        received: Option<&'a Received>,
        context: Context<'a>,
        timers: &'a mut Timers,
    ) -> Self {
        Self {
            context,
            now,
            received,
            timers,
            validity: None,
            accepted: false,
        }
    }

    /// The time of the call; in a call for a stop, that of the call before.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.now
    }

    /// The received message; `None` in calls for a stop, for control and for internal events.
    #[must_use]
    pub const fn received(&self) -> Option<&'a Received> {
        self.received
    }

    /// The sender of the message.
    #[must_use]
    pub fn source(&self) -> Option<JausId> {
        self.received.map(|it| it.source)
    }

    /// Sets how long the command in this call stays in force. The default is [`Validity::of`] for
    /// its code, which is 500 ms for a command of your own service.
    pub const fn set_validity(&mut self, validity: Validity) {
        self.validity = Some(validity);
    }

    /// Raises an event of the service's state machine after a delay, in place of an earlier one of
    /// the same kind.
    pub fn raise_after(&mut self, delay: Duration, event: impl InternalEvent) {
        self.timers.set(self.now + delay, event.number());
    }

    /// Cancels an event that has not been raised yet.
    pub fn cancel(&mut self, event: impl InternalEvent) {
        self.timers.cancel(event.number());
    }

    /// A token for an answer after this call, for instance from another task, with
    /// [`Component::answer`](crate::component::Component::answer). `None` if the message is no `Q`.
    /// Queries that are answered later cannot be subscribed to.
    #[must_use]
    pub fn later<Q: Query>(&self) -> Option<LaterAnswer<Q>> {
        let request = self.received?;
        let query = Q::decode(&request.payload).ok()?;
        Some(LaterAnswer {
            request: request.clone(),
            query,
        })
    }

    /// The validity of a command that was accepted, with its sender.
    pub(super) fn command(&self) -> Option<(JausId, Validity)> {
        let received = self.received.filter(|_| self.accepted)?;
        let code = super::code_of(&received.payload)?;
        let validity = self.validity.unwrap_or_else(|| Validity::of(code));
        Some((received.source, validity))
    }

    /// Decodes the message, and passes it on if its sender may send it. `moves` is whether it is a
    /// command that moves something.
    pub(super) fn guarded<M: Message>(
        &mut self,
        may: fn(&Standing, JausId) -> bool,
        moves: bool,
        step: impl FnOnce(M, &mut Self) -> Outcome,
    ) -> Result<(), DecodeError> {
        let Some(received) = self.permitted(may, M::NAME) else {
            return Ok(());
        };
        let message = M::decode(&received.payload)?;
        if moves && !self.admits(received) {
            return Ok(());
        }
        match step(message, self) {
            Outcome::Handled => self.accepted |= moves,
            outcome => {
                let source = received.source;
                tracing::debug!(%source, command = M::NAME, ?outcome, "not accepted in this state");
            }
        }
        Ok(())
    }

    /// Passes the message on, undecoded, if its sender may send it. `name` is the message's name,
    /// and a `validity` means that it is a command that moves something.
    pub(super) fn guarded_undecoded(
        &mut self,
        may: fn(&Standing, JausId) -> bool,
        validity: Option<Validity>,
        name: &'static str,
        handle: impl FnOnce(&'a Received, &mut Context<'_>),
    ) {
        let Some(received) = self.permitted(may, name) else {
            return;
        };
        if validity.is_some() && !self.admits(received) {
            return;
        }
        if let Some(validity) = validity {
            self.set_validity(validity);
            self.accepted = true;
        }
        handle(received, &mut self.context);
    }

    /// Whether a setpoint is in its sender's order.
    fn admits(&mut self, received: &Received) -> bool {
        let code = super::code_of(&received.payload).unwrap_or_default();
        let now = self.now;
        self.context
            .admits_setpoint(now, received, Validity::of(code))
    }

    /// The message, if its sender may send it.
    fn permitted(
        &self,
        may: fn(&Standing, JausId) -> bool,
        name: &'static str,
    ) -> Option<&'a Received> {
        let received = self.received?;
        let source = received.source;
        if !may(self.standing(), source) {
            tracing::debug!(%source, command = name, "ignored: sender not in control");
            return None;
        }
        Some(received)
    }
}

impl<'a> Deref for Call<'a> {
    type Target = Context<'a>;

    fn deref(&self) -> &Context<'a> {
        &self.context
    }
}

impl<'a> DerefMut for Call<'a> {
    fn deref_mut(&mut self) -> &mut Context<'a> {
        &mut self.context
    }
}

impl codec::Call for Call<'_> {
    fn step<M: Message>(
        &mut self,
        step: impl FnOnce(M, &mut Self) -> Outcome,
    ) -> Result<(), DecodeError> {
        let may = match (M::NEEDS_READINESS, M::IS_COMMAND) {
            (true, _) => Standing::acts_for,
            (false, true) => Standing::obeys,
            (false, false) => |_: &Standing, _| true,
        };
        self.guarded(may, M::NEEDS_READINESS, step)
    }

    fn answer<Q: Query>(
        &mut self,
        answer: impl FnOnce(Q, &mut Self) -> Option<Q::Report>,
    ) -> Result<(), DecodeError> {
        let Some(received) = self.received else {
            return Ok(());
        };
        let query = Q::decode(&received.payload)?;
        if let Some(mut report) = answer(query.clone(), self) {
            query.drop_unrequested(&mut report);
            self.reply(received, &report);
        }
        Ok(())
    }

    fn send<M: Message>(&mut self, message: &M) {
        if let Some(received) = self.received {
            self.reply(received, message);
        }
    }

    fn send_report<Q: Query>(&mut self, mut report: Q::Report) {
        let query = self.received.and_then(|it| Q::decode(&it.payload).ok());
        if let Some(query) = query {
            query.drop_unrequested(&mut report);
        }
        self.send(&report);
    }

    fn is_controlling_client(&self) -> bool {
        self.source().is_some_and(|it| self.standing().obeys(it))
    }
}

/// An answer to a query that the service owes.
#[derive(Debug, Clone)]
#[must_use = "the client waits for the answer"]
pub struct LaterAnswer<Q> {
    request: Received,
    query: Q,
}

impl<Q: Query> LaterAnswer<Q> {
    /// The query.
    #[must_use]
    pub const fn query(&self) -> &Q {
        &self.query
    }

    /// The message that answers with this report, without what the query did not request. A
    /// component sends it with `Component::answer`.
    ///
    /// # Errors
    /// If the report cannot be encoded.
    pub fn into_outgoing(self, mut report: Q::Report) -> Result<Outgoing, EncodeError> {
        let Received {
            source,
            destination,
            priority,
            ..
        } = self.request;
        self.query.drop_unrequested(&mut report);
        Ok(Outgoing {
            priority,
            ..Outgoing::new(destination, source, report.encode()?)
        })
    }
}
