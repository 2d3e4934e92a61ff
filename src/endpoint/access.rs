//! Access control for a node: allow and deny lists by subsystem and by network, and ids bound to
//! networks.
//!
//! JAUS does not authenticate senders. The lists keep out unrelated traffic, such as another team's
//! vehicles on a shared network. Binding refuses a forged id from another address. Neither protects
//! against a sender that forges the address as well.

use std::fmt;
use std::net::IpAddr;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::str::FromStr;

use ipnet::IpNet;

use super::{Counter, Remote};
use crate::address::{JausId, ParseIdError};
use crate::as_text::serde_as_text;
use crate::rights::{self, Admitted, Grant, GrantError, Table, Unaccepted};
use crate::wire::Frame;

/// Allow and deny lists. Deny wins over allow. If an allow list is not empty, everything that is
/// not on it is denied; empty lists admit everything.
///
/// ```toml
/// [access]
/// allow_subsystems = ["101", "200-299"]
/// deny_networks = ["10.0.9.0/24", "fd00:9::/32"]
/// bind = ["60.255.255@192.168.7.2"]
/// grants = ["60 control=127", "65535.255.255 observe"]
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct Access {
    /// The only subsystems to receive from and to forward for, unless empty. The node's own
    /// subsystem is no exception: its other nodes are heard only if it is listed. Flag: `--allow`.
    pub allow_subsystems: Vec<Subsystems>,
    /// Subsystems to ignore, both as senders and for forwarding. Flag: `--deny`.
    pub deny_subsystems: Vec<Subsystems>,
    /// The only networks to receive from, unless empty. Serial lines and secure links have no
    /// address and are always allowed. Flag: `--allow`.
    pub allow_networks: Vec<Network>,
    /// Networks to ignore. Flag: `--deny`.
    pub deny_networks: Vec<Network>,
    /// Ids and the only networks to receive them from. An id with several entries may come from each
    /// of their networks; an id without an entry may come from anywhere. A bound id is refused from
    /// a serial line. Secure links are exempt, because they check the ids of each key. Flag:
    /// `--bind`.
    pub bind: Vec<Binding>,
    /// What ids may do that come by plain links, in the words of [`rights`](crate::rights):
    /// `["60 control=127", "65535.255.255 observe"]`. The first entry that an id matches counts, and an
    /// id without one is refused. Without entries everybody may do everything. Ids are not proven: who
    /// is on the network and forges one has its rights, unless [`bind`](Self::bind) keeps it out.
    /// Secure links are exempt, because they have rules for each key. Flag: `--grant`.
    pub grants: Vec<Grant>,
    /// JSIDL files or folders of messages of one's own, which state what their senders need, for `grants`. The
    /// programs read them into [`table`](Self::table). Flag: `--grant-jsidl`.
    pub jsidl: Vec<PathBuf>,
    /// What messages need, for `grants`: by default the table of the catalogue. A program that knows further
    /// definitions replaces it.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub table: Table,
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

    /// Whether messages with this id may come from this remote end.
    #[must_use]
    pub fn allows_id_from(&self, id: JausId, from: Remote) -> bool {
        let mut bindings = self.bind.iter().filter(|it| it.ids.matches(id)).peekable();
        if bindings.peek().is_none() {
            return true;
        }
        match from {
            Remote::Socket(address) => bindings.any(|it| it.network.contains(address.ip())),
            Remote::Line => false,
            Remote::Session(_) => true,
        }
    }

    /// Whether an entry of [`bind`](Self::bind) says where this id comes from.
    #[must_use]
    pub fn binds(&self, id: JausId) -> bool {
        self.bind.iter().any(|it| it.ids.matches(id))
    }

    /// Checks what a message needs that comes from this remote end, and says to which ids it may go.
    ///
    /// # Errors
    /// Why it is refused.
    pub fn admit(&self, frame: &Frame, from: Remote) -> Result<Admitted, Unaccepted> {
        if self.grants.is_empty() || from.is_session() {
            return Ok(Admitted::Whole);
        }
        rights::admit_by_grants(&self.grants, frame, &self.table)
    }

    /// Checks the words of all grants against the table: names that no definition has, and rights that have
    /// no effect on plain links. Grants that do not pass give no more than they would without the word.
    ///
    /// # Errors
    /// The first grant that is wrong.
    pub fn verify_grants(&self) -> Result<(), GrantError> {
        let mut grants = self.grants.iter();
        grants.try_for_each(|grant| {
            if grant.rules.clear_any_emergency {
                return Err(GrantError::ClearAny(grant.to_string()));
            }
            Ok(grant.rules.verify(&self.table)?)
        })
    }

    /// Adds an entry to the allow list of its kind.
    pub fn allow(&mut self, entry: AccessEntry) {
        match entry {
            AccessEntry::Subsystems(subsystems) => self.allow_subsystems.push(subsystems),
            AccessEntry::Network(network) => self.allow_networks.push(network),
        }
    }

    /// Adds an entry to the deny list of its kind.
    pub fn deny(&mut self, entry: AccessEntry) {
        match entry {
            AccessEntry::Subsystems(subsystems) => self.deny_subsystems.push(subsystems),
            AccessEntry::Network(network) => self.deny_networks.push(network),
        }
    }

    /// Checks the subsystem of a message's source or destination.
    pub(super) fn check_subsystem(&self, id: JausId) -> Result<(), Counter> {
        let is_allowed = self.allows_subsystem(id.subsystem());
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

/// Ids bound to a network, as text `60.1.255@192.168.7.2` or `60.255.255@192.168.7.0/24`. The ids
/// may have the wildcards 65535 and 255.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Binding {
    ids: JausId,
    network: Network,
}

/// An entry of an allow or deny list: a [`Network`], or [`Subsystems`].
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum AccessEntry {
    /// A subsystem or a range of subsystems.
    Subsystems(Subsystems),
    /// A network or an address.
    Network(Network),
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
    /// Not ids and a network.
    #[error(
        "`{0}` binds no id to a network: write ids and a network, such as \
         \"60.1.255@192.168.7.2\" or \"60.255.255@192.168.7.0/24\""
    )]
    Binding(String),
    /// The ids of a binding are invalid.
    #[error("the ids of a binding: {0}")]
    BoundId(ParseIdError),
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

