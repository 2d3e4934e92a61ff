//! What was shown a moment ago: a message that is repeated, passed on, or sent by several ways is
//! shown once.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, VecDeque};
use std::hash::{BuildHasher, RandomState};
use std::time::Duration;

use crate::Timestamp;
use jaus::wire::{Acknowledgement, Frame, Version};

/// Messages remembered.
const MOST: usize = 8192;
/// As long as peers repeat what was not acknowledged.
const REPEATS: Duration = Duration::from_millis(3500);
/// Copies of what has no number of its own come at once, or are another message.
const COPIES: Duration = Duration::from_millis(20);

/// Fingerprints of messages and when they were seen first.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    keys: RandomState,
    times: HashMap<u64, Duration>,
    order: VecDeque<u64>,
}

impl Seen {
    /// Whether this is a copy of something seen lately; remembers it, if not.
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

    /// The same for a message to many that passes within a node without a number, and goes to the
    /// links as well.
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
                // A clock that was set back makes nothing a copy for ever.
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
