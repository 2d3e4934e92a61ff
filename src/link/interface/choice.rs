//! Selects the host's interfaces and addresses that a node uses.

use std::collections::BTreeSet;
use std::net::{IpAddr, SocketAddr};

use super::{Available, Interface, Place, list};
use crate::link::Error;

/// The IP versions to use on the selected interfaces. An interface or a peer that is given by
/// address is used whatever its version.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Ip {
    /// IPv4, the only version that other implementations support.
    #[default]
    #[cfg_attr(feature = "serde", serde(rename = "4"))]
    V4,
    /// IPv6.
    #[cfg_attr(feature = "serde", serde(rename = "6"))]
    V6,
    /// Both. A peer that sends over both is replied to over the one it used last.
    #[cfg_attr(feature = "serde", serde(rename = "both"))]
    Both,
}

impl Ip {
    const fn includes(self, address: IpAddr) -> bool {
        match self {
            Self::V4 => address.is_ipv4(),
            Self::V6 => address.is_ipv6(),
            Self::Both => true,
        }
    }

    pub(in crate::link) const fn name(self) -> &'static str {
        match self {
            Self::V4 => "IPv4",
            Self::V6 => "IPv6",
            Self::Both => "IP",
        }
    }
}

/// The interfaces that a node opens links on.
///
/// On each interface a node uses one address per [`Ip`] version. With IPv4 this is the first one.
/// With IPv6 it is the link-local one (`fe80::…`), which every interface has and with which
/// neighbours find each other without any configuration, or else the first one. To use another
/// address, name it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(
        rename_all = "lowercase",
        expecting = "\"all\", \"loopback\" or a list of names or addresses such as [\"eth0\"]"
    )
)]
pub enum Interfaces {
    /// Every interface that is up and has an address, except loopback. Nodes of one host reach each
    /// other there too. A host without any other interface uses loopback.
    #[default]
    All,
    /// Only the loopback interface: nothing leaves this host, and no network is needed.
    Loopback,
    /// The listed interfaces, each by name (`eth0`) or by an address of this host, such as
    /// `10.0.3.2`, `fd00::2` or `fe80::1%eth0`. Any address in 127.0.0.0/8 means the loopback
    /// interface with that address.
    #[cfg_attr(feature = "serde", serde(untagged))]
    Only(Vec<String>),
}

impl Interfaces {
    /// The selected interfaces of this host.
    ///
    /// # Errors
    /// [`Error::NoSuchInterface`], [`Error::NoAddress`], [`Error::InterfaceDown`] or
    /// [`Error::NoInterface`], each with what exists instead.
    pub fn choose(&self, ip: Ip) -> Result<Vec<Interface>, Error> {
        self.choose_from(&list()?, ip)
    }

    fn choose_from(&self, available: &[Interface], ip: Ip) -> Result<Vec<Interface>, Error> {
        if let Self::Only(wanted) = self {
            wanted
                .iter()
                .try_for_each(|name| named(name, available, ip).map(drop))?;
        }
        let chosen = self.present(available, ip);
        if chosen.is_empty() {
            return Err(Error::NoInterface(Available(available.to_vec())));
        }
        Ok(chosen)
    }

    /// The selected ones of the available interfaces that are up. May be empty.
    #[must_use]
    pub fn present(&self, available: &[Interface], ip: Ip) -> Vec<Interface> {
        let up = available.iter().filter(|i| i.up);
        match self {
            Self::All => {
                let chosen = usual(up.filter(|i| !i.is_loopback()), ip);
                if chosen.is_empty() {
                    return Self::Loopback.present(available, ip);
                }
                chosen
            }
            Self::Loopback => usual(up.filter(|i| i.is_loopback()), ip),
            Self::Only(wanted) => {
                let mut seen = BTreeSet::new();
                let found = wanted.iter().flat_map(|name| named(name, available, ip));
                let is_new = |interface: &Interface| seen.insert(interface.at(0));
                found.flatten().filter(is_new).collect()
            }
        }
    }
}

/// One address per interface and selected version, IPv4 first.
fn usual<'a>(addresses: impl Iterator<Item = &'a Interface>, ip: Ip) -> Vec<Interface> {
    let mut all: Vec<&Interface> = addresses.filter(|i| ip.includes(i.address)).collect();
    all.sort_by_key(|i| (i.address.is_ipv6(), !i.is_link_local()));
    let mut seen = BTreeSet::new();
    all.retain(|i| seen.insert((i.index, i.address.is_ipv4())));
    all.into_iter().cloned().collect()
}

/// The addresses of a requested interface, which must be up.
fn named(wanted: &str, available: &[Interface], ip: Ip) -> Result<Vec<Interface>, Error> {
    let place = wanted.parse::<Place>().ok();
    let of_name = |i: &&Interface| i.name == wanted;
    let mut found: Vec<Interface> = match place {
        Some(place) => by_address(place, available).into_iter().collect(),
        None => available.iter().filter(of_name).cloned().collect(),
    };
    let (wanted, available) = (wanted.to_owned(), Available(available.to_vec()));
    let Some(first) = found.first().cloned() else {
        return Err(Error::NoSuchInterface(wanted, available));
    };
    found.retain(|i| i.up);
    if found.is_empty() {
        return Err(Error::InterfaceDown(first, available));
    }
    if place.is_none() {
        found = usual(found.iter(), ip);
    }
    if found.is_empty() {
        return Err(Error::NoAddress(wanted, ip, available));
    }
    Ok(found)
}

