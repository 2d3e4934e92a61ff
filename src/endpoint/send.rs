//! From a message to datagrams: local delivery, unicast to a known address, or the group.

use std::time::Instant;

use tracing::{debug, trace};

use super::large::{Cut, Cutting};
use super::pacing::{Pacing, Stretch};
use super::{
    Counter, Endpoint, Event, LinkId, MessageHandle, Outgoing, Path, Received, To, Transmit,
};
use crate::address::JausId;
use crate::wire::{
    Acknowledgement, Broadcast, EncodeError, Flags, Frame, Framing, Priority, Version,
};

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
    /// The payload is longer than a message may be.
    #[error("the message has {length} octets, and at most {limit} can be sent to this receiver")]
    TooLong {
        /// Octets of the payload.
        length: usize,
        /// [`Config::max_message`](super::Config::max_message); to a receiver with an older header
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
    /// Too much waits for acknowledgements.
    #[error("messages of {limit} octets wait for acknowledgements already")]
    TooMuchUnacknowledged {
        /// [`Config::max_unacknowledged_octets`](super::Config::max_unacknowledged_octets).
        limit: usize,
    },
    /// Messages to too many destinations wait for acknowledgements.
    #[error("messages to {limit} destinations wait for acknowledgements already")]
    TooManyDestinations {
        /// [`Config::max_flows`](super::Config::max_flows).
        limit: usize,
    },
    /// Too much of large messages waits to be sent.
    #[error("large messages of {limit} octets wait to be sent already")]
    TooMuchQueued {
        /// [`Config::max_paced`](super::Config::max_paced).
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
    /// A message to one component goes to its address if that is known; else to the group of every
    /// link, as a global broadcast that wants an acknowledgement, because the answer teaches the
    /// address. A destination with wildcards goes to the group, and to matching siblings (not to
    /// the sender itself).
    ///
    /// # Errors
    /// A [`SendError`] tells what is wrong; then nothing was sent. That a message was sent does not
    /// mean that it arrives; ask for an acknowledgement to be told.
    pub fn send(&mut self, now: Instant, message: Outgoing) -> Result<MessageHandle, SendError> {
        let scope = self.check(&message)?;
        self.latest = Some(now);
        let handle = self.deliveries.next_handle();
        let (destination, length) = (message.destination, message.payload.len());
        if self.components.contains(message.destination) {
            self.send_to_sibling(handle, message)?;
        } else {
            let siblings = self.siblings(&message, scope);
            if !self.messages.has_room(message.priority, siblings.len()) {
                self.counters.add(Counter::DeliveryQueueFull);
                let limit = self.config.queue_limit;
                return Err(SendError::QueueFull { limit });
            }
            self.send_away(now, handle, &message, scope)?;
            for to in siblings {
                self.enqueue(received_locally(message.clone(), scope, to));
            }
        }
        self.counters.add(Counter::MessagesSent);
        self.peers.note_sent(destination, length);
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
        if acknowledge {
            self.deliveries.check_room(self.untold, 0)?;
        }
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
            self.tell_result(Event::Acknowledged {
                message: handle,
                by,
            });
        }
        Ok(())
    }

    /// The components of this node that get a message for many, but for its sender.
    fn siblings(&self, message: &Outgoing, scope: Broadcast) -> Vec<JausId> {
        let source = message.source;
        let mut siblings = self.components.matching(message.destination);
        siblings.retain(|to| {
            let in_scope = scope != Broadcast::Local || to.subsystem() == source.subsystem();
            *to != source && in_scope
        });
        siblings
    }

    fn send_away(
        &mut self,
        now: Instant,
        handle: MessageHandle,
        message: &Outgoing,
        scope: Broadcast,
    ) -> Result<(), SendError> {
        let (destination, limit) = (message.destination, self.config.queue_limit);
        if self.links.is_empty() && scope == Broadcast::None {
            return Err(SendError::NoLink(destination));
        }
        let route = self.route(destination);
        let version = route.map_or(Version::As5669a, |(_, version)| version);
        let length = message.payload.len();
        self.check_length(length, destination, version)?;
        let cut = self.cutting(destination, version).cut(length);
        // What is large goes to everybody only until the address is known, and nowhere else than to
        // whoever acknowledges the beginning.
        let seeks = scope == Broadcast::None && self.seeks_proof(destination, length);
        if message.acknowledge || cut.count() > 1 && seeks {
            return self.deliver_reliably(now, handle, message, scope);
        }
        let first = self.numbers.take(cut.count());
        if cut.count() > 1 {
            return self.pace(now, message, scope, cut, first);
        }
        let frame = Frame {
            flags: Flags::new(message.priority).with_broadcast(scope),
            sequence: first as u16,
            ..Frame::new(message.source, message.destination, message.payload.clone())
        };
        let transmits = self.transmits_of(&frame)?;
        if scope == Broadcast::None {
            match route {
                None => self.calls.insert(now, &frame),
                Some((path, _)) => {
                    let octets = transmits.iter().map(|it| it.payload.len()).sum();
                    if !self.may_send(now, destination, path, octets) {
                        return Ok(());
                    }
                }
            }
        }
        if !self.transmits.has_room(message.priority, transmits.len()) {
            self.counters.add(Counter::TransmitQueueFull);
            return Err(SendError::QueueFull { limit });
        }
        for transmit in self.remember_echo(now, &frame, transmits) {
            self.transmit(transmit);
        }
        Ok(())
    }

    /// Whether the address of a destination is unknown, or not proven and the message too long to
    /// go there unasked.
    fn seeks_proof(&self, destination: JausId, length: usize) -> bool {
        let much = length > self.config.unverified_address.burst as usize / 2;
        self.route(destination).is_none_or(|(path, _)| {
            let needs_proof = much || self.peers.awaits_proof(destination);
            needs_proof && !self.is_free(path)
        })
    }

    /// Takes in a large message that wants no acknowledgement.
    fn pace(
        &mut self,
        now: Instant,
        message: &Outgoing,
        scope: Broadcast,
        cut: Cut,
        first: u64,
    ) -> Result<(), SendError> {
        let flags = Flags::new(message.priority).with_broadcast(scope);
        let (flags, ways) = self.ways(message.destination, flags);
        if !self.pacer.has_room(ways.len() * message.payload.len()) {
            self.counters.add(Counter::TransmitQueueFull);
            let limit = self.config.max_paced;
            return Err(SendError::TooMuchQueued { limit });
        }
        for Way { link, to, version } in ways {
            let stretch = Stretch {
                source: message.source,
                destination: message.destination,
                version,
                flags,
                payload: message.payload.clone(),
                cut,
                first,
                pacing: self.pacing(message.destination),
            };
            self.pacer.push(now, (link, to), stretch);
        }
        Ok(())
    }

    /// The next fragment of a large message that wants no acknowledgement, if one of this priority
    /// may be sent.
    pub(super) fn next_paced(&mut self, priority: Priority) -> Option<Transmit> {
        let now = self.latest?;
        loop {
            let ((link, to), frame) = self.pacer.take(now, priority)?;
            let way = Way {
                link,
                to,
                version: frame.version,
            };
            match self.transmit_of(&way, &frame) {
                Ok(transmit) if !self.may_leave(now, &frame, &transmit) => {}
                Ok(transmit) => return self.remember_echo(now, &frame, vec![transmit]).pop(),
                Err(error) => debug!(destination = %frame.destination, %error, "cannot be sent"),
            }
        }
    }

    /// Whether a datagram may go to an address, or goes to the group.
    fn may_leave(&mut self, now: Instant, frame: &Frame, transmit: &Transmit) -> bool {
        let (link, octets) = (transmit.link, transmit.payload.len());
        match transmit.to {
            To::Peer(peer) => self.may_send(now, frame.destination, Path { link, peer }, octets),
            To::Group => true,
        }
    }

    /// How messages to `destination` are cut.
    pub(super) fn cutting(&self, destination: JausId, version: Version) -> Cutting {
        let profile = self.peers.profile(destination);
        let (longest, limit) = (profile.payload_limit(), self.config.payload_limit);
        let presumed = self.peers.presumed(destination);
        Cutting {
            limit: longest.map_or(limit, |longest| longest.min(limit)),
            repeat_code: version != Version::As5669a || self.peers.wants_repeated_code(destination),
            kept: presumed.fragments_kept().zip(presumed.payload_limit()),
        }
    }

    /// How fast the fragments of a large message may leave for `destination`.
    fn pacing(&self, destination: JausId) -> Option<Pacing> {
        let usual = self.config.pacing?;
        let intake = self.peers.presumed(destination).intake();
        Some(intake.map_or(usual, |intake| usual.within(intake)))
    }

    fn check_length(
        &self,
        length: usize,
        destination: JausId,
        version: Version,
    ) -> Result<(), SendError> {
        let longest = self.cutting(destination, version).longest();
        let limit = self.config.max_message.min(longest);
        if length > limit {
            return Err(SendError::TooLong { length, limit });
        }
        Ok(())
    }

    /// Where and with which header to reach `destination`, if that is known and there is a link.
    pub(super) fn route(&self, destination: JausId) -> Option<(Path, Version)> {
        self.peers
            .route(destination)
            .filter(|(path, _)| self.links.contains_key(&path.link))
    }

    /// Remembers what goes to the group, which may come back.
    pub(super) fn remember_echo(
        &mut self,
        now: Instant,
        frame: &Frame,
        transmits: Vec<Transmit>,
    ) -> Vec<Transmit> {
        if transmits.iter().any(|transmit| transmit.to == To::Group) {
            self.sent_to_group
                .insert(now, self.sent_to_group.fingerprint(frame));
        }
        transmits
    }

    /// The datagrams that carry a frame to where its destination is.
    pub(super) fn transmits_of(&self, frame: &Frame) -> Result<Vec<Transmit>, SendError> {
        let (flags, ways) = self.ways(frame.destination, frame.flags);
        let frame = Frame {
            flags,
            ..frame.clone()
        };
        ways.iter()
            .map(|way| Ok(self.transmit_of(way, &frame)?))
            .collect()
    }

    /// The datagram that carries a frame, with its own header, along a path.
    pub(super) fn transmit_along(
        &self,
        path: Path,
        frame: &Frame,
    ) -> Result<Transmit, EncodeError> {
        Ok(Transmit {
            link: path.link,
            to: To::Peer(path.peer),
            priority: frame.flags.priority(),
            payload: self.framing(path.link).encode(frame)?,
            segment: None,
        })
    }

    fn transmit_of(&self, way: &Way, frame: &Frame) -> Result<Transmit, EncodeError> {
        let frame = Frame {
            version: way.version,
            ..frame.clone()
        };
        Ok(Transmit {
            link: way.link,
            to: way.to,
            priority: frame.flags.priority(),
            payload: self.framing(way.link).encode(&frame)?,
            segment: None,
        })
    }

    /// The ways to where a destination is. If its address is unknown: to everybody, with flags that
    /// ask it for an answer.
    fn ways(&self, destination: JausId, flags: Flags) -> (Flags, Vec<Way>) {
        if destination.has_wildcard() || flags.broadcast() != Some(Broadcast::None) {
            return (flags, self.ways_to_group(destination));
        }
        if let Some((path, version)) = self.route(destination) {
            return (flags, vec![Way::along(path, version)]);
        }
        trace!(%destination, "address unknown");
        let flags = flags
            .with_broadcast(Broadcast::Global)
            .with_acknowledgement(Acknowledgement::Request);
        (flags, self.ways_to_group(destination))
    }

    /// The group of every link, and the static peers that multicast does not reach.
    fn ways_to_group(&self, destination: JausId) -> Vec<Way> {
        let group = |&link: &LinkId| Way {
            link,
            to: To::Group,
            version: Version::As5669a,
        };
        let copies = self.peers.broadcast_copies(destination).into_iter();
        let copies = copies.map(|path| Way::along(path, Version::As5669a));
        self.links.keys().map(group).chain(copies).collect()
    }

    /// How a link frames messages.
    pub(super) fn framing(&self, link: LinkId) -> Framing {
        self.links
            .get(&link)
            .map_or(Framing::default(), |profile| profile.framing)
    }
}

/// Whereto, and with which header.
#[derive(Clone, Copy, Debug)]
struct Way {
    link: LinkId,
    to: To,
    version: Version,
}

impl Way {
    const fn along(path: Path, version: Version) -> Self {
        Self {
            link: path.link,
            to: To::Peer(path.peer),
            version,
        }
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
