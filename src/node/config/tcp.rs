//! The `[tcp]` section: connections to and from other nodes.

use std::fmt;
use std::net::{IpAddr, SocketAddr};
use std::str::FromStr;

use super::Peer;
use crate::as_text::serde_as_text;
use crate::endpoint::Access;
use crate::link::{STANDARD_PORT, tcp};

/// TCP connections of a node. The default is none.
///
/// ```toml
/// [tcp]
/// listen = "0.0.0.0"                                      # port 3794, or "10.0.0.5:3795"
/// connect = ["10.0.0.7", "102.255.255@10.0.0.8:3794"]     # again and again, if they are lost
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
#[non_exhaustive]
pub struct Tcp {
    /// The address to accept connections at; none if omitted.
    pub listen: Option<Listen>,
    /// Peers to connect to. With an id (or a pattern of ids) in front, messages for it go there
    /// before it has sent any.
    pub connect: Vec<Peer>,
    /// Limit of accepted connections.
    pub max_accepted: usize,
    /// Limit of accepted connections from one IPv4 address, or from the 64-bit network of an IPv6
    /// address.
    pub max_per_address: usize,
}

impl Default for Tcp {
    fn default() -> Self {
        let usual = tcp::Settings::default();
        Self {
            listen: None,
            connect: Vec::new(),
            max_accepted: usual.max_accepted,
            max_per_address: usual.max_per_address,
        }
    }
}

impl Tcp {
    /// Whether TCP is in use.
    pub(in crate::node) const fn is_used(&self) -> bool {
        self.listen.is_some() || !self.connect.is_empty()
    }

    /// The settings of the link; `access` limits which addresses may connect.
    pub(in crate::node) fn settings(&self, access: &Access) -> tcp::Settings {
        tcp::Settings {
            listen: self.listen.map(|listen| listen.0),
            connect: self.connect.iter().map(|peer| peer.address()).collect(),
            max_accepted: self.max_accepted,
            max_per_address: self.max_per_address,
            access: access.clone(),
        }
    }
}

/// The address where a node accepts connections: `10.0.0.5`, which means port 3794,
/// `10.0.0.5:3795`, `0.0.0.0` for all addresses of the host, port 0 for any free one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Listen(SocketAddr);

/// Not an address to listen on.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is not an address to listen on: write an address of this host, or 0.0.0.0 for all of \
     them, with a port if it is not 3794, such as 10.0.0.5 or 0.0.0.0:3795"
)]
pub struct InvalidListen(String);

impl From<SocketAddr> for Listen {
    fn from(address: SocketAddr) -> Self {
        Self(address)
    }
}

impl FromStr for Listen {
    type Err = InvalidListen;

    fn from_str(text: &str) -> Result<Self, InvalidListen> {
        let standard = |ip: IpAddr| SocketAddr::new(ip, STANDARD_PORT);
        let address = text.parse().or_else(|_| text.parse().map(standard));
        address
            .ok()
            .filter(|address| !address.ip().is_multicast())
            .map(Self)
            .ok_or_else(|| InvalidListen(text.to_owned()))
    }
}

impl fmt::Display for Listen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

serde_as_text!(Listen);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_to_listen_on_has_the_standard_port_unless_it_names_one() {
        let listen = |text: &str| text.parse::<Listen>().map(|listen| listen.to_string());
        assert_eq!(listen("0.0.0.0").unwrap(), "0.0.0.0:3794");
        assert_eq!(listen("10.0.0.5:0").unwrap(), "10.0.0.5:0");
        assert_eq!(listen("[::]:3795").unwrap(), "[::]:3795");
        for wrong in ["", "eth0", "239.255.0.1", "10.0.0.5:70000"] {
            let error = listen(wrong).unwrap_err().to_string();
            assert!(error.contains(&format!("`{wrong}`")), "{error}");
            assert!(error.contains("such as 10.0.0.5"), "{error}");
        }
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_file_may_name_both_or_one_and_nothing_else() {
        let read = |text: &str| toml::from_str::<Tcp>(text).map_err(|error| error.to_string());
        let both =
            read("listen = \"0.0.0.0\"\nconnect = [\"10.0.0.7\", \"102.255.255@10.0.0.8:9\"]");
        let settings = both.unwrap().settings(&Access::default());
        assert_eq!(settings.listen, Some(([0, 0, 0, 0], 3794).into()));
        let expected = [([10, 0, 0, 7], 3794).into(), ([10, 0, 0, 8], 9).into()];
        assert_eq!(settings.connect, expected);
        assert!(!read("").unwrap().is_used());
        assert!(
            read("listne = \"0.0.0.0\"")
                .unwrap_err()
                .contains("unknown field `listne`")
        );
        assert!(read("listen = \"eth0\"").unwrap_err().contains("`eth0`"));
    }
}
