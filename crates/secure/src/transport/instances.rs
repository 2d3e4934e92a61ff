//! Programs that share a key: several of one host's, side by side.
//!
//! Each program has a random number, its instance, and tells it to the peer in a hello after the
//! handshake. A session belongs to a key and an instance. Who does not know the instance of another
//! program cannot take its place, even with the same key.
//!
//! A JAUS id belongs to the instance that has used it last, while that one is alive: the other's
//! messages from this id are refused, but for a stop, and the owner of the id is sent pings. If nothing
//! comes from it for a second, or for four round trips if that is longer, because it was killed or
//! restarted, its session ends and the id is free.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::endpoint::SessionId;
use jaus::rights::{Permission, Table};
use jaus::wire::{DataControl, Frame};
use jaus_limits::{last_of_crowd, quota_address};

use super::record::Act;
use super::session::Session;
use super::{Counter, Transport, WARNING_PAUSE, code};
use crate::key::{self, PublicKey};

/// The first octet of a hello. No JAUS transport begins with it.
pub(super) const HELLO: u8 = 0xFD;
/// The octets of an instance.
const LENGTH: usize = 16;
/// The least time, and the round trips, within which a sign of life of the owner of an id must come.
const ANSWER: Duration = Duration::from_secs(1);
const ANSWER_ROUND_TRIPS: u32 = 4;
/// Pings in that time, while nothing is heard. At a loss of 30 % each way, all fail once in 50 000 times.
const PINGS: u32 = 16;
/// A session without a packet for this time gives way to a new one if its key has too many. Peers
/// send keep-alives every second.
const SILENCE: Duration = Duration::from_millis(2500);
/// Programs of one key that may have sessions at the same time.
pub(super) const MOST_INSTANCES: usize = 16;
/// Ids that are remembered as used by a session. Further ones are not protected.
const MOST_IDS: usize = 1024;
/// How long an id that is not used remains that of its session.
const LEASE: Duration = Duration::from_secs(30);

/// A running program among those with the same key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Instance([u8; LENGTH]);

impl Instance {
    /// A new one. Without random numbers there are no sessions that it could distinguish.
    pub(super) fn random() -> Self {
        Self(key::random().unwrap_or_default())
    }

    /// The message that tells it to a peer.
    pub(super) fn hello(self) -> [u8; 1 + LENGTH] {
        let mut hello = [HELLO; 1 + LENGTH];
        hello[1..].copy_from_slice(&self.0);
        hello
    }

    /// Reads a hello. Later versions may append to it.
    fn parse(hello: &[u8]) -> Option<Self> {
        let (octets, _) = hello.get(1..)?.split_first_chunk()?;
        Some(Self(*octets))
    }
}

/// A question for a sign of life.
#[derive(Clone, Copy, Debug)]
pub(super) struct Asked {
    since: Instant,
    until: Instant,
    /// The next ping.
    next: Instant,
    pause: Duration,
}

/// The ids that a session has used, with the time of the last message.
#[derive(Debug, Default)]
pub(super) struct UsedIds(BTreeMap<JausId, Instant>);

impl UsedIds {
    pub(super) fn note(&mut self, now: Instant, id: JausId) {
        if self.0.len() >= MOST_IDS && !self.0.contains_key(&id) {
            self.0.retain(|_, last| now < *last + LEASE);
            if self.0.len() >= MOST_IDS {
                return;
            }
        }
        self.0.insert(id, now);
    }

    fn holds(&self, now: Instant, id: JausId) -> bool {
        self.0.get(&id).is_some_and(|last| now < *last + LEASE)
    }
}

/// Whether a frame does nothing but stop something. To release control is to take it from the program that
/// uses the id.
pub(super) fn only_stops(frame: &Frame, table: &Table) -> bool {
    let is_whole = frame.flags.data() == DataControl::Single && !frame.is_acknowledgement();
    let mut needs = table.needs(&frame.payload);
    is_whole && table.stops(&frame.payload) && needs.all(|it| it != Permission::Release)
}

impl Transport {
    /// Ends a session with this key if there is no place for a new one from this address: a silent one, or
    /// one of another address that has most of them, so that a thief of the key does not keep its owner out.
    /// Returns whether there is a place.
    pub(super) fn has_place_for(
        &mut self,
        now: Instant,
        key: PublicKey,
        address: SocketAddr,
    ) -> bool {
        let of_key: Vec<_> = self
            .with_key(key)
            .map(|(id, it)| (it.heard_at, id, SILENCE.max(it.answer_time())))
            .collect();
        if of_key.len() < MOST_INSTANCES {
            return true;
        }
        let longest_silent = of_key.into_iter().min();
        let is_silent =
            |&(at, _, time): &(Option<Instant>, _, _)| at.is_none_or(|at| at + time <= now);
        let silent = longest_silent.filter(is_silent).map(|(_, id, _)| id);
        match silent.or_else(|| self.crowding(key, address)) {
            Some(id) => {
                self.end(now, id, code::DUPLICATE, "too many programs with this key");
                true
            }
            None => {
                if self.warned.is_none_or(|at| now >= at + WARNING_PAUSE) {
                    self.warned = Some(now);
                    tracing::warn!(
                        %key,
                        "refused: {MOST_INSTANCES} programs with this key are connected. Attach programs of \
                         one host to one node (--attach), or give them keys of their own"
                    );
                }
                false
            }
        }
    }

