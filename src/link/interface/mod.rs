//! The network interfaces of this host and their addresses.
//!
//! A link is opened per interface and bound to one of its addresses, so selecting an interface
//! ([`Interfaces`]) also selects the address that peers see.

mod changes;
mod choice;
mod place;

use std::fmt;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, SocketAddrV6, UdpSocket};

use if_addrs::{IfAddr, IfOperStatus};
use ipnet::{IpNet, Ipv4Net};

pub(crate) use changes::Changes;
pub use choice::{Interfaces, Ip};
pub use place::Place;

use super::Error;

/// One address of one network interface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interface {
    /// The operating system's name, such as `eth0`.
    pub name: String,
    /// The operating system's index, used to join multicast groups.
    pub index: u32,
    /// The address that a link on this interface is bound to.
    pub address: IpAddr,
    /// The length of the network prefix in bits.
    pub prefix: u8,
    /// Whether it is up and the address can be bound, as far as the operating system reports it.
    pub up: bool,
    /// Whether it carries multicast. Tunnels (`wg0`, `ppp0`) often do not; loopback does for IPv4
    /// only.
    pub multicast: bool,
    /// The broadcast address of the attached network, if there is one: never with IPv6, nor on
    /// tunnels and loopback.
    pub broadcast: Option<Ipv4Addr>,
}

impl Interface {
    /// Whether this is the loopback interface, which only this host can reach.
    #[must_use]
    pub const fn is_loopback(&self) -> bool {
        self.address.is_loopback()
    }

    /// Whether the address is link-local (IPv6's `fe80::/10`).
    #[must_use]
    pub const fn is_link_local(&self) -> bool {
        matches!(self.address, IpAddr::V6(v6) if v6.is_unicast_link_local())
    }

    /// Whether `peer` is on the network attached to this interface.
    #[must_use]
    pub fn reaches(&self, peer: SocketAddr) -> bool {
        let scope = match peer {
            SocketAddr::V4(_) => 0,
            SocketAddr::V6(peer) => peer.scope_id(),
        };
        if self.is_link_local() && scope != self.index {
            return false;
        }
        IpNet::new(self.address, self.prefix).is_ok_and(|network| network.contains(&peer.ip()))
    }

    /// A socket address on this interface; a link-local address includes the interface index as its
    /// scope.
    #[must_use]
    pub const fn at(&self, port: u16) -> SocketAddr {
        match self.address {
            IpAddr::V6(v6) if self.is_link_local() => {
                SocketAddr::V6(SocketAddrV6::new(v6, port, 0, self.index))
            }
            address => SocketAddr::new(address, port),
        }
    }
}

impl fmt::Display for Interface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.name, self.address)?;
        match (self.up, self.multicast) {
            (true, true) => Ok(()),
            (true, false) => f.write_str(" (no multicast)"),
            (false, _) => f.write_str(" (down)"),
        }
    }
}

/// A list of the existing interfaces, for error messages.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Available(pub Vec<Interface>);

impl fmt::Display for Available {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all: Vec<_> = self.0.iter().map(ToString::to_string).collect();
        match all.as_slice() {
            [] => f.write_str("none with an address"),
            all => f.write_str(&all.join(", ")),
        }
    }
}

/// Every address of every interface of this host, up or not.
///
/// # Errors
/// [`Error::Io`] if the operating system does not list them.
pub fn list() -> Result<Vec<Interface>, Error> {
    let found = if_addrs::get_if_addrs().map_err(Error::io("listing the network interfaces"))?;
    let tentative = tentative_addresses();
    let usable = |mut interface: Interface| {
        interface.up &= !tentative.contains(&(interface.address, interface.index));
        interface
    };
    Ok(found.into_iter().filter_map(describe).map(usable).collect())
}

/// The local address from which the operating system would send to `peer`; `None` without a route.
/// Nothing is sent.
#[must_use]
pub fn local_address_for(peer: SocketAddr) -> Option<IpAddr> {
    let any = match peer {
        SocketAddr::V4(_) => IpAddr::V4(Ipv4Addr::UNSPECIFIED),
        SocketAddr::V6(_) => IpAddr::V6(Ipv6Addr::UNSPECIFIED),
    };
    let socket = UdpSocket::bind((any, 0)).ok()?;
    socket.connect(peer).ok()?;
    socket.local_addr().ok().map(|local| local.ip())
}

