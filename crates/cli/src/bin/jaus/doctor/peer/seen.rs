//! What was heard while the peer was examined: every message with its way here, and what could not
//! be read.

use std::collections::BTreeSet;
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::wire::{DataControl, Frame, Version, judp, large};

/// Messages that are kept. More are counted; a report is no recording.
const MOST: usize = 16_384;

/// At which of our sockets something arrives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Listener {
    /// The one that speaks.
    Unicast,
    /// The multicast group of AS5669A.
    Group,
    /// The multicast group of the Reference Architecture.
    RaGroup,
    /// A passing one that asks whether the port refuses.
    Probe,
}

/// A datagram that arrived.
#[derive(Clone, Debug)]
pub(super) struct Arrival {
    pub(super) listener: Listener,
    /// On which of our interfaces.
    pub(super) link: usize,
    pub(super) from: SocketAddr,
    pub(super) datagram: Bytes,
}

/// One message.
#[derive(Clone, Debug)]
pub(super) struct Heard {
    pub(super) at: Duration,
    pub(super) listener: Listener,
    pub(super) link: usize,
    pub(super) from: SocketAddr,
    pub(super) frame: Frame,
    /// Octets that lay behind the messages of its datagram.
    pub(super) stale: usize,
}

impl Heard {
    /// The code of a whole message; an acknowledgement and a fragment have none.
    pub(super) fn code(&self) -> Option<u16> {
        let whole = self.frame.flags.data() == DataControl::Single;
        self.frame
            .code()
            .filter(|_| whole && !self.frame.flags.acknowledgement().is_answer())
    }
}

/// All that was heard.
#[derive(Debug, Default)]
pub(super) struct Seen {
    heard: Vec<Heard>,
    /// Beyond [`MOST`].
    dropped: u64,
    /// Datagrams of no JAUS framing, with the beginning of the first.
    unreadable: Vec<(SocketAddr, String)>,
    /// Why the system says that nobody is there.
    pub(super) refused: Option<Refusal>,
    /// What became of the TCP connection.
    pub(super) tcp: Option<TcpAnswer>,
}

/// What the operating system says about a destination.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// The host answers that nobody listens at the port.
    Port,
    /// There is no way to the host, or it does not answer on its network.
    Host,
}

/// What became of a TCP connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TcpAnswer {
    Open,
    Refused,
    /// Neither; the system's own patience was shorter than ours.
    Failed,
}

impl Seen {
    /// Takes a datagram in; gives how many messages were in it.
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

    /// How much was heard so far: a mark to look [`since`](Self::since).
    pub(super) fn len(&self) -> usize {
        self.heard.len()
    }

    /// What was heard behind a mark.
    pub(super) fn since(&self, mark: usize) -> &[Heard] {
        self.heard.get(mark..).unwrap_or_default()
    }

    /// All of it.
    pub(super) fn all(&self) -> &[Heard] {
        &self.heard
    }

    /// How many messages there was no room for.
    pub(super) const fn dropped(&self) -> u64 {
        self.dropped
    }

    /// What came from a host.
    pub(super) fn of_host(&self, ip: IpAddr) -> impl Iterator<Item = &Heard> {
        self.heard.iter().filter(move |heard| heard.from.ip() == ip)
    }

    /// How the first unreadable datagram of a host begins.
    pub(super) fn unreadable_from(&self, ip: IpAddr) -> Option<&str> {
        let mut all = self.unreadable.iter();
        all.find(|(from, _)| from.ip() == ip)
            .map(|(_, beginning)| beginning.as_str())
    }

    /// The framings that a host was heard with.
    pub(super) fn framings(&self, ip: IpAddr) -> BTreeSet<Version> {
        self.of_host(ip).map(|heard| heard.frame.version).collect()
    }

    /// The large messages that one sender sent behind a mark, put together, with the number of
    /// their fragments and whether each of these repeats the message code.
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

/// What the peer does with what the standard reserves.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reserved {
    /// The first number of the second question.
    pub(super) second: u16,
    /// It takes bits of the message type for header compression.
    pub(super) misreads_type: bool,
    /// It acknowledges what is for an id with a 0.
    pub(super) answers_for_zero: bool,
}
