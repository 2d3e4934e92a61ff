//! Learns about peer subsystems: processes their reports and sends the discovery queries.

use std::time::{Duration, Instant};

use super::RaNode;
use super::peer::{Peer, Question, commands};
use super::subsystem::{Command, RaComponentEntry, RaNodeEntry, RaServiceEntry};
use crate::RaId;
use crate::counters::Counter;
use crate::message::Message;
use crate::messages::ra33::query_configuration::QueryField as Parts;
use crate::messages::ra33::query_identification::QueryField as Whose;
use crate::messages::ra33::{
    ConfirmEventRequest, CreateEvent, Event, QueryConfiguration, QueryIdentification,
    QueryServices, RejectEventRequest, ReportConfiguration, ReportIdentification, ReportServices,
    create_event, report_services,
};
use jaus::codec::{Message as _, Text};

/// Octets of a complete Report Identification.
const IDENTIFICATION_LEN: usize = 84;
/// Delay of a query that the rate limit holds back.
const PAUSE: Duration = Duration::from_millis(50);

impl RaNode {
    /// Processes a peer's heartbeat.
    pub(super) fn handle_heartbeat(&mut self, now: Instant, source: RaId) {
        let communicator = RaId {
            component: RaId::COMMUNICATOR,
            instance: 1,
            ..source
        };
        let peer = self.peers.entry(source.subsystem).or_insert_with(|| {
            tracing::info!(subsystem = source.subsystem, "RA subsystem found");
            Peer::new(now, communicator, &self.settings)
        });
        if source.component == RaId::COMMUNICATOR {
            peer.communicator = source;
        }
        self.serve(now, source.subsystem);
    }

    /// Processes a report addressed to the node itself; returns whether it was one.
    pub(super) fn handle_report(&mut self, now: Instant, message: &Message) -> bool {
        let subsystem = message.source.subsystem;
        let learned = match message.code {
            ReportIdentification::CODE => self.learn_identification(now, message),
            ReportConfiguration::CODE => self.learn_configuration(now, message, None),
            ReportServices::CODE => self.learn_services(now, message),
            Event::CODE => match message.body::<Event>() {
                Ok(event) if event.report_code == ReportConfiguration::CODE => {
                    self.learn_configuration(now, message, Some(event))
                }
                _ => return false,
            },
            ConfirmEventRequest::CODE => match confirmation(message) {
                Some(body) if body.report_code == ReportConfiguration::CODE => {
                    self.learn_subscription(now, message, body.response_code.0 == 0)
                }
                _ => return false,
            },
            RejectEventRequest::CODE if Some(message.destination) == self.asker() => {
                self.learn_subscription(now, message, false)
            }
            _ => return false,
        };
        if learned.is_none() {
            self.carrier.count(Counter::Malformed);
        }
        self.serve(now, subsystem);
        true
    }

    fn learn_identification(&mut self, now: Instant, message: &Message) -> Option<()> {
        let mut whole = message.clone();
        if message.data.len() < IDENTIFICATION_LEN {
            let mut data = message.data.to_vec();
            data.resize(IDENTIFICATION_LEN, 0);
            whole.data = data.into();
        }
        let report: ReportIdentification = whole.body().ok()?;
        let name = name_of(&report.identification);
        let source = message.source;
        let Some(peer) = self.peers.get_mut(&source.subsystem) else {
            return Some(());
        };
        match report.query_field {
            Whose::SUBSYSTEM => {
                peer.name_subsystem(name);
                peer.settle(now, Question::Subsystem);
            }
            Whose::NODE => {
                peer.name_node(source.node, name);
                peer.settle(now, Question::Node(source.node));
            }
            Whose::COMPONENT => {
                peer.name_component(source, name);
                peer.settle(now, Question::Name(source));
            }
            _ => {}
        }
        Some(())
    }

