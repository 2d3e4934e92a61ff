//! Opening the links of a node: which interfaces, and which peer is reached through which.

use std::net::IpAddr;

use super::{Config, Peer, StartError};
use crate::endpoint::{LinkId, Path, StaticPeer};
use crate::link::udp::UdpLink;
use crate::link::{Available, Error, Group, Interface, Interfaces, interface};

/// The links of a node, numbered by their place, and the peers that have an id.
#[derive(Debug)]
pub(super) struct Links {
    pub(super) links: Vec<UdpLink>,
    pub(super) static_peers: Vec<StaticPeer>,
}

/// Opens a link on every chosen interface. Nothing stays open if one fails.
pub(super) fn open(config: &Config) -> Result<Links, StartError> {
    let mut interfaces = config.interfaces.choose()?;
    let mut placed = Vec::with_capacity(config.peers.len());
    for &peer in &config.peers {
        let may_add = config.interfaces == Interfaces::All;
        placed.push((place(peer, &mut interfaces, may_add)?, peer));
    }
    let deaf = !interfaces.iter().any(|interface| interface.multicast);
    if config.group != Group::Off && deaf && config.peers.is_empty() {
        return Err(Error::NoMulticast(Available(interfaces)).into());
    }
    let mut links = Vec::with_capacity(interfaces.len());
    for (i, interface) in interfaces.iter().enumerate() {
        let nameless = |&&(place, peer): &&(usize, Peer)| place == i && peer.id().is_none();
        let mut settings = config.udp();
        settings.peers = placed
            .iter()
            .filter(nameless)
            .map(|(_, peer)| peer.address())
            .collect();
        links.push(UdpLink::open(interface, &settings)?);
    }
    let static_peers = placed
        .iter()
        .filter_map(|&(place, peer)| named(place, peer))
        .collect();
    Ok(Links {
        links,
        static_peers,
    })
}

/// The number of the link at this place. There are never as many interfaces as numbers.
pub(super) fn link_id(place: usize) -> LinkId {
    LinkId(u16::try_from(place).unwrap_or(u16::MAX))
}

fn named(place: usize, peer: Peer) -> Option<StaticPeer> {
    let path = Path {
        link: link_id(place),
        peer: peer.address(),
    };
    Some(StaticPeer {
        id: peer.id()?,
        path,
        gets_broadcasts: true,
    })
}

/// Which of the interfaces leads to a peer: the one whose network it is in, else the one that
/// the operating system would use.
fn place(peer: Peer, chosen: &mut Vec<Interface>, may_add: bool) -> Result<usize, StartError> {
    let ip = peer.address().ip();
    let near = |i: &Interface| matches!(ip, IpAddr::V4(v4) if i.reaches(v4));
    if let Some(place) = chosen.iter().position(near) {
        return Ok(place);
    }
    let Some(local) = interface::local_address_for(peer.address()) else {
        tracing::warn!(%peer, "no route there just now; sending to it through the first link");
        return Ok(0);
    };
    if let Some(place) = chosen.iter().position(|i| i.address == local) {
        return Ok(place);
    }
    let through = interface::list()?.into_iter().find(|i| i.address == local);
    match through {
        Some(interface) if may_add => {
            chosen.push(interface);
            Ok(chosen.len() - 1)
        }
        _ => {
            let chosen = Available(chosen.clone());
            Err(StartError::PeerOutOfReach {
                peer,
                local,
                chosen,
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interface(name: &str, address: [u8; 4]) -> Interface {
        Interface {
            name: name.into(),
            index: 1,
            address: address.into(),
            netmask: [255, 255, 255, 255].into(),
            up: true,
            multicast: true,
        }
    }

    fn peer() -> Peer {
        "127.0.0.1:9".parse().unwrap()
    }

    #[test]
    fn a_peer_is_reached_through_the_interface_of_its_network() {
        let mut chosen = vec![
            interface("eth0", [10, 0, 0, 5]),
            interface("lo", [127, 0, 0, 1]),
        ];
        assert_eq!(place(peer(), &mut chosen, false).unwrap(), 1);
    }

    #[test]
    fn the_interface_that_leads_to_a_peer_is_added_when_all_are_wanted() {
        let mut chosen = vec![interface("eth0", [10, 0, 0, 5])];
        assert_eq!(place(peer(), &mut chosen, true).unwrap(), 1);
        assert_eq!(chosen[1].address.octets(), [127, 0, 0, 1]);
    }

    #[test]
    fn a_peer_behind_an_interface_that_was_not_chosen_is_an_error_that_names_it() {
        let mut chosen = vec![interface("eth0", [10, 0, 0, 5])];
        let error = place(peer(), &mut chosen, false).unwrap_err().to_string();
        assert!(
            error.contains("add `127.0.0.1`") && error.contains("eth0 10.0.0.5"),
            "{error}"
        );
    }
}
