//! Building IP and UDP headers around a datagram.

use std::net::{IpAddr, SocketAddr};

use etherparse::PacketBuilder;

/// The IP packet of a UDP datagram with this payload. `None` if the address families differ or the
/// payload is too long.
pub fn udp_packet(source: SocketAddr, destination: SocketAddr, payload: &[u8]) -> Option<Vec<u8>> {
    let builder = match (source.ip(), destination.ip()) {
        (IpAddr::V4(from), IpAddr::V4(to)) => PacketBuilder::ipv4(from.octets(), to.octets(), 1),
        (IpAddr::V6(from), IpAddr::V6(to)) => PacketBuilder::ipv6(from.octets(), to.octets(), 1),
        _ => return None,
    };
    let mut packet = Vec::new();
    let builder = builder.udp(source.port(), destination.port());
    builder.write(&mut packet, payload).ok()?;
    Some(packet)
}
