//! The receive path, from a datagram to deliveries: each message is checked, acknowledged,
//! deduplicated, learned from and delivered.

use std::collections::BTreeSet;
use std::time::Instant;

use bytes::Bytes;
use tracing::{debug, trace, warn};

use super::arrival::Arrival;
use super::duplicates::Novelty;
use super::peers::is_challenge;
use super::recent::Fingerprint;
use super::verify::Warning;
use super::{Counter, Endpoint, Event, Ingress, Path, Received, Sink, is_reserved};
use crate::address::JausId;
use crate::peer::{self, Sign};
use crate::wire::{Acknowledgement, Broadcast, DataControl, Frame, judp};

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
        let Ingress { path, to_all } = from.into();
        self.counters.add(Counter::DatagramsReceived);
        if let Err(reason) = self.check_path(path) {
            return self.counters.add(reason);
        }
        let held = data.len();
        let mut frames = match judp::frames(data) {
            Ok(frames) => frames,
            Err(error) => {
                debug!(?path, %error, "not JAUS");
                return self.counters.add(Counter::NotJaus);
            }
        };
        let mut latest = None;
        for frame in &mut frames {
            match frame {
                Ok(frame) => {
                    let arrival = Arrival {
                        frame: &frame,
                        now,
                        path,
                        to_all,
                        held,
                    };
                    self.receive(arrival, sink);
                    latest = Some(frame.source);
                }
                Err(error) => {
                    debug!(?path, %error, "malformed");
                    return self.counters.add(Counter::Malformed);
                }
            }
        }
        if frames.remaining() > 0 {
            trace!(?path, octets = frames.remaining(), "stale octets");
            self.counters
                .add_many(Counter::StaleOctets, frames.remaining() as u64);
            if let Some(source) = latest {
                self.peers
                    .recognise(source, path, |it| it.note(Sign::StaleOctets));
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
            frame,
            now,
            path: from,
            to_all: false,
            held: usize::MAX,
        };
        self.receive(arrival, sink);
    }

    /// Reports that a version octet precedes the next frame of `source` in the middle of a TCP
    /// stream, which helps to recognise the peer and to choose the path for answers.
    pub fn handle_repeated_version(&mut self, source: JausId) {
        if let Some(path) = self.peers.get(source).map(|state| state.peer.path) {
            self.peers
                .recognise(source, path, |it| it.note(Sign::RepeatedVersion));
        }
    }

    /// Whether messages from a path are accepted.
    fn check_path(&self, from: Path) -> Result<(), Counter> {
        if !self.egress.links.contains_key(&from.link) {
            return Err(Counter::UnknownLink);
        }
        let address = from.peer.socket().map(|address| address.ip());
        if address.is_some_and(|address| !self.config.access.allows_address(address)) {
            return Err(Counter::NetworkDenied);
        }
        Ok(())
    }

    fn receive(&mut self, arrival: Arrival<'_>, sink: &mut dyn Sink) {
        self.counters.add(Counter::MessagesReceived);
        let Arrival { frame, path, .. } = arrival;
        let accepted = match &self.with_wildcards_for_zeros(frame) {
            Some(frame) => self.accept(Arrival { frame, ..arrival }, sink),
            None => self.accept(arrival, sink),
        };
        if let Err(reason) = accepted {
            trace!(source = %frame.source, destination = %frame.destination, peer = %path.peer, %reason);
            self.counters.add(reason);
        }
    }

    /// Replaces zeros in the destination by wildcards if the sender's profile writes 0 for "all";
    /// `None` if nothing changes.
    fn with_wildcards_for_zeros(&self, frame: &Frame) -> Option<Frame> {
        let means_all = frame.destination.has_zero()
            && self.peers.presumed(frame.source).reads_zero_as_wildcard();
        means_all.then(|| Frame {
            destination: frame.destination.with_zeros_for_all(),
            ..frame.clone()
        })
    }

    /// Processes a message, or returns why it is dropped.
    fn accept(&mut self, arrival: Arrival<'_>, sink: &mut dyn Sink) -> Result<(), Counter> {
        let (frame, now, path) = (arrival.frame, arrival.now, arrival.path);
        let broadcast = check_header(frame).inspect_err(|reason| {
            if *reason == Counter::PriorityFault {
                self.peers
                    .recognise(frame.source, path, |it| it.handle_frame(frame, 0));
            }
        })?;
        let seen = self.heard.fingerprint(frame);
        self.refuse_own(arrival, seen)?;
        self.refuse_misplaced(arrival)?;
        self.refuse_bridged(arrival)?;
        let passes = self.is_passed_on(frame);
        let is_for_us = match self.check_receivers(frame, broadcast) {
            Err(_) if passes => false,
            checked => checked.map(|()| true)?,
        };
        let is_new = self.peers.get(frame.source).is_none();
        self.gate.admit(now, path, frame.source, is_new)?;
        // Neither a message for others nor one above the rate costs an answer or an entry.
        if let Some(copies) = self.refuse_without_right(arrival)?.copies(frame) {
            // A copy may be for nobody here, and another one for somebody.
            let accepted = copies
                .iter()
                .map(|frame| self.accept(Arrival { frame, ..arrival }, sink));
            return accepted.reduce(Result::or).unwrap_or(Ok(()));
        }
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
            self.check_part(arrival, seen)?;
            match frame.flags.acknowledgement() {
                Acknowledgement::Positive | Acknowledgement::Negative => {
                    return self.receive_acknowledgement(arrival);
                }
                Acknowledgement::Request => {
                    let may_be_refused = frame.destination.is_unicast() && !is_challenge(frame);
                    if may_be_refused && !self.is_repeat(arrival, seen) {
                        self.check_room(arrival, sink)?;
                    }
                    self.acknowledge(arrival);
                }
                Acknowledgement::None => {}
            }
        }
        // Check before learning: a copy that arrived on another path must not move the peer.
        let novelty = match self.recall(arrival, seen) {
            Novelty::Repeated { .. } if self.reassembly.awaits(frame, path) => Novelty::New,
            novelty => novelty,
        };
        if novelty != Novelty::New {
            self.reassembly.keep(now, frame);
            self.peers.note(frame.source, |peer| peer.duplicates += 1);
            let forwardable = matches!(novelty, Novelty::Repeated { forwardable: true });
            if passes && forwardable {
                self.pass_on(arrival);
            }
            return Err(Counter::Duplicate);
        }
        // A copy of a bridge's own message, from another bridge or a router, shows no component.
        self.forget_bridged(arrival);
        if passes && self.is_astray(arrival) {
            self.counters.add(Counter::NotTheWayBack);
        } else {
            self.learn(arrival)?;
            if arrival.to_all {
                self.peers
                    .recognise(frame.source, path, |it| it.handle_frame_to_all(frame));
            }
            if passes && self.pass_on(arrival) && !is_for_us {
                self.record_passed(frame, path.peer);
            }
        }
        if !is_for_us || is_challenge(frame) {
            return Ok(());
        }
        self.put_together(arrival, broadcast, sink)
    }

    /// Checks that a message to be acknowledged will be kept.
    fn check_room(&self, arrival: Arrival<'_>, sink: &dyn Sink) -> Result<(), Counter> {
        let frame = arrival.frame;
        if !sink.has_room(frame.destination, frame.flags.priority()) {
            return Err(Counter::ReceiverBusy);
        }
        self.reassembly.check_length(arrival)
    }

    /// Processes an acknowledgement. An unawaited one neither teaches nor moves a route. Sequence
    /// numbers can be guessed, so an acknowledgement from elsewhere than the peer's verified
    /// address is ignored.
    fn receive_acknowledgement(&mut self, arrival: Arrival<'_>) -> Result<(), Counter> {
        let (frame, now, path) = (arrival.frame, arrival.now, arrival.path);
        let (peer, local, number) = (frame.source, frame.destination, frame.sequence);
        if self.calls.take(now, peer, local, number) {
            return self.learn(arrival);
        }
        if self.awaits_answer(peer, local, number) && !self.peers.is_proven_elsewhere(peer, path) {
            self.learn(arrival)?;
            self.receive_answer(now, frame);
            let path = self.where_it_reads(peer, path);
            self.peers.verify(peer, path);
            return Ok(());
        }
        if self.receive_challenge_answer(arrival) {
            return self.learn(arrival);
        }
        Err(Counter::UnawaitedAcknowledgement)
    }

    /// Refuses senders that are denied by id, that belong to a secure link, or that are bound or configured to be
    /// at another address.
    fn refuse_misplaced(&mut self, arrival: Arrival<'_>) -> Result<(), Counter> {
        let (id, path) = (arrival.frame.source, arrival.path);
        self.config.access.check_subsystem(id)?;
        if !self.config.access.allows_id_from(id, path.peer) {
            if self.warnings.is_due(arrival.now, Warning::BoundElsewhere) {
                warn!(%id, from = %path.peer, "refused: `access.bind` binds this id to other networks");
            }
            return Err(Counter::BoundElsewhere);
        }
        if is_reserved(&self.reserved, &self.config.access, id, path.peer) {
            if self.warnings.is_due(arrival.now, Warning::Reserved) {
                warn!(
                    %id, from = %path.peer,
                    "refused: this id belongs to a peer of the secure link. If another component has it, give \
                     the key of that peer narrower ids, or bind the id to its network (`access.bind`)"
                );
            }
            return Err(Counter::ReservedId);
        }
        if !self.peers.is_pinned_elsewhere(id, path) {
            return Ok(());
        }
        if self.warnings.is_due(arrival.now, Warning::PinnedElsewhere) {
            warn!(%id, from = %path.peer, "refused: `peers` pins this id to another address");
        }
        Err(Counter::PinnedElsewhere)
    }

    /// Refuses a fragment whose sender is verified at another address, without acknowledging it: it
    /// may be forged. If the sender has in fact moved, a challenge shows it, and the fragment is
    /// retransmitted. A duplicate of a known fragment needs no challenge.
    fn check_part(&mut self, arrival: Arrival<'_>, seen: Fingerprint) -> Result<(), Counter> {
        let Arrival { frame, path, .. } = arrival;
        let is_part = frame.flags.data() != DataControl::Single;
        if !is_part || !self.peers.is_proven_elsewhere(frame.source, path) {
            return Ok(());
        }
        let seen = seen.in_round(self.peers.round(frame));
        let window = self.config.retransmission_window;
        if self.heard.contains(arrival.now, seen, window) {
            return Err(Counter::Duplicate);
        }
        self.learn(arrival)?;
        if self.peers.is_proven_elsewhere(frame.source, path) {
            return Err(Counter::PartFromElsewhere);
        }
        Ok(())
    }

    /// Delivers a message to local components once it is complete. A whole message may show the end
    /// of the large one before it, which is then delivered first.
    fn put_together(
        &mut self,
        arrival: Arrival<'_>,
        broadcast: Broadcast,
        sink: &mut dyn Sink,
    ) -> Result<(), Counter> {
        let Arrival { frame, path, .. } = arrival;
        let source = frame.source;
        let acknowledged = frame.destination.is_unicast()
            && frame.flags.acknowledgement() == Acknowledgement::Request;
        let received = |destination, priority, broadcast, sequence, payload| Received {
            source,
            destination,
            priority,
            broadcast,
            sequence: Some(sequence),
            payload,
            path: Some(path),
            to: destination,
            acknowledged,
        };
        let is_single = frame.flags.data() == DataControl::Single;
        let large = if is_single {
            self.reassembly.finish(frame, path)
        } else {
            let style = self.peers.large_style(source);
            let inserted = self.reassembly.insert(arrival, style, &mut self.counters)?;
            if inserted.is_none() {
                sink.progress(arrival.now, source, frame.destination);
            }
            inserted.inspect(|whole| self.recall_beginning(arrival, whole))
        };
        if let Some(whole) = large {
            self.peers
                .recognise(source, path, |it| it.handle_large(whole.style));
            let scope = if is_single {
                Broadcast::None
            } else {
                broadcast
            };
            let (to, first) = (whole.destination, whole.first.0);
            let message = received(to, whole.priority, scope, first, whole.payload);
            self.deliver(&message, None, sink);
        }
        if is_single {
            let (destination, priority) = (frame.destination, frame.flags.priority());
            let (number, payload) = (frame.sequence, frame.payload.clone());
            let message = received(destination, priority, broadcast, number, payload);
            self.deliver(&message, None, sink);
        }
        Ok(())
    }

    /// Checks whether a message is for local components.
    fn check_receivers(&self, frame: &Frame, broadcast: Broadcast) -> Result<(), Counter> {
        let reaches = |broadcast| {
            let (source, destination) = (frame.source, frame.destination);
            receivers(&self.components, source, destination, broadcast)
                .next()
                .is_some()
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
    fn refuse_own(&mut self, arrival: Arrival<'_>, seen: Fingerprint) -> Result<(), Counter> {
        let window = self.config.echo_window;
        let is_echo = self.egress.echoes.contains(arrival.now, seen, window);
        if is_echo && self.may_be_ours(arrival.path) {
            return Err(Counter::OwnEcho);
        }
        if self.components.contains(&arrival.frame.source) {
            self.announce_conflict(arrival);
            return Err(Counter::IdConflict);
        }
        Ok(())
    }

    /// Whether a message may be our own, judging by its source address.
    fn may_be_ours(&self, from: Path) -> bool {
        let links = self.egress.links.values();
        let mut own = links.flat_map(|link| &link.own).peekable();
        own.peek().is_none() || own.any(|&own| from.peer == own.into())
    }

    /// Announces that another sender uses a local id, at most once per interval.
    fn announce_conflict(&mut self, arrival: Arrival<'_>) {
        let (now, id, path) = (arrival.now, arrival.frame.source, arrival.path);
        let is_recent =
            |&at: &Instant| now.saturating_duration_since(at) < self.config.conflict_interval;
        if self.conflicts.get(&id).is_some_and(is_recent) {
            return;
        }
        self.conflicts.insert(id, now);
        debug!(%id, ?path, "id conflict");
        if self.warnings.is_due(now, Warning::IdConflict) {
            warn!(%id, from = %path.peer, "another node uses an id of this node: change one of the two");
        }
        self.announce(Event::IdConflict { id, path });
    }

    /// The path for answers to a sender: where it was heard, unless it does not read there. In that
    /// case the datagram path on which it was heard before, if any.
    pub(super) fn where_it_reads(&self, id: JausId, from: Path) -> Path {
        if self.egress.is_datagram(from) || !self.peers.is_deaf_on_its_connections(id) {
            return from;
        }
        let before = self.peers.get(id).map(|state| state.peer.path);
        before
            .filter(|&path| self.egress.is_datagram(path))
            .unwrap_or(from)
    }

    /// Delivers a complete message to every matching component except `but`.
    pub(super) fn deliver(&mut self, message: &Received, but: Option<JausId>, sink: &mut dyn Sink) {
        let (source, destination) = (message.source, message.destination);
        let receivers = receivers(&self.components, source, destination, message.broadcast);
        let mut is_delivered = false;
        for to in receivers.filter(|&to| Some(to) != but) {
            is_delivered = true;
            sink.deliver(Received {
                to,
                ..message.clone()
            });
            self.counters.add(Counter::MessagesDelivered);
        }
        let recorded = |it: &Path| is_delivered && self.records(it.peer);
        if let Some(path) = message.path.filter(recorded) {
            let frame = Frame::new(source, destination, message.payload.clone());
            self.record_passed(&frame, path.peer);
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
    let begins = matches!(frame.flags.data(), DataControl::Single | DataControl::First);
    if frame.flags.acknowledgement().is_answer() {
        if !frame.is_acknowledgement() {
            return Err(Counter::AcknowledgementWithPayload);
        }
    } else if begins && frame.code().is_none() {
        return Err(Counter::NoMessageCode);
    }
    Ok(broadcast)
}

/// The components that a message to `destination` reaches. A local broadcast reaches only those of
/// the sender's subsystem.
fn receivers(
    components: &BTreeSet<JausId>,
    source: JausId,
    destination: JausId,
    broadcast: Broadcast,
) -> impl Iterator<Item = JausId> + '_ {
    let (first, last) = if destination.has_wildcard() {
        (JausId::from_u32(0), JausId::EVERYONE)
    } else {
        (destination, destination)
    };
    let in_scope =
        move |id: &JausId| broadcast != Broadcast::Local || id.subsystem() == source.subsystem();
    let ids = components.range(first..=last).copied();
    ids.filter(move |&id| destination.matches(id))
        .filter(in_scope)
}
