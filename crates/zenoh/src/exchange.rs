//! The bridge without I/O: which messages pass, and under which keys.
//!
//! A message crosses the zenoh network once at most. It leaves only if its source belongs to this
//! side, and it enters only if its source belongs to the bridge that publishes it and not to this
//! side. So there are no loops, however many bridges join the same two networks.

mod decided;
mod presence;

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message as _;
use jaus::endpoint::{ID_HELD, Remote, SessionId, To, Transmit};
use jaus::link::custom::Arrival;
use jaus::messages::core::QueryIdentification;
use jaus::rights::{Acceptance, DecisionQueue, InControl, Table};
use jaus::wire::{Acknowledgement, DataControl, Frame, Version, judp};

use crate::arrivals::Arrivals;
use crate::counters::{Counter, Counters};
use crate::key::{BridgeId, Key, Label, Prefix, Recipient};
use crate::notices::Notices;
use crate::queue::{Command, Publication, Queue};
use crate::remotes::{MOST_OF_BRIDGE, Remotes};
use crate::thin::{MinPeriod, Thinner, Verdict};

/// The settings of a bridge.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Settings {
    /// The first chunks of all keys. Bridges with different prefixes do not see each other.
    pub prefix: Prefix,
    /// The ids that may come from the zenoh side, and their rights.
    pub accept: Acceptance,
    /// What messages need, for `accept`; of the catalogue by default.
    pub table: Table,
    /// Whether `accept` may let ids do more than watch although the links of the zenoh network do not prove
    /// who is there.
    pub trusts_network: bool,
    /// The ids of this side that the other sides see, with wildcards; all if empty.
    pub offer: Vec<JausId>,
    /// Minimum periods of messages to the zenoh side.
    pub min_periods: Vec<MinPeriod>,
}

/// How long a component belongs to this side after it was last heard.
const LOCAL_FOR: Duration = Duration::from_secs(10);
/// The largest payload: a UDP datagram.
const LARGEST: usize = 65_507;

/// A component of this side.
#[derive(Debug)]
struct Local {
    heard: Instant,
    /// Its latest call: the broadcast Query Identification with which it searches for others, as a
    /// datagram.
    call: Option<Bytes>,
}

/// Whether messages can be published.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// The zenoh session is not open yet.
    Opening,
    Open,
    /// The node stops.
    Closed,
}

/// The longest call that is kept, in octets. Calls have less than twenty.
const LONGEST_CALL: usize = 64;

/// The tables and queues of a bridge, without I/O.
///
/// Feed it with `handle_*`, [`transmit`](Self::transmit) and [`expire`](Self::expire); then poll
/// commands for the zenoh session and arrivals for the node until there are none.
#[derive(Debug)]
pub struct Exchange {
    id: BridgeId,
    prefix: Prefix,
    accept: Acceptance,
    table: Table,
    offer: Vec<JausId>,
    remotes: Remotes,
    /// The components of this side.
    locals: BTreeMap<JausId, Local>,
    /// Those that are silent, and since when: their ids still belong to this side, unless `accept` gives them
    /// rights and so says that they may come from the zenoh side.
    silent: BTreeMap<JausId, Instant>,
    /// Their subsystems, whose views this bridge serves.
    served: BTreeSet<u16>,
    thinner: Thinner,
    queue: Queue,
    arrivals: Arrivals,
    phase: Phase,
    /// The kinds of refused messages that were logged.
    refused: Notices<(JausId, u16)>,
    /// The bridges that were logged because they use an id without speaking for it.
    intruders: Notices<(JausId, BridgeId)>,
    /// The bridges that were logged because a component belongs to them.
    owners: Notices<(JausId, BridgeId)>,
    /// Whether what cannot be recorded is refused.
    is_refusing: bool,
    decisions: DecisionQueue<BridgeId>,
    in_control: InControl,
    counters: Counters,
}

impl Exchange {
    /// A bridge with this id.
    #[must_use]
    pub fn new(id: BridgeId, settings: Settings) -> Self {
        Self {
            id,
            prefix: settings.prefix,
            accept: settings.accept,
            table: settings.table,
            offer: settings.offer,
            remotes: Remotes::default(),
            locals: BTreeMap::new(),
            silent: BTreeMap::new(),
            served: BTreeSet::new(),
            thinner: Thinner::new(&settings.min_periods),
            queue: Queue::default(),
            arrivals: Arrivals::default(),
            phase: Phase::Opening,
            refused: Notices::default(),
            intruders: Notices::default(),
            owners: Notices::default(),
            is_refusing: false,
            decisions: DecisionQueue::default(),
            in_control: InControl::default(),
            counters: Counters::default(),
        }
    }

