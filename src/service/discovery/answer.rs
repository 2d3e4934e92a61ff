//! The answering side: reports about this component and the components it knows.

use std::time::Instant;

use super::Discovery;
use super::known::Known;
use crate::address::JausId;
use crate::codec::{Composite, Message, Text};
use crate::endpoint::Received;
use crate::messages::core::{
    QueryConfiguration, QueryIdentification, QueryServiceList, QueryServices, ReportConfiguration,
    ReportIdentification, ReportServiceList, ReportServices, ReportSubsystemList,
    query_service_list, query_services, report_configuration, report_service_list, report_services,
    report_subsystem_list,
};
use crate::service::{ComponentEntry, Directory, Level, NodeEntry, Outbox, SubsystemEntry, read};

/// Lists of services are split into several reports, so that each stays under this many octets: one
/// packet, which every peer can read.
const REPORT_LIMIT: usize = 1300;

impl Discovery {
    /// Whether the budget allows another answer.
    fn may_answer(&mut self, now: Instant, received: &Received) -> bool {
        if self.quoted {
            return true;
        }
        let source = received.source;
        let may = source.is_unicast() && source != self.own && self.answers.take(now);
        if !may {
            tracing::debug!(%source, "query not answered: too many, or an invalid source");
        }
        may
    }

    pub(super) fn answer_identification(
        &mut self,
        now: Instant,
        received: &Received,
        out: &mut Outbox,
    ) {
        let Some(query) = read::<QueryIdentification>(received) else {
            return;
        };
        if !self.quoted {
            // A call also announces its sender.
            self.known.lock().admit(now, received);
        }
        let own = match query.query_type.0 {
            1 => self.profile.system(),
            2 => self.profile.identification(Level::Subsystem),
            3 => self.profile.identification(Level::Node),
            4 => self.profile.identification(Level::Component),
            _ => return,
        };
        // A component without a configured name leaves the answer to others.
        if !own.name.is_empty() && self.may_answer(now, received) {
            let report = ReportIdentification {
                query_type: query.query_type.0.into(),
                r#type: own.kind.code().into(),
                identification: Text::from(own.name),
            };
            out.reply(received, &report);
        }
    }

    pub(super) fn answer_configuration(
        &mut self,
        now: Instant,
        received: &Received,
        out: &mut Outbox,
    ) {
        let Some(query) = read::<QueryConfiguration>(received) else {
            return;
        };
        let whole = match query.query_type.0 {
            2 => true,
            3 => false,
            _ => return,
        };
        if !self.may_answer(now, received) {
            return;
        }
        let directory = self.directory();
        let nodes = directory.subsystem(self.own.subsystem()).into_iter();
        let nodes = nodes
            .flat_map(SubsystemEntry::nodes)
            .filter(|(id, _)| whole || *id == self.own.node());
        let known = self.known.lock();
        let nodes = nodes.filter_map(|(id, node)| configuration_of(id, node, &known));
        let node_list = nodes.collect();
        out.reply(received, &ReportConfiguration { node_list });
    }

    pub(super) fn answer_subsystem_list(
        &mut self,
        now: Instant,
        received: &Received,
        out: &mut Outbox,
    ) {
        if !self.may_answer(now, received) {
            return;
        }
        let known = self.known.lock();
        let subsystems = known
            .directory
            .subsystems()
            .filter_map(|(subsystem, members)| {
                let reporter = known.reporters.get(&subsystem).copied();
                let any = || members.components().next().map(|component| component.id);
                if subsystem == self.own.subsystem() {
                    Some(self.own)
                } else {
                    reporter.or_else(any)
                }
            });
        let subsystems = subsystems.map(|id| report_subsystem_list::SubsystemRec {
            subsystem_id: id.subsystem(),
            node_id: id.node(),
            component_id: id.component(),
        });
        // The count field is one octet.
        let subsystem_list = subsystems.take(usize::from(u8::MAX)).collect();
        out.reply(received, &ReportSubsystemList { subsystem_list });
    }

