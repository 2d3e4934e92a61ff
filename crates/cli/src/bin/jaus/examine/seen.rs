//! Records the messages of an examination with their origin, and unreadable datagrams.

use std::collections::BTreeSet;
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::wire::{DataControl, Frame, Version, judp, large};

/// Maximum number of stored messages. Further ones are only counted.
const MOST: usize = 16_384;

/// The receiving socket.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Listener {
    /// The query socket.
    Unicast,
    /// The multicast group of AS5669A.
    Group,
    /// The multicast group of the Reference Architecture.
    RaGroup,
    /// The temporary socket that detects a refused port.
    Probe,
}

/// A received datagram.
#[derive(Clone, Debug)]
pub(super) struct Arrival {
    pub(super) listener: Listener,
    /// Index of the receiving interface.
    pub(super) link: usize,
    pub(super) from: SocketAddr,
    pub(super) datagram: Bytes,
}

/// A received message.
#[derive(Clone, Debug)]
pub(super) struct Heard {
    pub(super) at: Duration,
    pub(super) listener: Listener,
    pub(super) link: usize,
    pub(super) from: SocketAddr,
    pub(super) frame: Frame,
    /// Surplus octets after the messages of its datagram.
    pub(super) stale: usize,
}

impl Heard {
    /// The code of a complete message; acknowledgements and fragments have none.
    pub(super) fn code(&self) -> Option<u16> {
        let whole = self.frame.flags.data() == DataControl::Single;
        self.frame
            .code()
            .filter(|_| whole && !self.frame.flags.acknowledgement().is_answer())
    }
}

/// All received messages.
#[derive(Debug, Default)]
pub(super) struct Seen {
    heard: Vec<Heard>,
    /// Messages beyond [`MOST`].
    dropped: u64,
    /// Datagrams without a JAUS framing, with the beginning of the first.
    unreadable: Vec<(SocketAddr, String)>,
    /// Why the destination is unreachable, according to the system.
    pub(super) refused: Option<Refusal>,
    /// Whether the destination's host refuses a port that is closed.
    pub(super) closed_port_refused: bool,
    /// Result of the TCP connection.
    pub(super) tcp: Option<TcpAnswer>,
}

/// Error of the operating system about a destination.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// The host answers that the port is closed.
    Port,
    /// There is no route to the host, or it does not answer on its network.
    Host,
}

/// Result of a TCP connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TcpAnswer {
    Open,
    Refused,
    /// Neither; the system's timeout was shorter than ours.
    Failed,
}

impl Seen {
    /// Processes a datagram; returns the number of its messages.
    pub(super) fn take(&mut self, now: Duration, arrival: &Arrival) -> usize {
        let before = self.heard.len();
        let Ok(mut frames) = judp::frames(arrival.datagram.clone()) else {
            self.note_unreadable(arrival);
            return 0;
        };
        let mut read = Vec::new();
        for frame in frames.by_ref() {
            match frame {
                Ok(frame) => read.push(frame),
                Err(_) => self.note_unreadable(arrival),
            }
        }
        let stale = frames.remaining();
        for frame in read {
            if self.heard.len() == MOST {
                self.dropped += 1;
                continue;
            }
            self.heard.push(Heard {
                at: now,
                listener: arrival.listener,
                link: arrival.link,
                from: arrival.from,
                frame,
                stale,
            });
        }
        self.heard.len() - before
    }

    fn note_unreadable(&mut self, arrival: &Arrival) {
        const MOST_UNREADABLE: usize = 64;
        if self.unreadable.len() < MOST_UNREADABLE {
            let beginning = arrival.datagram.iter().take(8);
            let hex: Vec<String> = beginning.map(|octet| format!("{octet:02X}")).collect();
            self.unreadable.push((arrival.from, hex.join(" ")));
        }
    }

    /// Number of messages so far: a mark for [`since`](Self::since).
    pub(super) fn len(&self) -> usize {
        self.heard.len()
    }

    /// Messages since a mark.
    pub(super) fn since(&self, mark: usize) -> &[Heard] {
        self.heard.get(mark..).unwrap_or_default()
    }

    /// All messages.
    pub(super) fn all(&self) -> &[Heard] {
        &self.heard
    }

    /// Number of messages that were not stored.
    pub(super) const fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Messages from a host.
    pub(super) fn of_host(&self, ip: IpAddr) -> impl Iterator<Item = &Heard> {
        self.heard.iter().filter(move |heard| heard.from.ip() == ip)
    }

    /// The beginning of a host's first unreadable datagram.
    pub(super) fn unreadable_from(&self, ip: IpAddr) -> Option<&str> {
        let mut all = self.unreadable.iter();
        all.find(|(from, _)| from.ip() == ip)
            .map(|(_, beginning)| beginning.as_str())
    }

    /// The framings used by a host.
    pub(super) fn framings(&self, ip: IpAddr) -> BTreeSet<Version> {
        self.of_host(ip).map(|heard| heard.frame.version).collect()
    }

    /// The large message of a sender since a mark, reassembled, with the number of its fragments
    /// and whether each of them repeats the message code.
    pub(super) fn large_from(&self, source: JausId, mark: usize) -> Option<(Bytes, usize, bool)> {
        let mut pieces: Vec<(u16, DataControl, Bytes)> = Vec::new();
        for heard in self.since(mark) {
            let (flags, frame) = (heard.frame.flags, &heard.frame);
            let fragment = flags.data() != DataControl::Single && frame.source == source;
            if fragment && !flags.acknowledgement().is_answer() {
                pieces.push((frame.sequence, flags.data(), frame.payload.clone()));
            }
        }
        let first = pieces
            .iter()
            .position(|(_, data, _)| *data == DataControl::First)?;
        let mut number = pieces[first].0;
        let mut fragments = vec![pieces[first].2.clone()];
        loop {
            number = number.wrapping_add(1);
            let next = pieces
                .iter()
                .find(|(sequence, data, _)| *sequence == number && *data != DataControl::First)?;
            fragments.push(next.2.clone());
            if next.1 == DataControl::Last {
                break;
            }
        }
        let repeats = large::repeats_code(&fragments);
        let whole = large::join(&fragments, if repeats { large::CODE_LEN } else { 0 });
        Some((whole, fragments.len(), repeats))
    }
}

/// The peer's reaction to reserved values.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reserved {
    /// The first sequence number of the second query.
    pub(super) second: u16,
    /// It takes message type bits for header compression.
    pub(super) misreads_type: bool,
    /// It acknowledges messages to an id with a 0.
    pub(super) answers_for_zero: bool,
}
