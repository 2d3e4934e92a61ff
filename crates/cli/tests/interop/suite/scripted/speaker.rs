//! Transport of a scripted peer: its socket, sequence numbers, fragments and known addresses.

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::time::{Duration, Instant};

use jaus::address::JausId;

use super::frame::{Frame, Piece, Receipt};
use super::habits::{Habits, Numbering};

const GROUP: Ipv4Addr = Ipv4Addr::new(239, 255, 0, 1);
const PORT: u16 = 3794;
const TTL: u32 = 16;
/// Timeout of an acknowledgement, and number of transmissions of a frame.
const RECEIPT: Duration = Duration::from_millis(200);
const TRIES: usize = 40;
/// Receive buffer size that a peer would request.
const BUFFER: usize = 4 << 20;

/// A complete received message.
#[derive(Debug, Clone)]
pub(super) struct Heard {
    pub(super) source: JausId,
    pub(super) payload: Vec<u8>,
}

/// A sender and receiver of messages.
pub(super) struct Speaker {
    pub(super) id: JausId,
    pub(super) habits: Habits,
    socket: UdpSocket,
    addresses: BTreeMap<JausId, SocketAddr>,
    /// The next sequence number: of all frames, or per destination.
    numbers: BTreeMap<Option<JausId>, u16>,
    /// Octets of the previous datagrams, by address.
    stale: BTreeMap<SocketAddr, Vec<u8>>,
    fragments: BTreeMap<JausId, BTreeMap<u16, Frame>>,
    sent: usize,
    heard: Vec<Heard>,
}

impl Speaker {
    /// Opens its socket on the network of this address.
    pub(super) fn open(id: JausId, habits: Habits, address: Ipv4Addr) -> std::io::Result<Self> {
        // A second actor on the host takes any free port.
        let at = |port| UdpSocket::bind((Ipv4Addr::UNSPECIFIED, port));
        let socket = at(PORT).or_else(|_| at(0))?;
        socket.join_multicast_v4(&GROUP, &address)?;
        socket.set_multicast_ttl_v4(TTL)?;
        let options = socket2::SockRef::from(&socket);
        options.set_multicast_if_v4(&address)?;
        // The system may grant less.
        let _ = options.set_recv_buffer_size(BUFFER);
        Ok(Self {
            id,
            habits,
            socket,
            addresses: BTreeMap::new(),
            numbers: BTreeMap::new(),
            stale: BTreeMap::new(),
            fragments: BTreeMap::new(),
            sent: 0,
            heard: Vec::new(),
        })
    }

    /// Sends a message to one component, or to all that an id with wildcards matches.
    pub(super) fn say(&mut self, to: JausId, message: &[u8]) {
        for frame in self.frames(to, message, Receipt::None) {
            self.transmit(&frame);
        }
    }

    /// Sends a message, and waits for the acknowledgement of each frame before the next one.
    pub(super) fn assure(&mut self, to: JausId, message: &[u8]) -> Result<(), String> {
        for frame in self.frames(to, message, Receipt::Wanted) {
            self.assure_frame(&frame)?;
        }
        Ok(())
    }

    fn assure_frame(&mut self, frame: &Frame) -> Result<(), String> {
        for _ in 0..TRIES {
            self.transmit(frame);
            let deadline = Instant::now() + RECEIPT;
            while let Some(answer) = self.frame(deadline) {
                let is_receipt = answer.receipt == Receipt::Given;
                if is_receipt
                    && answer.sequence == frame.sequence
                    && answer.source == frame.destination
                {
                    return Ok(());
                }
                self.take(answer);
            }
        }
        Err(format!("frame {} was not acknowledged", frame.sequence))
    }

    /// The next message for us before the deadline.
    pub(super) fn hear(&mut self, deadline: Instant) -> Option<Heard> {
        loop {
            if !self.heard.is_empty() {
                return Some(self.heard.remove(0));
            }
            let frame = self.frame(deadline)?;
            self.take(frame);
        }
    }

    /// The frames of a message.
    fn frames(&mut self, to: JausId, message: &[u8], receipt: Receipt) -> Vec<Frame> {
        let is_repeated = self.habits.repeats_code && message.len() > self.habits.fragment;
        let (code, body) = message.split_at(if is_repeated { 2 } else { 0 });
        let pieces: Vec<&[u8]> = body.chunks(self.habits.fragment).collect();
        let last = pieces.len() - 1;
        let priorities = self.habits.priorities;
        let priority = priorities[self.sent % priorities.len()];
        self.sent += 1;
        let first_number = self.reserve(to, pieces.len());
        let is_unknown = !self.addresses.contains_key(&to);
        let receipt = match receipt {
            Receipt::None if is_unknown && self.habits.insists && !to.has_wildcard() => {
                Receipt::Wanted
            }
            receipt => receipt,
        };
        let frame = |(index, piece): (usize, &&[u8])| Frame {
            priority,
            broadcast: if is_unknown { 2 } else { 0 },
            receipt,
            piece: match index {
                _ if last == 0 => Piece::Whole,
                0 => Piece::First,
                index if index == last => Piece::Last,
                _ => Piece::Middle,
            },
            destination: to,
            source: self.id,
            payload: [code, piece].concat(),
            sequence: first_number.wrapping_add(index as u16),
        };
        pieces.iter().enumerate().map(frame).collect()
    }

