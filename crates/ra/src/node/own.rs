//! A local subsystem: completed, validated and encoded as reports.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use super::subscriptions::Subscription;
use super::subsystem::{
    BadSubsystem, Command, RaComponentEntry, RaNodeEntry, RaServiceEntry, RaSubsystemEntry,
};
use crate::RaId;
use crate::messages::ra33::{
    CancelEvent, ConfirmEventRequest, CreateEvent, Event, QueryConfiguration, QueryHeartbeatPulse,
    QueryIdentification, QueryServices, ReportConfiguration, ReportHeartbeatPulse,
    ReportIdentification, ReportServices, report_configuration, report_services,
};
use jaus::codec::{Message as _, Text};

/// A local subsystem.
#[derive(Debug)]
pub(super) struct Own {
    pub(super) subsystem: RaSubsystemEntry,
    pub(super) next_heartbeat: Instant,
    /// Subscriptions by event number.
    pub(super) subscriptions: BTreeMap<u8, Subscription>,
    /// When to send the changes collected so far.
    pub(super) tell: Option<Instant>,
}

impl Own {
    /// Takes a complete and validated subsystem.
    pub(super) fn new(now: Instant, subsystem: RaSubsystemEntry) -> Self {
        Self {
            subsystem,
            next_heartbeat: now,
            subscriptions: BTreeMap::new(),
            tell: None,
        }
    }

    /// Source of heartbeats: the communicator in the first node.
    pub(super) fn communicator(&self) -> RaId {
        self.of_first_node(RaId::COMMUNICATOR)
    }

    /// Source of queries: the manager of the first node.
    pub(super) fn manager(&self) -> RaId {
        self.of_first_node(RaId::NODE_MANAGER)
    }

    fn of_first_node(&self, component: u8) -> RaId {
        let node = self.subsystem.nodes.first().map_or(1, |node| node.id);
        RaId::new(self.subsystem.id, node, component, 1)
    }

    pub(super) fn ids(&self) -> impl Iterator<Item = RaId> + '_ {
        self.subsystem.components().map(|(id, _)| id)
    }

    fn node(&self, id: u8) -> Option<&RaNodeEntry> {
        self.subsystem.nodes.iter().find(|node| node.id == id)
    }

    fn component(&self, id: RaId) -> Option<&RaComponentEntry> {
        let found = self.subsystem.components().find(|&(other, _)| other == id);
        found.map(|(_, component)| component)
    }

    /// The name of the subsystem (2), the node (3) or the component (4) of an id, as queried.
    pub(super) fn identification(
        &self,
        id: RaId,
        query: &QueryIdentification,
    ) -> Option<ReportIdentification> {
        let name = match query.query_field.0 {
            2 => &self.subsystem.name,
            3 => &self.node(id.node)?.name,
            4 => &self.component(id)?.name,
            _ => return None,
        };
        Some(ReportIdentification {
            query_field: query.query_field,
            authority_code: 0,
            identification_type: 0,
            identification: Text::from(short(name)),
        })
    }

    /// The nodes and components of the subsystem (2), or of the node of an id (3).
    pub(super) fn configuration(
        &self,
        id: RaId,
        query: &QueryConfiguration,
    ) -> Option<ReportConfiguration> {
        let nodes = self.subsystem.nodes.iter();
        let nodes: Vec<_> = match query.query_field.0 {
            2 => nodes.collect(),
            3 => nodes.filter(|node| node.id == id.node).collect(),
            _ => return None,
        };
        Some(ReportConfiguration {
            node_list: nodes.into_iter().map(listed).collect(),
        })
    }

    /// The services of a component.
    pub(super) fn services(&self, id: RaId) -> Option<ReportServices> {
        let services = &self.component(id)?.services;
        Some(ReportServices {
            service_list: services.iter().map(described).collect(),
        })
    }
}

/// The longest prefix of a name that fits 80 octets with its terminating zero.
fn short(name: &str) -> &str {
    const LONGEST: usize = 79;
    let ends = name.char_indices().map(|(at, c)| at + c.len_utf8());
    let end = ends.take_while(|&end| end <= LONGEST).last();
    &name[..end.unwrap_or(0)]
}

