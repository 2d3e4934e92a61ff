//! From a datagram to deliveries: each message is judged, learned from, acknowledged, filtered and
//! handed out.

use std::time::Instant;

use bytes::Bytes;
use tracing::{debug, trace};

use super::peers::Learned;
use super::{Counter, Endpoint, Event, Path, Peer, Received};
use crate::address::JausId;
use crate::wire::{Acknowledgement, Broadcast, DataControl, Frame, Version, judp};

impl Endpoint {
    /// Takes a datagram that came from `from`.
    ///
    /// Nothing in it is an error: what cannot be used is counted and traced. Messages, answers and
    /// news come out of [`poll_event`](Self::poll_event) and
    /// [`poll_transmit`](Self::poll_transmit).
    pub fn handle_datagram(&mut self, now: Instant, from: Path, data: Bytes) {
        self.latest = Some(now);
        self.counters.add(Counter::DatagramsReceived);
        if !self.links.contains_key(&from.link) {
            return self.counters.add(Counter::UnknownLink);
        }
        let mut frames = match judp::frames(data) {
            Ok(frames) => frames,
            Err(error) => {
                debug!(?from, %error, "not JAUS");
                return self.counters.add(Counter::NotJaus);
            }
        };
        for frame in &mut frames {
            match frame {
                Ok(frame) => self.handle_frame(now, from, &frame),
                Err(error) => {
                    debug!(?from, %error, "malformed");
                    return self.counters.add(Counter::Malformed);
                }
            }
        }
        if frames.remaining() > 0 {
            trace!(?from, octets = frames.remaining(), "stale octets");
            self.counters
                .add_many(Counter::StaleOctets, frames.remaining() as u64);
        }
    }

    /// Takes a frame that came from `from`, from a link that reads frames itself. Nothing in it is
    /// an error, as with [`handle_datagram`](Self::handle_datagram).
    pub fn handle_frame(&mut self, now: Instant, from: Path, frame: &Frame) {
        self.latest = Some(now);
        self.counters.add(Counter::MessagesReceived);
        if !self.links.contains_key(&from.link) {
            return self.counters.add(Counter::UnknownLink);
        }
        let (source, destination) = (frame.source, frame.destination);
        if let Err(reason) = self.accept(now, from, frame) {
            trace!(%source, %destination, peer = %from.peer, %reason);
            self.counters.add(reason);
        }
    }

    /// Does all that a message causes, or tells why it is dropped.
    fn accept(&mut self, now: Instant, from: Path, frame: &Frame) -> Result<(), Counter> {
        let broadcast = check_header(frame)?;
        if self.is_own_echo(now, from, frame) {
            return Err(Counter::OwnEcho);
        }
        if self.components.contains(frame.source) {
            self.announce_conflict(now, from, frame.source);
            return Err(Counter::IdConflict);
        }
        let receivers = self.receivers(frame, broadcast)?;
        match frame.flags.acknowledgement() {
            Acknowledgement::Positive | Acknowledgement::Negative => {
                self.learn(now, from, frame);
                return self.receive_answer(now, frame);
            }
            Acknowledgement::Request => self.acknowledge(from, frame),
            Acknowledgement::None => {}
        }
        // Before learning: a copy that came another way must not move the peer there and back.
        self.filter_duplicate(now, frame)?;
        self.learn(now, from, frame);
        let payload = match frame.flags.data() {
            DataControl::Single => frame.payload.clone(),
            _ => {
                let style = self.large_styles.of(frame.source);
                let whole = self
                    .reassembly
                    .insert(now, frame, style, &mut self.counters)?;
                let Some(whole) = whole else { return Ok(()) };
                self.large_styles.learn(frame.source, whole.style);
                whole.payload
            }
        };
        self.deliver(from, frame, broadcast, &payload, &receivers);
        Ok(())
    }

    /// The local components that a message is for, or why there are none.
    fn receivers(&self, frame: &Frame, broadcast: Broadcast) -> Result<Vec<JausId>, Counter> {
        let mut receivers = self.components.matching(frame.destination);
        if receivers.is_empty() {
            return Err(Counter::NotForUs);
        }
        if broadcast == Broadcast::Local {
            receivers.retain(|receiver| receiver.subsystem() == frame.source.subsystem());
        }
        if receivers.is_empty() {
            Err(Counter::OutOfScope)
        } else {
            Ok(receivers)
        }
    }

