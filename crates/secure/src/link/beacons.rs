//! The sockets of beacons: one link to the beacons' group on each interface.

use std::net::SocketAddr;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::link::udp::{self, Broadcasts, UdpLink};
use jaus::link::{Error, Group, Interface, Interfaces, Ip, Slab, interface};
use jaus::wire::Priority;

use crate::beacon::{Announcer, Counters, GROUP, GROUP6, Neighbors, Sighting};
use crate::credentials::Credentials;

/// Datagrams to read before the link's sessions have their turn.
const BATCH: usize = 16;
/// The receive buffer of a socket, in octets: some hundred beacons.
const RECEIVE_BUFFER: usize = 64 << 10;

/// Where a node announces itself by beacons, and under which id.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Announce {
    /// The interfaces to send beacons on, and to receive them from.
    pub interfaces: Interfaces,
    /// The id of the node; its component does not matter.
    pub node: JausId,
}

/// Sends and receives beacons.
#[derive(Debug)]
pub(super) struct Beacons {
    announcer: Announcer,
    neighbors: Neighbors,
    /// The id that it announces.
    node: JausId,
    credentials: Credentials,
    /// The edition of the key that signs the beacons.
    key: u64,
    interfaces: Interfaces,
    /// The address of the secure link; beacons are sent only where peers can reach it.
    link: SocketAddr,
    links: Vec<UdpLink>,
    slab: Slab,
}

impl Beacons {
    /// For the secure link that listens at this address.
    pub(super) fn open(
        credentials: Credentials,
        link: SocketAddr,
        announce: Announce,
    ) -> Result<Self, Error> {
        let mut interfaces = announce.interfaces;
        if interfaces == Interfaces::All && !link.ip().is_unspecified() {
            interfaces = Interfaces::Only(vec![link.ip().to_string()]);
        }
        if interfaces != Interfaces::All {
            interfaces.choose(ip_version(link))?;
        }
        let mut beacons = Self {
            announcer: Announcer::new(&credentials.own_key(), announce.node, link.port()),
            neighbors: Neighbors::new(credentials.public(), credentials.trust()),
            node: announce.node,
            key: credentials.own_edition(),
            credentials,
            interfaces,
            link,
            links: Vec::new(),
            slab: Slab::default(),
        };
        beacons.follow_interfaces();
        Ok(beacons)
    }

    /// Its counters.
    pub(super) const fn counters(&self) -> &Counters {
        self.neighbors.counters()
    }

    /// When beacons are due.
    pub(super) fn due(&self, now: Instant) -> Instant {
        self.announcer.due().unwrap_or(now)
    }

    /// Sends the beacons that are due. They are few, so what the kernel has no room for is dropped
    /// with the next ones.
    pub(super) fn send(&mut self, now: Instant, time_of_day: Duration) {
        if !self.announcer.is_due(now) {
            return;
        }
        self.follow_key();
        self.follow_interfaces();
        let addresses = self.links.iter().map(|link| link.interface().address);
        let beacons = self.announcer.announce(now, time_of_day, addresses);
        for (link, beacon) in self.links.iter_mut().zip(beacons) {
            if let Some(beacon) = beacon {
                link.send_to_group(Priority::Standard, &beacon);
            }
        }
    }

    /// Signs with the present key of the node.
    fn follow_key(&mut self) {
        let edition = self.credentials.own_edition();
        if edition != self.key {
            self.key = edition;
            let key = self.credentials.own_key();
            self.announcer = Announcer::new(&key, self.node, self.link.port());
        }
    }

    /// Reads what the kernel has received. Returns the nodes that it shows, and whether there may be
    /// more.
    pub(super) fn read(&mut self, cx: &mut Context<'_>, now: Instant) -> (Vec<Sighting>, bool) {
        let mut sightings = Vec::new();
        let mut may_be_more = false;
        for link in &mut self.links {
            let mut datagrams =
                (0..BATCH).map_while(|_| match link.poll_recv(cx, &mut self.slab) {
                    Poll::Ready(arrived) => Some(arrived),
                    Poll::Pending => None,
                });
            let mut count = 0;
            for (from, datagram) in datagrams.by_ref() {
                count += 1;
                sightings.extend(self.neighbors.handle(now, from, &datagram));
            }
            may_be_more |= count == BATCH;
        }
        (sightings, may_be_more)
    }

    /// Opens links on interfaces that have appeared, and closes those of interfaces that are gone.
    fn follow_interfaces(&mut self) {
        let present = match interface::list() {
            Ok(all) => self.interfaces.present(&all, ip_version(self.link)),
            Err(error) => return tracing::debug!(%error, "beacons: interfaces"),
        };
        let is_wanted = |it: &Interface| {
            let listens = self.link.ip().is_unspecified() || self.link.ip() == it.address;
            it.multicast && listens
        };
        let wanted: Vec<_> = present.into_iter().filter(is_wanted).collect();
        self.links.retain(|link| wanted.contains(link.interface()));
        for interface in &wanted {
            if self.links.iter().any(|link| link.interface() == interface) {
                continue;
            }
            match UdpLink::open(interface, &settings()) {
                Ok(link) => self.links.push(link),
                // Tried again with the next beacon.
                Err(error) => tracing::debug!(%interface, %error, "no beacons on this interface"),
            }
        }
    }
}

/// Beacons are sent over the IP version of the link that they announce.
const fn ip_version(link: SocketAddr) -> Ip {
    match link {
        SocketAddr::V4(_) => Ip::V4,
        SocketAddr::V6(_) => Ip::V6,
    }
}

/// They do not leave the network: their TTL is 1.
fn settings() -> udp::Settings {
    udp::Settings {
        port: 0,
        group: Group::At(GROUP),
        group6: Group::At(GROUP6),
        broadcast: Broadcasts::Off,
        ttl: 1,
        receive_buffer: RECEIVE_BUFFER,
        batch: false,
        ..udp::Settings::default()
    }
}
