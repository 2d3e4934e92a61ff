//! Acknowledging, and the calls of which an acknowledgement tells where their receiver is.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::{Counter, Endpoint, Path};
use crate::address::JausId;
use crate::wire::{Acknowledgement, Broadcast, DataControl, Frame, Kind, Version, ra};

/// The most calls that are remembered.
const MOST_CALLS: usize = 256;
/// For how long.
const CALL_LIFE: Duration = Duration::from_secs(5);

/// Messages without delivery that went to everybody because their receiver's address was not known.
/// An acknowledgement of one teaches the address.
#[derive(Debug, Default)]
pub(super) struct Calls(VecDeque<(Instant, JausId, JausId, u16)>);

impl Calls {
    pub(super) fn insert(&mut self, now: Instant, call: &Frame) {
        if self.0.len() >= MOST_CALLS {
            self.0.pop_front();
        }
        let (peer, local) = (call.destination, call.source);
        self.0.push_back((now, peer, local, call.sequence));
    }

    /// Whether a component of ours has called a peer with that number lately, and was not answered.
    pub(super) fn take(&mut self, now: Instant, peer: JausId, local: JausId, number: u16) -> bool {
        let is_over = |at: Instant| now.saturating_duration_since(at) >= CALL_LIFE;
        while self.0.front().is_some_and(|&(at, ..)| is_over(at)) {
            self.0.pop_front();
        }
        let is_it = |call: &(Instant, JausId, JausId, u16)| {
            (call.1, call.2, call.3) == (peer, local, number)
        };
        let found = self.0.iter().position(is_it);
        found.and_then(|at| self.0.remove(at)).is_some()
    }
}

impl Endpoint {
    /// Answers a message that wants an acknowledgement, and does so for each copy: the peer repeats
    /// it because an answer got lost. A broadcast to many is not acknowledged, or all would answer
    /// at once.
    pub(super) fn acknowledge(&mut self, now: Instant, from: Path, request: &Frame) {
        if !request.destination.is_unicast() {
            return;
        }
        self.reassembly.hear(now, from.into());
        // The older headers' answers repeat the message code.
        let code_len = match request.version {
            Version::As5669a => 0,
            Version::As5669 | Version::Ra => ra::CODE_LEN,
        };
        let answer = Frame {
            version: request.version,
            kind: Kind::default(),
            flags: request
                .flags
                .with_acknowledgement(Acknowledgement::Positive)
                .with_broadcast(Broadcast::None)
                .with_data(DataControl::Single),
            destination: request.source,
            source: request.destination,
            sequence: request.sequence,
            payload: request.payload.slice(..code_len.min(request.payload.len())),
        };
        if self.send_along(now, from, &answer) == Ok(true) {
            self.counters.add(Counter::AcknowledgementsSent);
        }
    }
}
