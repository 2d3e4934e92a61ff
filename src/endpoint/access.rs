//! Access control for a node: allow and deny lists by subsystem and by network.
//!
//! JAUS does not authenticate senders. The lists keep out unrelated traffic, such as another team's
//! vehicles on a shared network. They do not protect against a sender that forges an id or address.

use std::fmt;
use std::net::IpAddr;
use std::ops::RangeInclusive;
use std::str::FromStr;

use ipnet::IpNet;

use super::Counter;
use crate::address::JausId;
use crate::as_text::serde_as_text;

/// Allow and deny lists. Deny wins over allow. If an allow list is not empty, everything that is
/// not on it is denied; empty lists admit everything.
///
/// ```toml
/// [access]
/// allow_subsystems = ["101", "200-299"]
/// deny_networks = ["10.0.9.0/24", "fd00:9::/32"]
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct Access {
    /// The only subsystems to receive from and to forward for, unless empty. The node's own
    /// subsystem is no exception: its other nodes are heard only if it is listed.
    pub allow_subsystems: Vec<Subsystems>,
    /// Subsystems to ignore, both as senders and for forwarding.
    pub deny_subsystems: Vec<Subsystems>,
    /// The only networks to receive from, unless empty. Serial lines have no address and are always
    /// allowed.
    pub allow_networks: Vec<Network>,
    /// Networks to ignore.
    pub deny_networks: Vec<Network>,
}

impl Access {
    /// Whether a message may come from, or be forwarded to, this subsystem.
    #[must_use]
    pub fn allows_subsystem(&self, subsystem: u16) -> bool {
        let contains = |range: &Subsystems| range.contains(subsystem);
        admits(&self.allow_subsystems, &self.deny_subsystems, contains)
    }

    /// Whether messages may come from this address.
    #[must_use]
    pub fn allows_address(&self, address: IpAddr) -> bool {
        let contains = |network: &Network| network.contains(address);
        admits(&self.allow_networks, &self.deny_networks, contains)
    }

    /// Checks the sender of a message.
    pub(super) fn check_source(&self, source: JausId) -> Result<(), Counter> {
        let is_allowed = self.allows_subsystem(source.subsystem());
        is_allowed.then_some(()).ok_or(Counter::SubsystemDenied)
    }
}

fn admits<T>(allow: &[T], deny: &[T], contains: impl Fn(&T) -> bool) -> bool {
    !deny.iter().any(&contains) && (allow.is_empty() || allow.iter().any(&contains))
}

/// A subsystem or a range of subsystems, as text `101` or `200-299`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Subsystems(RangeInclusive<u16>);

impl Subsystems {
    /// Whether the range contains this subsystem.
    #[must_use]
    pub fn contains(&self, subsystem: u16) -> bool {
        self.0.contains(&subsystem)
    }
}

/// Why a text is not a valid list entry.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AccessError {
    /// Neither a subsystem number nor a range.
    #[error(
        "`{0}` is not a subsystem or range: write a number from 1 to 65534 such as \"101\", or a \
         range in ascending order such as \"200-299\""
    )]
    Subsystems(String),
    /// Not a network.
    #[error(
        "`{0}` is not a network: write an address and its prefix length, such as \"10.0.9.0/24\" \
         or \"fd00::/8\", or one address such as \"10.0.9.7\""
    )]
    Network(String),
    /// The address has bits set beyond the prefix.
    #[error("`{text}` has bits set after the first {}: write \"{meant}\"", meant.0.prefix_len())]
    HostBits {
        /// The text.
        text: String,
        /// The network that contains the address.
        meant: Network,
    },
}

impl FromStr for Subsystems {
    type Err = AccessError;

    fn from_str(text: &str) -> Result<Self, AccessError> {
        let number = |part: &str| {
            let part = part.trim();
            let plain = part.bytes().all(|octet| octet.is_ascii_digit());
            let number = part.parse::<u16>().ok().filter(|_| plain);
            number.filter(|number| (1..JausId::ANY_SUBSYSTEM).contains(number))
        };
        let (first, last) = text.split_once('-').unwrap_or((text, text));
        match (number(first), number(last)) {
            (Some(first), Some(last)) if first <= last => Ok(Self(first..=last)),
            _ => Err(AccessError::Subsystems(text.to_owned())),
        }
    }
}