    pub(super) fn answer_services(&mut self, now: Instant, received: &Received, out: &mut Outbox) {
        let Some(query) = read::<QueryServices>(received) else {
            return;
        };
        let together = received.destination.has_wildcard();
        let wanted = |id: JausId| query_services_wants(&query, id);
        let directory = self.directory();
        let mut asked = self.speaks_for(&directory, together);
        asked.retain(|component| wanted(component.id));
        // The own component first: some clients read only one report.
        asked.sort_by_key(|component| component.id != self.own);
        let mut reports = Vec::new();
        for component in asked {
            add_services(&mut reports, component);
        }
        if reports.is_empty() && !together {
            reports.push(ReportServices {
                node_list: Vec::new(),
            });
        }
        for report in reports {
            if self.may_answer(now, received) {
                out.reply(received, &report);
            }
        }
    }

    pub(super) fn answer_service_list(
        &mut self,
        now: Instant,
        received: &Received,
        out: &mut Outbox,
    ) {
        let Some(query) = read::<QueryServiceList>(received) else {
            return;
        };
        let together = received.destination.has_wildcard();
        let directory = self.directory();
        let known = directory
            .components()
            .filter(|c| !together || c.id == self.own);
        let mut reports = Vec::new();
        for component in known {
            let Some(filters) = service_list_filters(&query, component.id) else {
                continue;
            };
            add_filtered(&mut reports, component, &filters);
        }
        if reports.is_empty() && !together {
            reports.push(ReportServiceList {
                subsystem_list: Vec::new(),
            });
        }
        for report in reports {
            if self.may_answer(now, received) {
                out.reply(received, &report);
            }
        }
    }

    /// The components to answer for: this one, or all known directly in its subsystem.
    fn speaks_for<'d>(&self, directory: &'d Directory, together: bool) -> Vec<&'d ComponentEntry> {
        let own = self.own;
        let known = self.known.lock();
        let subsystem = directory.subsystem(own.subsystem()).into_iter();
        let members = subsystem.flat_map(SubsystemEntry::components);
        let is_listed = |it: &&ComponentEntry| it.id == own || !together && known.is_heard(it.id);
        members.filter(is_listed).collect()
    }
}

/// Reports a component's services to every peer that may have queried them.
pub(super) fn tell_services(
    directory: &Directory,
    own: JausId,
    peers: impl Iterator<Item = JausId>,
    out: &mut Outbox,
) {
    let mut reports = Vec::new();
    if let Some(own) = directory.component(own) {
        add_services(&mut reports, own);
    }
    for peer in peers {
        for report in &reports {
            out.send(peer, report);
        }
    }
}

/// The components of a node that are known directly; `None` if there are none.
fn configuration_of(
    id: u8,
    node: &NodeEntry,
    known: &Known,
) -> Option<report_configuration::NodeSeq> {
    let components = node.components().filter(|it| known.is_heard(it.id));
    let components = components.map(|component| report_configuration::ComponentRec {
        component_id: component.id.component(),
        instance_id: 0,
    });
    let component_list: Vec<_> = components.collect();
    (!component_list.is_empty()).then_some(report_configuration::NodeSeq {
        node_rec: report_configuration::NodeRec { node_id: id },
        component_list,
    })
}

/// Whether a Query Services covers this component. An empty list or the number 255 covers all.
fn query_services_wants(query: &QueryServices, id: JausId) -> bool {
    let component_wanted = |node: &query_services::NodeSeq| {
        let wanted = |number: u8| [JausId::ANY_COMPONENT, id.component()].contains(&number);
        node.component_list.is_empty()
            || node
                .component_list
                .iter()
                .any(|component| wanted(component.component_id.0))
    };
    query.node_list.is_empty()
        || query.node_list.iter().any(|node| {
            [JausId::ANY_NODE, id.node()].contains(&node.node_rec.node_id.0)
                && component_wanted(node)
        })
}

