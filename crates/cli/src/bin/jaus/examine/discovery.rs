//! Discovery exchanges: identification, multicast and service lists.

use std::time::Duration;

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::messages::core::{
    QueryConfiguration, QueryServices, ReportConfiguration, ReportIdentification, ReportServices,
    query_configuration, query_services, report_identification::Type,
};
use jaus_cli::output::counted;

use super::case::{Case, Offer, Question, query_identification};
use super::exchange::{Exchange, Mark, Verdict};
use super::judgement::{Begin, Judgement};
use super::seen::{Heard, Listener};

pub(super) fn identification(case: &mut Case) -> Begin {
    if let Some(skip) = case.nobody() {
        return Begin::Over(skip);
    }
    match case.ask_peer(&query_identification()) {
        Some(send) => Begin::Ask(Question::new(send)),
        None => Begin::Over(Verdict::skipped("no component id is known at that address")),
    }
}

pub(super) fn identified(case: &mut Case, mark: usize) -> Judgement {
    let Some(report) = case.report::<ReportIdentification>(mark) else {
        return Judgement::Wait;
    };
    let name = report.identification.to_string_lossy();
    let name = name.trim_end_matches('\0').to_owned();
    let kind = match report.r#type {
        Type::VEHICLE => "a vehicle".to_owned(),
        Type::OCU => "an operator control unit".to_owned(),
        Type::OTHER_SUBSYSTEM => "another subsystem".to_owned(),
        other => format!("of type {}", other.0),
    };
    // Quoted, so that control characters are escaped.
    let verdict = Verdict::ok(format!("{name:?}, {kind}"));
    case.name = Some(name);
    Judgement::Over(verdict)
}

pub(super) fn not_identified(case: &Case, mark: usize) -> Verdict {
    let id = shown(case);
    if let Some(error) = case.unreadable::<ReportIdentification>(mark) {
        return malformed("Report Identification", &error);
    }
    let own = case.settings.own;
    let other = case.seen.since(mark).iter().find(|heard| {
        heard.frame.destination == own && heard.code() == Some(ReportIdentification::CODE)
    });
    if let Some(heard) = other {
        let other = heard.frame.source;
        return Verdict::failed(
            format!("{id} was queried, but {other} answers"),
            "another component answers for the node, or the id is wrong",
            format!("examine that one: jaus examine {other}@{}", heard.from),
        );
    }
    let what = format!("{id} does not answer Query Identification");
    let cause = "the component has no Discovery service (a bare Junior client has no services)";
    if case.received(0).next().is_some() {
        return Verdict::failed(
            what,
            cause,
            "query its node's discovery component, if there is one",
        );
    }
    Verdict::failed(
        what,
        format!("{cause}, or its id is a different one"),
        "query its node's discovery component; check the id in the peer's settings",
    )
}

/// The verdict on a malformed report.
pub(super) fn malformed(report: &str, error: &str) -> Verdict {
    Verdict::failed(
        format!("its {report} cannot be decoded: {error}"),
        "the peer encodes the message differently from its definition",
        "inspect its octets field by field with `jaus record` and `jaus decode`",
    )
}

pub(super) fn shown(case: &Case) -> String {
    case.id.map_or_else(|| "it".to_owned(), |id| id.to_string())
}

pub(super) fn multicast(case: &mut Case) -> Begin {
    if let Some(skip) = case.nobody() {
        return Begin::Over(skip);
    }
    if let Some(why) = &case.settings.no_group {
        return Begin::Over(Verdict::skipped(format!("no multicast here: {why}")));
    }
    // An answer to an earlier query looks like one to the multicast, so it must have arrived. "any
    // answer" and "identification" have sent a query each.
    let answers = case.reports::<ReportIdentification>(0).count();
    if case.went_well(Exchange::Identification) && answers < 2 {
        return Begin::Ask(Question::silence(LATE));
    }
    Begin::Ask(ask_by_multicast(case))
}

/// Timeout of an answer to an earlier query.
const LATE: Duration = Duration::from_millis(250);

/// The query by multicast.
pub(super) fn ask_by_multicast(case: &mut Case) -> Question {
    case.multicast_asked = true;
    let mut sends = vec![case.ask_everybody(&query_identification())];
    if !case.went_well(Exchange::Identification) {
        sends.extend(case.call_alone());
    }
    Question {
        sends,
        again: Some(Duration::from_millis(700)),
        patience: Duration::from_secs(2),
    }
}

pub(super) fn multicast_answered(case: &mut Case, mark: usize) -> Judgement {
    if !case.multicast_asked {
        return Judgement::Wait;
    }
    // Any component of its node may answer for all.
    let (own, id) = (case.settings.own, case.id);
    let answers = |heard: &&Heard| {
        let same = id.is_some_and(|id| id.subsystem() == heard.frame.source.subsystem());
        same && heard.frame.destination == own && heard.code() == Some(ReportIdentification::CODE)
    };
    if case.seen.since(mark).iter().any(|heard| answers(&heard)) {
        return Judgement::Over(Verdict::ok("a broadcast query is answered"));
    }
    let mut received = case.received(mark);
    if received.any(|heard| heard.frame.flags.acknowledgement().is_answer()) {
        return Judgement::Over(Verdict::ok("a broadcast message is acknowledged"));
    }
    Judgement::Wait
}

