//! What leaves: waiting datagrams become packets of QUIC, the most urgent first, within the byte
//! budget of the node.

use std::cmp::Reverse;
use std::net::SocketAddr;
use std::num::NonZeroU32;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus_limits::{Bucket, Rate};

use super::{Session, Transport, zone};

/// The fraction of a second whose octets may be sent at once after a pause.
const BURST: u32 = 10;
/// The least burst: two datagrams.
const LEAST_BURST: u32 = 3000;

/// The share of the budget for answers outside of sessions, as a divisor: forged packets cause them.
const RESPONSE_SHARE: u32 = 8;
/// Answers outside of sessions that are sent before the sessions have their turn.
const RESPONSES_AT_ONCE: usize = 16;

/// UDP datagrams for the owner to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Datagrams {
    /// The destination.
    pub to: SocketAddr,
    /// Their octets, one after the other.
    pub octets: Bytes,
    /// The length of each datagram in octets, where there are several; the last may be shorter.
    pub segment: Option<usize>,
}

/// Limits the UDP octets that a node sends on all its sessions together. Datagrams wait in the
/// backlogs of the sessions, where an urgent one overtakes the others, until the budget has room.
/// What QUIC itself sends (acknowledgements, keep-alives, retransmissions, the octets around each
/// datagram) is never held up, but paid for.
#[derive(Debug)]
pub(super) struct Budget {
    rate: Rate,
    bucket: Bucket,
    /// The share of answers outside of sessions.
    responses: Bucket,
    /// Octets paid for: those of datagrams when connections take them, and of whatever else they
    /// send. Never less than `sent`.
    paid: u64,
    /// UDP octets sent.
    sent: u64,
    /// When there is room again, if datagrams wait for it.
    ready: Option<Instant>,
}

impl Budget {
    /// A budget of this many octets per second.
    pub(super) fn new(octets: NonZeroU32) -> Self {
        let octets = octets.get();
        Self {
            rate: Rate::new(octets, (octets / BURST).max(LEAST_BURST)),
            bucket: Bucket::default(),
            responses: Bucket::default(),
            paid: 0,
            sent: 0,
            ready: None,
        }
    }

    /// When there is room again, if datagrams wait for it.
    pub(super) const fn ready(&self) -> Option<Instant> {
        self.ready
    }

    /// How long until there is room for a datagram; `None` if there is.
    fn wait(&self, now: Instant) -> Option<Duration> {
        let burst = self.rate.time_for(self.rate.burst);
        let wait = self.bucket.debt(now).saturating_sub(burst);
        (!wait.is_zero()).then_some(wait)
    }

    /// Whether an answer outside of sessions may be sent.
    pub(super) fn admits_response(&mut self, now: Instant, octets: usize) -> bool {
        let is_admitted = self.responses.debt(now) < self.rate.time_for(self.rate.burst);
        if is_admitted {
            let octets = u32::try_from(octets).unwrap_or(u32::MAX);
            let time = RESPONSE_SHARE * self.rate.time_for(octets);
            self.responses.spend(now, time);
        }
        is_admitted
    }

    /// Pays for a datagram that a connection has taken.
    fn pay(&mut self, now: Instant, octets: usize) {
        self.paid += octets as u64;
        self.spend(now, octets as u64);
    }

    /// Counts octets that were sent, and pays for those that nobody has paid for.
    fn count(&mut self, now: Instant, octets: usize) {
        self.sent += octets as u64;
        let unpaid = self.sent.saturating_sub(self.paid);
        self.paid += unpaid;
        self.spend(now, unpaid);
    }

    fn spend(&mut self, now: Instant, octets: u64) {
        // One call is about a datagram or a batch, far below the limit.
        let octets = u32::try_from(octets).unwrap_or(u32::MAX);
        self.bucket.spend(now, self.rate.time_for(octets));
    }
}

impl Transport {
    /// Limits the UDP octets that all sessions together send per second.
    #[must_use]
    pub fn with_budget(mut self, octets_per_second: NonZeroU32) -> Self {
        self.budget = Some(Budget::new(octets_per_second));
        self
    }

    /// The next UDP datagrams to send: at most `most`, at least 1, to one destination.
    pub fn poll_transmit(&mut self, now: Instant, most: usize) -> Option<Datagrams> {
        self.flush(now);
        let next = self.next_transmit(now, most.max(1))?;
        if let Some(budget) = &mut self.budget {
            budget.count(now, next.octets.len());
        }
        Some(next)
    }

    fn next_transmit(&mut self, now: Instant, most: usize) -> Option<Datagrams> {
        if self.responded < RESPONSES_AT_ONCE
            && let Some(response) = self.next_response()
        {
            return Some(response);
        }
        let buffer = &mut self.buffer;
        buffer.clear();
        let mut connections = self.sessions.values_mut().map(|it| &mut it.connection);
        let Some(transmit) = connections.find_map(|it| it.poll_transmit(now, most, buffer)) else {
            self.responded = 0;
            return self.next_response();
        };
        Some(Datagrams {
            to: zone::extract(transmit.destination),
            octets: Bytes::copy_from_slice(&buffer[..transmit.size]),
            segment: transmit.segment_size,
        })
    }

    fn next_response(&mut self) -> Option<Datagrams> {
        let (to, octets) = self.responses.pop_front()?;
        self.responded += 1;
        let segment = None;
        Some(Datagrams {
            to,
            octets,
            segment,
        })
    }

    /// Passes waiting datagrams to the connections, as far as they take them and the budget allows.
    fn flush(&mut self, now: Instant) {
        self.sessions.values_mut().for_each(Session::write_rests);
        let sessions = self.sessions.values_mut();
        let Some(budget) = &mut self.budget else {
            return sessions.for_each(|session| while session.flush_one().is_some() {});
        };
        budget.ready = None;
        let mut waiting: Vec<_> = sessions.filter(|it| it.next_priority().is_some()).collect();
        loop {
            // The most urgent, and of equals the one that waits longest.
            let next = waiting.iter_mut().enumerate();
            let next = next.max_by_key(|(_, it)| (it.next_priority(), Reverse(it.turn)));
            let Some((index, session)) = next else {
                break;
            };
            if let Some(wait) = budget.wait(now) {
                budget.ready = Some(now + wait);
                break;
            }
            match session.flush_one() {
                Some(octets) => {
                    self.turns += 1;
                    session.turn = self.turns;
                    budget.pay(now, octets);
                }
                // It has no more, or its connection takes no more.
                None => {
                    waiting.swap_remove(index);
                }
            }
        }
    }
}
