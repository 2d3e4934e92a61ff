//! Baselines of the machine without this library: blocking sockets of the standard library, and a
//! copy.

use std::io::{Read, Write};
use std::net::{SocketAddr, UdpSocket};
use std::os::unix::net::{UnixListener, UnixStream};
use std::time::{Duration, Instant};

use crate::child::Process;
use crate::placement::{Placement, Side};
use crate::roles::{Batching, Role};
use crate::run::folder;

/// Result of one run of sending: messages sent and received, and seconds from the first message
/// sent to the last received.
#[derive(Clone, Copy)]
pub(crate) struct Flow {
    pub(crate) sent: u64,
    pub(crate) received: u64,
    pub(crate) seconds: f64,
}

impl Flow {
    pub(crate) fn rate(self) -> f64 {
        self.received as f64 / self.seconds
    }

    pub(crate) fn lost(self) -> f64 {
        100.0 * self.sent.saturating_sub(self.received) as f64 / self.sent.max(1) as f64
    }
}

/// Round trips of a datagram to a child that echoes each.
pub(crate) struct UdpEcho {
    socket: UdpSocket,
    _child: Process,
}

impl UdpEcho {
    pub(crate) fn start(placement: Placement) -> Self {
        let (socket, _child) = connected(&Role::UdpEcho, placement, Duration::from_secs(5));
        Self { socket, _child }
    }

    pub(crate) fn round_trip(&self, message: &[u8]) -> Duration {
        let mut buffer = [0; 65_536];
        let start = Instant::now();
        self.socket.send(message).expect("sent");
        self.socket.recv(&mut buffer).expect("an echo");
        start.elapsed()
    }
}

pub(crate) fn udp_echo() {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    println!("{}", socket.local_addr().expect("an address"));
    let (mut buffer, from) = ([0; 65_536], socket.peek_from(&mut []).expect("a client").1);
    // Connected like the other end, so that both use `send` and `recv`.
    socket.connect(from).expect("the client's address");
    while let Ok(length) = socket.recv(&mut buffer) {
        // The sender may be gone.
        let _ = socket.send(&buffer[..length]);
    }
}

/// A socket that is connected to a child.
fn connected(role: &Role, placement: Placement, timeout: Duration) -> (UdpSocket, Process) {
    let child = Process::start(role, &placement.of(Side::Theirs));
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    socket.connect(&child.ready).expect("the child's address");
    let timeout = socket.set_read_timeout(Some(timeout));
    timeout.expect("a timeout");
    (socket, child)
}

