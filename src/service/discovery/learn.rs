//! Reports from other components about themselves and their subsystem, and the resulting changes of
//! the directory.

use std::collections::BTreeSet;
use std::collections::btree_map::Entry;
use std::time::Instant;

use super::known::Known;
use super::peers::ShareExhausted;
use super::questions::{Question, What};
use super::{Change, Loss, Profile};
use crate::address::JausId;
use crate::codec::Text;
use crate::endpoint::Received;
use crate::messages::core::{
    RegisterServices, ReportConfiguration, ReportIdentification, ReportServices, discovery,
};
use crate::service::share::Share;
use crate::service::{Identification, Kind, Level, Offer, read};

/// Limit of services of a component, counting each version …
const MOST_SERVICES: usize = 128;
/// … and of the octets of their names together.
const MOST_URN_OCTETS: usize = 6 * 1024;
/// Memory of a service without its name, in octets.
const OFFER_OCTETS: usize = size_of::<Offer>() + 16;

impl Known {
    /// Notes a sign of life. A message from an unknown component triggers a query for its name.
    pub(super) fn hear(&mut self, now: Instant, received: &Received) {
        let source = received.source;
        if self.covers(source) && !self.peers.hear(now, source) {
            let what = What::Name(Level::Component);
            self.wonder(now, source, what, Share::of(received));
        }
    }

    /// Adds the sender of a discovery message to the tree if there is room. Returns whether it is
    /// in the tree.
    pub(super) fn admit(&mut self, now: Instant, received: &Received) -> bool {
        self.admit_as(now, received.source, None, Share::of(received))
    }

    /// Adds a component to the tree, and queues the queries about it. Returns whether it is in the
    /// tree.
    fn admit_as(
        &mut self,
        now: Instant,
        id: JausId,
        listed_by: Option<JausId>,
        share: Share,
    ) -> bool {
        if !self.covers(id) {
            return false;
        }
        let look = now + self.timing.patience(self.peers.confirmed());
        match self.peers.get(id).map(|peer| peer.listed_by) {
            None => return self.take_in(now, id, (listed_by, share), look),
            Some(known) if listed_by.is_none() => {
                self.peers.hear(now, id);
                self.appoint(now, id, share);
                if known.is_some() {
                    // Only now can it be queried itself.
                    self.peers.speak(look, id);
                    self.ask_who_it_is(now, id, share);
                }
            }
            Some(_) => self.peers.list(now, id),
        }
        true
    }

    fn take_in(
        &mut self,
        now: Instant,
        id: JausId,
        (listed_by, share): (Option<JausId>, Share),
        look: Instant,
    ) -> bool {
        match self.peers.room(share, listed_by.is_none()) {
            Ok(None) => {}
            Ok(Some(weaker)) => {
                self.refuse(now, |refused| &mut refused.no_room);
                self.lose(now, weaker, Loss::NoRoom);
            }
            Err(ShareExhausted) => {
                self.refuse(now, |refused| &mut refused.no_room);
                return false;
            }
        }
        let interval = match listed_by {
            Some(_) => self.timing.longest_silence,
            None => self.timing.refresh_interval(self.peers.confirmed() + 1),
        };
        let refresh = now + self.jitter.around(interval);
        self.peers
            .insert(now, id, (listed_by, share), (look, refresh));
        if self.directory.subsystem(id.subsystem()).is_none() {
            self.tell(Change::SubsystemFound(id.subsystem()));
        }
        self.tree().insert(id);
        self.tell(Change::Found(id));
        self.wonder(now, id, What::Services, share);
        if listed_by.is_none() {
            self.appoint(now, id, share);
            self.ask_who_it_is(now, id, share);
        }
        true
    }

    /// Queries a component for missing names: that of its subsystem if it is the reporter, and that
    /// of its node if no other component is being queried for it.
    pub(super) fn ask_who_it_is(&mut self, now: Instant, id: JausId, share: Share) {
        let has_the_say = self.reporters.get(&id.subsystem()) == Some(&id);
        for level in [Level::Subsystem, Level::Node, Level::Component] {
            let what = What::Name(level);
            let is_its_turn = match level {
                Level::Subsystem => has_the_say,
                Level::Node => !self.questions.is_open(what, self.peers.of_node(id)),
                Level::Component => true,
            };
            if is_its_turn && self.directory.identification(level, id).is_none() {
                self.wonder(now, id, what, share);
            }
        }
    }