    /// A report by the communicator covers the whole subsystem, any other only the sender's node.
    fn learn_configuration(
        &mut self,
        now: Instant,
        message: &Message,
        event: Option<Event>,
    ) -> Option<()> {
        let report: ReportConfiguration = match event {
            Some(event) => {
                let (source, destination) = (message.source, message.destination);
                let code = ReportConfiguration::CODE;
                Message::new(source, destination, code, event.report_message)
                    .body()
                    .ok()?
            }
            None => message.body().ok()?,
        };
        let source = message.source;
        if !self.peers.contains_key(&source.subsystem) {
            return Some(());
        }
        let for_all = source.component == RaId::COMMUNICATOR;
        if for_all && report.node_list.is_empty() {
            self.lose(source.subsystem);
            return Some(());
        }
        let mut nodes = self.nodes(&report);
        let peer = self.peers.get_mut(&source.subsystem)?;
        if !for_all {
            nodes.retain(|node| node.id == source.node);
            let others = peer.subsystem.nodes.iter();
            let others = others.filter(|node| node.id != source.node);
            nodes.extend(others.cloned());
            nodes.sort_by_key(|node| node.id);
        }
        if for_all {
            peer.settle(now, Question::Configuration);
        }
        peer.configure(now, nodes);
        Some(())
    }

    /// The nodes of a report, without invalid or duplicate ids and components above the limit.
    fn nodes(&mut self, report: &ReportConfiguration) -> Vec<RaNodeEntry> {
        let mut room = self.settings.max_components;
        let mut nodes: Vec<RaNodeEntry> = Vec::new();
        let mut left_out = false;
        for listed in &report.node_list {
            let id = listed.node_rec.node_id;
            if !(1..=254).contains(&id) || nodes.iter().any(|node| node.id == id) {
                left_out = true;
                continue;
            }
            let mut components: Vec<RaComponentEntry> = Vec::new();
            for rec in &listed.component_list {
                let is_there = |known: &RaComponentEntry| {
                    (known.component, known.instance) == (rec.component_id, rec.instance_id)
                };
                let in_range = [rec.component_id, rec.instance_id]
                    .iter()
                    .all(|number| (1..=254).contains(number));
                if !in_range || room == 0 || components.iter().any(is_there) {
                    left_out = true;
                    continue;
                }
                room -= 1;
                components.push(RaComponentEntry {
                    component: rec.component_id,
                    instance: rec.instance_id,
                    ..RaComponentEntry::default()
                });
            }
            nodes.push(RaNodeEntry {
                id,
                components,
                ..RaNodeEntry::default()
            });
        }
        if left_out {
            self.carrier.count(Counter::ConfigurationTooLong);
        }
        nodes
    }

    fn learn_services(&mut self, now: Instant, message: &Message) -> Option<()> {
        let report: ReportServices = message.body().ok()?;
        let mut services: Vec<_> = report.service_list.iter().map(service).collect();
        let source = message.source;
        let Some(peer) = self.peers.get_mut(&source.subsystem) else {
            return Some(());
        };
        let others = peer.commands_but_of(source);
        if others + commands(&services) > self.settings.max_commands {
            services.clear();
            self.carrier.count(Counter::ConfigurationTooLong);
        }
        peer.set_services(source, services);
        peer.settle(now, Question::Services(source));
        Some(())
    }

    fn learn_subscription(&mut self, now: Instant, message: &Message, granted: bool) -> Option<()> {
        if let Some(peer) = self.peers.get_mut(&message.source.subsystem) {
            peer.subscribed |= granted;
            peer.settle(now, Question::Subscription);
        }
        Some(())
    }

    /// Source of our queries: the node manager of our first subsystem.
    pub(super) fn asker(&self) -> Option<RaId> {
        self.own.values().next().map(super::own::Own::manager)
    }

