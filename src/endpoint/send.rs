//! The send path, from a message to datagrams: local delivery, unicast to a known address, or the
//! group.

use std::time::Instant;

use tracing::trace;

use super::egress::{FragmentedSend, Hop};
use super::large::{Cut, Cutting};
use super::{Counter, Endpoint, Event, MessageHandle, Outgoing, Pacing, Path, Received, Sink, To};
use crate::address::JausId;
use crate::rights::{Admitted, Refusal};
use crate::wire::{
    Acknowledgement, Broadcast, EncodeError, Flags, Frame, Priority, Version, as5669a,
};

/// Why the endpoint cannot send a message. No part of it was sent.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SendError {
    /// The source is not attached.
    #[error("{0} is not attached here, so it cannot send")]
    UnknownSource(JausId),
    /// The destination contains a zero.
    #[error("{0} is not a valid destination: subsystem, node and component start at 1")]
    Nobody(JausId),
    /// The payload does not begin with a message code.
    #[error("a message starts with two code octets, but this one has {length} octets")]
    NoMessageCode {
        /// Octets of the payload.
        length: usize,
    },
    /// The payload exceeds the longest message.
    #[error("the message has {length} octets, but the limit for this receiver is {limit}")]
    TooLong {
        /// Octets of the payload.
        length: usize,
        /// [`Config::max_message`](super::Config::max_message), or less if 65535 fragments to this
        /// receiver cannot carry that.
        limit: usize,
    },
    /// An acknowledgement was requested from many receivers.
    #[error(
        "{0} is not a single component, and only messages to one component can be acknowledged"
    )]
    ManyAcknowledgements(JausId),
    /// The sender may not send it, as [`Endpoint::restrict`] says.
    #[error("this component may not send it: {0}")]
    NotAllowed(Refusal),
    /// A local broadcast to another subsystem.
    #[error("a local broadcast stays in the sender's subsystem and cannot go to {0}")]
    OutOfScope(JausId),
    /// Too many messages wait for acknowledgements.
    #[error("the limit of {limit} unacknowledged messages is reached")]
    TooManyUnacknowledged {
        /// [`Config::max_unacknowledged`](super::Config::max_unacknowledged).
        limit: usize,
    },
    /// Too many octets wait for acknowledgements.
    #[error("the limit of {limit} unacknowledged octets is reached")]
    TooMuchUnacknowledged {
        /// [`Config::max_unacknowledged_octets`](super::Config::max_unacknowledged_octets).
        limit: usize,
    },
    /// Messages to too many destinations wait for acknowledgements.
    #[error("the limit of {limit} destinations with unacknowledged messages is reached")]
    TooManyDestinations {
        /// [`Config::max_flows`](super::Config::max_flows).
        limit: usize,
    },
    /// Too many octets of large messages wait to be sent.
    #[error("the limit of {limit} queued octets of large messages is reached")]
    TooMuchQueued {
        /// [`Config::max_paced`](super::Config::max_paced).
        limit: usize,
    },
    /// The receiver is a component of this node whose mailbox is full, and an acknowledged message
    /// must not be dropped.
    #[error("{0} does not read fast enough: its mailbox is full")]
    ReceiverFull(JausId),
    /// Too many datagrams wait to be sent.
    #[error("the limit of {limit} queued messages of this priority is reached")]
    QueueFull {
        /// [`Config::queue_limit`](super::Config::queue_limit).
        limit: usize,
    },
    /// The destination is on another node, and there is no link.
    #[error("{0} is not attached here, and there is no link to another node")]
    NoLink(JausId),
    /// The receiver's older header cannot carry it.
    #[error("the receiver's header cannot carry the message: {0}")]
    Header(#[from] EncodeError),
}