    /// The prefix of its keys.
    #[must_use]
    pub const fn prefix(&self) -> &Prefix {
        &self.prefix
    }

    /// The ids that may come from the zenoh side, and their rights.
    #[must_use]
    pub const fn accept(&self) -> &Acceptance {
        &self.accept
    }

    /// Counts of what passed and what was dropped.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// The key expressions of messages to subscribe to.
    #[must_use]
    pub fn subscriptions(&self) -> Vec<String> {
        let to = [Recipient::All, Recipient::Bridge(self.id)];
        let patterns = self.accept.patterns();
        let both = |ids: &JausId| to.map(|to| self.prefix.messages_of(*ids, to));
        patterns.iter().flat_map(both).collect()
    }

    /// The key expressions of liveliness tokens to subscribe to.
    #[must_use]
    pub fn presences(&self) -> Vec<String> {
        let patterns = self.accept.patterns();
        let presence = |ids: &JausId| self.prefix.presence_of(*ids);
        patterns.iter().map(presence).collect()
    }

    /// The key expression of a component's liveliness token.
    #[must_use]
    pub fn token_key(&self, component: JausId) -> String {
        let from = self.id;
        self.prefix.key(&Key::Live { component, from })
    }

    /// The zenoh session is open: from now on messages are published. Before, they are dropped,
    /// because late commands do harm.
    pub fn handle_open(&mut self) {
        if self.phase == Phase::Opening {
            self.phase = Phase::Open;
        }
    }

    /// A sample was received.
    pub fn handle_sample(&mut self, now: Instant, key: &str, payload: &Bytes) {
        if let Err(counter) = self.receive(now, key, payload) {
            tracing::trace!(%counter, "sample refused");
            self.counters.add(counter);
        }
        self.repeat_calls(now);
    }

    /// Sends the calls of this side's components to the bridges that were found. The components have
    /// called before, and would not call again for a while.
    fn repeat_calls(&mut self, now: Instant) {
        for bridge in self.remotes.take_found() {
            let calls = self.locals.values().filter_map(|local| local.call.clone());
            for call in calls.collect::<Vec<_>>() {
                if let Some(frame) = only_frame(&call) {
                    self.publish(now, &frame, Some(call), Recipient::Bridge(bridge));
                }
            }
        }
    }

    fn receive(&mut self, now: Instant, key: &str, payload: &Bytes) -> Result<(), Counter> {
        let Some(Key::Raw {
            source,
            label,
            from,
            to,
        }) = self.prefix.parse(key)
        else {
            return Err(Counter::UnknownKey);
        };
        let is_for_us = to == Recipient::All || to == Recipient::Bridge(self.id);
        if from == self.id || !is_for_us {
            return Err(Counter::UnknownKey);
        }
        let frame = only_frame(payload).ok_or(Counter::InvalidPayload)?;
        if frame.source != source || Label::of(&frame) != Some(label) {
            return Err(Counter::KeyMismatch);
        }
        let session = self.speaker(now, source, from).inspect_err(|counter| {
            self.record_intruder(from, &frame);
            if matches!(counter, Counter::NotAnnounced | Counter::OtherBridge) {
                self.note_intruder(now, key, source, from);
            }
        })?;
        let datagrams = match self.decide(now, from, &frame)?.copies(&frame) {
            Some(copies) => copies
                .iter()
                .filter_map(|it| judp::encode(it).ok())
                .collect(),
            None => vec![payload.clone()],
        };
        for datagram in datagrams {
            match self.arrivals.push(session, datagram) {
                true => self.counters.add(Counter::Received),
                false => return Err(Counter::InboxFull),
            }
        }
        Ok(())
    }

    /// The session of a bridge that speaks for a component.
    fn speaker(
        &self,
        now: Instant,
        component: JausId,
        bridge: BridgeId,
    ) -> Result<SessionId, Counter> {
        if self.is_held(now, component) {
            return Err(Counter::OwnId);
        }
        if !self.accept.accepts(component) {
            return Err(Counter::NotAccepted);
        }
        self.remotes.hear(bridge, component)
    }

    /// Whether a component of this side was heard lately.
    fn is_local(&self, now: Instant, id: JausId) -> bool {
        let local = self.locals.get(&id);
        local.is_some_and(|local| is_recent(now, local.heard))
    }

    /// Whether an id belongs to this side: its component was heard lately, or is silent, but no rule lets the id
    /// come from the zenoh side.
    fn is_held(&self, now: Instant, id: JausId) -> bool {
        let is_kept = |since: &Instant| now.saturating_duration_since(*since) < ID_HELD;
        self.is_local(now, id) || self.silent.get(&id).is_some_and(is_kept)
    }

