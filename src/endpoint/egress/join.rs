//! Packs several messages into one datagram, and several datagrams into one batch.

use std::collections::VecDeque;
use std::time::Instant;

use bytes::{BufMut, Bytes, BytesMut};

use super::queue::{HopQueue, Level};
use super::{MOST_OCTETS, encode};
use crate::endpoint::{Counter, Counters, LinkProfile};
use crate::wire::{EncodeError, Frame, Priority, as5669a, judp};

impl HopQueue {
    /// The first queued message, packed with others into a datagram of up to `longest` octets, and
    /// followed by further datagrams of the same length, of which only the last may be shorter.
    /// Returns the octets and that length.
    pub(super) fn join_messages(
        &mut self,
        level: Level,
        segments: usize,
        longest: usize,
        buffer: &mut BytesMut,
    ) -> Option<(Bytes, Option<usize>)> {
        let priority = usize::from(level.priority().bits());
        let mut joined = Joined::new(self.whole[priority].pop_front()?, buffer);
        // Less urgent messages use the remaining room, but must not delay a safety-critical one.
        let least = if level.priority() == Priority::SafetyCritical {
            priority
        } else {
            0
        };
        let queues = &mut self.whole[least..=priority];
        joined.pack(0, queues, longest);
        Some(joined.batch(segments, |joined, length| {
            let next = pop_if(&mut queues[priority - least], |it| it.len() <= length)?;
            let start = joined.len();
            joined.push(&next);
            joined.pack(start, queues, longest.min(length));
            Some(())
        }))
    }

    /// The next fragment that may be sent, batched with others of the same length. Each is passed to
    /// `leave`, and counted if it cannot be encoded.
    pub(super) fn join_fragments(
        &mut self,
        now: Instant,
        level: Level,
        link: &LinkProfile,
        buffer: &mut BytesMut,
        counters: &mut Counters,
        mut leave: impl FnMut(&Frame),
    ) -> Option<(Bytes, Option<usize>)> {
        let (first, like) = loop {
            let frame = self.next_fragment(now, level, None)?;
            leave(&frame);
            match encode(link.framing, buffer, &frame) {
                Ok(octets) => break (octets, (frame.version, frame.payload.len())),
                Err(_) => counters.add(Counter::CannotSend),
            }
        };
        Some(
            Joined::new(first, buffer).batch(link.segments(), |joined, _| {
                let next = self.next_fragment(now, level, Some(like))?;
                leave(&next);
                let emitted = joined.emit(&next);
                emitted.map_err(|_| counters.add(Counter::CannotSend)).ok()
            }),
        )
    }
}

/// Octets sent together. A single message is not copied.
struct Joined<'a> {
    first: Bytes,
    /// All of the octets, once there is more than the first message.
    buffer: &'a mut BytesMut,
}

impl<'a> Joined<'a> {
    fn new(first: Bytes, buffer: &'a mut BytesMut) -> Self {
        Self { first, buffer }
    }

    fn len(&self) -> usize {
        self.buffer.len().max(self.first.len())
    }

    fn begin(&mut self) {
        if self.buffer.is_empty() {
            self.buffer.put_slice(&self.first);
        }
    }

    fn push(&mut self, octets: &[u8]) {
        self.begin();
        self.buffer.put_slice(octets);
    }

    fn emit(&mut self, frame: &Frame) -> Result<(), EncodeError> {
        self.begin();
        judp::emit(frame, self.buffer)
    }

    /// Packs queued messages, the most urgent first, into the datagram that begins at `start`, up
    /// to `longest` octets.
    fn pack(&mut self, start: usize, queues: &mut [VecDeque<Bytes>], longest: usize) {
        let datagram = if start == 0 {
            &self.first[..]
        } else {
            &self.buffer[start..]
        };
        if !may_pack(datagram, longest) {
            return;
        }
        // A packed message lacks its version octet.
        let room = |joined: &Self| 1 + longest - (joined.len() - start);
        for queue in queues.iter_mut().rev() {
            while let Some(next) =
                pop_if(queue, |it| has_current_header(it) && it.len() <= room(self))
            {
                self.push(next.get(1..).unwrap_or_default());
            }
        }
    }

    /// Appends datagrams of the length of the first, of which only the last may be shorter, up to
    /// `segments` in all. Returns the octets, and that length if there is more than one datagram.
    fn batch(
        mut self,
        segments: usize,
        mut append: impl FnMut(&mut Self, usize) -> Option<()>,
    ) -> (Bytes, Option<usize>) {
        let (length, mut segment) = (self.len(), None);
        for _ in 1..segments.min(MOST_OCTETS / length.max(1)) {
            let start = self.len();
            if append(&mut self, length).is_none() {
                break;
            }
            segment = Some(length);
            if self.len() - start < length {
                break;
            }
        }
        if self.buffer.is_empty() {
            return (self.first, None);
        }
        (self.buffer.split().freeze(), segment)
    }
}

fn pop_if(queue: &mut VecDeque<Bytes>, is_wanted: impl FnOnce(&Bytes) -> bool) -> Option<Bytes> {
    queue.front().filter(|it| is_wanted(it))?;
    queue.pop_front()
}

/// Whether another message fits after a datagram with the AS5669A header.
pub(super) fn may_pack(datagram: &[u8], longest: usize) -> bool {
    has_current_header(datagram) && datagram.len() + as5669a::MIN_LEN <= longest
}

/// Whether a datagram has the AS5669A header.
fn has_current_header(datagram: &[u8]) -> bool {
    datagram.first() == Some(&judp::VERSION_AS5669A)
}