impl Endpoint {
    /// Sends a message from a local component: to local components at once through `sink`, to other
    /// nodes through the links.
    ///
    /// A message to one component goes to its address if that is known. Otherwise it goes to the
    /// group of every link, as a global broadcast that requests an acknowledgement, because the
    /// answer teaches the address. A destination with wildcards goes to the group and to matching
    /// local components, except the sender itself.
    ///
    /// # Errors
    /// On a [`SendError`] nothing was sent. Success does not mean that the message arrives; request
    /// an acknowledgement to learn that.
    pub fn send(
        &mut self,
        now: Instant,
        message: Outgoing,
        sink: &mut dyn Sink,
    ) -> Result<MessageHandle, SendError> {
        let scope = self.check(&message)?;
        if let Admitted::Narrowed(ids) = self.admit_restricted(now, &message, sink)? {
            return self.send_to_each(now, &message, ids, sink);
        }
        let handle = self.deliveries.next_handle();
        let (destination, length) = (message.destination, message.payload.len());
        if self.components.contains(&message.destination) {
            self.send_to_sibling(handle, message, scope, sink)?;
        } else {
            self.send_away(now, handle, &message, scope)?;
            self.record_answer(&message);
            let source = message.source;
            let message = received_locally(message, scope);
            self.deliver(&message, Some(source), sink);
        }
        self.counters.add(Counter::MessagesSent);
        self.peers.note_sent(destination, length);
        Ok(handle)
    }

