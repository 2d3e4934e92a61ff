//! From a datagram to deliveries: each message is judged, learned from, acknowledged, filtered and
//! handed out.

use std::time::{Duration, Instant};

use bytes::Bytes;
use tracing::{debug, trace};

use super::peers::Learned;
use super::recent::{Class, Fingerprint};
use super::{Counter, Endpoint, Event, Path, Received};
use crate::address::JausId;
use crate::peer;
use crate::wire::{
    Acknowledgement, Broadcast, DataControl, Flags, Frame, Framing, Version, as5669a, judp,
};

/// Octets of IPv4 and UDP around a datagram.
const DATAGRAM_OVERHEAD: usize = 28;
/// The same message again within this time is a copy made on the way: nobody repeats so fast.
const REPEAT_INTERVAL: Duration = Duration::from_millis(1);

/// How a message stands to what was heard lately.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Novelty {
    /// Not heard lately.
    New,
    /// Its sender has sent it again.
    Repeated,
    /// The network has made a copy, or brought it in a circle.
    Copy,
}

impl Endpoint {
    /// Takes a datagram that came from `from`.
    ///
    /// Nothing in it is an error: what cannot be used is counted and traced. Messages, answers and
    /// news come out of [`poll_event`](Self::poll_event) and
    /// [`poll_transmit`](Self::poll_transmit).
    pub fn handle_datagram(&mut self, now: Instant, from: Path, data: Bytes) {
        self.receive_datagram(now, from, data, false);
    }

    /// The same for a datagram that went to everybody: to the link's group, or to what it has
    /// instead.
    pub fn handle_datagram_to_all(&mut self, now: Instant, from: Path, data: Bytes) {
        self.receive_datagram(now, from, data, true);
    }

