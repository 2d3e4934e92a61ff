//! The datagrams of established sessions: screened on both ways, recorded, answered where refused.

use std::time::{Duration, Instant};

use bytes::{BufMut as _, Bytes, BytesMut};
use jaus::endpoint::SessionId;
use jaus::link::custom::Arrival;
use jaus::rights::{Admitted, Unaccepted, check_unrecorded, denial};
use jaus::wire::{Frame, Priority, judp};
use quinn_proto::StreamId;

use super::instances::{HELLO, only_stops};
use super::record::{Act, Record};
use super::screen;
use super::session::Session;
use super::{Counter, Transport};
use crate::trust::Peer;

/// The first octet of a notice: text for the peer, about a message of its that was refused. No
/// JAUS transport begins with it.
const NOTICE: u8 = 0xFE;
/// The longest text of a notice, in octets.
const LONGEST_NOTICE: usize = 300;
/// The shortest interval between notices of a session.
const NOTICE_PAUSE: Duration = Duration::from_secs(1);

/// Why a frame of a peer does not pass.
#[derive(Clone, Copy, Debug)]
enum Refused {
    /// Its sender may not send it.
    Unaccepted(Unaccepted),
    /// Another program with the same key, the one of this session, uses its id.
    Disputed(SessionId),
    /// It continues no message of its session.
    Stray,
}

impl Transport {
    /// Queues a JUDP datagram for a session. It is dropped if the session has ended.
    pub fn send(&mut self, session: SessionId, priority: Priority, datagram: &Bytes) {
        let is_established = |it: &Session| it.established().is_some();
        if !self.sessions.get(&session).is_some_and(is_established) {
            self.counters.add(Counter::NoSession);
            return;
        }
        let Some(datagram) = self.permitted(session, datagram) else {
            return;
        };
        self.record_answers(session, &datagram);
        if let Some(session) = self.sessions.get_mut(&session) {
            let dropped = session.queue(priority, datagram);
            self.counters.add_many(Counter::SendOverflows, dropped);
        }
    }

    /// Queues a JUDP datagram for every session.
    pub fn send_to_all(&mut self, priority: Priority, datagram: &Bytes) {
        let established = self
            .sessions
            .iter()
            .filter(|(_, it)| it.established().is_some());
        for id in established.map(|(&id, _)| id).collect::<Vec<_>>() {
            self.send(id, priority, datagram);
        }
    }

    /// What of a datagram may go to this session: messages for its ids, as far as the rules do not
    /// separate it from their sources, nor forbid it to query what they report.
    fn permitted(&mut self, session: SessionId, datagram: &Bytes) -> Option<Bytes> {
        let peers = || self.sessions.values().filter_map(Session::established);
        let has_limits = peers().any(|peer| !peer.rules.with.is_empty());
        let to = self.sessions.get(&session)?.established()?;
        let mut stopped = 0;
        let passed = screen::screen(datagram, |frame| {
            let is_addressed = to.ids.iter().any(|ids| ids.overlaps(frame.destination));
            let is_open = || {
                let speaks = |peer: &&Peer| peer.speaks_for(frame.source);
                let origins: Vec<_> = peers().filter(speaks).collect();
                screen::may_pass(frame.source, &origins, to)
            };
            let passes = is_addressed
                && (!has_limits || is_open())
                && to.rules.may_receive(frame, &self.table);
            stopped += u64::from(!passes);
            passes
        })?;
        self.counters.add_many(Counter::Separated, stopped);
        passed
    }

    /// Records what components tell the peer about its control.
    fn record_answers(&mut self, id: SessionId, datagram: &Bytes) {
        let Ok(frames) = judp::frames(datagram.clone()) else {
            return;
        };
        for frame in frames.map_while(Result::ok) {
            if let Some(told) = self.in_control.told(&frame, &self.table) {
                self.record(id, Act::Decided(told));
            }
        }
    }

    /// Whether to refuse what changes something, because it could not be recorded.
    pub const fn refuse_commands(&mut self, is_refusing: bool) {
        self.is_refusing = is_refusing;
    }

    /// Reads a stream of a session; without one, its QUIC datagrams.
    pub(super) fn read(&mut self, now: Instant, id: SessionId, stream: Option<StreamId>) {
        let Some(session) = self.sessions.get_mut(&id) else {
            return;
        };
        let mut received = Vec::new();
        match stream {
            Some(stream) => session.read(stream, |it| received.push(it)),
            None => received.extend(std::iter::from_fn(|| session.connection.datagrams().recv())),
        }
        for datagram in received {
            self.receive(now, id, &datagram);
        }
    }

    /// Processes a JUDP datagram, a greeting or a notice.
    fn receive(&mut self, now: Instant, id: SessionId, octets: &Bytes) {
        let Some(session) = self.sessions.get_mut(&id) else {
            return;
        };
        if octets.is_empty() && session.is_awaiting_greeting() {
            self.establish(now, id);
            return;
        }
        let Some(peer) = session.established() else {
            return;
        };
        if octets.first() == Some(&NOTICE) {
            let text = String::from_utf8_lossy(&octets[1..octets.len().min(1 + LONGEST_NOTICE)]);
            if session.heard.is_none_or(|at| now >= at + NOTICE_PAUSE) {
                tracing::warn!(peer = peer.name, notice = ?text, "the peer refused a message");
                session.heard = Some(now);
            }
            self.counters.add(Counter::NoticesReceived);
            return;
        }
        if octets.first() == Some(&HELLO) {
            self.handle_hello(now, id, octets);
            return;
        }
        let mut narrowed = Vec::new();
        let each = |frame: &Frame| self.handle_frame(now, id, frame, &mut narrowed);
        let Some(passed) = screen::screen(octets, each) else {
            self.counters.add(Counter::Malformed);
            return;
        };
        if let Some(session) = self.sessions.get_mut(&id) {
            session.received += 1;
        }
        let narrowed = narrowed.iter().filter_map(|copy| judp::encode(copy).ok());
        for octets in passed.into_iter().chain(narrowed) {
            let session = id;
            self.arrivals
                .push_back(Arrival::Datagram { session, octets });
        }
    }

