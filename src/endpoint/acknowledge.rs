//! Sends acknowledgements, and remembers broadcasts whose acknowledgement teaches the receiver's
//! address.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::arrival::Arrival;
use super::{Counter, Endpoint};
use crate::address::JausId;
use crate::wire::{Acknowledgement, Flags, Frame};

/// The most calls remembered.
const MOST_CALLS: usize = 256;
/// How long a call is remembered.
const CALL_LIFE: Duration = Duration::from_secs(5);

/// Unreliable messages that were broadcast because the receiver's address was unknown. An
/// acknowledgement of one teaches the address.
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

    /// Whether a local component called the peer with this number recently, without an answer so
    /// far.
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
    /// Acknowledges a message that requests it, and each duplicate of it: the peer retransmits
    /// because an acknowledgement got lost. A broadcast to many is not acknowledged, or all
    /// receivers would answer at once.
    pub(super) fn acknowledge(&mut self, arrival: Arrival<'_>) {
        let (request, now, path) = (arrival.frame, arrival.now, arrival.path);
        if !request.destination.is_unicast() {
            return;
        }
        self.reassembly.hear(now, path.into());
        let priority = request.flags.priority();
        let code = request.payload.slice(..request.repeated_code_len());
        let answer = Frame {
            version: request.version,
            flags: Flags::new(priority).with_acknowledgement(Acknowledgement::Positive),
            sequence: request.sequence,
            ..Frame::new(request.destination, request.source, code)
        };
        if self.send_along(now, path, &answer) == Ok(true) {
            self.counters.add(Counter::AcknowledgementsSent);
        }
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use bytes::Bytes;

    use super::*;

    const US: JausId = JausId::new(101, 1, 1);
    const PEER: JausId = JausId::new(42, 1, 1);

    fn call(sequence: u16) -> Frame {
        Frame {
            sequence,
            ..Frame::new(US, PEER, Bytes::from_static(b"\x02\x22"))
        }
    }

    #[test]
    fn the_latest_256_calls_are_remembered_until_each_is_answered() {
        let (mut calls, now) = (Calls::default(), Instant::now());
        for sequence in 1..=257 {
            calls.insert(now, &call(sequence));
        }
        for (sequence, expected) in [(1, false), (2, true), (2, false), (257, true)] {
            assert_eq!(calls.take(now, PEER, US, sequence), expected, "{sequence}");
        }
        assert!(!calls.take(now, US, PEER, 3), "of another peer");
        assert!(!calls.take(now, PEER, PEER, 3), "to another component");
    }

    #[test]
    fn a_call_can_be_answered_for_five_seconds() {
        for (after, expected) in [(4999, true), (5000, false)] {
            let (mut calls, now) = (Calls::default(), Instant::now());
            calls.insert(now, &call(7));
            let then = now + Duration::from_millis(after);
            assert_eq!(calls.take(then, PEER, US, 7), expected, "after {after} ms");
        }
    }
}
