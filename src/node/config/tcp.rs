//! The `[tcp]` section: connections to and from other nodes.

#[cfg(feature = "serde")]
use std::net::IpAddr;
use std::net::SocketAddr;

#[cfg(feature = "serde")]
use super::ConfigError;
use super::PeerAddress;
use crate::endpoint::Access;
#[cfg(feature = "serde")]
use crate::link::STANDARD_PORT;
use crate::link::tcp;

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
    /// The address to accept connections at; none if omitted. In a file the port may be omitted;
    /// it is 3794 then.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "read_listen"))]
    pub listen: Option<SocketAddr>,
    /// Peers to connect to. With an id (or a pattern of ids) in front, messages for it go there
    /// before it has sent any.
    pub connect: Vec<PeerAddress>,
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
            listen: self.listen,
            connect: self.connect.iter().map(|peer| peer.address()).collect(),
            max_accepted: self.max_accepted,
            max_per_address: self.max_per_address,
            access: access.clone(),
        }
    }
}

/// Deserializes the address to listen on; the default port is 3794.
#[cfg(feature = "serde")]
fn read_listen<'de, D: serde::Deserializer<'de>>(d: D) -> Result<Option<SocketAddr>, D::Error> {
    let Some(text) = <Option<String> as serde::Deserialize>::deserialize(d)? else {
        return Ok(None);
    };
    let standard = |ip: IpAddr| SocketAddr::new(ip, STANDARD_PORT);
    let address = text.parse().or_else(|_| text.parse().map(standard)).ok();
    let address = address.filter(|address| !address.ip().is_multicast());
    let wrong = || serde::de::Error::custom(ConfigError::Listen(text));
    address.map(Some).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "serde")]
    #[test]
    fn an_address_to_listen_on_has_the_standard_port_unless_it_names_one() {
        let listen = |text: &str| {
            let tcp = toml::from_str::<Tcp>(&format!("listen = \"{text}\""));
            tcp.map(|tcp| tcp.listen.unwrap().to_string())
        };
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