pub(super) fn multicast_unanswered(case: &Case) -> Verdict {
    let id = shown(case);
    if case.mark_of(Exchange::Identification) != Some(Mark::Ok) {
        return Verdict::failed(
            "a broadcast query is neither answered nor acknowledged",
            "it has not joined the group, or the network does not forward multicast; or it \
             answers and acknowledges nothing at all",
            "see \"identification\" and \"acknowledgement\"",
        );
    }
    Verdict::failed(
        format!("{id} answers a unicast query, but not a multicast one"),
        "the peer has not joined the group, or joined it on another interface; or the network \
         does not forward multicast (IGMP snooping without a querier, an access point, a \
         container)",
        "let the peer join 239.255.0.1 on this network's interface; or set peers = [\"ADDRESS\"] \
         in our settings, which needs no multicast",
    )
}

/// Evaluates all messages since the beginning; waits if that is too recent.
pub(super) fn multicast_back(case: &mut Case, now: Duration) -> Begin {
    if let Some(skip) = case.nobody() {
        return Begin::Over(skip);
    }
    if let Some(why) = &case.settings.no_group {
        return Begin::Over(Verdict::skipped(format!("no multicast here: {why}")));
    }
    let left = case.settings.listen.saturating_sub(now);
    match heard_by_multicast(case) {
        Judgement::Over(verdict) => Begin::Over(verdict),
        _ if left.is_zero() => Begin::Over(nothing_by_multicast(case)),
        _ => Begin::Ask(Question::silence(left)),
    }
}

pub(super) fn heard_by_multicast(case: &mut Case) -> Judgement {
    let (address, id) = (case.address, case.id);
    let by_group = |heard: &&Heard| {
        let same = id.is_some_and(|id| id.subsystem() == heard.frame.source.subsystem());
        let there = address.is_some_and(|address| address.ip() == heard.from.ip());
        heard.listener == Listener::Group && same && there
    };
    match case.seen.all().iter().find(by_group) {
        Some(heard) => Judgement::Over(Verdict::ok(format!(
            "multicasts from {} arrive",
            heard.frame.source
        ))),
        None => Judgement::Wait,
    }
}

/// Not every peer multicasts, so silence is no proof.
pub(super) fn nothing_by_multicast(case: &Case) -> Verdict {
    let seconds = case.settings.listen.as_secs_f64();
    Verdict::skipped(format!("it sent no multicast within {seconds} s"))
        .advice("if it should (JAUS++ sends every 5 s), listen longer: --timeout 15s")
}

pub(super) fn configuration(case: &mut Case) -> Begin {
    if let Some(skip) = case.nobody() {
        return Begin::Over(skip);
    }
    let query = QueryConfiguration {
        query_type: query_configuration::QueryType::SUBSYSTEM_IDENTIFICATION,
    };
    match case.ask_peer(&query) {
        Some(send) => Begin::Ask(Question::new(send)),
        None => Begin::Over(Verdict::skipped("no component id is known at that address")),
    }
}

pub(super) fn configured(case: &mut Case, mark: usize) -> Judgement {
    let Some(report) = case.report::<ReportConfiguration>(mark) else {
        return Judgement::Wait;
    };
    let components: usize = report
        .node_list
        .iter()
        .map(|n| n.component_list.len())
        .sum();
    let lists_itself = case.id.is_some_and(|id| {
        report.node_list.iter().any(|node| {
            let mut all = node.component_list.iter();
            node.node_rec.node_id == id.node() && all.any(|c| c.component_id == id.component())
        })
    });
    let nodes = report.node_list.len();
    let what = format!(
        "{}, {}",
        counted(nodes, "node"),
        counted(components, "component")
    );
    if lists_itself {
        return Judgement::Over(Verdict::ok(what));
    }
    Judgement::Over(Verdict::failed(
        format!("{what}, but {} itself is not listed", shown(case)),
        "its node manager does not know the component, or lists another node's components",
        "clients that search the node's list do not find it: give them its id",
    ))
}

pub(super) fn not_configured(case: &Case, mark: usize) -> Verdict {
    if let Some(error) = case.unreadable::<ReportConfiguration>(mark) {
        return malformed("Report Configuration", &error);
    }
    Verdict::failed(
        format!("{} does not answer Query Configuration", shown(case)),
        "the component does not report its subsystem's configuration",
        "query its node manager, or the component itself",
    )
}

