//! The wire between the nodes: its effects on datagrams, and the socket buffers at its ends.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet};
use std::net::SocketAddr;
use std::ops::Range;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::endpoint::LinkId;

use super::Random;

/// Quality of the wire.
#[derive(Clone, Debug)]
pub struct Conditions {
    /// Travel time of a datagram; its spread reorders them.
    pub latency: Range<Duration>,
    /// Lost copies per 1000.
    pub lost: u32,
    /// Copies per 1000 that arrive twice.
    pub repeated: u32,
    /// Copies per 1000 that make a detour, so that others overtake them.
    pub detoured: u32,
    /// The longest detour.
    pub detour: Duration,
    /// Copies per 1000 in which one bit changes, undetected by checksums.
    pub corrupted: u32,
    /// The longest datagram that gets through, in octets.
    pub mtu: usize,
    /// The socket of each receiver; `None` for one that is read immediately.
    pub socket: Option<Socket>,
}

/// A socket with a buffer, which its node reads at a fixed speed.
#[derive(Clone, Copy, Debug)]
pub struct Socket {
    /// Reading speed, in octets per second.
    pub speed: usize,
    /// Buffer size in octets. Datagrams beyond it are lost.
    pub buffer: usize,
}

impl Conditions {
    /// A quiet switch: 100 µs, no loss.
    pub fn good() -> Self {
        Self {
            latency: Duration::from_micros(100)..Duration::from_micros(101),
            lost: 0,
            repeated: 0,
            detoured: 0,
            detour: Duration::ZERO,
            corrupted: 0,
            mtu: usize::MAX,
            socket: None,
        }
    }

    /// A poor radio: 1 to 30 ms, one of ten copies lost, one of twenty repeated.
    pub fn poor() -> Self {
        Self {
            latency: Duration::from_millis(1)..Duration::from_millis(30),
            lost: 100,
            repeated: 50,
            ..Self::good()
        }
    }
}

/// A datagram in flight. Ordered by arrival, then by departure.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Flight {
    pub(super) arrival: Instant,
    number: u64,
    pub(super) to: usize,
    /// The receiver's link.
    pub(super) link: LinkId,
    pub(super) from: SocketAddr,
    pub(super) datagram: Bytes,
    /// Already in the receiver's socket; it will be read.
    buffered: bool,
}

/// Datagrams in the socket of a suspended process, oldest first.
#[derive(Default)]
pub(super) struct Backlog {
    pub(super) flights: Vec<Flight>,
    octets: usize,
}

impl Backlog {
    /// Default buffer size in octets, without a socket in the conditions: that of Linux.
    const ROOM: usize = 212_992;
}

/// Contents of a node's socket.
#[derive(Clone, Copy, Default)]
struct Buffer {
    octets: usize,
    /// When the buffered datagrams will have been read.
    read: Option<Instant>,
}

/// The wire. See the [module](self).
pub(super) struct Wire {
    pub(super) conditions: Conditions,
    random: Random,
    flights: BinaryHeap<Reverse<Flight>>,
    /// The cut directions, as sender and receiver.
    cut: HashSet<(usize, usize)>,
    buffers: Vec<Buffer>,
    launched: u64,
    pub(super) harm: Harm,
}

/// The wire's effects on datagrams so far.
#[derive(Clone, Copy, Debug, Default)]
pub struct Harm {
    /// Lost or oversized copies.
    pub lost: u64,
    /// Copies that could not leave because the wire was cut.
    pub cut: u64,
    /// Copies that arrive twice.
    pub repeated: u64,
    /// Copies that make a detour.
    pub detoured: u64,
    /// Copies with a changed bit.
    pub corrupted: u64,
    /// Copies lost because a receiver's socket was full.
    pub overflowed: u64,
}

impl Wire {
    pub(super) fn new(seed: u64, conditions: Conditions) -> Self {
        Self {
            conditions,
            random: Random::new(seed),
            flights: BinaryHeap::new(),
            cut: HashSet::new(),
            buffers: Vec::new(),
            launched: 0,
            harm: Harm::default(),
        }
    }

