//! Several small messages in one datagram, for those who want it: whoever sends many small ones
//! saves most of what a datagram costs.

use std::collections::{HashMap, VecDeque};
use std::time::{Duration, Instant};

use bytes::{BufMut, BytesMut};

use super::pacing::Lane;
use super::{Counter, Endpoint, Transmit};
use crate::wire::{Framing, Priority, as5669a, judp};

/// Whether small messages to the same address share a datagram.
///
/// Only messages with today's header do. Junior and JAUS++ read several in a datagram, and neither
/// ever sends more than one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Packing {
    /// Each message has a datagram of its own.
    #[default]
    Off,
    /// Messages wait for company up to so long, a safety-critical one not at all. With zero, those
    /// share a datagram that wait anyway when the link takes the next.
    Within(Duration),
}

/// Messages that wait for company.
#[derive(Debug, Default)]
pub(super) struct Gathering {
    waiting: HashMap<Lane, Transmit>,
    /// When which is to go; those that have gone are passed over.
    due: VecDeque<(Instant, Lane)>,
}

impl Gathering {
    /// When the next is to go.
    pub(super) fn next_deadline(&self) -> Option<Instant> {
        self.due.front().map(|&(at, _)| at)
    }

    /// Forgets what waits for a link that has gone.
    pub(super) fn forget_link(&mut self, link: super::LinkId) {
        self.waiting.retain(|lane, _| lane.0 != link);
        self.due.retain(|(_, lane)| lane.0 != link);
    }

    fn take(&mut self, lane: Lane) -> Option<Transmit> {
        let gathered = self.waiting.remove(&lane)?;
        self.due.retain(|(_, due)| *due != lane);
        Some(gathered)
    }
}

impl Endpoint {
    /// Queues a datagram, or lets it wait for company; whether there is room. A full queue is
    /// counted.
    pub(super) fn transmit(&mut self, transmit: Transmit) -> bool {
        let Packing::Within(patience) = self.config.packing else {
            return self.enqueue_transmit(transmit);
        };
        let room = self.gathering.waiting.len() < self.config.queue_limit;
        match self.latest {
            Some(now)
                if room
                    && !patience.is_zero()
                    && transmit.priority != Priority::SafetyCritical
                    && self.may_pack(&transmit) =>
            {
                self.gather(now + patience, transmit)
            }
            _ => self.enqueue_transmit(transmit),
        }
    }

    fn enqueue_transmit(&mut self, transmit: Transmit) -> bool {
        let queued = self.transmits.push(transmit.priority, transmit).is_ok();
        if !queued {
            self.counters.add(Counter::TransmitQueueFull);
        }
        queued
    }

    /// Puts a message to those to the same place that wait, or lets it wait as their first.
    fn gather(&mut self, due: Instant, transmit: Transmit) -> bool {
        let lane = (transmit.link, transmit.to);
        let Some(mut before) = self.gathering.waiting.remove(&lane) else {
            self.gathering.due.push_back((due, lane));
            self.gathering.waiting.insert(lane, transmit);
            return true;
        };
        let together = before.payload.len() + transmit.payload.len() - 1;
        if together > self.most_in_datagram() {
            self.gathering.due.retain(|(_, due)| *due != lane);
            self.gathering.due.push_back((due, lane));
            self.gathering.waiting.insert(lane, transmit);
            return self.enqueue_transmit(before);
        }
        let mut packed = BytesMut::from(before.payload);
        packed.put_slice(transmit.payload.get(1..).unwrap_or_default());
        before.payload = packed.freeze();
        before.priority = before.priority.max(transmit.priority);
        self.gathering.waiting.insert(lane, before);
        true
    }

    /// Queues what has waited long enough.
    pub(super) fn send_gathered(&mut self, now: Instant) {
        while let Some(&(at, lane)) = self.gathering.due.front()
            && at <= now
        {
            if let Some(gathered) = self.gathering.take(lane) {
                self.enqueue_transmit(gathered);
            }
        }
    }

    fn most_in_datagram(&self) -> usize {
        1 + as5669a::message_len(self.config.payload_limit)
    }

    /// Puts messages to the same place that wait anyway into the same datagram.
    pub(super) fn pack(&mut self, first: Transmit) -> Transmit {
        let most = self.most_in_datagram();
        if self.config.packing == Packing::Off || !self.may_pack(&first) {
            return first;
        }
        let mut packed = BytesMut::new();
        loop {
            // The next one does without its version octet.
            let room = 1 + most - packed.len().max(first.payload.len());
            let fits = |next: &Transmit| is_todays(next) && next.payload.len() <= room;
            if room <= as5669a::MIN_LEN {
                break;
            }
            let Some(next) = self.take_companion(&first, Self::take_transmit, fits) else {
                break;
            };
            if packed.is_empty() {
                packed.reserve(most);
                packed.put_slice(&first.payload);
            }
            packed.put_slice(next.payload.get(1..).unwrap_or_default());
        }
        if packed.is_empty() {
            return first;
        }
        Transmit {
            payload: packed.freeze(),
            ..first
        }
    }

    /// Whether there is room for one more message behind it.
    fn may_pack(&self, transmit: &Transmit) -> bool {
        self.framing(transmit.link) == Framing::Judp
            && is_todays(transmit)
            && transmit.payload.len() + as5669a::MIN_LEN <= self.most_in_datagram()
    }
}

/// Whether it is a datagram with today's header.
fn is_todays(transmit: &Transmit) -> bool {
    transmit.payload.first() == Some(&judp::VERSION_AS5669A)
}
