//! The protocol of a secure link, without I/O: handshakes, sessions, dials, and the check that each
//! key speaks only for its own ids.
//!
//! The owner passes in UDP datagrams ([`Transport::handle_datagram`]), time
//! ([`Transport::handle_timeout`]) and JUDP datagrams to send ([`Transport::send`],
//! [`Transport::send_to_all`]). Then it polls until there is no more output:
//! [`Transport::poll_arrival`] for what was received, [`Transport::poll_transmit`] for UDP datagrams,
//! [`Transport::poll_timeout`] for when to call `handle_timeout`.
//!
//! The side that was dialled sends an empty datagram on a stream when it has accepted the key of the
//! other side; with it the session begins for both.
//!
//! Two nodes that dial each other get two connections. Both sides keep the one that the smaller
//! public key dialled, or else the newer one. Several programs with one key have a session each.

mod admission;
mod dial;
mod egress;
mod fragments;
mod inlet;
mod instances;
mod parameters;
mod record;
mod renewal;
mod report;
mod screen;
mod session;
#[cfg(test)]
mod tests;
mod tokens;
mod traffic;
mod zone;

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::{Bytes, BytesMut};
use jaus::address::JausId;
use jaus::endpoint::SessionId;
use jaus::link::custom::Arrival;
use jaus::rights::{InControl, Table, WeightedQueue};
use quinn_proto::{
    ClientConfig, ConnectionError, ConnectionHandle, DatagramEvent, Endpoint, Event, StreamEvent,
};

pub use egress::Datagrams;
pub use inlet::{Inlet, framed};
pub use record::{Act, Fault, Record};
pub use report::{Counter, Counters, SessionReport};

use crate::authority::Rejection;
use crate::credentials::Credentials;
use crate::key::{Key, PublicKey};
use crate::tls::Refusals;
use crate::trust::TrustFile;
use admission::{Admission, MOST_RESPONSES};
use dial::Dial;
use egress::Budget;
use fragments::Fragments;
use instances::Instance;
use session::Session;
use tokens::Tokens;

/// The shortest interval between warnings about refused peers.
const WARNING_PAUSE: Duration = Duration::from_secs(10);

/// Close codes of this protocol.
mod code {
    pub(super) const SHUTDOWN: u32 = 0;
    pub(super) const DUPLICATE: u32 = 1;
    pub(super) const REVOKED: u32 = 2;
    pub(super) const RENEWED: u32 = 3;
    pub(super) const BUSY: u32 = 4;
}

/// The sessions of one node. See the [module](self).
#[derive(Debug)]
pub struct Transport {
    own: PublicKey,
    /// This program among those with the same key.
    instance: Instance,
    credentials: Credentials,
    /// What messages need, for the rules of the peers.
    table: Table,
    /// Whether what changes something is refused, because it could not be recorded.
    is_refusing: bool,
    /// The edition of the trust with which the sessions were last compared.
    edition: u64,
    /// Why new sessions are refused, as last reported.
    fault: Option<Arc<str>>,
    /// The edition of the own key and certificate in use.
    own_edition: u64,
    refusals: Refusals,
    warned: Option<Instant>,
    reminded: Option<Instant>,
    endpoint: Endpoint,
    client: ClientConfig,
    tokens: Tokens,
    admission: Admission,
    dials: Vec<Dial>,
    sessions: BTreeMap<SessionId, Session>,
    handles: HashMap<ConnectionHandle, SessionId>,
    next: u64,
    arrivals: VecDeque<Arrival>,
    /// The ids for which peers may speak, as the node was told last.
    spoken: Vec<JausId>,
    /// The unfinished messages of all sessions.
    fragments: Fragments,
    /// Answers outside of connections.
    responses: VecDeque<(SocketAddr, Bytes)>,
    /// How many of them were sent since the connections had their turn.
    responded: usize,
    records: WeightedQueue<Record>,
    in_control: InControl,
    counters: Counters,
    budget: Option<Budget>,
    /// How often a session was served within the budget.
    turns: u64,
    buffer: Vec<u8>,
}

impl Transport {
    /// Creates the transport of a node with this key. It accepts connections, and dials these
    /// addresses until it has a session with each.
    #[must_use]
    pub fn new(key: &Key, trust: TrustFile, dials: impl IntoIterator<Item = SocketAddr>) -> Self {
        Self::with_credentials(Credentials::pinned(key.clone(), trust), dials)
    }

