//! Extraction of UDP datagrams from captured frames: link header, IP, fragments, ports.

mod fragments;
mod packet;

use std::borrow::Cow;
use std::net::{IpAddr, SocketAddr};

use etherparse::{
    EtherType, Ipv6ExtensionSlice, LaxNetSlice, LaxSlicedPacket, TransportSlice, UdpSlice,
    ether_type, ip_number,
};

use self::fragments::{Fragment, Fragments, Key};
use super::capture::{Frame, LinkType};

pub use packet::udp_packet;

/// The UDP and TCP port registered with IANA for JAUS.
pub const JAUS_PORT: u16 = 3794;

/// Extracts the datagrams on selected UDP ports from the frames of a capture.
///
/// Supports Ethernet (with VLAN tags), both Linux cooked headers, raw IP, and the null and loopback
/// headers of the BSDs, each with IPv4 and IPv6. IP fragments are kept until the datagram is
/// complete; see [`Counts`] for those that never are.
#[derive(Debug)]
pub struct Network {
    /// The selected ports; empty for all.
    ports: Vec<u16>,
    fragments: Fragments,
    counts: Counts,
}

/// Traffic that a [`Network`] did not return.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// Frames with an unsupported link type.
    pub unknown_links: u64,
    /// TCP segments with payload on a selected port: JTCP, which is not supported yet.
    pub tcp_segments: u64,
    /// Datagrams with missing, truncated or contradictory fragments.
    pub incomplete_datagrams: u64,
}

/// A UDP datagram on a selected port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Datagram<'a> {
    /// Address and port of the sender.
    pub source: SocketAddr,
    /// Address and port of the destination: a node or a multicast group.
    pub destination: SocketAddr,
    /// The UDP payload, as far as it was captured.
    pub payload: Cow<'a, [u8]>,
    /// Octets at the end of the payload that were not captured (snap length).
    pub missing: usize,
}

impl Network {
    /// Selects datagrams from or to one of `ports`.
    pub fn new(ports: impl IntoIterator<Item = u16>) -> Self {
        Self {
            ports: ports.into_iter().collect(),
            fragments: Fragments::default(),
            counts: Counts::default(),
        }
    }

    /// Selects all UDP datagrams.
    pub fn of_any_port() -> Self {
        Self::new([])
    }

    /// Counts of traffic that was not returned. Incomplete fragments count as incomplete datagrams.
    pub fn counts(&self) -> Counts {
        let incomplete_datagrams = self.counts.incomplete_datagrams + self.fragments.incomplete();
        Counts {
            incomplete_datagrams,
            ..self.counts
        }
    }

    /// The datagram that `frame` contains or completes, if it is on a selected port.
    pub fn handle_frame<'a>(&mut self, frame: &Frame<'a>) -> Option<Datagram<'a>> {
        let Some((kind, octets)) = payload_of_link(frame.link, frame.octets) else {
            self.counts.unknown_links += 1;
            return None;
        };
        let packet = LaxSlicedPacket::from_ether_type(kind, octets);
        let addresses = addresses(packet.net.as_ref()?)?;
        match packet.transport {
            Some(TransportSlice::Udp(udp)) => self.datagram(addresses, &udp, Cow::Borrowed),
            Some(TransportSlice::Tcp(tcp)) => {
                let ports = [tcp.source_port(), tcp.destination_port()];
                if self.is_chosen(ports) && !tcp.payload().is_empty() {
                    self.counts.tcp_segments += 1;
                }
                None
            }
            Some(_) => None,
            None => {
                let whole = self.fragments.insert(fragment(addresses, &packet)?)?;
                let udp = UdpSlice::from_slice_lax(&whole).ok()?;
                self.datagram(addresses, &udp, |payload| Cow::Owned(payload.to_vec()))
            }
        }
    }

    fn is_chosen(&self, ports: [u16; 2]) -> bool {
        self.ports.is_empty() || ports.iter().any(|port| self.ports.contains(port))
    }

    fn datagram<'u, 'a>(
        &self,
        [source, destination]: [IpAddr; 2],
        udp: &UdpSlice<'u>,
        payload: impl FnOnce(&'u [u8]) -> Cow<'a, [u8]>,
    ) -> Option<Datagram<'a>> {
        let ports = [udp.source_port(), udp.destination_port()];
        self.is_chosen(ports).then(|| Datagram {
            source: SocketAddr::new(source, ports[0]),
            destination: SocketAddr::new(destination, ports[1]),
            payload: payload(udp.payload()),
            missing: usize::from(udp.length()).saturating_sub(udp.slice().len()),
        })
    }
}

