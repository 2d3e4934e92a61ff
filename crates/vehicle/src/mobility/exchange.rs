//! A message that has come for a vehicle, and all that is needed to deal with it.

use std::time::{Duration, Instant};

use super::clock;
use super::controls::Controls;
use crate::motion::{Goal, Ticket};
use jaus::address::JausId;
use jaus::codec::{Message, OutOfRange};
use jaus::endpoint::Received;
use jaus::messages::mobility::report_local_pose::TimeStamp;
use jaus::service::{Context, Standing, State, Validity, read};

/// A command of the client in control.
pub(super) struct Command<M> {
    pub(super) message: M,
    /// Whether the vehicle acts on it, or only keeps it.
    pub(super) acts: bool,
}

/// One message, with the vehicle and the context in which it came.
pub(super) struct Exchange<'a, 'c> {
    pub(super) now: Instant,
    pub(super) controls: &'a mut Controls,
    pub(super) message: &'a Received,
    pub(super) context: &'a mut Context<'c>,
}

impl Exchange<'_, '_> {
    /// Reads a query, whoever asks.
    pub(super) fn query<Q: Message>(&self) -> Option<Q> {
        read(self.message)
    }

    /// Reads what sets something up; only the client in control may.
    pub(super) fn configure<M: Message>(&self) -> Option<M> {
        self.read_if(Standing::obeys)
    }

    /// Reads a command of the client in control. In standby it is to be kept and reported, and
    /// nothing moves by it, also not later; the public contests' judges look for that.
    pub(super) fn command<M: Message>(&self) -> Option<Command<M>> {
        let may = |standing: &Standing, client| match standing.state {
            State::Ready | State::Standby => standing.obeys(client),
            _ => false,
        };
        let message = self.read_if(may)?;
        let is_ready = self.context.standing().acts_for(self.message.source);
        let acts = is_ready && !self.controls.is_in_trouble();
        Some(Command { message, acts })
    }

    /// Pursues a goal on behalf of the sender for as long as its command is valid.
    pub(super) fn pursue(&mut self, goal: Goal, validity: Validity) -> Ticket {
        self.accept(validity);
        self.controls.pilot.pursue(goal)
    }

    /// The sender's command is in force from now on.
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
        tracing::debug!(%source, message = M::NAME, %state, "ignored: not in control or not ready");
        None
    }

    /// Answers.
    pub(super) fn reply<R: Message>(&mut self, report: &R) {
        self.context.reply(self.message, report);
    }

    /// Answers, unless the answer has a number that the report cannot hold.
    pub(super) fn reply_if<R: Message>(&mut self, report: Result<R, OutOfRange>) {
        match report {
            Ok(report) => self.reply(&report),
            Err(error) => tracing::debug!(report = R::NAME, %error, "cannot be reported"),
        }
    }

    /// When the vehicle's motion was sampled, since the beginning of 1970; `None` without a clock.
    fn sampled_since_1970(&mut self) -> Option<Duration> {
        let sampled_at = self.controls.pilot.motion().sampled_at;
        let clock = self.controls.clock.as_mut()?;
        Some(clock.since_1970(self.now, sampled_at))
    }

    /// When the motion was sampled, for the reports of version 1.1: seconds since 1970, and the rest
    /// in nanoseconds.
    pub(super) fn seconds_and_nanoseconds(&mut self) -> (Option<u32>, Option<u32>) {
        let Some(time) = self.sampled_since_1970() else {
            return (None, None);
        };
        (
            u32::try_from(time.as_secs()).ok(),
            Some(time.subsec_nanos()),
        )
    }

    /// When the motion was sampled, for the reports of version 1.0.
    pub(super) fn stamp(&mut self) -> Option<TimeStamp> {
        clock::stamp(self.sampled_since_1970()?)
    }
}
