//! The Discovery service: says who we are and what we offer, and finds out the same of others.
//!
//! # What it asks, and when
//!
//! The components of one node share a [`NodeDirectory`]; one of them calls and asks for all. It calls
//! Query Identification (2B00h, subsystem) to everybody when it starts, after one second, after two
//! more, and then every [`Timing::call`]. Whoever answers, calls itself, or is heard in any other way
//! is asked once, directly, for its name (2B00h) and services (2B03h), and one component of each
//! subsystem for the subsystem's name and configuration (2B01h). Components that only stand in a
//! configuration, because they have no Discovery service, are listed on the word of the one that named
//! them, which is asked for the services of up to 128 of them with one query. What was asked is asked
//! again every [`Timing::refresh`], so that services that come and go are noticed; a component whose
//! own services change tells its peers at once.
//!
//! # When a peer is gone
//!
//! A component from which nothing came for one and a half calls, or for [`Timing::longest_silence`],
//! is asked directly, [`Timing::probes`] times; if it stays silent it leaves the tree. With the
//! standard timing and one or two peers that is 8 s + 3 × 1 s, so a death is noticed within 12 s; with
//! more peers it takes 2.25 s longer for each, up to 33 s in all. One that has never answered leaves
//! without being asked; one that could not be asked because too many are silent leaves another 33 s
//! later. A component that was only listed leaves when its subsystem lists it no more, or with the one
//! that listed it.
//!
//! # How much it says
//!
//! At most one packet a second in the long run with up to a dozen peers, answers to peers of its own
//! kind included: the intervals grow with the number of peers that have answered. (Measured: 720
//! packets an hour alone, 1900 with one peer, 3150 with many.) Budgets hold for all questions: 200 a
//! second about newcomers, after a burst, by turns of their network addresses, and 32 a second that
//! were asked before or are probes. Answers to others have a budget too, so that nobody can use us to
//! flood a third party. Times are spread by a jitter from a seed.
//!
//! # How much it keeps
//!
//! Components, their services and the questions about them are limited for each network address, and
//! so are the length of a message and of a component's list of services. What is left out is
//! [counted](Refused) and logged.
//!
//! # What it answers
//!
//! Every query of AS5710, always by unicast to the asker. Asked alone, a component speaks for all
//! that it knows of its subsystem; asked together with others (a wildcard in the destination), it
//! lists only its own services, so that the answers add up without repetitions.

mod answer;
mod known;
mod learn;
mod pace;
mod peers;
mod profile;
mod questions;
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

/// The Discovery service of one component.
#[derive(Debug)]
pub struct Discovery {
    own: JausId,
    profile: Profile,
    known: Arc<NodeDirectory>,
    answers: Budget,
    /// Whether the query in hand was not sent now, but subscribed to before.
    quoted: bool,
    /// Whether this component has learnt something since it was woken, so that there may be something
    /// to ask.
    has_news: bool,
}

/// Something that has become different in the [`Directory`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Change {
    /// The first component of a subsystem has come.
    SubsystemFound(u16),
    /// A component has come. Its name and its services follow.
    Found(JausId),
    /// A subsystem, a node or a component has told its kind and name, or other ones than before.
    Identified(Level, JausId),
    /// A component has told its services, or other ones than before.
    Services(JausId),
    /// A component is gone.
    Lost(JausId, Loss),
    /// The last component of a subsystem is gone.
    SubsystemLost(u16),
}

/// How we know that a component is gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Loss {
    /// It has been silent, also when it was asked directly.
    Silent,
    /// Its subsystem does not list it any more.
    Unlisted,
    /// We knew it only from a component that is gone.
    WithItsReporter,
    /// It was only listed, and the share of its network address was needed for one that speaks.
    NoRoom,
}

impl Discovery {
    /// Answers are limited to a burst of this many …
    const ANSWER_BURST: u32 = 256;
    /// … and then to one in this time.
    const ANSWER_REFILL: std::time::Duration = std::time::Duration::from_millis(10);

    /// The queries whose answers are others when the directory has changed.
    pub(super) const QUERIES: [u16; 5] = [
        QueryIdentification::CODE,
        QueryConfiguration::CODE,
        QuerySubsystemList::CODE,
        QueryServices::CODE,
        QueryServiceList::CODE,
    ];

    /// The longest report that is read, in octets: what 254 components with a dozen services each need.
    const LONGEST_REPORT: usize = 128 * 1024;
    /// The longest query.
    const LONGEST_QUERY: usize = 4096;

    /// The discovery of the component `own`, which presents itself as `profile` says, with a directory
    /// of its own.
    #[must_use]
    pub fn new(own: JausId, profile: Profile, scope: Scope, timing: Timing, seed: u64) -> Self {
        let known = Arc::new(NodeDirectory::new(scope, timing, seed));
        Self::join(known, own, profile)
    }

    /// The discovery of the component `own`, with the directory of its node.
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

    /// Everybody who is known, the own component included.
    #[must_use]
    pub fn directory(&self) -> Arc<Directory> {
        self.known.directory()
    }

    /// What was left out because of the limits.
    #[must_use]
    pub fn refused(&self) -> Refused {
        self.known.lock().refused()
    }

    /// Says what the component offers beside Discovery. Peers are told if it is something else
    /// than before.
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

/// What a [`Stack`](super::Stack) does with it.
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
        let told = (self.own, &self.profile);
        match code_of(&message.payload) {
            Some(QueryIdentification::CODE) => self.answer_identification(now, message, out),
            Some(QueryConfiguration::CODE) => self.answer_configuration(now, message, out),
            Some(QuerySubsystemList::CODE) => self.answer_subsystem_list(now, message, out),
            Some(QueryServices::CODE) => self.answer_services(now, message, out),
            Some(QueryServiceList::CODE) => self.answer_service_list(now, message, out),
            Some(RegisterServices::CODE) => known().learn_registration(now, message),
            Some(ReportIdentification::CODE) => known().learn_identification(now, message, told),
            Some(ReportConfiguration::CODE) => known().learn_configuration(now, message),
            Some(ReportServices::CODE) => known().learn_services(now, message),
            _ => {}
        }
    }

    /// A query that a client has subscribed to: it shows nothing about the client now, and has its
    /// own limits.
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
        if self.has_news || known.is_leader(self.own) {
            self.has_news = false;
            known.handle_timeout(now, out);
        }
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let known = self.known.lock();
        let is_due = self.has_news || known.is_leader(self.own);
        is_due.then(|| known.poll_timeout())?
    }
}
