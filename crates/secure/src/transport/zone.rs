//! Link-local addresses inside the QUIC endpoint.
//!
//! They need the number of their interface, but QUIC's tokens hold an IP address without it, so no
//! token would be valid. Inside the endpoint it therefore is a part of the IP address: in octets 2 to
//! 5, which are zero in a link-local address.

use std::net::{IpAddr, Ipv6Addr, SocketAddr, SocketAddrV6};

/// The number of bits behind the interface.
const SHIFT: u32 = 80;
const MASK: u128 = (u32::MAX as u128) << SHIFT;

/// The address as the endpoint knows it.
pub(super) fn embed(address: SocketAddr) -> SocketAddr {
    match address {
        SocketAddr::V6(it) if it.ip().is_unicast_link_local() => {
            let bits = it.ip().to_bits() & !MASK | u128::from(it.scope_id()) << SHIFT;
            SocketAddr::new(IpAddr::V6(Ipv6Addr::from_bits(bits)), it.port())
        }
        other => other,
    }
}

/// The address as sockets know it.
pub(super) fn extract(address: SocketAddr) -> SocketAddr {
    match address {
        SocketAddr::V6(it) if it.ip().is_unicast_link_local() => {
            let bits = it.ip().to_bits();
            let scope = u32::try_from((bits & MASK) >> SHIFT).unwrap_or_default();
            SocketAddrV6::new(Ipv6Addr::from_bits(bits & !MASK), it.port(), 0, scope).into()
        }
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_keeps_its_interface_without_a_scope() {
        for text in [
            "[fe80::1:2:3%4294967295]:7",
            "[fe80::1]:7",
            "[fd00::1]:7",
            "10.0.0.1:7",
        ] {
            let address: SocketAddr = text.parse().unwrap();
            let inside = embed(address);
            assert!(
                matches!(inside, SocketAddr::V4(_)) || inside == SocketAddr::new(inside.ip(), 7)
            );
            assert_eq!(extract(inside), address);
        }
        let [one, other] = ["[fe80::1%1]:7", "[fe80::1%2]:7"].map(|it| embed(it.parse().unwrap()));
        assert_ne!(one.ip(), other.ip());
    }
}