fn describe(found: if_addrs::Interface) -> Option<Interface> {
    let (address, prefix, broadcast): (IpAddr, u8, _) = match &found.addr {
        IfAddr::V4(v4) => {
            let prefix = u32::from(v4.netmask).leading_ones() as u8;
            let set = |b: &Ipv4Addr| *b != v4.ip && !b.is_unspecified();
            let broadcast = v4.broadcast.filter(set);
            let broadcast = broadcast.or_else(|| last_address(v4.ip, prefix));
            (v4.ip.into(), prefix, broadcast)
        }
        IfAddr::V6(v6) => {
            let prefix = u128::from(v6.netmask).leading_ones() as u8;
            (v6.ip.into(), prefix, None)
        }
    };
    let flags = sysfs_flags(&found.name);
    let has = |flag: u32| flags.map(|flags| flags & flag != 0);
    let loopback = address.is_loopback();
    let multicast = if loopback {
        // IPv4 loopback carries multicast although its flag says otherwise. IPv6 loopback does not.
        address.is_ipv4()
    } else {
        has(IFF_MULTICAST).unwrap_or(!found.is_p2p)
    };
    let broadcasts = !loopback && has(IFF_BROADCAST).unwrap_or(!found.is_p2p);
    Some(Interface {
        index: found.index?,
        address,
        prefix,
        up: has(IFF_UP).unwrap_or(found.oper_status != IfOperStatus::Down),
        multicast,
        broadcast: broadcast.filter(|_| broadcasts),
        name: found.name,
    })
}

/// The last address of a network, which is its broadcast address unless another one is set. A
/// network of two addresses has none (RFC 3021).
fn last_address(address: Ipv4Addr, prefix: u8) -> Option<Ipv4Addr> {
    let network = Ipv4Net::new(address, prefix).ok()?;
    (prefix < 31).then(|| network.broadcast())
}

const IFF_UP: u32 = 0x1;
const IFF_BROADCAST: u32 = 0x2;
const IFF_MULTICAST: u32 = 0x1000;

/// The interface's flags where the operating system (Linux) provides them as a file.
fn sysfs_flags(name: &str) -> Option<u32> {
    let text = std::fs::read_to_string(format!("/sys/class/net/{name}/flags")).ok()?;
    u32::from_str_radix(text.trim().trim_start_matches("0x"), 16).ok()
}

/// IPv6 addresses that cannot be bound yet, because the host (Linux) is still checking for
/// duplicates. That takes a second or two after an interface has come up.
fn tentative_addresses() -> Vec<(IpAddr, u32)> {
    let table = std::fs::read_to_string("/proc/net/if_inet6").unwrap_or_default();
    table.lines().filter_map(tentative_address).collect()
}

fn tentative_address(line: &str) -> Option<(IpAddr, u32)> {
    const IFA_F_TENTATIVE: u32 = 0x40;
    let mut columns = line.split_whitespace();
    let address = u128::from_str_radix(columns.next()?, 16).ok()?;
    let mut number = || u32::from_str_radix(columns.next()?, 16).ok();
    let (index, _prefix, _scope, flags) = (number()?, number()?, number()?, number()?);
    (flags & IFA_F_TENTATIVE != 0).then(|| (Ipv6Addr::from(address).into(), index))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interface(address: &str, prefix: u8) -> Interface {
        Interface {
            name: "eth0".into(),
            index: 2,
            address: address.parse().unwrap(),
            prefix,
            up: true,
            multicast: true,
            broadcast: None,
        }
    }

    #[test]
    fn an_interface_reaches_the_addresses_of_its_own_network_only() {
        let reaches =
            |address, prefix, peer: &str| interface(address, prefix).reaches(peer.parse().unwrap());
        assert!(reaches("10.0.0.5", 24, "10.0.0.99:1"));
        assert!(!reaches("10.0.0.5", 24, "10.0.1.5:1"));
        assert!(!reaches("10.0.0.5", 24, "[fd00::1]:1"));
        assert!(reaches("10.0.0.5", 0, "192.0.2.1:1"));
        assert!(reaches("fd00::5", 64, "[fd00::1:2]:1"));
        assert!(!reaches("fd00::5", 64, "[fd01::5]:1"));
        assert!(reaches("fe80::5", 64, "[fe80::6%2]:1"));
        assert!(!reaches("fe80::5", 64, "[fe80::6%3]:1"));
    }

    #[test]
    fn a_link_local_address_names_its_interface() {
        assert_eq!(interface("fe80::5", 64).at(9).to_string(), "[fe80::5%2]:9");
        assert_eq!(interface("fd00::5", 64).at(9).to_string(), "[fd00::5]:9");
        assert_eq!(interface("10.0.0.5", 24).at(9).to_string(), "10.0.0.5:9");
    }

    #[test]
    fn a_network_of_more_than_two_has_a_last_address() {
        let last = |address: &str, prefix| last_address(address.parse().unwrap(), prefix);
        assert_eq!(last("10.0.0.5", 24), Some([10, 0, 0, 255].into()));
        assert_eq!(last("10.0.0.5", 30), Some([10, 0, 0, 7].into()));
        assert_eq!(last("10.0.0.5", 0), Some([255, 255, 255, 255].into()));
        assert_eq!(last("10.0.0.5", 31), None);
    }

    #[test]
    fn addresses_that_are_not_sure_yet_are_told_from_the_others() {
        let line = |flags| format!("fe80000000000000000000000000000a 1c 40 20 {flags}     eth0");
        let address: IpAddr = "fe80::a".parse().unwrap();
        assert_eq!(tentative_address(&line("c0")), Some((address, 0x1c)));
        assert_eq!(tentative_address(&line("80")), None);
        assert_eq!(tentative_address("garbage"), None);
    }
}
