//! Tests of discovery under floods of real and forged components, in virtual time.

use std::collections::{BTreeMap, BTreeSet};
use std::net::{IpAddr, Ipv4Addr};
use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::*;
use crate::endpoint::{LinkId, Outgoing, Path};
use crate::messages::core::{
    ReportHeartbeatPulse, report_configuration, report_identification, report_services,
};
use crate::service::{ComponentEntry, Kind};
use crate::wire::{Broadcast, Priority};

const US: JausId = JausId::new(101, 1, 1);
const ATTACKER: IpAddr = IpAddr::V4(Ipv4Addr::new(10, 0, 0, 66));
const OTHER: IpAddr = IpAddr::V4(Ipv4Addr::new(10, 0, 0, 9));
const SECOND: Duration = Duration::from_secs(1);

/// A component, and peers that answer its queries.
struct Rig {
    discovery: Discovery,
    now: Instant,
    start: Instant,
    /// The live peers and their addresses.
    lively: Vec<(JausId, IpAddr)>,
    /// Those of them that offer Discovery, and whom they list.
    servers: BTreeMap<JausId, Vec<JausId>>,
    /// Whom it has sent Register Services.
    registered_with: Vec<JausId>,
    /// The number of messages it has sent.
    sent: usize,
}

impl Rig {
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn new() -> Self {
        let profile = Profile::new(Kind::Vehicle, "Rover");
        let start = Instant::now();
        let mut rig = Self {
            discovery: Discovery::new(US, profile, Scope::System, Timing::default(), 1),
            now: start,
            start,
            lively: Vec::new(),
            servers: BTreeMap::new(),
            registered_with: Vec::new(),
            sent: 0,
        };
        rig.discovery.set_offers([], &mut Outbox::new(US));
        rig
    }

    fn hear<M: Message>(&mut self, source: JausId, ip: IpAddr, message: &M) {
        let peer = std::net::SocketAddr::new(ip, 3794).into();
        let link = LinkId(0);
        let received = Received {
            source,
            destination: US,
            to: US,
            priority: Priority::Standard,
            broadcast: Broadcast::None,
            payload: message.encode().unwrap(),
            sequence: None,
            path: Some(Path { link, peer }),
            acknowledged: false,
        };
        let mut out = Outbox::new(US);
        self.discovery.hear(self.now, &received);
        self.discovery.handle_message(self.now, &received, &mut out);
        while self.discovery.poll_change().is_some() {}
    }

    fn call(&mut self, source: JausId, ip: IpAddr) {
        self.hear(source, ip, &query(2));
    }

    /// Advances the time; live peers answer.
    fn run(&mut self, time: Duration) {
        let end = self.now + time;
        while let Some(wake) = self.discovery.poll_timeout().filter(|wake| *wake <= end) {
            self.now = self.now.max(wake);
            let mut out = Outbox::new(US);
            self.discovery.handle_timeout(self.now, &mut out);
            while self.discovery.poll_change().is_some() {}
            while let Some(sent) = out.pop() {
                self.sent += 1;
                if let Ok(registration) = RegisterServices::decode(&sent.payload) {
                    assert!(
                        registration
                            .service_list
                            .iter()
                            .any(|it| it.uri == core::discovery::URN)
                    );
                    self.registered_with.push(sent.destination);
                }
                let lively = self.lively.iter();
                let peer = lively.copied().find(|(id, _)| *id == sent.destination);
                if let Some((id, ip)) = peer {
                    self.answer(id, ip, &sent.payload);
                }
            }
        }
        self.now = end;
    }

    fn answer(&mut self, id: JausId, ip: IpAddr, query: &Bytes) {
        if let Ok(query) = QueryIdentification::decode(query) {
            self.hear(id, ip, &named(query.query_type.0, "peer"));
        } else if QueryServices::decode(query).is_ok() {
            let mut report = services([(id, 3)], "urn:jaus:jss:core:Some");
            if self.servers.contains_key(&id) {
                report.node_list[0].component_list[0].service_list[0].uri =
                    core::discovery::URN.into();
            }
            self.hear(id, ip, &report);
        } else if QueryConfiguration::decode(query).is_ok() {
            let listed = self.servers.get(&id).cloned().unwrap_or(vec![id]);
            self.hear(id, ip, &configuration(listed));
        }
    }

