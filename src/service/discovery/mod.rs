//! The Discovery service: announces this component and its services, and finds those of others.
//!
//! # Queries
//!
//! The components of one node share a [`NodeDirectory`]; one of them sends the calls and queries
//! for all. It broadcasts Query Identification (2B00h, subsystem) as a call at start, after one
//! second, after two more, and then every [`Timing::call`]. A component that answers, sends a call
//! itself, or sends any other message is queried once, directly, for its name (2B00h) and services
//! (2B03h). One component of each subsystem, its reporter, is also queried for the subsystem's name
//! and configuration (2B01h). Components without Discovery appear only in a configuration. They are
//! listed on the word of its sender, which is queried for the services of up to 128 of them at once.
//! Queries are repeated every [`Timing::refresh`], to notice services that come and go. A component
//! whose own services change notifies its peers at once.
//!
//! # Loss of a peer
//!
//! A component that was silent for one and a half call intervals, or for
//! [`Timing::longest_silence`], is queried directly, [`Timing::probes`] times. If it stays silent
//! it leaves the directory. With the default timing and one or two peers that is 8 s + 3 × 1 s, so
//! a death is noticed within 12 s. Each further peer adds 2.25 s, up to 33 s in all. A component
//! that has never answered leaves without probes. One that could not be probed because too many are
//! silent leaves another 33 s later. A component that was only listed leaves when its subsystem no
//! longer lists it, or together with the component that listed it.
//!
//! # Registration
//!
//! Some discovery servers list only components that register with them (Register Services, 0B00h):
//! fkie's, and those of the JAUS Tool Set. Each component of our subsystem that offers Discovery is
//! queried for its configuration; if that lacks a component of this node, the component registers.
//!
//! # Network load
//!
//! At most one packet per second in the long run with up to a dozen peers, including answers to
//! peers with the same implementation: the intervals grow with the number of peers that have
//! answered. (Measured: 720 packets per hour alone, 1900 with one peer, 3150 with many.) Budgets
//! limit all queries: 200 per second for newcomers, after a burst, round robin over their network
//! addresses, and 32 per second for repeated queries and probes. Answers to other components have a
//! budget too, so that an attacker cannot use this component to flood a third party. A seeded
//! jitter spreads the packets in time.
//!
//! # Limits
//!
//! Components, their services and the queries about them are limited per network address. So are
//! the length of a message and of a component's list of services. What exceeds a limit is
//! [counted](Refused) and logged.
//!
//! # Answers
//!
//! Every query of AS5710 is answered by unicast to its sender. A query to this component alone is
//! answered for all known components of its subsystem. A query to several components (a wildcard in
//! the destination) is answered with its own services only, so that the answers add up without
//! repetitions.

mod answer;
mod known;
mod learn;
mod pace;
mod peers;
mod profile;
mod questions;
mod register;
mod search;
#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::time::Instant;

use super::{Directory, Handled, Level, Offer, Outbox, code_of};
use crate::address::JausId;
use crate::codec::{Message, ServiceId};
use crate::endpoint::Received;
use crate::messages::core::{
    self, QueryConfiguration, QueryIdentification, QueryServiceList, QueryServices,
    QuerySubsystemList, RegisterServices, ReportConfiguration, ReportIdentification,
    ReportServices,
};
pub use known::{NodeDirectory, Refused};
pub(super) use pace::Budget;
pub use profile::{Profile, Scope, Timing};
use register::registration;

/// The Discovery service of one component.
#[derive(Debug)]
pub struct Discovery {
    own: JausId,
    profile: Profile,
    known: Arc<NodeDirectory>,
    answers: Budget,
    /// Whether the current query comes from a subscription rather than from a message just
    /// received.
    quoted: bool,
    /// Whether this component has learnt something since it was last woken, so that queries may be
    /// due.
    has_news: bool,
}

/// A change of the [`Directory`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Change {
    /// The first component of a subsystem was found.
    SubsystemFound(u16),
    /// A component was found. Its name and its services follow.
    Found(JausId),
    /// The kind or name of a subsystem, a node or a component is known, or has changed.
    Identified(Level, JausId),
    /// The services of a component are known, or have changed.
    Services(JausId),
    /// A component is gone.
    Lost(JausId, Loss),
    /// The last component of a subsystem is gone.
    SubsystemLost(u16),
}

/// How the loss of a component was detected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Loss {
    /// It stayed silent, even when probed.
    Silent,
    /// Its subsystem no longer lists it.
    Unlisted,
    /// It was known only from a component that is gone.
    WithItsReporter,
    /// It was only listed, and its entry was needed for a component at the same network address
    /// that sends messages itself.
    NoRoom,
}

impl Discovery {
    /// Answers are limited to a burst of this many …
    const ANSWER_BURST: u32 = 256;
    /// … and then to one in this interval.
    const ANSWER_REFILL: std::time::Duration = std::time::Duration::from_millis(10);

    /// The queries whose answers change with the directory.
    pub(super) const QUERIES: [u16; 5] = [
        QueryIdentification::CODE,
        QueryConfiguration::CODE,
        QuerySubsystemList::CODE,
        QueryServices::CODE,
        QueryServiceList::CODE,
    ];