    /// Creates the transport of a node with these credentials; otherwise as [`new`](Self::new). The
    /// owner sets their clock ([`Credentials::set_clock`]) before each `handle_timeout`.
    #[must_use]
    pub fn with_credentials(
        credentials: Credentials,
        dials: impl IntoIterator<Item = SocketAddr>,
    ) -> Self {
        let refusals = Refusals::default();
        let (own, own_edition) = (credentials.public(), credentials.own_edition());
        let tokens = Tokens::new(&credentials);
        let (server, client) = parameters::of_sides(&credentials, &refusals, &tokens);
        let config = Arc::new(parameters::of_endpoint(&credentials.own_key()));
        let mut transport = Self {
            own,
            instance: Instance::random(),
            table: Table::default(),
            is_refusing: false,
            edition: credentials.trust_edition(),
            fault: None,
            own_edition,
            credentials,
            refusals,
            warned: None,
            reminded: None,
            endpoint: Endpoint::new(config, Some(server), true, None),
            client,
            tokens,
            admission: Admission::new(),
            dials: dials.into_iter().map(Dial::new).collect(),
            sessions: BTreeMap::new(),
            handles: HashMap::new(),
            next: 0,
            arrivals: VecDeque::new(),
            spoken: Vec::new(),
            fragments: Fragments::default(),
            responses: VecDeque::new(),
            responded: 0,
            records: WeightedQueue::default(),
            in_control: InControl::default(),
            counters: Counters::default(),
            budget: None,
            turns: 0,
            buffer: Vec::new(),
        };
        transport.tell_spoken();
        transport
    }

    /// Decides by this table what messages need; without it by the catalogue's.
    #[must_use]
    pub fn with_table(self, table: Table) -> Self {
        let transport = Self { table, ..self };
        transport.verify_rules();
        transport
    }

