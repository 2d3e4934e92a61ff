//! Which network interfaces this host has, and which of them a node uses.
//!
//! A link is opened per interface, bound to one IPv4 address of it, so choosing an interface
//! also chooses the address that peers see.

use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};

use if_addrs::{IfAddr, IfOperStatus};

use super::Error;

/// One IPv4 address of one network interface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interface {
    /// The operating system's name, such as `eth0`.
    pub name: String,
    /// The operating system's number for it, used to join multicast groups.
    pub index: u32,
    /// The address that a link on this interface is bound to.
    pub address: Ipv4Addr,
    /// The mask of the attached network.
    pub netmask: Ipv4Addr,
    /// Whether it is up, as far as the operating system tells.
    pub up: bool,
    /// Whether it carries multicast. Tunnels (`wg0`, `ppp0`) often do not; loopback does.
    pub multicast: bool,
}

impl Interface {
    /// Whether this is the loopback interface, which only this host can reach.
    #[must_use]
    pub const fn is_loopback(&self) -> bool {
        self.address.is_loopback()
    }

    /// Whether `address` lies in the network attached to this interface.
    #[must_use]
    pub fn reaches(&self, address: Ipv4Addr) -> bool {
        let mask = u32::from(self.netmask);
        u32::from(self.address) & mask == u32::from(address) & mask
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

/// Lists for an error message: what there is to choose from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Available(pub Vec<Interface>);

impl fmt::Display for Available {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return f.write_str("none with an IPv4 address");
        }
        for (i, interface) in self.0.iter().enumerate() {
            let comma = if i == 0 { "" } else { ", " };
            write!(f, "{comma}{interface}")?;
        }
        Ok(())
    }
}

/// The interfaces that a node opens links on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Interfaces {
    /// Every interface that is up and has an IPv4 address, without loopback. Nodes of one host
    /// hear each other there too. A host that has nothing else uses loopback.
    #[default]
    All,
    /// Only the loopback interface: nothing leaves this host and no network is needed.
    Loopback,
    /// The interfaces named, each by name (`eth0`) or by an IPv4 address of this host. Any
    /// address in 127.0.0.0/8 stands for the loopback interface with that address.
    Only(Vec<String>),
}

impl Interfaces {
    /// The interfaces of this host that are meant.
    ///
    /// # Errors
    /// [`Error::NoSuchInterface`], [`Error::InterfaceDown`] or [`Error::NoInterface`], each with
    /// what exists instead.
    pub fn choose(&self) -> Result<Vec<Interface>, Error> {
        self.choose_from(&list()?)
    }

    fn choose_from(&self, available: &[Interface]) -> Result<Vec<Interface>, Error> {
        if let Self::Only(wanted) = self {
            wanted
                .iter()
                .try_for_each(|name| named(name, available).map(drop))?;
        }
        let chosen = self.present(available);
        if chosen.is_empty() {
            return Err(Error::NoInterface(Available(available.to_vec())));
        }
        Ok(chosen)
    }

    /// Those of the available interfaces that are meant and are up. May be none.
    #[must_use]
    pub fn present(&self, available: &[Interface]) -> Vec<Interface> {
        let up = |i: &&Interface| i.up;
        let mut chosen: Vec<Interface> = Vec::new();
        match self {
            // One address of each: its first.
            Self::All => {
                for interface in available.iter().filter(up).filter(|i| !i.is_loopback()) {
                    if !chosen.iter().any(|c| c.index == interface.index) {
                        chosen.push(interface.clone());
                    }
                }
                if chosen.is_empty() {
                    return Self::Loopback.present(available);
                }
            }
            Self::Loopback => {
                chosen.extend(
                    available
                        .iter()
                        .filter(up)
                        .find(|i| i.is_loopback())
                        .cloned(),
                );
            }
            Self::Only(wanted) => {
                for interface in wanted.iter().filter_map(|name| named(name, available).ok()) {
                    if !chosen.iter().any(|c| c.address == interface.address) {
                        chosen.push(interface);
                    }
                }
            }
        }
        chosen
    }
}

#[cfg(feature = "serde")]
impl serde::Serialize for Interfaces {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::All => serializer.serialize_str("all"),
            Self::Loopback => serializer.serialize_str("loopback"),
            Self::Only(names) => names.serialize(serializer),
        }
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for Interfaces {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(WordOrNames)
    }
}

#[cfg(feature = "serde")]
struct WordOrNames;

#[cfg(feature = "serde")]
impl<'de> serde::de::Visitor<'de> for WordOrNames {
    type Value = Interfaces;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("\"all\", \"loopback\" or a list of names or addresses such as [\"eth0\"]")
    }

    fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Interfaces, E> {
        match word {
            "all" => Ok(Interfaces::All),
            "loopback" => Ok(Interfaces::Loopback),
            _ => Err(E::invalid_value(serde::de::Unexpected::Str(word), &self)),
        }
    }

    fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut seq: A) -> Result<Interfaces, A::Error> {
        let mut names = Vec::new();
        while let Some(name) = seq.next_element()? {
            names.push(name);
        }
        Ok(Interfaces::Only(names))
    }
}

/// Every IPv4 address of every interface of this host, up or not.
///
/// # Errors
/// [`Error::Io`] if the operating system does not tell.
pub fn list() -> Result<Vec<Interface>, Error> {
    let found = if_addrs::get_if_addrs().map_err(|source| Error::Io {
        doing: "listing the network interfaces".into(),
        source,
    })?;
    Ok(found.into_iter().filter_map(describe).collect())
}

