//! The flow to one destination: its messages that want an acknowledgement, queued, in flight or
//! lost.
//!
//! Each acknowledgement names one packet, so only unacknowledged packets are retransmitted. A
//! packet counts as lost when one sent sufficiently later is acknowledged (the distance adapts to
//! needless retransmissions), or when nothing was acknowledged for the retransmission timeout.

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::time::{Duration, Instant};

use super::FlowStatus;
use super::round_trip::RoundTrip;
use super::window::Window;
use crate::address::JausId;
use crate::endpoint::large::{Cut, Numbers};
use crate::endpoint::{Config, MessageHandle, Unacknowledged};
use crate::wire::{Frame, Priority, Version};

/// The window for a destination with unknown address, because its packets are broadcast.
const SEEKING: usize = 1;
/// The longest retransmission timeout for a destination with unknown address. Receivers remember
/// such a message for a short time only.
const SEEKING_TIMEOUT: Duration = Duration::from_millis(400);
/// The shortest retransmission timeout on a connection. Connections lose nothing, so a
/// retransmission helps only if the receiver was busy. It is twice Junior's timeout: Junior
/// acknowledges every duplicate, even to connections closed since, and that can terminate its
/// engine.
const CONNECTED_TIMEOUT: Duration = Duration::from_millis(200);
/// How far urgent packets may exceed the window, by priority: they do not wait for acknowledgements
/// of less urgent ones.
const RESERVE: [usize; Priority::ALL.len()] = [0, 0, 8, 32];
/// A packet is lost when one sent this many packets later is acknowledged: initial and largest
/// value.
const TOLERANCE: (u64, u64) = (3, 96);
/// After this long without traffic, the measured window is out of date.
const STALE: Duration = Duration::from_secs(1);
/// The divisor of the usual patience for messages to a destination that was silent before.
const SILENT_PART: u32 = 6;
/// The period of sequence numbers.
const ROUND: u64 = 1 << 16;

/// A message that is queued or unacknowledged.
#[derive(Debug)]
pub(super) struct PendingMessage {
    pub(super) whole: Frame,
    /// Whether the sender wants the result reported.
    pub(super) awaited: bool,
    /// When it was queued.
    accepted: Instant,
    /// How it was cut, once its first packet is sent.
    started: Option<Started>,
    /// Octets acknowledged so far.
    pub(super) acknowledged: u32,
}

/// The state of a message whose first packet is sent.
#[derive(Debug)]
struct Started {
    cut: Cut,
    /// The serial number of the first fragment.
    first: u64,
    /// The first fragment not sent yet.
    next: usize,
    /// How many fragments are unacknowledged.
    missing: usize,
}

/// A fragment or unfragmented message that was sent and not acknowledged yet.
#[derive(Debug)]
struct Packet {
    message: MessageHandle,
    index: usize,
    priority: Priority,
    first_sent: Instant,
    sent: Instant,
    /// How many packets had been sent before its latest transmission.
    order: u64,
    tries: u32,
    /// Counts as lost, and is queued for retransmission.
    lost: bool,
}

/// The end of a message, and why it was given up, unless it was acknowledged in full.
pub(super) type Outcome = (MessageHandle, PendingMessage, Option<Unacknowledged>);

/// All messages to one destination.
#[derive(Debug, Default)]
pub(super) struct Flow {
    /// By handle, and so in the order in which they were queued.
    pending_messages: BTreeMap<MessageHandle, PendingMessage>,
    /// Messages not fully sent yet, by priority.
    waiting: [VecDeque<MessageHandle>; Priority::ALL.len()],
    /// Packets to retransmit, by priority.
    lost: [VecDeque<u16>; Priority::ALL.len()],
    flight: HashMap<u16, Packet>,
    /// Sent packets that do not count as lost, oldest first; entries of acknowledged packets are
    /// skipped.
    order: VecDeque<(u64, u16)>,
    sends: u64,
    /// The `order` of the latest acknowledged packet.
    newest: u64,
    tolerance: u64,
    in_flight: usize,
    window: Window,
    round_trip: RoundTrip,
    /// The start of the retransmission timer: when packets are in flight, the time of the latest
    /// acknowledgement or first transmission.
    armed: Option<Instant>,
    /// When the latest acknowledgement arrived.
    heard: Option<Instant>,
    /// When a message was last queued or acknowledged.
    pub(super) active: Option<Instant>,
    /// Whether messages were given up because of silence, and no acknowledgement has arrived since.
    silent: bool,
    /// Whether the address is known.
    pub(super) known: bool,
    /// Whether it is reached through a connection.
    pub(super) connected: bool,
    /// By priority, whether the flow is in the list of flows with something to send.
    pub(super) listed: [bool; Priority::ALL.len()],
    /// When the flow is checked next, at the latest.
    pub(super) timer: Option<Instant>,
    /// The outcomes of messages that are not reported yet.
    pub(super) outcomes: VecDeque<Outcome>,
    /// No message in flight has a lower serial number.
    floor: u64,
    patience: Duration,
    tries: u32,
}

