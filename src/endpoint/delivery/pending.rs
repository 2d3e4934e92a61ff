//! A message in delivery, and the packets that carry it.

use std::time::Instant;

use bytes::Bytes;

use crate::address::JausId;
use crate::endpoint::Outgoing;
use crate::endpoint::large::Cut;
use crate::wire::{Acknowledgement, Broadcast, Flags, Frame, Priority, Version};

/// A message that is queued or unacknowledged.
#[derive(Debug)]
pub(super) struct PendingMessage {
    pub(super) source: JausId,
    pub(super) priority: Priority,
    pub(super) broadcast: Broadcast,
    pub(super) payload: Bytes,
    /// Whether the sender wants the result reported.
    pub(super) awaited: bool,
    /// When it was queued.
    pub(super) accepted: Instant,
    /// How it was cut, once its first packet is sent.
    pub(super) started: Option<Started>,
    /// Octets acknowledged so far.
    pub(super) acknowledged: usize,
}

/// The state of a message whose first packet is sent.
#[derive(Debug)]
pub(super) struct Started {
    pub(super) cut: Cut,
    pub(super) version: Version,
    /// The serial number of the first fragment.
    pub(super) first: u64,
    /// The first fragment not sent yet.
    pub(super) next: usize,
    /// How many fragments are unacknowledged.
    pub(super) missing: usize,
}

impl PendingMessage {
    pub(super) fn new(accepted: Instant, message: &Outgoing, scope: Broadcast) -> Self {
        Self {
            source: message.source,
            priority: message.priority,
            broadcast: scope,
            payload: message.payload.clone(),
            awaited: message.acknowledge,
            accepted,
            started: None,
            acknowledged: 0,
        }
    }

    /// The frame that carries a fragment, without its destination.
    pub(super) fn frame(&self, index: usize) -> Option<Frame> {
        let started = self.started.as_ref()?;
        let (data, payload) = started.cut.fragment(&self.payload, index);
        let flags = Flags::new(self.priority)
            .with_broadcast(self.broadcast)
            .with_acknowledgement(Acknowledgement::Request)
            .with_data(data);
        Some(Frame {
            version: started.version,
            flags,
            sequence: (started.first + index as u64) as u16,
            ..Frame::new(self.source, self.source, payload)
        })
    }
}
