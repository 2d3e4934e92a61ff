//! Roles of the benchmark's child processes, and their encoding for the command line.

use std::env;
use std::net::SocketAddr;
use std::path::PathBuf;

use jaus::address::JausId;
use jaus::endpoint::Received;
use jaus::node::PeerAddress;

use crate::place::Place;

/// The code of all messages here: an experimental one, which no service handles.
pub(crate) const CODE: [u8; 2] = [0x01, 0xD7];
/// The code of the query for a sink's message count, and of its answer.
pub(crate) const COUNT: [u8; 2] = [0x02, 0xD7];

/// How datagrams are passed to the kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Batching {
    /// One per call.
    Single,
    /// As many as one call takes (`UDP_SEGMENT`, `UDP_GRO`), as our links do.
    Segments,
}

/// A role with its parameters.
#[derive(Clone, Debug)]
pub(crate) enum Role {
    /// Echoes datagrams.
    UdpEcho,
    /// Counts datagrams.
    UdpSink(Batching),
    /// Connects to a stream and echoes octets.
    StreamEcho(PathBuf),
    /// Connects to a stream and counts octets.
    StreamSink(PathBuf),
    /// Copies between two streams.
    Relay(PathBuf),
    /// Copies between a stream and another relay, at this address if that relay has started
    /// already.
    DatagramRelay(PathBuf, Option<SocketAddr>),
    /// Delays datagrams between two addresses and drops a percentage of them, by a seed.
    Network(SocketAddr, SocketAddr, u8, u64),
    /// A component that echoes messages.
    Echo(JausId, Place),
    /// A component that counts messages.
    Sink(JausId, Place),
    /// The same on a node at an address, which knows one peer.
    SinkAt(JausId, SocketAddr, PeerAddress),
    /// A sensor at an address, with its subscribers.
    Sensor(SocketAddr, Vec<SocketAddr>),
    /// A node for other processes that serves this socket.
    Node(JausId, Place),
    /// An idle node with this number of components.
    Idle(usize),
}

impl Role {
    /// The environment variable that names the role.
    pub(crate) const VARIABLE: &str = "JAUS_BENCH_ROLE";

    pub(crate) fn to_words(&self) -> String {
        match self {
            Self::UdpEcho => "udp-echo".into(),
            Self::UdpSink(Batching::Single) => "udp-sink".into(),
            Self::UdpSink(Batching::Segments) => "udp-sink-segments".into(),
            Self::StreamEcho(at) => format!("stream-echo {}", at.display()),
            Self::StreamSink(at) => format!("stream-sink {}", at.display()),
            Self::Relay(at) => format!("relay {}", at.display()),
            Self::DatagramRelay(at, None) => format!("datagram-relay {}", at.display()),
            Self::DatagramRelay(at, Some(to)) => format!("datagram-relay {} {to}", at.display()),
            Self::Network(one, two, percent, seed) => {
                format!("network {one} {two} {percent} {seed}")
            }
            Self::SinkAt(id, at, peer) => format!("sink-at {id} {at} {peer}"),
            Self::Sensor(at, subscribers) => {
                let words = subscribers.iter().map(|address| format!(" {address}"));
                format!("sensor {at}{}", words.collect::<String>())
            }
            Self::Echo(id, place) => format!("echo {id} {place}"),
            Self::Sink(id, place) => format!("sink {id} {place}"),
            Self::Node(id, place) => format!("node {id} {place}"),
            Self::Idle(components) => format!("idle {components}"),
        }
    }

    fn from_words(words: &str) -> Option<Self> {
        let words: Vec<_> = words.split(' ').collect();
        let component = |id: &str, place: &str| Some((id.parse().ok()?, place.parse().ok()?));
        Some(match words[..] {
            ["udp-echo"] => Self::UdpEcho,
            ["udp-sink"] => Self::UdpSink(Batching::Single),
            ["udp-sink-segments"] => Self::UdpSink(Batching::Segments),
            ["stream-echo", at] => Self::StreamEcho(at.into()),
            ["stream-sink", at] => Self::StreamSink(at.into()),
            ["relay", at] => Self::Relay(at.into()),
            ["datagram-relay", at] => Self::DatagramRelay(at.into(), None),
            ["datagram-relay", at, to] => Self::DatagramRelay(at.into(), Some(to.parse().ok()?)),
            ["network", one, two, percent, seed] => Self::Network(
                one.parse().ok()?,
                two.parse().ok()?,
                percent.parse().ok()?,
                seed.parse().ok()?,
            ),
            ["sink-at", id, at, peer] => {
                Self::SinkAt(id.parse().ok()?, at.parse().ok()?, peer.parse().ok()?)
            }
            ["sensor", at, ref subscribers @ ..] => {
                let subscribers = subscribers.iter().map(|it| it.parse());
                Self::Sensor(
                    at.parse().ok()?,
                    subscribers.collect::<Result<_, _>>().ok()?,
                )
            }
            ["echo", id, place] => component(id, place).map(|(id, at)| Self::Echo(id, at))?,
            ["sink", id, place] => component(id, place).map(|(id, at)| Self::Sink(id, at))?,
            ["node", id, place] => component(id, place).map(|(id, at)| Self::Node(id, at))?,
            ["idle", components] => Self::Idle(components.parse().ok()?),
            _ => return None,
        })
    }
}

/// The role of this process; `None` for the one that the user started.
pub(crate) fn of_this_process() -> Option<Role> {
    let words = env::var(Role::VARIABLE).ok()?;
    Some(Role::from_words(&words).unwrap_or_else(|| panic!("{words} is no role")))
}

/// One thread for node, components and sockets, as on a small board.
pub(crate) fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .expect("a runtime")
}

/// Whether a message has a code.
pub(crate) fn is(message: &Received, code: [u8; 2]) -> bool {
    message.payload.starts_with(&code)
}
