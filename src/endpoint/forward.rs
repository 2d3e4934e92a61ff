//! Passing on what is for others, between the links. The rule, with pictures, is in
//! `docs/routing.md`.
//!
//! AS5669A has neither hop count nor routes. So a router learns who is where from all that it hears,
//! remembers what it has heard by which way, and passes nothing on twice but what its sender has
//! sent again. Flags, ids and sequence number stay as they are: acknowledgements are between the
//! ends.

use std::time::{Duration, Instant};

use bytes::Bytes;
use tracing::trace;

use super::{Counter, Endpoint, LinkId, Path, To, Transmit};
use crate::wire::{Broadcast, DataControl, Frame, Framing, Version, ra};

/// For how long after a peer was heard from one side a broadcast of it from another side is taken
/// for a late copy.
const SETTLED: Duration = Duration::from_secs(1);

impl Endpoint {
    /// Whether a message is for others too, and we are asked to pass such on.
    pub(super) fn is_passed_on(&self, frame: &Frame) -> bool {
        let destination = frame.destination;
        self.config.forwarding && !destination.has_zero() && !self.components.contains(destination)
    }

    /// Whether a message for many has not come by the way that leads to its sender, who was heard
    /// from there a moment ago. It is neither passed on nor learned from.
    pub(super) fn is_astray(&self, now: Instant, from: Path, frame: &Frame) -> bool {
        let for_many = frame.destination.has_wildcard()
            || frame.flags.broadcast() != Some(Broadcast::None)
            || self.route(frame.destination).is_none();
        let lately = |at: Instant| now.saturating_duration_since(at) < SETTLED;
        for_many
            && self
                .peers
                .last_heard(frame.source)
                .is_some_and(|(path, at)| path != from && lately(at))
    }

    /// Sends a message on to where its receivers are, if that is somewhere else.
    pub(super) fn pass_on(&mut self, now: Instant, from: Path, frame: &Frame) {
        let (source, destination) = (frame.source, frame.destination);
        match self.next_hops(now, from, frame) {
            Ok(transmits) => {
                self.counters.add(Counter::MessagesForwarded);
                for transmit in transmits {
                    self.transmit(transmit);
                }
            }
            Err(reason) => {
                trace!(%source, %destination, %reason, "not forwarded");
                self.counters.add(reason);
            }
        }
    }

    fn next_hops(
        &mut self,
        now: Instant,
        from: Path,
        frame: &Frame,
    ) -> Result<Vec<Transmit>, Counter> {
        let destination = frame.destination;
        if destination.is_unicast() {
            self.config.access.check_source(destination)?;
            if let Some((path, version)) = self.route(destination) {
                return self.along(from, path, version, frame);
            }
            // Whoever asked for an acknowledgement has been heard: nobody is to be found.
            if frame.flags.acknowledgement().is_answer() {
                return Err(Counter::NotForUs);
            }
        }
        let hops = self.everywhere_but(from, frame)?;
        if hops.is_empty() {
            return Err(Counter::NotForUs);
        }
        if !self.broadcasts.take(now, self.config.forwarded_broadcasts) {
            return Err(Counter::ForwardRate);
        }
        Ok(hops)
    }

    /// To one receiver.
    fn along(
        &self,
        from: Path,
        path: Path,
        version: Version,
        frame: &Frame,
    ) -> Result<Vec<Transmit>, Counter> {
        // What went to a network's group was heard by all on that network.
        let shared = from.link == path.link
            && self.framing(from.link) == Framing::Judp
            && frame.flags.broadcast() != Some(Broadcast::None);
        if path == from || shared {
            return Err(Counter::NotForUs);
        }
        Ok(vec![self.hop(
            path.link,
            To::Peer(path.peer),
            version,
            frame,
        )?])
    }

    /// To everybody who has not heard it: the other links' groups, those at the other ends of a
    /// link that has no group, and configured peers that groups do not reach.
    fn everywhere_but(&self, from: Path, frame: &Frame) -> Result<Vec<Transmit>, Counter> {
        let version = Version::As5669a;
        let to = |path: Path| self.hop(path.link, To::Peer(path.peer), version, frame);
        let links = self.links.keys().filter(|&&link| link != from.link);
        let mut hops: Vec<_> = links
            .map(|&link| self.hop(link, To::Group, version, frame))
            .collect::<Result<_, _>>()?;
        let mut singly = self.peers.broadcast_copies(frame.destination);
        if self.framing(from.link) == Framing::Jtcp {
            singly.extend(self.peers.paths_on(from.link));
        }
        singly.sort_unstable();
        singly.dedup();
        for path in singly.into_iter().filter(|&path| path != from) {
            hops.push(to(path)?);
        }
        Ok(hops)
    }

    fn hop(
        &self,
        link: LinkId,
        to: To,
        version: Version,
        frame: &Frame,
    ) -> Result<Transmit, Counter> {
        let frame = with_header(frame, version).ok_or(Counter::CannotForward)?;
        let payload = self
            .framing(link)
            .encode(&frame)
            .map_err(|_| Counter::CannotForward)?;
        Ok(Transmit {
            link,
            to,
            priority: frame.flags.priority(),
            payload,
            segment: None,
        })
    }
}

/// The frame with another header. The older headers name the message code in every fragment and in
/// acknowledgements, today's only where the message begins; so the code of a later fragment cannot
/// be told, and there is no older header for it.
fn with_header(frame: &Frame, version: Version) -> Option<Frame> {
    let names_code = |version| version != Version::As5669a;
    let answer = frame.flags.acknowledgement().is_answer();
    let later = matches!(frame.flags.data(), DataControl::Middle | DataControl::Last);
    let payload = match (names_code(frame.version), names_code(version)) {
        (true, false) if answer || later => {
            let code_len = ra::CODE_LEN.min(frame.payload.len());
            frame.payload.slice(code_len..)
        }
        (false, true) if answer => Bytes::from_static(&[0; ra::CODE_LEN]),
        (false, true) if later => return None,
        _ => frame.payload.clone(),
    };
    Some(Frame {
        version,
        payload,
        ..frame.clone()
    })
}