impl fmt::Display for Subsystems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (first, last) = (self.0.start(), self.0.end());
        if first == last {
            write!(f, "{first}")
        } else {
            write!(f, "{first}-{last}")
        }
    }
}

/// An IPv4 or IPv6 network, as text `10.0.9.0/24`, `fd00::/8`, or a single address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Network(IpNet);

impl Network {
    /// Whether the network contains an address. An IPv4-mapped IPv6 address (`::ffff:10.0.9.7`)
    /// counts as the IPv4 address.
    #[must_use]
    pub fn contains(self, address: IpAddr) -> bool {
        self.0.contains(&address.to_canonical())
    }
}

impl FromStr for Network {
    type Err = AccessError;

    fn from_str(text: &str) -> Result<Self, AccessError> {
        let network = text
            .parse()
            .or_else(|_| text.parse::<IpAddr>().map(IpNet::from))
            .map_err(|_| AccessError::Network(text.to_owned()))?;
        let meant = Self(network.trunc());
        if meant.0 != network {
            return Err(AccessError::HostBits {
                text: text.to_owned(),
                meant,
            });
        }
        Ok(meant)
    }
}

impl fmt::Display for Network {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

serde_as_text!(Subsystems, Network);

#[cfg(test)]
mod tests {
    use super::*;

    fn network(text: &str) -> Network {
        text.parse().unwrap()
    }

    fn subsystems(texts: &[&str]) -> Vec<Subsystems> {
        texts.iter().map(|text| text.parse().unwrap()).collect()
    }

    #[test]
    fn deny_wins_over_allow_and_empty_lists_let_everybody_in() {
        let mut access = Access::default();
        assert!(access.allows_subsystem(7) && access.allows_address([10, 0, 9, 7].into()));
        access.allow_subsystems = subsystems(&["101", "200-299"]);
        access.deny_subsystems = subsystems(&["250"]);
        let allowed: Vec<_> = (1..400).filter(|&id| access.allows_subsystem(id)).collect();
        assert_eq!(allowed.len(), 100);
        assert!(allowed.contains(&101) && allowed.contains(&299) && !allowed.contains(&250));
        access.allow_networks = vec![network("10.0.0.0/8")];
        access.deny_networks = vec![network("10.0.9.0/24")];
        let allows = |text: &str| access.allows_address(text.parse().unwrap());
        assert!(allows("10.0.8.1") && !allows("10.0.9.1") && !allows("11.0.0.1"));
    }

    #[test]
    fn networks_of_both_families_hold_what_is_in_them() {
        let holds = |net: &str, address: &str| network(net).contains(address.parse().unwrap());
        assert!(holds("fd00::/8", "fdff::1") && !holds("fd00::/8", "fe80::1"));
        assert!(holds("0.0.0.0/0", "1.2.3.4") && !holds("0.0.0.0/0", "::1"));
        assert!(holds("::/0", "2001:db8::1"));
        assert!(holds("10.0.9.7", "10.0.9.7") && !holds("10.0.9.7", "10.0.9.6"));
        assert!(
            holds("10.0.9.0/24", "::ffff:10.0.9.1"),
            "IPv4 in IPv6's form"
        );
    }

    #[test]
    fn entries_are_written_as_they_are_read() {
        for text in ["101", "200-299"] {
            assert_eq!(text.parse::<Subsystems>().unwrap().to_string(), text);
        }
        for text in ["10.0.9.0/24", "fd00::/8"] {
            assert_eq!(network(text).to_string(), text);
        }
    }

    #[test]
    fn a_wrong_entry_is_named_with_what_to_write() {
        for wrong in ["", "0", "65535", "299-200", "a", "1-", "+1", "1-2-3"] {
            let error = wrong.parse::<Subsystems>().unwrap_err().to_string();
            assert!(error.contains(&format!("`{wrong}`")), "{error}");
            assert!(error.contains("\"200-299\""), "{error}");
        }
        for wrong in [
            "",
            "10.0.9.0/33",
            "fd00::/129",
            "10.0.9/24",
            "10.0.9.0/",
            "eth0",
        ] {
            let error = wrong.parse::<Network>().unwrap_err().to_string();
            assert!(error.contains("\"10.0.9.0/24\""), "{error}");
        }
        let error = "10.0.9.7/24".parse::<Network>().unwrap_err().to_string();
        assert!(error.contains("write \"10.0.9.0/24\""), "{error}");
    }
}
