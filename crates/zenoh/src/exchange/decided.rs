//! What messages of the zenoh side may do here, and the decisions for an audit log.

use std::time::Instant;

use jaus::rights::{
    Admitted, Decided, Decision, Refusal, Unaccepted, check_unrecorded, denial, is_recorded,
};
use jaus::wire::Frame;

use super::Exchange;
use crate::counters::Counter;
use crate::key::{BridgeId, Recipient};

impl Exchange {
    /// Whether to refuse what changes something, because it could not be recorded.
    pub const fn refuse_commands(&mut self, is_refusing: bool) {
        self.is_refusing = is_refusing;
    }

    /// The next decision on a message of another bridge, or on the control of a client there, for an audit
    /// log: refused messages, and what concerns control, emergencies and the configuration of components.
    pub fn poll_decision(&mut self) -> Option<Decided<BridgeId>> {
        self.decisions.pop()
    }

    /// Decides on a message of a component that its bridge speaks for.
    pub(super) fn decide(
        &mut self,
        now: Instant,
        from: BridgeId,
        frame: &Frame,
    ) -> Result<Admitted, Counter> {
        let admitted = self.accept.admit(frame, &self.table).and_then(|admitted| {
            if self.is_refusing {
                check_unrecorded(frame, &self.table).map_err(Unaccepted::Rule)?;
            }
            Ok(admitted)
        });
        let checked = admitted.as_ref().map(|_| ()).map_err(|why| *why);
        if let Some(decision) = self.in_control.decision(frame, checked, &self.table) {
            if let Err(Unaccepted::Rule(refusal)) = checked {
                self.refuse(now, from, frame, (&decision, refusal));
            }
            self.record(decision, from);
        }
        admitted.map_err(|why| match why {
            Unaccepted::Source => Counter::NotAccepted,
            Unaccepted::Rule(_) => Counter::RuleForbids,
        })
    }

    /// Records a message under the id of a component that its bridge does not speak for, if it would have been
    /// recorded otherwise.
    pub(super) fn record_intruder(&mut self, from: BridgeId, frame: &Frame) {
        if is_recorded(frame, &self.table)
            && let Some(refused) = Decision::of(frame, Err(Unaccepted::Source), &self.table)
        {
            self.record(refused, from);
        }
    }

    /// Records what a component of this side tells a client of a bridge about its control.
    pub(super) fn record_answer(&mut self, frame: &Frame, to: Recipient) {
        if let Recipient::Bridge(client) = to
            && let Some(told) = self.in_control.told(frame, &self.table)
        {
            self.record(told, client);
        }
    }

    fn record(&mut self, decision: Decision, client: BridgeId) {
        if !self.decisions.push(decision, client) {
            self.counters.add(Counter::DecisionsLost);
        }
    }

    /// Logs a refusal, and answers a request for control.
    fn refuse(
        &mut self,
        now: Instant,
        from: BridgeId,
        frame: &Frame,
        (decision, refusal): (&Decision, Refusal),
    ) {
        let code = frame.code().unwrap_or_default();
        if self.refused.is_due(now, (frame.source, code)) {
            let place = match refusal {
                Refusal::Unrecorded => "",
                _ => " (--accept)",
            };
            tracing::warn!("refused {decision}{place}");
        }
        if let Some(denial) = denial(frame)
            && self.locals.contains_key(&denial.source)
        {
            self.publish(now, &denial, None, Recipient::Bridge(from));
        }
    }
}