    /// The newest session with this key of the address that has most of them, unless the newcomer's has as many.
    fn crowding(&self, key: PublicKey, newcomer: SocketAddr) -> Option<SessionId> {
        let host = |address: SocketAddr| quota_address(address.ip());
        let sessions = self.with_key(key).map(|(id, it)| (id, host(it.address())));
        let sessions: Vec<_> = sessions.collect();
        last_of_crowd(&sessions, &host(newcomer), |it| it.1).map(|at| sessions[at].0)
    }

    /// Handles the hello of a peer.
    pub(super) fn handle_hello(&mut self, now: Instant, id: SessionId, hello: &[u8]) {
        let Some(session) = self.sessions.get_mut(&id) else {
            return;
        };
        match (Instance::parse(hello), session.instance) {
            (Some(told), None) => {
                session.instance = Some(told);
                self.keep_one(now, id);
            }
            (Some(_), Some(_)) => {}
            (None, _) => self.counters.add(Counter::Malformed),
        }
    }

    /// Leaves one session with a program; `newer` is the one whose instance was learned just now.
    fn keep_one(&mut self, now: Instant, newer: SessionId) {
        let Some(session) = self.sessions.get(&newer) else {
            return;
        };
        let Some(key) = session.established().map(|it| it.key) else {
            return;
        };
        let (instance, newer_is_ours) = (session.instance, session.dial.is_some());
        let same = self.with_key(key).find_map(|(id, it)| {
            let is_same = id != newer && it.instance == instance;
            is_same.then_some((id, it.dial.is_some()))
        });
        let Some((older, older_is_ours)) = same else {
            return;
        };
        let (kept, other) = match older_is_ours {
            one if one == newer_is_ours => (newer, older),
            ours if ours == (self.own < key) => (older, newer),
            _ => (newer, older),
        };
        for dial in &mut self.dials {
            if dial.session == Some(other) {
                dial.session = Some(kept);
            }
        }
        let reason = "another session with the same program";
        self.end(now, other, code::DUPLICATE, reason);
    }

    /// Sends the pings that are due, and ends the sessions of programs that have not answered in time.
    pub(super) fn ping_owners(&mut self, now: Instant) {
        let sessions = self.sessions.iter_mut();
        let silent = sessions.filter_map(|(&id, it)| it.has_fallen_silent(now).then_some(id));
        for id in silent.collect::<Vec<_>>() {
            let reason = "another program with the same key uses its id, and it does not answer";
            self.end(now, id, code::DUPLICATE, reason);
        }
    }

    /// The other session with this key whose program uses an id.
    pub(super) fn other_user(
        &self,
        now: Instant,
        session: SessionId,
        key: PublicKey,
        id: JausId,
    ) -> Option<SessionId> {
        let mut others = self.with_key(key).filter(|(it, _)| *it != session);
        let user = others.find(|(_, it)| it.used.holds(now, id));
        user.map(|(session, _)| session)
    }

    /// Refuses a message from an id of another program, and finds out whether that one is alive.
    pub(super) fn refuse_disputed(
        &mut self,
        now: Instant,
        id: SessionId,
        owner: SessionId,
        frame: &Frame,
    ) {
        let (source, destination) = (frame.source, frame.destination);
        self.counters.add(Counter::DisputedIds);
        self.record(
            id,
            Act::DisputedId {
                source,
                destination,
            },
        );
        let Some(owner) = self.sessions.get_mut(&owner) else {
            return;
        };
        owner.ask(now);
        let (name, address) = (self.table.name_of(&frame.payload), owner.address());
        let sentence = format!(
            "{name} from {source} to {destination}: the program at {address} has the same key and uses this \
             id: stop it, give one of them another id, or attach both to one node"
        );
        self.answer_refusal(now, id, frame, &sentence);
    }

    /// The established sessions with this key.
    pub(super) fn with_key(&self, key: PublicKey) -> impl Iterator<Item = (SessionId, &Session)> {
        let sessions = self.sessions.iter().map(|(&id, it)| (id, it));
        sessions.filter(move |(_, it)| it.established().is_some_and(|it| it.key == key))
    }
}

impl Session {
    /// Notes whether packets have come that QUIC has authenticated: others may come from any sender.
    pub(super) fn note_packets(&mut self, now: Instant) {
        let frames = self.connection.stats().frame_rx;
        let frames = frames.acks + frames.ping + frames.datagram + frames.stream;
        if frames != self.frames {
            self.frames = frames;
            self.heard_at = Some(now);
        }
    }

    /// How long a living peer may be silent that is sent pings.
    fn answer_time(&self) -> Duration {
        ANSWER.max(ANSWER_ROUND_TRIPS * self.connection.rtt())
    }

    /// Sends pings until there is a sign of life.
    fn ask(&mut self, now: Instant) {
        let time = self.answer_time();
        self.asked.get_or_insert(Asked {
            since: now,
            until: now + time,
            next: now,
            pause: time / PINGS,
        });
    }

    /// Sends the ping that is due; returns whether there was no sign of life in time.
    fn has_fallen_silent(&mut self, now: Instant) -> bool {
        let Some(asked) = self.asked.as_mut().filter(|_| !self.ended) else {
            return false;
        };
        let is_silent = self.heard_at.is_none_or(|at| at <= asked.since);
        if asked.until <= now {
            self.asked = None;
            return is_silent;
        }
        if asked.next <= now {
            asked.next = (now + asked.pause).min(asked.until);
            if is_silent {
                self.connection.ping();
            }
        }
        false
    }

    /// When the next ping is due, or its answer.
    pub(super) fn ping_due(&self) -> Option<Instant> {
        self.asked.filter(|_| !self.ended).map(|it| it.next)
    }
}
