//! Configured peers: an address and, if known, an id.

use std::fmt;
use std::net::SocketAddr;
use std::str::FromStr;

use super::ConfigError;
use crate::address::JausId;
use crate::as_text::serde_as_text;
use crate::link::Place;

/// A peer to send to by unicast from the start: `10.0.0.2`, which means port 3794, `10.0.0.2:3795`,
/// `[fe80::2%eth0]:3794`, or with its id in front `102.1.1@10.0.0.2`. With an id (which may have the
/// wildcards 65535 and 255), messages for it go there before it has sent any, and its address is
/// never learned again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PeerAddress {
    id: Option<JausId>,
    place: Place,
}

impl PeerAddress {
    /// The id, or pattern of ids, at this address, if known.
    #[must_use]
    pub const fn id(self) -> Option<JausId> {
        self.id
    }

    /// The address and port. With an interface (`%eth0`) it is valid as long as that interface
    /// exists.
    #[must_use]
    pub fn address(self) -> SocketAddr {
        self.place.address()
    }
}

impl FromStr for PeerAddress {
    type Err = ConfigError;

    fn from_str(text: &str) -> Result<Self, ConfigError> {
        let named = text.split_once('@');
        let (id, place) = named.map_or((None, text), |(id, place)| (Some(id), place));
        let id = id
            .map(str::parse)
            .transpose()
            .map_err(ConfigError::PeerId)?;
        let place = place.parse().ok();
        let place = place.filter(|place: &Place| !place.lacks_zone());
        let place = place.ok_or_else(|| ConfigError::Peer(text.to_owned()))?;
        Ok(Self { id, place })
    }
}

impl fmt::Display for PeerAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(id) = self.id {
            write!(f, "{id}@")?;
        }
        self.place.fmt(f)
    }
}

serde_as_text!(PeerAddress);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peer_is_an_address_with_or_without_port_and_id() {
        assert_eq!(
            "10.0.0.2".parse::<PeerAddress>().unwrap().to_string(),
            "10.0.0.2:3794"
        );
        assert_eq!(
            "10.0.0.2:9".parse::<PeerAddress>().unwrap().to_string(),
            "10.0.0.2:9"
        );
        let named: PeerAddress = "101.255.255@10.0.0.2".parse().unwrap();
        assert_eq!(named.to_string(), "101.255.255@10.0.0.2:3794");
        assert_eq!(named.id(), Some(JausId::new(101, 255, 255)));
        assert!(
            "101.1@10.0.0.2"
                .parse::<PeerAddress>()
                .unwrap_err()
                .to_string()
                .contains("\"101.1\"")
        );
        for wrong in [
            "",
            "ten",
            "10.0.0.2:0",
            "239.255.0.1",
            "0.0.0.0",
            "10.0.0.2:70000",
        ] {
            let error = wrong.parse::<PeerAddress>().unwrap_err().to_string();
            assert!(error.contains(&format!("`{wrong}`")), "{error}");
        }
    }
}
