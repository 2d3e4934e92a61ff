//! The Discovery service: says who we are and what we offer, and finds out the same of others.
//!
//! # What it asks, and when
//!
//! A component calls Query Identification (2B00h, subsystem) to everybody when it starts, after
//! one second, after two more, and then every [`Timing::call`]. Whoever answers, calls itself, or
//! is heard in any other way is asked once, directly, for its names (2B00h) and services (2B03h),
//! and one component of each subsystem for the subsystem's configuration (2B01h). Components
//! that only stand in a configuration, because they have no Discovery service, are listed on the
//! word of the one that named them. What was asked is asked again every [`Timing::refresh`], so
//! that services that come and go are noticed; a component whose own services change tells its
//! peers at once.
//!
//! # When a peer is gone
//!
//! A component from which nothing came for one and a half calls is asked directly,
//! [`Timing::probes`] times; if it stays silent it leaves the tree. With the standard timing and
//! one or two peers that is 8 s + 3 × 1 s, so a death is noticed within 12 s; with more peers it
//! takes 2.25 s longer for each. A component that was only listed leaves when its subsystem lists
//! it no more, or with the one that listed it.
//!
//! # How much it says
//!
//! At most one packet a second in the long run, answers to peers of its own kind included: the
//! intervals grow with the number of peers, and a budget holds for all questions. (Measured: 720
//! packets an hour alone, 1900 with one peer, 3150 with many.) Answers to others have a budget
//! too, so that nobody can use us to flood a third party. Times are spread by a jitter from a
//! seed.
//!
//! # What it answers
//!
//! Every query of AS5710, always by unicast to the asker. Asked alone, a component speaks for all
//! that it knows of its subsystem; asked together with others (a wildcard in the destination), it
//! lists only its own services, so that the answers add up without repetitions.

mod answer;
mod learn;
mod pace;
mod profile;
mod search;

use std::collections::VecDeque;
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
pub(super) use pace::Budget;
pub use profile::{Profile, Scope, Timing};
use search::Search;

/// The Discovery service of one component.
#[derive(Debug)]
pub struct Discovery {
    own: JausId,
    profile: Profile,
    directory: Directory,
    search: Search,
    answers: Budget,
    /// Whether the query in hand was not sent now, but subscribed to before.
    quoted: bool,
    changes: VecDeque<Change>,
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

    /// The discovery of the component `own`, which presents itself as `profile` says.
    #[must_use]
    pub fn new(own: JausId, profile: Profile, scope: Scope, timing: Timing, seed: u64) -> Self {
        let mut directory = Directory::default();
        directory.insert(own);
        for level in [Level::Subsystem, Level::Node, Level::Component] {
            directory.identify(level, own, profile.identification(level));
        }
        Self {
            own,
            profile,
            directory,
            search: Search::new(scope, timing, seed),
            answers: Budget::new(Self::ANSWER_BURST, Self::ANSWER_REFILL),
            quoted: false,
            changes: VecDeque::new(),
        }
    }

    /// The own id.
    #[must_use]
    pub const fn id(&self) -> JausId {
        self.own
    }

    /// Everybody who is known, the own component included.
    #[must_use]
    pub const fn directory(&self) -> &Directory {
        &self.directory
    }

    /// Says what the component offers beside Discovery. Peers are told if it is something else
    /// than before.
    pub fn set_offers(&mut self, others: impl IntoIterator<Item = ServiceId>, out: &mut Outbox) {
        let offers = others.into_iter().chain(self.offers()).map(Offer::from);
        let own = self.directory.component(self.own);
        let begun = own.is_some_and(|own| own.services.is_some());
        if self.directory.set_services(self.own, offers.collect()) && begun {
            self.changes.push_back(Change::Services(self.own));
            self.tell_services(out);
        }
    }

    /// The next change of the directory.
    pub fn poll_change(&mut self) -> Option<Change> {
        self.changes.pop_front()
    }
}

/// What a [`Stack`](super::Stack) does with it.
impl Discovery {
    pub(super) fn offers(&self) -> Vec<ServiceId> {
        vec![core::discovery::V1_1, core::discovery::V1_0]
    }

    pub(super) fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        out: &mut Outbox,
    ) -> Handled {
        match code_of(&message.payload) {
            Some(QueryIdentification::CODE) => self.answer_identification(now, message, out),
            Some(QueryConfiguration::CODE) => self.answer_configuration(now, message, out),
            Some(QuerySubsystemList::CODE) => self.answer_subsystem_list(now, message, out),
            Some(QueryServices::CODE) => self.answer_services(now, message, out),
            Some(QueryServiceList::CODE) => self.answer_service_list(now, message, out),
            Some(RegisterServices::CODE) => self.learn_registration(now, message),
            Some(ReportIdentification::CODE) => self.learn_identification(now, message),
            Some(ReportConfiguration::CODE) => self.learn_configuration(now, message),
            Some(ReportServices::CODE) => self.learn_services(now, message),
            _ => return Handled::No,
        }
        Handled::Yes
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
        self.call(now, out);
        self.drop_the_silent(now, out);
        self.refresh(now);
        self.search.ask_due(now, out);
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.search.poll_timeout()
    }
}
