//! Detects systems of the Reference Architecture, which AS5669A nodes do not discover: their
//! heartbeats go to their own multicast group.

use std::collections::BTreeMap;
use std::net::SocketAddr;

use jaus::link::Group;
use jaus::link::udp::Settings;
use jaus::node::Config;
use jaus::wire::ra::RaId;

use super::finding::Finding;
use super::group::GroupLinks;
use crate::examine::RA_GROUP;

/// Maximum number of subsystems that are named one by one.
const MOST: usize = 12;

/// Systems heard in the group of the Reference Architecture.
pub(super) struct RaSystems {
    /// `None` if multicast is off.
    links: Option<GroupLinks>,
    /// Address of each subsystem.
    heard: BTreeMap<u8, SocketAddr>,
}

impl RaSystems {
    /// Joins the group, unless multicast is off.
    pub(super) fn open(config: &Config) -> Self {
        let settings = Settings {
            group: Group::At(RA_GROUP),
            ..Settings::default()
        };
        let links = match config.group {
            Group::Off => None,
            Group::At(_) => Some(GroupLinks::open(config, &settings)),
        };
        Self {
            links,
            heard: BTreeMap::new(),
        }
    }

    /// Listens until cancelled.
    pub(super) async fn listen(&mut self) {
        let heard = &mut self.heard;
        let Some(links) = &mut self.links else {
            return std::future::pending().await;
        };
        links
            .listen(|from, frame| {
                let of_ra = RaId::in_header(frame.version, frame.source);
                if let Some(id) = of_ra.filter(|_| heard.len() < MOST) {
                    heard.insert(id.subsystem, from);
                }
                true
            })
            .await;
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
