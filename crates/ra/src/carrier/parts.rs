//! Fragments large messages for transmission and reassembles them on reception.
//!
//! The parts of a message have the same source, destination and code; they are numbered from 0 and
//! flagged first, normal (or retransmitted) and last. OpenJAUS numbers each large message from 0
//! again, so nothing else separates two messages of one code: a first part therefore always starts
//! a new message, and a part that differs from an earlier one of the same number discards the
//! message.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use bytes::{Bytes, BytesMut};

use super::Settings;
use crate::RaId;
use crate::counters::{Counter, Counters};
use jaus::wire::ra::MAX_DATA;

/// Bookkeeping cost of a part, in octets.
const PART_COST: usize = 64;
/// Bookkeeping cost of an incomplete message, in octets.
const MESSAGE_COST: usize = 256;

/// Position of a part in its message, from its data flag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// The whole message.
    Single,
    /// The first part.
    First,
    /// A later part, possibly retransmitted.
    Middle,
    /// The last part.
    Last,
}

impl Place {
    /// Decodes a data flag.
    pub(super) const fn from_flag(flag: u8) -> Option<Self> {
        match flag {
            0 => Some(Self::Single),
            1 => Some(Self::First),
            2 | 4 => Some(Self::Middle),
            8 => Some(Self::Last),
            _ => None,
        }
    }

    /// The corresponding data flag.
    pub(super) const fn flag(self) -> u8 {
        match self {
            Self::Single => 0,
            Self::First => 1,
            Self::Middle => 2,
            Self::Last => 8,
        }
    }
}

/// Splits data into parts with positions and numbers. Data that fits one packet stays whole.
pub(super) fn cut(data: &[u8]) -> impl Iterator<Item = (Place, u16, &[u8])> {
    let last = data.len().div_ceil(MAX_DATA).saturating_sub(1);
    let whole = data.is_empty().then_some(data);
    let parts = whole.into_iter().chain(data.chunks(MAX_DATA));
    parts.enumerate().map(move |(number, part)| {
        let place = match number {
            _ if last == 0 => Place::Single,
            0 => Place::First,
            _ if number == last => Place::Last,
            _ => Place::Middle,
        };
        (place, number as u16, part)
    })
}

/// Common key of a message's parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key {
    pub(super) source: RaId,
    pub(super) destination: RaId,
    pub(super) code: u16,
}

/// An incomplete message.
#[derive(Debug)]
struct Unfinished {
    /// Parts by number, relative to the first.
    parts: BTreeMap<u16, Bytes>,
    first: u16,
    last: Option<u16>,
    octets: usize,
    /// Arrival of the latest part.
    updated: Instant,
}

impl Unfinished {
    fn begin(now: Instant, first: u16) -> Self {
        Self {
            parts: BTreeMap::new(),
            first,
            last: None,
            octets: 0,
            updated: now,
        }
    }

    /// Adds a part.
    ///
    /// # Errors
    /// A part that contradicts earlier ones.
    fn add(&mut self, place: Place, number: u16, data: Bytes) -> Result<(), Counter> {
        let index = number.wrapping_sub(self.first);
        let last = match place {
            Place::Last => Some(index),
            _ => self.last,
        };
        let highest = self.parts.keys().next_back().copied().unwrap_or(0);
        let ends_elsewhere = last.is_some_and(|last| index.max(highest) > last);
        if ends_elsewhere || (self.last.is_some() && self.last != last) {
            return Err(Counter::PartOutOfOrder);
        }
        self.last = last;
        match self.parts.get(&index) {
            Some(known) if *known == data => {}
            Some(_) => return Err(Counter::PartOutOfOrder),
            None => {
                self.octets += data.len();
                self.parts.insert(index, data);
            }
        }
        Ok(())
    }

    fn cost(&self) -> usize {
        MESSAGE_COST + self.parts.len() * PART_COST + self.octets
    }

    fn is_whole(&self) -> bool {
        let parts = self.parts.len();
        self.last.is_some_and(|last| parts == usize::from(last) + 1)
    }

    fn join(self) -> Bytes {
        let mut whole = BytesMut::with_capacity(self.octets);
        for part in self.parts.values() {
            whole.extend_from_slice(part);
        }
        whole.freeze()
    }
}

/// The incomplete messages of one subsystem.
#[derive(Debug, Default)]
struct Sender {
    messages: BTreeMap<Key, Unfinished>,
    cost: usize,
}

impl Sender {
    fn take(&mut self, key: Key) -> Option<Unfinished> {
        let message = self.messages.remove(&key)?;
        self.cost -= message.cost();
        Some(message)
    }