/// Strips the link header. Returns the type of the content and its octets; `None` if the type is
/// unknown or the frame is too short.
fn payload_of_link(link: LinkType, octets: &[u8]) -> Option<(EtherType, &[u8])> {
    match link {
        LinkType::ETHERNET => after_header(octets, 12, 14),
        LinkType::LINUX_SLL => after_header(octets, 14, 16),
        LinkType::LINUX_SLL2 => after_header(octets, 0, 20),
        LinkType::RAW | LinkType::RAW_BSD | LinkType::RAW_OPENBSD => by_ip_version(octets),
        LinkType::IPV4 => Some((ether_type::IPV4, octets)),
        LinkType::IPV6 => Some((ether_type::IPV6, octets)),
        // The address family, in the byte order of the capturing machine and numbered differently
        // on every system. The IP packet after it states its own version.
        LinkType::NULL | LinkType::LOOP => by_ip_version(octets.get(4..)?),
        _ => None,
    }
}

/// The Ethernet type at `at`, and the octets from `payload` on.
fn after_header(octets: &[u8], at: usize, payload: usize) -> Option<(EtherType, &[u8])> {
    let kind = *octets.get(at..)?.first_chunk()?;
    Some((EtherType(u16::from_be_bytes(kind)), octets.get(payload..)?))
}

fn by_ip_version(octets: &[u8]) -> Option<(EtherType, &[u8])> {
    match octets.first()? >> 4 {
        4 => Some((ether_type::IPV4, octets)),
        6 => Some((ether_type::IPV6, octets)),
        _ => None,
    }
}

/// Source and destination.
fn addresses(net: &LaxNetSlice<'_>) -> Option<[IpAddr; 2]> {
    match net {
        LaxNetSlice::Ipv4(ip) => {
            let header = ip.header();
            Some([
                header.source_addr().into(),
                header.destination_addr().into(),
            ])
        }
        LaxNetSlice::Ipv6(ip) => {
            let header = ip.header();
            Some([
                header.source_addr().into(),
                header.destination_addr().into(),
            ])
        }
        LaxNetSlice::Arp(_) => None,
    }
}

/// The UDP fragment in a packet, if the packet is fragmented.
fn fragment<'a>(addresses: [IpAddr; 2], packet: &LaxSlicedPacket<'a>) -> Option<Fragment<'a>> {
    let net = packet.net.as_ref()?;
    let payload = net.ip_payload_ref()?;
    if !payload.fragmented || payload.ip_number != ip_number::UDP {
        return None;
    }
    let (identification, offset, more) = match net {
        LaxNetSlice::Ipv4(ip) => {
            let header = ip.header();
            (
                header.identification().into(),
                header.fragments_offset(),
                header.more_fragments(),
            )
        }
        LaxNetSlice::Ipv6(ip) => {
            let mut extensions = ip.extensions().clone().into_iter();
            let header = extensions.find_map(|extension| match extension {
                Ipv6ExtensionSlice::Fragment(header) => Some(header),
                _ => None,
            })?;
            (
                header.identification(),
                header.fragment_offset(),
                header.more_fragments(),
            )
        }
        LaxNetSlice::Arp(_) => return None,
    };
    Some(Fragment {
        key: Key {
            addresses,
            identification,
        },
        offset: offset.byte_offset().into(),
        more,
        cut: payload.incomplete,
        octets: payload.payload,
    })
}

#[cfg(test)]
mod tests {
    use etherparse::PacketBuilder;

    use super::*;

    const PAYLOAD: &[u8] = b"octets of a datagram";

    fn ipv4(port: u16) -> Vec<u8> {
        let mut packet = Vec::new();
        PacketBuilder::ipv4([10, 0, 0, 1], [239, 255, 0, 1], 16)
            .udp(3794, port)
            .write(&mut packet, PAYLOAD)
            .unwrap();
        packet
    }

    fn ipv6() -> Vec<u8> {
        let mut packet = Vec::new();
        PacketBuilder::ipv6([1; 16], [2; 16], 16)
            .udp(1000, 3794)
            .write(&mut packet, PAYLOAD)
            .unwrap();
        packet
    }

