//! Extraction of datagrams from captured frames: link header, IP, fragments, TCP streams, ports.

mod batch;
mod fragments;
mod packet;
mod streams;

use std::borrow::Cow;
use std::net::{IpAddr, SocketAddr};
use std::ops::AddAssign;

use bytes::Bytes;
use etherparse::{
    EtherType, Ipv6ExtensionSlice, LaxNetSlice, LaxSlicedPacket, TransportSlice, UdpSlice,
    ether_type, ip_number,
};

use self::fragments::{Fragment, Fragments, Key};
use self::streams::{Segment, Streams};
use super::capture::{Frame, LinkType};
use jaus::wire::judp;

pub use packet::udp_packet;

/// The UDP and TCP port registered with IANA for JAUS.
pub const JAUS_PORT: u16 = 3794;

/// Extracts the datagrams of JAUS from the frames of a capture, and the messages of TCP streams as
/// if they had been datagrams.
///
/// Supports Ethernet (with VLAN tags), both Linux cooked headers, raw IP, and the null and loopback
/// headers of the BSDs, each with IPv4 and IPv6. IP fragments are kept until the datagram is
/// complete, TCP segments until those before them have come; see [`Counts`] for what never does.
#[derive(Debug)]
pub struct Network {
    choice: Choice,
    fragments: Fragments,
    streams: Streams,
    counts: Counts,
}

/// Which traffic is taken for JAUS.
#[derive(Debug)]
enum Choice {
    /// That of these ports; of all ports if there are none.
    Ports(Vec<u16>),
    /// That of the registered port, and what begins with a plausible message on any other.
    Content,
}

/// Traffic that a [`Network`] did not return.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// Frames with an unsupported link type.
    pub unknown_links: u64,
    /// Datagrams and TCP segments on other ports that are not JAUS by their content.
    pub foreign: u64,
    /// Places of TCP streams where octets are missing or unreadable.
    pub gaps: u64,
    /// Datagrams with missing, truncated or contradictory fragments.
    pub incomplete_datagrams: u64,
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.unknown_links += other.unknown_links;
        self.foreign += other.foreign;
        self.gaps += other.gaps;
        self.incomplete_datagrams += other.incomplete_datagrams;
    }
}

/// A UDP datagram, or a message of a TCP stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Datagram<'a> {
    /// Address and port of the sender.
    pub source: SocketAddr,
    /// Address and port of the destination: a node or a multicast group.
    pub destination: SocketAddr,
    /// The UDP payload, as far as it was captured; that of a datagram with the message of a stream.
    pub payload: Cow<'a, [u8]>,
    /// Octets at the end of the payload that were not captured (snap length).
    pub missing: usize,
    /// Whether it came by TCP.
    pub by_tcp: bool,
}

impl Network {
    /// Selects what is from or to one of `ports`.
    pub fn new(ports: impl IntoIterator<Item = u16>) -> Self {
        Self::choosing(Choice::Ports(ports.into_iter().collect()))
    }

    /// Selects what is on the registered port, and recognises JAUS on others by its content.
    #[must_use]
    pub fn by_content() -> Self {
        Self::choosing(Choice::Content)
    }

    fn choosing(choice: Choice) -> Self {
        Self {
            choice,
            fragments: Fragments::default(),
            streams: Streams::default(),
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
            foreign: self.counts.foreign + self.streams.foreign(),
            gaps: self.streams.gaps(),
            ..self.counts
        }
    }

    /// The datagram that `frame` contains or completes, or the messages of a stream that it
    /// completes, if they are selected.
    pub fn handle_frame<'a>(&mut self, frame: &Frame<'a>) -> Vec<Datagram<'a>> {
        let Some((kind, octets)) = payload_of_link(frame.link, frame.octets) else {
            self.counts.unknown_links += 1;
            return Vec::new();
        };
        let packet = LaxSlicedPacket::from_ether_type(kind, octets);
        let Some(addresses) = packet.net.as_ref().and_then(addresses) else {
            return Vec::new();
        };
        match &packet.transport {
            Some(TransportSlice::Udp(udp)) => self.choose(datagram(addresses, udp, Cow::Borrowed)),
            Some(TransportSlice::Tcp(tcp)) => {
                let [source, destination] = addresses;
                let cut = packet.net.as_ref().and_then(LaxNetSlice::ip_payload_ref);
                self.messages(Segment {
                    source: SocketAddr::new(source, tcp.source_port()),
                    destination: SocketAddr::new(destination, tcp.destination_port()),
                    number: tcp.sequence_number(),
                    syn: tcp.syn(),
                    cut: cut.is_some_and(|payload| payload.incomplete),
                    octets: tcp.payload(),
                })
            }
            Some(_) => Vec::new(),
            None => match self.reassembled(addresses, &packet) {
                Some(datagram) => self.choose(datagram),
                None => Vec::new(),
            },
        }
    }

    /// The datagram that an IP fragment completes.
    fn reassembled<'a>(
        &mut self,
        addresses: [IpAddr; 2],
        packet: &LaxSlicedPacket<'_>,
    ) -> Option<Datagram<'a>> {
        let whole = self.fragments.insert(fragment(addresses, packet)?)?;
        let udp = UdpSlice::from_slice_lax(&whole).ok()?;
        let owned = |payload: &[u8]| Cow::Owned(payload.to_vec());
        Some(datagram(addresses, &udp, owned))
    }

    /// The datagram, or those of a batch, if they are selected.
    fn choose<'a>(&mut self, datagram: Datagram<'a>) -> Vec<Datagram<'a>> {
        let ports = [datagram.source.port(), datagram.destination.port()];
        let is_chosen = match &self.choice {
            Choice::Content => {
                let is_jaus =
                    ports.contains(&JAUS_PORT) || first_message(&datagram.payload).is_some();
                self.counts.foreign += u64::from(!is_jaus);
                is_jaus
            }
            Choice::Ports(chosen) => is_among(chosen, ports),
        };
        match is_chosen {
            true => batch::cut(datagram),
            false => Vec::new(),
        }
    }

    /// The messages that a TCP segment completes.
    fn messages<'a>(&mut self, segment: Segment<'_>) -> Vec<Datagram<'a>> {
        let (source, destination) = (segment.source, segment.destination);
        if let Choice::Ports(chosen) = &self.choice
            && !is_among(chosen, [source.port(), destination.port()])
        {
            return Vec::new();
        }
        let frames = self.streams.insert(segment);
        // A message of JTCP fits in a datagram, but for the limit of IP.
        let payloads = frames.iter().filter_map(|frame| judp::encode(frame).ok());
        payloads
            .map(|payload| Datagram {
                source,
                destination,
                payload: Cow::Owned(payload.into()),
                missing: 0,
                by_tcp: true,
            })
            .collect()
    }
}

