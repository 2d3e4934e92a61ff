//! From a message to datagrams: local delivery, unicast to a known address, or the group.

use std::time::Instant;

use bytes::Bytes;
use tracing::trace;

use super::{Counter, Endpoint, Event, MessageHandle, Outgoing, Path, Received, To, Transmit};
use crate::address::JausId;
use crate::wire::{Acknowledgement, Broadcast, EncodeError, Flags, Frame, judp};

/// Why a message cannot be sent. Nothing of it was.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SendError {
    /// The source is not attached.
    #[error("{0} is not attached here, so it cannot send")]
    UnknownSource(JausId),
    /// The destination holds a zero.
    #[error("{0} names nobody: a subsystem, node or component of 0 does not exist")]
    Nobody(JausId),
    /// The payload does not begin with a message code.
    #[error("a message begins with two code octets, this one has {length} octets")]
    NoMessageCode {
        /// Octets of the payload.
        length: usize,
    },
    /// The payload is longer than one packet may be.
    #[error("the message has {length} octets, and the limit of one packet is {limit}")]
    TooLong {
        /// Octets of the payload.
        length: usize,
        /// [`Config::payload_limit`](super::Config::payload_limit).
        limit: usize,
    },
    /// Many receivers, and an acknowledgement from each.
    #[error(
        "a message to {0} goes to many, and only a message to one component can be acknowledged"
    )]
    ManyAcknowledgements(JausId),
    /// A local broadcast to another subsystem.
    #[error("a local broadcast stays in the sender's subsystem and cannot go to {0}")]
    OutOfScope(JausId),
    /// Too many messages wait for acknowledgements.
    #[error("{limit} messages wait for acknowledgements already")]
    TooManyUnacknowledged {
        /// [`Config::max_unacknowledged`](super::Config::max_unacknowledged).
        limit: usize,
    },
    /// Too many datagrams or messages wait to be sent or delivered.
    #[error("{limit} messages of this priority wait already")]
    QueueFull {
        /// [`Config::queue_limit`](super::Config::queue_limit).
        limit: usize,
    },
    /// The destination is elsewhere, and there is no link.
    #[error("{0} is not here, and there is no link to another node")]
    NoLink(JausId),
    /// The receiver's older header cannot carry it.
    #[error("the receiver's header cannot carry the message: {0}")]
    Header(#[from] EncodeError),
}

impl Endpoint {
    /// Sends a message from a local component: to siblings at once, to others through the links.
    ///
    /// A message to one component goes to its address if that is known; else to the group of every link, as a global
    /// broadcast that wants an acknowledgement, because the answer teaches the address. A destination with wildcards
    /// goes to the group, and to matching siblings (not to the sender itself).
    ///
    /// # Errors
    /// A [`SendError`] tells what is wrong; then nothing was sent. That a message was sent does not mean that it
    /// arrives; ask for an acknowledgement to be told.
    pub fn send(&mut self, now: Instant, message: Outgoing) -> Result<MessageHandle, SendError> {
        let scope = self.check(&message)?;
        let handle = self.acknowledgements.next_handle();
        if self.components.contains(message.destination) {
            self.send_to_sibling(handle, message)?;
        } else {
            self.send_to_siblings(&message, scope);
            self.send_away(now, handle, message, scope)?;
        }
        self.counters.add(Counter::MessagesSent);
        Ok(handle)
    }

    /// Checks a message, and gives the broadcast scope that it is sent with.
    fn check(&self, message: &Outgoing) -> Result<Broadcast, SendError> {
        let (source, destination, length) =
            (message.source, message.destination, message.payload.len());
        if !self.components.contains(source) {
            return Err(SendError::UnknownSource(source));
        }
        if destination.has_zero() {
            return Err(SendError::Nobody(destination));
        }
        if length < 2 {
            return Err(SendError::NoMessageCode { length });
        }
        if message.acknowledge && destination.has_wildcard() {
            return Err(SendError::ManyAcknowledgements(destination));
        }
        let elsewhere =
            ![source.subsystem(), JausId::ANY_SUBSYSTEM].contains(&destination.subsystem());
        if message.broadcast == Broadcast::Local && elsewhere {
            return Err(SendError::OutOfScope(destination));
        }
        Ok(match message.broadcast {
            Broadcast::None if destination.has_wildcard() => Broadcast::Global,
            scope => scope,
        })
    }

