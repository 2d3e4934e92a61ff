//! What RA components may send to JAUS components, and the record of it.

use std::time::Instant;

use jaus::address::JausId;
use jaus::endpoint::{Outgoing, Received};
use jaus::rights::{Decided, Decision, Table, Unaccepted, check_unrecorded, denial};
use jaus::wire::Frame;

use super::proxy::Proxy;
use super::{Action, Counter, Gateway};
use crate::RaId;

impl Gateway {
    /// The next decision on a message of an RA component, or on its control of a JAUS component, for an
    /// audit log.
    pub fn poll_decision(&mut self) -> Option<Decided<RaId>> {
        self.decisions.pop()
    }

    /// Passes the messages of a proxy on to JAUS components, as far as the RA component may send them.
    /// Returns the answers to refused requests for control.
    pub(super) fn pass_on(&mut self, now: Instant, proxy: &mut Proxy) -> Vec<Received> {
        let (mut denials, table) = (Vec::new(), Table::default());
        while let Some(message) = proxy.poll_transmit() {
            let frame = frame_of(&message);
            let checked = self.check_sent(&frame, &table);
            if let Some(decision) = self.in_control.decision(&frame, checked, &table) {
                self.record(now, decision, proxy.ra());
            }
            match checked {
                Ok(()) => self.actions.push_back(Action::Send(message)),
                Err(why) => {
                    self.refuse(now, &frame, why);
                    denials
                        .extend(denial(&frame).map(|denial| received(&denial, proxy.stack.id())));
                }
            }
        }
        denials
    }

    /// Whether to refuse what changes something, because it could not be recorded.
    pub const fn refuse_commands(&mut self, is_refusing: bool) {
        self.is_refusing = is_refusing;
    }

    fn check_sent(&self, frame: &Frame, table: &Table) -> Result<(), Unaccepted> {
        self.settings.grants.check(frame, table)?;
        match self.is_refusing {
            true => check_unrecorded(frame, table).map_err(Unaccepted::Rule),
            false => Ok(()),
        }
    }

    /// Records what a JAUS component tells an RA component about its control.
    pub(super) fn record_answer(&mut self, now: Instant, message: &Received) {
        let Some(proxy) = self.proxies.get(&message.to) else {
            return;
        };
        let ra = proxy.ra();
        let frame = Frame::new(message.source, message.to, message.payload.clone());
        if let Some(told) = self.in_control.told(&frame, &Table::default()) {
            self.record(now, told, ra);
        }
    }

    fn record(&mut self, now: Instant, decision: Decision, ra: RaId) {
        if !self.decisions.push(decision, ra) {
            self.tally.refuse(now, Counter::DecisionsLost, 0, ra);
        }
    }

    fn refuse(&mut self, now: Instant, frame: &Frame, why: Unaccepted) {
        let (code, source) = (frame.code().unwrap_or_default(), frame.source);
        let why = format_args!("{source}: {why} (--ra-grant)");
        self.tally.refuse(now, Counter::NotGranted, code, why);
    }
}

fn frame_of(message: &Outgoing) -> Frame {
    Frame::new(message.source, message.destination, message.payload.clone())
}

/// A message of this node for a proxy.
fn received(frame: &Frame, to: JausId) -> Received {
    Received {
        source: frame.source,
        destination: frame.destination,
        priority: frame.flags.priority(),
        broadcast: jaus::wire::Broadcast::None,
        sequence: None,
        payload: frame.payload.clone(),
        path: None,
        to,
        acknowledged: false,
    }
}