    /// Decides on a frame of the peer; returns whether it passes as it is. If it passes to a part of the
    /// ids that it is for, adds a copy for each.
    fn handle_frame(
        &mut self,
        now: Instant,
        id: SessionId,
        frame: &Frame,
        narrowed: &mut Vec<Frame>,
    ) -> bool {
        let checked = self.check(now, id, frame);
        let accepted = match checked {
            Ok(_) => Ok(()),
            Err(Refused::Unaccepted(why)) => Err(why),
            Err(Refused::Disputed(holder)) => {
                self.refuse_disputed(now, id, holder, frame);
                return false;
            }
            Err(Refused::Stray) => {
                self.counters.add(Counter::StrayFragments);
                return false;
            }
        };
        if let Some(decision) = self.in_control.decision(frame, accepted, &self.table) {
            match accepted {
                Ok(()) => {}
                // Of a peer that speaks for others, nobody can be answered.
                Err(Unaccepted::Source) => self.counters.add(Counter::ForeignIds),
                Err(Unaccepted::Rule(_)) => {
                    self.counters.add(Counter::RuleForbids);
                    self.answer_refusal(now, id, frame, &decision.to_string());
                }
            }
            self.record(id, Act::Decided(decision));
        }
        let Ok(admitted) = checked else {
            return false;
        };
        let copies = admitted.copies(frame);
        let passes_whole = copies.is_none();
        narrowed.extend(copies.into_iter().flatten());
        passes_whole
    }

    /// Whether a frame of the peer may pass: its source is an id of the peer, which no other program with
    /// the same key uses, the rules allow it, it can be recorded, and a fragment continues a message of
    /// this session.
    fn check(&mut self, now: Instant, id: SessionId, frame: &Frame) -> Result<Admitted, Refused> {
        let (table, source) = (&self.table, frame.source);
        let peer = self.sessions.get(&id).and_then(Session::established);
        let trust = self.credentials.trust();
        let peer = peer.filter(|it| it.speaks_for(source) && !trust.is_others(it, source));
        let peer = peer.ok_or(Refused::Unaccepted(Unaccepted::Source))?;
        let other = self.other_user(now, id, peer.key, source);
        // A stop does not fail because two programs use one id.
        if let Some(other) = other.filter(|_| !only_stops(frame, table)) {
            return Err(Refused::Disputed(other));
        }
        let rule = |why| Refused::Unaccepted(Unaccepted::Rule(why));
        let admitted = peer.rules.admit(frame, table).map_err(rule)?;
        if self.is_refusing {
            check_unrecorded(frame, table).map_err(rule)?;
        }
        if !self.fragments.admit(id, frame) {
            return Err(Refused::Stray);
        }
        if let Some(session) = self.sessions.get_mut(&id).filter(|_| other.is_none()) {
            session.used.note(now, source);
        }
        Ok(admitted)
    }

    /// Tells the peer what was refused: in the words of JAUS if it asked for control, and in a
    /// notice.
    pub(super) fn answer_refusal(
        &mut self,
        now: Instant,
        id: SessionId,
        frame: &Frame,
        sentence: &str,
    ) {
        let Some(session) = self.sessions.get_mut(&id) else {
            return;
        };
        let mut dropped = 0;
        if let Some(denial) = denial(frame)
            && let Ok(denial) = judp::encode(&denial)
        {
            dropped += session.queue(frame.flags.priority(), denial);
        }
        if session.noticed.is_none_or(|at| now >= at + NOTICE_PAUSE) {
            session.noticed = Some(now);
            let name = session.established().map_or("", |it| &it.name);
            tracing::warn!(peer = name, "refused {sentence}");
            let mut notice = BytesMut::new();
            notice.put_u8(NOTICE);
            notice.put_slice(&sentence.as_bytes()[..sentence.len().min(LONGEST_NOTICE)]);
            dropped += session.queue(Priority::Standard, notice.freeze());
        }
        self.counters.add_many(Counter::SendOverflows, dropped);
    }

    /// Adds a record about an established session.
    pub(super) fn record(&mut self, id: SessionId, act: Act) {
        let Some(session) = self.sessions.get(&id) else {
            return;
        };
        let address = session.address();
        self.push_record(Record {
            peer: session.peer.as_ref().map(|it| it.name.clone()),
            key: session.peer.as_ref().map(|it| it.key),
            address,
            act,
        });
    }

    /// Adds a record.
    pub(super) fn push_record(&mut self, record: Record) {
        if !self.records.push(record) {
            self.counters.add(Counter::RecordsLost);
        }
    }

    /// The next record for an audit log, and how often it came. Those for which the queue has no room are
    /// counted as [`Counter::RecordsLost`].
    pub fn poll_record(&mut self) -> Option<(Record, u64)> {
        self.records.pop()
    }
}
