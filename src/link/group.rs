//! The multicast group, by which nodes that do not know each other meet.

use std::fmt;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::str::FromStr;

/// The port that IANA assigned to JAUS, for UDP and TCP.
pub const STANDARD_PORT: u16 = 3794;

/// The multicast group that every known implementation uses.
pub const STANDARD_GROUP: SocketAddrV4 =
    SocketAddrV4::new(Ipv4Addr::new(239, 255, 0, 1), STANDARD_PORT);

/// The multicast group of a link: `239.255.0.1`, which means port 3794, `239.255.0.1:3794`, or
/// `off` for unicast alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// No multicast.
    Off,
    /// This group and port, joined on every interface that carries multicast.
    At(SocketAddrV4),
}

/// Not a multicast group.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no multicast group: write an address from 224.0.0.0 to 239.255.255.255, with a port \
     if it is not 3794, or `off`; the usual group for JAUS is 239.255.0.1:3794"
)]
pub struct InvalidGroup(String);

impl Group {
    /// Whether the address is a multicast address and the port is not 0.
    ///
    /// # Errors
    /// [`InvalidGroup`], with what can be.
    pub fn validate(self) -> Result<(), InvalidGroup> {
        match self {
            Self::At(group) if !group.ip().is_multicast() || group.port() == 0 => {
                Err(InvalidGroup(group.to_string()))
            }
            _ => Ok(()),
        }
    }
}

impl Default for Group {
    fn default() -> Self {
        Self::At(STANDARD_GROUP)
    }
}

impl FromStr for Group {
    type Err = InvalidGroup;

    fn from_str(text: &str) -> Result<Self, InvalidGroup> {
        if text == "off" {
            return Ok(Self::Off);
        }
        let standard = |ip: Ipv4Addr| SocketAddrV4::new(ip, STANDARD_PORT);
        let address = text.parse().or_else(|_| text.parse().map(standard));
        let group = address
            .ok()
            .map(Self::At)
            .filter(|group| group.validate().is_ok());
        group.ok_or_else(|| InvalidGroup(text.to_owned()))
    }
}

impl fmt::Display for Group {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Off => f.pad("off"),
            Self::At(group) => group.fmt(f),
        }
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for Group {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(feature = "serde")]
impl serde::Serialize for Group {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_is_an_address_with_or_without_port_or_off() {
        let named = |text: &str| text.parse::<Group>().map(|group| group.to_string());
        assert_eq!(named("239.255.0.9").unwrap(), "239.255.0.9:3794");
        assert_eq!(named("239.255.0.1:4000").unwrap(), "239.255.0.1:4000");
        assert_eq!(named("off").unwrap(), "off");
        assert_eq!(Group::default().to_string(), "239.255.0.1:3794");
    }

    #[test]
    fn what_is_no_group_is_refused_with_what_would_be() {
        for wrong in ["", "none", "10.0.0.1", "239.255.0.1:0", "239.255.0.1:99999"] {
            let error = wrong.parse::<Group>().unwrap_err().to_string();
            assert!(error.contains(&format!("`{wrong}`")), "{error}");
            assert!(error.contains("224.0.0.0 to 239.255.255.255"), "{error}");
        }
    }
}
