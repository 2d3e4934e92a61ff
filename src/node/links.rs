//! The links of a node: one UDP link per selected interface, even as interfaces come and go, one
//! link for all TCP connections, one for Junior, and one per serial line.
//!
//! A board may start its node before its network is up, and Wi-Fi may return with another address.
//! So on each change a [`Follower`](super::follower::Follower) makes a [`Survey`] of the host,
//! without the node's lock, and passes it to the links.

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::time::Instant;

use super::link::Link;
use super::{Config, Peer, StartError};
use crate::address::JausId;
use crate::endpoint::{LinkId, Path, StaticPeer};
#[cfg(unix)]
use crate::link::junior::{Claim, JuniorLink};
#[cfg(feature = "serial")]
use crate::link::serial::SerialLink;
use crate::link::tcp::TcpLink;
use crate::link::udp::UdpLink;
use crate::link::{Available, Error, Interface, Interfaces, interface};

/// The open links of a node.
#[derive(Debug)]
pub(super) struct Links {
    config: Config,
    open: BTreeMap<LinkId, Link>,
    next: LinkId,
    routes: Routes,
}

/// The local address on the route to each configured peer.
type Routes = BTreeMap<SocketAddr, IpAddr>;

/// The UDP links that a node needs for the host's interfaces and routes. Making it takes system
/// calls, using it does not.
#[derive(Debug)]
pub(super) struct Survey {
    wanted: Vec<Interface>,
    routes: Routes,
}

impl Survey {
    /// Surveys the host; `None` if it does not list its interfaces.
    pub(super) fn make(config: &Config) -> Option<Self> {
        let available = interface::list().ok()?;
        let mut wanted = config.interfaces.present(&available, config.ip);
        for &peer in &config.peers {
            // Unreachable at present. It was reachable when the node started.
            let _ = lead_to(peer, &config.interfaces, &mut wanted);
        }
        let routes = routes(config, &wanted);
        Some(Self { wanted, routes })
    }
}

impl Links {
    /// Opens a link on every selected interface, and the links for streams. If one fails, none
    /// stays open.
    pub(super) fn open(config: &Config) -> Result<Self, StartError> {
        let mut links = Self {
            config: config.clone(),
            open: BTreeMap::new(),
            next: LinkId(0),
            routes: Routes::new(),
        };
        if config.uses_udp() {
            links.open_udp()?;
        }
        #[cfg(unix)]
        if let Some(folder) = &config.junior {
            links.insert(Link::Junior(JuniorLink::open(folder)?));
        }
        if config.tcp.is_used() {
            let link = TcpLink::open(&config.tcp.settings(&config.access))?;
            links.insert(Link::Tcp(link));
        }
        #[cfg(feature = "serial")]
        for line in &config.serial {
            let link = SerialLink::open(line)?;
            links.insert(Link::Serial(link));
        }
        Ok(links)
    }

    fn open_udp(&mut self) -> Result<(), StartError> {
        let config = self.config.clone();
        let mut chosen = config.interfaces.choose(config.ip)?;
        for &peer in &config.peers {
            lead_to(peer, &config.interfaces, &mut chosen)?;
        }
        let udp = config.udp();
        let deaf = chosen.iter().all(|interface| udp.is_deaf_on(interface));
        // The network of a board that has just booted may still come up.
        let alone = chosen.iter().all(Interface::is_loopback);
        let waits = alone && config.interfaces == Interfaces::All;
        if deaf && !waits && config.peers.is_empty() && !config.has_streams() {
            return Err(Error::NoMulticast(Available(chosen)).into());
        }
        for interface in &chosen {
            self.insert(Link::Udp(UdpLink::open(interface, &udp)?));
        }
        self.routes = routes(&config, &chosen);
        self.distribute_peers();
        Ok(())
    }