/// Queries services in one of the three ways.
pub(super) fn services(case: &mut Case, way: Exchange) -> Begin {
    if let Some(skip) = case.nobody().or_else(|| case.mute()) {
        return Begin::Over(skip);
    }
    let Some(id) = case.id else {
        return Begin::Over(Verdict::skipped("no component id is known at that address"));
    };
    let list = |node, component| vec![node_seq(node, vec![component])];
    let node_list = match way {
        Exchange::ServicesWildcard => list(JausId::ANY_NODE, JausId::ANY_COMPONENT),
        Exchange::ServicesNamed => list(id.node(), id.component()),
        _ => Vec::new(),
    };
    match case.ask_peer(&QueryServices { node_list }) {
        Some(send) => Begin::Ask(Question::new(send)),
        None => Begin::Over(Verdict::skipped("no component id is known at that address")),
    }
}

/// One node with some of its components, in a Query Services.
pub(super) fn node_seq(node: u8, components: Vec<u8>) -> query_services::NodeSeq {
    query_services::NodeSeq {
        node_rec: query_services::NodeRec {
            node_id: query_services::NodeId(node),
        },
        component_list: components
            .into_iter()
            .map(|component| query_services::ComponentRec {
                component_id: query_services::ComponentId(component),
            })
            .collect(),
    }
}

/// Timeout of further reports of a list after the first.
const MORE: Duration = Duration::from_millis(150);

/// A long list spans several reports.
pub(super) fn serves(case: &mut Case, way: Exchange, mark: usize, stage: u8) -> Judgement {
    if stage > 0 {
        return Judgement::Wait;
    }
    let reports: Vec<ReportServices> = case.reports(mark).collect();
    if reports.is_empty() {
        return Judgement::Wait;
    }
    case.listed = services_in(&reports);
    if case.listed == 0 {
        return Judgement::Over(empty(way));
    }
    note_services(case, &reports);
    Judgement::Ask(Question::silence(MORE))
}

fn services_in(reports: &[ReportServices]) -> usize {
    let nodes = reports.iter().flat_map(|report| &report.node_list);
    let components = nodes.flat_map(|node| &node.component_list);
    components.map(|c| c.service_list.len()).sum()
}

/// Timeout of the list, or of its first report.
pub(super) fn all_listed(case: &mut Case, way: Exchange, mark: usize, stage: u8) -> Verdict {
    if stage == 0 {
        return no_services(case, way, mark);
    }
    let more: Vec<ReportServices> = case.reports(mark).collect();
    note_services(case, &more);
    Verdict::ok(counted(case.listed + services_in(&more), "service"))
}

/// Stores the services of the component itself.
fn note_services(case: &mut Case, reports: &[ReportServices]) {
    let Some(id) = case.id else {
        return;
    };
    let nodes = reports.iter().flat_map(|report| &report.node_list);
    let own_node = nodes.filter(|node| node.node_rec.node_id == id.node());
    let components = own_node.flat_map(|node| &node.component_list);
    let own = components.filter(|c| c.component_rec.component_id == id.component());
    let offers: Vec<Offer> = own
        .flat_map(|component| &component.service_list)
        .map(|service| Offer {
            urn: service
                .uri
                .to_string_lossy()
                .trim_end_matches('\0')
                .to_owned(),
            major: service.major_version_number,
            minor: service.minor_version_number,
        })
        .collect();
    if offers.is_empty() {
        return;
    }
    let known = case.services.get_or_insert_default();
    for offer in offers {
        if !known.contains(&offer) {
            known.push(offer);
        }
    }
}

fn empty(way: Exchange) -> Verdict {
    match way {
        Exchange::ServicesWildcard => Verdict::failed(
            "Query Services with 255 for node and component gets an empty list",
            "the peer reads 255 as an id, not as a wildcard (JAUS++ does)",
            "query by id, as our clients do",
        ),
        Exchange::ServicesNamed => Verdict::failed(
            "Query Services by id gets an empty list",
            "its node manager does not know the component's services, or does not know them yet",
            "query again later; query the component itself instead of its node manager",
        ),
        _ => Verdict::failed(
            "Query Services with an empty list gets an empty list",
            "the peer reads an empty list as \"none\", not as \"all\"",
            "query by id, as our clients do",
        ),
    }
}

fn no_services(case: &Case, way: Exchange, mark: usize) -> Verdict {
    if let Some(error) = case.unreadable::<ReportServices>(mark) {
        return malformed("Report Services", &error);
    }
    let how = match way {
        Exchange::ServicesWildcard => "with wildcards (255)",
        Exchange::ServicesNamed => "by id",
        _ => "with an empty list",
    };
    if case
        .id
        .is_some_and(|id| case.seen.large_from(id, mark).is_some())
    {
        return Verdict::failed(
            format!("queried {how}, it answers in fragments that are not a Report Services"),
            "it fragments large messages in a non-standard way",
            "query fewer components at a time",
        );
    }
    Verdict::failed(
        format!("Query Services {how} is not answered"),
        "the component has no Discovery service, or does not support this form of the query",
        "use one of the other two forms",
    )
}