    /// Makes a component the reporter of its subsystem if there is none.
    fn appoint(&mut self, now: Instant, id: JausId, share: Share) {
        if let Entry::Vacant(vacant) = self.reporters.entry(id.subsystem()) {
            vacant.insert(id);
            self.wonder(now, id, What::Configuration, share);
        }
    }

    /// Removes a component from the tree, together with the components that it had listed.
    pub(super) fn lose(&mut self, now: Instant, id: JausId, loss: Loss) {
        let subsystem = id.subsystem();
        let orphans: Vec<_> = self.peers.listed_by(id).collect();
        self.drop_peer(id, loss);
        for orphan in orphans {
            self.drop_peer(orphan, Loss::WithItsReporter);
        }
        if self.reporters.get(&subsystem) == Some(&id) {
            self.reporters.remove(&subsystem);
        }
        let successor = self.peers.speaker_of(subsystem);
        let successor = successor.and_then(|id| Some((id, self.peers.get(id)?.share)));
        if let Some((successor, share)) = successor {
            self.appoint(now, successor, share);
        }
        if self.directory.subsystem(subsystem).is_none() {
            self.tell(Change::SubsystemLost(subsystem));
        }
    }

    fn drop_peer(&mut self, id: JausId, loss: Loss) {
        self.peers.remove(id);
        self.questions.forget(id);
        self.tree().remove(id);
        self.tell(Change::Lost(id, loss));
    }

    /// Removes an answered query; returns whether it had been sent.
    fn settle(&mut self, about: JausId, what: What) -> bool {
        let asked = self.questions.settle(Question { about, what });
        if asked {
            self.peers.confirm(about);
        }
        asked
    }

    pub(super) fn learn_identification(
        &mut self,
        now: Instant,
        received: &Received,
        (own, profile): (JausId, &Profile),
    ) {
        let Some(report) = read::<ReportIdentification>(received) else {
            return;
        };
        let source = received.source;
        if !self.admit(now, received) {
            return;
        }
        let level = match report.query_type.0 {
            2 => Level::Subsystem,
            3 => Level::Node,
            4 => Level::Component,
            _ => return,
        };
        self.settle(source, What::Name(level));
        let reporter = self.reporters.get(&source.subsystem());
        if level == Level::Subsystem && reporter != Some(&source) {
            // Every component answers a call. If the answers differ, only the reporter's counts.
            return;
        }
        if knows_better(level, source, own, profile) {
            return;
        }
        let identification = Identification {
            kind: Kind::from_code(report.r#type.0),
            name: text(&report.identification),
        };
        let known = self.directory.identification(level, source);
        if known == Some(&identification) {
            return;
        }
        let is_known = known.is_some();
        if is_known && !self.peers.may_change(now, source) {
            return self.refuse(now, |refused| &mut refused.too_often);
        }
        if self.tree().identify(level, source, identification) {
            self.tell(Change::Identified(level, source));
            if is_known {
                self.doubt(now, source, Share::of(received));
            }
        }
    }

    /// Queries the names and services of a component again: another program may have taken its id.
    fn doubt(&mut self, now: Instant, id: JausId, share: Share) {
        let names = [Level::Node, Level::Component].map(What::Name);
        for what in [What::Services].into_iter().chain(names) {
            self.wonder(now, id, what, share);
        }
    }

    pub(super) fn learn_configuration(&mut self, now: Instant, received: &Received) {
        let Some(report) = read::<ReportConfiguration>(received) else {
            return;
        };
        let source = received.source;
        if !self.admit(now, received) {
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
                self.admit_as(now, id, Some(source), Share::of(received));
            }
        }
        // Only the answer to a query is known to cover the whole subsystem.
        if self.settle(source, What::Configuration) {
            let known = self.peers.listed_by(source);
            let gone: Vec<_> = known.filter(|id| !listed.contains(id)).collect();
            for id in gone {
                self.lose(now, id, Loss::Unlisted);
            }
            self.register_with(now, source, &listed);
        }
    }

