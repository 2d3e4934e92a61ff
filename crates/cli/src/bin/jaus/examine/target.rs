//! Parses the target of an examination: an id, an address, or both.

use std::fmt;
use std::net::SocketAddr;
use std::str::FromStr;

use jaus::address::JausId;
use jaus::node;

/// `77.1.1`, `10.0.0.2`, `10.0.0.2:3795` or `77.1.1@10.0.0.2:3795`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Target {
    /// Its id, if given.
    pub(super) id: Option<JausId>,
    place: Option<node::PeerAddress>,
}

impl Target {
    /// Its address, if given. The default port is 3794.
    pub(super) fn address(&self) -> Option<SocketAddr> {
        self.place.map(node::PeerAddress::address)
    }
}

impl FromStr for Target {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const FORMS: &str = "write an id (77.1.1), an address (10.0.0.2), an address with its \
                             port (10.0.0.2:3795), or both (77.1.1@10.0.0.2)";
        if let Ok(id) = text.parse() {
            return of_one(id).map(|id| Self {
                id: Some(id),
                place: None,
            });
        }
        let place: node::PeerAddress = text
            .parse()
            .map_err(|_| format!("\"{text}\" is neither an id nor an address: {FORMS}"))?;
        Ok(Self {
            id: place.id().map(of_one).transpose()?,
            place: Some(place),
        })
    }
}

/// Requires the id of a single component.
fn of_one(id: JausId) -> Result<JausId, String> {
    if id.is_unicast() {
        return Ok(id);
    }
    Err(format!(
        "{id} is not a single component: run `jaus discover` and name one that it lists, or the \
         address of its host"
    ))
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.id, self.place) {
            (Some(id), None) => id.fmt(f),
            (_, Some(place)) => place.fmt(f),
            (None, None) => f.write_str("nobody"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peer_is_named_by_id_by_address_or_by_both() {
        for (text, full) in [
            ("77.1.1", "77.1.1"),
            ("10.0.0.2", "10.0.0.2:3794"),
            ("10.0.0.2:3795", "10.0.0.2:3795"),
            ("77.1.1@10.0.0.2", "77.1.1@10.0.0.2:3794"),
            ("fd00::2", "[fd00::2]:3794"),
        ] {
            assert_eq!(text.parse::<Target>().unwrap().to_string(), full);
        }
        let both: Target = "77.1.1@10.0.0.2:9".parse().unwrap();
        assert_eq!(both.id, Some(JausId::new(77, 1, 1)));
        assert_eq!(both.address(), "10.0.0.2:9".parse().ok());
    }

    #[test]
    fn what_is_neither_is_refused_with_what_would_be() {
        let why = |text: &str| text.parse::<Target>().unwrap_err();
        assert_eq!(
            why("rover"),
            "\"rover\" is neither an id nor an address: write an id (77.1.1), an address \
             (10.0.0.2), an address with its port (10.0.0.2:3795), or both (77.1.1@10.0.0.2)"
        );
        for many in ["77.1.255", "65535.255.255", "77.255.255@10.0.0.2"] {
            assert!(why(many).contains("is not a single component"), "{many}");
        }
        for wrong in ["77.1", "10.0.0.300", "10.0.0.2:0", "239.255.0.1", ""] {
            assert!(
                why(wrong).contains("neither an id nor an address"),
                "{wrong}"
            );
        }
    }
}