fn by_address(place: Place, available: &[Interface]) -> Option<Interface> {
    let address = place.address();
    let any_scope = SocketAddr::new(address.ip(), address.port()) == address;
    let is_meant = |i: &&Interface| {
        let own = i.at(address.port());
        own == address || any_scope && own.ip() == address.ip()
    };
    let loopback = || {
        let of_ipv4 = |i: &&Interface| i.is_loopback() && i.address.is_ipv4();
        let v4 = address.is_ipv4() && address.ip().is_loopback();
        available.iter().find(of_ipv4).filter(|_| v4)
    };
    let found = available.iter().find(is_meant).or_else(loopback)?;
    Some(Interface {
        address: address.ip(),
        ..found.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interface(name: &str, index: u32, address: &str) -> Interface {
        let address: IpAddr = address.parse().unwrap();
        Interface {
            name: name.into(),
            index,
            address,
            prefix: if address.is_ipv4() { 24 } else { 64 },
            up: true,
            multicast: true,
            broadcast: None,
        }
    }

    fn host() -> Vec<Interface> {
        vec![
            interface("lo", 1, "127.0.0.1"),
            interface("eth0", 2, "10.0.0.5"),
            interface("eth0", 2, "10.0.1.5"),
            Interface {
                up: false,
                ..interface("wlan0", 3, "10.0.2.5")
            },
            Interface {
                multicast: false,
                ..interface("wg0", 4, "10.9.0.1")
            },
            interface("lo", 1, "::1"),
            interface("eth0", 2, "fd00::5"),
            interface("eth0", 2, "fe80::5"),
            interface("eth1", 5, "fe80::5"),
            interface("eth2", 6, "fd00::6"),
        ]
    }

    fn names(chosen: &[Interface]) -> Vec<String> {
        chosen
            .iter()
            .map(|i| format!("{}={}", i.name, i.address))
            .collect()
    }

    fn only<const N: usize>(names: [&str; N]) -> Interfaces {
        Interfaces::Only(names.map(String::from).into())
    }

    #[test]
    fn all_means_one_address_of_each_interface_that_is_up_without_loopback() {
        let chosen = |ip| names(&Interfaces::All.choose_from(&host(), ip).unwrap());
        assert_eq!(chosen(Ip::V4), ["eth0=10.0.0.5", "wg0=10.9.0.1"]);
        let six = ["eth0=fe80::5", "eth1=fe80::5", "eth2=fd00::6"];
        assert_eq!(chosen(Ip::V6), six);
        assert_eq!(chosen(Ip::Both)[2..], six);
    }

    #[test]
    fn a_host_without_network_uses_loopback() {
        let host = [host()[0].clone(), host()[5].clone()];
        let chosen = |ip| names(&Interfaces::All.choose_from(&host, ip).unwrap());
        assert_eq!(chosen(Ip::V4), ["lo=127.0.0.1"]);
        assert_eq!(chosen(Ip::V6), ["lo=::1"]);
        assert_eq!(chosen(Ip::Both), ["lo=127.0.0.1", "lo=::1"]);
    }

    #[test]
    fn interfaces_are_chosen_by_name_or_address_and_only_once() {
        let wanted = only(["eth0", "10.0.1.5", "127.0.0.7", "eth0"]);
        assert_eq!(
            names(&wanted.choose_from(&host(), Ip::V4).unwrap()),
            ["eth0=10.0.0.5", "eth0=10.0.1.5", "lo=127.0.0.7"]
        );
        let wanted = only(["eth0", "fd00::5", "fe80::5%5", "::1"]);
        let chosen = wanted.choose_from(&host(), Ip::Both).unwrap();
        assert_eq!(chosen[3].index, 5);
        assert_eq!(
            names(&chosen),
            [
                "eth0=10.0.0.5",
                "eth0=fe80::5",
                "eth0=fd00::5",
                "eth1=fe80::5",
                "lo=::1"
            ]
        );
    }

    #[test]
    fn an_unknown_interface_is_an_error_that_lists_what_exists() {
        let error = only(["eth9"]).choose_from(&host(), Ip::V4).unwrap_err();
        let text = error.to_string();
        assert!(text.contains("`eth9`"), "{text}");
        assert!(
            text.contains("eth0 10.0.0.5") && text.contains("wlan0 10.0.2.5 (down)"),
            "{text}"
        );
        assert!(text.contains("wg0 10.9.0.1 (no multicast)"), "{text}");
    }

    #[test]
    fn an_interface_without_an_address_of_the_version_wanted_is_said_to_lack_it() {
        let error = only(["wg0"]).choose_from(&host(), Ip::V6).unwrap_err();
        let text = error.to_string();
        assert!(text.contains("`wg0` has no IPv6 address"), "{text}");
    }

    #[test]
    fn an_interface_that_is_down_is_said_to_be_down() {
        for wanted in ["wlan0", "10.0.2.5"] {
            let error = only([wanted]).choose_from(&host(), Ip::V4).unwrap_err();
            assert!(matches!(error, Error::InterfaceDown { .. }), "{error}");
        }
    }

    #[test]
    fn a_host_without_any_address_is_told_so() {
        let error = Interfaces::All.choose_from(&[], Ip::V4).unwrap_err();
        assert!(
            error.to_string().contains("none with an address"),
            "{error}"
        );
    }
}