fn listed(node: &RaNodeEntry) -> report_configuration::NodeSeq {
    let component = |component: &RaComponentEntry| report_configuration::ComponentRec {
        component_id: component.component,
        instance_id: component.instance,
    };
    report_configuration::NodeSeq {
        node_rec: report_configuration::NodeRec { node_id: node.id },
        component_list: node.components.iter().map(component).collect(),
    }
}

fn described(service: &RaServiceEntry) -> report_services::ServiceSeq {
    let input = |command: &Command| report_services::InputMessageRec {
        command_code: command.code,
        presence_vector: command.presence,
    };
    let output = |command: &Command| report_services::OutputMessageRec {
        command_code: command.code,
        presence_vector: command.presence,
    };
    report_services::ServiceSeq {
        service_rec: report_services::ServiceRec {
            service_type: service.kind,
        },
        input_message_list: service.inputs.iter().map(input).collect(),
        output_message_list: service.outputs.iter().map(output).collect(),
    }
}

/// The messages that the node itself receives and sends for each component.
fn core() -> RaServiceEntry {
    let commands = |codes: &[u16]| {
        let command = |&code| Command { code, presence: 0 };
        codes.iter().map(command).collect()
    };
    RaServiceEntry {
        kind: 0,
        inputs: commands(&[
            CreateEvent::CODE,
            CancelEvent::CODE,
            QueryIdentification::CODE,
            QueryConfiguration::CODE,
            QueryServices::CODE,
            QueryHeartbeatPulse::CODE,
        ]),
        outputs: commands(&[
            ConfirmEventRequest::CODE,
            Event::CODE,
            ReportIdentification::CODE,
            ReportConfiguration::CODE,
            ReportServices::CODE,
            ReportHeartbeatPulse::CODE,
        ]),
    }
}

/// Adds missing node managers and the communicator, and validates the result.
pub(super) fn complete(mut subsystem: RaSubsystemEntry) -> Result<RaSubsystemEntry, BadSubsystem> {
    subsystem.nodes.sort_by_key(|node| node.id);
    if subsystem.nodes.is_empty() {
        subsystem.nodes.push(RaNodeEntry {
            id: 1,
            ..RaNodeEntry::default()
        });
    }
    for (number, node) in subsystem.nodes.iter_mut().enumerate() {
        if number == 0 {
            add_missing(node, RaId::COMMUNICATOR, "Communicator");
        }
        add_missing(node, RaId::NODE_MANAGER, "Node Manager");
    }
    check(&subsystem)?;
    Ok(subsystem)
}

fn add_missing(node: &mut RaNodeEntry, component: u8, name: &str) {
    let is_it = |known: &RaComponentEntry| (known.component, known.instance) == (component, 1);
    if !node.components.iter().any(is_it) {
        let missing = RaComponentEntry {
            component,
            instance: 1,
            name: name.to_owned(),
            services: vec![core()],
        };
        node.components.insert(0, missing);
    }
}

fn check(subsystem: &RaSubsystemEntry) -> Result<(), BadSubsystem> {
    const MOST: usize = 255;
    let in_range = |what, number| match number {
        1..=254 => Ok(()),
        _ => Err(BadSubsystem::OutOfRange { what, number }),
    };
    let fits = |id, what, number| match number {
        0..=MOST => Ok(()),
        _ => Err(BadSubsystem::TooMany(id, what)),
    };
    in_range("subsystem", subsystem.id)?;
    let mut nodes = BTreeSet::new();
    for node in &subsystem.nodes {
        in_range("node", node.id)?;
        let manager = RaId::new(subsystem.id, node.id, RaId::NODE_MANAGER, 1);
        if !nodes.insert(node.id) {
            return Err(BadSubsystem::Twice(manager));
        }
        fits(manager, "components in its node", node.components.len())?;
    }
    let mut ids = BTreeSet::new();
    for (id, component) in subsystem.components() {
        in_range("component", id.component)?;
        in_range("instance", id.instance)?;
        if !ids.insert(id) {
            return Err(BadSubsystem::Twice(id));
        }
        fits(id, "services", component.services.len())?;
        for service in &component.services {
            fits(id, "inputs in a service", service.inputs.len())?;
            fits(id, "outputs in a service", service.outputs.len())?;
        }
    }
    Ok(())
}
