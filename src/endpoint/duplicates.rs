//! Duplicate detection: a message is new, retransmitted by its sender, or a copy made by the
//! network.

use std::time::Duration;

use super::Endpoint;
use super::arrival::Arrival;
use super::large::Whole;
use super::recent::{Class, Fingerprint, Sighting};
use crate::peer;
use crate::wire::{Acknowledgement, Broadcast, DataControl, Frame, Version};

/// A repetition within this time is a copy made on the way: no sender retransmits that fast.
const REPEAT_INTERVAL: Duration = Duration::from_millis(1);
/// The interval before a repetition that is forwarded doubles this often, to 1.275 s.
const MOST_DOUBLINGS: u8 = 8;

/// How long after the last forwarded repetition the next one is forwarded: 0, 5, 15, 35 ms and so
/// on.
///
/// A sender backs off from 10 ms or more; Junior repeats three times at 100 ms. A frame that
/// circulates between routers, because it was corrupted or forged as if one of them had sent it,
/// comes back at a constant interval. It must be dropped soon: each round may corrupt it into
/// another that circulates too.
fn forwarding_interval(forwarded: u8) -> Duration {
    Duration::from_millis(5) * ((1 << forwarded.min(MOST_DOUBLINGS)) - 1)
}

/// Result of the duplicate check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Novelty {
    /// Not seen recently.
    New,
    /// Retransmitted by its sender.
    Repeated {
        /// Whether it may be forwarded, because it comes long enough after those before.
        forwardable: bool,
    },
    /// A copy made by the network, or sent round a loop.
    Copy,
}

impl Endpoint {
    /// Whether a message that requests an acknowledgement was received before: it needs no room.
    pub(super) fn is_repeat(&self, arrival: Arrival<'_>, seen: Fingerprint) -> bool {
        let seen = seen.in_round(self.peers.round(arrival.frame));
        let window = self.duplicate_window(arrival);
        self.heard.contains(arrival.now, seen, window)
    }

    /// Runs the duplicate check and records the message.
    ///
    /// Peers with the older headers leave the sequence number at 0, so equal messages look alike.
    /// Without an acknowledgement request such a message counts as a copy only if this endpoint
    /// forwards and the message arrives on another path.
    pub(super) fn recall(&mut self, arrival: Arrival<'_>, seen: Fingerprint) -> Novelty {
        let Arrival { frame, now, .. } = arrival;
        let forwarding = self.config.routing.forward;
        let repeats = frame.flags.acknowledgement() != Acknowledgement::None;
        let numbered = repeats || frame.version == Version::As5669a;
        if !numbered && !forwarding {
            return Novelty::New;
        }
        let seen = seen.in_round(self.peers.round(frame));
        let way = self.heard.way(forwarding.then_some(arrival.path));
        let mut sighting = Sighting::new(now, way);
        let mut novelty = Novelty::New;
        if let Some(before) = self.heard.sighting(seen) {
            let age = now.saturating_duration_since(before.time);
            let elsewhere = before.way != way;
            if elsewhere && age < self.config.retransmission_window {
                return Novelty::Copy;
            }
            if numbered && age < self.duplicate_window(arrival) {
                if !repeats || age < REPEAT_INTERVAL {
                    return Novelty::Copy;
                }
                let since = now.saturating_duration_since(before.forwarded);
                let forwardable = since >= forwarding_interval(before.repetitions);
                sighting = Sighting {
                    time: now,
                    ..before
                };
                if forwardable {
                    sighting.forwarded = now;
                    sighting.repetitions = before.repetitions.saturating_add(1);
                }
                novelty = Novelty::Repeated { forwardable };
            }
        }
        self.heard.insert(seen, sighting, self.class(frame));
        novelty
    }

    /// Refreshes the record of the first fragment of a message that is now complete. It may have
    /// arrived long before `last`, and a retransmission of it must not begin the message again.
    pub(super) fn recall_beginning(&mut self, last: Arrival<'_>, whole: &Whole) {
        let Arrival {
            frame: last, now, ..
        } = last;
        let first = Frame {
            sequence: whole.first.0,
            flags: last.flags.with_data(DataControl::First),
            payload: whole.first.1.clone(),
            ..last.clone()
        };
        let seen = self.heard.fingerprint(&first);
        let seen = seen.in_round(self.peers.round(&first));
        if let Some(before) = self.heard.sighting(seen) {
            let sighting = Sighting {
                time: now,
                ..before
            };
            self.heard.insert(seen, sighting, self.class(&first));
        }
    }

    fn class(&self, frame: &Frame) -> Class {
        Class {
            stranger: self.peers.is_stranger(frame.source),
            repeats: frame.flags.acknowledgement() != Acknowledgement::None,
        }
    }

    /// How long a repetition of the message counts as a duplicate.
    fn duplicate_window(&self, arrival: Arrival<'_>) -> Duration {
        let frame = arrival.frame;
        if frame.flags.acknowledgement() == Acknowledgement::None {
            return self.config.duplicate_window;
        }
        let is_call = frame.flags.broadcast() != Some(Broadcast::None);
        let is_unmarked_call = arrival.to_all && peer::Recogniser::is_unmarked_call(frame);
        let repeats_soon = || self.peers.profile(frame.source).repeats_soon();
        if is_call || is_unmarked_call || repeats_soon() {
            self.config.first_contact_window
        } else {
            self.config.retransmission_window
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_between_forwarded_repetitions_doubles_up_to_a_limit() {
        let intervals = [0, 1, 2, 3, 8, 9, 255].map(forwarding_interval);
        let expected = [0, 5, 15, 35, 1275, 1275, 1275].map(Duration::from_millis);
        assert_eq!(intervals, expected);
    }
}