    fn put(&mut self, key: Key, message: Unfinished) {
        self.cost += message.cost();
        self.messages.insert(key, message);
    }

    fn oldest(&self) -> Option<(Instant, Key)> {
        let times = self.messages.iter();
        times.map(|(&key, message)| (message.updated, key)).min()
    }
}

/// The incomplete messages of all subsystems.
#[derive(Debug)]
pub(super) struct Parts {
    senders: BTreeMap<u8, Sender>,
    cost: usize,
    max_message: usize,
    max_sender: usize,
    max: usize,
    timeout: Duration,
    /// No message expires before this time.
    next: Option<Instant>,
}

impl Parts {
    /// Maximum number of incomplete messages per subsystem.
    const MAX_MESSAGES: usize = 64;

    pub(super) fn new(settings: &Settings) -> Self {
        Self {
            senders: BTreeMap::new(),
            cost: 0,
            max_message: settings.max_message,
            max_sender: settings.max_parts_per_subsystem,
            max: settings.max_parts,
            timeout: settings.part_timeout,
            next: None,
        }
    }

    /// Stored octets, including bookkeeping.
    pub(super) fn cost(&self) -> usize {
        self.cost
    }

    /// Adds a part; returns the data if the message is complete.
    ///
    /// # Errors
    /// The counter of the drop, if the part and its message are discarded.
    pub(super) fn insert(
        &mut self,
        now: Instant,
        key: Key,
        (place, number, data): (Place, u16, Bytes),
        counters: &mut Counters,
    ) -> Result<Option<Bytes>, Counter> {
        if place == Place::Single {
            return Ok(Some(data));
        }
        let known = self.take(key);
        let mut message = match place {
            Place::First => {
                if known.is_some() {
                    counters.add(Counter::PartOutOfOrder);
                }
                Unfinished::begin(now, number)
            }
            _ => known.ok_or(Counter::PartOutOfOrder)?,
        };
        message.add(place, number, data)?;
        if message.octets > self.max_message {
            return Err(Counter::MessageTooLong);
        }
        if message.is_whole() {
            return Ok(Some(message.join()));
        }
        message.updated = now;
        self.put(key, message);
        self.keep_within_bounds(key.source.subsystem, counters);
        self.next.get_or_insert(now + self.timeout);
        Ok(None)
    }

    fn take(&mut self, key: Key) -> Option<Unfinished> {
        let sender = self.senders.get_mut(&key.source.subsystem)?;
        let message = sender.take(key)?;
        if sender.messages.is_empty() {
            self.senders.remove(&key.source.subsystem);
        }
        self.cost -= message.cost();
        Some(message)
    }

    fn put(&mut self, key: Key, message: Unfinished) {
        self.cost += message.cost();
        let sender = self.senders.entry(key.source.subsystem).or_default();
        sender.put(key, message);
    }

    /// Enforces the limits: discards the oldest messages of this subsystem, then of the one that
    /// uses most. A flooding sender thus loses its own messages.
    fn keep_within_bounds(&mut self, subsystem: u8, counters: &mut Counters) {
        while let Some(sender) = self.senders.get(&subsystem)
            && (sender.cost > self.max_sender || sender.messages.len() > Self::MAX_MESSAGES)
        {
            self.forget_oldest(subsystem, counters);
        }
        while self.cost > self.max {
            let most = self.senders.iter().max_by_key(|(_, sender)| sender.cost);
            let Some((&subsystem, _)) = most else { return };
            self.forget_oldest(subsystem, counters);
        }
    }

    fn forget_oldest(&mut self, subsystem: u8, counters: &mut Counters) {
        let oldest = self.senders.get(&subsystem).and_then(Sender::oldest);
        if let Some((_, key)) = oldest {
            self.take(key);
            counters.add(Counter::PartsForgotten);
        }
    }

    /// Discards messages after the part timeout.
    pub(super) fn expire(&mut self, now: Instant, counters: &mut Counters) {
        if self.next.is_none_or(|next| next > now) {
            return;
        }
        let messages = self.senders.values().flat_map(|sender| &sender.messages);
        let late = messages.filter(|(_, message)| message.updated + self.timeout <= now);
        let late: Vec<_> = late.map(|(&key, _)| key).collect();
        for key in late {
            self.take(key);
            counters.add(Counter::PartsTimedOut);
        }
        let left = self.senders.values().filter_map(Sender::oldest).min();
        self.next = left.map(|(updated, _)| updated + self.timeout);
    }

    /// When to call [`expire`](Self::expire).
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.next
    }
}
