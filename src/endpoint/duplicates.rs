//! Whether a message is new, repeated by its sender, or a copy that the network has made.

use std::time::Duration;

use super::Endpoint;
use super::large::Whole;
use super::receive::Arrival;
use super::recent::{Class, Fingerprint, Sighting};
use crate::address::JausId;
use crate::peer;
use crate::wire::{Acknowledgement, Broadcast, DataControl, Frame, Version};

/// The same message again within this time is a copy made on the way: nobody repeats so fast.
const REPEAT_INTERVAL: Duration = Duration::from_millis(1);

/// Result of the duplicate check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Novelty {
    /// Not heard lately.
    New,
    /// Its sender has sent it again; how often so far.
    Repeated(u8),
    /// The network has made a copy, or brought it in a circle.
    Copy,
}

impl Novelty {
    const fn repetitions(self) -> u8 {
        match self {
            Self::Repeated(repetitions) => repetitions,
            Self::New | Self::Copy => 0,
        }
    }
}

impl Endpoint {
    /// How a message stands to what was heard lately.
    ///
    /// The older headers' peers leave the sequence number at 0, so there only a message that wants
    /// an acknowledgement, and hence may be repeated, can be told from another.
    pub(super) fn recall(&mut self, arrival: Arrival, frame: &Frame, seen: Fingerprint) -> Novelty {
        let now = arrival.now;
        let forwarding = self.config.forwarding;
        let repeats = frame.flags.acknowledgement() != Acknowledgement::None;
        let numbered = repeats || frame.version == Version::As5669a;
        if !numbered && !forwarding {
            return Novelty::New;
        }
        let seen = seen.in_round(self.peers.round(frame));
        let way = self.heard.way(forwarding.then_some(arrival.path));
        let novelty = match self.heard.sighting(seen) {
            None => Novelty::New,
            Some(before) => {
                let age = now.saturating_duration_since(before.time);
                let elsewhere = before.way != way;
                if elsewhere && age < self.config.retransmission_window {
                    Novelty::Copy
                } else if numbered && age < self.duplicate_window(arrival, frame) {
                    if repeats && age >= REPEAT_INTERVAL {
                        Novelty::Repeated(before.repetitions.saturating_add(1))
                    } else {
                        Novelty::Copy
                    }
                } else {
                    Novelty::New
                }
            }
        };
        if novelty != Novelty::Copy {
            let sighting = Sighting {
                time: now,
                way,
                repetitions: novelty.repetitions(),
            };
            self.heard.insert_as(seen, sighting, self.class(frame));
        }
        novelty
    }

    /// Has the first fragment of a message that is whole now remembered from now on: it may have come
    /// long before `last`, and must not begin the message again when it is repeated.
    pub(super) fn recall_beginning(&mut self, arrival: Arrival, last: &Frame, whole: &Whole) {
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
                time: arrival.now,
                ..before
            };
            self.heard.insert_as(seen, sighting, self.class(&first));
        }
    }

    fn class(&self, frame: &Frame) -> Class {
        Class {
            stranger: self.peers.is_stranger(frame.source),
            repeats: frame.flags.acknowledgement() != Acknowledgement::None,
        }
    }

    /// For how long the same message is taken for a duplicate.
    fn duplicate_window(&self, arrival: Arrival, frame: &Frame) -> Duration {
        if frame.flags.acknowledgement() == Acknowledgement::None {
            return self.config.duplicate_window;
        }
        let is_call = frame.flags.broadcast() != Some(Broadcast::None);
        let is_unmarked_call = arrival.to_all && peer::Recogniser::is_unmarked_call(frame);
        if is_call || is_unmarked_call || self.repeats_soon(frame.source) {
            self.config.first_contact_window
        } else {
            self.config.retransmission_window
        }
    }

    fn repeats_soon(&self, source: JausId) -> bool {
        self.peers.profile(source).repeats_soon()
    }
}