    /// Notes a component of this side: `heard` is when its latest message arrived, or now if it is attached to the
    /// node. A bridge that speaks for its id loses the id, unless `accept` gives it rights.
    pub fn handle_local(&mut self, now: Instant, id: JausId, heard: Instant) {
        if !is_recent(now, heard) || !self.offers(id) {
            return;
        }
        match self.remotes.owner(id) {
            Some(owner) if self.accept.trusts(id) => self.note_hidden(now, id, owner),
            // What keeps it out is counted when it sends something.
            owner if self.enter(id, heard).is_ok() && owner.is_some() => self.take_back(now, id),
            _ => {}
        }
    }

    /// Enters a component of this side, and announces it if it is new.
    fn enter(&mut self, id: JausId, heard: Instant) -> Result<(), Counter> {
        if self.phase == Phase::Closed {
            return Err(Counter::NotConnected);
        }
        if let Some(local) = self.locals.get_mut(&id) {
            local.heard = heard.max(local.heard);
            return Ok(());
        }
        if self.locals.len() >= MOST_OF_BRIDGE {
            return Err(Counter::LocalTableFull);
        }
        self.silent.remove(&id);
        self.locals.insert(id, Local { heard, call: None });
        self.queue.declare(Command::Announce(id));
        if self.served.insert(id.subsystem()) {
            self.queue.declare(Command::Serve(id.subsystem()));
        }
        Ok(())
    }

    fn offers(&self, id: JausId) -> bool {
        self.offer.is_empty() || self.offer.iter().any(|offered| offered.matches(id))
    }

    /// Whether this bridge serves the views of a component.
    #[must_use]
    pub fn serves(&self, id: JausId) -> bool {
        self.locals.contains_key(&id)
    }

    /// Publishes a datagram of the node.
    pub fn transmit(&mut self, now: Instant, transmit: &Transmit) {
        let to = match transmit.to {
            To::Group => Some(Recipient::All),
            To::Peer(Remote::Session(session)) => {
                self.remotes.bridge(session).map(Recipient::Bridge)
            }
            To::Peer(_) => None,
        };
        let Some(to) = to else {
            self.counters.add(Counter::NoSession);
            return;
        };
        let Ok(mut frames) = judp::frames(transmit.payload.clone()) else {
            self.counters.add(Counter::NotAs5669a);
            return;
        };
        let is_as5669a = frames.version() == Version::As5669a;
        let mut is_first = true;
        while let Some(Ok(frame)) = frames.next() {
            let is_alone = std::mem::take(&mut is_first) && frames.remaining() == 0;
            let octets = is_alone.then(|| transmit.payload.clone());
            let sent = match is_as5669a {
                true => self.send(now, &frame, octets, to),
                false => Err(Counter::NotAs5669a),
            };
            if let Err(counter) = sent {
                self.counters.add(counter);
            }
        }
    }

    fn send(
        &mut self,
        now: Instant,
        frame: &Frame,
        octets: Option<Bytes>,
        to: Recipient,
    ) -> Result<(), Counter> {
        if self.remotes.contains(frame.source) {
            return Err(Counter::FromOutside);
        }
        if !self.offers(frame.source) {
            return Err(Counter::NotOffered);
        }
        self.enter(frame.source, now)?;
        self.keep_call(frame);
        if self.phase != Phase::Open {
            return Err(Counter::NotConnected);
        }
        let to = self.recipient(frame.destination, to)?;
        self.record_answer(frame, to);
        self.publish(now, frame, octets, to);
        Ok(())
    }

    /// The bridges for which a message is that the node sends to `to`: it searches everywhere for a
    /// component whose route it does not know. Its token tells, and without one it is not there.
    fn recipient(&self, destination: JausId, to: Recipient) -> Result<Recipient, Counter> {
        match self.remotes.owner(destination) {
            Some(owner) => Ok(Recipient::Bridge(owner)),
            None if !destination.has_wildcard() => Err(Counter::NotPresent),
            None => Ok(to),
        }
    }

    fn keep_call(&mut self, frame: &Frame) {
        let is_call = frame.code() == Some(QueryIdentification::CODE)
            && frame.destination.has_wildcard()
            && frame.payload.len() <= LONGEST_CALL;
        if is_call && let Some(local) = self.locals.get_mut(&frame.source) {
            local.call = judp::encode(frame).ok();
        }
    }

