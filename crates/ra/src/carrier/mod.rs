//! Datagrams to whole messages and back: framings, ids, addresses, large messages, bounds.
//!
//! A [`Carrier`] judges what arrives before anybody else sees it: framing, size and version of the
//! packet; whether its source is one component and its destination one of ours or a group of
//! them; whether it comes from where its subsystem is. What passes teaches it the subsystem's
//! address and framing, is acknowledged if that is wanted, and comes out as a [`Message`] as soon
//! as it is whole. What does not pass is counted.
//!
//! Large messages are sent a few parts at a time, so that a peer's receive buffer holds them.
//!
//! Everything is sent to the port of [`Settings::port`], as OpenJAUS expects. What is for everybody
//! goes to the group, in the framings that somebody was heard to use and, more rarely then, in the
//! others of [`Settings::group_dialects`].

mod addresses;
mod pace;
mod packet;
mod parts;
mod settings;
#[cfg(test)]
mod tests;
mod transmit;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::net::{IpAddr, SocketAddr};
use std::time::Instant;

use bytes::Bytes;

pub use settings::{Dialect, Settings};
pub use transmit::{SendError, To, Transmit};

use super::Recipients;
use super::{Counter, Counters, Message, RaId};
use addresses::Addresses;
use jaus::endpoint::Buckets;
use jaus::wire::Acknowledgement;
use jaus::wire::ra::{Fields, Header};
use pace::Pace;
use packet::Packet;
use parts::{Key, Parts, Place};

/// Datagrams to whole messages and back. See the [module](self).
#[derive(Debug)]
pub struct Carrier {
    settings: Settings,
    /// Who is here.
    components: BTreeSet<RaId>,
    addresses: Addresses,
    messages: Option<Buckets<IpAddr>>,
    parts: Parts,
    transmits: VecDeque<Transmit>,
    pace: Pace,
    /// How much each subsystem here has sent to everybody.
    group_sent: BTreeMap<u8, u32>,
    counters: Counters,
}

