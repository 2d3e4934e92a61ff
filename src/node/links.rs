//! The links of a node: one UDP link per selected interface, even as interfaces come and go, one
//! link for all TCP connections, one for Junior, and one per serial line.
//!
//! A board may start its node before its network is up, and Wi-Fi may return with another address.
//! So on each change the [follower](super::follower) makes a [`Survey`] of the host, without the
//! node's lock, and passes it to the links.

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::time::Instant;

use super::link::Link;
use super::{Config, PeerAddress, StartError};
use crate::endpoint::{LinkId, Path, StaticPeer};
use crate::link::custom::CustomLink;
#[cfg(unix)]
use crate::link::junior::JuniorLink;
#[cfg(feature = "serial")]
use crate::link::serial::SerialLink;
use crate::link::tcp::TcpLink;
use crate::link::udp::UdpLink;
use crate::link::{Available, Error, Interface, Interfaces, interface};

/// The open links of a node.
#[derive(Debug)]
pub(super) struct Links {
    config: Arc<Config>,
    pub(super) open: BTreeMap<LinkId, Link>,
    next: LinkId,
    routes: Routes,
    uses_udp: bool,
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
        // An error means that a peer is unreachable at present. It was not when the node started.
        let route = |&peer| route_to(peer, &config.interfaces, &mut wanted).ok()?;
        let routes = config.peers.iter().filter_map(route).collect();
        Some(Self { wanted, routes })
    }
}

impl Links {
    /// Opens a link on every selected interface, and the links for streams, and adds the custom
    /// links. If one fails, none stays open.
    pub(super) fn open(
        config: &Arc<Config>,
        custom: Vec<Box<dyn CustomLink>>,
    ) -> Result<Self, StartError> {
        let mut links = Self {
            config: config.clone(),
            open: BTreeMap::new(),
            next: LinkId(0),
            routes: Routes::new(),
            uses_udp: config.uses_udp(!custom.is_empty()),
        };
        if links.uses_udp {
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
        for link in custom {
            links.insert(Link::Custom(link));
        }
        Ok(links)
    }

    fn open_udp(&mut self) -> Result<(), StartError> {
        let config = self.config.clone();
        let mut chosen = config.interfaces.choose(config.ip)?;
        for &peer in &config.peers {
            self.routes
                .extend(route_to(peer, &config.interfaces, &mut chosen)?);
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
        self.distribute_peers();
        Ok(())
    }

    pub(super) fn udp(&self) -> impl Iterator<Item = (LinkId, &UdpLink)> {
        self.open.iter().filter_map(|(&id, link)| match link {
            Link::Udp(link) => Some((id, link)),
            _ => None,
        })
    }

    /// The link through Junior, with which each component is registered.
    #[cfg(unix)]
    pub(super) fn junior(&mut self) -> Option<&mut JuniorLink> {
        self.open.values_mut().find_map(|link| match link {
            Link::Junior(link) => Some(link),
            _ => None,
        })
    }

    /// When a link needs a turn if nothing arrives before.
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.open.values().filter_map(Link::poll_timeout).min()
    }

    /// Whether changes of interfaces matter to this node.
    pub(super) fn follows(&self) -> bool {
        self.uses_udp && self.config.interfaces != Interfaces::Loopback
    }

    /// Removes the links whose interfaces are gone. Returns them, and the interfaces without a
    /// link.
    pub(super) fn retire(&mut self, survey: &Survey) -> (Vec<(LinkId, Link)>, Vec<Interface>) {
        let udp = self.udp().map(|(id, link)| (id, link.interface()));
        let gone: Vec<_> = udp
            .filter(|(_, interface)| !survey.wanted.contains(interface))
            .inspect(|(_, interface)| {
                tracing::info!(%interface, "link closed: the interface was removed");
            })
            .map(|(id, _)| id)
            .collect();
        let close = |id| self.open.remove_entry(id);
        let gone = gone.iter().filter_map(close).collect();
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
        let mut links = self.open.iter();
        let tcp = links.find_map(|(&id, link)| matches!(link, Link::Tcp(_)).then_some(id));
        let (by_udp, by_tcp) = (&self.config.peers, &self.config.tcp.connect);
        let by_udp = by_udp
            .iter()
            .map(|peer| (peer, self.link_to(peer.address()), true));
        // Broadcasts go to all connections anyway.
        let by_tcp = by_tcp.iter().map(|peer| (peer, tcp, false));
        let named = |(peer, link, gets_broadcasts): (&PeerAddress, Option<LinkId>, bool)| {
            let (id, link, peer) = (peer.id()?, link?, peer.address().into());
            Some(StaticPeer {
                id,
                path: Path { link, peer },
                gets_broadcasts,
            })
        };
        by_udp.chain(by_tcp).filter_map(named).collect()
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
        let mut placed = BTreeMap::<_, Vec<_>>::new();
        for peer in self.config.peers.iter().filter(|peer| peer.id().is_none()) {
            let address = peer.address();
            let others = placed.entry(self.link_to(address)).or_default();
            others.push(address);
        }
        for (&id, link) in &mut self.open {
            if let Link::Udp(link) = link {
                link.set_peers(placed.remove(&Some(id)).unwrap_or_default());
            }
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

/// A configured peer's address, and the local address on the route to it, if there is one at
/// present. Ensures that its interface is selected.
fn route_to(
    peer: PeerAddress,
    wanted: &Interfaces,
    chosen: &mut Vec<Interface>,
) -> Result<Option<(SocketAddr, IpAddr)>, StartError> {
    let address = peer.address();
    if let Some(near) = chosen.iter().find(|interface| interface.reaches(address)) {
        return Ok(Some((address, near.address)));
    }
    let Some(local) = interface::local_address_for(address) else {
        tracing::debug!(%peer, "no route to the peer");
        return Ok(None);
    };
    if !chosen.iter().any(|interface| interface.address == local) {
        let mut all = interface::list()?.into_iter();
        match all.find(|interface| interface.address == local) {
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
    }
    Ok(Some((address, local)))
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

    fn peer() -> PeerAddress {
        "127.0.0.1:9".parse().unwrap()
    }

    #[test]
    fn a_peer_is_reached_through_the_interface_of_its_network() {
        let mut chosen = vec![
            interface("eth0", [10, 0, 0, 5]),
            interface("lo", [127, 0, 0, 1]),
        ];
        let route = route_to(peer(), &Interfaces::Loopback, &mut chosen).unwrap();
        assert_eq!(chosen.len(), 2);
        assert_eq!(route, Some((peer().address(), [127, 0, 0, 1].into())));
    }

    #[test]
    fn the_interface_that_leads_to_a_peer_is_added_when_all_are_wanted() {
        let mut chosen = vec![interface("eth0", [10, 0, 0, 5])];
        route_to(peer(), &Interfaces::All, &mut chosen).unwrap();
        assert_eq!(chosen[1].address, IpAddr::from([127, 0, 0, 1]));
    }

    #[test]
    fn a_peer_behind_an_interface_that_was_not_chosen_is_an_error_that_names_it() {
        let mut chosen = vec![interface("eth0", [10, 0, 0, 5])];
        let only = Interfaces::Only(vec!["eth0".into()]);
        let error = route_to(peer(), &only, &mut chosen)
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("add `127.0.0.1`") && error.contains("eth0 10.0.0.5"),
            "{error}"
        );
    }
}
