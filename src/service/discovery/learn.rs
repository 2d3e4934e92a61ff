//! What others say about themselves and their subsystem, and what it changes in the directory.

use std::collections::BTreeSet;
use std::collections::btree_map::Entry;
use std::time::Instant;

use super::search::Question;
use super::{Change, Discovery, Loss};
use crate::address::JausId;
use crate::codec::Text;
use crate::endpoint::Received;
use crate::messages::core::{
    RegisterServices, ReportConfiguration, ReportIdentification, ReportServices,
};
use crate::service::{Identification, Kind, Level, Offer, read};

impl Discovery {
    /// Any message is a sign of life, and a stranger's is a reason to ask who it is.
    pub(in crate::service) fn hear(&mut self, now: Instant, source: JausId) {
        if self.search.covers(self.own, source) && !self.search.hear(now, source) {
            self.search
                .wonder(now, Question::Identify(source, Level::Component));
        }
    }

    /// Takes a component into the tree, and wonders what there is to know about it. Says whether
    /// it is in the tree then.
    pub(super) fn admit(&mut self, now: Instant, id: JausId, listed_by: Option<JausId>) -> bool {
        if !self.search.covers(self.own, id) {
            return false;
        }
        let was_listed = self.search.is_listed(id);
        let Some(new) = self.search.admit(now, id, listed_by) else {
            return false;
        };
        if new {
            self.welcome(now, id, listed_by.is_none());
        } else if was_listed && listed_by.is_none() {
            // Only now is there somebody to ask.
            self.ask_who_it_is(now, id);
        }
        if listed_by.is_none() {
            self.appoint(now, id);
        }
        true
    }

    fn welcome(&mut self, now: Instant, id: JausId, direct: bool) {
        if self.directory.subsystem(id.subsystem()).is_none() {
            self.changes
                .push_back(Change::SubsystemFound(id.subsystem()));
        }
        self.directory.insert(id);
        self.changes.push_back(Change::Found(id));
        self.search.wonder(now, Question::Services(id));
        if direct {
            self.ask_who_it_is(now, id);
        }
    }

    fn ask_who_it_is(&mut self, now: Instant, id: JausId) {
        for level in [Level::Subsystem, Level::Node, Level::Component] {
            if self.directory.identification(level, id).is_none() {
                self.search.wonder(now, Question::Identify(id, level));
            }
        }
    }

    /// Makes a component the one that is asked for its subsystem's configuration, if there is
    /// none yet.
    fn appoint(&mut self, now: Instant, id: JausId) {
        if let Entry::Vacant(vacant) = self.search.reporters.entry(id.subsystem()) {
            vacant.insert(id);
            self.search.wonder(now, Question::Configuration(id));
        }
    }

    /// Takes a component out of the tree, and those with it that it had listed.
    pub(super) fn lose(&mut self, now: Instant, id: JausId, loss: Loss) {
        self.search.forget(id);
        self.directory.remove(id);
        self.changes.push_back(Change::Lost(id, loss));
        let orphans: Vec<_> = self.listed_by(id).collect();
        for orphan in orphans {
            self.lose(now, orphan, Loss::WithItsReporter);
        }
        let subsystem = id.subsystem();
        let successor = self.search.peers.iter().find_map(|(&other, peer)| {
            (other.subsystem() == subsystem && peer.listed_by.is_none()).then_some(other)
        });
        if let Some(successor) = successor {
            self.appoint(now, successor);
        }
        if loss != Loss::WithItsReporter && self.directory.subsystem(subsystem).is_none() {
            self.changes.push_back(Change::SubsystemLost(subsystem));
        }
    }

    fn listed_by(&self, reporter: JausId) -> impl Iterator<Item = JausId> {
        let peers = self.search.peers.iter();
        peers
            .filter(move |(_, peer)| peer.listed_by == Some(reporter))
            .map(|(&id, _)| id)
    }