    fn knows(&self, id: JausId) -> bool {
        self.discovery.directory().component(id).is_some()
    }

    /// The number of other components in the directory.
    fn len(&self) -> usize {
        self.discovery.directory().len() - 1
    }
}

fn query(level: u8) -> QueryIdentification {
    QueryIdentification {
        query_type: level.into(),
    }
}

fn named(level: u8, name: &str) -> ReportIdentification {
    ReportIdentification {
        query_type: report_identification::QueryType(level),
        r#type: 10001.into(),
        identification: name.into(),
    }
}

fn configuration(ids: impl IntoIterator<Item = JausId>) -> ReportConfiguration {
    let node = |id: JausId| report_configuration::NodeSeq {
        node_rec: report_configuration::NodeRec { node_id: id.node() },
        component_list: vec![report_configuration::ComponentRec {
            component_id: id.component(),
            instance_id: 0,
        }],
    };
    ReportConfiguration {
        node_list: ids.into_iter().map(node).collect(),
    }
}

/// A report with the given number of services for each component, each named after it.
fn services(ids: impl IntoIterator<Item = (JausId, u8)>, urn: &str) -> ReportServices {
    let service = |id: JausId, number: u8| report_services::ServiceRec {
        uri: format!("{urn}:{id}:{number}").as_str().into(),
        major_version_number: 1,
        minor_version_number: 0,
    };
    let component = |&(id, many): &(JausId, u8)| report_services::ComponentSeq {
        component_rec: report_services::ComponentRec {
            component_id: id.component(),
            instance_id: 0,
        },
        service_list: (0..many).map(|number| service(id, number)).collect(),
    };
    let ids: Vec<_> = ids.into_iter().collect();
    let nodes = ids.chunk_by(|one, other| one.0.node() == other.0.node());
    let node = |ids: &[(JausId, u8)]| report_services::NodeSeq {
        node_rec: report_services::NodeRec {
            node_id: ids[0].0.node(),
        },
        component_list: ids.iter().map(component).collect(),
    };
    ReportServices {
        node_list: nodes.map(node).collect(),
    }
}

/// The components 1 to 254 of some nodes.
fn many(subsystem: u16, nodes: u8) -> impl Iterator<Item = JausId> {
    let ids = move |node| (1..=254).map(move |number| JausId::new(subsystem, node, number));
    (1..=nodes).flat_map(ids)
}

/// The approximate memory of the services in the directory.
fn octets(rig: &Rig) -> usize {
    let directory = rig.discovery.directory();
    let mut lists: Vec<_> = directory.components().collect();
    lists.retain(|it| it.id != US);
    let offers = lists.into_iter().flat_map(ComponentEntry::offered);
    offers.map(|it| size_of::<Offer>() + it.urn.len()).sum()
}

#[test]
fn a_newcomer_is_found_within_ten_seconds_however_many_components_another_address_lists() {
    let mut rig = Rig::new();
    rig.run(SECOND);
    let liar = JausId::new(7, 1, 1);
    for number in 0..20 {
        for round in 0..5 {
            let listed = many(7, 254).skip(1000 * round).take(200);
            rig.hear(liar, ATTACKER, &configuration(listed));
        }
        for id in many(1000 + number, 2) {
            rig.call(id, ATTACKER);
            rig.hear(id, ATTACKER, &ReportHeartbeatPulse {});
        }
        rig.run(SECOND / 2);
    }
    assert!(rig.len() >= 1000, "the table is as full as it gets");
    let newcomer = JausId::new(9, 1, 1);
    rig.lively.push((newcomer, OTHER));
    rig.call(newcomer, OTHER);
    rig.run(10 * SECOND);
    let directory = rig.discovery.directory();
    let known = directory.component(newcomer);
    let known = known.expect("the newcomer is found");
    assert!(known.services.is_some() && known.identification.is_some());
    assert!(rig.discovery.refused().no_room > 0);
}

