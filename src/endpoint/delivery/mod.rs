//! Reliable delivery: retransmits messages until they are acknowledged or given up.
//!
//! Each destination has a [flow](flow) of its own with a sliding window, so that an unresponsive
//! destination delays no other. A message is given up when its destination has acknowledged nothing
//! for [`Config::acknowledge_patience`] since the message was queued, or when one of its packets
//! was sent [`Config::acknowledge_tries`] times over at least that long. The silence is remembered:
//! until the peer acknowledges something, its other messages, including those already queued, get
//! a sixth of the time.
//!
//! Frames are created when they are sent; a waiting message costs only its own octets, which are
//! shared.
//!
//! Two limits of Junior as a receiver matter here. It drops all but the latest 50 fragments (or
//! 100, as configured) although it has acknowledged them, so a message must not have more. And it
//! reads ten datagrams per millisecond from a buffer of 70000 octets, to which the window adapts
//! through losses.

mod flow;
mod round_trip;
mod window;

use std::collections::{BTreeSet, HashMap, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};

use tracing::debug;

use super::{Config, Counter, Endpoint, Event, MessageHandle, SendError, Shortfall};
use crate::address::JausId;
use crate::wire::{Acknowledgement, Broadcast, DataControl, Frame, Framing, Priority, Version};
use flow::{Flow, Outcome};

/// Packets of one flow are sent in runs of this length, so that links can batch them in one call.
const TURN: usize = 32;

/// The state of reliable delivery to one destination.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlowStatus {
    /// The smoothed round trip; `None` before the first measurement.
    pub round_trip: Option<Duration>,
    /// How many packets may be in flight at a time.
    pub window: usize,
    /// How many are in flight now: sent, and neither acknowledged nor counted as lost.
    pub in_flight: usize,
    /// Messages that are queued or unacknowledged.
    pub messages: usize,
}

/// All flows, with their schedule.
#[derive(Debug, Default)]
pub(super) struct Deliveries {
    flows: HashMap<JausId, Flow>,
    /// Flows that may have something to send, by priority; the first is next.
    ready: [VecDeque<JausId>; Priority::ALL.len()],
    /// The latest time to check each flow; at most one entry per flow.
    timers: BTreeSet<(Instant, JausId)>,
    handed_in: u64,
    messages: usize,
    octets: usize,
    config: Arc<Config>,
}

impl Deliveries {
    pub(super) fn new(config: Arc<Config>) -> Self {
        Self {
            config,
            ..Self::default()
        }
    }

    /// Allocates a handle for the next message.
    pub(super) fn next_handle(&mut self) -> MessageHandle {
        self.handed_in += 1;
        MessageHandle(self.handed_in)
    }

    /// Checks that one more message fits, while this many `results` have not been polled.
    pub(super) fn check_room(&self, results: usize, length: usize) -> Result<(), SendError> {
        let limit = self.config.max_unacknowledged;
        if self.messages + results >= limit {
            return Err(SendError::TooManyUnacknowledged { limit });
        }
        let limit = self.config.max_unacknowledged_octets;
        if self.octets > 0 && self.octets + length > limit {
            return Err(SendError::TooMuchUnacknowledged { limit });
        }
        Ok(())
    }

    fn push(
        &mut self,
        now: Instant,
        handle: MessageHandle,
        whole: Frame,
        awaited: bool,
    ) -> Result<(), SendError> {
        let destination = whole.destination;
        if !self.flows.contains_key(&destination) && !self.make_room(now) {
            let limit = self.config.max_flows;
            return Err(SendError::TooManyDestinations { limit });
        }
        self.messages += 1;
        self.octets += whole.payload.len();
        let flow = self.flows.entry(destination);
        let flow = flow.or_insert_with(|| Flow::new(&self.config));
        flow.push(now, handle, whole, awaited);
        self.touch(destination);
        Ok(())
    }

    /// Makes room for one more flow by dropping the one idle for longest.
    fn make_room(&mut self, now: Instant) -> bool {
        if self.flows.len() < self.config.max_flows.max(1) {
            return true;
        }
        let idle = self.flows.iter().filter(|(_, flow)| flow.is_idle());
        let oldest = idle.min_by_key(|(_, flow)| flow.active.min(Some(now)));
        let Some((&destination, _)) = oldest else {
            return false;
        };
        if let Some(timer) = self.flows.remove(&destination).and_then(|flow| flow.timer) {
            self.timers.remove(&(timer, destination));
        }
        true
    }