fn is_among(chosen: &[u16], ports: [u16; 2]) -> bool {
    chosen.is_empty() || ports.iter().any(|port| chosen.contains(port))
}

/// The message at the beginning of a datagram, if it is a plausible one.
fn first_message(datagram: &[u8]) -> Option<jaus::wire::Frame> {
    let mut frames = judp::frames(Bytes::copy_from_slice(datagram)).ok()?;
    frames.next()?.ok().filter(jaus::wire::Frame::is_plausible)
}

fn datagram<'u, 'a>(
    [source, destination]: [IpAddr; 2],
    udp: &UdpSlice<'u>,
    payload: impl FnOnce(&'u [u8]) -> Cow<'a, [u8]>,
) -> Datagram<'a> {
    Datagram {
        source: SocketAddr::new(source, udp.source_port()),
        destination: SocketAddr::new(destination, udp.destination_port()),
        payload: payload(udp.payload()),
        missing: usize::from(udp.length()).saturating_sub(udp.slice().len()),
        by_tcp: false,
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
            interface: "",
        }
    }

    #[track_caller]
    fn assert_found(link: LinkType, header: &[u8], packet: &[u8]) {
        let octets = [header, packet].concat();
        let mut network = Network::new([JAUS_PORT]);
        let datagram = network.handle_frame(&frame(link, &octets)).remove(0);
        assert_eq!(datagram.payload, PAYLOAD);
        assert_eq!(datagram.missing, 0);
        assert_eq!(network.counts(), Counts::default());
        for length in 0..octets.len() {
            let cut = network.handle_frame(&frame(link, &octets[..length]));
            assert!(cut.iter().all(|datagram| datagram.missing > 0));
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
                .is_empty()
        );
    }

    #[test]
    fn an_unknown_link_type_is_counted() {
        let mut network = Network::new([JAUS_PORT]);
        let packet = ipv4(3794);
        assert!(
            network
                .handle_frame(&frame(LinkType(147), &packet))
                .is_empty()
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
                .is_empty()
        );
        assert!(
            network
                .handle_frame(&frame(LinkType::RAW, &pieces[1]))
                .is_empty()
        );
        assert_eq!(network.counts().incomplete_datagrams, 1);
        let datagram = network
            .handle_frame(&frame(LinkType::RAW, &pieces[2]))
            .remove(0);
        assert_eq!(datagram.payload, PAYLOAD);
        assert_eq!(network.counts(), Counts::default());
    }

    #[test]
    fn jaus_is_recognised_on_any_port_and_what_is_not_is_counted() {
        let message = b"\x02\x00\x11\x00\x09\xFF\xFF\xFF\xFF\x07\x01\xE8\x03\x00\x2B\x02\x00\x00";
        let packet = |port, payload: &[u8]| {
            let mut packet = Vec::new();
            let builder = PacketBuilder::ipv4([10, 0, 0, 1], [10, 0, 0, 2], 16);
            builder
                .udp(40_000, port)
                .write(&mut packet, payload)
                .unwrap();
            packet
        };
        let mut network = Network::by_content();
        let mut found = |port, payload: &[u8]| {
            let packet = packet(port, payload);
            network.handle_frame(&frame(LinkType::RAW, &packet)).len()
        };
        assert_eq!(found(50_000, message), 1);
        assert_eq!(found(3794, b"damaged"), 1, "an error is shown");
        assert_eq!(found(53, b"\x02\x00 a query of something else"), 0);
        assert_eq!(network.counts().foreign, 1);
    }

    #[test]
    fn the_messages_of_a_tcp_connection_come_as_datagrams() {
        // Recorded from JAUS++, which sends the version before each message as a segment of its own.
        let parts = [
            &b"\x02"[..],
            b"\x00\x11\x00\x01\x01\x01\x66\x00\x01\x01\x65\x00\x00\x2B\x02\x01\x00",
            b"\x02",
            b"\x00\x11\x00\x01\x01\x01\x66\x00\x01\x01\x65\x00\x00\x2B\x02\x02\x00",
        ];
        let mut network = Network::by_content();
        let mut number = 1000;
        let mut found = Vec::new();
        for part in parts {
            let mut packet = Vec::new();
            let builder = PacketBuilder::ipv4([10, 0, 0, 1], [10, 0, 0, 2], 16);
            let builder = builder.tcp(40_000, 40_001, number, 1000);
            builder.write(&mut packet, part).unwrap();
            number += part.len() as u32;
            let datagrams = network.handle_frame(&frame(LinkType::RAW, &packet));
            found.extend(datagrams.into_iter().map(|it| (it.by_tcp, it.payload[16])));
        }
        assert_eq!(found, [(true, 1), (true, 2)]);
    }
}
