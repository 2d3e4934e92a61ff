//! One open link of a node, of any kind.

use std::net::SocketAddr;
use std::task::{Context, Poll};
use std::time::Instant;

use super::components::Components;
use crate::endpoint::{Endpoint, Ingress, LinkId, LinkProfile, Path, Remote, Transmit};
use crate::link::Slab;
use crate::link::custom::{self, CustomLink};
#[cfg(unix)]
use crate::link::junior::JuniorLink;
#[cfg(feature = "serial")]
use crate::link::serial::{self, SerialLink};
use crate::link::tcp::{Arrival, TcpLink};
use crate::link::udp::UdpLink;
use crate::wire::Framing;

/// Limit of datagrams from one link before the others have their turn.
const BATCH: usize = 64;

#[derive(Debug)]
pub(super) enum Link {
    Udp(UdpLink),
    #[cfg(unix)]
    Junior(JuniorLink),
    Tcp(TcpLink),
    #[cfg(feature = "serial")]
    Serial(SerialLink),
    Custom(Box<dyn CustomLink>),
}

impl Link {
    /// The profile for the endpoint; `own` are the source addresses of all UDP links.
    pub(super) fn profile(&self, own: impl IntoIterator<Item = SocketAddr>) -> LinkProfile {
        match self {
            Self::Udp(link) => LinkProfile {
                max_segments: link.max_segments(),
                ..LinkProfile::judp(own)
            },
            #[cfg(unix)]
            Self::Junior(_) => LinkProfile {
                reads_one: true,
                ..LinkProfile::judp([])
            },
            Self::Custom(link) => LinkProfile {
                bridged: link.bridged(),
                ..LinkProfile::default()
            },
            _ => LinkProfile {
                framing: self.framing(),
                ..LinkProfile::default()
            },
        }
    }

    /// Its message framing.
    pub(super) const fn framing(&self) -> Framing {
        match self {
            Self::Tcp(_) => Framing::Jtcp,
            #[cfg(feature = "serial")]
            Self::Serial(_) => Framing::Jserial,
            _ => Framing::Judp,
        }
    }

    /// Its display name: the interface or device, `tcp` or `junior`.
    pub(super) fn name(&self) -> String {
        match self {
            Self::Udp(link) => link.interface().name.clone(),
            #[cfg(unix)]
            Self::Junior(_) => "junior".to_owned(),
            Self::Tcp(_) => "tcp".to_owned(),
            #[cfg(feature = "serial")]
            Self::Serial(link) => link.settings().device.clone(),
            Self::Custom(link) => link.name().to_owned(),
        }
    }

    /// Queues a datagram from the endpoint. Call [`send_waiting`](Self::send_waiting) after the
    /// last one.
    pub(super) fn transmit(&mut self, transmit: &Transmit) {
        match self {
            Self::Udp(link) => link.transmit(transmit),
            #[cfg(unix)]
            Self::Junior(link) => link.transmit(transmit),
            Self::Tcp(link) => link.transmit(transmit),
            #[cfg(feature = "serial")]
            Self::Serial(link) => link.transmit(transmit),
            Self::Custom(link) => link.transmit(transmit),
        }
    }

    /// Sends what would gain nothing by waiting for the driver's turn, which sends the rest.
    pub(super) fn send_waiting(&mut self) {
        if let Self::Udp(link) = self {
            link.flush();
        }
    }

    /// Sends what waits for the network; ready when nothing is left.
    pub(super) fn poll_flush(&mut self, cx: &mut Context<'_>, now: Instant) -> Poll<()> {
        match self {
            Self::Udp(link) => link.poll_flush(cx),
            #[cfg(unix)]
            Self::Junior(link) => link.poll_flush(cx),
            Self::Tcp(link) => link.poll_flush(cx, now),
            #[cfg(feature = "serial")]
            Self::Serial(link) => link.poll_flush(cx),
            Self::Custom(link) => link.poll_flush(cx, now),
        }
    }

    /// Notifies the other ends of the shutdown, where the protocol can.
    pub(super) fn hang_up(&mut self) -> Poll<()> {
        match self {
            #[cfg(unix)]
            Self::Junior(link) => link.hang_up(),
            Self::Tcp(link) => link.hang_up(),
            Self::Custom(link) => link.hang_up(),
            _ => Poll::Ready(()),
        }
    }

    /// When the link needs a turn if nothing arrives before.
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        match self {
            Self::Udp(_) => None,
            #[cfg(unix)]
            Self::Junior(link) => link.poll_timeout(),
            Self::Tcp(link) => link.poll_timeout(),
            #[cfg(feature = "serial")]
            Self::Serial(link) => link.poll_timeout(),
            Self::Custom(link) => link.poll_timeout(),
        }
    }

    /// Passes received data to the endpoint and the taps; returns whether there was more than the
    /// link's share.
    pub(super) fn receive(
        &mut self,
        cx: &mut Context<'_>,
        now: Instant,
        id: LinkId,
        slab: &mut Slab,
        (endpoint, components): (&mut Endpoint, &mut Components),
    ) -> bool {
        let from = |peer| Path { link: id, peer };
        match self {
            Self::Udp(link) => {
                for _ in 0..BATCH {
                    let Poll::Ready((peer, datagram)) = link.poll_recv(cx, slab) else {
                        return false;
                    };
                    let path = from(Remote::Socket(peer));
                    components.taps.datagram(path, &datagram);
                    let to_all = link.went_to_all();
                    endpoint.handle_datagram(now, Ingress { path, to_all }, datagram, components);
                }
                true
            }
            #[cfg(unix)]
            Self::Junior(link) => link.receive(cx, now, slab, |datagram| {
                let path = from(Remote::Line);
                components.taps.datagram(path, &datagram);
                endpoint.handle_datagram(now, path, datagram, components);
            }),
            Self::Tcp(link) => link.receive(cx, now, |arrival| match arrival {
                Arrival::Frame {
                    remote,
                    frame,
                    version_again,
                } => {
                    let path = from(Remote::Socket(remote));
                    components.taps.frame(path, &frame);
                    // First, because it decides how this frame is answered.
                    if version_again {
                        endpoint.handle_repeated_version(frame.source);
                    }
                    endpoint.handle_frame(now, path, &frame, components);
                }
                Arrival::Closed(peer, _) => endpoint.forget_path(from(Remote::Socket(peer))),
            }),
            #[cfg(feature = "serial")]
            Self::Serial(link) => link.receive(cx, now, |arrival| match arrival {
                serial::Arrival::Frame(frame) => {
                    components.taps.frame(from(Remote::Line), &frame);
                    endpoint.handle_frame(now, from(Remote::Line), &frame, components);
                }
                serial::Arrival::Lost => endpoint.forget_path(from(Remote::Line)),
            }),
            Self::Custom(link) => {
                for _ in 0..BATCH {
                    let Poll::Ready(arrival) = link.poll_receive(cx, now) else {
                        return false;
                    };
                    match arrival {
                        custom::Arrival::Datagram { session, octets } => {
                            let path = from(Remote::Session(session));
                            components.taps.datagram(path, &octets);
                            endpoint.handle_datagram(now, path, octets, components);
                        }
                        custom::Arrival::Closed(session) => {
                            endpoint.forget_path(from(Remote::Session(session)));
                        }
                        custom::Arrival::Speaks(ids) => endpoint.reserve(id, ids),
                    }
                }
                true
            }
        }
    }
}
