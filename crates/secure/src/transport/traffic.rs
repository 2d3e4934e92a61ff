//! The datagrams of established sessions: screened on both ways, recorded, answered where refused.

use std::time::{Duration, Instant};

use bytes::{BufMut as _, Bytes, BytesMut};
use jaus::endpoint::SessionId;
use jaus::link::custom::Arrival;
use jaus::rights::{Decision, Unaccepted, denial};
use jaus::wire::{DataControl, Frame, Priority, judp};
use quinn_proto::StreamId;

use super::instances::HELLO;
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
    /// separate it from their sources.
    fn permitted(&mut self, session: SessionId, datagram: &Bytes) -> Option<Bytes> {
        let peers = || self.sessions.values().filter_map(Session::established);
        let has_limits = peers().any(|peer| !peer.rules.with.is_empty());
        let to = self.sessions.get(&session)?.established()?;
        let screened = screen::screen(datagram, |frame| {
            let is_addressed = to.ids.iter().any(|ids| ids.overlaps(frame.destination));
            let is_open = || {
                let speaks = |peer: &&Peer| peer.speaks_for(frame.source);
                let origins: Vec<_> = peers().filter(speaks).collect();
                screen::may_pass(frame.source, &origins, to)
            };
            let passes = is_addressed && (!has_limits || is_open());
            passes.then_some(true).ok_or(Unaccepted::Source)
        })?;
        let stopped = screened.frames.iter().filter(|(_, it)| it.is_err()).count();
        self.counters.add_many(Counter::Separated, stopped as u64);
        screened.passed
    }

    /// Records what components tell the peer about its control.
    fn record_answers(&mut self, id: SessionId, datagram: &Bytes) {
        let Ok(frames) = judp::frames(datagram.clone()) else {
            return;
        };
        for frame in frames.map_while(Result::ok) {
            if let Some(told) = Decision::told_by(&frame, &self.table) {
                self.record(id, Act::Decided(told));
            }
        }
    }

    /// Whether to refuse what changes something, because it could not be recorded.
    pub const fn refuse_commands(&mut self, is_refusing: bool) {
        self.is_refusing = is_refusing;
    }

    /// Reads the QUIC datagrams of a session.
    pub(super) fn read_datagrams(&mut self, now: Instant, id: SessionId) {
        let mut datagrams = Vec::new();
        if let Some(session) = self.sessions.get_mut(&id) {
            datagrams.extend(std::iter::from_fn(|| session.connection.datagrams().recv()));
        }
        for datagram in datagrams {
            self.receive(now, id, &datagram);
        }
    }

    /// Reads a stream of a session.
    pub(super) fn read_stream(&mut self, now: Instant, id: SessionId, stream: StreamId) {
        let mut datagrams = Vec::new();
        if let Some(session) = self.sessions.get_mut(&id) {
            session.read(stream, |datagram| datagrams.push(datagram));
        }
        for datagram in datagrams {
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
        let Some(octets) = self.undisputed(now, id, octets) else {
            return;
        };
        let Some(session) = self.sessions.get_mut(&id) else {
            return;
        };
        let Some(peer) = session.established() else {
            return;
        };
        let Some(screened) = screen::incoming(peer, (&self.table, !self.is_refusing), &octets)
        else {
            self.counters.add(Counter::Malformed);
            return;
        };
        session.received += 1;
        for (frame, checked) in &screened.frames {
            self.handle_decision(now, id, frame, *checked);
        }
        let is_part = |frame: &Frame| frame.flags.data() != DataControl::Single;
        let has_parts = screened.frames.iter().any(|(frame, _)| is_part(frame));
        let passed = match screened.passed {
            Some(datagram) if has_parts => self.continued(id, &datagram),
            passed => passed,
        };
        for octets in passed.into_iter().chain(screened.narrowed) {
            let session = id;
            self.arrivals
                .push_back(Arrival::Datagram { session, octets });
        }
    }

    /// A datagram without later fragments that continue no message of this session.
    fn continued(&mut self, id: SessionId, datagram: &Bytes) -> Option<Bytes> {
        let mut stopped = 0;
        let screened = screen::screen(datagram, |frame| {
            let passes = self.fragments.admit(id, frame);
            stopped += u64::from(!passes);
            Ok(passes)
        })?;
        self.counters.add_many(Counter::StrayFragments, stopped);
        screened.passed
    }

    /// Records the decision on a frame of the peer; of a refused one, tells the peer.
    fn handle_decision(
        &mut self,
        now: Instant,
        id: SessionId,
        frame: &Frame,
        checked: Result<(), Unaccepted>,
    ) {
        let Some(decision) = Decision::of(frame, checked, &self.table) else {
            return;
        };
        match checked {
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
