//! Hears the multicast group, without the right to open packet sockets.

use std::future::poll_fn;
use std::task::Poll;

use jaus::link::udp::{Settings, UdpLink};
use jaus::link::{Group, Interfaces, Slab, interface::Ip};
use jaus_cli::failure::Failure;
use jaus_view::udp_packet;

use super::Packet;

/// A passive listener on each interface.
pub(crate) struct Listeners {
    links: Vec<UdpLink>,
    slab: Slab,
}

impl Listeners {
    pub(super) fn open(interfaces: &Interfaces, group: Group) -> Result<Self, Failure> {
        let settings = Settings {
            port: 0,
            group,
            ..Settings::default()
        };
        let chosen = interfaces.choose(Ip::default()).map_err(Failure::of)?;
        let links = chosen
            .iter()
            .map(|interface| UdpLink::open(interface, &settings))
            .collect::<Result<_, _>>()
            .map_err(Failure::of)?;
        Ok(Self {
            links,
            slab: Slab::default(),
        })
    }

    /// Waits for a datagram, and reconstructs its headers.
    pub(super) async fn next(&mut self) -> Vec<Packet> {
        let (links, slab) = (&mut self.links, &mut self.slab);
        let (on, source, datagram) = poll_fn(|cx| {
            for (on, link) in links.iter_mut().enumerate() {
                if let Poll::Ready((source, datagram)) = link.poll_recv(cx, slab) {
                    return Poll::Ready((on, source, datagram));
                }
            }
            Poll::Pending
        })
        .await;
        let link = &self.links[on];
        let octets = link
            .group()
            .and_then(|group| udp_packet(source, group, &datagram));
        let packet = octets.map(|octets| Packet::now(&link.interface().name, octets.into()));
        packet.into_iter().collect()
    }
}