    fn send_to_sibling(
        &mut self,
        handle: MessageHandle,
        message: Outgoing,
    ) -> Result<(), SendError> {
        let (acknowledge, scope, by) =
            (message.acknowledge, message.broadcast, message.destination);
        let limit = self.config.queue_limit;
        let received = received_locally(message, scope, by);
        self.messages
            .push(received.priority, received)
            .map_err(|_| {
                self.counters.add(Counter::DeliveryQueueFull);
                SendError::QueueFull { limit }
            })?;
        self.counters.add(Counter::MessagesDelivered);
        if acknowledge {
            self.announce(Event::Acknowledged {
                message: handle,
                by,
            });
        }
        Ok(())
    }

    fn send_to_siblings(&mut self, message: &Outgoing, scope: Broadcast) {
        for to in self.components.matching(message.destination) {
            let in_scope =
                scope != Broadcast::Local || to.subsystem() == message.source.subsystem();
            if to != message.source && in_scope {
                self.enqueue(received_locally(message.clone(), scope, to));
            }
        }
    }

    fn send_away(
        &mut self,
        now: Instant,
        handle: MessageHandle,
        message: Outgoing,
        scope: Broadcast,
    ) -> Result<(), SendError> {
        let (length, limit) = (message.payload.len(), self.config.payload_limit);
        if length > limit {
            return Err(SendError::TooLong { length, limit });
        }
        if message.acknowledge && self.acknowledgements.is_full() {
            return Err(SendError::TooManyUnacknowledged {
                limit: self.config.max_unacknowledged,
            });
        }
        let acknowledgement = if message.acknowledge {
            Acknowledgement::Request
        } else {
            Acknowledgement::None
        };
        let frame = Frame {
            flags: Flags::new(message.priority)
                .with_broadcast(scope)
                .with_acknowledgement(acknowledgement),
            sequence: self.next_sequence(),
            ..Frame::new(message.source, message.destination, message.payload)
        };
        self.route(now, &frame)?;
        if message.acknowledge {
            self.acknowledgements.expect(now, handle, frame);
        }
        Ok(())
    }

    /// Queues a frame for where its destination is now.
    pub(super) fn route(&mut self, now: Instant, frame: &Frame) -> Result<(), SendError> {
        let destination = frame.destination;
        if destination.has_wildcard() || frame.flags.broadcast() != Some(Broadcast::None) {
            return self.send_to_group(now, frame);
        }
        if self.links.is_empty() {
            return Err(SendError::NoLink(destination));
        }
        let Some((path, version)) = self.peers.route(destination) else {
            trace!(%destination, "address unknown");
            let flags = frame
                .flags
                .with_broadcast(Broadcast::Global)
                .with_acknowledgement(Acknowledgement::Request);
            return self.send_to_group(
                now,
                &Frame {
                    flags,
                    ..frame.clone()
                },
            );
        };
        let payload = judp::encode(&Frame {
            version,
            ..frame.clone()
        })?;
        self.transmit(frame.flags.priority(), to_path(path, payload))
    }

    /// Queues a frame for the group of every link and for the static peers that multicast does not reach.
    fn send_to_group(&mut self, now: Instant, frame: &Frame) -> Result<(), SendError> {
        let payload = judp::encode(frame)?;
        let groups = self.links.keys().map(|&link| Transmit {
            link,
            to: To::Group,
            payload: payload.clone(),
        });
        let copies = self.peers.broadcast_copies(frame.destination);
        let copies = copies
            .into_iter()
            .map(|path| to_path(path, payload.clone()));
        let transmits: Vec<_> = groups.chain(copies).collect();
        self.sent_to_group
            .insert(now, self.sent_to_group.fingerprint(frame));
        let mut result = Ok(());
        for transmit in transmits {
            result = result.and(self.transmit(frame.flags.priority(), transmit));
        }
        result
    }
}

fn to_path(path: Path, payload: Bytes) -> Transmit {
    Transmit {
        link: path.link,
        to: To::Peer(path.peer),
        payload,
    }
}

fn received_locally(message: Outgoing, broadcast: Broadcast, to: JausId) -> Received {
    Received {
        source: message.source,
        destination: message.destination,
        priority: message.priority,
        broadcast,
        payload: message.payload,
        path: None,
        to,
    }
}
