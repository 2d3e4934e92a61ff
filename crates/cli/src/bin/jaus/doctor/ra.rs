//! Detects systems of the Reference Architecture, which AS5669A nodes do not discover: their
//! heartbeats go to their own multicast group.

use std::collections::BTreeMap;
use std::future::poll_fn;
use std::net::SocketAddr;
use std::task::Poll;

use jaus::link::udp::{Settings, UdpLink};
use jaus::link::{Group, Slab};
use jaus::node::Config;
use jaus::wire::judp;
use jaus::wire::ra::RaId;

use super::finding::Finding;
use crate::examine::RA_GROUP;

/// Maximum number of subsystems that are named one by one.
const MOST: usize = 12;

/// Systems heard in the group of the Reference Architecture.
pub(super) struct RaSystems {
    links: Vec<UdpLink>,
    slab: Slab,
    /// Address of each subsystem.
    heard: BTreeMap<u8, SocketAddr>,
}

impl RaSystems {
    /// Joins the group on each interface of the settings, unless multicast is off; ignores
    /// interfaces where that fails.
    pub(super) fn open(config: &Config) -> Self {
        let settings = Settings {
            port: 0,
            group: Group::At(RA_GROUP),
            ..Settings::default()
        };
        let chosen = match config.group {
            Group::Off => Vec::new(),
            Group::At(_) => config.interfaces.choose(config.ip).unwrap_or_default(),
        };
        let links = chosen.iter();
        Self {
            links: links
                .filter_map(|interface| UdpLink::open(interface, &settings).ok())
                .collect(),
            slab: Slab::default(),
            heard: BTreeMap::new(),
        }
    }

    /// Listens until cancelled.
    pub(super) async fn listen(&mut self) {
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
            for frame in frames.map_while(Result::ok) {
                let of_ra = RaId::in_header(frame.version, frame.source);
                if let Some(id) = of_ra.filter(|_| self.heard.len() < MOST) {
                    self.heard.insert(id.subsystem, from);
                }
            }
        }
    }

    /// The findings.
    pub(super) fn findings(&self) -> impl Iterator<Item = Finding> {
        self.heard.iter().map(|(subsystem, from)| {
            let what = format!(
                "subsystem {subsystem} of the Reference Architecture (OpenJAUS 3.x) is at {from}"
            );
            Finding::ok("neighbours", what).advice(
                "it does not understand AS5669A: connect it through `jaus-ra-gateway` \
                 (docs/ra-gateway.md)",
            )
        })
    }
}
