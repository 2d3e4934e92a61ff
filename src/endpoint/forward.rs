//! Forwards messages for other nodes between links. `docs/routing.md` explains the rules, with
//! pictures.
//!
//! AS5669A has neither a hop count nor routes. A router therefore learns addresses from all
//! traffic, remembers on which path it saw each message, and forwards a message twice only if its
//! sender retransmitted it. Flags, ids and sequence number stay unchanged: acknowledgements are end
//! to end.

use std::time::{Duration, Instant};

use bytes::Bytes;
use tracing::trace;

use super::arrival::Arrival;
use super::egress::Hop;
use super::{Counter, Endpoint, Path, Peer, Rate, To};
use crate::address::JausId;
use crate::wire::{Broadcast, DataControl, Frame, Version, ra};

/// How long after a peer was heard on one path its broadcasts from another path count as late
/// copies.
const SETTLED: Duration = Duration::from_secs(1);

/// Whether and how much a node forwards between its links. By default it does not, even with
/// several links: joining two networks is a deliberate decision.
///
/// ```toml
/// [routing]
/// forward = true
/// broadcasts = { per_second = 500, burst = 1000 }
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct Routing {
    /// Whether to forward messages for other nodes.
    pub forward: bool,
    /// The total rate of forwarded messages with many receivers or an unknown destination.
    pub broadcasts: Rate,
}

impl Default for Routing {
    fn default() -> Self {
        Self {
            forward: false,
            broadcasts: Rate::new(500, 1000),
        }
    }
}

impl Endpoint {
    /// Whether a message is also for other nodes, and forwarding is on.
    pub(super) fn is_passed_on(&self, frame: &Frame) -> bool {
        let destination = frame.destination;
        let is_elsewhere = !destination.has_zero() && !self.components.contains(&destination);
        self.config.routing.forward && is_elsewhere
    }

    /// Whether a broadcast, or a message to an unknown address, arrived on another path than the
    /// one on which its sender was heard a moment ago. It is neither forwarded nor learned from.
    pub(super) fn is_astray(&self, arrival: Arrival<'_>) -> bool {
        let (frame, now, from) = (arrival.frame, arrival.now, arrival.path);
        let for_many = frame.destination.has_wildcard()
            || frame.flags.broadcast() != Some(Broadcast::None)
            || self.route(frame.destination).is_none();
        let is_settled = |at: Instant| now.saturating_duration_since(at) < SETTLED;
        let is_elsewhere = |peer: &Peer| peer.path != from && is_settled(peer.last_heard);
        let sender = self.peers.get(frame.source);
        for_many && sender.is_some_and(|state| is_elsewhere(&state.peer))
    }

    /// Forwards a message towards its receivers, unless they are where it came from; returns whether it was
    /// forwarded.
    pub(super) fn pass_on(&mut self, arrival: Arrival<'_>) -> bool {
        let (source, destination) = (arrival.frame.source, arrival.frame.destination);
        let passed = self.next_hops(arrival).and_then(|(hops, version)| {
            let frame = with_header(arrival.frame, version).ok_or(Counter::CannotForward)?;
            self.egress
                .push_to_many(arrival.now, &hops, &frame, &mut self.counters)
                .map_err(|_| Counter::CannotForward)
        });
        let outcome = passed.err().unwrap_or(Counter::MessagesForwarded);
        trace!(%source, %destination, %outcome, "passing on");
        self.counters.add(outcome);
        passed.is_ok()
    }

    /// The next hops of a message, and the header to use.
    fn next_hops(&mut self, arrival: Arrival<'_>) -> Result<(Vec<Hop>, Version), Counter> {
        let (frame, now, from) = (arrival.frame, arrival.now, arrival.path);
        let destination = frame.destination;
        if destination.is_unicast() {
            self.config.access.check_subsystem(destination)?;
            if let Some((path, version)) = self.route(destination) {
                // Multicast has already reached every node on that network.
                let shared = from.link == path.link
                    && self.egress.is_datagram(from)
                    && frame.flags.broadcast() != Some(Broadcast::None);
                return if path == from || shared {
                    Err(Counter::NotForUs)
                } else {
                    Ok((vec![path.into()], version))
                };
            }
            // The destination of an acknowledgement has been heard before, so there is no need to
            // search for it.
            if frame.flags.acknowledgement().is_answer() {
                return Err(Counter::NotForUs);
            }
        }
        let hops = self.hops_everywhere_but(from, destination);
        if hops.is_empty() {
            return Err(Counter::NotForUs);
        }
        let rate = self.config.routing.broadcasts;
        if self.broadcasts.take(now, rate, 1).is_err() {
            return Err(Counter::ForwardRate);
        }
        Ok((hops, Version::As5669a))
    }

