//! Registration with discovery servers that list only who has registered: fkie's, and those of the
//! JAUS Tool Set.
//!
//! Such a server is a component of our own subsystem that offers Discovery, and whose Report
//! Configuration lacks a component of this node. It gets that component's Register Services, as
//! often as its report lacks it: a server that was restarted has forgotten its clients, and fkie's
//! forgets a client that does not call for a while. Others list whom they have heard, and get none.

use std::collections::BTreeMap;
use std::time::Instant;

use crate::address::JausId;
use crate::codec::Text;
use crate::messages::core::RegisterServices;
use crate::messages::core::register_services::ServiceRec;
use crate::service::ComponentEntry;

/// Limit of servers that a component registers with at a time, however many claim to be servers.
const MOST_SERVERS: usize = 8;

/// The registrations that components of this node have yet to send.
#[derive(Debug, Default)]
pub(super) struct Registrations {
    due: BTreeMap<JausId, Due>,
    count: u64,
}

/// The servers that one component is to register with, and since when.
#[derive(Debug)]
struct Due {
    since: Instant,
    servers: Vec<JausId>,
}

impl Registrations {
    /// Queues the registration of a component with a server.
    pub(super) fn add(&mut self, now: Instant, own: JausId, server: JausId) {
        let (since, servers) = (now, Vec::new());
        let due = self.due.entry(own).or_insert(Due { since, servers });
        if due.servers.len() < MOST_SERVERS {
            due.servers.push(server);
            self.count += 1;
        }
    }

    /// Takes out the servers that a component is to register with now.
    pub(super) fn take(&mut self, own: JausId) -> Vec<JausId> {
        self.due.remove(&own).map_or_else(Vec::new, |it| it.servers)
    }

    /// When a component first had a registration to send.
    pub(super) fn due_since(&self, own: JausId) -> Option<Instant> {
        self.due.get(&own).map(|it| it.since)
    }

    /// The number of registrations ever queued.
    pub(super) fn count(&self) -> u64 {
        self.count
    }
}

/// The registration of a component with all that it offers.
pub(super) fn registration(component: &ComponentEntry) -> RegisterServices {
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
