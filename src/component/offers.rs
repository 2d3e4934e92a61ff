//! Whether a peer can answer a query, judging by the services that it offers.

use std::collections::BTreeSet;

use crate::codec::{Registry, ServiceInfo};
use crate::service::ComponentEntry;

/// The services that receive a message, if the component offers none of them: not even one that
/// inherits from them. Empty if that is not known for certain.
pub(super) fn missing_for(
    registry: &Registry,
    peer: &ComponentEntry,
    code: u16,
) -> Vec<&'static str> {
    let receives = |urn: &str| {
        let of_this_urn = |info: &&ServiceInfo| info.id.urn == urn;
        let mut heard = registry.services().filter(of_this_urn).peekable();
        // An unknown service may inherit from any.
        heard.peek().is_none() || heard.any(|info| inherits_input(registry, info, code))
    };
    if peer.services.is_none() || peer.offered().any(|offer| receives(&offer.urn)) {
        return Vec::new();
    }
    let declare = |info: &&ServiceInfo| info.inputs.contains(&code);
    let urns: BTreeSet<_> = registry
        .services()
        .filter(declare)
        .map(|it| it.id.urn)
        .collect();
    urns.into_iter().collect()
}

fn inherits_input(registry: &Registry, info: &ServiceInfo, code: u16) -> bool {
    info.inputs.contains(&code)
        || info.inherits_from.is_some_and(|parent| {
            let mut services = registry.services();
            let parent = services.find(|it| it.id == parent);
            parent.is_some_and(|parent| inherits_input(registry, parent, code))
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::address::JausId;
    use crate::codec::Message;
    use crate::messages::core::{QueryStatus, discovery, management};
    use crate::messages::mobility::primitive_driver;
    use crate::messages::registry;
    use crate::service::Offer;

    fn peer(offers: Option<&[&str]>) -> ComponentEntry {
        let offer = |urn: &&str| Offer {
            urn: (*urn).to_owned(),
            major: 1,
            minor: 0,
        };
        ComponentEntry {
            id: JausId::new(101, 1, 33),
            identification: None,
            services: offers.map(|urns| urns.iter().map(offer).collect()),
        }
    }

    #[test]
    fn a_query_is_missing_only_if_no_offered_service_can_have_inherited_it() {
        let own = "urn:example:arm";
        for (offers, missing) in [
            (Some(&[discovery::URN][..]), true),
            (Some(&[]), true),
            (Some(&[management::URN]), false),
            (Some(&[discovery::URN, primitive_driver::URN]), false),
            (Some(&[discovery::URN, own]), false),
            (None, false),
        ] {
            let expected: &[&str] = if missing { &[management::URN] } else { &[] };
            let found = missing_for(&registry(), &peer(offers), QueryStatus::CODE);
            assert_eq!(found, expected, "{offers:?}");
        }
    }

    #[test]
    fn a_message_of_no_known_service_is_not_missing() {
        let peer = peer(Some(&[discovery::URN]));
        assert!(missing_for(&registry(), &peer, 0xD3FF).is_empty());
    }
}
