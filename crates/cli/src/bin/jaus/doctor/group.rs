//! Receives a multicast group beside the node, to learn whose multicasts reach this host.

use std::future::poll_fn;
use std::net::SocketAddr;
use std::task::Poll;

use jaus::link::Slab;
use jaus::link::udp::{Settings, UdpLink};
use jaus::node::Config;
use jaus::wire::{Frame, judp};

/// Sockets that have joined a group on each interface of the settings.
pub(super) struct GroupLinks {
    links: Vec<UdpLink>,
    slab: Slab,
}

impl GroupLinks {
    /// Joins the groups of `settings`; ignores interfaces where that fails. Each link has a port of
    /// its own, to which no node sends.
    pub(super) fn open(config: &Config, settings: &Settings) -> Self {
        let settings = Settings {
            port: 0,
            ..settings.clone()
        };
        let chosen = config.interfaces.choose(config.ip).unwrap_or_default();
        let links = chosen.iter();
        Self {
            links: links
                .filter_map(|interface| UdpLink::open(interface, &settings).ok())
                .collect(),
            slab: Slab::default(),
        }
    }

    /// Passes each message to `note`, with its sender's address, until that returns false.
    pub(super) async fn listen(&mut self, mut note: impl FnMut(SocketAddr, &Frame) -> bool) {
        loop {
            let (links, slab) = (&mut self.links, &mut self.slab);
            let (from, datagram) = poll_fn(|cx| {
                let mut all = links.iter_mut().map(|link| link.poll_recv(cx, slab));
                all.find(Poll::is_ready).unwrap_or(Poll::Pending)
            })
            .await;
            let Ok(frames) = judp::frames(datagram) else {
                continue;
            };
            let mut frames = frames.map_while(Result::ok);
            if !frames.all(|frame| note(from, &frame)) {
                return;
            }
        }
    }
}
