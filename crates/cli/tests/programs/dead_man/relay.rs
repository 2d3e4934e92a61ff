//! A cable with delay, jitter, loss and a rate: a bridge in user space between two interfaces. It acts
//! on IP packets, so that TCP meets what it would meet on a radio link, and all connections share one
//! queue in each direction.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fs::File;
use std::io;
use std::os::fd::{AsFd, AsRawFd, OwnedFd};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use jaus_test_kit::random::Random;
use nix::errno::Errno;
use nix::ifaddrs::getifaddrs;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sched::{CloneFlags, setns};
use nix::sys::socket::{
    AddressFamily, MsgFlags, SockFlag, SockProtocol, SockType, bind, recv, send, socket,
};

/// Most octets that wait for their turn in one direction; what comes later is lost. A modem's buffer:
/// small for a fast link, 40 s at 400 octets/s.
const QUEUE: f64 = 16_384.0;
/// Octets of an Ethernet header.
const ETHERNET: usize = 14;
/// Largest frame.
const FRAME: usize = ETHERNET + 1500;

/// How one direction of the link treats IP packets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Conditions {
    /// The least time that a packet is under way.
    pub(crate) delay: Duration,
    /// Each packet is under way longer by up to this: packets overtake one another.
    pub(crate) jitter: Duration,
    /// How many of 1000 packets are lost.
    pub(crate) loss: u32,
    /// Octets of IP packets per second, if limited.
    pub(crate) rate: Option<f64>,
}

impl Conditions {
    pub(crate) const CLEAR: Self = Self {
        delay: Duration::ZERO,
        jitter: Duration::ZERO,
        loss: 0,
        rate: None,
    };
    /// Nothing arrives.
    pub(crate) const CUT: Self = Self {
        loss: 1000,
        ..Self::CLEAR
    };
}

/// A direction: its conditions, and how often they have changed.
struct Direction {
    conditions: Mutex<(Conditions, u64)>,
    ends: AtomicBool,
}

/// The running relay; ends when dropped.
pub(crate) struct Relay {
    directions: [Arc<Direction>; 2],
    threads: Vec<JoinHandle<()>>,
}

impl Relay {
    /// Bridges two interfaces of a host. The first direction is from the first to the second.
    ///
    /// # Errors
    /// If this machine does not permit it.
    pub(crate) fn start(host: &str, interfaces: [&str; 2]) -> Result<Self, String> {
        let [first, second] = open_on(host, interfaces)?.map(Arc::new);
        let directions = [1, 2].map(|_| {
            Arc::new(Direction {
                conditions: Mutex::new((Conditions::CLEAR, 0)),
                ends: AtomicBool::new(false),
            })
        });
        let ways = [(first.clone(), second.clone()), (second, first)];
        let threads = ways.into_iter().zip(&directions).zip(1..);
        let threads = threads.map(|(((from, to), direction), seed)| {
            let direction = direction.clone();
            thread::spawn(move || forward(&from, &to, &direction, Random::new(seed)))
        });
        Ok(Self {
            threads: threads.collect(),
            directions,
        })
    }

