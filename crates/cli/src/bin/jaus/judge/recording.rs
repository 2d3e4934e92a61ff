//! Records the run as a capture file. Packets are written as the judge's components sent and
//! received them, with their step as a comment; their sequence numbers are generated here, because
//! the real ones are internal to the transport.
#![expect(
    clippy::disallowed_methods,
    reason = "a recording carries the time of day"
)]

use std::fs::File;
use std::io::{self, BufWriter};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use etherparse::PacketBuilder;
use jaus::endpoint::{Outgoing, Received};
use jaus::node::Node;
use jaus::wire::{Flags, Frame, judp};
use jaus_cli::failure::Failure;
use jaus_view::{CaptureWriter, InterfaceNumber, LinkType, Timestamp};

use crate::recordings;

/// Assumed TTL of recorded packets.
const TTL: u8 = 16;
/// Stands for an unknown address.
const UNKNOWN: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::UNSPECIFIED), 0);

/// The capture file of a run.
pub(super) struct Recording {
    path: PathBuf,
    writer: CaptureWriter<BufWriter<File>>,
    interface: InterfaceNumber,
    sequence: u16,
}

impl Recording {
    /// Creates the file, replacing an existing one.
    pub(super) fn create(path: &Path) -> Result<Self, Failure> {
        let failed = |error: io::Error| Failure::file(path, &error);
        let file = recordings::create(path, true)?;
        let program = concat!("jaus ", env!("CARGO_PKG_VERSION"), " judge");
        let mut writer = CaptureWriter::new(BufWriter::new(file), program).map_err(failed)?;
        let interface = writer
            .add_interface("judge", LinkType::RAW)
            .map_err(failed)?;
        Ok(Self {
            path: path.to_owned(),
            writer,
            interface,
            sequence: 0,
        })
    }

    /// Records a message that one of the judge's components is about to send.
    pub(super) fn sent(
        &mut self,
        node: &Node,
        message: &Outgoing,
        step: &str,
    ) -> Result<(), Failure> {
        let link = node.links().into_iter().next();
        let source = link.as_ref().map_or(UNKNOWN, |link| link.local);
        let group = link.and_then(|link| link.group);
        let peers = node.peers();
        let known = peers.iter().find(|peer| peer.id == message.destination);
        let known = known.and_then(|peer| peer.path.peer.socket());
        let destination = known.or(group).unwrap_or(UNKNOWN);
        let flags = Flags::new(message.priority).with_broadcast(message.broadcast);
        let frame = Frame {
            flags,
            ..Frame::new(message.source, message.destination, message.payload.clone())
        };
        self.write(source, destination, frame, step)
    }

    /// Records a message of the subject.
    pub(super) fn received(
        &mut self,
        node: &Node,
        message: &Received,
        step: &str,
    ) -> Result<(), Failure> {
        let source = message.path.and_then(|path| path.peer.socket());
        let link = node.links().into_iter().next();
        let destination = link.map_or(UNKNOWN, |link| link.local);
        let flags = Flags::new(message.priority).with_broadcast(message.broadcast);
        let frame = Frame {
            flags,
            ..Frame::new(message.source, message.destination, message.payload.clone())
        };
        self.write(source.unwrap_or(UNKNOWN), destination, frame, step)
    }

    fn write(
        &mut self,
        source: SocketAddr,
        destination: SocketAddr,
        mut frame: Frame,
        step: &str,
    ) -> Result<(), Failure> {
        frame.sequence = self.sequence;
        self.sequence = self.sequence.wrapping_add(1);
        // The script has no message longer than a datagram; longer ones are not recorded.
        let Ok(datagram) = judp::encode(&frame) else {
            return Ok(());
        };
        let builder = match (source.ip(), destination.ip()) {
            (IpAddr::V6(from), IpAddr::V6(to)) => {
                PacketBuilder::ipv6(from.octets(), to.octets(), TTL)
            }
            (from, to) => PacketBuilder::ipv4(octets(from), octets(to), TTL),
        };
        let mut packet = Vec::new();
        let builder = builder.udp(source.port(), destination.port());
        let built = builder.write(&mut packet, &datagram);
        built.map_err(|error| Failure::new(format!("{}: {error}", self.path.display())))?;
        let written = self
            .writer
            .write_with_comment(self.interface, now(), &packet, step);
        written.map_err(|error| Failure::file(&self.path, &error))
    }

    /// Flushes everything to disk.
    pub(super) fn end(mut self) -> Result<(), Failure> {
        let flushed = self.writer.flush();
        flushed.map_err(|error| Failure::file(&self.path, &error))
    }
}

/// An IPv4 address, or the unspecified one.
const fn octets(address: IpAddr) -> [u8; 4] {
    match address {
        IpAddr::V4(address) => address.octets(),
        IpAddr::V6(_) => [0; 4],
    }
}

fn now() -> Timestamp {
    // A clock before 1970 is treated as 1970.
    let time = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    Timestamp::new(time.as_secs() as i64, time.subsec_nanos(), 9)
}