    /// Reschedules a flow whose state has changed: its turn and its timer.
    pub(super) fn touch(&mut self, destination: JausId) {
        let Some(flow) = self.flows.get_mut(&destination) else {
            return;
        };
        if let Some(priority) = flow.wants() {
            let level = usize::from(priority.bits());
            if !flow.listed[level] {
                flow.listed[level] = true;
                self.ready[level].push_back(destination);
            }
        }
        let deadline = flow.deadline();
        // An early timer is harmless; moving it with each answer would be costly.
        let is_early = |(set, deadline)| set <= deadline;
        if !flow.timer.zip(deadline).is_some_and(is_early) {
            if let Some(set) = flow.timer {
                self.timers.remove(&(set, destination));
            }
            self.timers.extend(deadline.map(|at| (at, destination)));
            flow.timer = deadline;
        }
    }

    /// The next flow in turn at this priority.
    fn next_ready(&mut self, priority: Priority) -> Option<JausId> {
        let level = usize::from(priority.bits());
        while let Some(destination) = self.ready[level].pop_front() {
            if let Some(flow) = self.flows.get_mut(&destination) {
                flow.listed[level] = false;
            }
            if self.wants(destination) == Some(priority) {
                return Some(destination);
            }
            self.touch(destination);
        }
        None
    }

    /// The highest priority at which a flow has something to send.
    fn wants(&self, destination: JausId) -> Option<Priority> {
        self.flows.get(&destination)?.wants()
    }

    fn take_due(&mut self, now: Instant) -> Option<JausId> {
        let &(_, destination) = self.timers.first().filter(|(at, _)| *at <= now)?;
        self.timers.pop_first();
        if let Some(flow) = self.flows.get_mut(&destination) {
            flow.timer = None;
        }
        Some(destination)
    }

    pub(super) fn next_deadline(&self) -> Option<Instant> {
        self.timers.first().map(|&(deadline, _)| deadline)
    }

    fn settle(&mut self, length: usize) {
        self.messages -= 1;
        self.octets -= length;
    }

    fn next_outcome(&mut self, destination: JausId) -> Option<Outcome> {
        let outcome = self.flows.get_mut(&destination)?.outcomes.pop_front()?;
        self.settle(outcome.1.whole.payload.len());
        Some(outcome)
    }

    /// Drops a message whose outcome is open; returns whether there was one.
    fn cancel(&mut self, destination: JausId, message: MessageHandle) -> bool {
        let flow = self.flows.get_mut(&destination);
        let Some(pending) = flow.and_then(|flow| flow.remove(message)) else {
            return false;
        };
        self.settle(pending.whole.payload.len());
        self.touch(destination);
        true
    }

    /// Drops the messages of a detached component; returns how many.
    pub(super) fn forget_source(&mut self, source: JausId) -> u64 {
        let before = self.messages;
        let destinations: Vec<_> = self.flows.keys().copied().collect();
        for destination in destinations {
            let flow = self.flows.get_mut(&destination);
            let gone = flow.map(|flow| flow.forget_source(source));
            for length in gone.into_iter().flatten() {
                self.settle(length);
            }
            self.touch(destination);
        }
        (before - self.messages) as u64
    }
}

impl Endpoint {
    /// The state of reliable delivery to `destination`; `None` if there was none recently.
    #[must_use]
    pub fn flow(&self, destination: JausId) -> Option<FlowStatus> {
        self.deliveries.flows.get(&destination).map(Flow::status)
    }

    /// Cancels a message that waits for its acknowledgement: from now on it is neither sent nor
    /// retransmitted, in whole or in part, and its outcome is not reported. Copies that were sent
    /// may still arrive. Returns whether it was waiting.
    ///
    /// Receivers do not notice the gap in the sequence numbers: AS5669A orders nothing by them.
    /// Junior, JAUS++ and this endpoint use them to recognise duplicates and to put fragments
    /// together, and drop the fragments of a message that stays incomplete when they get too old.
    pub fn cancel(&mut self, destination: JausId, message: MessageHandle) -> bool {
        let is_cancelled = self.deliveries.cancel(destination, message);
        if is_cancelled {
            self.counters.add(Counter::MessagesCancelled);
        }
        is_cancelled
    }

    /// Queues a message that wants an acknowledgement, or a large one for an unknown address.
    pub(super) fn deliver_reliably(
        &mut self,
        now: Instant,
        handle: MessageHandle,
        mut whole: Frame,
        awaited: bool,
    ) -> Result<(), SendError> {
        self.deliveries
            .check_room(self.results, whole.payload.len())?;
        whole.flags = whole.flags.with_acknowledgement(Acknowledgement::Request);
        self.deliveries.push(now, handle, whole, awaited)
    }

    /// Sends the next packets of this priority, at most [`TURN`]. Returns whether any were sent.
    pub(super) fn send_deliveries(&mut self, now: Instant, priority: Priority) -> bool {
        let mut sent = 0;
        while sent < TURN
            && let Some(destination) = self.deliveries.next_ready(priority)
        {
            let before = sent;
            while sent < TURN
                && self.deliveries.wants(destination) == Some(priority)
                && self.send_packet(now, destination, priority).is_some()
            {
                sent += 1;
            }
            // A flow without free sequence numbers is rescheduled when a message is acknowledged or
            // given up.
            if sent > before {
                self.deliveries.touch(destination);
            }
        }
        sent > 0
    }