impl Flow {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            tolerance: TOLERANCE.0,
            window: Window::new(config.initial_window, config.max_window),
            patience: config.acknowledge_patience,
            tries: config.acknowledge_tries,
            ..Self::default()
        }
    }

    pub(super) fn is_idle(&self) -> bool {
        self.pending_messages.is_empty()
    }

    pub(super) fn status(&self) -> FlowStatus {
        FlowStatus {
            round_trip: self.round_trip.smoothed(),
            window: self.window.packets(),
            in_flight: self.in_flight,
            messages: self.pending_messages.len(),
        }
    }

    /// Queues a message; `awaited` says whether the sender wants its outcome reported.
    pub(super) fn push(
        &mut self,
        now: Instant,
        message: MessageHandle,
        whole: Frame,
        awaited: bool,
    ) {
        if self.is_idle() {
            self.round_trip.restart();
            let is_stale = |at: Instant| now.saturating_duration_since(at) >= STALE;
            if self.active.is_some_and(is_stale) {
                self.window.rest();
            }
        }
        self.active = Some(now);
        self.waiting[usize::from(whole.flags.priority().bits())].push_back(message);
        let pending = PendingMessage {
            whole,
            awaited,
            accepted: now,
            started: None,
            acknowledged: 0,
        };
        self.pending_messages.insert(message, pending);
    }

    /// The highest priority at which a packet is ready and the window has room.
    pub(super) fn wants(&self) -> Option<Priority> {
        let limit = match self.known {
            true => self.window.packets(),
            false => SEEKING,
        };
        Priority::ALL.into_iter().rev().find(|priority| {
            let level = usize::from(priority.bits());
            let something = !self.lost[level].is_empty() || !self.waiting[level].is_empty();
            something && self.in_flight < limit + RESERVE[level]
        })
    }

    /// Whether the next message to begin is longer than this.
    pub(super) fn begins_more_than(&self, octets: usize) -> bool {
        let next = self.waiting.iter().rev().find_map(VecDeque::front);
        let pending = next.and_then(|message| self.pending_messages.get(message));
        pending.is_some_and(|it| it.started.is_none() && it.whole.payload.len() > octets)
    }

    /// The next packet to send: of that priority or, if that must wait for sequence numbers, of a
    /// lower one. `begin` is called with the length of a message when its first packet is due, and
    /// returns how to cut it and which header to use.
    pub(super) fn take(
        &mut self,
        now: Instant,
        priority: Priority,
        numbers: &mut Numbers,
        mut begin: impl FnMut(usize) -> (Cut, Version),
    ) -> Option<(Frame, u32)> {
        (0..=usize::from(priority.bits())).rev().find_map(|level| {
            self.repeat(now, level)
                .or_else(|| self.advance(now, level, numbers, &mut begin))
        })
    }

    /// Retransmits a lost packet.
    fn repeat(&mut self, now: Instant, level: usize) -> Option<(Frame, u32)> {
        while let Some(sequence) = self.lost[level].pop_front() {
            let Some(packet) = self.flight.get(&sequence).filter(|packet| packet.lost) else {
                continue;
            };
            let pending = self.pending_messages.get(&packet.message)?;
            let started = pending.started.as_ref()?;
            let frame = started
                .cut
                .frame(&pending.whole, started.first, packet.index);
            return self.depart(now, frame);
        }
        None
    }

    /// The next packet of the first queued message.
    fn advance(
        &mut self,
        now: Instant,
        level: usize,
        numbers: &mut Numbers,
        begin: &mut impl FnMut(usize) -> (Cut, Version),
    ) -> Option<(Frame, u32)> {
        loop {
            let message = *self.waiting[level].front()?;
            if !self.pending_messages.contains_key(&message) {
                self.waiting[level].pop_front();
                continue;
            }
            self.start(message, numbers, begin)?;
            let pending = self.pending_messages.get_mut(&message)?;
            let started = pending.started.as_mut()?;
            let index = started.next;
            let frame = started.cut.frame(&pending.whole, started.first, index);
            started.next += 1;
            if started.next == started.cut.count() {
                self.waiting[level].pop_front();
            }
            let packet = Packet {
                message,
                index,
                priority: frame.flags.priority(),
                first_sent: now,
                sent: now,
                order: self.sends,
                tries: 0,
                lost: false,
            };
            self.flight.insert(frame.sequence, packet);
            return self.depart(now, frame);
        }
    }

    /// Cuts and numbers a message if necessary; `None` as long as the sequence numbers that it
    /// needs are in flight.
    fn start(
        &mut self,
        message: MessageHandle,
        numbers: &mut Numbers,
        begin: &mut impl FnMut(usize) -> (Cut, Version),
    ) -> Option<()> {
        let pending = self.pending_messages.get(&message)?;
        if pending.started.is_some() {
            return Some(());
        }
        let (cut, version) = begin(pending.whole.payload.len());
        let count = cut.count();
        let end = numbers.peek(count as u64) + count as u64;
        if end - self.floor >= ROUND {
            let under_way = self
                .pending_messages
                .values()
                .filter_map(|p| p.started.as_ref());
            self.floor = under_way.map(|s| s.first).min().unwrap_or(end);
            if end.saturating_sub(self.floor) >= ROUND {
                return None;
            }
        }
        let pending = self.pending_messages.get_mut(&message)?;
        pending.whole.version = version;
        pending.started = Some(Started {
            cut,
            first: numbers.take(count),
            next: 0,
            missing: count,
        });
        Some(())
    }

    /// Records a transmission; returns the packet's frame, and how often it was sent.
    fn depart(&mut self, now: Instant, frame: Frame) -> Option<(Frame, u32)> {
        let packet = self.flight.get_mut(&frame.sequence)?;
        (packet.sent, packet.order, packet.lost) = (now, self.sends, false);
        packet.tries += 1;
        self.order.push_back((self.sends, frame.sequence));
        self.sends += 1;
        self.in_flight += 1;
        self.armed.get_or_insert(now);
        Some((frame, packet.tries))
    }

    /// Processes the refusal of a packet from `source`.
    pub(super) fn refuse(&mut self, source: JausId, sequence: u16) {
        if let Some(message) = self.owner_of(source, sequence) {
            self.finish(message, Some(Unacknowledged::Refused));
        }
    }

    /// Processes the acknowledgement of a packet.
    pub(super) fn acknowledge(&mut self, now: Instant, sequence: u16) {
        let Some(packet) = self.flight.remove(&sequence) else {
            return;
        };
        self.learn_from(now, &packet);
        self.in_flight -= usize::from(!packet.lost);
        self.newest = self.newest.max(packet.order);
        if let Some(pending) = self.pending_messages.get_mut(&packet.message)
            && let Some(started) = &mut pending.started
        {
            pending.acknowledged += started.cut.range(packet.index).len() as u32;
            started.missing -= 1;
            if started.missing == 0 {
                self.finish(packet.message, None);
            }
        }
        self.find_lost(now);
        self.armed = (self.in_flight > 0).then_some(now);
    }

    /// The message that a packet from `source` belongs to.
    pub(super) fn owner_of(&self, source: JausId, sequence: u16) -> Option<MessageHandle> {
        let message = self.flight.get(&sequence)?.message;
        let pending = self.pending_messages.get(&message)?;
        (pending.whole.source == source).then_some(message)
    }

    fn learn_from(&mut self, now: Instant, packet: &Packet) {
        self.heard = Some(now);
        self.active = self.heard;
        self.silent = false;
        let time = now.saturating_duration_since(packet.sent);
        let shortest = self.round_trip.shortest().unwrap_or_default();
        // Too early to answer the retransmission: the first copy was only reordered.
        let needless = if packet.tries == 1 {
            packet.lost
        } else {
            time * 2 < shortest
        };
        if needless {
            self.tolerance = (self.tolerance * 2).min(TOLERANCE.1);
        }
        if packet.tries == 1 {
            self.round_trip.measure(time);
        }
        self.window.grow(packet.order, self.in_flight);
    }

    /// Marks packets as lost if one sent `tolerance` packets later was acknowledged.
    fn find_lost(&mut self, now: Instant) {
        while let Some(&(order, sequence)) = self.order.front() {
            let is_current = |packet: &Packet| packet.order == order;
            if self.flight.get(&sequence).is_some_and(is_current) {
                if order + self.tolerance > self.newest {
                    return;
                }
                self.lose(now, sequence);
                let is_queued = self.round_trip.has_grown();
                self.window.lose(order, self.sends, is_queued);
            }
            self.order.pop_front();
        }
    }

    /// Marks a packet as lost. Gives its message up if it has used up its attempts.
    fn lose(&mut self, now: Instant, sequence: u16) {
        let Some(packet) = self.flight.get_mut(&sequence) else {
            return;
        };
        packet.lost = true;
        self.in_flight -= 1;
        self.lost[usize::from(packet.priority.bits())].push_back(sequence);
        let long = now.saturating_duration_since(packet.first_sent) >= self.patience;
        if long && packet.tries >= self.tries {
            let message = packet.message;
            self.finish(message, Some(Unacknowledged::TimedOut));
        }
    }

    /// The next timeout.
    pub(super) fn deadline(&self) -> Option<Instant> {
        [self.repetition(), self.end_of_patience()]
            .into_iter()
            .flatten()
            .min()
    }

    /// When all packets in flight count as lost.
    fn repetition(&self) -> Option<Instant> {
        let timeout = self.round_trip.timeout();
        let timeout = match (self.known, self.connected) {
            (false, _) => timeout.min(SEEKING_TIMEOUT),
            (true, false) => timeout,
            (true, true) => timeout.max(CONNECTED_TIMEOUT),
        };
        self.armed.map(|armed| armed + timeout)
    }

    /// When the oldest message is given up, unless an acknowledgement arrives before.
    fn end_of_patience(&self) -> Option<Instant> {
        let (_, oldest) = self.pending_messages.first_key_value()?;
        let patience = match self.silent {
            true => self.patience / SILENT_PART,
            false => self.patience,
        };
        Some(self.heard.max(Some(oldest.accepted))? + patience)
    }

    /// Treats all packets in flight as lost if the retransmission timeout has passed, and gives up
    /// messages that are out of time.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        if self.repetition().is_some_and(|due| due <= now) {
            self.armed = None;
            self.round_trip.back_off();
            let has_proven = self.round_trip.smoothed().is_some();
            self.window.collapse(self.sends, has_proven);
            while let Some((order, sequence)) = self.order.pop_front() {
                let is_current = |packet: &Packet| packet.order == order;
                if self.flight.get(&sequence).is_some_and(is_current) {
                    self.lose(now, sequence);
                }
            }
        }
        let mut silent = self.silent;
        while self.end_of_patience().is_some_and(|end| end <= now)
            && let Some((&message, _)) = self.pending_messages.first_key_value()
        {
            silent = true;
            self.finish(message, Some(Unacknowledged::TimedOut));
        }
        self.silent = silent;
    }

    /// Removes a message and records its outcome.
    fn finish(&mut self, message: MessageHandle, given_up: Option<Unacknowledged>) {
        let Some(pending) = self.remove(message) else {
            return;
        };
        let given_up = given_up.map(|reason| match (reason, &pending.started) {
            (Unacknowledged::TimedOut, None) => Unacknowledged::NotSent,
            (reason, _) => reason,
        });
        self.outcomes.push_back((message, pending, given_up));
    }

    /// Removes a message and its packets in flight. What is left of it in the queues is skipped.
    pub(super) fn remove(&mut self, message: MessageHandle) -> Option<PendingMessage> {
        let pending = self.pending_messages.remove(&message)?;
        if let Some(started) = &pending.started
            && started.missing > 0
        {
            for index in 0..started.next {
                let sequence = (started.first + index as u64) as u16;
                let packet = self.flight.remove(&sequence);
                self.in_flight -= usize::from(packet.is_some_and(|packet| !packet.lost));
            }
        }
        if self.in_flight == 0 {
            self.armed = None;
        }
        Some(pending)
    }

    /// Drops the messages of one component; returns their lengths.
    pub(super) fn forget_source(&mut self, source: JausId) -> Vec<usize> {
        let is_theirs = |pending: &PendingMessage| pending.whole.source == source;
        let all = self.pending_messages.iter();
        let theirs = all.filter(|(_, pending)| is_theirs(pending));
        let theirs: Vec<_> = theirs.map(|(&message, _)| message).collect();
        let removed = theirs.into_iter().filter_map(|it| self.remove(it));
        removed.map(|it| it.whole.payload.len()).collect()
    }
}
