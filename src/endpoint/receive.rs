//! From a datagram to deliveries: each message is judged, learned from, acknowledged, filtered and
//! handed out.

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

/// How a message came.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival {
    pub(super) now: Instant,
    pub(super) path: Path,
    /// Whether it went to everybody.
    pub(super) to_all: bool,
    /// Octets of memory that its payload holds on to.
    pub(super) held: usize,
}

/// A repeated message is passed on this often. No sender repeats more often before it gives up; a
/// frame that circulates between routers, corrupted or forged as if one of them had sent it, does.
const MOST_REPETITIONS: u8 = 32;

impl Endpoint {
    /// Takes a datagram, and hands the messages in it for local components to `sink`.
    ///
    /// Nothing in it is an error: what cannot be used is counted and traced. Answers and news come
    /// out of [`poll_transmit`](Self::poll_transmit) and [`poll_event`](Self::poll_event).
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

    /// Takes a frame that came from `from`, from a link that reads frames itself. Nothing in it is
    /// an error, as with [`handle_datagram`](Self::handle_datagram).
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

    /// Takes note that a version octet stands before the next frame of `source` in the middle of a
    /// TCP stream, which tells something of who it is and where it is to be answered.
    pub fn handle_repeated_version(&mut self, source: JausId) {
        if let Some((path, _)) = self.peers.last_heard(source) {
            self.peers
                .recognise(source, path, peer::Recogniser::handle_repeated_version);
        }
    }

    /// Whether anything may come by a path.
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
        // Before acknowledging: what is dropped must not be taken for delivered.
        if !self.peers.has_room_for(now, frame.source, path) {
            if self.warnings.is_due(now, Warning::TableFull) {
                warn!(
                    id = %frame.source, from = %path.peer,
                    "no room for another peer: raise limits.max_peers, or see who invents ids"
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
        // Before learning: a copy that came another way must not move the peer there and back.
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

    /// Takes an acknowledgement. One that nobody waits for teaches nothing and moves nobody, and
    /// numbers can be guessed: so one from elsewhere than where the peer has proven to be is none.
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

    /// Refuses what may not come from there: from an id that is denied or configured to be
    /// elsewhere.
    fn refuse_misplaced(&mut self, now: Instant, from: Path, id: JausId) -> Result<(), Counter> {
        self.config.access.check_source(id)?;
        if !self.peers.is_pinned_elsewhere(id, from) {
            return Ok(());
        }
        if self.warnings.is_due(now, Warning::PinnedElsewhere) {
            warn!(%id, from = %from.peer, "refused: peers says that this id is at another address");
        }
        Err(Counter::PinnedElsewhere)
    }

    /// Refuses a part of a message from where its sender is not proven to be, if it is proven to be
    /// elsewhere, and does not acknowledge it: it may be forged. If it is not, a challenge shows that,
    /// and the part comes again. A copy of what has come from there needs no challenge.
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

    /// Delivers a message to components of ours when it is whole.
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

    /// Delivers a large message whose end only the next message of its sender shows.
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

    /// Whether one more message may come from there, and from somebody who was not known.
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
        if self.egress.is_echo(now, &seen) && self.may_be_ours(from) {
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
        let links = self.egress.links();
        let mut own = links.flat_map(|(_, link)| &link.own).peekable();
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
            if self.warnings.is_due(now, Warning::IdConflict) {
                warn!(%id, from = %from.peer, "somebody else uses an id of this node: change one of the two");
            }
            self.announce(Event::IdConflict { id, path: from });
        }
    }

    /// Where a sender is to be answered: where it was heard, unless it does not read there. Then
    /// where it was heard before by datagram, if it was.
    pub(super) fn where_it_reads(&self, id: JausId, from: Path) -> Path {
        let is_datagram = |path: &Path| self.framing(path.link) == Framing::Judp;
        if is_datagram(&from) || !self.peers.is_deaf_on_its_connections(id) {
            return from;
        }
        let before = self.peers.last_heard(id).map(|(path, _)| path);
        before.filter(is_datagram).unwrap_or(from)
    }

    /// Hands a whole message to its receivers.
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

    /// Hands a message to each component that it reaches, but for one.
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
