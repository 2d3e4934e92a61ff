//! Packets of this host's network, without a part in it: for `jaus record` and `jaus watch --interface`.
#![expect(
    clippy::disallowed_methods,
    reason = "a packet carries the time of day at which it passed"
)]

mod group;
#[cfg(target_os = "linux")]
mod socket;

use std::time::{SystemTime, UNIX_EPOCH};

use bytes::Bytes;
use jaus::link::{Group, Interfaces};
use jaus_cli::failure::Failure;
use jaus_cli::output::say;
use jaus_view::{Frame, LinkType, Timestamp};

/// A captured IP packet.
#[derive(Clone)]
pub(super) struct Packet {
    pub(super) interface: String,
    pub(super) time: Timestamp,
    pub(super) octets: Bytes,
}

impl Packet {
    fn now(interface: &str, octets: Bytes) -> Self {
        // A clock before 1970 is treated as 1970.
        let time = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default();
        Self {
            interface: interface.to_owned(),
            time: Timestamp::new(time.as_secs() as i64, time.subsec_nanos(), 9),
            octets,
        }
    }

    /// The packet as a frame of a capture: a frame without a link header, and without a loss before it.
    pub(super) fn frame(&self) -> Frame<'_> {
        Frame {
            time: Some(self.time),
            link: LinkType::RAW,
            octets: &self.octets,
            lost: 0,
            // Packets have at most 64 KiB, and are captured whole.
            length: self.octets.len() as u32,
            interface: &self.interface,
        }
    }
}

/// Source of packets.
pub(super) enum Source {
    #[cfg(target_os = "linux")]
    Socket(socket::PacketSocket),
    /// Without the privilege, or on other systems.
    Group(group::Listeners),
}

impl Source {
    /// Opens the interfaces with these names or addresses, or all.
    pub(super) fn open(interfaces: &[String], group: Group) -> Result<Self, Failure> {
        #[cfg(target_os = "linux")]
        match socket::PacketSocket::open(interfaces) {
            Ok(socket) => return Ok(Self::Socket(socket)),
            Err(socket::OpenError::NotAllowed) => say(
                "this process may not open packet sockets (run as root, or grant the privilege \
                 once: `sudo setcap cap_net_raw+ep $(which jaus)`). Only multicast is seen, not \
                 unicast between other nodes",
            ),
            Err(socket::OpenError::Other(failure)) => return Err(failure),
        }
        let interfaces = match interfaces {
            [] => Interfaces::All,
            names => Interfaces::Only(names.to_vec()),
        };
        Ok(Self::Group(group::Listeners::open(&interfaces, group)?))
    }

    /// Waits for packets.
    pub(super) async fn next(&mut self) -> Result<Vec<Packet>, Failure> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Socket(socket) => socket.next().await,
            Self::Group(listeners) => Ok(listeners.next().await),
        }
    }

    /// The packets that wait, without waiting for more.
    pub(super) fn rest(&mut self) -> Result<Vec<Packet>, Failure> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Socket(socket) => socket.rest(),
            Self::Group(_) => Ok(Vec::new()),
        }
    }

    /// Number of packets, JAUS or not, that were lost since the last call because they were not read
    /// in time. Only packet sockets count them.
    pub(super) fn take_lost(&self) -> u64 {
        match self {
            #[cfg(target_os = "linux")]
            Self::Socket(socket) => socket.take_lost(),
            Self::Group(_) => 0,
        }
    }
}
