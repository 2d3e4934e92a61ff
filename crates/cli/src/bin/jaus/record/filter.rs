//! Selects the IP packets that are JAUS, by port or by content.

use std::collections::VecDeque;
use std::net::{IpAddr, SocketAddr};

use bytes::Bytes;
use etherparse::{LaxNetSlice, LaxSlicedPacket, TransportSlice, ip_number};
use jaus::wire::judp;
use jaus_limits::{first_of_largest, quota_address};

use super::connections::{Connections, Segment};
use crate::packets::Packet;

/// Maximum number of packets with pending fragments. Beyond it the oldest of the sender with the most is
/// forgotten.
const FRAGMENTED: usize = 64;

/// Common key of an IP packet's fragments.
type Whole = (IpAddr, IpAddr, u32);

pub(super) struct Filter {
    ports: Vec<u16>,
    /// Packets whose first fragment was selected, latest last.
    fragmented: VecDeque<Whole>,
    connections: Connections,
}

impl Filter {
    pub(super) fn new(ports: &[u16]) -> Self {
        Self {
            ports: ports.to_vec(),
            fragmented: VecDeque::new(),
            connections: Connections::default(),
        }
    }

    /// Whether to record an IP packet or fragment; then with the earlier packets to record before
    /// it.
    pub(super) fn select(&mut self, packet: &Packet) -> Option<Vec<Packet>> {
        let sliced = LaxSlicedPacket::from_ip(&packet.octets).ok()?;
        let is_wanted = match fragment(&sliced) {
            Some((whole, is_first)) => self.wants_fragment(&sliced, whole, is_first),
            None => self.is_jaus(&sliced),
        };
        match is_wanted {
            true => Some(Vec::new()),
            false => self.connections.recognise(&segment(&sliced)?, packet),
        }
    }

    fn wants_fragment(
        &mut self,
        sliced: &LaxSlicedPacket<'_>,
        whole: Whole,
        is_first: bool,
    ) -> bool {
        if !is_first {
            return self.fragmented.contains(&whole);
        }
        // Only the first fragment has the ports and the start of the content.
        let wanted = self.first_is_jaus(sliced);
        if wanted {
            if self.fragmented.len() == FRAGMENTED {
                let place = first_of_largest(&self.fragmented, |it| quota_address(it.0));
                place.and_then(|place| self.fragmented.remove(place));
            }
            self.fragmented.push_back(whole);
        }
        wanted
    }

    fn is_jaus(&self, packet: &LaxSlicedPacket<'_>) -> bool {
        match &packet.transport {
            Some(TransportSlice::Udp(udp)) => {
                self.is_chosen([udp.source_port(), udp.destination_port()])
                    || is_judp(udp.payload())
            }
            Some(TransportSlice::Tcp(tcp)) => {
                self.is_chosen([tcp.source_port(), tcp.destination_port()])
            }
            _ => false,
        }
    }

    fn first_is_jaus(&self, packet: &LaxSlicedPacket<'_>) -> bool {
        let Some(payload) = packet.net.as_ref().and_then(LaxNetSlice::ip_payload_ref) else {
            return false;
        };
        let ports = payload.payload.first_chunk::<4>();
        let ports = ports
            .map(|&[s1, s2, d1, d2]| [u16::from_be_bytes([s1, s2]), u16::from_be_bytes([d1, d2])]);
        payload.ip_number == ip_number::UDP && ports.is_some_and(|ports| self.is_chosen(ports))
    }

    fn is_chosen(&self, ports: [u16; 2]) -> bool {
        ports.iter().any(|port| self.ports.contains(port))
    }
}

/// Whether a datagram is JAUS by its content, on any port: nodes may use other ports.
fn is_judp(payload: &[u8]) -> bool {
    let frames = judp::frames(Bytes::copy_from_slice(payload));
    let first = frames.ok().and_then(|mut frames| frames.next());
    matches!(first, Some(Ok(frame)) if frame.is_plausible())
}

/// The TCP segment in a whole packet.
fn segment<'a>(packet: &LaxSlicedPacket<'a>) -> Option<Segment<'a>> {
    let Some(TransportSlice::Tcp(tcp)) = &packet.transport else {
        return None;
    };
    let [source, destination]: [IpAddr; 2] = match packet.net.as_ref()? {
        LaxNetSlice::Ipv4(ip) => [
            ip.header().source_addr().into(),
            ip.header().destination_addr().into(),
        ],
        LaxNetSlice::Ipv6(ip) => [
            ip.header().source_addr().into(),
            ip.header().destination_addr().into(),
        ],
        LaxNetSlice::Arp(_) => return None,
    };
    Some(Segment {
        ends: [
            SocketAddr::new(source, tcp.source_port()),
            SocketAddr::new(destination, tcp.destination_port()),
        ],
        opens: tcp.syn() && !tcp.ack(),
        octets: tcp.payload(),
    })
}

