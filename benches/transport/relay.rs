//! Bare relays that only copy, with the same number of processes and hops as a path through nodes.
//! One thread per direction blocks in the kernel.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, UdpSocket};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::child::Process;
use crate::placement::{Placement, Side};
use crate::roles::Role;
use crate::run::folder;

/// Round trips over a Unix stream to a child that echoes each octet: directly, through one relay,
/// or through two with UDP between them.
pub(crate) struct StreamEcho {
    stream: UnixStream,
    _children: Vec<Process>,
}

impl StreamEcho {
    pub(crate) fn start(relays: usize, placement: Placement) -> Self {
        let [near, far] = ["near", "far"].map(|end| {
            let name = format!("relay-{relays}-{end}-{placement:?}.sock");
            folder().join(name)
        });
        let start = |role: &Role, side| Process::start(role, &placement.of(side));
        let echo = |at: &Path| start(&Role::StreamEcho(at.into()), Side::Theirs);
        let connect = |at: &Path| UnixStream::connect(at).expect("a relay");
        let (stream, _children) = match relays {
            0 => {
                let listener = UnixListener::bind(&near).expect("a socket");
                let child = echo(&near);
                (listener.accept().expect("the echo").0, vec![child])
            }
            1 => {
                let relay = start(&Role::Relay(near.clone()), Side::Ours);
                let stream = connect(&near);
                (stream, vec![relay, echo(&near)])
            }
            _ => {
                let first = start(&Role::DatagramRelay(near.clone(), None), Side::Ours);
                let address = first.ready.parse().expect("the relay's address");
                let second = Role::DatagramRelay(far.clone(), Some(address));
                let second = start(&second, Side::Theirs);
                let stream = connect(&near);
                (stream, vec![first, second, echo(&far)])
            }
        };
        Self { stream, _children }
    }

    pub(crate) fn round_trip(&mut self, message: &[u8]) -> Duration {
        let mut buffer = vec![0; message.len()];
        let start = Instant::now();
        self.stream.write_all(message).expect("sent");
        self.stream.read_exact(&mut buffer).expect("an echo");
        start.elapsed()
    }
}

/// A child: echoes received octets.
pub(crate) fn stream_echo(at: &Path) {
    let mut stream = UnixStream::connect(at).expect("a relay, or the measuring side");
    println!("ready");
    let mut back = stream.try_clone().expect("the same stream");
    copy(
        |buffer| stream.read(buffer),
        |octets| back.write_all(octets),
    );
}

/// A child: copies between the two streams that connect first.
pub(crate) fn relay(at: &Path) {
    let listener = UnixListener::bind(at).expect("a socket");
    println!("ready");
    let accept = || listener.accept().expect("a client").0;
    let [mut one, mut two] = [accept(), accept()];
    let [mut to_one, mut to_two] = [&one, &two].map(|it| it.try_clone().expect("the same"));
    std::thread::spawn(move || copy(|into| one.read(into), |octets| to_two.write_all(octets)));
    copy(|into| two.read(into), |octets| to_one.write_all(octets));
}

/// A child: copies between the stream that connects first and another relay.
pub(crate) fn datagram_relay(at: &PathBuf, other: Option<SocketAddr>) {
    let listener = UnixListener::bind(at).expect("a socket");
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    println!("{}", socket.local_addr().expect("an address"));
    let other = other.unwrap_or_else(|| socket.recv_from(&mut []).expect("the other relay").1);
    socket.connect(other).expect("the other relay");
    // Announces this relay's address.
    socket.send(&[]).expect("sent");
    let mut stream = listener.accept().expect("a client").0;
    let mut to_stream = stream.try_clone().expect("the same stream");
    let datagrams = socket.try_clone().expect("the same socket");
    std::thread::spawn(move || {
        // The other relay's first datagram is empty, and does not mean the end.
        let next = |into: &mut [u8]| loop {
            match datagrams.recv(into) {
                Ok(0) => {}
                result => return result,
            }
        };
        copy(next, |octets| to_stream.write_all(octets));
    });
    copy(
        |into| stream.read(into),
        |octets| socket.send(octets).map(drop),
    );
}

/// Copies until the input ends or the output is closed.
fn copy(
    mut read: impl FnMut(&mut [u8]) -> io::Result<usize>,
    mut write: impl FnMut(&[u8]) -> io::Result<()>,
) {
    let mut buffer = [0; 65_536];
    while let Ok(length @ 1..) = read(&mut buffer) {
        if write(&buffer[..length]).is_err() {
            break;
        }
    }
}