#[test]
fn one_that_speaks_takes_the_place_of_one_of_its_address_that_is_only_listed() {
    let mut rig = Rig::new();
    for round in 0..12 {
        let listed = many(7, 254).skip(250 * round).take(250);
        for id in listed.collect::<Vec<_>>().chunks(200) {
            let listed = id.iter().copied();
            rig.hear(JausId::new(7, 1, 1), OTHER, &configuration(listed));
        }
    }
    assert_eq!(rig.len(), 1024);
    let speaker = JausId::new(9, 1, 1);
    rig.call(speaker, OTHER);
    assert!(rig.knows(speaker));
    assert_eq!(rig.len(), 1024);
}

#[test]
fn whatever_is_reported_the_services_of_an_address_take_a_megabyte_at_most() {
    let mut rig = Rig::new();
    let liar = JausId::new(7, 1, 1);
    // More than a megabyte in one message.
    let all = many(7, 1).map(|id| (id, 255));
    rig.hear(liar, ATTACKER, &services(all, "urn:a"));
    assert_eq!((rig.discovery.refused().too_long, rig.len()), (1, 0));
    // As much as the limits allow, in many messages of the maximum length.
    let filler = "x".repeat(100);
    let all: Vec<_> = many(7, 8).map(|id| (id, 200)).collect();
    for some in all.chunks(5) {
        let report = services(some.iter().copied(), &filler);
        rig.hear(liar, ATTACKER, &report);
    }
    assert!(rig.len() >= 1000);
    assert!(octets(&rig) <= 1 << 20, "{} octets", octets(&rig));
    assert!(rig.discovery.refused().cut > 0);
    // Another address still has room.
    let other = JausId::new(9, 1, 1);
    rig.hear(other, OTHER, &services([(other, 20)], "urn:b"));
    let directory = rig.discovery.directory();
    let known = directory.component(other).unwrap();
    assert_eq!(known.offered().count(), 20);
}

#[test]
fn a_peer_that_says_something_else_every_time_is_heard_twenty_times_a_second() {
    let mut rig = Rig::new();
    let liar = JausId::new(7, 1, 1);
    let (mut changes, mut last) = (0, None);
    for number in 0..10_000_u32 {
        let report = services([(liar, 1)], &format!("urn:{number}"));
        rig.hear(liar, ATTACKER, &report);
        let directory = rig.discovery.directory();
        let services = directory.component(liar).unwrap().services.clone();
        changes += usize::from(services != last);
        last = services;
        rig.run(Duration::from_millis(1));
    }
    assert!((300..=340).contains(&changes), "{changes} changes in 10 s");
    assert!(rig.discovery.refused().too_often > 9000);
}

#[test]
fn the_dead_leave_within_seventy_seconds_however_many_they_are() {
    let mut rig = Rig::new();
    for id in many(8, 4).take(700) {
        rig.lively.push((id, OTHER));
        rig.call(id, OTHER);
    }
    rig.run(20 * SECOND);
    rig.lively.clear();
    for id in many(7, 4).take(300) {
        rig.call(id, ATTACKER);
    }
    assert_eq!(rig.len(), 1000);
    let before = rig.sent;
    rig.run(35 * SECOND);
    let directory = rig.discovery.directory();
    assert!(directory.subsystem(7).is_none(), "they have never answered");
    rig.run(35 * SECOND);
    assert_eq!(rig.len(), 0);
    // New queries about 300, one refresh of the 700, and probes and repetitions within their limit.
    let sent = rig.sent - before;
    assert!(sent <= 2 * 700 + 64 + 70 * 33, "{sent} packets in 70 s");
}