/// The local address from which the operating system would send to `peer`; `None` if it knows no
/// way there. Nothing is sent.
#[must_use]
pub fn local_address_for(peer: SocketAddr) -> Option<Ipv4Addr> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).ok()?;
    socket.connect(peer).ok()?;
    match socket.local_addr().ok()?.ip() {
        IpAddr::V4(v4) => Some(v4),
        IpAddr::V6(_) => None,
    }
}

fn describe(found: if_addrs::Interface) -> Option<Interface> {
    let IfAddr::V4(v4) = &found.addr else {
        return None;
    };
    let flags = sysfs_flags(&found.name);
    let up = flags.map_or(found.oper_status != IfOperStatus::Down, |f| f & IFF_UP != 0);
    // Loopback carries multicast although its flag says otherwise.
    let multicast = v4.ip.is_loopback() || flags.map_or(!found.is_p2p, |f| f & IFF_MULTICAST != 0);
    Some(Interface {
        index: found.index?,
        address: v4.ip,
        netmask: v4.netmask,
        up,
        multicast,
        name: found.name,
    })
}

const IFF_UP: u32 = 0x1;
const IFF_MULTICAST: u32 = 0x1000;

/// The interface's flags where the operating system (Linux) shows them as a file.
fn sysfs_flags(name: &str) -> Option<u32> {
    let text = std::fs::read_to_string(format!("/sys/class/net/{name}/flags")).ok()?;
    u32::from_str_radix(text.trim().trim_start_matches("0x"), 16).ok()
}

/// The interface that was asked for, which must be up.
fn named(wanted: &str, available: &[Interface]) -> Result<Interface, Error> {
    let found = match wanted.parse::<Ipv4Addr>() {
        Ok(address) => by_address(address, available),
        Err(_) => available.iter().find(|i| i.name == wanted).cloned(),
    };
    match found {
        None => Err(Error::NoSuchInterface {
            wanted: wanted.to_owned(),
            available: Available(available.to_vec()),
        }),
        Some(down) if !down.up => Err(Error::InterfaceDown {
            interface: down,
            available: Available(available.to_vec()),
        }),
        Some(interface) => Ok(interface),
    }
}

fn by_address(address: Ipv4Addr, available: &[Interface]) -> Option<Interface> {
    let exact = available.iter().find(|i| i.address == address);
    let loopback = || {
        available
            .iter()
            .find(|i| i.is_loopback() && address.is_loopback())
    };
    exact.or_else(loopback).map(|i| Interface {
        address,
        ..i.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interface(name: &str, index: u32, address: [u8; 4]) -> Interface {
        Interface {
            name: name.into(),
            index,
            address: address.into(),
            netmask: [255, 255, 255, 0].into(),
            up: true,
            multicast: true,
        }
    }

    fn host() -> Vec<Interface> {
        vec![
            interface("lo", 1, [127, 0, 0, 1]),
            interface("eth0", 2, [10, 0, 0, 5]),
            interface("eth0", 2, [10, 0, 1, 5]),
            Interface {
                up: false,
                ..interface("wlan0", 3, [10, 0, 2, 5])
            },
            Interface {
                multicast: false,
                ..interface("wg0", 4, [10, 9, 0, 1])
            },
        ]
    }

    fn names(chosen: &[Interface]) -> Vec<String> {
        chosen
            .iter()
            .map(|i| format!("{}={}", i.name, i.address))
            .collect()
    }

    #[test]
    fn all_means_one_address_of_each_interface_that_is_up_without_loopback() {
        let chosen = Interfaces::All.choose_from(&host()).unwrap();
        assert_eq!(names(&chosen), ["eth0=10.0.0.5", "wg0=10.9.0.1"]);
    }

    #[test]
    fn a_host_without_network_uses_loopback() {
        let chosen = Interfaces::All.choose_from(&host()[..1]).unwrap();
        assert_eq!(names(&chosen), ["lo=127.0.0.1"]);
    }

    #[test]
    fn interfaces_are_chosen_by_name_or_address_and_only_once() {
        let only = Interfaces::Only(
            ["eth0", "10.0.1.5", "127.0.0.7", "eth0"]
                .map(String::from)
                .into(),
        );
        let chosen = only.choose_from(&host()).unwrap();
        assert_eq!(
            names(&chosen),
            ["eth0=10.0.0.5", "eth0=10.0.1.5", "lo=127.0.0.7"]
        );
    }

    #[test]
    fn an_unknown_interface_is_an_error_that_lists_what_exists() {
        let error = Interfaces::Only(vec!["eth9".into()])
            .choose_from(&host())
            .unwrap_err();
        let text = error.to_string();
        assert!(text.contains("`eth9`"), "{text}");
        assert!(
            text.contains("eth0 10.0.0.5") && text.contains("wlan0 10.0.2.5 (down)"),
            "{text}"
        );
        assert!(text.contains("wg0 10.9.0.1 (no multicast)"), "{text}");
    }

    #[test]
    fn an_interface_that_is_down_is_said_to_be_down() {
        let error = Interfaces::Only(vec!["wlan0".into()])
            .choose_from(&host())
            .unwrap_err();
        assert!(matches!(error, Error::InterfaceDown { .. }), "{error}");
    }

    #[test]
    fn a_host_without_any_address_is_told_so() {
        let error = Interfaces::All.choose_from(&[]).unwrap_err();
        assert!(
            error.to_string().contains("none with an IPv4 address"),
            "{error}"
        );
    }

    #[test]
    fn an_interface_reaches_the_addresses_of_its_own_network_only() {
        let eth0 = interface("eth0", 2, [10, 0, 0, 5]);
        assert!(eth0.reaches([10, 0, 0, 99].into()));
        assert!(!eth0.reaches([10, 0, 1, 5].into()));
    }
}
