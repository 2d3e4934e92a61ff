//! Selects the IP packets that are JAUS, by port or by content.

use std::collections::VecDeque;
use std::net::IpAddr;

use bytes::Bytes;
use etherparse::{LaxNetSlice, LaxSlicedPacket, TransportSlice, ip_number};
use jaus::wire::judp;

/// Maximum number of packets with pending fragments.
const FRAGMENTED: usize = 64;

/// Common key of an IP packet's fragments.
type Whole = (IpAddr, IpAddr, u32);

pub(super) struct Filter {
    ports: Vec<u16>,
    /// Packets whose first fragment was selected, latest last.
    fragmented: VecDeque<Whole>,
}

impl Filter {
    pub(super) fn new(ports: &[u16]) -> Self {
        Self {
            ports: ports.to_vec(),
            fragmented: VecDeque::new(),
        }
    }

    /// Whether to record an IP packet or fragment.
    pub(super) fn wants(&mut self, packet: &[u8]) -> bool {
        let Ok(sliced) = LaxSlicedPacket::from_ip(packet) else {
            return false;
        };
        let Some(fragment) = fragment(&sliced) else {
            return self.is_jaus(&sliced);
        };
        let (whole, is_first) = fragment;
        if !is_first {
            return self.fragmented.contains(&whole);
        }
        // Only the first fragment has the ports and the start of the content.
        let wanted = self.first_is_jaus(&sliced);
        if wanted {
            if self.fragmented.len() == FRAGMENTED {
                self.fragmented.pop_front();
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

    use super::*;

    fn udp(port: u16, payload: &[u8]) -> Vec<u8> {
        let mut packet = Vec::new();
        PacketBuilder::ipv4([10, 0, 0, 1], [10, 0, 0, 2], 16)
            .udp(40_000, port)
            .write(&mut packet, payload)
            .unwrap();
        packet
    }

    /// 42.1.1 queries the heartbeat of 101.1.1.
    const DATAGRAM: &[u8] = b"\x02\x00\x10\x00\x01\x01\x01\x65\x00\x01\x01\x2A\x00\x02\x22\x07\x00";

    #[test]
    fn port_or_content_make_a_packet_jaus() {
        let mut filter = Filter::new(&[3794]);
        assert!(filter.wants(&udp(3794, b"whatever")));
        assert!(filter.wants(&udp(5000, DATAGRAM)));
        assert!(!filter.wants(&udp(5000, b"whatever")));
        assert!(!filter.wants(b"not IP"));
    }

    #[test]
    fn the_later_fragments_follow_the_first() {
        let whole = udp(3794, &[7; 2000]);
        let mut filter = Filter::new(&[3794]);
        let fragment = |offset: usize, id: u8| {
            let mut packet = whole[..20].to_vec();
            packet[5] = id;
            let flags = (offset / 8) as u16 | u16::from(offset == 0) << 13;
            packet[6..8].copy_from_slice(&flags.to_be_bytes());
            let part = &whole[20 + offset..(20 + offset + 1480).min(whole.len())];
            let length = (20 + part.len()) as u16;
            packet[2..4].copy_from_slice(&length.to_be_bytes());
            packet.extend_from_slice(part);
            packet
        };
        assert!(!filter.wants(&fragment(1480, 1)), "its first was not seen");
        assert!(filter.wants(&fragment(0, 1)));
        assert!(filter.wants(&fragment(1480, 1)));
        assert!(!filter.wants(&fragment(1480, 2)), "another packet");
    }
}