#[test]
fn those_who_live_stay_however_many_they_are() {
    let mut rig = Rig::new();
    for id in many(8, 4).take(1000) {
        rig.lively.push((id, OTHER));
        rig.call(id, OTHER);
    }
    rig.run(600 * SECOND);
    assert_eq!(rig.len(), 1000);
    assert!(rig.sent <= 4000 + 600 * 34, "{} packets", rig.sent);
}

#[test]
fn two_hundred_components_are_known_with_names_and_services_within_three_seconds() {
    let mut rig = Rig::new();
    rig.run(100 * SECOND);
    rig.sent = 0;
    for id in many(8, 1).take(200) {
        rig.lively.push((id, OTHER));
        rig.call(id, OTHER);
    }
    for tenth in 0..30 {
        rig.run(SECOND / 10);
        assert!(rig.sent <= 96 + 25 * (tenth + 1), "{} packets", rig.sent);
    }
    let directory = rig.discovery.directory();
    let known = directory.components();
    let known = known.filter(|it| it.services.is_some() && it.identification.is_some());
    assert_eq!(known.count(), 1 + 200);
}

#[test]
fn the_services_of_two_hundred_listed_components_are_asked_for_with_two_queries() {
    let mut rig = Rig::new();
    rig.run(100 * SECOND);
    let manager = JausId::new(8, 1, 1);
    rig.hear(manager, OTHER, &configuration(many(8, 1).take(201)));
    rig.sent = 0;
    rig.run(SECOND / 2);
    // The manager's services, configuration and three names.
    assert_eq!(rig.sent, 2 + 5);
}

/// A node with two components that share a directory, and their messages.
struct TwoOfANode {
    known: Arc<NodeDirectory>,
    first: Discovery,
    second: Discovery,
    now: Instant,
}

const SIBLING: JausId = JausId::new(101, 1, 2);

fn two_of_a_node() -> TwoOfANode {
    let known = Arc::new(NodeDirectory::new(Scope::System, Timing::default(), 1));
    let join = |id| {
        let profile = Profile::new(Kind::Vehicle, format!("{id}"));
        let mut discovery = Discovery::join(known.clone(), id, profile);
        discovery.set_offers([], &mut Outbox::new(id));
        discovery
    };
    TwoOfANode {
        first: join(US),
        second: join(SIBLING),
        now: Rig::new().start,
        known,
    }
}

#[test]
fn components_of_one_node_know_one_another_at_once_and_one_of_them_calls_for_both() {
    let mut node = two_of_a_node();
    let mut changes = std::iter::from_fn(|| node.first.poll_change());
    assert_eq!(changes.next(), Some(Change::Found(SIBLING)));
    assert_eq!(changes.last(), Some(Change::Services(SIBLING)));
    assert_eq!(node.second.poll_change(), None, "it found the first there");
    for discovery in [&node.first, &node.second] {
        assert_eq!(discovery.directory().len(), 2);
        let directory = discovery.directory();
        let name = directory.identification(Level::Subsystem, SIBLING);
        assert_eq!(name.unwrap().name, US.to_string(), "the first has the say");
    }
    assert!(node.first.poll_timeout().is_none(), "nothing to wait for");
    let mut out = Outbox::new(US);
    node.first.handle_timeout(node.now, &mut out);
    assert!(node.first.poll_timeout().is_some());
    assert_eq!(node.second.poll_timeout(), None, "the first sees to it");
    let mut asked = Outbox::new(SIBLING);
    node.second.handle_timeout(node.now + SECOND, &mut asked);
    assert!(asked.pop().is_none());
    node.first.handle_timeout(node.now + SECOND, &mut out);
    assert!(out.pop().is_some());
}

