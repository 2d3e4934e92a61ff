//! RA datagram layer: framing, addressing, reassembly and limits.
//!
//! A [`Carrier`] validates every packet before the node sees it: framing, size and version; whether
//! the source is a single component and the destination one or several of ours; whether it comes
//! from its subsystem's address. A valid packet updates the subsystem's address and framing, is
//! acknowledged on request, and becomes a [`Message`] when all parts have arrived. Invalid packets
//! are counted.
//!
//! Large messages are sent in bursts of a few parts, so that a peer's receive buffer can hold them.
//!
//! All datagrams go to the port of [`Settings::port`], as OpenJAUS expects. Multicasts use the
//! framings that peers use and, less often then, the others of [`Settings::group_dialects`].

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

use super::RaId;
use super::Recipients;
use super::counters::{Counter, Counters};
use super::message::Message;
use addresses::Addresses;
use jaus::endpoint::Buckets;
use jaus::wire::Acknowledgement;
use jaus::wire::ra::{Fields, Header};
use pace::Pace;
use packet::Packet;
use parts::{Key, Parts, Place};

/// Converts between datagrams and complete messages. See the [module](self).
#[derive(Debug)]
pub struct Carrier {
    settings: Settings,
    /// Local components.
    components: BTreeSet<RaId>,
    addresses: Addresses,
    messages: Option<Buckets<IpAddr>>,
    parts: Parts,
    transmits: VecDeque<Transmit>,
    pace: Pace,
    /// Number of multicasts of each local subsystem.
    group_sent: BTreeMap<u8, u32>,
    counters: Counters,
}

impl Carrier {
    /// A carrier without local components.
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

    /// Sets the components of a local subsystem, replacing earlier ones.
    pub fn set_components(&mut self, subsystem: u8, components: impl IntoIterator<Item = RaId>) {
        self.components.retain(|id| id.subsystem != subsystem);
        self.components.extend(components);
    }

    /// The local components that a destination addresses.
    pub fn recipients(&self, destination: RaId) -> impl Iterator<Item = RaId> + '_ {
        let (first, last) = match destination.recipients() {
            Ok(Recipients::One) => (destination, destination),
            Ok(Recipients::Many) => (RaId::new(0, 0, 0, 0), RaId::new(255, 255, 255, 255)),
            Err(_) => (RaId::new(0, 0, 0, 0), RaId::new(0, 0, 0, 0)),
        };
        let among = self.components.range(first..=last).copied();
        among.filter(move |&id| destination.includes(id))
    }

    /// Whether the subsystem has a local component.
    fn has_subsystem(&self, subsystem: u8) -> bool {
        let all = RaId::new(subsystem, 0, 0, 0)..=RaId::new(subsystem, 255, 255, 255);
        self.components.range(all).next().is_some()
    }

    /// Processes a datagram; returns the completed messages.
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

    /// Validates and processes a packet.
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

    /// Validates a header and its origin.
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

    /// Sends an acknowledgement on request: the same code and number, no data.
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

    /// Runs due timers.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.parts.expire(now, &mut self.counters);
        self.transmits.extend(self.pace.take_due(now));
    }

    /// Sets the time after a transmission: queued parts wait from now on.
    pub fn settle(&mut self, now: Instant) {
        self.pace.start(now);
    }

    /// When to call [`handle_timeout`](Self::handle_timeout).
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let parts = self.parts.poll_timeout();
        parts.into_iter().chain(self.pace.poll_timeout()).min()
    }

    /// Forgets the address of a lost subsystem.
    pub fn forget(&mut self, subsystem: u8) {
        self.addresses.forget(subsystem);
    }

    /// The address of a subsystem, with the destination port.
    #[must_use]
    pub fn address(&self, subsystem: u8) -> Option<SocketAddr> {
        self.addresses.of(subsystem).map(|(address, _)| address)
    }

    /// Number of subsystems with known address.
    #[must_use]
    pub fn known(&self) -> usize {
        self.addresses.len()
    }

    /// Octets stored for incomplete large messages.
    #[must_use]
    pub fn unfinished(&self) -> usize {
        self.parts.cost()
    }

    /// Counters of traffic and drops.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Increments a counter.
    pub(super) fn count(&mut self, counter: Counter) {
        self.counters.add(counter);
    }
}
