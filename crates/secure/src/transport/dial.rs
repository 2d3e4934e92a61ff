//! The addresses to dial, and when: those of the settings, and those that beacons have shown.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use jaus::endpoint::SessionId;

use super::{Session, Transport, tokens, zone};
use crate::beacon::{self, Sighting};
use crate::key::PublicKey;

/// The pause after the first failure; it doubles with each further one.
const FIRST_PAUSE: Duration = Duration::from_millis(250);
/// The longest pause.
const LONGEST_PAUSE: Duration = Duration::from_secs(8);
/// How long the greater of two keys waits for the dial of the other one. It dials itself then,
/// because its own beacons may not arrive.
pub(super) const PATIENCE: Duration = Duration::from_secs(5);

#[derive(Debug)]
pub(super) struct Dial {
    address: SocketAddr,
    /// The attempt, or the session with the peer at the address.
    pub(super) session: Option<SessionId>,
    pause: Duration,
    /// When the next attempt is due; `None` at once.
    due: Option<Instant>,
    /// For an address from beacons: which peer is there, and until when they count.
    sighted: Option<Sighted>,
}

#[derive(Clone, Copy, Debug)]
struct Sighted {
    key: PublicKey,
    /// `None` after the last beacon has expired.
    until: Option<Instant>,
}

impl Dial {
    pub(super) const fn new(address: SocketAddr) -> Self {
        Self {
            address,
            session: None,
            pause: FIRST_PAUSE,
            due: None,
            sighted: None,
        }
    }

    /// When the next attempt is due, unless there is a session or this is the first attempt.
    pub(super) const fn due(&self) -> Option<Instant> {
        match self.session {
            Some(_) => None,
            None => self.due,
        }
    }

    /// The address, if an attempt is due.
    fn start(&mut self, now: Instant) -> Option<SocketAddr> {
        if self.session.is_some() {
            return None;
        }
        if self
            .sighted
            .is_some_and(|it| it.until.is_none_or(|until| until <= now))
        {
            self.rest();
            return None;
        }
        if self.due.is_some_and(|due| due > now) {
            return None;
        }
        self.due = None;
        Some(self.address)
    }

    /// Makes the next attempt due at once.
    pub(super) const fn hasten(&mut self) {
        self.due = None;
    }

    /// Makes no more attempts until a beacon comes.
    const fn rest(&mut self) {
        self.due = None;
        if let Some(sighted) = &mut self.sighted {
            sighted.until = None;
        }
    }

    /// Whether it is for another peer when a beacon of that one comes.
    const fn is_unused(&self) -> bool {
        matches!(self.sighted, Some(Sighted { until: None, .. })) && self.session.is_none()
    }

    pub(super) const fn established(&mut self, session: SessionId) {
        self.session = Some(session);
        self.pause = FIRST_PAUSE;
    }

    /// Handles the end of the session or attempt. After a session that `was_good`, the next attempt
    /// follows soon.
    pub(super) fn lost(&mut self, now: Instant, was_good: bool) {
        self.session = None;
        if was_good {
            self.pause = FIRST_PAUSE;
        }
        self.due = Some(now + self.pause);
        self.pause = (2 * self.pause).min(LONGEST_PAUSE);
    }
}

impl Transport {
    /// Dials a peer that a beacon has shown, unless there is a session with it. Attempts follow each
    /// other as with configured addresses, and end when the last beacon is 30 s old. Of the two
    /// nodes, the one with the smaller public key dials; the other one does after 5 s.
    pub fn handle_sighting(&mut self, now: Instant, sighting: Sighting) {
        let Sighting { key, address } = sighting;
        let until = Some(now + beacon::LIFETIME);
        let index = self.dial_of(key);
        let Some(dial) = self.dials.get_mut(index) else {
            return;
        };
        let was_in_sight = dial
            .sighted
            .is_some_and(|it| it.key == key && it.until.is_some());
        dial.address = address;
        dial.sighted = Some(Sighted { key, until });
        if !was_in_sight && dial.session.is_none() {
            dial.pause = FIRST_PAUSE;
            dial.due = (self.own > key).then_some(now + PATIENCE);
        }
        self.dial(now);
    }

    /// The index of the dial for a peer in sight: there is one for each at most. Without one, that of
    /// a peer that is out of sight, or else a new one; so there are not more than trusted keys.
    fn dial_of(&mut self, key: PublicKey) -> usize {
        let of_key = |it: &Dial| it.sighted.is_some_and(|sighted| sighted.key == key);
        let found = self.dials.iter().position(of_key);
        let unused = || self.dials.iter().position(Dial::is_unused);
        found.or_else(unused).unwrap_or_else(|| {
            let new = self.dials.len();
            // Its address and key are set by the caller.
            self.dials.push(Dial::new(SocketAddr::from(([0; 4], 0))));
            new
        })
    }

    /// Makes the attempts that are due.
    pub(super) fn dial(&mut self, now: Instant) {
        for index in 0..self.dials.len() {
            let sighted = self.dials[index].sighted;
            if sighted.is_some_and(|it| self.has_session(it.key)) {
                if self.dials[index].session.is_none() {
                    self.dials[index].rest();
                }
                continue;
            }
            let Some(address) = self.dials[index].start(now) else {
                continue;
            };
            let (client, name) = (self.client.clone(), tokens::name_of(address));
            let inside = zone::embed(address);
            match self.endpoint.connect(now, client, inside, &name) {
                Ok((handle, connection)) => {
                    let id = self.insert(Session::new(handle, connection, Some(index)));
                    self.dials[index].session = Some(id);
                }
                Err(error) => {
                    tracing::warn!(%address, %error, "cannot dial the secure peer");
                    self.dials[index].lost(now, false);
                }
            }
        }
    }

    fn has_session(&self, key: PublicKey) -> bool {
        let mut peers = self.sessions.values().filter_map(Session::established);
        peers.any(|peer| peer.key == key)
    }
}
