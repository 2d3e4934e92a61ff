//! Transmission of messages: addresses, framings and parts.

use std::net::SocketAddr;

use bytes::Bytes;

use super::pace::Pace;
use super::{Carrier, Dialect, packet, parts};
use crate::BadId;
use crate::RaId;
use crate::counters::Counter;
use crate::message::Message;
use jaus::wire::Acknowledgement;
use jaus::wire::ra::{Fields, Header};

/// Destination of a datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum To {
    /// The multicast group, 224.1.0.1 by default.
    Group,
    /// One host.
    Address(SocketAddr),
}

/// An outgoing datagram.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Transmit {
    /// Its destination.
    pub to: To,
    /// Its octets.
    pub datagram: Bytes,
}

/// Reason why a message was not sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// The source is not one of our components.
    #[error("the source {0} is not announced: announce it with its subsystem first")]
    NotOurs(RaId),
    /// The source or destination is invalid.
    #[error("{0}")]
    BadId(#[from] BadId),
    /// The address of the destination's subsystem is unknown.
    #[error("the address of subsystem {0} is unknown: wait until it appears")]
    Unknown(u8),
    /// The data is above [`Settings::max_message`](super::Settings::max_message).
    #[error("{length} octets of data exceed the limit of {limit}: send less, or raise the limit")]
    TooLong {
        /// Octets of data.
        length: usize,
        /// Maximum number of octets.
        limit: usize,
    },
    /// The priority is invalid.
    #[error("{0} is not a priority: use 0 to 15")]
    Priority(u8),
    /// The transmit queue is full.
    #[error("the transmit queue is full: poll it, or send less")]
    QueueFull,
}

impl Carrier {
    /// Sends a message of one of our components. The parts of a large message are numbered from 0,
    /// which OpenJAUS requires; the first parts are sent at once, the others after
    /// [`settle`](Carrier::settle) has set the time. A small message keeps its number.
    ///
    /// # Errors
    /// See [`SendError`]; nothing is sent then.
    pub fn send(&mut self, message: &Message) -> Result<(), SendError> {
        message.source.require_one()?;
        if !self.components.contains(&message.source) {
            return Err(SendError::NotOurs(message.source));
        }
        message.destination.recipients()?;
        if message.priority > 15 {
            return Err(SendError::Priority(message.priority));
        }
        let (length, limit) = (message.data.len(), self.settings.max_message);
        if length > limit {
            return Err(SendError::TooLong { length, limit });
        }
        let ways = self.ways(message.source.subsystem, message.destination.subsystem)?;
        let packets = length.div_ceil(jaus::wire::ra::MAX_DATA).max(1) * ways.len();
        if self.transmits.len() + self.pace.len() + packets > self.settings.queue_limit {
            self.counters.add(Counter::TransmitQueueFull);
            return Err(SendError::QueueFull);
        }
        for (to, dialect) in ways {
            for (place, number, data) in parts::cut(&message.data) {
                let header = header(message, place, number, data.len());
                let datagram = packet::datagram(dialect, &header, data);
                match place {
                    parts::Place::Single => self.push(to, datagram)?,
                    // Queue behind parts that already wait, to keep the order.
                    _ if self.pace.len() > 0 || usize::from(number) >= Pace::BURST => {
                        self.pace.push(Transmit { to, datagram });
                    }
                    _ => self.push(to, datagram)?,
                }
            }
        }
        self.counters.add(Counter::MessagesSent);
        Ok(())
    }

    /// The destinations and framings for a subsystem.
    fn ways(&mut self, from: u8, to: u8) -> Result<Vec<(To, Dialect)>, SendError> {
        if to == RaId::ALL {
            let sent = self.group_sent.entry(from).or_default();
            let turn = *sent;
            *sent = sent.wrapping_add(1);
            let group = self.group_dialects(turn);
            let group = group.map(|dialect| (To::Group, dialect));
            return Ok(group.chain(self.to_peers(turn)).collect());
        }
        let known = self.addresses.of(to);
        let (address, dialect) = known.ok_or(SendError::Unknown(to))?;
        Ok(vec![(To::Address(address), dialect)])
    }

    /// The framings for multicasts of a subsystem: all that peers use, plus the configured ones.
    /// OpenJAUS logs an error for each datagram in a foreign framing, so once peers use other
    /// framings, an unused one is sent only every tenth time. Any peer that uses it has been heard
    /// by then.
    fn group_dialects(&self, turn: u32) -> impl Iterator<Item = Dialect> + '_ {
        const RARELY: u32 = 10;
        let is_turn = turn.is_multiple_of(RARELY);
        let all = [Dialect::Opc, Dialect::As5669].into_iter();
        let is_quiet = !all.clone().any(|dialect| self.addresses.speaks(dialect));
        all.filter(move |&dialect| {
            let configured = self.settings.group_dialects.contains(&dialect);
            self.addresses.speaks(dialect) || (configured && (is_quiet || is_turn))
        })
    }

    /// Destinations of multicasts for hosts beyond multicast: each host in its own framing; a host
    /// that was not heard yet gets one of the possible framings in turn.
    fn to_peers(&self, turn: u32) -> impl Iterator<Item = (To, Dialect)> + '_ {
        let configured = self.settings.group_dialects.as_slice();
        let candidates = match configured {
            [] => &[Dialect::Opc, Dialect::As5669],
            some => some,
        };
        let next = candidates[turn as usize % candidates.len()];
        self.settings.peers.iter().map(move |&host| {
            let to = SocketAddr::new(host, self.settings.port);
            let dialect = self.addresses.dialect_at(host).unwrap_or(next);
            (To::Address(to), dialect)
        })
    }

    /// Queues a datagram.
    pub(super) fn push(&mut self, to: To, datagram: Bytes) -> Result<(), SendError> {
        if self.transmits.len() >= self.settings.queue_limit {
            self.counters.add(Counter::TransmitQueueFull);
            return Err(SendError::QueueFull);
        }
        self.transmits.push_back(Transmit { to, datagram });
        Ok(())
    }

    /// The next outgoing datagram.
    pub fn poll_transmit(&mut self) -> Option<Transmit> {
        let transmit = self.transmits.pop_front()?;
        self.counters.add(Counter::DatagramsSent);
        Some(transmit)
    }
}

/// The header of a message part.
fn header(message: &Message, place: parts::Place, number: u16, data_size: usize) -> Header {
    let sequence = match place {
        parts::Place::Single => message.sequence,
        _ => number,
    };
    Header::new(&Fields {
        priority: message.priority,
        acknowledgement: if message.acknowledge {
            Acknowledgement::Request
        } else {
            Acknowledgement::None
        },
        service_connection: message.connection,
        experimental: message.experimental,
        code: message.code,
        destination: message.destination,
        source: message.source,
        data_flag: place.flag(),
        data_size,
        sequence,
    })
}
