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

use super::egress::Hop;
use super::{Counter, Endpoint, Path, To};
use crate::address::JausId;
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
        let passed = self
            .next_hops(now, from, frame)
            .and_then(|(hops, version)| {
                let frame = with_header(frame, version).ok_or(Counter::CannotForward)?;
                self.send_to_hops(now, &hops, &frame)
                    .map_err(|_| Counter::CannotForward)
            });
        let outcome = passed.err().unwrap_or(Counter::MessagesForwarded);
        trace!(%source, %destination, %outcome, "passing on");
        self.counters.add(outcome);
    }

    /// Where a message goes on to, and with which header.
    fn next_hops(
        &mut self,
        now: Instant,
        from: Path,
        frame: &Frame,
    ) -> Result<(Vec<Hop>, Version), Counter> {
        let destination = frame.destination;
        if destination.is_unicast() {
            self.config.access.check_source(destination)?;
            if let Some((path, version)) = self.route(destination) {
                // A multicast reaches every node on its network.
                let shared = from.link == path.link
                    && self.framing(from.link) == Framing::Judp
                    && frame.flags.broadcast() != Some(Broadcast::None);
                return if path == from || shared {
                    Err(Counter::NotForUs)
                } else {
                    Ok((vec![path.into()], version))
                };
            }
            // Whoever asked for an acknowledgement has been heard: nobody is to be found.
            if frame.flags.acknowledgement().is_answer() {
                return Err(Counter::NotForUs);
            }
        }
        let hops = self.hops_everywhere_but(from, destination);
        if hops.is_empty() {
            return Err(Counter::NotForUs);
        }
        if !self.broadcasts.take(now, self.config.forwarded_broadcasts) {
            return Err(Counter::ForwardRate);
        }
        Ok((hops, Version::As5669a))
    }

    /// Everybody who has not heard a message: the other links' groups, those at the other ends of a
    /// link that has no group, and configured peers that groups do not reach.
    fn hops_everywhere_but(&self, from: Path, destination: JausId) -> Vec<Hop> {
        let mut singly = self.peers.broadcast_copies(destination);
        if self.framing(from.link) == Framing::Jtcp {
            singly.extend(self.peers.paths_on(from.link));
        }
        singly.sort_unstable();
        singly.dedup();
        let links = self.egress.links().map(|(link, _)| link);
        let groups = links.filter(|&link| link != from.link);
        let groups = groups.map(|link| (link, To::Group));
        let singly = singly.into_iter().filter(|&path| path != from);
        groups.chain(singly.map(Hop::from)).collect()
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
