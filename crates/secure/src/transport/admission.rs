//! Which handshakes of peers begin, at a bounded cost.
//!
//! The source address of a first packet proves nothing, so there is no budget for it: a forger would
//! spend the budget of the peer whose address it uses. A few first packets are accepted as they come,
//! while few handshakes are unfinished and the own key is in no token. Each further one is answered by a Retry packet (RFC 9000,
//! section 8.1), which is shorter than the first packet and leaves no state here. A peer that
//! returns its token, or one from an earlier session, has proved that it receives at its address.
//! Only then its address has a budget, and a share of the places for unfinished handshakes.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::time::Instant;

use jaus::endpoint::SessionId;
use jaus_limits::{Buckets, Rate, quota_address};
use quinn_proto::{EndpointEvent, Incoming};

use super::session::Session;
use super::{Counter, Transport, code};

/// Limit of unfinished handshakes.
pub(super) const MOST_HANDSHAKES: usize = 64;
/// Limit of unfinished handshakes from one network address.
pub(super) const MOST_HANDSHAKES_PER_ADDRESS: usize = 8;
/// From this number of unfinished handshakes on, a peer must first prove its address.
pub(super) const RETRY_FROM: usize = 4;
/// Handshakes with unproven addresses, all together.
const UNPROVEN: Rate = Rate::new(10, 20);
/// Handshakes with one proven address.
const PROVEN: Rate = Rate::new(50, 100);
/// Handshakes with all addresses that have returned the token of a Retry packet; and with all that
/// had a token from an earlier session, so that a swarm of new addresses does not keep them out.
const ALL_PROVEN: Rate = Rate::new(200, 200);
/// Limit of proven addresses with a budget of their own. Further ones share one.
const MOST_ADDRESSES: usize = 4096;
/// First packets to process, without a token and with one. Each costs the keys of its packet and,
/// if it proves nothing, a Retry packet: the bench `flood` measures both. Further ones are dropped
/// unread, so that existing sessions keep the processor.
pub(super) const FIRST_PACKETS: Rate = Rate::new(40_000, 4000);
/// Limit of answers that wait for the network.
pub(super) const MOST_RESPONSES: usize = 4096;
/// The shortest datagram that may open a connection, in octets.
const SHORTEST_FIRST: usize = 1200;

/// The budgets of handshakes.
#[derive(Debug)]
pub(super) struct Admission {
    unproven: Buckets<()>,
    retried: Budgets,
    known: Budgets,
    without_token: Buckets<()>,
    with_token: Buckets<()>,
}

/// The budgets of proven addresses: of each, and of all.
#[derive(Debug)]
struct Budgets {
    each: Buckets<IpAddr>,
    all: Buckets<()>,
}

impl Budgets {
    fn new() -> Self {
        Self {
            each: Buckets::new(PROVEN, MOST_ADDRESSES),
            all: Buckets::new(ALL_PROVEN, 1),
        }
    }

    fn take(&mut self, now: Instant, address: IpAddr) -> bool {
        self.each.take(now, address) && self.all.take(now, ())
    }
}

impl Admission {
    pub(super) fn new() -> Self {
        Self {
            unproven: Buckets::new(UNPROVEN, 1),
            retried: Budgets::new(),
            known: Budgets::new(),
            without_token: Buckets::new(FIRST_PACKETS, 1),
            with_token: Buckets::new(FIRST_PACKETS, 1),
        }
    }
}

impl Transport {
    /// Whether to drop a datagram unread, because it is one of too many first packets.
    pub(super) fn is_excess(&mut self, now: Instant, from: SocketAddr, datagram: &[u8]) -> bool {
        let Some(has_token) = first_packet(datagram) else {
            return false;
        };
        let budget = match has_token {
            true => &mut self.admission.with_token,
            false => &mut self.admission.without_token,
        };
        let has_room = self.responses.len() < MOST_RESPONSES && budget.take(now, ());
        !has_room && !self.is_dialling(from)
    }

    /// Decides on a new connection from a peer.
    pub(super) fn admit(&mut self, now: Instant, incoming: Incoming) {
        if !incoming.remote_address_validated() {
            let is_calm = self.admission.unproven.take(now, ())
                && self.unfinished().count() < RETRY_FROM
                && !self.credentials.own_key().is_slow();
            return match is_calm {
                true => self.accept(now, incoming),
                false => self.request_proof(now, incoming),
            };
        }
        // The token of a Retry packet forbids another one; a token from an earlier session does not.
        let budgets = match incoming.may_retry() {
            true => &mut self.admission.known,
            false => &mut self.admission.retried,
        };
        let address = quota_address(incoming.remote_address().ip());
        if !budgets.take(now, address) {
            self.counters.add(Counter::HandshakesDropped);
            self.endpoint.ignore(incoming);
            return;
        }
        self.make_room(now, address);
        self.accept(now, incoming);
    }