    /// Its counters so far.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// The established sessions.
    pub fn sessions(&self) -> impl Iterator<Item = SessionReport> + '_ {
        self.sessions.iter().filter_map(|(&id, session)| {
            let peer = session.established()?;
            Some(SessionReport {
                session: id,
                peer: peer.clone(),
                address: session.address(),
                dialed: session.dial.is_some(),
                round_trip: session.connection.rtt(),
                received: session.received,
                sent: session.sent,
                waiting: session.waiting(),
            })
        })
    }

    /// Processes a UDP datagram from this address.
    pub fn handle_datagram(&mut self, now: Instant, from: SocketAddr, datagram: &[u8]) {
        if self.is_excess(now, from, datagram) {
            self.counters.add(Counter::FirstPacketsDropped);
            return;
        }
        self.buffer.clear();
        let data = BytesMut::from(datagram);
        let event =
            self.endpoint
                .handle(now, zone::embed(from), None, None, data, &mut self.buffer);
        match event {
            Some(DatagramEvent::ConnectionEvent(handle, event)) => {
                if let Some(&id) = self.handles.get(&handle)
                    && let Some(session) = self.sessions.get_mut(&id)
                {
                    session.connection.handle_event(event);
                    session.note_packets(now);
                    self.advance(now, id);
                }
            }
            Some(DatagramEvent::NewConnection(incoming)) => self.admit(now, incoming),
            Some(DatagramEvent::Response(response)) => self.respond(now, &response),
            None => {}
        }
    }

    /// Performs what is due: retransmissions, timeouts, dials; and closes the sessions of keys that
    /// are no longer trusted.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.apply_own(now);
        self.apply_trust(now);
        self.remind(now);
        self.ping_owners(now);
        self.dial(now);
        let is_due = |it: &mut Session| it.connection.poll_timeout().is_some_and(|at| at <= now);
        let sessions = self.sessions.iter_mut();
        let due = sessions.filter_map(|(&id, it)| is_due(it).then_some(id));
        for id in due.collect::<Vec<_>>() {
            if let Some(session) = self.sessions.get_mut(&id) {
                session.connection.handle_timeout(now);
            }
            self.advance(now, id);
        }
    }

    /// The next event.
    pub fn poll_arrival(&mut self) -> Option<Arrival> {
        self.arrivals.pop_front()
    }

    /// When to call [`handle_timeout`](Self::handle_timeout) if nothing happens before.
    pub fn poll_timeout(&mut self) -> Option<Instant> {
        let ping = self.sessions.values().filter_map(Session::ping_due).min();
        let sessions = self.sessions.values_mut();
        let sessions = sessions.filter_map(|it| it.connection.poll_timeout());
        let dials = self.dials.iter().filter_map(Dial::due);
        let budget = self.budget.as_ref().and_then(Budget::ready);
        sessions.chain(dials).chain(budget).chain(ping).min()
    }

    /// Closes all sessions and dials no more; returns whether there is a peer to tell.
    pub fn close(&mut self, now: Instant) -> bool {
        self.dials.clear();
        self.endpoint.set_server_config(None);
        let running = self.sessions.iter().filter(|(_, it)| !it.ended);
        let running: Vec<_> = running.map(|(&id, _)| id).collect();
        for &id in &running {
            self.end(now, id, code::SHUTDOWN, "the node stops");
        }
        !running.is_empty()
    }

    fn insert(&mut self, session: Session) -> SessionId {
        let id = SessionId(self.next);
        self.next += 1;
        self.handles.insert(session.handle, id);
        self.sessions.insert(id, session);
        id
    }

    /// Queues the answer in the buffer, if there is room for it.
    fn respond(&mut self, now: Instant, response: &quinn_proto::Transmit) {
        let is_affordable = |it: &mut Budget| it.admits_response(now, response.size);
        if self.responses.len() < MOST_RESPONSES && self.budget.as_mut().is_none_or(is_affordable) {
            let datagram = Bytes::copy_from_slice(&self.buffer[..response.size]);
            let to = zone::extract(response.destination);
            self.responses.push_back((to, datagram));
        }
    }

    /// Processes the events of a connection.
    fn advance(&mut self, now: Instant, id: SessionId) {
        loop {
            let Some(session) = self.sessions.get_mut(&id) else {
                return;
            };
            while let Some(event) = session.connection.poll_endpoint_events() {
                if let Some(event) = self.endpoint.handle_event(session.handle, event) {
                    session.connection.handle_event(event);
                }
            }
            let Some(event) = session.connection.poll() else {
                break;
            };
            match event {
                // The dialling side waits for the greeting.
                Event::Connected if session.dial.is_some() => session.greet(self.instance),
                Event::Connected => self.establish(now, id),
                Event::ConnectionLost { reason } => self.lose(now, id, &reason),
                Event::DatagramReceived => self.read(now, id, None),
                Event::Stream(StreamEvent::Opened { .. }) => {
                    for stream in session.accept_streams() {
                        self.read(now, id, Some(stream));
                    }
                }
                Event::Stream(StreamEvent::Readable { id: stream }) => {
                    self.read(now, id, Some(stream));
                }
                // The next flush tries every stream and datagram again.
                Event::HandshakeDataReady | Event::DatagramsUnblocked | Event::Stream(_) => {}
            }
        }
        if let Some(session) = self.sessions.get(&id)
            && session.connection.is_drained()
        {
            self.handles.remove(&session.handle);
            self.sessions.remove(&id);
        }
    }

    /// Handles a completed handshake.
    fn establish(&mut self, now: Instant, id: SessionId) {
        let Some(session) = self.sessions.get_mut(&id) else {
            return;
        };
        // The handshake has accepted it, but the trust may have changed meanwhile.
        let identified = match session.identify(|shown| self.credentials.admit(shown)) {
            Ok(identified) => identified,
            Err(rejection) => {
                tracing::warn!(%rejection, "refused after the handshake");
                self.end(now, id, code::REVOKED, renewal::NOT_ACCEPTED);
                return;
            }
        };
        let key = identified.peer.key;
        let address = session.address();
        if session.dial.is_none() && !self.has_place_for(now, key, address) {
            self.counters.add(Counter::TooManyInstances);
            self.end(now, id, code::BUSY, "too many programs with this key");
            return;
        }
        let Some(session) = self.sessions.get_mut(&id) else {
            return;
        };
        let peer = identified.peer;
        tracing::info!(peer = peer.name, %address, "secure session established");
        session.peer = Some(peer);
        session.valid_until = identified.valid_until;
        self.counters.add(Counter::SessionsEstablished);
        match session.dial {
            // There are no dials any more after `close`.
            Some(dial) => {
                if let Some(dial) = self.dials.get_mut(dial) {
                    dial.established(id);
                }
            }
            None => session.greet(self.instance),
        }
        self.tell_spoken();
        self.record(id, Act::Connected);
    }

    /// Handles the loss of a connection.
    fn lose(&mut self, now: Instant, id: SessionId, reason: &ConnectionError) {
        let Some(session) = self.sessions.get_mut(&id) else {
            return;
        };
        let address = session.address();
        if let Some(peer) = session.established() {
            tracing::warn!(peer = peer.name, %address, %reason, "secure session lost");
            let reason = reason.to_string();
            self.record(id, Act::Disconnected { reason });
        } else if session.peer.is_none() {
            self.counters.add(Counter::HandshakesFailed);
            let rejection = self.refusals.take();
            if let Some(rejection) = &rejection {
                self.counters.count(rejection);
            }
            let key = rejection.as_ref().and_then(Rejection::key);
            let fault = Fault::of(reason, rejection);
            if self.warned.is_none_or(|at| now >= at + WARNING_PAUSE) {
                self.warned = Some(now);
                let remedy = fault.remedy().unwrap_or_default();
                tracing::warn!(%address, %fault, remedy, "no secure session");
            }
            self.push_record(Record {
                peer: None,
                key,
                address,
                act: Act::HandshakeFailed(fault),
            });
        }
        self.mark_ended(now, id);
    }

    /// Closes a session from this side.
    fn end(&mut self, now: Instant, id: SessionId, code: u32, reason: &'static str) {
        if let Some(session) = self.sessions.get_mut(&id)
            && !session.ended
        {
            let peer = session.established().map(|it| it.name.clone());
            session.close(now, code, reason);
            if let Some(peer) = peer {
                tracing::info!(peer, reason, "secure session closed");
                let reason = reason.to_owned();
                self.record(id, Act::Disconnected { reason });
            }
            self.mark_ended(now, id);
        }
    }

    fn mark_ended(&mut self, now: Instant, id: SessionId) {
        let Some(session) = self.sessions.get_mut(&id) else {
            return;
        };
        if session.established().is_some() {
            self.arrivals.push_back(Arrival::Closed(id));
        }
        session.ended = true;
        self.fragments.forget(id);
        let was_good = session.peer.is_some();
        for dial in &mut self.dials {
            if dial.session == Some(id) {
                dial.lost(now, was_good);
            }
        }
    }
}
