//! What leaves: in the order of urgency, and several datagrams at once where a link takes them so.

use bytes::{BufMut, BytesMut};

use super::{Counter, Endpoint, LinkProfile, Transmit};
use crate::wire::{Framing, Priority};

/// What the kernel takes at once, whatever the number of datagrams; a little less than it says.
const MOST_OCTETS: usize = 65_000;

impl Endpoint {
    /// What is sent next, the most urgent first.
    pub(super) fn next_transmit(&mut self) -> Option<Transmit> {
        let first = self.take_datagram()?;
        let first = self.join_train(first);
        let datagrams = first
            .segment
            .map_or(1, |segment| first.payload.len().div_ceil(segment));
        self.counters
            .add_many(Counter::DatagramsSent, datagrams as u64);
        Some(first)
    }

    /// The most urgent datagram, with what else shares it.
    fn take_datagram(&mut self) -> Option<Transmit> {
        let first = self.take_transmit()?;
        Some(self.pack(first))
    }

    /// The most urgent datagram. What waits in the queue goes before what is cut from large
    /// messages and before what a window holds back.
    pub(super) fn take_transmit(&mut self) -> Option<Transmit> {
        if let Some(held) = self.held.pop() {
            return Some(held);
        }
        let next = Priority::ALL.into_iter().rev().find_map(|priority| {
            let queued = self.transmits.pop_at(priority);
            queued
                .or_else(|| self.next_delivery(priority))
                .or_else(|| self.next_paced(priority))
        });
        // What may not leave before its address is proven has queued a challenge instead.
        next.or_else(|| self.transmits.pop())
    }

    /// The next datagram to the same place, if it comes next and `fits`; what does not is held back
    /// for later.
    pub(super) fn take_companion(
        &mut self,
        first: &Transmit,
        take: fn(&mut Self) -> Option<Transmit>,
        fits: impl FnOnce(&Transmit) -> bool,
    ) -> Option<Transmit> {
        let next = take(self)?;
        if (next.link, next.to) == (first.link, first.to) && fits(&next) {
            return Some(next);
        }
        self.held.push(next);
        None
    }

    /// Joins datagrams of the same length to the same place, such as the fragments of a message or
    /// acknowledgements, into one [`Transmit`], for links that can send them with one call.
    fn join_train(&mut self, first: Transmit) -> Transmit {
        let segments = self
            .links
            .get(&first.link)
            .filter(|link| link.framing == Framing::Judp)
            .map_or(1, |LinkProfile { max_segments, .. }| *max_segments);
        let length = first.payload.len();
        let segments = segments.min(MOST_OCTETS / length.max(1));
        if segments <= 1 {
            return first;
        }
        let mut train = BytesMut::new();
        for _segment in 1..segments {
            let fits = |next: &Transmit| next.payload.len() <= length;
            let Some(next) = self.take_companion(&first, Self::take_datagram, fits) else {
                break;
            };
            if train.is_empty() {
                train.reserve(segments * length);
                train.put_slice(&first.payload);
            }
            train.put_slice(&next.payload);
            if next.payload.len() < length {
                break;
            }
        }
        if train.is_empty() {
            return first;
        }
        Transmit {
            payload: train.freeze(),
            segment: Some(length),
            ..first
        }
    }
}
