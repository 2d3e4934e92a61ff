//! A message on its way, and the packets that it is sent in.

use std::time::Instant;

use bytes::Bytes;

use crate::address::JausId;
use crate::endpoint::Outgoing;
use crate::endpoint::large::Cut;
use crate::wire::{Acknowledgement, Broadcast, Flags, Frame, Priority, Version};

/// A message that waits to be sent or acknowledged.
#[derive(Debug)]
pub(super) struct PendingMessage {
    pub(super) source: JausId,
    pub(super) priority: Priority,
    pub(super) broadcast: Broadcast,
    pub(super) payload: Bytes,
    /// Whether the sender wants to be told the result.
    pub(super) awaited: bool,
    /// When it was handed in.
    pub(super) accepted: Instant,
    /// How it was cut, once the first of it was sent.
    pub(super) started: Option<Started>,
    /// Octets that were acknowledged.
    pub(super) acknowledged: usize,
}

/// What is known of a message once the first of it was sent.
#[derive(Debug)]
pub(super) struct Started {
    pub(super) cut: Cut,
    pub(super) version: Version,
    /// The serial number of the first fragment.
    pub(super) first: u64,
    /// The first fragment that was never sent.
    pub(super) next: usize,
    /// How many fragments were not acknowledged yet.
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

    /// The frame that carries a fragment; without its destination.
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