    /// Sends the next packet to a destination, if there is one. Without a route, the packet counts
    /// as lost on the way.
    fn send_packet(&mut self, now: Instant, destination: JausId, priority: Priority) -> Option<()> {
        let route = self.route(destination);
        let version = route.map_or(Version::As5669a, |(_, version)| version);
        let cutting = self.cutting(destination, version);
        let connected =
            route.is_some_and(|(path, _)| self.egress.framing(path.link) == Framing::Jtcp);
        let is_proven = route.is_some_and(|(path, _)| self.is_free(path));
        let much = self.config.unverified_address.burst as usize / 2;
        let flow = self.deliveries.flows.get(&destination)?;
        let is_too_much = route.is_some() && !is_proven && flow.begins_more_than(much);
        if is_too_much || self.peers.repeats_code(destination).is_none() {
            self.challenge(now, destination);
            if self.peers.challenge(destination).is_some() {
                return None;
            }
        }
        let flow = self.deliveries.flows.get_mut(&destination)?;
        flow.known = is_proven;
        flow.connected = connected;
        let begin = |length| (cutting.cut(length), version);
        let (mut frame, tries) = flow.take(now, priority, &mut self.numbers, begin)?;
        if tries > 1 {
            self.counters.add(Counter::Retransmissions);
            self.peers
                .note(destination, |peer| peer.retransmissions += 1);
        }
        if frame.flags.data() == DataControl::Single {
            frame.version = version;
        }
        let sent = match route {
            Some((path, _)) if frame.flags.broadcast() == Some(Broadcast::None) => {
                let sent = self.send_along(now, path, &frame);
                sent.map(drop).map_err(SendError::Header)
            }
            _ => self.send_to_all(now, frame),
        };
        if let Err(error) = sent {
            debug!(%destination, %error, "cannot be sent");
        }
        Some(())
    }

    /// Whether a message or fragment with this number awaits an acknowledgement of `peer`.
    pub(super) fn awaits_answer(&self, peer: JausId, local: JausId, number: u16) -> bool {
        let flow = self.deliveries.flows.get(&peer);
        flow.is_some_and(|flow| flow.owner_of(local, number).is_some())
    }

    /// Handles a message that was given up: if its destination was silent meanwhile, its route
    /// becomes stale, and further messages go to the group.
    fn lose(&mut self, now: Instant, destination: JausId) {
        if let Some(since) = now.checked_sub(self.config.acknowledge_patience)
            && self
                .route(destination)
                .is_some_and(|(path, _)| self.egress.is_datagram(path))
        {
            self.peers.lose(destination, since);
        }
    }

    /// Processes an awaited acknowledgement of one of our messages.
    pub(super) fn receive_answer(&mut self, now: Instant, frame: &Frame) {
        let destination = frame.source;
        if let Some(flow) = self.deliveries.flows.get_mut(&destination) {
            flow.known = true;
            match frame.flags.acknowledgement() {
                Acknowledgement::Negative => flow.refuse(frame.destination, frame.sequence),
                _ => flow.acknowledge(now, frame.sequence),
            }
        }
        self.report_outcomes(destination);
    }

    /// Retransmits unacknowledged packets whose timeout has passed, or gives their messages up.
    pub(super) fn retry_unacknowledged(&mut self, now: Instant) {
        while let Some(destination) = self.deliveries.take_due(now) {
            let Some(flow) = self.deliveries.flows.get_mut(&destination) else {
                continue;
            };
            flow.handle_timeout(now);
            if !flow.outcomes.is_empty() {
                self.lose(now, destination);
            }
            self.report_outcomes(destination);
        }
    }

    /// Reports the outcomes of messages to a destination, and reschedules its flow.
    fn report_outcomes(&mut self, destination: JausId) {
        while let Some((message, pending, given_up)) = self.deliveries.next_outcome(destination) {
            if given_up.is_some() {
                self.counters.add(Counter::MessagesGivenUp);
                self.peers.note(destination, |peer| peer.lost += 1);
            }
            if !pending.awaited {
                continue;
            }
            self.announce_result(match given_up {
                None => Event::Acknowledged {
                    message,
                    by: destination,
                },
                Some(reason) => Event::NotAcknowledged {
                    message,
                    shortfall: Shortfall {
                        destination,
                        reason,
                        acknowledged: pending.acknowledged,
                        length: pending.whole.payload.len() as u32,
                    },
                },
            });
        }
        self.deliveries.touch(destination);
    }
}