    /// Runs the due work for a peer: queries, notifications to the owner, or its removal.
    pub(super) fn serve(&mut self, now: Instant, subsystem: u8) {
        let Some(peer) = self.peers.get_mut(&subsystem) else {
            return;
        };
        if peer.heard + self.settings.silence <= now {
            self.carrier.forget(subsystem);
            self.lose(subsystem);
            return;
        }
        peer.refresh(now, &self.settings);
        self.greet(now, subsystem);
        self.ask(now, subsystem);
        let asks = !self.own.is_empty();
        if let Some(peer) = self.peers.get_mut(&subsystem) {
            peer.schedule(self.settings.silence, asks);
            if peer.take_news() {
                self.news.insert(subsystem);
            }
        }
    }

    /// Sends the due queries.
    fn ask(&mut self, now: Instant, subsystem: u8) {
        let Some(asker) = self.asker() else { return };
        let Some(peer) = self.peers.get_mut(&subsystem) else {
            return;
        };
        while let Some(question) = peer.poll_question(now, &self.settings) {
            if !self.questions.take(now, subsystem) {
                self.carrier.count(Counter::QuestionRate);
                peer.postpone(question, now + PAUSE);
                continue;
            }
            let message = ask(asker, peer.communicator, question);
            if let Ok(message) = message
                && let Err(error) = self.carrier.send(&message)
            {
                tracing::debug!(?message, %error, "query not sent");
            }
        }
    }

    /// Removes a peer.
    pub(super) fn lose(&mut self, subsystem: u8) {
        if self.peers.remove(&subsystem).is_some() {
            tracing::info!(subsystem, "RA subsystem lost");
            self.forget_subscriber(subsystem);
            self.news.insert(subsystem);
        }
    }
}

/// Builds the message of a query.
fn ask(
    asker: RaId,
    communicator: RaId,
    question: Question,
) -> Result<Message, jaus::codec::EncodeError> {
    let name =
        |id, query_field| Message::with_body(asker, id, &QueryIdentification { query_field });
    let configuration = QueryConfiguration {
        query_field: Parts::SUBSYSTEM,
    };
    match question {
        Question::Subsystem => name(communicator, Whose::SUBSYSTEM),
        Question::Configuration => Message::with_body(asker, communicator, &configuration),
        Question::Subscription => {
            let event = CreateEvent {
                create_event_rec: create_event::CreateEventRec {
                    request_id: 0,
                    report_code: ReportConfiguration::CODE,
                    event_type: create_event::EventType(super::subscriptions::EVERY_CHANGE),
                },
                query_rec: Some(create_event::QueryRec {
                    query_message: configuration.encode()?.slice(2..),
                }),
                ..CreateEvent::default()
            };
            Message::with_body(asker, communicator, &event)
        }
        Question::Node(node) => {
            let manager = RaId::new(communicator.subsystem, node, RaId::NODE_MANAGER, 1);
            name(manager, Whose::NODE)
        }
        Question::Name(id) => name(id, Whose::COMPONENT),
        Question::Services(id) => Message::with_body(asker, id, &QueryServices),
    }
}

/// Decodes a confirmation. OpenJAUS sets all bits of its presence vector, including undefined ones.
fn confirmation(message: &Message) -> Option<ConfirmEventRequest> {
    const RATE: u8 = 1;
    let mut data = message.data.to_vec();
    *data.first_mut()? &= RATE;
    let known = Message {
        data: data.into(),
        ..message.clone()
    };
    known.body().ok()
}

/// A name up to its first zero, as received: who shows it escapes it.
fn name_of(name: &Text) -> String {
    let octets = name.as_bytes().split(|&octet| octet == 0).next();
    String::from_utf8_lossy(octets.unwrap_or_default()).into_owned()
}

fn service(seq: &report_services::ServiceSeq) -> RaServiceEntry {
    let inputs = seq.input_message_list.iter();
    let outputs = seq.output_message_list.iter();
    let command = |code, presence| Command { code, presence };
    RaServiceEntry {
        kind: seq.service_rec.service_type,
        inputs: inputs
            .map(|rec| command(rec.command_code, rec.presence_vector))
            .collect(),
        outputs: outputs
            .map(|rec| command(rec.command_code, rec.presence_vector))
            .collect(),
    }
}
