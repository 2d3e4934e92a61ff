//! Registration with discovery servers that list only who has registered: fkie's, and those of the
//! JAUS Tool Set.
//!
//! Such a server is a component of our own subsystem that offers Discovery, and whose Report
//! Configuration lacks a component of this node. It gets that component's Register Services, as
//! often as its report lacks it: a server that was restarted has forgotten its clients, and fkie's
//! forgets a client that does not call for a while. Others list whom they have heard, and get none.

use std::collections::BTreeSet;
use std::time::Instant;

use super::known::Known;
use super::questions::What;
use crate::address::JausId;
use crate::codec::Text;
use crate::messages::core::register_services::ServiceRec;
use crate::messages::core::{RegisterServices, discovery};
use crate::service::Component;

/// Limit of servers that a component registers with at a time, however many claim to be servers.
const MOST_SERVERS: usize = 8;

/// The servers that a component is to register with, and since when.
#[derive(Debug)]
pub(super) struct Registrations {
    pub(super) since: Instant,
    pub(super) servers: Vec<JausId>,
}

impl Known {
    /// Asks a component whom it lists, if it may be a server of our subsystem.
    pub(super) fn examine_server(&mut self, now: Instant, id: JausId) {
        if let Some(peer) = self.peers.get(id)
            && peer.listed_by.is_none()
            && self.may_serve_us(id)
        {
            self.wonder(now, id, What::Configuration, peer.share);
        }
    }

    /// Whether this is a component of our subsystem that offers Discovery.
    fn may_serve_us(&self, id: JausId) -> bool {
        let component = self.directory.component(id);
        component.is_some_and(|component| component.offers(discovery::URN))
            && self.members().any(|own| own.subsystem() == id.subsystem())
    }

    /// Queues the registrations of the components of this node that a server does not list.
    pub(super) fn register_with(
        &mut self,
        now: Instant,
        server: JausId,
        listed: &BTreeSet<JausId>,
    ) {
        if !self.may_serve_us(server) {
            return;
        }
        let is_missing =
            |own: &JausId| own.subsystem() == server.subsystem() && !listed.contains(own);
        let missing: Vec<_> = self.members().filter(is_missing).collect();
        for own in missing {
            let (since, servers) = (now, Vec::new());
            let waiting = self.registrations.entry(own);
            let waiting = waiting.or_insert(Registrations { since, servers });
            if waiting.servers.len() < MOST_SERVERS {
                waiting.servers.push(server);
                self.registered += 1;
            }
        }
    }
}

/// The registration of a component with all that it offers.
pub(super) fn registration(component: &Component) -> RegisterServices {
    let services = component.offered().map(|offer| ServiceRec {
        uri: Text::from(offer.urn.as_str()),
        major_version_number: offer.major,
        minor_version_number: offer.minor,
    });
    RegisterServices {
        // The count field is one octet.
        service_list: services.take(usize::from(u8::MAX)).collect(),
    }
}