    pub(super) fn learn_identification(&mut self, now: Instant, received: &Received) {
        let Some(report) = read::<ReportIdentification>(received) else {
            return;
        };
        let source = received.source;
        if !self.admit(now, source, None) {
            return;
        }
        let level = match report.query_type.0 {
            2 => Level::Subsystem,
            3 => Level::Node,
            4 => Level::Component,
            _ => return,
        };
        self.search.settle(Question::Identify(source, level));
        let reporter = self.search.reporters.get(&source.subsystem());
        if level == Level::Subsystem && reporter != Some(&source) {
            // Every component answers a call. Should they disagree, one has the say.
            return;
        }
        if self.knows_better(level, source) {
            return;
        }
        let told = Identification {
            kind: Kind::from_code(report.r#type.0),
            name: text(&report.identification),
        };
        let known = self.directory.identification(level, source).is_some();
        if self.directory.identify(level, source, told) {
            self.changes.push_back(Change::Identified(level, source));
            if known {
                self.doubt(now, source);
            }
        }
    }

    /// Whether we have told others ourselves what is called how, namely our own subsystem or node.
    /// A component that joins them may have another idea, or be a tool that passes by.
    fn knows_better(&self, level: Level, source: JausId) -> bool {
        let same_subsystem = source.subsystem() == self.own.subsystem();
        let ours = match level {
            Level::Subsystem => same_subsystem,
            Level::Node => same_subsystem && source.node() == self.own.node(),
            Level::Component => false,
        };
        ours && !self.profile.identification(level).name.is_empty()
    }

    /// Asks a component anew who it is and what it offers: another program may have taken its id.
    fn doubt(&mut self, now: Instant, id: JausId) {
        self.search.wonder(now, Question::Services(id));
        for level in [Level::Node, Level::Component] {
            self.search.wonder(now, Question::Identify(id, level));
        }
    }

    pub(super) fn learn_configuration(&mut self, now: Instant, received: &Received) {
        let Some(report) = read::<ReportConfiguration>(received) else {
            return;
        };
        let source = received.source;
        if !self.admit(now, source, None) {
            return;
        }
        let mut listed = BTreeSet::new();
        for node in &report.node_list {
            for component in &node.component_list {
                let (node, component) = (node.node_rec.node_id, component.component_id);
                listed.insert(JausId::new(source.subsystem(), node, component));
            }
        }
        for &id in &listed {
            if id != source {
                self.admit(now, id, Some(source));
            }
        }
        // Only what we asked for is known to be the whole subsystem.
        if self.search.settle(Question::Configuration(source)) {
            let gone: Vec<_> = self
                .listed_by(source)
                .filter(|id| !listed.contains(id))
                .collect();
            for id in gone {
                self.lose(now, id, Loss::Unlisted);
            }
        }
    }

    pub(super) fn learn_services(&mut self, now: Instant, received: &Received) {
        let Some(report) = read::<ReportServices>(received) else {
            return;
        };
        let source = received.source;
        if !self.admit(now, source, None) {
            return;
        }
        for node in report.node_list {
            for component in node.component_list {
                let (node, number) = (node.node_rec.node_id, component.component_rec.component_id);
                let id = JausId::new(source.subsystem(), node, number);
                let services = component.service_list.into_iter().map(|service| Offer {
                    urn: text(&service.uri),
                    major: service.major_version_number,
                    minor: service.minor_version_number,
                });
                if id == source || self.admit(now, id, Some(source)) {
                    self.set_services(id, services.collect());
                }
            }
        }
    }

    pub(super) fn learn_registration(&mut self, now: Instant, received: &Received) {
        let Some(registration) = read::<RegisterServices>(received) else {
            return;
        };
        if self.admit(now, received.source, None) {
            let services = registration.service_list.into_iter().map(|service| Offer {
                urn: text(&service.uri),
                major: service.major_version_number,
                minor: service.minor_version_number,
            });
            self.set_services(received.source, services.collect());
        }
    }

    fn set_services(&mut self, id: JausId, services: Vec<Offer>) {
        self.search.settle(Question::Services(id));
        if self.directory.set_services(id, services) {
            self.changes.push_back(Change::Services(id));
        }
    }
}

fn text(text: &Text) -> String {
    text.to_string_lossy().into_owned()
}