    /// Validates a message and returns its broadcast scope.
    fn check(&self, message: &Outgoing) -> Result<Broadcast, SendError> {
        let (source, destination, length) =
            (message.source, message.destination, message.payload.len());
        if !self.components.contains(&source) {
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
        scope: Broadcast,
        sink: &mut dyn Sink,
    ) -> Result<(), SendError> {
        let (acknowledge, by) = (message.acknowledge, message.destination);
        if acknowledge {
            self.deliveries.check_room(self.results, 0)?;
            if !sink.has_room(by, message.priority) {
                return Err(SendError::ReceiverFull(by));
            }
        }
        sink.deliver(received_locally(message, scope));
        self.counters.add(Counter::MessagesDelivered);
        if acknowledge {
            self.announce_result(Event::Acknowledged {
                message: handle,
                by,
            });
        }
        Ok(())
    }

    fn send_away(
        &mut self,
        now: Instant,
        handle: MessageHandle,
        message: &Outgoing,
        scope: Broadcast,
    ) -> Result<(), SendError> {
        let destination = message.destination;
        let is_to_one = scope == Broadcast::None;
        if is_to_one && self.egress.links.is_empty() {
            return Err(SendError::NoLink(destination));
        }
        let route = self.route(destination);
        let version = route.map_or(Version::As5669a, |(_, version)| version);
        let length = message.payload.len();
        let cutting = self.cutting(destination, version);
        let limit = self.config.max_message.min(cutting.longest());
        if length > limit {
            return Err(SendError::TooLong { length, limit });
        }
        let cut = cutting.cut(length);
        let mut frame = Frame {
            version: if is_to_one { version } else { Version::As5669a },
            flags: Flags::new(message.priority).with_broadcast(scope),
            ..Frame::new(message.source, destination, message.payload.clone())
        };
        // A large message to an unknown address is broadcast only until its first packet is
        // acknowledged. The rest goes only to that address.
        let seeks = is_to_one && self.seeks_proof(destination, length);
        if message.acknowledge || cut.count() > 1 && seeks {
            return self.deliver_reliably(now, handle, frame, message.acknowledge);
        }
        let path = route.filter(|_| is_to_one).map(|(path, _)| path);
        let first = self.numbers.take(cut.count());
        frame.sequence = first as u16;
        if cut.count() > 1 {
            return self.send_fragmented(now, path, &frame, cut, first);
        }
        let Some(path) = path else {
            if is_to_one {
                self.calls.insert(now, &frame);
            }
            return self.send_to_all(now, frame);
        };
        self.check_egress(message.priority, 1)?;
        self.send_along(now, path, &frame)?;
        Ok(())
    }

    /// Whether the destination's address is unknown; or unverified, although the message is too
    /// long to send without a proof, or its cutting depends on what the peer is.
    fn seeks_proof(&self, destination: JausId, length: usize) -> bool {
        let much = length > self.config.unverified_address.burst as usize / 2;
        self.route(destination).is_none_or(|(path, _)| {
            let needs_proof = much || self.peers.repeats_code(destination).is_none();
            needs_proof && !self.is_free(path)
        })
    }

    /// Queues a large message without acknowledgement request. The frame holds the whole message,
    /// without data control, and leaves in fragments.
    fn send_fragmented(
        &mut self,
        now: Instant,
        path: Option<Path>,
        whole: &Frame,
        cut: Cut,
        first: u64,
    ) -> Result<(), SendError> {
        let hops = match path {
            Some(path) => vec![path.into()],
            None => self.hops_to_all(whole.destination),
        };
        let length = whole.payload.len();
        if !self.egress.has_room_for_fragments(hops.len() * length) {
            self.counters.add(Counter::TransmitQueueFull);
            let limit = self.config.max_paced;
            return Err(SendError::TooMuchQueued { limit });
        }
        let octets = length + cut.count() * (1 + as5669a::MIN_LEN);
        if path.is_some_and(|path| !self.may_send(now, whole.destination, path, octets)) {
            return Ok(());
        }
        let pacing = self.pacing(whole.destination);
        for hop in hops {
            let message = FragmentedSend {
                whole: whole.clone(),
                cut,
                first,
                next: 0,
                pacing,
            };
            if let Err(reason) = self.egress.push_fragmented(now, hop, message) {
                self.counters.add(reason);
            }
        }
        Ok(())
    }

    /// Checks that `count` more datagrams fit the queue.
    fn check_egress(&mut self, priority: Priority, count: usize) -> Result<(), SendError> {
        if self.egress.has_room(priority, count) {
            return Ok(());
        }
        self.counters.add(Counter::TransmitQueueFull);
        let limit = self.config.queue_limit;
        Err(SendError::QueueFull { limit })
    }

    /// Sends a frame along a path, with its own header. Returns false if the address has no budget
    /// left or the queue is full. Frames not sent are counted.
    pub(super) fn send_along(
        &mut self,
        now: Instant,
        path: Path,
        frame: &Frame,
    ) -> Result<bool, EncodeError> {
        let octets = self.egress.encode(path.link, frame)?;
        if !self.may_send(now, frame.destination, path, octets.len()) {
            return Ok(false);
        }
        let queued = self.egress.push(now, path.into(), frame.flags, octets);
        Ok(queued.map_err(|reason| self.counters.add(reason)).is_ok())
    }

    /// Sends a local component's frame to every link's group. A frame for one component requests an
    /// acknowledgement, which teaches its address.
    pub(super) fn send_to_all(&mut self, now: Instant, mut frame: Frame) -> Result<(), SendError> {
        let hops = self.hops_to_all(frame.destination);
        self.check_egress(frame.flags.priority(), hops.len())?;
        self.egress.echoes.insert_own(now, &frame);
        frame.version = Version::As5669a;
        if frame.flags.broadcast() == Some(Broadcast::None) {
            trace!(destination = %frame.destination, "address unknown");
            frame.flags = frame
                .flags
                .with_broadcast(Broadcast::Global)
                .with_acknowledgement(Acknowledgement::Request);
        }
        self.egress
            .push_to_many(now, &hops, &frame, &mut self.counters)?;
        Ok(())
    }

    /// How to cut messages to `destination`.
    pub(super) fn cutting(&self, destination: JausId, version: Version) -> Cutting {
        let profile = self.peers.profile(destination);
        let (longest, limit) = (profile.payload_limit(), self.config.payload_limit);
        let presumed = self.peers.presumed(destination);
        Cutting {
            limit: longest.map_or(limit, |longest| longest.min(limit)),
            repeat_code: version.repeated_code_len() > 0
                || self.peers.repeats_code(destination) == Some(true),
            kept: presumed.fragments_kept().zip(presumed.payload_limit()),
        }
    }

    /// The rate for fragments of a large message to `destination`.
    fn pacing(&self, destination: JausId) -> Option<Pacing> {
        let usual = self.config.pacing?;
        let intake = self.peers.presumed(destination).intake();
        Some(intake.map_or(usual, |intake| usual.within(intake)))
    }

    /// The path and header for `destination`, if its address is known and the link exists.
    pub(super) fn route(&self, destination: JausId) -> Option<(Path, Version)> {
        self.peers
            .route(destination)
            .filter(|(path, _)| self.egress.links.contains_key(&path.link))
    }

    /// The group of every link, and the static peers that multicast does not reach.
    fn hops_to_all(&self, destination: JausId) -> Vec<Hop> {
        let groups = self.egress.links.keys().map(|&link| (link, To::Group));
        let copies = self.peers.broadcast_copies(destination);
        groups.chain(copies.into_iter().map(Hop::from)).collect()
    }
}

fn received_locally(message: Outgoing, broadcast: Broadcast) -> Received {
    Received {
        source: message.source,
        destination: message.destination,
        priority: message.priority,
        broadcast,
        sequence: None,
        payload: message.payload,
        path: None,
        to: message.destination,
        acknowledged: message.acknowledge,
    }
}
