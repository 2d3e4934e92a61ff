//! A message to a vehicle, with everything needed to handle it.

use std::time::{Duration, Instant};

use super::controls::Controls;
use crate::motion::{Goal, Ticket};
use jaus::address::JausId;
use jaus::codec::{Message, OutOfRange, Query, Report};
use jaus::endpoint::Received;
use jaus::service::{Context, Standing, State, Validity, code_of, read};

/// A command from the client in control.
pub(super) struct Command<M> {
    pub(super) message: M,
    /// Whether the vehicle executes the command or only stores it.
    pub(super) acts: bool,
}

/// One message with the vehicle and its context.
pub(super) struct Exchange<'a, 'c> {
    pub(super) now: Instant,
    pub(super) controls: &'a mut Controls,
    pub(super) message: &'a Received,
    pub(super) context: &'a mut Context<'c>,
}

impl Exchange<'_, '_> {
    /// Reads a query from any client.
    pub(super) fn query<Q: Message>(&self) -> Option<Q> {
        read(self.message)
    }

    /// Answers a query from any client with this report.
    pub(super) fn answer<Q: Query>(&mut self, report: impl FnOnce(&Q, &mut Self) -> Q::Report) {
        self.answer_if(|query, exchange| Ok(report(query, exchange)));
    }

    /// As [`answer`](Self::answer), unless the report contains a number outside the range of its
    /// field.
    pub(super) fn answer_if<Q: Query>(
        &mut self,
        report: impl FnOnce(&Q, &mut Self) -> Result<Q::Report, OutOfRange>,
    ) {
        let Some(query) = self.query::<Q>() else {
            return;
        };
        match report(&query, self) {
            Ok(report) => self.report(&query, report),
            Err(error) => tracing::debug!(query = Q::NAME, %error, "cannot encode the report"),
        }
    }

    /// Sends the report with the fields that the query requests, and the sample time of the
    /// vehicle's motion if there is a clock.
    pub(super) fn report<Q: Query>(&mut self, query: &Q, mut report: Q::Report) {
        if let Some(since_1970) = self.sampled_since_1970() {
            report.stamp(since_1970);
        }
        query.drop_unrequested(&mut report);
        self.reply(&report);
    }

    /// Reads a configuration command, which only the client in control may send.
    pub(super) fn configure<M: Message>(&self) -> Option<M> {
        self.read_if(Standing::obeys)
    }

    /// Reads a command from the client in control. In standby the command is stored and reported
    /// but never moves the vehicle, not even later. The judges of the public contests check this.
    pub(super) fn command<M: Message>(&mut self) -> Option<Command<M>> {
        let may = |standing: &Standing, client| match standing.state {
            State::Ready | State::Standby => standing.obeys(client),
            _ => false,
        };
        let message = self.read_if(may)?;
        if !self.is_in_order() {
            return None;
        }
        let is_ready = self.context.standing().acts_for(self.message.source);
        let acts = is_ready && !self.controls.is_in_trouble();
        Some(Command { message, acts })
    }

    /// Whether the setpoint is newer than its sender's last one and than its last stop.
    pub(super) fn is_in_order(&mut self) -> bool {
        let validity = code_of(&self.message.payload).map_or(Validity::Brief, Validity::of);
        self.context
            .admits_setpoint(self.now, self.message, validity)
    }

    /// Pursues a goal for the sender as long as its command is valid.
    pub(super) fn pursue(&mut self, goal: Goal, validity: Validity) -> Ticket {
        self.accept(validity);
        self.controls.pilot.pursue(goal)
    }

    /// Puts the sender's command in force.
    pub(super) fn accept(&mut self, validity: Validity) {
        let guard = &mut self.controls.guard;
        guard.accept(self.now, self.message.source, validity);
    }

    fn read_if<M: Message>(&self, may: impl Fn(&Standing, JausId) -> bool) -> Option<M> {
        let (standing, source) = (self.context.standing(), self.message.source);
        if may(standing, source) {
            return read(self.message);
        }
        let state = standing.state;
        tracing::debug!(%source, command = M::NAME, %state, "ignored: sender not in control, or \
            not ready");
        None
    }

    /// Sends the reply.
    pub(super) fn reply<R: Message>(&mut self, report: &R) {
        self.context.reply(self.message, report);
    }

    /// Sample time of the vehicle's motion since the start of 1970; `None` without a clock.
    fn sampled_since_1970(&mut self) -> Option<Duration> {
        let sampled_at = self.controls.pilot.motion().sampled_at;
        let clock = self.controls.clock.as_mut()?;
        Some(clock.since_1970(self.now, sampled_at))
    }
}