impl FromStr for Binding {
    type Err = AccessError;

    fn from_str(text: &str) -> Result<Self, AccessError> {
        let (ids, network) = text
            .split_once('@')
            .ok_or_else(|| AccessError::Binding(text.to_owned()))?;
        Ok(Self {
            ids: ids.parse().map_err(AccessError::BoundId)?,
            network: network.parse()?,
        })
    }
}

impl fmt::Display for Binding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}", self.ids, self.network)
    }
}

impl FromStr for AccessEntry {
    type Err = AccessError;

    /// An address has a dot or a colon, and a range of subsystems has neither.
    fn from_str(text: &str) -> Result<Self, AccessError> {
        if text.contains(['.', ':']) {
            text.parse().map(Self::Network)
        } else {
            text.parse().map(Self::Subsystems)
        }
    }
}

serde_as_text!(Subsystems, Network, Binding);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::endpoint::SessionId;

    fn network(text: &str) -> Network {
        text.parse().unwrap()
    }

    fn subsystems(texts: &[&str]) -> Vec<Subsystems> {
        texts.iter().map(|text| text.parse().unwrap()).collect()
    }

    #[test]
    fn words_that_have_no_effect_on_plain_links_and_unknown_names_are_errors() {
        let access = |grant: &str| Access {
            grants: vec![grant.parse().unwrap()],
            ..Access::default()
        };
        let verified = |grant: &str| access(grant).verify_grants().map_err(|it| it.to_string());
        assert_eq!(
            verified("60 control=99 clear-emergency only=PrimitiveDriver"),
            Ok(())
        );
        let error = verified("60 clear-emergency=any").unwrap_err();
        assert!(error.contains("has no effect on plain links"), "{error}");
        let error = verified("60 command only=SetLamp").unwrap_err();
        assert!(error.contains("`SetLamp` is not a service"), "{error}");
        let mut with_lamp = access("60 command only=SetLamp");
        with_lamp.table = Table::default().with("D103 command SetLamp").unwrap();
        assert!(with_lamp.verify_grants().is_ok());
        let frame = |octets: &'static [u8]| {
            let (source, to) = (JausId::new(60, 1, 1), JausId::new(101, 1, 1));
            Frame::new(source, to, bytes::Bytes::from_static(octets))
        };
        assert!(with_lamp.admit(&frame(b"\x03\xD1"), Remote::Line).is_ok());
        assert!(with_lamp.admit(&frame(b"\x05\x04"), Remote::Line).is_err());
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
    fn a_bound_id_comes_from_its_networks_alone() {
        let binding = |text: &str| text.parse().unwrap();
        let access = Access {
            bind: ["60.1.255@192.168.7.2", "60.1.255@10.0.9.0/24"]
                .map(binding)
                .into(),
            ..Access::default()
        };
        let socket = |text: &str| Remote::Socket(text.parse().unwrap());
        let bound = JausId::new(60, 1, 9);
        assert!(access.allows_id_from(bound, socket("192.168.7.2:3794")));
        assert!(access.allows_id_from(bound, socket("10.0.9.7:9")));
        assert!(!access.allows_id_from(bound, socket("192.168.7.3:3794")));
        assert!(
            !access.allows_id_from(bound, Remote::Line),
            "a line has no address"
        );
        assert!(
            access.allows_id_from(bound, Remote::Session(SessionId(1))),
            "its key has ids"
        );
        for free in [JausId::new(60, 2, 9), JausId::new(61, 1, 9)] {
            assert!(
                access.allows_id_from(free, socket("192.168.7.3:3794")),
                "{free}"
            );
        }
    }

    #[test]
    fn an_entry_of_a_flag_is_added_to_the_list_of_its_kind() {
        let mut access = Access::default();
        for text in ["101", "200-299", "10.0.0.0/8", "fd00::/8"] {
            access.allow(text.parse().unwrap());
            access.deny(text.parse().unwrap());
        }
        assert_eq!(access.allow_subsystems, subsystems(&["101", "200-299"]));
        assert_eq!(access.deny_subsystems, access.allow_subsystems);
        let networks = vec![network("10.0.0.0/8"), network("fd00::/8")];
        assert_eq!(
            (&access.allow_networks, &access.deny_networks),
            (&networks, &networks)
        );
        let error = |text: &str| text.parse::<AccessEntry>().unwrap_err();
        assert!(matches!(error("rover"), AccessError::Subsystems(_)));
        assert!(matches!(error("10.0.0"), AccessError::Network(_)));
    }

    #[test]
    fn entries_are_written_as_they_are_read() {
        for text in ["101", "200-299"] {
            assert_eq!(text.parse::<Subsystems>().unwrap().to_string(), text);
        }
        for text in ["10.0.9.0/24", "fd00::/8"] {
            assert_eq!(network(text).to_string(), text);
        }
        let text = "60.255.255@10.0.9.0/24";
        assert_eq!(text.parse::<Binding>().unwrap().to_string(), text);
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
        for (wrong, remedy) in [
            ("60.1.255", "\"60.1.255@192.168.7.2\""),
            ("60.1@10.0.9.7", "\"60.1\""),
            ("60.1.1@eth0", "\"10.0.9.7\""),
        ] {
            let error = wrong.parse::<Binding>().unwrap_err().to_string();
            assert!(error.contains(remedy), "{error}");
        }
    }
}