/// Datagrams of `length` octets to a child that counts them.
pub(crate) fn udp_one_way(
    length: usize,
    time: Duration,
    batching: Batching,
    placement: Placement,
) -> Flow {
    let timeout = Duration::from_millis(200);
    let (socket, _child) = connected(&Role::UdpSink(batching), placement, timeout);
    let datagrams = match batching {
        Batching::Single => 1,
        Batching::Segments => (60_000 / length).clamp(1, 64),
    };
    let octets = vec![1; length * datagrams];
    let (mut sent, start) = (0, Instant::now());
    while start.elapsed() < time {
        for _ in 0..32 {
            let went = match batching {
                Batching::Single => socket.send(&octets).is_ok(),
                Batching::Segments => segments::send(&socket, &octets, length),
            };
            sent += if went { datagrams as u64 } else { 0 };
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    // An empty datagram requests the count; it may be lost among the others.
    for _ in 0..50 {
        socket.send(&[]).expect("sent");
        let mut count = [0; 8];
        if socket.recv(&mut count).is_ok() {
            return Flow {
                sent,
                received: u64::from_le_bytes(count),
                seconds,
            };
        }
    }
    panic!("the child does not say how many came");
}

pub(crate) fn udp_sink(batching: Batching) {
    let socket = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::DGRAM, None);
    let socket = socket.expect("a socket");
    // The size that our links request.
    socket.set_recv_buffer_size(4 << 20).expect("a buffer");
    let any = SocketAddr::from(([127, 0, 0, 1], 0));
    socket.bind(&any.into()).expect("an address");
    let socket = UdpSocket::from(socket);
    println!("{}", socket.local_addr().expect("an address"));
    // Peek leaves the sender's first datagram in the socket.
    let from = socket.peek_from(&mut [0; 65_536]).expect("a client").1;
    socket.connect(from).expect("the client's address");
    if batching == Batching::Segments {
        segments::prepare(&socket);
    }
    let (mut buffer, mut count) = (vec![0; 65_536], 0u64);
    loop {
        let received = match batching {
            Batching::Single => socket.recv(&mut buffer).map(|length| (length, length)),
            Batching::Segments => segments::receive(&socket, &mut buffer),
        };
        match received {
            Ok((0, _)) => drop(socket.send(&count.to_le_bytes())),
            Ok((length, datagram)) => count += length.div_ceil(datagram) as u64,
            Err(_) => return,
        }
    }
}

#[cfg(target_os = "linux")]
mod segments {
    use std::io::{self, IoSlice, IoSliceMut};
    use std::net::UdpSocket;
    use std::os::fd::AsRawFd;

    use nix::sys::socket::{
        ControlMessage, ControlMessageOwned, MsgFlags, recvmsg, sendmsg, setsockopt, sockopt,
    };

    pub(super) fn prepare(socket: &UdpSocket) {
        setsockopt(socket, sockopt::UdpGroSegment, &true).expect("Linux 5.0");
    }

    pub(super) fn send(socket: &UdpSocket, octets: &[u8], datagram: usize) -> bool {
        let segment = datagram as u16;
        let segment = [ControlMessage::UdpGsoSegments(&segment)];
        let octets = [IoSlice::new(octets)];
        sendmsg::<()>(
            socket.as_raw_fd(),
            &octets,
            &segment,
            MsgFlags::empty(),
            None,
        )
        .is_ok()
    }

    /// Octets received with one call, and the length of each datagram but the last.
    pub(super) fn receive(socket: &UdpSocket, into: &mut [u8]) -> io::Result<(usize, usize)> {
        let mut space = nix::cmsg_space!(i32);
        let mut into = [IoSliceMut::new(into)];
        let flags = MsgFlags::empty();
        let received = recvmsg::<()>(socket.as_raw_fd(), &mut into, Some(&mut space), flags)?;
        let segment = received.cmsgs()?.find_map(|message| match message {
            ControlMessageOwned::UdpGroSegments(octets) => usize::try_from(octets).ok(),
            _ => None,
        });
        Ok((received.bytes, segment.unwrap_or(received.bytes)))
    }
}

#[cfg(not(target_os = "linux"))]
mod segments {
    use std::io;
    use std::net::UdpSocket;

    pub(super) fn prepare(_: &UdpSocket) {}

    pub(super) fn send(socket: &UdpSocket, octets: &[u8], datagram: usize) -> bool {
        octets.chunks(datagram).all(|it| socket.send(it).is_ok())
    }

    pub(super) fn receive(socket: &UdpSocket, into: &mut [u8]) -> io::Result<(usize, usize)> {
        socket.recv(into).map(|length| (length, length))
    }
}

/// Sends octets over a Unix stream to a child that counts them, in writes of 16 KiB or one message.
pub(crate) fn unix_one_way(length: usize, time: Duration, placement: Placement) -> Flow {
    let path = folder().join("one-way.sock");
    // Left by the previous run.
    let _ = std::fs::remove_file(&path);
    let listener = UnixListener::bind(&path).expect("a socket");
    let sink = Role::StreamSink(path);
    let _child = Process::start(&sink, &placement.of(Side::Theirs));
    let (mut stream, _) = listener.accept().expect("the sink");
    let messages = ((16 << 10) / length).max(1);
    let octets = vec![1; messages * length];
    let (mut sent, start) = (0, Instant::now());
    while start.elapsed() < time {
        stream.write_all(&octets).expect("sent");
        sent += messages as u64;
    }
    let end = stream.shutdown(std::net::Shutdown::Write);
    end.expect("an open stream");
    let mut count = [0; 8];
    stream.read_exact(&mut count).expect("a count");
    Flow {
        sent,
        received: u64::from_le_bytes(count) / length as u64,
        seconds: start.elapsed().as_secs_f64(),
    }
}

pub(crate) fn stream_sink(at: &std::path::Path) {
    let mut stream = UnixStream::connect(at).expect("the measuring side");
    println!("ready");
    let (mut buffer, mut count) = ([0; 65_536], 0u64);
    while let Ok(length @ 1..) = stream.read(&mut buffer) {
        count += length as u64;
    }
    // The measuring side may be gone.
    let _ = stream.write_all(&count.to_le_bytes());
}

/// Octets per second of a copy in memory, in pieces of `length`.
pub(crate) fn memcpy(length: usize) -> f64 {
    let from = vec![1u8; length];
    let mut to = vec![0u8; length];
    let (mut copied, start) = (0, Instant::now());
    while start.elapsed() < Duration::from_millis(100) {
        for _ in 0..64 {
            to.copy_from_slice(std::hint::black_box(&from));
            std::hint::black_box(&mut to);
            copied += length;
        }
    }
    copied as f64 / start.elapsed().as_secs_f64()
}