    /// Sets the conditions of both directions. Packets that are under way are lost.
    pub(crate) fn set(&self, conditions: [Conditions; 2]) {
        for (direction, conditions) in self.directions.iter().zip(conditions) {
            let mut current = direction.conditions.lock().unwrap();
            *current = (conditions, current.1 + 1);
        }
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        for direction in &self.directions {
            direction.ends.store(true, Ordering::Relaxed);
        }
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

/// Opens a packet socket on each interface. A thread of its own enters the host for that.
fn open_on(host: &str, interfaces: [&str; 2]) -> Result<[OwnedFd; 2], String> {
    let host = format!("/var/run/netns/{host}");
    let open = || -> Result<[OwnedFd; 2], io::Error> {
        setns(File::open(&host)?, CloneFlags::CLONE_NEWNET)?;
        let [first, second] = interfaces.map(open);
        Ok([first?, second?])
    };
    let opened = thread::scope(|scope| scope.spawn(open).join()).unwrap();
    opened.map_err(|error| format!("packet sockets on {host}: {error}"))
}

fn open(interface: &str) -> io::Result<OwnedFd> {
    let flags = SockFlag::SOCK_CLOEXEC | SockFlag::SOCK_NONBLOCK;
    let opened = socket(
        AddressFamily::Packet,
        SockType::Raw,
        flags,
        SockProtocol::EthAll,
    )?;
    let mut addresses = getifaddrs()?.filter(|it| it.interface_name == interface);
    let address = addresses.find_map(|it| it.address?.as_link_addr().copied());
    bind(opened.as_raw_fd(), &address.ok_or(io::ErrorKind::NotFound)?)?;
    Ok(opened)
}

/// A frame under way, ordered by when it arrives.
type Pending = Reverse<(Instant, u64, Vec<u8>)>;

/// Carries the frames of one direction until the relay ends.
fn forward(from: &OwnedFd, to: &OwnedFd, direction: &Direction, mut random: Random) {
    let mut pending: BinaryHeap<Pending> = BinaryHeap::new();
    let mut frame = [0; FRAME + 1];
    let (mut count, mut changes) = (0, 0);
    // When the last octet of the queue has left.
    let mut free_at = Instant::now();
    while !direction.ends.load(Ordering::Relaxed) {
        wait(from, pending.peek().map(|Reverse((due, ..))| *due));
        let (conditions, change) = *direction.conditions.lock().unwrap();
        if std::mem::replace(&mut changes, change) != change {
            pending.clear();
            free_at = Instant::now();
        }
        while let Some(length) = receive(from, &mut frame) {
            let frame = &mut frame[..length];
            if !is_ip4(frame) || random.happens(conditions.loss) {
                continue;
            }
            let now = Instant::now();
            free_at = free_at.max(now);
            if let Some(rate) = conditions.rate {
                let octets = (length - ETHERNET) as f64;
                if (free_at - now).as_secs_f64() * rate + octets > QUEUE {
                    continue;
                }
                free_at += Duration::from_secs_f64(octets / rate);
            }
            let jitter = random.between(&(Duration::ZERO..conditions.jitter));
            complete_checksum(frame);
            count += 1;
            let due = free_at + conditions.delay + jitter;
            pending.push(Reverse((due, count, frame.to_vec())));
        }
        let now = Instant::now();
        while pending.peek().is_some_and(|Reverse((due, ..))| *due <= now) {
            let Reverse((.., frame)) = pending.pop().unwrap();
            // The interface's own queue is full at most for a moment: a lost packet.
            let _ = send(to.as_raw_fd(), &frame, MsgFlags::empty());
        }
    }
}

/// Waits for a frame, but at most until this time, and for 20 ms.
fn wait(from: &OwnedFd, until: Option<Instant>) {
    const LONGEST: Duration = Duration::from_millis(20);
    let left = until.map_or(LONGEST, |it| it.saturating_duration_since(Instant::now()));
    let millis = left.min(LONGEST).as_micros().div_ceil(1000) as u16;
    let mut polled = [PollFd::new(from.as_fd(), PollFlags::POLLIN)];
    let _ = poll(&mut polled, PollTimeout::from(millis));
}

/// The length of the next frame, if there is one.
fn receive(from: &OwnedFd, frame: &mut [u8]) -> Option<usize> {
    match recv(from.as_raw_fd(), frame, MsgFlags::empty()) {
        Ok(length) => {
            assert!(length <= FRAME, "a frame of more than {FRAME} octets");
            Some(length)
        }
        Err(Errno::EAGAIN | Errno::EINTR | Errno::ENETDOWN) => None,
        Err(error) => panic!("cannot receive: {error}"),
    }
}

fn is_ip4(frame: &[u8]) -> bool {
    frame.len() > ETHERNET + 20 && frame[12..ETHERNET] == [0x08, 0x00]
}

/// Writes the checksum of a TCP or UDP packet, which a virtual cable leaves to the receiving card.
fn complete_checksum(frame: &mut [u8]) {
    let packet = &mut frame[ETHERNET..];
    let header = usize::from(packet[0] & 0x0F) * 4;
    let length = usize::from(u16::from_be_bytes([packet[2], packet[3]]));
    let place = match packet[9] {
        6 => 16,
        17 => 6,
        _ => return,
    };
    let pseudo_header = sum(&packet[12..20]) + u32::from(packet[9]) + (length - header) as u32;
    let segment = &mut packet[header..length];
    segment[place..place + 2].fill(0);
    let mut total = pseudo_header + sum(segment);
    while total > 0xFFFF {
        total = (total & 0xFFFF) + (total >> 16);
    }
    let checksum = match !(total as u16) {
        0 => 0xFFFF,
        checksum => checksum,
    };
    segment[place..place + 2].copy_from_slice(&checksum.to_be_bytes());
}

/// The sum of the 16-bit words.
fn sum(octets: &[u8]) -> u32 {
    let words = octets
        .chunks(2)
        .map(|it| u32::from(it[0]) << 8 | it.get(1).map_or(0, |&low| u32::from(low)));
    words.sum()
}