    /// Reserves `count` sequence numbers and returns the first.
    fn reserve(&mut self, to: JausId, count: usize) -> u16 {
        let (of, start, ahead) = match self.habits.numbering {
            Numbering::From(start) => (None, start, 0),
            Numbering::OneTooHigh => (None, 0, u16::from(count > 1)),
            Numbering::PerDestination => (Some(to), 0, 0),
        };
        let next = self.numbers.entry(of).or_insert(start);
        let first = next.wrapping_add(ahead);
        *next = next.wrapping_add(count as u16);
        first
    }

    fn transmit(&mut self, frame: &Frame) {
        let group = SocketAddr::V4(SocketAddrV4::new(GROUP, PORT));
        let to = self
            .addresses
            .get(&frame.destination)
            .copied()
            .unwrap_or(group);
        let mut datagram = frame.datagram();
        if self.habits.leaves_stale_octets {
            let stale = self.stale.entry(to).or_default();
            datagram.extend(stale.get(datagram.len()..).unwrap_or_default());
            stale.clone_from(&datagram);
        }
        // Sending fails while the cable is out; the missing answers reveal it.
        let _ = self.socket.send_to(&datagram, to);
        if frame.piece != Piece::Whole && frame.receipt == Receipt::None {
            // No receiver keeps up with a whole message sent at once.
            std::thread::sleep(Duration::from_micros(100));
        }
    }

    /// The next frame for us before the deadline.
    fn frame(&mut self, deadline: Instant) -> Option<Frame> {
        let mut buffer = [0; 65_536];
        loop {
            let left = deadline.checked_duration_since(Instant::now())?;
            let left = left.max(Duration::from_millis(1));
            self.socket.set_read_timeout(Some(left)).ok()?;
            let Ok((length, from)) = self.socket.recv_from(&mut buffer) else {
                continue;
            };
            // No captured peer packs two messages into a datagram; further frames are ignored.
            let frame = Frame::all(&buffer[..length]).into_iter().next();
            let Some(frame) = frame.filter(|frame| frame.destination.matches(self.id)) else {
                continue;
            };
            if frame.source == self.id {
                continue;
            }
            self.addresses.insert(frame.source, from);
            return Some(frame);
        }
    }

    /// Acknowledges a frame, and stores it or the message that it completes.
    fn take(&mut self, frame: Frame) {
        match frame.receipt {
            Receipt::Wanted => self.acknowledge(&frame),
            Receipt::None => {}
            Receipt::Refused | Receipt::Given => return,
        }
        let source = frame.source;
        if frame.piece == Piece::Whole {
            return self.heard.push(Heard {
                source,
                payload: frame.payload,
            });
        }
        let fragments = self.fragments.entry(source).or_default();
        if frame.piece == Piece::First {
            // One fragmented message at a time.
            fragments.retain(|number, _| *number >= frame.sequence);
        }
        fragments.insert(frame.sequence, frame);
        if let Some(payload) = whole(fragments, self.habits.repeats_code) {
            self.fragments.remove(&source);
            self.heard.push(Heard { source, payload });
        }
    }

    fn acknowledge(&mut self, frame: &Frame) {
        let receipt = Frame {
            priority: frame.priority,
            broadcast: 0,
            receipt: Receipt::Given,
            piece: frame.piece,
            destination: frame.source,
            source: self.id,
            payload: Vec::new(),
            sequence: frame.sequence,
        };
        self.transmit(&receipt);
    }
}

/// The message of these fragments, if complete.
fn whole(fragments: &BTreeMap<u16, Frame>, repeats_code: bool) -> Option<Vec<u8>> {
    if !fragments.values().any(|frame| frame.piece == Piece::Last) {
        return None;
    }
    let (&start, first) = fragments
        .iter()
        .find(|(_, frame)| frame.piece == Piece::First)?;
    let mut payload = first.payload.clone();
    for number in 1.. {
        let frame = fragments.get(&start.wrapping_add(number))?;
        let rest = match repeats_code {
            true => frame.payload.strip_prefix(first.payload.get(..2)?)?,
            false => &frame.payload[..],
        };
        payload.extend(rest);
        if frame.piece == Piece::Last {
            return Some(payload);
        }
    }
    None
}