    /// Whether this is our own multicast come back. A component that has gone meanwhile is known by
    /// what it sent.
    fn is_own_echo(&self, now: Instant, from: Path, frame: &Frame) -> bool {
        let mut own_addresses = self.links.values().flat_map(|link| &link.own).peekable();
        let may_be_own =
            own_addresses.peek().is_none() || own_addresses.any(|&own| from.peer == own);
        let window = self.config.echo_window;
        may_be_own
            && self
                .sent_to_group
                .contains(now, &self.sent_to_group.fingerprint(frame), window)
    }

    /// Tells that somebody else has taken an id of ours, not for each of its messages.
    fn announce_conflict(&mut self, now: Instant, from: Path, id: JausId) {
        let announced = self.conflicts.get(&id);
        if announced
            .is_none_or(|&at| now.saturating_duration_since(at) >= self.config.conflict_interval)
        {
            self.conflicts.insert(id, now);
            debug!(%id, ?from, "id conflict");
            self.announce(Event::IdConflict { id, path: from });
        }
    }

    fn learn(&mut self, now: Instant, from: Path, frame: &Frame) {
        let (id, version) = (frame.source, frame.version);
        match self.peers.learn(Peer {
            id,
            path: from,
            version,
            last_heard: now,
        }) {
            Learned::Known => {}
            Learned::New { evicted } => {
                if let Some(id) = evicted {
                    self.counters.add(Counter::PeersEvicted);
                    self.announce(Event::PeerForgotten { id });
                }
                debug!(%id, ?from, %version, "peer learned");
                self.announce(Event::PeerLearned {
                    id,
                    path: from,
                    version,
                });
            }
            Learned::Moved { from: before } => {
                debug!(%id, ?before, ?from, "peer moved");
                self.announce(Event::PeerMoved {
                    id,
                    from: before,
                    to: from,
                });
            }
        }
    }

    /// Drops what was received before.
    ///
    /// The older headers' peers leave the sequence number at 0, so there only a message that wants
    /// an acknowledgement, and hence may be repeated, can be told.
    fn filter_duplicate(&mut self, now: Instant, frame: &Frame) -> Result<(), Counter> {
        let repeats = frame.flags.acknowledgement() == Acknowledgement::Request;
        if !repeats && frame.version != Version::As5669a {
            return Ok(());
        }
        let window = match frame.flags.broadcast() {
            _ if !repeats => self.config.duplicate_window,
            Some(Broadcast::None) => self.config.retransmission_window,
            _ => self.config.first_contact_window,
        };
        let fingerprint = self.heard.fingerprint(frame);
        let known = self.heard.contains(now, &fingerprint, window);
        if repeats || !known {
            self.heard.insert(now, fingerprint);
        }
        if known {
            Err(Counter::Duplicate)
        } else {
            Ok(())
        }
    }

    /// Queues a whole message for its receivers.
    fn deliver(
        &mut self,
        from: Path,
        frame: &Frame,
        broadcast: Broadcast,
        payload: &Bytes,
        receivers: &[JausId],
    ) {
        for &to in receivers {
            self.enqueue(Received {
                source: frame.source,
                destination: frame.destination,
                priority: frame.flags.priority(),
                broadcast,
                payload: payload.clone(),
                path: Some(from),
                to,
            });
        }
    }

    /// Queues a message for one component; a full queue is counted.
    pub(super) fn enqueue(&mut self, received: Received) {
        let outcome = match self.messages.push(received.priority, received) {
            Ok(()) => Counter::MessagesDelivered,
            Err(_) => Counter::DeliveryQueueFull,
        };
        self.counters.add(outcome);
    }
}

/// Checks what does not depend on who we are; gives the broadcast scope.
fn check_header(frame: &Frame) -> Result<Broadcast, Counter> {
    if frame.kind.message_type() != 0 {
        return Err(Counter::ReservedType);
    }
    if frame.kind.is_compressed() {
        return Err(Counter::CompressedHeader);
    }
    if !frame.source.is_unicast() {
        return Err(Counter::InvalidSource);
    }
    let broadcast = frame.flags.broadcast().ok_or(Counter::ReservedBroadcast)?;
    if frame.flags.acknowledgement().is_answer() {
        let sound = frame.is_acknowledgement();
        return if sound {
            Ok(broadcast)
        } else {
            Err(Counter::AcknowledgementWithPayload)
        };
    }
    match (frame.flags.data(), frame.code()) {
        (DataControl::Single | DataControl::First, None) => Err(Counter::NoMessageCode),
        _ => Ok(broadcast),
    }
}