    pub(super) fn get_mut(&mut self, link: LinkId) -> Option<&mut Link> {
        self.open.get_mut(&link)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (LinkId, &Link)> {
        self.open.iter().map(|(&id, link)| (id, link))
    }

    pub(super) fn udp(&self) -> impl Iterator<Item = (LinkId, &UdpLink)> {
        self.iter().filter_map(|(id, link)| Some((id, link.udp()?)))
    }

    pub(super) fn tcp(&self) -> Option<(LinkId, &TcpLink)> {
        self.iter().find_map(|(id, link)| Some((id, link.tcp()?)))
    }

    #[cfg(unix)]
    pub(super) fn junior(&self) -> Option<(LinkId, &JuniorLink)> {
        self.iter()
            .find_map(|(id, link)| Some((id, link.junior()?)))
    }

    /// Registers a component with Junior's node manager.
    #[cfg(unix)]
    pub(super) fn admit(&mut self, claim: Claim) {
        for link in self.open.values_mut() {
            if let Link::Junior(link) = link {
                return link.admit(claim);
            }
        }
    }

    /// Notes that a component is gone.
    pub(super) fn release(&mut self, id: JausId) {
        for link in self.open.values_mut() {
            link.release(id);
        }
    }

    #[cfg(feature = "serial")]
    pub(super) fn serial(&self) -> impl Iterator<Item = (LinkId, &SerialLink)> {
        self.iter()
            .filter_map(|(id, link)| Some((id, link.serial()?)))
    }

    /// When a link needs a turn if nothing arrives before.
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.open.values().filter_map(Link::poll_timeout).min()
    }

    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = (LinkId, &mut Link)> {
        self.open.iter_mut().map(|(&id, link)| (id, link))
    }

    pub(super) fn close(&mut self) {
        self.open.clear();
    }

    /// Whether changes of interfaces matter to this node.
    pub(super) fn follows(&self) -> bool {
        self.config.uses_udp() && self.config.interfaces != Interfaces::Loopback
    }

    /// Removes the links whose interfaces are gone. Returns them, and the interfaces without a
    /// link.
    pub(super) fn retire(&mut self, survey: &Survey) -> (Vec<(LinkId, UdpLink)>, Vec<Interface>) {
        let is_gone = |link: &UdpLink| !survey.wanted.contains(link.interface());
        let ids: Vec<_> = self
            .udp()
            .filter_map(|(id, link)| is_gone(link).then_some(id))
            .collect();
        let mut gone = Vec::new();
        for id in ids {
            if let Some(Link::Udp(link)) = self.open.remove(&id) {
                tracing::info!(interface = %link.interface(), "link closed: the interface was \
                    removed");
                gone.push((id, link));
            }
        }
        let has_link =
            |interface: &&Interface| !self.udp().any(|(_, link)| link.interface() == *interface);
        let came = survey.wanted.iter().filter(has_link).cloned().collect();
        (gone, came)
    }

    /// Adds links, and assigns each configured peer to a link again.
    pub(super) fn adopt(&mut self, links: Vec<UdpLink>, survey: Survey) {
        for link in links {
            self.insert(Link::Udp(link));
        }
        self.routes = survey.routes;
        self.distribute_peers();
    }

    /// The routes to peers with a configured id.
    pub(super) fn static_peers(&self) -> Vec<StaticPeer> {
        let named = |&peer: &Peer| {
            let path = Path {
                link: self.link_to(peer.address())?,
                peer: peer.address().into(),
            };
            Some(StaticPeer {
                id: peer.id()?,
                path,
                gets_broadcasts: true,
            })
        };
        let behind_connection = |&peer: &Peer| {
            let path = Path {
                link: self.tcp()?.0,
                peer: peer.address().into(),
            };
            // Broadcasts go to all connections anyway.
            Some(StaticPeer {
                id: peer.id()?,
                path,
                gets_broadcasts: false,
            })
        };
        let config = &self.config;
        let by_udp = config.peers.iter().filter_map(named);
        let by_tcp = config.tcp.connect.iter().filter_map(behind_connection);
        by_udp.chain(by_tcp).collect()
    }

    fn insert(&mut self, link: Link) {
        while self.open.contains_key(&self.next) {
            self.next = LinkId(self.next.0.wrapping_add(1));
        }
        self.open.insert(self.next, link);
        self.next = LinkId(self.next.0.wrapping_add(1));
    }

