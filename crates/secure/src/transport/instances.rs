//! Programs that share a key: several of one host's, side by side.
//!
//! Each program has a random number, its instance, and tells it to the peer in a hello after the
//! handshake. A session belongs to a key and an instance. Who does not know the instance of another
//! program cannot take its place, even with the same key.
//!
//! A JAUS id belongs to the instance that has used it last, while that one is alive: the other's
//! messages from this id are refused, but for a stop, and the owner of the id is sent a ping. If it does
//! not answer, because it was killed or restarted, its session ends and the id is free.
//!
//! Peers before this version send no hello. After [`PATIENCE`] all programs of such a key count as
//! one: the newer session replaces the older.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use bytes::{BufMut as _, Bytes, BytesMut};
use jaus::address::JausId;
use jaus::endpoint::SessionId;
use jaus::rights::{Permission, Table};
use jaus::wire::{DataControl, Frame};

use super::record::Act;
use super::session::Session;
use super::{Counter, Transport, WARNING_PAUSE, code};
use crate::key::{self, PublicKey};

/// The first octet of a hello. No JAUS transport begins with it.
pub(super) const HELLO: u8 = 0xFD;
/// The octets of an instance.
const LENGTH: usize = 16;
/// How long after the handshake the hello of a peer may arrive.
pub(super) const PATIENCE: Duration = Duration::from_secs(2);
/// How long the owner of an id has to answer a ping. Round trips are shorter, or the link is no use.
const ANSWER: Duration = Duration::from_secs(1);
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
    /// That of all programs that do not tell theirs.
    pub(super) const UNNAMED: Self = Self([0; LENGTH]);

    /// A new one; without random numbers the program behaves as one before this version.
    pub(super) fn random() -> Self {
        key::random().map_or(Self::UNNAMED, Self)
    }

    /// The message that tells it to a peer.
    pub(super) fn hello(self) -> Option<Bytes> {
        let mut hello = BytesMut::with_capacity(1 + LENGTH);
        hello.put_u8(HELLO);
        hello.put_slice(&self.0);
        (self != Self::UNNAMED).then(|| hello.freeze())
    }

    /// Reads a hello. Later versions may append to it.
    fn parse(hello: &[u8]) -> Option<Self> {
        let (octets, _) = hello.get(1..)?.split_first_chunk()?;
        Some(Self(*octets))
    }
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

/// Whether a frame does nothing but set an emergency, which everybody may.
pub(super) fn only_stops(frame: &Frame, table: &Table) -> bool {
    let is_whole = frame.flags.data() == DataControl::Single && !frame.is_acknowledgement();
    let mut needs = table.needs(&frame.payload).peekable();
    is_whole && needs.peek().is_some() && needs.all(|it| it == Permission::Emergency)
}

impl Transport {
    /// Ends a silent session with this key if there is no place for a new one; returns whether there is
    /// a place.
    pub(super) fn has_place_for(&mut self, now: Instant, key: PublicKey) -> bool {
        let of_key: Vec<_> = self
            .with_key(key)
            .map(|(id, it)| (it.heard_at, id))
            .collect();
        if of_key.len() < MOST_INSTANCES {
            return true;
        }
        let longest_silent = of_key.into_iter().min();
        let silent = longest_silent.filter(|(at, _)| at.is_none_or(|at| at + SILENCE <= now));
        match silent {
            Some((_, id)) => {
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

    /// Handles the hello of a peer.
    pub(super) fn handle_hello(&mut self, now: Instant, id: SessionId, hello: &[u8]) {
        let Some(session) = self.sessions.get_mut(&id) else {
            return;
        };
        match (Instance::parse(hello), session.instance) {
            (Some(told), None | Some(Instance::UNNAMED)) => {
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

    /// Handles peers that have not told their instance, or not answered a ping, in time.
    pub(super) fn settle_instances(&mut self, now: Instant) {
        let is_due = |due: Option<Instant>| due.is_some_and(|due| due <= now);
        let (mut unnamed, mut lost) = (Vec::new(), Vec::new());
        for (&id, session) in &mut self.sessions {
            if is_due(session.hello_due()) {
                session.instance = Some(Instance::UNNAMED);
                unnamed.push(id);
            }
            if is_due(session.answer_due()) {
                let asked = session.asked.take();
                if session.heard_at <= asked {
                    lost.push(id);
                }
            }
        }
        for id in unnamed {
            self.keep_one(now, id);
        }
        for id in lost {
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
        if owner.asked.is_none() {
            owner.asked = Some(now);
            owner.connection.ping();
        }
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
    /// When its peer counts as one that does not tell its instance.
    fn hello_due(&self) -> Option<Instant> {
        let since = self
            .since
            .filter(|_| self.instance.is_none() && !self.ended);
        since.map(|since| since + PATIENCE)
    }

    /// When its peer has not answered a ping in time.
    fn answer_due(&self) -> Option<Instant> {
        let asked = self.asked.filter(|_| !self.ended);
        asked.map(|asked| asked + ANSWER)
    }

    /// When [`Transport::settle_instances`] is due for it.
    pub(super) fn settlement_due(&self) -> Option<Instant> {
        self.hello_due().into_iter().chain(self.answer_due()).min()
    }
}