    pub(super) fn learn_services(&mut self, now: Instant, received: &Received) {
        let Some(report) = read::<ReportServices>(received) else {
            return;
        };
        let source = received.source;
        if !self.admit(now, received) {
            return;
        }
        for node in report.node_list {
            for component in node.component_list {
                let (node, number) = (node.node_rec.node_id, component.component_rec.component_id);
                let id = JausId::new(source.subsystem(), node, number);
                let services = component.service_list.iter().map(|it| {
                    let version = (it.major_version_number, it.minor_version_number);
                    (&it.uri, version)
                });
                if id == source || self.admit_as(now, id, Some(source), Share::of(received)) {
                    self.set_services(now, id, services);
                }
            }
        }
    }

    pub(super) fn learn_registration(&mut self, now: Instant, received: &Received) {
        let Some(registration) = read::<RegisterServices>(received) else {
            return;
        };
        if self.admit(now, received) {
            let services = registration.service_list.iter().map(|it| {
                let version = (it.major_version_number, it.minor_version_number);
                (&it.uri, version)
            });
            self.set_services(now, received.source, services);
        }
    }

    /// Sets the services of a component, as far as the limits allow.
    fn set_services<'r>(
        &mut self,
        now: Instant,
        id: JausId,
        services: impl Iterator<Item = (&'r Text, (u8, u8))>,
    ) {
        let (services, is_cut) = offers(services);
        if is_cut {
            self.refuse(now, |refused| &mut refused.cut);
        }
        self.settle(id, What::Services);
        let known = self.directory.component(id);
        let known = known.and_then(|known| known.services.as_deref());
        if known == Some(&services[..]) {
            return;
        }
        if known.is_some() && !self.peers.may_change(now, id) {
            return self.refuse(now, |refused| &mut refused.too_often);
        }
        let octets = match self.directory.list(&services) {
            Some(_) => 0,
            None => services.iter().map(|it| OFFER_OCTETS + it.urn.len()).sum(),
        };
        if !self.peers.charge(id, octets) {
            return self.refuse(now, |refused| &mut refused.cut);
        }
        if self.tree().set_services(id, services) {
            self.tell(Change::Services(id));
            self.examine_server(now, id);
        }
    }

    /// Queries the configuration of a component that may be a server of our subsystem.
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
        if self.may_serve_us(server) {
            let is_missing =
                |own: &JausId| own.subsystem() == server.subsystem() && !listed.contains(own);
            let missing: Vec<_> = self.members().filter(is_missing).collect();
            for own in missing {
                self.registrations.add(now, own, server);
            }
        }
    }
}

/// Whether this component itself names the subsystem or node in question. Another component that
/// joins it may give a different name, or be a tool that is there for a short time.
fn knows_better(level: Level, source: JausId, own: JausId, profile: &Profile) -> bool {
    let same_subsystem = source.subsystem() == own.subsystem();
    let ours = match level {
        Level::Subsystem => same_subsystem,
        Level::Node => same_subsystem && source.node() == own.node(),
        Level::Component => false,
    };
    ours && !profile.identification(level).name.is_empty()
}

/// A sorted list of services without repetitions, and whether it was truncated.
fn offers<'r>(services: impl Iterator<Item = (&'r Text, (u8, u8))>) -> (Vec<Offer>, bool) {
    let (mut offers, mut octets, mut is_cut) = (Vec::new(), 0, false);
    for (uri, (major, minor)) in services {
        let urn = text(uri);
        octets += urn.len();
        is_cut = offers.len() >= MOST_SERVICES || octets > MOST_URN_OCTETS;
        if is_cut {
            break;
        }
        if !urn.is_empty() {
            offers.push(Offer { urn, major, minor });
        }
    }
    offers.sort_unstable();
    offers.dedup();
    (offers, is_cut)
}

fn text(text: &Text) -> String {
    text.to_string_lossy().into_owned()
}