    /// Assigns the peers without an id to the links that reach them.
    fn distribute_peers(&mut self) {
        let nameless = self.config.peers.iter().filter(|peer| peer.id().is_none());
        let placed: Vec<_> = nameless
            .filter_map(|peer| Some((self.link_to(peer.address())?, peer.address())))
            .collect();
        for (&id, link) in &mut self.open {
            let Link::Udp(link) = link else {
                continue;
            };
            link.set_peers(
                placed
                    .iter()
                    .filter(|(at, _)| *at == id)
                    .map(|(_, a)| *a)
                    .collect(),
            );
        }
    }

    /// The link that leads to a configured peer; any link if there is no route at present.
    fn link_to(&self, peer: SocketAddr) -> Option<LinkId> {
        let local = self.routes.get(&peer);
        let leads = |link: &UdpLink| Some(&link.interface().address) == local;
        let link = self
            .udp()
            .find(|(_, link)| leads(link))
            .or_else(|| self.udp().next());
        link.map(|(id, _)| id)
    }
}

/// The local address on the route to each configured peer.
fn routes(config: &Config, interfaces: &[Interface]) -> Routes {
    let route = |peer: &Peer| {
        let address = peer.address();
        Some((address, way_to(address, interfaces.iter())?))
    };
    config.peers.iter().filter_map(route).collect()
}

/// The local address on the route to a peer: that of the interface on its network, or else the one
/// that the operating system selects.
fn way_to<'a>(
    peer: SocketAddr,
    mut interfaces: impl Iterator<Item = &'a Interface>,
) -> Option<IpAddr> {
    let near = |i: &&Interface| i.reaches(peer);
    let near = interfaces.find(near).map(|interface| interface.address);
    near.or_else(|| interface::local_address_for(peer))
}

/// Ensures that an interface on the route to the peer is selected.
fn lead_to(peer: Peer, wanted: &Interfaces, chosen: &mut Vec<Interface>) -> Result<(), StartError> {
    let Some(local) = way_to(peer.address(), chosen.iter()) else {
        tracing::debug!(%peer, "no route to the peer");
        return Ok(());
    };
    if chosen.iter().any(|interface| interface.address == local) {
        return Ok(());
    }
    let through = interface::list()?
        .into_iter()
        .find(|interface| interface.address == local);
    match through {
        Some(interface) if *wanted == Interfaces::All => chosen.push(interface),
        _ => {
            let chosen = Available(chosen.clone());
            return Err(StartError::PeerOutOfReach {
                peer,
                local,
                chosen,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interface(name: &str, address: [u8; 4]) -> Interface {
        Interface {
            name: name.into(),
            index: 1,
            address: address.into(),
            prefix: 32,
            up: true,
            multicast: true,
            broadcast: None,
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
        lead_to(peer(), &Interfaces::Loopback, &mut chosen).unwrap();
        assert_eq!(chosen.len(), 2);
        assert_eq!(
            way_to(peer().address(), chosen.iter()),
            Some([127, 0, 0, 1].into())
        );
    }

    #[test]
    fn the_interface_that_leads_to_a_peer_is_added_when_all_are_wanted() {
        let mut chosen = vec![interface("eth0", [10, 0, 0, 5])];
        lead_to(peer(), &Interfaces::All, &mut chosen).unwrap();
        assert_eq!(chosen[1].address, IpAddr::from([127, 0, 0, 1]));
    }

    #[test]
    fn a_peer_behind_an_interface_that_was_not_chosen_is_an_error_that_names_it() {
        let mut chosen = vec![interface("eth0", [10, 0, 0, 5])];
        let only = Interfaces::Only(vec!["eth0".into()]);
        let error = lead_to(peer(), &only, &mut chosen).unwrap_err().to_string();
        assert!(
            error.contains("add `127.0.0.1`") && error.contains("eth0 10.0.0.5"),
            "{error}"
        );
    }
}
