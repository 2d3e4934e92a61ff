//! The decisions on messages of plain links, for an audit log.

use tracing::warn;

use super::arrival::Arrival;
use super::verify::Warning;
use super::{Counter, Endpoint, Outgoing, Remote};
use crate::rights::{
    self, Admitted, Decision, DecisionQueue, InControl, Unaccepted, check_unrecorded, denial,
};
use crate::wire::Frame;

/// A decision on a message of a plain link, or on the control of a client there.
pub type Decided = rights::Decided<Remote>;

/// What was decided and is not polled yet.
#[derive(Debug, Default)]
pub(super) struct Decisions {
    /// Whether anybody polls.
    is_recording: bool,
    /// Whether what changes something is refused, because it could not be recorded.
    is_refusing: bool,
    waiting: DecisionQueue<Remote>,
    in_control: InControl,
}

impl Endpoint {
    /// Keeps decisions on messages of plain links for [`poll_decision`](Self::poll_decision): refused
    /// messages, and what concerns control, emergencies and the configuration of components. Links with
    /// sessions know who their clients are, and record their own: secure links and the one to zenoh.
    pub fn record_decisions(&mut self) {
        self.decisions.is_recording = true;
    }

    /// Whether to refuse what changes something, because it could not be recorded, on plain links.
    pub fn refuse_commands(&mut self, is_refusing: bool) {
        self.decisions.is_refusing = is_refusing;
    }

    /// The next decision for an audit log. Those for which the queue has no room are counted
    /// as [`Counter::DecisionsLost`].
    pub fn poll_decision(&mut self) -> Option<Decided> {
        self.decisions.waiting.pop()
    }

    /// Decides by the rights of the sender. A refused message is not acknowledged; a request for control
    /// is answered.
    pub(super) fn refuse_without_right(
        &mut self,
        arrival: Arrival<'_>,
    ) -> Result<Admitted, Counter> {
        let admitted = self.admit(arrival.frame, arrival.path.peer);
        admitted.map_err(|why| {
            self.handle_refusal(arrival, why);
            Counter::NotGranted
        })
    }

    fn handle_refusal(&mut self, arrival: Arrival<'_>, why: Unaccepted) {
        let Arrival {
            frame, now, path, ..
        } = arrival;
        if let Some(refusal) = Decision::of(frame, Err(why), &self.config.access.table) {
            if self.warnings.is_due(now, Warning::NotGranted) {
                warn!(from = %path.peer, "refused {refusal}");
            }
            self.record(refusal, path.peer);
        }
        if let Some(denial) = denial(frame) {
            // What cannot be encoded for the link is not answered.
            let _sent = self.send_along(now, path, &denial);
        }
    }

    /// Whether messages of a remote end are recorded here.
    pub(super) const fn records(&self, from: Remote) -> bool {
        self.decisions.is_recording && !from.is_session()
    }

    /// Records a message that was delivered or passed on.
    pub(super) fn record_passed(&mut self, frame: &Frame, from: Remote) {
        if !self.records(from) {
            return;
        }
        let table = &self.config.access.table;
        if let Some(passed) = self.decisions.in_control.decision(frame, Ok(()), table) {
            self.record(passed, from);
        }
    }

    /// Records what a component tells a client of a plain link about its control.
    pub(super) fn record_answer(&mut self, message: &Outgoing) {
        if !self.decisions.is_recording {
            return;
        }
        let (client, payload) = (message.destination, message.payload.clone());
        let frame = Frame::new(message.source, client, payload);
        let table = &self.config.access.table;
        if let Some(told) = self.decisions.in_control.told(&frame, table)
            && let Some((path, _)) = self.route(client)
        {
            self.record(told, path.peer);
        }
    }

    fn admit(&self, frame: &Frame, from: Remote) -> Result<Admitted, Unaccepted> {
        let access = &self.config.access;
        let admitted = access.admit(frame, from)?;
        if self.decisions.is_refusing && !from.is_session() {
            check_unrecorded(frame, &access.table).map_err(Unaccepted::Rule)?;
        }
        Ok(admitted)
    }

    fn record(&mut self, decision: Decision, client: Remote) {
        let is_plain = !client.is_session();
        if self.decisions.is_recording && is_plain && !self.decisions.waiting.push(decision, client)
        {
            self.counters.add(Counter::DecisionsLost);
        }
    }
}