/// The text filters of a Query Service List for this component: `None` if the query does not cover
/// it, an empty filter if it covers all its services.
fn service_list_filters(query: &QueryServiceList, id: JausId) -> Option<Vec<String>> {
    if query.subsystem_list.is_empty() {
        return Some(vec![String::new()]);
    }
    let mut filters = Vec::new();
    for subsystem in &query.subsystem_list {
        let number = subsystem.subsystem_rec.subsystem_id.0;
        if ![JausId::ANY_SUBSYSTEM, id.subsystem()].contains(&number) {
            continue;
        }
        if subsystem.node_list.is_empty() {
            filters.push(String::new());
        }
        for node in &subsystem.node_list {
            if [JausId::ANY_NODE, id.node()].contains(&node.node_rec.node_id.0) {
                filters.extend(component_filters(&node.component_list, id.component()));
            }
        }
    }
    if filters.is_empty() {
        None
    } else {
        Some(filters)
    }
}

fn component_filters(
    components: &[query_service_list::ComponentRec],
    number: u8,
) -> impl Iterator<Item = String> {
    let everything = components.is_empty().then(String::new);
    let named = components.iter().filter(move |component| {
        [JausId::ANY_COMPONENT, number].contains(&component.component_id.0)
    });
    let filters = named.map(|component| {
        component
            .search_filter
            .as_ref()
            .map_or_else(String::new, |text| text.to_string_lossy().into_owned())
    });
    everything.into_iter().chain(filters)
}

/// Adds a component to the last report, or to a new one if it does not fit.
fn add_services(reports: &mut Vec<ReportServices>, component: &ComponentEntry) {
    use report_services::{ComponentRec, ComponentSeq, NodeRec, NodeSeq, ServiceRec};

    let Some(services) = &component.services else {
        return;
    };
    let (node, number) = (component.id.node(), component.id.component());
    let services = services.iter().map(|offer| ServiceRec {
        uri: Text::from(offer.urn.as_str()),
        major_version_number: offer.major,
        minor_version_number: offer.minor,
    });
    let entry = ComponentSeq {
        component_rec: ComponentRec {
            component_id: number,
            instance_id: 0,
        },
        // The count field is one octet.
        service_list: services.take(usize::from(u8::MAX)).collect(),
    };
    let room =
        |report: &&mut ReportServices| report.encoded_len() + entry.encoded_len() <= REPORT_LIMIT;
    let report = match reports.last_mut().filter(room) {
        Some(report) => report,
        None => {
            reports.push(ReportServices {
                node_list: Vec::new(),
            });
            let Some(report) = reports.last_mut() else {
                return;
            };
            report
        }
    };
    match report
        .node_list
        .last_mut()
        .filter(|last| last.node_rec.node_id == node)
    {
        Some(last) => last.component_list.push(entry),
        None => report.node_list.push(NodeSeq {
            node_rec: NodeRec { node_id: node },
            component_list: vec![entry],
        }),
    }
}

/// Adds the services of a component that pass one of the filters, as a separate report: Report
/// Service List is rare, and simple beats short.
fn add_filtered(
    reports: &mut Vec<ReportServiceList>,
    component: &ComponentEntry,
    filters: &[String],
) {
    use report_service_list::{
        ComponentRec, ComponentSeq, NodeRec, NodeSeq, ServiceRec, SubsystemRec, SubsystemSeq,
    };

    let passed = component
        .offered()
        .filter(|offer| filters.iter().any(|filter| offer.urn.contains(filter)));
    let service_list: Vec<_> = passed
        .map(|offer| ServiceRec {
            uri: Text::from(offer.urn.as_str()),
            major_version_number: offer.major,
            minor_version_number: offer.minor,
        })
        .take(usize::from(u8::MAX))
        .collect();
    if service_list.is_empty() {
        return;
    }
    let id = component.id;
    let entry = ComponentSeq {
        component_rec: ComponentRec {
            component_id: id.component(),
            instance_id: 0,
        },
        service_list,
    };
    let node = NodeSeq {
        node_rec: NodeRec { node_id: id.node() },
        component_list: vec![entry],
    };
    let subsystem_rec = SubsystemRec {
        subsystem_id: id.subsystem(),
    };
    let subsystem = SubsystemSeq {
        subsystem_rec,
        node_list: vec![node],
    };
    reports.push(ReportServiceList {
        subsystem_list: vec![subsystem],
    });
}
