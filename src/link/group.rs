//! The multicast groups, one per IP version, with which nodes find each other.

use std::fmt;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, SocketAddrV4, SocketAddrV6};
use std::str::FromStr;

use crate::as_text::serde_as_text;

/// The port that IANA assigned to JAUS, for UDP and TCP.
pub const STANDARD_PORT: u16 = 3794;

/// The multicast group that every known implementation uses.
pub const STANDARD_GROUP: SocketAddrV4 =
    SocketAddrV4::new(Ipv4Addr::new(239, 255, 0, 1), STANDARD_PORT);

/// The multicast group of this implementation for IPv6; the standard defines none.
///
/// `ff12::efff:1` is a temporary address, as RFC 4291 requires for a group not assigned by IANA. It
/// is link-local, so it needs no routers and no address beyond the one that every interface has,
/// and it cannot leave the network. Its last 32 bits are those of the IPv4 group and lie in the
/// range that RFC 3307 leaves to applications. For use across routers, configure `[ff15::efff:1]`
/// (site), and name each interface by its global address.
pub const STANDARD_GROUP6: SocketAddrV6 = SocketAddrV6::new(
    Ipv6Addr::new(0xFF12, 0, 0, 0, 0, 0, 0xEFFF, 1),
    STANDARD_PORT,
    0,
    0,
);

/// The multicast group of a link: `239.255.0.1`, which means port 3794, `239.255.0.1:3794`, or
/// `off` for unicast only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group<A = SocketAddrV4> {
    /// No multicast.
    Off,
    /// This group and port, joined on every interface that carries multicast.
    At(A),
}

/// The multicast group of a link with IPv6: `ff12::efff:1`, `[ff12::efff:1]:3794` or `off`.
pub type Group6 = Group<SocketAddrV6>;

/// Not a multicast group.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{given}` is not a multicast group: write an address from {range}, with a port if it is not \
     3794, or `off`; the usual JAUS group is {usual}"
)]
pub struct InvalidGroup {
    given: String,
    range: &'static str,
    usual: SocketAddr,
}

/// The socket addresses of one IP version.
pub trait GroupAddress: Copy + Into<SocketAddr> + FromStr + fmt::Display {
    /// The range of its multicast addresses, for people.
    const RANGE: &'static str;
    /// The default group.
    const USUAL: Self;
}

impl GroupAddress for SocketAddrV4 {
    const RANGE: &'static str = "224.0.0.0 to 239.255.255.255";
    const USUAL: Self = STANDARD_GROUP;
}

impl GroupAddress for SocketAddrV6 {
    const RANGE: &'static str = "ff00:: to ffff:…";
    const USUAL: Self = STANDARD_GROUP6;
}

impl<A: GroupAddress> Group<A> {
    /// Checks that the address is a multicast address and the port is not 0.
    ///
    /// # Errors
    /// [`InvalidGroup`], with the valid range.
    pub fn validate(self) -> Result<(), InvalidGroup> {
        match self.address() {
            Some(group) if !group.ip().is_multicast() || group.port() == 0 => {
                Err(Self::invalid(&group.to_string()))
            }
            _ => Ok(()),
        }
    }

    /// The address and port; `None` if it is off.
    #[must_use]
    pub fn address(self) -> Option<SocketAddr> {
        match self {
            Self::Off => None,
            Self::At(group) => Some(group.into()),
        }
    }

    fn invalid(given: &str) -> InvalidGroup {
        InvalidGroup {
            given: given.to_owned(),
            range: A::RANGE,
            usual: A::USUAL.into(),
        }
    }
}

impl<A: GroupAddress> Default for Group<A> {
    fn default() -> Self {
        Self::At(A::USUAL)
    }
}

impl<A: GroupAddress> FromStr for Group<A> {
    type Err = InvalidGroup;

    fn from_str(text: &str) -> Result<Self, InvalidGroup> {
        if text == "off" {
            return Ok(Self::Off);
        }
        let with_port = [
            text.to_owned(),
            format!("{text}:{STANDARD_PORT}"),
            format!("[{text}]:{STANDARD_PORT}"),
        ];
        let group = with_port.iter().find_map(|text| text.parse().ok());
        group
            .map(Self::At)
            .filter(|group| group.validate().is_ok())
            .ok_or_else(|| Self::invalid(text))
    }
}

impl<A: GroupAddress> fmt::Display for Group<A> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Off => f.pad("off"),
            Self::At(group) => group.fmt(f),
        }
    }
}

serde_as_text!(Group, Group6);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_is_an_address_with_or_without_port_or_off() {
        let named = |text: &str| text.parse::<Group>().map(|group| group.to_string());
        assert_eq!(named("239.255.0.9").unwrap(), "239.255.0.9:3794");
        assert_eq!(named("239.255.0.1:4000").unwrap(), "239.255.0.1:4000");
        assert_eq!(named("off").unwrap(), "off");
        assert_eq!(<Group>::default().to_string(), "239.255.0.1:3794");
        let named = |text: &str| text.parse::<Group6>().map(|group| group.to_string());
        assert_eq!(named("ff15::efff:1").unwrap(), "[ff15::efff:1]:3794");
        assert_eq!(named("[ff12::9]:4000").unwrap(), "[ff12::9]:4000");
        assert_eq!(named("off").unwrap(), "off");
        assert_eq!(Group6::default().to_string(), "[ff12::efff:1]:3794");
    }

    #[test]
    fn what_is_no_group_is_refused_with_what_would_be() {
        let four = [
            "",
            "none",
            "10.0.0.1",
            "239.255.0.1:0",
            "239.255.0.1:99999",
            "ff12::1",
        ];
        for wrong in four {
            let error = wrong.parse::<Group>().unwrap_err().to_string();
            assert!(error.contains(&format!("`{wrong}`")), "{error}");
            assert!(error.contains("224.0.0.0 to 239.255.255.255"), "{error}");
        }
        for wrong in ["", "fe80::1", "[ff12::1]:0", "239.255.0.1"] {
            let error = wrong.parse::<Group6>().unwrap_err().to_string();
            assert!(error.contains(&format!("`{wrong}`")), "{error}");
            assert!(error.contains("[ff12::efff:1]:3794"), "{error}");
        }
    }
}