    /// Answers a first packet by a Retry packet.
    fn request_proof(&mut self, now: Instant, incoming: Incoming) {
        self.buffer.clear();
        match self.endpoint.retry(incoming, &mut self.buffer) {
            Ok(response) => {
                self.counters.add(Counter::Retries);
                self.respond(now, &response);
            }
            // It has a token, which its caller excludes.
            Err(error) => self.endpoint.ignore(error.into_incoming()),
        }
    }

    fn accept(&mut self, now: Instant, incoming: Incoming) {
        self.buffer.clear();
        match self.endpoint.accept(incoming, now, &mut self.buffer, None) {
            Ok((handle, connection)) => {
                let id = self.insert(Session::new(handle, connection, None));
                self.advance(now, id);
            }
            Err(error) => {
                self.counters.add(Counter::HandshakesFailed);
                if let Some(response) = error.response {
                    self.respond(now, &response);
                }
            }
        }
    }

    /// The unfinished handshakes of peers with their network addresses, the oldest first.
    fn unfinished(&self) -> impl Iterator<Item = (SessionId, IpAddr)> + '_ {
        let is_unfinished = |it: &Session| it.peer.is_none() && !it.ended && it.dial.is_none();
        let all = self.sessions.iter();
        all.filter(move |(_, it)| is_unfinished(it))
            .map(|(&id, it)| (id, quota_address(it.address().ip())))
    }

    /// Ends an unfinished handshake if there is no place for one more from this address: the oldest
    /// one of this address if it has used up its share, else of the address that has most of them.
    fn make_room(&mut self, now: Instant, newcomer: IpAddr) {
        let mut by_address: BTreeMap<IpAddr, Vec<SessionId>> = BTreeMap::new();
        for (id, address) in self.unfinished() {
            by_address.entry(address).or_default().push(id);
        }
        let own = by_address.get(&newcomer);
        let own = own.filter(|it| it.len() >= MOST_HANDSHAKES_PER_ADDRESS);
        let is_full = by_address.values().map(Vec::len).sum::<usize>() >= MOST_HANDSHAKES;
        let largest = || {
            let all = by_address.values();
            all.max_by_key(|it| (it.len(), Reverse(it.first().copied())))
        };
        let share = own.or_else(|| largest().filter(|_| is_full));
        if let Some(&oldest) = share.and_then(|it| it.first()) {
            self.displace(now, oldest);
        }
    }

    /// Ends an unfinished handshake, and tells the peer, so that it dials again soon.
    fn displace(&mut self, now: Instant, id: SessionId) {
        let Some(mut session) = self.sessions.remove(&id) else {
            return;
        };
        self.handles.remove(&session.handle);
        self.counters.add(Counter::HandshakesDisplaced);
        session.close(now, code::BUSY, "too many unfinished handshakes");
        self.buffer.clear();
        let last = session.connection.poll_transmit(now, 1, &mut self.buffer);
        if let Some(last) = last {
            self.respond(now, &last);
        }
        // Without its session the connection would never report that it is drained.
        self.endpoint
            .handle_event(session.handle, EndpointEvent::drained());
    }

    /// Whether a handshake of this side with an address is under way.
    fn is_dialling(&self, address: SocketAddr) -> bool {
        let mut awaiting = self
            .sessions
            .values()
            .filter(|it| it.is_awaiting_greeting());
        awaiting.any(|it| it.address() == address)
    }
}

/// Whether a datagram that may cost an answer carries a token; `None` for those of connections. It
/// opens a connection, in a datagram of the least length (RFC 9000, section 14.1, whatever its fixed
/// bit: RFC 9287), or has another version of QUIC than 1.
fn first_packet(datagram: &[u8]) -> Option<bool> {
    let (&first, version) = datagram.split_first()?;
    let is_initial = first & 0x30 == 0 || !version.starts_with(&[0, 0, 0, 1]);
    if datagram.len() < SHORTEST_FIRST || first & 0x80 == 0 || !is_initial {
        return None;
    }
    let behind_id = |at: usize| Some(at + 1 + usize::from(*datagram.get(at)?));
    let token = behind_id(5).and_then(behind_id);
    let length = token.and_then(|at| datagram.get(at));
    Some(length.is_some_and(|&length| length != 0))
}