impl Carrier {
    /// A carrier for nobody yet.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        let buckets = |rate| Buckets::new(rate, settings.max_addresses);
        Self {
            components: BTreeSet::new(),
            addresses: Addresses::new(&settings),
            messages: settings.messages.map(buckets),
            parts: Parts::new(&settings),
            transmits: VecDeque::new(),
            pace: Pace::default(),
            group_sent: BTreeMap::new(),
            counters: Counters::default(),
            settings,
        }
    }

    /// Says which components of a subsystem are here now: those and no others of it.
    pub fn set_components(&mut self, subsystem: u8, components: impl IntoIterator<Item = RaId>) {
        self.components.retain(|id| id.subsystem != subsystem);
        self.components.extend(components);
    }

    /// The components here that a destination means.
    pub fn recipients(&self, destination: RaId) -> impl Iterator<Item = RaId> + '_ {
        let (first, last) = match destination.recipients() {
            Ok(Recipients::One) => (destination, destination),
            Ok(Recipients::Many) => (RaId::new(0, 0, 0, 0), RaId::new(255, 255, 255, 255)),
            Err(_) => (RaId::new(0, 0, 0, 0), RaId::new(0, 0, 0, 0)),
        };
        let among = self.components.range(first..=last).copied();
        among.filter(move |&id| destination.includes(id))
    }

    /// Whether a component of that subsystem is here.
    fn has_subsystem(&self, subsystem: u8) -> bool {
        let all = RaId::new(subsystem, 0, 0, 0)..=RaId::new(subsystem, 255, 255, 255);
        self.components.range(all).next().is_some()
    }

    /// A datagram has come: gives the messages that are whole with it.
    pub fn handle_datagram(
        &mut self,
        now: Instant,
        from: SocketAddr,
        datagram: Bytes,
    ) -> Vec<Message> {
        self.counters.add(Counter::DatagramsReceived);
        let dialect = match packet::dialect(&datagram) {
            Ok(dialect) => dialect,
            Err(reason) => {
                self.counters.add(reason);
                return Vec::new();
            }
        };
        let mut messages = Vec::new();
        for packet in packet::packets(dialect, datagram) {
            let taken = packet.and_then(|packet| self.take(now, (from, dialect), packet));
            match taken {
                Ok(message) => messages.extend(message),
                Err(reason) => {
                    tracing::debug!(%from, %reason, "packet dropped");
                    self.counters.add(reason);
                }
            }
        }
        messages
    }

    /// Judges a packet, and takes it in.
    fn take(
        &mut self,
        now: Instant,
        from: (SocketAddr, Dialect),
        packet: Packet,
    ) -> Result<Option<Message>, Counter> {
        let Packet { header, data } = packet;
        let (source, destination): (RaId, RaId) =
            (header.source().into(), header.destination().into());
        let place = self.judge(now, from.0, &header)?;
        self.addresses.learn(
            now,
            source.subsystem,
            from,
            &self.settings,
            &mut self.counters,
        )?;
        if header.acknowledgement().is_answer() {
            self.counters.add(Counter::AcknowledgementsReceived);
            return Ok(None);
        }
        if self.recipients(destination).next().is_none() {
            return Err(Counter::NotForUs);
        }
        let key = Key {
            source,
            destination,
            code: header.code,
        };
        let part = (place, header.sequence, data);
        let data = self.parts.insert(now, key, part, &mut self.counters)?;
        let acknowledge = header.acknowledgement() == Acknowledgement::Request;
        if acknowledge && destination.require_one().is_ok() {
            self.acknowledge(from, &header);
        }
        Ok(data.map(|data| {
            self.counters.add(Counter::MessagesReceived);
            Message {
                destination,
                source,
                code: header.code,
                data,
                priority: header.priority(),
                acknowledge,
                connection: header.service_connection(),
                experimental: header.experimental(),
                sequence: header.sequence,
            }
        }))
    }

    /// Whether a header makes sense, and may come from there.
    fn judge(&mut self, now: Instant, from: SocketAddr, header: &Header) -> Result<Place, Counter> {
        let address = from.ip().to_canonical();
        if self.settings.own_addresses.contains(&address) {
            return Err(Counter::OwnEcho);
        }
        if !self.settings.versions.contains(&header.header_version()) {
            return Err(Counter::WrongVersion);
        }
        let place = Place::from_flag(header.data_flag()).ok_or(Counter::UnknownDataFlag)?;
        let source = RaId::from(header.source());
        source.require_one().map_err(|_| Counter::InvalidSource)?;
        let destination = RaId::from(header.destination());
        let recipients = destination.recipients();
        recipients.map_err(|_| Counter::InvalidDestination)?;
        if self.has_subsystem(source.subsystem) {
            return Err(Counter::SubsystemConflict);
        }
        let in_rate = self.messages.as_mut();
        if in_rate.is_some_and(|buckets| !buckets.take(now, address)) {
            return Err(Counter::MessageRate);
        }
        Ok(place)
    }

    /// Answers a packet that wants it: the same code and number, no data.
    fn acknowledge(&mut self, (from, dialect): (SocketAddr, Dialect), header: &Header) {
        let answer = Header::new(&Fields {
            priority: header.priority(),
            acknowledgement: Acknowledgement::Positive,
            service_connection: header.service_connection(),
            experimental: header.experimental(),
            code: header.code,
            destination: header.source().into(),
            source: header.destination().into(),
            data_flag: header.data_flag(),
            data_size: 0,
            sequence: header.sequence,
        });
        let to = SocketAddr::new(from.ip(), self.settings.port);
        let datagram = packet::datagram(dialect, &answer, &[]);
        if self.push(To::Address(to), datagram).is_ok() {
            self.counters.add(Counter::AcknowledgementsSent);
        }
    }

    /// Time has passed.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.parts.expire(now, &mut self.counters);
        self.transmits.extend(self.pace.take_due(now));
    }

    /// Says what time it is, after something was sent: what waits for its turn waits from now on.
    pub fn settle(&mut self, now: Instant) {
        self.pace.start(now);
    }

    /// When to call [`handle_timeout`](Self::handle_timeout).
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let parts = self.parts.poll_timeout();
        parts.into_iter().chain(self.pace.poll_timeout()).min()
    }

    /// Forgets where a subsystem is, because it is gone.
    pub fn forget(&mut self, subsystem: u8) {
        self.addresses.forget(subsystem);
    }

    /// Where a subsystem was heard, with the port that is sent to.
    #[must_use]
    pub fn address(&self, subsystem: u8) -> Option<SocketAddr> {
        self.addresses.of(subsystem).map(|(address, _)| address)
    }

    /// Of how many subsystems the address is known.
    #[must_use]
    pub fn known(&self) -> usize {
        self.addresses.len()
    }

    /// How many octets are kept of unfinished large messages.
    #[must_use]
    pub fn unfinished(&self) -> usize {
        self.parts.cost()
    }

    /// What was seen, done and thrown away.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Counts something.
    pub(super) fn count(&mut self, counter: Counter) {
        self.counters.add(counter);
    }
}