    fn receive_datagram(&mut self, now: Instant, from: Path, data: Bytes, to_all: bool) {
        self.to_all = to_all;
        self.latest = Some(now);
        self.counters.add(Counter::DatagramsReceived);
        if let Err(reason) = self.check_path(from) {
            return self.counters.add(reason);
        }
        self.credit = data.len() + DATAGRAM_OVERHEAD;
        self.held_by_payload = data.len();
        let mut frames = match judp::frames(data) {
            Ok(frames) => frames,
            Err(error) => {
                debug!(?from, %error, "not JAUS");
                return self.counters.add(Counter::NotJaus);
            }
        };
        let mut latest = None;
        for frame in &mut frames {
            match frame {
                Ok(frame) => {
                    self.receive(now, from, &frame);
                    latest = Some(frame.source);
                }
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
            if let Some(source) = latest {
                self.peers
                    .recognise(source, peer::Recogniser::handle_stale_octets);
            }
        }
    }

    /// Takes a frame that came from `from`, from a link that reads frames itself. Nothing in it is
    /// an error, as with [`handle_datagram`](Self::handle_datagram).
    pub fn handle_frame(&mut self, now: Instant, from: Path, frame: &Frame) {
        self.latest = Some(now);
        if let Err(reason) = self.check_path(from) {
            self.counters.add(Counter::MessagesReceived);
            return self.counters.add(reason);
        }
        self.to_all = false;
        // Whoever is at the other end has shown that it is there.
        self.credit = usize::MAX;
        self.held_by_payload = usize::MAX;
        self.receive(now, from, frame);
    }

    /// Takes note that a version octet stands before the next frame of `source` in the middle of a
    /// TCP stream, which tells something of who it is and where it is to be answered.
    pub fn handle_repeated_version(&mut self, source: JausId) {
        self.peers
            .recognise(source, peer::Recogniser::handle_repeated_version);
    }

    /// Whether anything may come by a path.
    fn check_path(&self, from: Path) -> Result<(), Counter> {
        if !self.links.contains_key(&from.link) {
            return Err(Counter::UnknownLink);
        }
        let address = from.peer.socket().map(|address| address.ip());
        if address.is_some_and(|address| !self.config.access.allows_address(address)) {
            return Err(Counter::NetworkDenied);
        }
        Ok(())
    }

    fn receive(&mut self, now: Instant, from: Path, frame: &Frame) {
        self.counters.add(Counter::MessagesReceived);
        let (source, destination) = (frame.source, frame.destination);
        let accepted = match self.with_wildcards_for_zeros(frame) {
            Some(meant) => self.accept(now, from, &meant),
            None => self.accept(now, from, frame),
        };
        if let Err(reason) = accepted {
            trace!(%source, %destination, peer = %from.peer, %reason);
            self.counters.add(reason);
        }
    }

    /// The message as somebody means it who writes 0 for "all"; `None` if it stays as it is.
    fn with_wildcards_for_zeros(&self, frame: &Frame) -> Option<Frame> {
        let means_all = frame.destination.has_zero()
            && self.peers.profile(frame.source).reads_zero_as_wildcard();
        means_all.then(|| Frame {
            destination: frame.destination.with_zeros_for_all(),
            ..frame.clone()
        })
    }

    /// Does all that a message causes, or tells why it is dropped.
    fn accept(&mut self, now: Instant, from: Path, frame: &Frame) -> Result<(), Counter> {
        let broadcast = check_header(frame).inspect_err(|reason| {
            if *reason == Counter::PriorityFault {
                self.peers
                    .recognise(frame.source, |it| it.handle_frame(frame, 0));
            }
        })?;
        let seen = self.heard.fingerprint(frame);
        self.refuse_own(now, from, frame.source, seen)?;
        self.config.access.check_source(frame.source)?;
        let passes = self.is_passed_on(frame);
        let receivers = match self.receivers(frame, broadcast) {
            Err(_) if passes => Vec::new(),
            receivers => receivers?,
        };
        self.admit(now, from, frame.source)?;
        // Before acknowledging: what is dropped must not be taken for delivered.
        if !self.peers.has_room_for(now, frame.source) {
            return Err(Counter::PeersFull);
        }
        if !receivers.is_empty() {
            match frame.flags.acknowledgement() {
                Acknowledgement::Positive | Acknowledgement::Negative => {
                    self.learn(now, from, frame)?;
                    self.receive_answer(now, frame)?;
                    self.peers.note_answer(frame.source);
                    return Ok(());
                }
                Acknowledgement::Request => {
                    if receivers.iter().any(|id| self.components.is_busy(id)) {
                        return Err(Counter::ReceiverBusy);
                    }
                    self.acknowledge_within_limits(from, frame);
                }
                Acknowledgement::None => {}
            }
        }
        // Before learning: a copy that came another way must not move the peer there and back.
        let novelty = match self.recall(now, from, frame, seen) {
            Novelty::Repeated if self.reassembly.awaits(frame) => Novelty::New,
            novelty => novelty,
        };
        if novelty != Novelty::New {
            self.peers.note_duplicate(frame.source);
            if passes && novelty == Novelty::Repeated {
                self.pass_on(now, from, frame);
            }
            return Err(Counter::Duplicate);
        }
        if passes && self.is_astray(now, from, frame) {
            self.counters.add(Counter::NotTheWayBack);
        } else {
            self.learn(now, from, frame)?;
            if self.to_all {
                self.peers
                    .recognise(frame.source, |it| it.handle_frame_to_all(frame));
            }
            if passes {
                self.pass_on(now, from, frame);
            }
        }
        self.put_together(now, from, frame, broadcast, &receivers)
    }

    /// Delivers a message to components of ours when it is whole.
    fn put_together(
        &mut self,
        now: Instant,
        from: Path,
        frame: &Frame,
        broadcast: Broadcast,
        receivers: &[JausId],
    ) -> Result<(), Counter> {
        if receivers.is_empty() {
            return Ok(());
        }
        let payload = match frame.flags.data() {
            DataControl::Single => {
                self.finish_large(from, frame);
                frame.payload.clone()
            }
            _ => {
                let style = self.peers.large_style(frame.source);
                let whole = self.reassembly.insert(
                    now,
                    frame,
                    self.held_by_payload,
                    style,
                    &mut self.counters,
                )?;
                let Some(whole) = whole else { return Ok(()) };
                self.peers
                    .recognise(frame.source, |it| it.handle_large(whole.style));
                whole.payload
            }
        };
        self.deliver(from, frame, broadcast, &payload, receivers);
        Ok(())
    }

    /// Delivers a large message whose end only the next message of its sender shows.
    fn finish_large(&mut self, from: Path, next: &Frame) {
        let finished = self.reassembly.finish(next.source, next.sequence);
        let Some((destination, priority, whole)) = finished else {
            return;
        };
        self.peers
            .recognise(next.source, |it| it.handle_large(whole.style));
        let large = Frame {
            flags: Flags::new(priority),
            ..Frame::new(next.source, destination, Bytes::new())
        };
        let receivers = self.components.matching(destination);
        self.deliver(from, &large, Broadcast::None, &whole.payload, &receivers);
    }

    /// Whether one more message may come from there, and from somebody who was not known.
    fn admit(&mut self, now: Instant, from: Path, source: JausId) -> Result<(), Counter> {
        self.gate.admit_message(now, from, source)?;
        if self.peers.knows(source) {
            Ok(())
        } else {
            self.gate.admit_new_id(now, from)
        }
    }

    /// Acknowledges a message. Strangers get no more octets of acknowledgements for a datagram than
    /// it had, or others could be flooded through us in their name.
    fn acknowledge_within_limits(&mut self, from: Path, request: &Frame) {
        if self.peers.is_stranger(request.source) {
            const COST: usize = 1 + as5669a::MIN_LEN + DATAGRAM_OVERHEAD;
            let Some(rest) = self.credit.checked_sub(COST) else {
                return self.counters.add(Counter::AcknowledgementsWithheld);
            };
            self.credit = rest;
        }
        self.acknowledge(from, request);
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

    /// Drops what is said in our own name.
    ///
    /// Our own multicast comes back from our own address, and is known by what it says when the
    /// component that said it has gone. Whatever else is said in our name is an id conflict.
    fn refuse_own(
        &mut self,
        now: Instant,
        from: Path,
        source: JausId,
        seen: Fingerprint,
    ) -> Result<(), Counter> {
        let window = self.config.echo_window;
        if self.sent_to_group.contains(now, &seen, window) && self.may_be_ours(from) {
            return Err(Counter::OwnEcho);
        }
        if self.components.contains(source) {
            self.announce_conflict(now, from, source);
            return Err(Counter::IdConflict);
        }
        Ok(())
    }

    /// Whether something may have been sent by ourselves, as far as the address tells.
    fn may_be_ours(&self, from: Path) -> bool {
        let mut own = self.links.values().flat_map(|link| &link.own).peekable();
        own.peek().is_none() || own.any(|&own| from.peer == own)
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

    /// Learns where a sender is, if there is room for it.
    fn learn(&mut self, now: Instant, from: Path, frame: &Frame) -> Result<(), Counter> {
        let (id, version) = (frame.source, frame.version);
        let from = self.where_it_reads(id, from);
        match self.peers.learn(now, from, frame) {
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
            Learned::NoRoom => return Err(Counter::PeersFull),
        }
        Ok(())
    }

    /// Where a sender is to be answered: where it was heard, unless it does not read there. Then
    /// where it was heard before by datagram, if it was.
    fn where_it_reads(&self, id: JausId, from: Path) -> Path {
        let is_datagram = |path: &Path| self.framing(path.link) == Framing::Judp;
        if is_datagram(&from) || !self.peers.is_deaf_on_its_connections(id) {
            return from;
        }
        let before = self.peers.last_heard(id).map(|(path, _)| path);
        before.filter(is_datagram).unwrap_or(from)
    }

    /// How a message stands to what was heard lately.
    ///
    /// The older headers' peers leave the sequence number at 0, so there only a message that wants
    /// an acknowledgement, and hence may be repeated, can be told from another.
    fn recall(&mut self, now: Instant, from: Path, frame: &Frame, seen: Fingerprint) -> Novelty {
        let forwarding = self.config.forwarding;
        let repeats = frame.flags.acknowledgement() != Acknowledgement::None;
        let numbered = repeats || frame.version == Version::As5669a;
        if !numbered && !forwarding {
            return Novelty::New;
        }
        let seen = seen.in_round(self.peers.round(frame));
        let way = self.heard.way(forwarding.then_some(from));
        let novelty = match self.heard.sighting(seen) {
            None => Novelty::New,
            Some(before) => {
                let age = now.saturating_duration_since(before.time);
                let elsewhere = before.way != way;
                if elsewhere && age < self.config.retransmission_window {
                    Novelty::Copy
                } else if numbered && age < self.duplicate_window(frame) {
                    if repeats && age >= REPEAT_INTERVAL {
                        Novelty::Repeated
                    } else {
                        Novelty::Copy
                    }
                } else {
                    Novelty::New
                }
            }
        };
        if novelty != Novelty::Copy {
            let stranger = self.peers.is_stranger(frame.source);
            let class = Class { stranger, repeats };
            self.heard.insert_as(now, seen, way, class);
        }
        novelty
    }

    /// For how long the same message is taken for a duplicate.
    fn duplicate_window(&self, frame: &Frame) -> Duration {
        if frame.flags.acknowledgement() == Acknowledgement::None {
            return self.config.duplicate_window;
        }
        let is_call = frame.flags.broadcast() != Some(Broadcast::None);
        let is_unmarked_call = self.to_all && peer::Recogniser::is_unmarked_call(frame);
        if is_call || is_unmarked_call || self.repeats_soon(frame.source) {
            self.config.first_contact_window
        } else {
            self.config.retransmission_window
        }
    }

    fn repeats_soon(&self, source: JausId) -> bool {
        self.peers.profile(source).repeats_soon()
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
    if peer::is_priority_fault(frame) {
        return Err(Counter::PriorityFault);
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