/// The key of a fragment, and whether it is the first; `None` for a whole packet.
fn fragment(packet: &LaxSlicedPacket<'_>) -> Option<(Whole, bool)> {
    match packet.net.as_ref()? {
        LaxNetSlice::Ipv4(ipv4) => {
            let header = ipv4.header();
            let whole = (
                header.source_addr().into(),
                header.destination_addr().into(),
                header.identification().into(),
            );
            let is_first = header.fragments_offset().value() == 0;
            ipv4.is_payload_fragmented().then_some((whole, is_first))
        }
        // Only the sender fragments IPv6, and JAUS packets fit its smallest MTU.
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use etherparse::PacketBuilder;
    use jaus_view::Timestamp;

    use super::*;

    fn packet(octets: Vec<u8>) -> Packet {
        Packet {
            interface: "eth0".to_owned(),
            time: Timestamp::new(0, 0, 9),
            octets: octets.into(),
        }
    }

    fn udp(port: u16, payload: &[u8]) -> Packet {
        let mut octets = Vec::new();
        PacketBuilder::ipv4([10, 0, 0, 1], [10, 0, 0, 2], 16)
            .udp(40_000, port)
            .write(&mut octets, payload)
            .unwrap();
        packet(octets)
    }

    /// A segment of a connection from one port to another. The host of port 5000 is another one.
    fn tcp([from, to]: [u16; 2], is_first: bool, payload: &[u8]) -> Packet {
        let host = |port| [10, 0, 0, if port == 5000 { 2 } else { 1 }];
        let ip = PacketBuilder::ipv4(host(from), host(to), 16);
        let segment = ip.tcp(from, to, 7, 1024);
        let segment = if is_first { segment.syn() } else { segment };
        let mut octets = Vec::new();
        segment.write(&mut octets, payload).unwrap();
        packet(octets)
    }

    /// The number of packets that a packet adds to the recording.
    fn recorded(filter: &mut Filter, packet: &Packet) -> usize {
        filter.select(packet).map_or(0, |earlier| earlier.len() + 1)
    }

    /// 42.1.1 queries the heartbeat of 101.1.1.
    const DATAGRAM: &[u8] = b"\x02\x00\x10\x00\x01\x01\x01\x65\x00\x01\x01\x2A\x00\x02\x22\x07\x00";

    #[test]
    fn port_or_content_make_a_packet_jaus() {
        let mut filter = Filter::new(&[3794]);
        let mut wants = |it: &Packet| filter.select(it).is_some();
        assert!(wants(&udp(3794, b"whatever")));
        assert!(wants(&udp(5000, DATAGRAM)));
        assert!(!wants(&udp(5000, b"whatever")));
        assert!(!wants(&packet(b"not IP".to_vec())));
    }

    #[test]
    fn a_tcp_connection_on_any_port_is_recorded_from_its_opening_if_its_content_is_jaus() {
        let mut filter = Filter::new(&[3794]);
        let (jaus, other) = ([40_000, 5000], [40_001, 5000]);
        assert_eq!(recorded(&mut filter, &tcp(jaus, true, b"")), 0);
        assert_eq!(recorded(&mut filter, &tcp(other, true, b"")), 0);
        // The stream begins with its version, as a datagram does.
        assert_eq!(recorded(&mut filter, &tcp(jaus, false, DATAGRAM)), 2);
        let reply = tcp([5000, 40_000], false, b"the middle of a message");
        assert_eq!(recorded(&mut filter, &reply), 1, "the other direction");
        let request = tcp(other, false, b"GET / HTTP/1.1\r\n\r\n");
        assert_eq!(recorded(&mut filter, &request), 0);
        let amid = tcp([40_002, 5000], false, &DATAGRAM[1..]);
        assert_eq!(recorded(&mut filter, &amid), 1, "it was open before");
        for port in 10_000..20_000 {
            assert_eq!(recorded(&mut filter, &tcp([port, 80], true, b"")), 0);
        }
        assert_eq!(
            recorded(&mut filter, &tcp(jaus, false, b"")),
            0,
            "forgotten"
        );
    }

    #[test]
    fn the_later_fragments_follow_the_first() {
        let whole = udp(3794, &[7; 2000]).octets;
        let mut filter = Filter::new(&[3794]);
        let fragment = |offset: usize, id: u8| {
            let mut octets = whole[..20].to_vec();
            octets[5] = id;
            let flags = (offset / 8) as u16 | u16::from(offset == 0) << 13;
            octets[6..8].copy_from_slice(&flags.to_be_bytes());
            let part = &whole[20 + offset..(20 + offset + 1480).min(whole.len())];
            let length = (20 + part.len()) as u16;
            octets[2..4].copy_from_slice(&length.to_be_bytes());
            octets.extend_from_slice(part);
            packet(octets)
        };
        let mut wants = |it: &Packet| filter.select(it).is_some();
        assert!(!wants(&fragment(1480, 1)), "its first was not seen");
        assert!(wants(&fragment(0, 1)));
        assert!(wants(&fragment(1480, 1)));
        assert!(!wants(&fragment(1480, 2)), "another packet");
    }
}
