//! Components that may not send everything: those of processes whose user has rights of its own.

use std::time::Instant;

use tracing::warn;

use super::verify::Warning;
use super::{Counter, Endpoint, MessageHandle, Outgoing, Received, SendError, Sink};
use crate::address::JausId;
use crate::rights::{Admitted, Decision, Refusal, Rules, Unaccepted, denial};
use crate::wire::{Flags, Frame};

impl Endpoint {
    /// Limits what an attached component may send to these rights, until it detaches.
    pub fn restrict(&mut self, id: JausId, rules: Rules) {
        if self.components.contains(&id) {
            self.restricted.insert(id, rules);
        }
    }

    /// Checks a message against the rights of its sender, and says to which ids it may go. A refused
    /// request for control is answered.
    pub(super) fn admit_restricted(
        &mut self,
        now: Instant,
        message: &Outgoing,
        sink: &mut dyn Sink,
    ) -> Result<Admitted, SendError> {
        let Some(rules) = self.restricted.get(&message.source) else {
            return Ok(Admitted::Whole);
        };
        let frame = Frame {
            flags: Flags::new(message.priority).with_broadcast(message.broadcast),
            ..Frame::new(message.source, message.destination, message.payload.clone())
        };
        let admitted = rules.admit(&frame, &self.config.access.table);
        admitted.map_err(|why| {
            self.refuse_restricted(now, &frame, why, sink);
            SendError::NotAllowed(why)
        })
    }

    fn refuse_restricted(
        &mut self,
        now: Instant,
        frame: &Frame,
        why: Refusal,
        sink: &mut dyn Sink,
    ) {
        self.counters.add(Counter::NotGranted);
        let refused = Err(Unaccepted::Rule(why));
        if let Some(decision) = Decision::of(frame, refused, &self.config.access.table)
            && self.warnings.is_due(now, Warning::OwnNotGranted)
        {
            warn!("refused to a component of this host: {decision}");
        }
        if let Some(denial) = denial(frame) {
            sink.deliver(Received {
                source: denial.source,
                destination: denial.destination,
                priority: denial.flags.priority(),
                broadcast: frame.flags.broadcast().unwrap_or_default(),
                sequence: None,
                payload: denial.payload,
                path: None,
                to: denial.destination,
                acknowledged: false,
            });
        }
    }

    /// Sends a copy to each of the ids of a group. Nothing of it awaits an acknowledgement, so that the
    /// handle of one stands for all.
    pub(super) fn send_to_each(
        &mut self,
        now: Instant,
        message: &Outgoing,
        ids: Vec<JausId>,
        sink: &mut dyn Sink,
    ) -> Result<MessageHandle, SendError> {
        let mut last = Err(SendError::NotAllowed(Refusal::Elsewhere));
        for destination in ids {
            let copy = Outgoing {
                destination,
                ..message.clone()
            };
            last = self.send(now, copy, sink);
        }
        last
    }
}