#[test]
fn what_one_component_of_a_node_learns_the_others_know_also_when_it_is_gone() {
    let mut node = two_of_a_node();
    while node.first.poll_change().is_some() {}
    let before = node.known.change_count();
    let peer = JausId::new(9, 1, 1);
    let call = Received {
        source: peer,
        destination: US,
        to: US,
        priority: Priority::Standard,
        broadcast: Broadcast::None,
        payload: query(2).encode().unwrap(),
        sequence: None,
        path: None,
        acknowledged: false,
    };
    let mut out = Outbox::new(US);
    node.first.hear(node.now, &call);
    node.first.handle_message(node.now, &call, &mut out);
    assert_ne!(node.known.change_count(), before);
    let mut changes = std::iter::from_fn(|| node.second.poll_change());
    assert_eq!(changes.next(), Some(Change::SubsystemFound(9)));
    assert_eq!(changes.next(), Some(Change::Found(peer)));
    drop(node.first);
    let gone = std::iter::from_fn(|| node.second.poll_change()).last();
    assert_eq!(gone, Some(Change::Lost(US, Loss::Unlisted)));
    assert!(node.second.directory().component(peer).is_some());
    assert!(node.second.directory().component(US).is_none());
    let mut out = Outbox::new(SIBLING);
    node.second.handle_timeout(node.now, &mut out);
    let asked = std::iter::from_fn(|| out.pop()).filter(|it| it.destination == peer);
    assert_ne!(asked.count(), 0, "it asks in the place of the first");
}

#[test]
fn a_server_of_our_subsystem_gets_a_registration_whenever_it_does_not_list_us() {
    let mut rig = Rig::new();
    let server = JausId::new(US.subsystem(), 2, 1);
    rig.lively.push((server, OTHER));
    rig.servers.insert(server, vec![server]);
    rig.call(server, OTHER);
    rig.run(5 * SECOND);
    assert_eq!(rig.registered_with, [server], "soon after it is found");
    rig.servers.insert(server, vec![server, US]);
    rig.run(600 * SECOND);
    assert_eq!(rig.registered_with, [server], "it lists us");
    rig.servers.insert(server, vec![server]);
    rig.run(60 * SECOND);
    assert!(rig.registered_with.len() > 1, "it has forgotten us");
}

#[test]
fn neither_other_subsystems_nor_components_without_discovery_get_registrations() {
    let mut rig = Rig::new();
    let elsewhere = JausId::new(7, 1, 1);
    let without = JausId::new(US.subsystem(), 2, 1);
    rig.servers.insert(elsewhere, vec![elsewhere]);
    for id in [elsewhere, without] {
        rig.lively.push((id, OTHER));
        rig.call(id, OTHER);
    }
    rig.run(600 * SECOND);
    assert!(rig.knows(elsewhere) && rig.knows(without));
    // `without` is asked for its configuration as the reporter of the subsystem.
    assert_eq!(rig.registered_with, []);
}

#[test]
fn each_component_of_a_node_registers_itself_though_one_asks_for_all() {
    let mut node = two_of_a_node();
    let server = JausId::new(US.subsystem(), 2, 1);
    let before = node.known.change_count();
    {
        let mut known = node.known.lock();
        known.tree().insert(server);
        let (urn, major, minor) = (core::discovery::URN.into(), 1, 0);
        let offers = vec![Offer { urn, major, minor }];
        known.tree().set_services(server, offers);
        known.register_with(node.now, server, &BTreeSet::from([server]));
    }
    assert_ne!(node.known.change_count(), before, "which wakes the second");
    for (own, discovery) in [(US, &mut node.first), (SIBLING, &mut node.second)] {
        assert_eq!(discovery.poll_timeout(), Some(node.now));
        let mut out = Outbox::new(own);
        discovery.handle_timeout(node.now, &mut out);
        let sent: Vec<_> = std::iter::from_fn(|| out.pop()).collect();
        let registered = |it: &&Outgoing| RegisterServices::decode(&it.payload).is_ok();
        let registration = sent.iter().find(registered).unwrap();
        assert_eq!(
            (registration.source, registration.destination),
            (own, server)
        );
    }
    assert_eq!(node.second.poll_timeout(), None);
}