    /// Publishes a frame; `octets` is its datagram, if it exists already.
    fn publish(&mut self, now: Instant, frame: &Frame, octets: Option<Bytes>, to: Recipient) {
        let label = Label::of(frame);
        let octets = octets.or_else(|| judp::encode(frame).ok());
        let (Some(label), Some(payload)) = (label, octets) else {
            self.counters.add(Counter::NotAs5669a);
            return;
        };
        let key = Key::Raw {
            source: frame.source,
            label,
            from: self.id,
            to,
        };
        let publication = Publication {
            key: self.prefix.key(&key),
            payload,
            priority: Some(frame.flags.priority()),
            waits: waits(frame),
        };
        match self.thinner.admit(now, frame, publication) {
            Verdict::Publish(publication) => self.queue(now, publication),
            Verdict::TableFull(publication) => {
                self.counters.add(Counter::PeriodTableFull);
                self.queue(now, publication);
            }
            Verdict::Held => {}
            Verdict::Replaced => self.counters.add(Counter::Replaced),
        }
    }

    fn queue(&mut self, now: Instant, publication: Publication) {
        let counter = match self.queue.publish(now, publication) {
            true => Counter::Published,
            false => Counter::QueueFull,
        };
        self.counters.add(counter);
    }

    /// Publishes a view.
    pub fn publish_view(&mut self, now: Instant, component: JausId, report: u16, json: Bytes) {
        let key = Key::Json { component, report };
        let view = Publication {
            key: self.prefix.key(&key),
            payload: json,
            priority: None,
            waits: false,
        };
        if !self.queue.publish(now, view) {
            self.counters.add(Counter::QueueFull);
        }
    }

    /// Counts a refused request for a view.
    pub fn count_refused_view(&mut self) {
        self.counters.add(Counter::ViewsRefused);
    }

    /// Publishes the messages whose minimum period is over.
    pub fn handle_timeout(&mut self, now: Instant) {
        while let Some(publication) = self.thinner.poll(now) {
            self.queue(now, publication);
        }
    }

    /// When to call [`handle_timeout`](Self::handle_timeout).
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.thinner.poll_timeout()
    }

    /// Forgets components of this side that have been silent. Call it about once a second.
    pub fn expire(&mut self, now: Instant) {
        let all: Vec<_> = self.locals.keys().copied().collect();
        for id in all {
            if self.is_local(now, id) {
                continue;
            }
            self.locals.remove(&id);
            self.queue.declare(Command::Withdraw(id));
            if self.accept.trusts(id) {
                self.release(now, id);
            } else if self.silent.len() < MOST_OF_BRIDGE {
                self.silent.insert(id, now);
            }
        }
        let silent = std::mem::take(&mut self.silent);
        let is_kept =
            |&(_, since): &(JausId, Instant)| now.saturating_duration_since(since) < ID_HELD;
        let (kept, over): (Vec<_>, Vec<_>) = silent.into_iter().partition(is_kept);
        self.silent = kept.into_iter().collect();
        for (id, _) in over {
            self.release(now, id);
        }
        self.repeat_calls(now);
    }

    /// Withdraws all components of this side, because the node stops.
    pub fn close(&mut self) {
        let withdraw = |(id, _)| Command::Withdraw(id);
        for command in std::mem::take(&mut self.locals).into_iter().map(withdraw) {
            self.queue.declare(command);
        }
        self.phase = Phase::Closed;
    }

    /// The next message or closed session for the node.
    pub fn poll_arrival(&mut self) -> Option<Arrival> {
        self.arrivals.pop()
    }

    /// The next command for the zenoh session.
    pub fn poll_command(&mut self, now: Instant) -> Option<Command> {
        let command = self.queue.pop(now);
        let late = self.queue.take_late();
        self.counters.add_many(Counter::TooLate, late);
        command
    }

    /// Whether no command waits.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.queue.is_empty()
    }
}

/// Whether a component that was heard then still counts as present.
fn is_recent(now: Instant, heard: Instant) -> bool {
    now.saturating_duration_since(heard) < LOCAL_FOR
}

/// The frame of a datagram that holds exactly one, with the AS5669A header.
fn only_frame(payload: &Bytes) -> Option<Frame> {
    if payload.len() > LARGEST {
        return None;
    }
    let mut frames = judp::frames(payload.clone()).ok()?;
    let frame = frames.next()?.ok()?;
    let is_whole = frames.version() == Version::As5669a && frames.remaining() == 0;
    (is_whole && frame.is_plausible()).then_some(frame)
}

/// Whether a message waits for room on a congested link. Those that are not repeated by their sender
/// anyway are dropped there: newer ones follow.
fn waits(frame: &Frame) -> bool {
    frame.flags.acknowledgement() != Acknowledgement::None
        || frame.flags.data() != DataControl::Single
}

#[cfg(test)]
mod tests;
