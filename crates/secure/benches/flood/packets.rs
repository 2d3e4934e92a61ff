//! Datagrams for a node without sockets.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::wire::{Frame, Priority, judp};
use jaus_secure::transport::Transport;
use jaus_secure::{Key, Trust, TrustFile};

const VEHICLE: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::new(10, 0, 0, 1)), 3795);
const OPERATOR: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::new(10, 0, 0, 2)), 3795);
/// The time between datagrams that are within every limit.
const SLOW: Duration = Duration::from_micros(50);
/// More first packets than a node answers at once.
const BURST: usize = 5000;

/// What arrives.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Session,
    First,
    Token,
    Excess,
}

impl Kind {
    pub(crate) const ALL: [Self; 4] = [Self::Session, Self::First, Self::Token, Self::Excess];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Session => "of a session, 1000 octets",
            Self::First => "forged first packet, answered by a Retry packet",
            Self::Token => "the same with a forged token",
            Self::Excess => "forged first packet beyond the limit",
        }
    }
}

/// A vehicle and an operator with a session.
pub(crate) struct Pair {
    vehicle: Transport,
    operator: Transport,
    now: Instant,
}

impl Pair {
    pub(crate) fn new() -> Self {
        let keys = [key(), key()];
        let trust = |name: &str, key: &Key, ids: &str| {
            let line = format!("{name} {} {ids} command", key.public());
            TrustFile::of(Trust::parse(&line).expect("a trusted key"))
        };
        let [vehicle, operator] = [&keys[0], &keys[1]];
        let mut pair = Self {
            vehicle: Transport::new(vehicle, trust("operator", operator, "60.255.255"), []),
            operator: Transport::new(operator, trust("rover", vehicle, "101.255.255"), [VEHICLE]),
            now: Instant::now(),
        };
        while pair.vehicle.sessions().next().is_none() || pair.operator.sessions().next().is_none()
        {
            pair.exchange();
        }
        // What follows a handshake.
        (0..10).for_each(|_| pair.exchange());
        pair
    }

    fn exchange(&mut self) {
        self.now += Duration::from_millis(1);
        let now = self.now;
        self.operator.handle_timeout(now);
        self.vehicle.handle_timeout(now);
        while let Some(sent) = self.operator.poll_transmit(now, 1) {
            self.vehicle.handle_datagram(now, OPERATOR, &sent.octets);
        }
        while let Some(sent) = self.vehicle.poll_transmit(now, 1) {
            self.operator.handle_datagram(now, VEHICLE, &sent.octets);
        }
    }

    /// Lets the vehicle process so many datagrams; returns the time that this takes, and the number
    /// of answers.
    pub(crate) fn receive(&mut self, kind: Kind, count: usize) -> (Duration, usize) {
        match kind {
            Kind::Session => self.receive_messages(count),
            Kind::First => self.receive_forged(SLOW, &first_packets(count)),
            Kind::Token => {
                let packets: Vec<_> = first_packets(count).iter().map(with_token).collect();
                self.receive_forged(SLOW, &packets)
            }
            Kind::Excess => {
                self.receive_forged(Duration::ZERO, &first_packets(BURST));
                self.receive_forged(Duration::ZERO, &first_packets(count))
            }
        }
    }

    fn receive_messages(&mut self, count: usize) -> (Duration, usize) {
        let session = self.operator.sessions().next().expect("a session").session;
        let source: JausId = "60.1.1".parse().expect("an id");
        let frame = Frame::new(source, JausId::EVERYONE, vec![7; 1000].into());
        let message = judp::encode(&frame).expect("a message");
        let (mut time, mut received) = (Duration::ZERO, 0);
        while received < count {
            self.operator.send(session, Priority::Standard, &message);
            self.now += Duration::from_millis(1);
            while let Some(sent) = self.operator.poll_transmit(self.now, 1) {
                let start = Instant::now();
                self.vehicle
                    .handle_datagram(self.now, OPERATOR, &sent.octets);
                while self.vehicle.poll_arrival().is_some() {
                    received += 1;
                }
                time += start.elapsed();
            }
            // Acknowledgements.
            self.exchange();
        }
        (time, 0)
    }

    /// Lets datagrams arrive from the operator's address.
    fn receive_forged(&mut self, spacing: Duration, packets: &[Bytes]) -> (Duration, usize) {
        let (start, mut answers) = (Instant::now(), 0);
        for packet in packets {
            self.now += spacing;
            self.vehicle.handle_datagram(self.now, OPERATOR, packet);
            while self.vehicle.poll_transmit(self.now, 1).is_some() {
                answers += 1;
            }
        }
        (start.elapsed(), answers)
    }
}

pub(crate) fn key() -> Key {
    let folder = tempfile::tempdir().expect("a folder for a key");
    Key::create(&folder.path().join("node.key")).expect("a key")
}

/// The first packets of so many handshakes of a stranger.
pub(crate) fn first_packets(count: usize) -> Vec<Bytes> {
    let (now, key) = (Instant::now(), key());
    let first = |_| {
        let mut stranger = Transport::new(&key, TrustFile::default(), [VEHICLE]);
        stranger.handle_timeout(now);
        stranger
            .poll_transmit(now, 1)
            .expect("a first packet")
            .octets
    };
    (0..count).map(first).collect()
}

/// The packet with a token of 64 octets, which nobody has issued.
fn with_token(packet: &Bytes) -> Bytes {
    let ids = 7 + usize::from(packet[5]);
    let token = ids + usize::from(packet[ids - 1]);
    let mut forged = packet[..token].to_vec();
    // The length takes two octets.
    forged.extend([0x40, 64]);
    forged.extend([7; 64]);
    // The rest moves, so the length of the packet is 65 octets too long.
    let rest = &packet[token + 1..packet.len() - 65];
    let length = u16::from_be_bytes([rest[0], rest[1]]) - 65;
    forged.extend(length.to_be_bytes());
    forged.extend(&rest[2..]);
    forged.into()
}
