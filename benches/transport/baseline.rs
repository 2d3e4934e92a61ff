//! What the machine can do without us: blocking sockets of the standard library, and a copy.

use std::io::{Read, Write};
use std::net::UdpSocket;
use std::os::unix::net::{UnixListener, UnixStream};
use std::time::{Duration, Instant};

use crate::child::Process;
use crate::roles::Role;

/// Round trips of a datagram to a child that sends each back.
pub(crate) struct UdpEcho {
    socket: UdpSocket,
    _child: Process,
}

impl UdpEcho {
    pub(crate) fn start() -> Self {
        let child = Process::start(&Role::UdpEcho);
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
        socket.connect(&child.ready).expect("the child's address");
        socket
            .set_read_timeout(Some(Duration::from_secs(5)))
            .expect("a timeout");
        Self {
            socket,
            _child: child,
        }
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
    let mut buffer = [0; 65_536];
    while let Ok((length, from)) = socket.recv_from(&mut buffer) {
        // A sender that has gone is none of ours.
        let _ = socket.send_to(&buffer[..length], from);
    }
}

/// Round trips over a Unix stream to a child that sends each octet back.
pub(crate) struct UnixEcho {
    stream: UnixStream,
    _child: Process,
}

impl UnixEcho {
    pub(crate) fn start() -> Self {
        let child = Process::start(&Role::UnixEcho);
        let stream = UnixStream::connect(&child.ready).expect("the child's socket");
        Self {
            stream,
            _child: child,
        }
    }

    pub(crate) fn round_trip(&mut self, message: &[u8]) -> Duration {
        let mut buffer = vec![0; message.len()];
        let start = Instant::now();
        self.stream.write_all(message).expect("sent");
        self.stream.read_exact(&mut buffer).expect("an echo");
        start.elapsed()
    }
}

pub(crate) fn unix_echo() {
    let folder = crate::run::folder();
    let path = format!("{}/echo-{}.sock", folder.display(), std::process::id());
    let listener = UnixListener::bind(&path).expect("a socket");
    println!("{path}");
    let (mut stream, _) = listener.accept().expect("a client");
    let mut buffer = [0; 65_536];
    while let Ok(length @ 1..) = stream.read(&mut buffer) {
        stream.write_all(&buffer[..length]).expect("sent");
    }
}

/// Datagrams of so many octets to a child that counts them: (sent, received, seconds).
pub(crate) fn udp_one_way(length: usize, time: Duration) -> (u64, u64, f64) {
    let child = Process::start(&Role::UdpSink);
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    socket.connect(&child.ready).expect("the child's address");
    socket
        .set_read_timeout(Some(Duration::from_millis(200)))
        .expect("a timeout");
    let message = vec![1; length];
    let (mut sent, start) = (0, Instant::now());
    while start.elapsed() < time {
        for _ in 0..32 {
            sent += u64::from(socket.send(&message).is_ok());
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    // An empty datagram asks how many came; it may be lost in the crowd.
    for _ in 0..50 {
        socket.send(&[]).expect("sent");
        let mut count = [0; 8];
        if socket.recv(&mut count).is_ok() {
            return (sent, u64::from_le_bytes(count), seconds);
        }
    }
    panic!("the child does not say how many came");
}

pub(crate) fn udp_sink() {
    let socket = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::DGRAM, None);
    let socket = socket.expect("a socket");
    // As large as our links ask for.
    socket.set_recv_buffer_size(4 << 20).expect("a buffer");
    let any = std::net::SocketAddr::from(([127, 0, 0, 1], 0));
    socket.bind(&any.into()).expect("an address");
    let socket = UdpSocket::from(socket);
    println!("{}", socket.local_addr().expect("an address"));
    let (mut buffer, mut count) = ([0; 65_536], 0u64);
    while let Ok((length, from)) = socket.recv_from(&mut buffer) {
        if length > 0 {
            count += 1;
        } else {
            let _ = socket.send_to(&count.to_le_bytes(), from);
        }
    }
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
