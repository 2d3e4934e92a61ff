//! Acknowledgements: answering requests, and waiting for answers to ours.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use tracing::debug;

use super::{Config, Counter, Endpoint, Event, Path, To, Transmit};
use crate::address::JausId;
use crate::wire::{Acknowledgement, Broadcast, DataControl, Frame, Kind, Version, ra};

/// Names a sent message in the events about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MessageHandle(pub(crate) u64);

/// What an answer repeats: our component, the peer and the sequence number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    source: JausId,
    destination: JausId,
    sequence: u16,
}

impl Key {
    fn of(frame: &Frame) -> Self {
        Self {
            source: frame.source,
            destination: frame.destination,
            sequence: frame.sequence,
        }
    }
}

#[derive(Debug)]
struct Waiting {
    message: MessageHandle,
    frame: Frame,
    deadline: Instant,
    retries_left: u32,
}

/// The messages that wait for an acknowledgement.
#[derive(Debug)]
pub(super) struct Acknowledgements {
    waiting: BTreeMap<Key, Waiting>,
    deadlines: BTreeSet<(Instant, Key)>,
    sent: u64,
    limit: usize,
    timeout: Duration,
    retries: u32,
}

impl Acknowledgements {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            waiting: BTreeMap::new(),
            deadlines: BTreeSet::new(),
            sent: 0,
            limit: config.max_unacknowledged,
            timeout: config.acknowledge_timeout,
            retries: config.acknowledge_retries,
        }
    }

    /// A handle for the next message.
    pub(super) fn next_handle(&mut self) -> MessageHandle {
        self.sent += 1;
        MessageHandle(self.sent)
    }

    pub(super) fn has_room(&self, count: usize) -> bool {
        self.waiting.len() + count <= self.limit
    }

    /// Waits for the acknowledgement of a frame that is being sent.
    pub(super) fn expect(&mut self, now: Instant, message: MessageHandle, frame: Frame) {
        let waiting = Waiting {
            message,
            frame,
            deadline: now + self.timeout,
            retries_left: self.retries,
        };
        self.insert(waiting);
    }

    fn insert(&mut self, waiting: Waiting) {
        let key = Key::of(&waiting.frame);
        self.take(key);
        self.deadlines.insert((waiting.deadline, key));
        self.waiting.insert(key, waiting);
    }

    fn take(&mut self, key: Key) -> Option<Waiting> {
        let waiting = self.waiting.remove(&key)?;
        self.deadlines.remove(&(waiting.deadline, key));
        Some(waiting)
    }

    fn take_due(&mut self, now: Instant) -> Option<Waiting> {
        let &(deadline, key) = self.deadlines.first()?;
        if deadline > now { None } else { self.take(key) }
    }

    pub(super) fn next_deadline(&self) -> Option<Instant> {
        self.deadlines.first().map(|&(deadline, _)| deadline)
    }

    fn is_waiting(&self, message: MessageHandle) -> bool {
        self.waiting
            .values()
            .any(|waiting| waiting.message == message)
    }

    /// Stops waiting for a message and all its fragments.
    fn forget(&mut self, message: MessageHandle) {
        self.waiting.retain(|_, waiting| waiting.message != message);
        self.deadlines
            .retain(|(_, key)| self.waiting.contains_key(key));
    }

    pub(super) fn forget_source(&mut self, source: JausId) {
        self.waiting.retain(|key, _| key.source != source);
        self.deadlines.retain(|(_, key)| key.source != source);
    }
}

impl Endpoint {
    /// Answers a message that wants an acknowledgement, and does so for each copy: the peer repeats
    /// it because an answer got lost. A broadcast to many is not acknowledged, or all would answer
    /// at once.
    pub(super) fn acknowledge(&mut self, from: Path, request: &Frame) {
        if !request.destination.is_unicast() {
            return;
        }
        // The older headers' answers repeat the message code.
        let code_len = match request.version {
            Version::As5669a => 0,
            Version::As5669 | Version::Ra => ra::CODE_LEN,
        };
        let answer = Frame {
            version: request.version,
            kind: Kind::default(),
            flags: request
                .flags
                .with_acknowledgement(Acknowledgement::Positive)
                .with_broadcast(Broadcast::None)
                .with_data(DataControl::Single),
            destination: request.source,
            source: request.destination,
            sequence: request.sequence,
            payload: request.payload.slice(..code_len.min(request.payload.len())),
        };
        let Ok(payload) = self.framing(from.link).encode(&answer) else {
            return;
        };
        let transmit = Transmit {
            link: from.link,
            to: To::Peer(from.peer),
            priority: request.flags.priority(),
            payload,
            segment: None,
        };
        if self.transmit(transmit) {
            self.counters.add(Counter::AcknowledgementsSent);
        }
    }

    /// Takes the answer to a message of ours.
    pub(super) fn receive_answer(&mut self, frame: &Frame) -> Result<(), Counter> {
        let key = Key {
            source: frame.destination,
            destination: frame.source,
            sequence: frame.sequence,
        };
        let waiting = self
            .acknowledgements
            .take(key)
            .ok_or(Counter::UnawaitedAcknowledgement)?;
        let message = waiting.message;
        if frame.flags.acknowledgement() == Acknowledgement::Negative {
            self.give_up(message, frame.source, true);
        } else if !self.acknowledgements.is_waiting(message) {
            self.announce(Event::Acknowledged {
                message,
                by: frame.source,
            });
        }
        Ok(())
    }

    fn give_up(&mut self, message: MessageHandle, destination: JausId, refused: bool) {
        self.acknowledgements.forget(message);
        self.announce(Event::NotAcknowledged {
            message,
            destination,
            refused,
        });
    }

    /// Sends again what was not acknowledged in time, or gives up.
    pub(super) fn retry_unacknowledged(&mut self, now: Instant) {
        while let Some(mut waiting) = self.acknowledgements.take_due(now) {
            let destination = waiting.frame.destination;
            if waiting.retries_left == 0 {
                self.give_up(waiting.message, destination, false);
                continue;
            }
            waiting.retries_left -= 1;
            waiting.deadline = now + self.acknowledgements.timeout;
            self.counters.add(Counter::Retransmissions);
            if let Err(error) = self.resend(now, &waiting.frame) {
                debug!(%destination, %error, "cannot send again");
            }
            self.acknowledgements.insert(waiting);
        }
    }
}