    /// Every hop that has not seen a message: the groups of other links, the remote ends of a link
    /// without a group, and static peers that groups do not reach.
    fn hops_everywhere_but(&self, from: Path, destination: JausId) -> Vec<Hop> {
        let mut singly = self.peers.broadcast_copies(destination);
        if !self.egress.is_datagram(from) {
            singly.extend(self.peers.paths_on(from.link));
        }
        singly.sort_unstable();
        singly.dedup();
        let others = self.egress.links.keys().filter(|&&link| link != from.link);
        let groups = others.map(|&link| (link, To::Group));
        let singly = singly.into_iter().filter(|&path| path != from);
        groups.chain(singly.map(Hop::from)).collect()
    }
}

/// Translates a frame to another header. A later fragment without the message code cannot be
/// translated to a header that repeats it.
fn with_header(frame: &Frame, version: Version) -> Option<Frame> {
    let answer = frame.flags.acknowledgement().is_answer();
    let later = matches!(frame.flags.data(), DataControl::Middle | DataControl::Last);
    let [from, to] = [frame.version, version].map(Version::repeated_code_len);
    let payload = match (from, to) {
        (1.., 0) if answer || later => frame.payload.slice(frame.repeated_code_len()..),
        (0, 1..) if answer => Bytes::from_static(&[0; ra::CODE_LEN]),
        (0, 1..) if later => return None,
        _ => frame.payload.clone(),
    };
    Some(Frame {
        version,
        payload,
        ..frame.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{Acknowledgement, Flags};

    const CODE: &[u8] = b"\x00\x2B";
    const WHOLE: &[u8] = b"\x00\x2B\x02";
    const REST: &[u8] = b"\x02";

    #[test]
    fn another_header_gets_the_code_where_it_has_one() {
        use DataControl::{First, Last, Middle, Single};
        use Version::{As5669, As5669a, Ra};
        let message = |data| Flags::default().with_data(data);
        let answer = Flags::default().with_acknowledgement(Acknowledgement::Positive);
        for (from, flags, payload, to, expected) in [
            (As5669, message(Single), WHOLE, As5669a, Some(WHOLE)),
            (As5669, message(First), WHOLE, As5669a, Some(WHOLE)),
            (As5669, message(Middle), WHOLE, As5669a, Some(REST)),
            (Ra, message(Last), WHOLE, As5669a, Some(REST)),
            (Ra, answer, CODE, As5669a, Some(&[][..])),
            (As5669a, message(Single), WHOLE, Ra, Some(WHOLE)),
            (As5669a, message(First), WHOLE, As5669, Some(WHOLE)),
            (As5669a, message(Middle), REST, Ra, None),
            (As5669a, message(Last), REST, As5669, None),
            (As5669a, answer, &[], Ra, Some(&[0, 0][..])),
            (As5669a, message(Last), REST, As5669a, Some(REST)),
            (As5669, message(Last), WHOLE, Ra, Some(WHOLE)),
            (As5669, answer, CODE, Ra, Some(CODE)),
        ] {
            let (source, destination) = (JausId::new(1, 1, 1), JausId::new(2, 1, 1));
            let frame = Frame {
                version: from,
                flags,
                sequence: 7,
                ..Frame::new(source, destination, Bytes::from_static(payload))
            };
            let translated = expected.map(|payload| Frame {
                version: to,
                payload: Bytes::from_static(payload),
                ..frame.clone()
            });
            assert_eq!(with_header(&frame, to), translated, "{flags:?} {from} {to}");
        }
    }
}
