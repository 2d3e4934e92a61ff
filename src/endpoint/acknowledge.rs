//! Answering messages that want an acknowledgement.

use super::{Counter, Endpoint, Path, To, Transmit};
use crate::wire::{Acknowledgement, Broadcast, DataControl, Frame, Kind, Version, ra};

impl Endpoint {
    /// Answers a message that wants an acknowledgement, and does so for each copy: the peer repeats
    /// it because an answer got lost. A broadcast to many is not acknowledged, or all would answer
    /// at once.
    pub(super) fn acknowledge(&mut self, from: Path, request: &Frame) {
        if !request.destination.is_unicast() {
            return;
        }
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
        let Ok(payload) = self.framing(from.link).encode(&answer) else {
            return;
        };
        let transmit = Transmit {
            link: from.link,
            to: To::Peer(from.peer),
            priority: request.flags.priority(),
            payload,
            segment: None,
        };
        if self.transmit(transmit) {
            self.counters.add(Counter::AcknowledgementsSent);
        }
    }
}