    fn frame(link: LinkType, octets: &[u8]) -> Frame<'_> {
        Frame {
            time: None,
            link,
            octets,
            length: octets.len() as u32,
            lost: 0,
        }
    }

    #[track_caller]
    fn assert_found(link: LinkType, header: &[u8], packet: &[u8]) {
        let octets = [header, packet].concat();
        let mut network = Network::new([JAUS_PORT]);
        let datagram = network.handle_frame(&frame(link, &octets)).unwrap();
        assert_eq!(datagram.payload, PAYLOAD);
        assert_eq!(datagram.missing, 0);
        assert_eq!(network.counts(), Counts::default());
        for length in 0..octets.len() {
            let cut = network.handle_frame(&frame(link, &octets[..length]));
            assert!(cut.is_none_or(|datagram| datagram.missing > 0));
        }
    }

    #[test]
    fn every_link_type_leads_to_the_datagram() {
        let mac = [0x02; 12];
        let plain = [&mac[..], &[0x08, 0x00]].concat();
        let tagged = [&mac[..], &[0x81, 0x00, 0x00, 0x07, 0x08, 0x00]].concat();
        let twice = [
            &mac[..],
            &[0x88, 0xa8, 0, 1, 0x81, 0x00, 0x00, 0x07, 0x86, 0xdd],
        ]
        .concat();
        assert_found(LinkType::ETHERNET, &plain, &ipv4(3794));
        assert_found(LinkType::ETHERNET, &tagged, &ipv4(3794));
        assert_found(LinkType::ETHERNET, &twice, &ipv6());
        let cooked = [0, 4, 0, 1, 0, 6, 2, 2, 2, 2, 2, 2, 0, 0, 0x08, 0x00];
        assert_found(LinkType::LINUX_SLL, &cooked, &ipv4(3794));
        let cooked = [
            0x86, 0xdd, 0, 0, 0, 0, 0, 1, 0, 1, 4, 6, 2, 2, 2, 2, 2, 2, 0, 0,
        ];
        assert_found(LinkType::LINUX_SLL2, &cooked, &ipv6());
        for raw in [LinkType::RAW, LinkType::RAW_BSD, LinkType::RAW_OPENBSD] {
            assert_found(raw, &[], &ipv4(3794));
            assert_found(raw, &[], &ipv6());
        }
        assert_found(LinkType::IPV4, &[], &ipv4(3794));
        assert_found(LinkType::IPV6, &[], &ipv6());
        assert_found(LinkType::NULL, &[2, 0, 0, 0], &ipv4(3794));
        assert_found(LinkType::NULL, &[0, 0, 0, 2], &ipv4(3794));
        assert_found(LinkType::LOOP, &[0, 0, 0, 30], &ipv6());
    }

    #[test]
    fn a_datagram_for_another_port_is_not_taken() {
        let packet = ipv4(3794);
        assert!(
            Network::new([1234])
                .handle_frame(&frame(LinkType::RAW, &packet))
                .is_none()
        );
    }

    #[test]
    fn an_unknown_link_type_is_counted() {
        let mut network = Network::new([JAUS_PORT]);
        let packet = ipv4(3794);
        assert!(
            network
                .handle_frame(&frame(LinkType(147), &packet))
                .is_none()
        );
        assert_eq!(network.counts().unknown_links, 1);
    }

    #[test]
    fn an_ip_packet_in_pieces_gives_its_datagram_with_the_last_piece() {
        let whole = ipv4(3794);
        let (header, payload) = whole.split_at(20);
        let piece = |range: std::ops::Range<usize>| {
            let mut piece = header.to_vec();
            let length = 20 + range.len() as u16;
            piece[2..4].copy_from_slice(&length.to_be_bytes());
            let more = u16::from(range.end < payload.len()) << 13;
            let offset = more | (range.start / 8) as u16;
            piece[6..8].copy_from_slice(&offset.to_be_bytes());
            piece.extend_from_slice(&payload[range]);
            piece
        };
        let mut network = Network::new([JAUS_PORT]);
        let pieces = [piece(16..payload.len()), piece(0..8), piece(8..16)];
        assert!(
            network
                .handle_frame(&frame(LinkType::RAW, &pieces[0]))
                .is_none()
        );
        assert!(
            network
                .handle_frame(&frame(LinkType::RAW, &pieces[1]))
                .is_none()
        );
        assert_eq!(network.counts().incomplete_datagrams, 1);
        let datagram = network
            .handle_frame(&frame(LinkType::RAW, &pieces[2]))
            .unwrap();
        assert_eq!(datagram.payload, PAYLOAD);
        assert_eq!(network.counts(), Counts::default());
    }
}