    pub(super) fn set_cut(&mut self, from: usize, to: usize, cut: bool) {
        if cut {
            self.cut.insert((from, to));
        } else {
            self.cut.remove(&(from, to));
        }
    }

    /// The time of the next arrival.
    pub(super) fn next_time(&self) -> Option<Instant> {
        self.flights.peek().map(|Reverse(flight)| flight.arrival)
    }

    /// Sends a datagram to one receiver's link.
    pub(super) fn launch(
        &mut self,
        now: Instant,
        (from, address): (Option<usize>, SocketAddr),
        (to, link): (usize, LinkId),
        datagram: &Bytes,
    ) {
        let conditions = &self.conditions;
        if from.is_some_and(|from| self.cut.contains(&(from, to))) {
            self.harm.cut += 1;
            return;
        }
        if datagram.len() > conditions.mtu || self.random.happens(conditions.lost) {
            self.harm.lost += 1;
            return;
        }
        let copies = 1 + u32::from(self.random.happens(conditions.repeated));
        self.harm.repeated += u64::from(copies - 1);
        for _copy in 0..copies {
            let mut arrival = now + self.random.between(&conditions.latency);
            if self.random.happens(conditions.detoured) {
                arrival += self.random.between(&(Duration::ZERO..conditions.detour));
                self.harm.detoured += 1;
            }
            let mut datagram = datagram.clone();
            if conditions.corrupted > 0 && self.random.happens(conditions.corrupted) {
                datagram = flip_a_bit(&datagram, &mut self.random);
                self.harm.corrupted += 1;
            }
            self.launched += 1;
            self.flights.push(Reverse(Flight {
                arrival,
                number: self.launched,
                to,
                link,
                from: address,
                datagram,
                buffered: false,
            }));
        }
    }

    /// The next datagram received by now.
    pub(super) fn receive(&mut self, now: Instant) -> Option<Flight> {
        while self.next_time().is_some_and(|next| next <= now) {
            let Reverse(flight) = self.flights.pop()?;
            if flight.buffered {
                self.buffer(flight.to).octets -= flight.datagram.len();
                return Some(flight);
            }
            match self.conditions.socket {
                None => return Some(flight),
                Some(socket) => self.keep(flight, socket),
            }
        }
        None
    }

    /// Puts a datagram into its receiver's socket, if there is room.
    fn keep(&mut self, mut flight: Flight, socket: Socket) {
        let length = flight.datagram.len();
        let buffer = self.buffer(flight.to);
        if buffer.octets + length > socket.buffer {
            self.harm.overflowed += 1;
            return;
        }
        let begun = buffer
            .read
            .map_or(flight.arrival, |read| read.max(flight.arrival));
        let read = begun + Duration::from_secs_f64(length as f64 / socket.speed as f64);
        buffer.octets += length;
        buffer.read = Some(read);
        flight.arrival = read;
        flight.buffered = true;
        self.flights.push(Reverse(flight));
    }

    /// Puts a datagram into the socket of a suspended process, if there is room.
    pub(super) fn keep_for_later(&mut self, flight: Flight, backlog: &mut Backlog) {
        let socket = self.conditions.socket;
        let room = socket.map_or(Backlog::ROOM, |socket| socket.buffer);
        let length = flight.datagram.len();
        if backlog.octets + length > room {
            self.harm.overflowed += 1;
            return;
        }
        backlog.octets += length;
        backlog.flights.push(flight);
    }

    fn buffer(&mut self, host: usize) -> &mut Buffer {
        if self.buffers.len() <= host {
            self.buffers.resize(host + 1, Buffer::default());
        }
        &mut self.buffers[host]
    }
}

/// Half of the bit flips hit the header, where they matter more.
fn flip_a_bit(datagram: &Bytes, random: &mut Random) -> Bytes {
    const HEADER: usize = 16;
    let mut octets = datagram.to_vec();
    let reach = match random.happens(500) {
        true => octets.len().min(HEADER),
        false => octets.len(),
    };
    if reach > 0 {
        octets[random.below(reach)] ^= 1 << random.below(8);
    }
    octets.into()
}