    /// The longest accepted report in octets: enough for 254 components with a dozen services each.
    const LONGEST_REPORT: usize = 128 * 1024;
    /// The longest accepted query in octets.
    const LONGEST_QUERY: usize = 4096;

    /// The discovery of the component `own`, presented as in `profile`, with its own directory.
    #[must_use]
    pub fn new(own: JausId, profile: Profile, scope: Scope, timing: Timing, seed: u64) -> Self {
        let known = Arc::new(NodeDirectory::new(scope, timing, seed));
        Self::join(known, own, profile)
    }

    /// The discovery of the component `own`, with the shared directory of its node.
    #[must_use]
    pub fn join(known: Arc<NodeDirectory>, own: JausId, profile: Profile) -> Self {
        known.lock().join(own, &profile);
        Self {
            own,
            profile,
            known,
            answers: Budget::new(Self::ANSWER_BURST, Self::ANSWER_REFILL),
            quoted: false,
            has_news: false,
        }
    }

    /// The own id.
    #[must_use]
    pub const fn id(&self) -> JausId {
        self.own
    }

    /// All known components, including the own one.
    #[must_use]
    pub fn directory(&self) -> Arc<Directory> {
        self.known.directory()
    }

    /// What was refused because of the limits.
    #[must_use]
    pub fn refused(&self) -> Refused {
        self.known.lock().refused()
    }

    /// Sets the services of the component other than Discovery. Peers are notified of a change.
    pub fn set_offers(&mut self, others: impl IntoIterator<Item = ServiceId>, out: &mut Outbox) {
        let offers = others.into_iter().chain(self.offers()).map(Offer::from);
        let offers = offers.collect();
        let mut known = self.known.lock();
        let own = known.directory.component(self.own);
        let begun = own.is_some_and(|own| own.services.is_some());
        if !known.tree().set_services(self.own, offers) {
            return;
        }
        known.tell(Change::Services(self.own));
        if begun {
            answer::tell_services(&known.directory, self.own, known.peers.speakers(), out);
        } else {
            known.skip(self.own);
        }
    }

    /// The next change of the directory.
    pub fn poll_change(&mut self) -> Option<Change> {
        self.known.lock().poll_change(self.own)
    }
}

/// The interface for a [`Stack`](super::Stack).
impl Discovery {
    pub(super) fn offers(&self) -> Vec<ServiceId> {
        vec![core::discovery::V1_1, core::discovery::V1_0]
    }

    /// Any message is a sign of life.
    pub(super) fn hear(&mut self, now: Instant, message: &Received) {
        self.known.lock().hear(now, message);
        self.has_news = true;
    }

    pub(super) fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        out: &mut Outbox,
    ) -> Handled {
        let longest = match code_of(&message.payload) {
            Some(
                QueryIdentification::CODE
                | QueryConfiguration::CODE
                | QuerySubsystemList::CODE
                | QueryServices::CODE
                | QueryServiceList::CODE,
            ) => Self::LONGEST_QUERY,
            Some(
                RegisterServices::CODE
                | ReportIdentification::CODE
                | ReportConfiguration::CODE
                | ReportServices::CODE,
            ) => Self::LONGEST_REPORT,
            _ => return Handled::No,
        };
        if message.payload.len() > longest {
            self.known.lock().refuse(now, |it| &mut it.too_long);
        } else {
            self.take(now, message, out);
        }
        Handled::Yes
    }

    fn take(&mut self, now: Instant, message: &Received, out: &mut Outbox) {
        let known = || self.known.lock();
        let own = (self.own, &self.profile);
        match code_of(&message.payload) {
            Some(QueryIdentification::CODE) => self.answer_identification(now, message, out),
            Some(QueryConfiguration::CODE) => self.answer_configuration(now, message, out),
            Some(QuerySubsystemList::CODE) => self.answer_subsystem_list(now, message, out),
            Some(QueryServices::CODE) => self.answer_services(now, message, out),
            Some(QueryServiceList::CODE) => self.answer_service_list(now, message, out),
            Some(RegisterServices::CODE) => known().learn_registration(now, message),
            Some(ReportIdentification::CODE) => known().learn_identification(now, message, own),
            Some(ReportConfiguration::CODE) => known().learn_configuration(now, message),
            Some(ReportServices::CODE) => known().learn_services(now, message),
            _ => {}
        }
    }

    /// Handles a query of a subscription. It is no sign of life of the client, and has limits of
    /// its own.
    pub(super) fn handle_quoted(
        &mut self,
        now: Instant,
        query: &Received,
        out: &mut Outbox,
    ) -> Handled {
        self.quoted = true;
        let handled = self.handle_message(now, query, out);
        self.quoted = false;
        handled
    }

    pub(super) fn handle_timeout(&mut self, now: Instant, out: &mut Outbox) {
        let mut known = self.known.lock();
        for server in known.registrations.take(self.own) {
            if let Some(own) = known.directory.component(self.own) {
                out.send(server, &registration(own));
            }
        }
        if self.has_news || known.is_leader(self.own) {
            self.has_news = false;
            known.handle_timeout(now, out);
        }
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let known = self.known.lock();
        let is_due = self.has_news || known.is_leader(self.own);
        let searches = is_due.then(|| known.poll_timeout()).flatten();
        let registers = known.registrations.due_since(self.own);
        registers.into_iter().chain(searches).min()
    }
}
