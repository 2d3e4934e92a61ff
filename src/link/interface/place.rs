//! Parses the address of one host: `10.0.0.2`, `10.0.0.2:3795`, `fd00::2`, `[fd00::2]:3795`,
//! `fe80::2%eth0`, `[fe80::2%eth0]:3795`.

use std::fmt;
use std::net::{IpAddr, Ipv6Addr, SocketAddr, SocketAddrV6};
use std::str::FromStr;

use super::super::STANDARD_PORT;

/// The address and port of one host. An IPv6 link-local address is only unique within a network, so
/// it also needs the interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Place {
    /// Without a scope id if `zone` has a name.
    address: SocketAddr,
    zone: Option<Zone>,
}

/// The name of an interface, padded with zeros. Linux allows 15 octets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Zone([u8; 15]);

/// Not the address of one host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoPlace;

impl Place {
    /// Whether it is a link-local address without an interface.
    #[must_use]
    pub const fn lacks_zone(&self) -> bool {
        matches!(self.address, SocketAddr::V6(v6)
            if v6.ip().is_unicast_link_local() && v6.scope_id() == 0 && self.zone.is_none())
    }

    /// The socket address, with the current index of the interface as its scope. While there is no
    /// such interface the scope is 0, which is unreachable.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        match (self.address, self.zone) {
            (SocketAddr::V6(v6), Some(zone)) => {
                let index = super::list().ok().and_then(|all| {
                    let found = all.iter().find(|i| i.name == zone.name());
                    found.map(|i| i.index)
                });
                SocketAddrV6::new(*v6.ip(), v6.port(), 0, index.unwrap_or(0)).into()
            }
            (address, _) => address,
        }
    }
}

impl From<SocketAddr> for Place {
    fn from(address: SocketAddr) -> Self {
        let zone = None;
        Self { address, zone }
    }
}

impl Zone {
    fn new(name: &str) -> Option<Self> {
        let mut octets = [0; 15];
        octets
            .get_mut(..name.len())?
            .copy_from_slice(name.as_bytes());
        Some(Self(octets))
    }

    fn name(&self) -> &str {
        let length = self.0.iter().position(|&o| o == 0).unwrap_or(self.0.len());
        // Made from a `str`, so it is valid UTF-8.
        std::str::from_utf8(&self.0[..length]).unwrap_or_default()
    }
}

impl FromStr for Place {
    type Err = NoPlace;

    /// The default port is 3794.
    fn from_str(text: &str) -> Result<Self, NoPlace> {
        let named = || {
            let (ip, zone, port) = split(text)?;
            let (scope, zone) = match zone.parse() {
                Ok(scope) => (scope, None),
                Err(_) => (0, Some(Zone::new(zone)?)),
            };
            let address = SocketAddrV6::new(ip, port, 0, scope).into();
            ip.is_unicast_link_local().then_some(Self { address, zone })
        };
        let standard = |ip: IpAddr| SocketAddr::new(ip, STANDARD_PORT);
        let plain = text.parse().or_else(|_| text.parse().map(standard)).ok();
        let place = plain.map(Self::from).or_else(named).ok_or(NoPlace)?;
        let ip = place.address.ip();
        if ip.is_unspecified() || ip.is_multicast() || place.address.port() == 0 {
            return Err(NoPlace);
        }
        Ok(place)
    }
}

/// Splits `IP%ZONE` or `[IP%ZONE]:PORT`.
fn split(text: &str) -> Option<(Ipv6Addr, &str, u16)> {
    let (host, port) = match text.strip_prefix('[') {
        None => (text, STANDARD_PORT),
        Some(rest) => {
            let (host, port) = rest.rsplit_once("]:")?;
            (host, port.parse().ok()?)
        }
    };
    let (ip, zone) = host.split_once('%')?;
    let plain = |c: char| c.is_ascii_graphic() && !"[]%/".contains(c);
    (!zone.is_empty() && zone.chars().all(plain)).then_some((ip.parse().ok()?, zone, port))
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.zone {
            Some(zone) => {
                let (ip, port) = (self.address.ip(), self.address.port());
                write!(f, "[{ip}%{}]:{port}", zone.name())
            }
            None => self.address.fmt(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_an_address_with_or_without_port_and_zone() {
        let written = |text: &str| text.parse::<Place>().unwrap().to_string();
        for (text, full) in [
            ("10.0.0.2", "10.0.0.2:3794"),
            ("10.0.0.2:9", "10.0.0.2:9"),
            ("fd00::2", "[fd00::2]:3794"),
            ("[fd00::2]:9", "[fd00::2]:9"),
            ("fe80::2%eth0", "[fe80::2%eth0]:3794"),
            ("[fe80::2%eth0]:9", "[fe80::2%eth0]:9"),
            ("[fe80::2%br-0123456789ab]:9", "[fe80::2%br-0123456789ab]:9"),
            ("[fe80::2%7]:9", "[fe80::2%7]:9"),
            ("fe80::2%7", "[fe80::2%7]:3794"),
        ] {
            assert_eq!(written(text), full);
            assert_eq!(written(full), full);
        }
    }

    #[test]
    fn what_is_no_address_of_one_host_is_refused() {
        for wrong in [
            "",
            "ten",
            "10.0.0.2:0",
            "239.255.0.1",
            "0.0.0.0",
            "::",
            "ff12::1",
            "10.0.0.2:70000",
            "fd00::2%eth0",
            "fe80::2%",
            "fe80::2%a/b",
            "fe80::2%far-too-long-name",
            "[fe80::2%eth0]",
        ] {
            assert_eq!(wrong.parse::<Place>(), Err(NoPlace), "{wrong}");
        }
    }

    #[test]
    fn a_link_local_address_alone_leads_nowhere() {
        let lacks = |text: &str| text.parse::<Place>().unwrap().lacks_zone();
        assert!(lacks("fe80::2") && lacks("[fe80::2]:9"));
        assert!(!lacks("fe80::2%eth0") && !lacks("fe80::2%7") && !lacks("fd00::2"));
    }

    #[test]
    fn the_scope_is_the_number_of_the_interface_if_there_is_one() {
        let scope = |text: &str| match text.parse::<Place>().unwrap().address() {
            SocketAddr::V6(v6) => v6.scope_id(),
            SocketAddr::V4(_) => unreachable!(),
        };
        assert_eq!(scope("fe80::2%nosuch0"), 0);
        assert_eq!(scope("[fe80::2%7]:9"), 7);
        let lo = crate::link::Interfaces::Loopback.choose(super::super::Ip::V4);
        let lo = &lo.unwrap()[0];
        assert_eq!(scope(&format!("fe80::2%{}", lo.name)), lo.index);
    }
}
