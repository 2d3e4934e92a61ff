//! Taps: copies of a node's traffic, for viewers and logs.
//!
//! A [`Tap`] sees everything that arrives on a link, leaves on a link, or passes between components
//! of the node. It sees the raw traffic and not the endpoint's output: including fragments,
//! retransmissions, acknowledgements, and messages that are dropped later. The viewer decodes the
//! octets and reassembles messages.
//!
//! Traffic never waits for a tap. Each passage is put into the tap's own bounded queue as shared
//! octets. A full queue drops the oldest, and counts it. Without taps the cost is one test of an
//! empty list.

use std::future::poll_fn;
use std::sync::{Arc, Weak};
use std::time::SystemTime;

use bytes::Bytes;

use super::mailbox::{Mailbox, MailboxLimits};
use crate::address::JausId;
use crate::endpoint::{LinkId, Path, Received, To, Transmit};
use crate::wire::{Flags, Frame, Framing, Priority};

/// Limit of octets that wait for one tap, whatever the number of messages.
const OCTETS: usize = 16 << 20;

/// One passage of traffic through a node.
#[derive(Clone, Debug)]
pub struct Passage {
    /// The time of day.
    pub time: SystemTime,
    /// Its direction.
    pub way: Way,
    /// Its content.
    pub content: Content,
}

/// The direction of a passage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Received on this path.
    In(Path),
    /// Sent on this link, including forwarded messages.
    Out(LinkId, To),
    /// From one component of the node to this one. A message to several components passes several
    /// times.
    Local(JausId),
}

/// The content of a passage: octets as on the link, shared with other owners.
#[derive(Clone, Debug)]
pub enum Content {
    /// A received datagram, or data for a link to send.
    Octets {
        /// Their framing.
        framing: Framing,
        /// The octets themselves.
        octets: Bytes,
        /// If set, they are several datagrams of this many octets each; the last may be shorter.
        segment: Option<usize>,
    },
    /// A message between components of the node, or from a link that decodes the framing itself:
    /// TCP, serial lines.
    Frame(Frame),
}

/// An item of a [`Tap`].
#[derive(Clone, Debug)]
pub enum Tapped {
    /// A passage.
    Passage(Passage),
    /// This many passages were lost here, because the tap was too slow.
    Lost(u64),
}

impl Passage {
    /// The messages in it. Undecodable octets yield none.
    #[must_use]
    pub fn frames(&self) -> Vec<Frame> {
        match &self.content {
            Content::Frame(frame) => vec![frame.clone()],
            Content::Octets {
                framing: Framing::Judp,
                ..
            } => {
                let datagrams = self.datagrams().into_iter();
                datagrams.flat_map(|it| Framing::Judp.frames(it)).collect()
            }
            Content::Octets {
                framing, octets, ..
            } => framing.frames(octets.clone()),
        }
    }

    /// The datagrams in it, if it passed as datagrams.
    #[must_use]
    pub fn datagrams(&self) -> Vec<Bytes> {
        let Content::Octets {
            framing: Framing::Judp,
            octets,
            segment,
        } = &self.content
        else {
            return Vec::new();
        };
        let length = segment.unwrap_or(octets.len()).max(1);
        let starts = (0..octets.len()).step_by(length);
        starts
            .map(|start| octets.slice(start..(start + length).min(octets.len())))
            .collect()
    }

    /// The octets that it keeps alive.
    fn len(&self) -> usize {
        match &self.content {
            Content::Octets { octets, .. } => octets.len(),
            Content::Frame(frame) => frame.payload.len(),
        }
    }
}

/// A stream of all traffic of a node: received traffic before the endpoint processes it, outgoing
/// traffic, and messages between components of the node.
///
/// Drop it to end it.
///
/// ```no_run
/// # use jaus::node::{Node, Tapped};
/// # async fn example(node: Node) {
/// let mut tap = node.tap(1024);
/// while let Some(tapped) = tap.next().await {
///     match tapped {
///         Tapped::Passage(passage) => {
///             for frame in passage.frames() {
///                 println!("{} to {}", frame.source, frame.destination);
///             }
///         }
///         Tapped::Lost(count) => println!("{count} passages lost"),
///     }
/// }
/// # }
/// ```
#[derive(Debug)]
pub struct Tap {
    queue: Arc<Queue>,
    /// The number of the next passage if none is lost.
    next: u64,
    /// The passage after the lost ones, which are reported first.
    held: Option<Passage>,
}

/// The queue of one tap: passages, with their numbers.
type Queue = Mailbox<(u64, Passage)>;

impl Tap {
    /// Waits for the next passage; `None` when the node has stopped and the queue is empty.
    pub async fn next(&mut self) -> Option<Tapped> {
        if let Some(tapped) = self.try_next() {
            return Some(tapped);
        }
        let passage = poll_fn(|cx| self.queue.poll_pop(cx)).await?;
        Some(self.take(passage))
    }

    /// The next unread passage, if any.
    pub fn try_next(&mut self) -> Option<Tapped> {
        let held = self.held.take().map(Tapped::Passage);
        held.or_else(|| self.queue.pop().map(|passage| self.take(passage)))
    }

    fn take(&mut self, (number, passage): (u64, Passage)) -> Tapped {
        match number - std::mem::replace(&mut self.next, number + 1) {
            0 => Tapped::Passage(passage),
            lost => {
                self.held = Some(passage);
                Tapped::Lost(lost)
            }
        }
    }
}

/// The taps of a node.
#[derive(Debug, Default)]
pub(super) struct Taps {
    queues: Vec<Weak<Queue>>,
    /// The number of the next passage.
    next: u64,
    ended: bool,
}

