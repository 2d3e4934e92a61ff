//! Duplicate detection: a message that is retransmitted, routed, or sent on several paths is shown
//! once.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, VecDeque};
use std::hash::{BuildHasher, RandomState};
use std::time::Duration;

use crate::time::Timestamp;
use jaus::wire::{Acknowledgement, Frame, Version};

/// Number of messages remembered.
const MOST: usize = 8192;
/// Detection window for numbered messages: how long peers retransmit without an acknowledgement.
const REPEATS: Duration = Duration::from_millis(3500);
/// Detection window for unnumbered messages: copies arrive almost simultaneously, later ones are
/// new messages.
const COPIES: Duration = Duration::from_millis(20);

/// Fingerprints of messages with the time of their first occurrence.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    keys: RandomState,
    times: HashMap<u64, Duration>,
    order: VecDeque<u64>,
}

impl Seen {
    /// Whether this is a duplicate of a recent message. Otherwise remembers it.
    pub(super) fn is_copy(&mut self, time: Timestamp, frame: &Frame) -> bool {
        let acknowledged = frame.flags.acknowledgement() != Acknowledgement::None;
        let numbered = frame.sequence != 0 && (frame.version == Version::As5669a || acknowledged);
        let window = if numbered { REPEATS } else { COPIES };
        let number = numbered.then_some(frame.sequence);
        let key = self.key(
            frame,
            number.map(|number| (number, frame.flags.data().name())),
        );
        self.is_known(time, key, window)
    }

    /// The same for a message to many destinations, which passes within the node without a sequence
    /// number and also goes out on the links.
    pub(super) fn is_copy_for_many(&mut self, time: Timestamp, frame: &Frame) -> bool {
        let key = self.key(frame, None);
        self.is_known(time, key, COPIES)
    }

    fn key(&self, frame: &Frame, number: Option<(u16, &str)>) -> u64 {
        self.keys
            .hash_one((frame.source, frame.destination, number, &frame.payload))
    }

    fn is_known(&mut self, time: Timestamp, key: u64, window: Duration) -> bool {
        let time = Duration::new(time.seconds().max(0) as u64, time.subsec_nanos());
        match self.times.entry(key) {
            Entry::Occupied(mut known) => {
                // After the clock is set back, old entries do not match forever.
                let is_copy = time.abs_diff(*known.get()) < window;
                if !is_copy {
                    known.insert(time);
                }
                return is_copy;
            }
            Entry::Vacant(free) => free.insert(time),
        };
        self.order.push_back(key);
        if self.order.len() > MOST
            && let Some(oldest) = self.order.pop_front()
        {
            self.times.remove(&oldest);
        }
        false
    }
}
