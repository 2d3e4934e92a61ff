//! The receive path, from a datagram to deliveries: each message is checked, acknowledged,
//! deduplicated, learned from and delivered.

use std::time::Instant;

use bytes::Bytes;
use tracing::{debug, trace, warn};

use super::duplicates::Novelty;
use super::peers::is_challenge;
use super::recent::Fingerprint;
use super::verify::Warning;
use super::{Counter, Endpoint, Event, Ingress, Path, Received, Sink};
use crate::address::JausId;
use crate::peer;
use crate::wire::{Acknowledgement, Broadcast, DataControl, Flags, Frame, Framing, judp};

/// How a message arrived.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival {
    pub(super) now: Instant,
    pub(super) path: Path,
    /// Whether it was sent to the link's group.
    pub(super) to_all: bool,
    /// Octets of memory that its payload keeps alive.
    pub(super) held: usize,
}

/// A repeated message is forwarded at most this often. No sender retransmits more often before it
/// gives up. A frame that circulates between routers, because it was corrupted or forged as if one
/// of them had sent it, does.
const MOST_REPETITIONS: u8 = 32;

impl Endpoint {
    /// Processes one datagram and delivers its messages for local components to `sink`.
    ///
    /// Malformed input is not an error: it is counted and traced. Responses and events are
    /// available from [`poll_transmit`](Self::poll_transmit) and [`poll_event`](Self::poll_event).
    pub fn handle_datagram(
        &mut self,
        now: Instant,
        from: impl Into<Ingress>,
        data: Bytes,
        sink: &mut dyn Sink,
    ) {
        let Ingress { path: from, to_all } = from.into();
        self.counters.add(Counter::DatagramsReceived);
        if let Err(reason) = self.check_path(from) {
            return self.counters.add(reason);
        }
        let arrival = Arrival {
            now,
            path: from,
            to_all,
            held: data.len(),
        };
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
                    self.receive(arrival, &frame, sink);
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
                    .recognise(source, from, peer::Recogniser::handle_stale_octets);
            }
        }
    }

    /// Processes one frame received on path `from`, for links that read frames themselves. As in
    /// [`handle_datagram`](Self::handle_datagram), malformed input is not an error.
    pub fn handle_frame(&mut self, now: Instant, from: Path, frame: &Frame, sink: &mut dyn Sink) {
        if let Err(reason) = self.check_path(from) {
            self.counters.add(Counter::MessagesReceived);
            return self.counters.add(reason);
        }
        let arrival = Arrival {
            now,
            path: from,
            to_all: false,
            held: usize::MAX,
        };
        self.receive(arrival, frame, sink);
    }

    /// Reports that a version octet precedes the next frame of `source` in the middle of a TCP
    /// stream, which helps to recognise the peer and to choose the path for answers.
    pub fn handle_repeated_version(&mut self, source: JausId) {
        if let Some((path, _)) = self.peers.last_heard(source) {
            self.peers
                .recognise(source, path, peer::Recogniser::handle_repeated_version);
        }
    }

    /// Whether messages from a path are accepted.
    fn check_path(&self, from: Path) -> Result<(), Counter> {
        if !self.egress.has_link(from.link) {
            return Err(Counter::UnknownLink);
        }
        let address = from.peer.socket().map(|address| address.ip());
        if address.is_some_and(|address| !self.config.access.allows_address(address)) {
            return Err(Counter::NetworkDenied);
        }
        Ok(())
    }

    fn receive(&mut self, arrival: Arrival, frame: &Frame, sink: &mut dyn Sink) {
        self.counters.add(Counter::MessagesReceived);
        let (source, destination) = (frame.source, frame.destination);
        let accepted = match self.with_wildcards_for_zeros(frame) {
            Some(meant) => self.accept(arrival, &meant, sink),
            None => self.accept(arrival, frame, sink),
        };
        if let Err(reason) = accepted {
            trace!(%source, %destination, peer = %arrival.path.peer, %reason);
            self.counters.add(reason);
        }
    }

    /// Replaces zeros in the destination by wildcards if the sender's profile writes 0 for "all";
    /// `None` if nothing changes.
    fn with_wildcards_for_zeros(&self, frame: &Frame) -> Option<Frame> {
        let means_all = frame.destination.has_zero()
            && self.peers.profile(frame.source).reads_zero_as_wildcard();
        means_all.then(|| Frame {
            destination: frame.destination.with_zeros_for_all(),
            ..frame.clone()
        })
    }

    /// Processes a message, or returns why it is dropped.
    fn accept(
        &mut self,
        arrival: Arrival,
        frame: &Frame,
        sink: &mut dyn Sink,
    ) -> Result<(), Counter> {
        let Arrival { now, path, .. } = arrival;
        let broadcast = check_header(frame).inspect_err(|reason| {
            if *reason == Counter::PriorityFault {
                self.peers
                    .recognise(frame.source, path, |it| it.handle_frame(frame, 0));
            }
        })?;
        let seen = self.heard.fingerprint(frame);
        self.refuse_own(now, path, frame.source, seen)?;
        self.refuse_misplaced(now, path, frame.source)?;
        let passes = self.is_passed_on(frame);
        let is_for_us = match self.check_receivers(frame, broadcast) {
            Err(_) if passes => false,
            checked => checked.map(|()| true)?,
        };
        self.admit(now, path, frame.source)?;
        // Check before acknowledging: a dropped message must not look delivered.
        if !self.peers.has_room_for(now, frame.source, path) {
            if self.warnings.is_due(now, Warning::TableFull) {
                warn!(
                    id = %frame.source, from = %path.peer,
                    "no room for another peer: raise limits.max_peers, or find the sender of \
                     forged ids"
                );
            }
            return Err(Counter::PeersFull);
        }
        if is_for_us {
            self.check_part(now, path, frame, seen)?;
            match frame.flags.acknowledgement() {
                Acknowledgement::Positive | Acknowledgement::Negative => {
                    return self.receive_acknowledgement(now, path, frame);
                }
                Acknowledgement::Request => {
                    let may_be_refused = frame.destination.is_unicast() && !is_challenge(frame);
                    if may_be_refused && !sink.has_room(frame.destination, frame.flags.priority()) {
                        return Err(Counter::ReceiverBusy);
                    }
                    self.acknowledge(now, path, frame);
                }
                Acknowledgement::None => {}
            }
        }
        // Check before learning: a copy that arrived on another path must not move the peer.
        let novelty = match self.recall(arrival, frame, seen) {
            Novelty::Repeated(_) if self.reassembly.awaits(frame) => Novelty::New,
            novelty => novelty,
        };
        if novelty != Novelty::New {
            self.reassembly.keep(now, frame);
            self.peers.note(frame.source, |peer| peer.duplicates += 1);
            if passes && let Novelty::Repeated(1..=MOST_REPETITIONS) = novelty {
                self.pass_on(now, path, frame);
            }
            return Err(Counter::Duplicate);
        }
        if passes && self.is_astray(now, path, frame) {
            self.counters.add(Counter::NotTheWayBack);
        } else {
            self.learn(now, path, frame)?;
            if arrival.to_all {
                self.peers
                    .recognise(frame.source, path, |it| it.handle_frame_to_all(frame));
            }
            if passes {
                self.pass_on(now, path, frame);
            }
        }
        if !is_for_us || is_challenge(frame) {
            return Ok(());
        }
        self.put_together(arrival, frame, broadcast, sink)
    }

    /// Processes an acknowledgement. An unawaited one neither teaches nor moves a route. Sequence
    /// numbers can be guessed, so an acknowledgement from elsewhere than the peer's verified
    /// address is ignored.
    fn receive_acknowledgement(
        &mut self,
        now: Instant,
        from: Path,
        frame: &Frame,
    ) -> Result<(), Counter> {
        let (peer, local, number) = (frame.source, frame.destination, frame.sequence);
        if self.calls.take(now, peer, local, number) {
            return self.learn(now, from, frame);
        }
        if self.awaits_answer(peer, local, number) && !self.peers.is_proven_elsewhere(peer, from) {
            self.learn(now, from, frame)?;
            self.receive_answer(now, frame)?;
            let from = self.where_it_reads(peer, from);
            self.peers.verify(peer, from);
            return Ok(());
        }
        if self.receive_challenge_answer(now, from, frame) {
            return self.learn(now, from, frame);
        }
        Err(Counter::UnawaitedAcknowledgement)
    }

    /// Refuses senders that are denied by id or configured to be at another address.
    fn refuse_misplaced(&mut self, now: Instant, from: Path, id: JausId) -> Result<(), Counter> {
        self.config.access.check_source(id)?;
        if !self.peers.is_pinned_elsewhere(id, from) {
            return Ok(());
        }
        if self.warnings.is_due(now, Warning::PinnedElsewhere) {
            warn!(%id, from = %from.peer, "refused: `peers` pins this id to another address");
        }
        Err(Counter::PinnedElsewhere)
    }

    /// Refuses a fragment whose sender is verified at another address, without acknowledging it: it
    /// may be forged. If the sender has in fact moved, a challenge shows it, and the fragment is
    /// retransmitted. A duplicate of a known fragment needs no challenge.
    fn check_part(
        &mut self,
        now: Instant,
        from: Path,
        frame: &Frame,
        seen: Fingerprint,
    ) -> Result<(), Counter> {
        let is_part = frame.flags.data() != DataControl::Single;
        if !is_part || !self.peers.is_proven_elsewhere(frame.source, from) {
            return Ok(());
        }
        let seen = seen.in_round(self.peers.round(frame));
        let window = self.config.retransmission_window;
        if self.heard.contains(now, &seen, window) {
            return Err(Counter::Duplicate);
        }
        self.learn(now, from, frame)?;
        if self.peers.is_proven_elsewhere(frame.source, from) {
            return Err(Counter::PartFromElsewhere);
        }
        Ok(())
    }

    /// Delivers a message to local components once it is complete.
    fn put_together(
        &mut self,
        arrival: Arrival,
        frame: &Frame,
        broadcast: Broadcast,
        sink: &mut dyn Sink,
    ) -> Result<(), Counter> {
        let from = arrival.path;
        let payload = match frame.flags.data() {
            DataControl::Single => {
                self.finish_large(from, frame, sink);
                frame.payload.clone()
            }
            _ => {
                let style = self.peers.large_style(frame.source);
                let whole = self
                    .reassembly
                    .insert(arrival, frame, style, &mut self.counters)?;
                let Some(whole) = whole else { return Ok(()) };
                self.recall_beginning(arrival, frame, &whole);
                self.peers
                    .recognise(frame.source, from, |it| it.handle_large(whole.style));
                whole.payload
            }
        };
        self.deliver(from, frame, broadcast, &payload, sink);
        Ok(())
    }

    /// Delivers a large message whose end is shown only by its sender's next message.
    fn finish_large(&mut self, from: Path, next: &Frame, sink: &mut dyn Sink) {
        let finished = self.reassembly.finish(next.source, next.sequence);
        let Some((destination, priority, whole)) = finished else {
            return;
        };
        self.peers
            .recognise(next.source, from, |it| it.handle_large(whole.style));
        let large = Frame {
            flags: Flags::new(priority),
            ..Frame::new(next.source, destination, Bytes::new())
        };
        self.deliver(from, &large, Broadcast::None, &whole.payload, sink);
    }

    /// Applies the rate limits for messages and for new ids.
    fn admit(&mut self, now: Instant, from: Path, source: JausId) -> Result<(), Counter> {
        self.gate.admit_message(now, from, source)?;
        if self.peers.knows(source) {
            Ok(())
        } else {
            self.gate.admit_new_id(now, from)
        }
    }

    /// Checks whether a message is for local components.
    fn check_receivers(&self, frame: &Frame, broadcast: Broadcast) -> Result<(), Counter> {
        let reaches = |broadcast| {
            let (source, destination) = (frame.source, frame.destination);
            let mut receivers = self.components.receivers(source, destination, broadcast);
            receivers.next().is_some()
        };
        if reaches(broadcast) {
            Ok(())
        } else if reaches(Broadcast::None) {
            Err(Counter::OutOfScope)
        } else {
            Err(Counter::NotForUs)
        }
    }

    /// Drops messages with a local source id.
    ///
    /// Our own multicast comes back from our own address; it is recognised by its content even if
    /// the component that sent it is detached by now. Any other message with a local source id is
    /// an id conflict.
    fn refuse_own(
        &mut self,
        now: Instant,
        from: Path,
        source: JausId,
        seen: Fingerprint,
    ) -> Result<(), Counter> {
        if self.egress.is_echo(now, &seen) && self.may_be_ours(from) {
            return Err(Counter::OwnEcho);
        }
        if self.components.contains(source) {
            self.announce_conflict(now, from, source);
            return Err(Counter::IdConflict);
        }
        Ok(())
    }

    /// Whether a message may be our own, judging by its source address.
    fn may_be_ours(&self, from: Path) -> bool {
        let links = self.egress.links();
        let mut own = links.flat_map(|(_, link)| &link.own).peekable();
        own.peek().is_none() || own.any(|&own| from.peer == own)
    }

    /// Announces that another sender uses a local id, at most once per interval.
    fn announce_conflict(&mut self, now: Instant, from: Path, id: JausId) {
        let announced = self.conflicts.get(&id);
        if announced
            .is_none_or(|&at| now.saturating_duration_since(at) >= self.config.conflict_interval)
        {
            self.conflicts.insert(id, now);
            debug!(%id, ?from, "id conflict");
            if self.warnings.is_due(now, Warning::IdConflict) {
                warn!(%id, from = %from.peer, "another node uses an id of this node: change one \
                    of the two");
            }
            self.announce(Event::IdConflict { id, path: from });
        }
    }

    /// The path for answers to a sender: where it was heard, unless it does not read there. In that
    /// case the datagram path on which it was heard before, if any.
    pub(super) fn where_it_reads(&self, id: JausId, from: Path) -> Path {
        let is_datagram = |path: &Path| self.framing(path.link) == Framing::Judp;
        if is_datagram(&from) || !self.peers.is_deaf_on_its_connections(id) {
            return from;
        }
        let before = self.peers.last_heard(id).map(|(path, _)| path);
        before.filter(is_datagram).unwrap_or(from)
    }

    /// Delivers a complete message to its receivers.
    fn deliver(
        &mut self,
        from: Path,
        frame: &Frame,
        broadcast: Broadcast,
        payload: &Bytes,
        sink: &mut dyn Sink,
    ) {
        let whole = Received {
            source: frame.source,
            destination: frame.destination,
            priority: frame.flags.priority(),
            broadcast,
            payload: payload.clone(),
            path: Some(from),
            to: frame.destination,
        };
        self.deliver_to_all(&whole, None, sink);
    }

    /// Delivers a message to every matching component except `but`.
    pub(super) fn deliver_to_all(
        &mut self,
        message: &Received,
        but: Option<JausId>,
        sink: &mut dyn Sink,
    ) {
        let Received {
            source,
            destination,
            ..
        } = *message;
        let receivers = self
            .components
            .receivers(source, destination, message.broadcast);
        for to in receivers.filter(|&to| Some(to) != but) {
            let message = Received {
                to,
                ..message.clone()
            };
            sink.deliver(message);
            self.counters.add(Counter::MessagesDelivered);
        }
    }
}

/// Runs the checks that do not depend on local state; returns the broadcast scope.
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