impl Taps {
    /// Opens a tap that holds up to `limit` passages.
    pub(super) fn open(&mut self, limit: usize) -> Tap {
        let queue = Arc::new(Queue::new(MailboxLimits {
            messages: limit.max(1),
            octets: OCTETS,
        }));
        if self.ended {
            queue.close();
        } else {
            self.queues.push(Arc::downgrade(&queue));
        }
        Tap {
            queue,
            next: self.next,
            held: None,
        }
    }

    /// Records a received datagram.
    pub(super) fn datagram(&mut self, path: Path, octets: &Bytes) {
        self.tell(Way::In(path), || Content::Octets {
            framing: Framing::Judp,
            octets: octets.clone(),
            segment: None,
        });
    }

    /// Records a received message.
    pub(super) fn frame(&mut self, path: Path, frame: &Frame) {
        self.tell(Way::In(path), || Content::Frame(frame.clone()));
    }

    /// Records data for a link.
    pub(super) fn transmit(&mut self, framing: Framing, transmit: &Transmit) {
        self.tell(Way::Out(transmit.link, transmit.to), || Content::Octets {
            framing,
            octets: transmit.payload.clone(),
            segment: transmit.segment,
        });
    }

    /// Records a message from one component of this node to another.
    pub(super) fn message(&mut self, message: &Received) {
        if message.path.is_none() {
            self.tell(Way::Local(message.to), || {
                Content::Frame(Frame {
                    flags: Flags::new(message.priority).with_broadcast(message.broadcast),
                    ..Frame::new(message.source, message.destination, message.payload.clone())
                })
            });
        }
    }

    /// Ends all taps.
    pub(super) fn end(&mut self) {
        self.ended = true;
        for queue in self.queues.drain(..).filter_map(|queue| queue.upgrade()) {
            queue.close();
        }
    }

    /// The only branch taken without taps.
    #[inline]
    fn tell(&mut self, way: Way, content: impl FnOnce() -> Content) {
        if !self.queues.is_empty() {
            self.tell_all(way, content());
        }
    }

    #[cold]
    #[expect(
        clippy::disallowed_methods,
        reason = "formats the time of day for people"
    )]
    fn tell_all(&mut self, way: Way, content: Content) {
        let passage = Passage {
            time: SystemTime::now(),
            way,
            content,
        };
        let (octets, number) = (passage.len(), self.next);
        self.next += 1;
        self.queues.retain(|queue| {
            let queue = queue.upgrade();
            if let Some(queue) = &queue {
                // Same priority for all, so that a tap sees the passages in their order.
                queue.push(Priority::Standard, octets, (number, passage.clone()));
            }
            queue.is_some()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(number: u8) -> Received {
        let own = JausId::new(1, 1, 1);
        Received {
            source: own,
            destination: own,
            to: own,
            priority: Priority::Standard,
            broadcast: crate::wire::Broadcast::None,
            payload: vec![0, 0, number].into(),
            sequence: None,
            path: None,
            acknowledged: false,
        }
    }

    fn numbers(tap: &mut Tap) -> Vec<Result<u8, u64>> {
        std::iter::from_fn(|| tap.try_next())
            .map(|tapped| match tapped {
                Tapped::Passage(passage) => Ok(passage.frames()[0].payload[2]),
                Tapped::Lost(lost) => Err(lost),
            })
            .collect()
    }

    #[test]
    fn a_slow_tap_loses_the_oldest_and_is_told_how_many() {
        let mut taps = Taps::default();
        let (mut slow, mut fast) = (taps.open(3), taps.open(100));
        (0..10).for_each(|number| taps.message(&message(number)));
        assert_eq!(numbers(&mut slow), [Err(7), Ok(7), Ok(8), Ok(9)]);
        assert_eq!(numbers(&mut fast), (0..10).map(Ok).collect::<Vec<_>>());
        taps.message(&message(10));
        assert_eq!(numbers(&mut slow), [Ok(10)], "and is told once");
    }

    #[test]
    fn nothing_is_kept_for_a_tap_that_has_gone() {
        let mut taps = Taps::default();
        drop(taps.open(10));
        taps.message(&message(1));
        assert!(taps.queues.is_empty());
    }

    #[test]
    fn large_messages_in_a_queue_are_bounded_by_their_octets() {
        let mut taps = Taps::default();
        let mut tap = taps.open(1_000_000);
        let octets = Bytes::from(vec![0; 60_000]);
        let path = Path {
            link: LinkId(0),
            peer: std::net::SocketAddr::from(([127, 0, 0, 1], 1)).into(),
        };
        (0..1000).for_each(|_| taps.datagram(path, &octets));
        assert!(matches!(tap.try_next(), Some(Tapped::Lost(lost)) if lost > 700));
        let held = std::iter::from_fn(|| tap.try_next()).count() * octets.len();
        assert!(held <= OCTETS, "{held}");
    }

    #[test]
    fn messages_are_found_in_every_framing_and_in_trains_of_datagrams() {
        let (source, destination) = (JausId::new(1, 1, 1), JausId::new(2, 1, 1));
        let frame = Frame::new(source, destination, vec![0, 0x2B, 2].into());
        for framing in [Framing::Judp, Framing::Jtcp, Framing::Jserial] {
            let one = framing.encode(&frame).unwrap();
            let mut content = vec![(one.clone(), None, 1)];
            if framing == Framing::Judp {
                let batch = [&one[..], &one[..]].concat();
                content.push((batch.into(), Some(one.len()), 2));
            }
            for (octets, segment, count) in content {
                let passage = Passage {
                    time: SystemTime::UNIX_EPOCH,
                    way: Way::Out(LinkId(0), To::Group),
                    content: Content::Octets {
                        framing,
                        octets,
                        segment,
                    },
                };
                assert_eq!(passage.frames(), vec![frame.clone(); count], "{framing:?}");
            }
        }
    }
}
