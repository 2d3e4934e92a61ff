//! Client side of an RA component towards JAUS components: it queries, subscribes and takes control
//! in its own name, so that each JAUS component applies its own access control.
//!
//! | request of the RA component | handling |
//! |---|---|
//! | query | sent to the JAUS component, and the answer converted; no answer on timeout |
//! | event | a subscription to the JAUS component, if it has the event |
//! | service connection | a subscription at that rate; confirmed when the JAUS component has confirmed |
//! | control | Request Control with its authority; Confirm or Reject after the decision |
//! | command | converted and forwarded; the JAUS component obeys if this component has control |

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use bytes::Bytes;

use super::super::convert::{self, Ids, Words};
use super::super::counters::{Counter, Tally};
use super::super::course::Entries;
use super::super::pairs;
use super::codes::{
    CONFIRM_CONTROL, REJECT_CONTROL, RELEASE_CONTROL, REQUEST_CONTROL, is_management, needs_control,
};
use super::hold::{ClientLife, Hold};
use super::ra_event::RaEvent;
use super::target::{RaRequest, Target, element_query, place_report, places};
use crate::RaId;
use crate::connection::{ConnectionId, Connections, Request, ResponseCode};
use crate::convert::Refusal;
use crate::message::Message;
use crate::messages::ra33::CreateServiceConnection;
use jaus::address::JausId;
use jaus::codec::Message as _;
use jaus::messages::core::ReleaseControl;
use jaus::service::{
    ControlId, ControlLost, ControlNews, Inquiry, NoAnswer, Patience, Question, Stack,
    SubscriptionId, SubscriptionNews, Topic, When, code_of,
};

/// Requests of an RA component to JAUS components.
#[derive(Debug)]
pub(in crate::gateway) struct RaClient {
    pub(super) patience: Patience,
    ids: Ids,
    asked: BTreeMap<Inquiry, (Message, Target)>,
    /// Service connections of the RA component, by the subscription that serves each.
    connections: BTreeMap<SubscriptionId, ServiceConnection>,
    pub(super) held_controls: BTreeMap<ControlId, HeldControl>,
    /// Its places, by the RA id of the driver.
    pub(super) entries: BTreeMap<RaId, (Target, Entries)>,
    /// Pending queries for the active element of a list.
    pub(super) active: BTreeMap<Inquiry, RaId>,
    /// Its events.
    pub(super) events: BTreeMap<SubscriptionId, RaEvent>,
    /// Queued messages to the RA component, from the queried components.
    pub(super) said: Vec<Message>,
    /// Its signs of life.
    pub(super) life: ClientLife,
    /// Time of the last rejection of a command without control.
    pub(super) rejected: Option<Instant>,
    /// Time of the first probe by a JAUS component, and of the last release of leftover control.
    probed: Option<Instant>,
    disowned: Option<Instant>,
    /// Whether the gateway is stopping and requests no further control.
    pub(super) is_closed: bool,
}

/// A service connection of the RA component.
#[derive(Debug)]
struct ServiceConnection {
    connection: ConnectionId,
    words: Words,
    /// Whether the JAUS component has confirmed its event.
    confirmed: bool,
}

/// Parts of the proxy shared with its RA client.
pub(super) struct Common<'a> {
    pub(super) stack: &'a mut Stack,
    pub(super) connections: &'a mut Connections,
}

/// Control of the RA component over a JAUS component.
#[derive(Debug)]
pub(super) struct HeldControl {
    pub(super) request: Message,
    pub(super) peer: JausId,
    pub(super) held: bool,
    pub(super) hold: Hold,
}

impl RaClient {
    /// Maximum number of pending queries.
    const MOST_ASKED: usize = 64;
    /// Maximum number of service connections.
    const MOST_CONNECTIONS: usize = 64;
    /// Maximum number of components under control.
    const MOST_GRIPS: usize = 32;
    /// After this time, control from before a restart has timed out everywhere.
    const LEFTOVER: Duration = Duration::from_secs(6);
    /// Minimum interval between releases of leftover control.
    const DISOWNING: Duration = Duration::from_millis(100);

    pub(super) fn new(patience: Duration, ids: Ids) -> Self {
        const TRIES: u32 = 3;
        Self {
            patience: Patience {
                tries: TRIES,
                interval: patience / TRIES,
            },
            ids,
            asked: BTreeMap::new(),
            connections: BTreeMap::new(),
            held_controls: BTreeMap::new(),
            entries: BTreeMap::new(),
            active: BTreeMap::new(),
            events: BTreeMap::new(),
            said: Vec::new(),
            life: ClientLife::default(),
            rejected: None,
            probed: None,
            disowned: None,
            is_closed: false,
        }
    }

    pub(super) fn words(&self, as_what: RaId, minor: u8) -> Words {
        Words::new(self.ids.clone(), as_what.component, minor)
    }

    /// Whether requests, connections, events or control are active.
    pub(in crate::gateway) fn is_busy(&self) -> bool {
        let is_served = !(self.connections.is_empty() && self.events.is_empty());
        is_served || !(self.asked.is_empty() && self.held_controls.is_empty())
    }

    /// Takes the queued messages to the RA component.
    pub(super) fn take_said(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.said)
    }

    /// Handles a message of the RA component to a JAUS component.
    pub(super) fn handle_ra(&mut self, request: &mut RaRequest<'_>) {
        match request.message.code {
            REQUEST_CONTROL => self.request_control(request),
            RELEASE_CONTROL => self.release_control(request.now, request.peer.id, request.stack),
            // Answers to requests that JAUS components never send to RA components.
            CONFIRM_CONTROL | REJECT_CONTROL => request.refuse(Counter::Unasked),
            _ => self.pass_on(request),
        }
    }

    fn pass_on(&mut self, request: &mut RaRequest<'_>) {
        let RaRequest {
            now, message, peer, ..
        } = *request;
        let drives = is_management(message.code) || matches!(message.code, 0x0400..=0x04FF);
        if drives && needs_control(message.code) && self.refuse_uncontrolled(request) {
            return;
        }
        if self.enter(request) || self.handle_event_request(request) {
            return;
        }
        let words = self.words(message.destination, peer.minor);
        let place = places(message, peer).filter(|it| it.query == message.code);
        let payload = match place.and_then(|places| element_query(places, message)) {
            Some(query) => Ok(query),
            None => words.to_jaus(message.code, &message.data),
        };
        let payload = match payload {
            Ok(payload) => payload,
            Err(refusal) => return convert::refuse(now, request.tally, message.code, &refusal),
        };
        let Some(report) = code_of(&payload).and_then(pairs::report_of) else {
            request.tally.add(Counter::CommandsFromRa);
            self.note_setpoint(now, (message, &payload), peer, request.stack);
            return request.stack.send_octets(peer.id, payload);
        };
        let same = |it: &Message| {
            it.destination == message.destination
                && it.code == message.code
                && it.data == message.data
        };
        if self.asked.values().any(|(it, _)| same(it)) {
            return request.tally.add(Counter::Repeated);
        }
        if self.asked.len() >= Self::MOST_ASKED {
            return request.refuse(Counter::TooManyWaiting);
        }
        request.tally.add(Counter::QueriesFromRa);
        let inquiry =
            request
                .stack
                .ask(now, peer.id, Question::new(payload, report), self.patience);
        self.asked.insert(inquiry, (message.clone(), peer));
    }

    /// Handles the answer to a query, or its timeout.
    pub(super) fn handle_answer(
        &mut self,
        now: Instant,
        inquiry: Inquiry,
        answer: Result<Bytes, NoAnswer>,
        stack: &mut Stack,
        tally: &mut Tally,
    ) {
        if self.handle_active(now, inquiry, &answer, stack, tally) {
            return;
        }
        let Some((request, peer)) = self.asked.remove(&inquiry) else {
            return;
        };
        match answer {
            Ok(report) => {
                let place = places(&request, peer).filter(|it| it.query == request.code);
                let converted = match place {
                    Some(places) => place_report(places, &report),
                    None => self.words(request.destination, peer.minor).to_ra(&report),
                };
                let answer = to_answer(now, &request, (&report, converted), tally);
                self.said.extend(answer);
            }
            Err(none) => tally.refuse(now, Counter::Unanswered, request.code, none.peer),
        }
    }

    /// Forwards an unsolicited message of a JAUS component, such as the response to a command.
    pub(in crate::gateway) fn handle_report(
        &mut self,
        now: Instant,
        (from, minor): (RaId, u8),
        to: RaId,
        report: &Bytes,
        tally: &mut Tally,
    ) {
        let request = Message::new(to, from, 0, Bytes::new());
        let converted = self.words(from, minor).to_ra(report);
        let answer = to_answer(now, &request, (report, converted), tally);
        self.said.extend(answer);
    }

    /// Opens a service connection of the RA component.
    pub(super) fn connect(
        &mut self,
        now: Instant,
        (id, request): (ConnectionId, Request),
        peer: Target,
        Common { stack, connections }: Common<'_>,
        tally: &mut Tally,
    ) {
        // The connection may exist at another rate.
        self.disconnect(now, id, stack);
        let report = request.code;
        if self.connections.len() >= Self::MOST_CONNECTIONS {
            tally.refuse(now, Counter::TooManyConnections, report, request.client);
            return connections.refuse(id, ResponseCode::CONNECTION_REFUSED);
        }
        let words = self.words(request.provider, peer.minor);
        let Some(topic) = topic(&request, peer.id, &words) else {
            tally.refuse(now, Counter::NoCounterpart, report, request.client);
            return connections.refuse(id, ResponseCode::COMPONENT_NOT_CAPABLE);
        };
        match stack.subscribe(now, &topic, self.patience) {
            Ok(subscription) => {
                let served = ServiceConnection {
                    connection: id,
                    words,
                    confirmed: false,
                };
                self.connections.insert(subscription, served);
            }
            Err(why) => {
                tally.refuse(now, Counter::NotConverted, report, why);
                connections.refuse(id, ResponseCode::CONNECTION_REFUSED);
            }
        }
    }

    /// Closes a service connection of the RA component.
    pub(super) fn disconnect(&mut self, now: Instant, id: ConnectionId, stack: &mut Stack) {
        let ended = self.connections.iter().find(|(_, it)| it.connection == id);
        if let Some((&subscription, _)) = ended {
            self.connections.remove(&subscription);
            stack.unsubscribe(now, subscription);
        }
    }

    /// Handles news of a subscription.
    pub(super) fn handle_subscription(
        &mut self,
        now: Instant,
        (id, news): (SubscriptionId, SubscriptionNews),
        connections: &mut Connections,
        tally: &mut Tally,
    ) {
        if self.handle_event_news(now, id, &news, tally) {
            return;
        }
        let Some(served) = self.connections.get_mut(&id) else {
            return;
        };
        let connection = served.connection;
        match news {
            SubscriptionNews::Up { .. } => {
                if !std::mem::replace(&mut served.confirmed, true) {
                    connections.accept(now, connection);
                }
            }
            SubscriptionNews::Report { report, .. } => match served.words.to_ra(&report) {
                Ok((_, data)) => {
                    tally.add(Counter::ReportsToRa);
                    connections.set_report(now, connection, data);
                }
                Err(refusal) => {
                    let code = code_of(&report).unwrap_or_default();
                    convert::refuse(now, tally, code, &refusal);
                }
            },
            SubscriptionNews::Down { .. } => connections.clear_report(connection),
            SubscriptionNews::Ended(why) => {
                let confirmed = served.confirmed;
                self.connections.remove(&id);
                tally.refuse(now, Counter::Unanswered, CreateServiceConnection::CODE, why);
                match confirmed {
                    true => connections.end(connection),
                    false => connections.refuse(connection, ResponseCode::COMPONENT_NOT_CAPABLE),
                }
            }
        }
    }

    fn request_control(&mut self, request: &mut RaRequest<'_>) {
        let RaRequest {
            now, message, peer, ..
        } = *request;
        let Some(&authority) = message.data.first() else {
            return request.refuse(Counter::NotConverted);
        };
        if let Some(held_control) = self
            .held_controls
            .values_mut()
            .find(|it| it.peer == peer.id)
        {
            held_control.request = message.clone();
            if held_control.held {
                self.confirm_control(message);
            }
            return;
        }
        if self.is_closed {
            return self.reject_control(message);
        }
        if self.held_controls.len() >= Self::MOST_GRIPS {
            request.refuse(Counter::TooManyWaiting);
            return self.reject_control(message);
        }
        match request
            .stack
            .request_control(now, peer.id, authority, self.patience)
        {
            Ok(id) => {
                let held_control = HeldControl {
                    request: message.clone(),
                    peer: peer.id,
                    held: false,
                    hold: Hold::new(),
                };
                self.held_controls.insert(id, held_control);
            }
            Err(why) => {
                request
                    .tally
                    .refuse(now, Counter::NotInControl, message.code, why);
                self.reject_control(message);
            }
        }
    }

    fn release_control(&mut self, now: Instant, peer: JausId, stack: &mut Stack) {
        let held = self.held_controls.iter().find(|(_, it)| it.peer == peer);
        if let Some((&id, _)) = held {
            self.held_controls.remove(&id);
            stack.release_control(now, id);
        }
    }

    /// Handles a liveness probe of a JAUS component. Without control or a pending request, the
    /// gateway may have restarted while the component still obeys the RA component, and an answer
    /// would keep that control alive. Such control is released at once, instead of by its timeout.
    /// The release is repeated with the probes, because it may be lost.
    pub(super) fn handle_probe(&mut self, now: Instant, peer: JausId, stack: &mut Stack) {
        let begun = *self.probed.get_or_insert(now);
        let is_recent = |at: Instant| now < at + Self::DISOWNING;
        if now >= begun + Self::LEFTOVER
            || self.disowned.is_some_and(is_recent)
            || self.held_controls.values().any(|it| it.peer == peer)
        {
            return;
        }
        self.disowned = Some(now);
        stack.send(peer, &ReleaseControl {});
    }

    /// Handles news of control over a JAUS component.
    pub(super) fn handle_control(
        &mut self,
        now: Instant,
        id: ControlId,
        news: ControlNews,
        stack: &mut Stack,
        tally: &mut Tally,
    ) {
        let Some(held_control) = self.held_controls.get_mut(&id) else {
            return;
        };
        let request = held_control.request.clone();
        match news {
            ControlNews::Granted => {
                held_control.held = true;
                tally.add(Counter::ControlFromRa);
                self.confirm_control(&request);
            }
            ControlNews::Refused(why) => {
                self.held_controls.remove(&id);
                tally.refuse(now, Counter::NotInControl, request.code, why);
                self.reject_control(&request);
            }
            ControlNews::Lost(why) => {
                self.held_controls.remove(&id);
                log_loss(&request, why);
                stack.release_control(now, id);
                self.reject_control(&request);
            }
            ControlNews::Status(_) => {}
            ControlNews::Released => drop(self.held_controls.remove(&id)),
        }
    }

    fn confirm_control(&mut self, request: &Message) {
        let accepted = Bytes::from_static(&[0]);
        self.said.push(request.answer(CONFIRM_CONTROL, accepted));
    }

    /// OpenJAUS takes any confirmation for a grant, and denies by rejecting.
    pub(super) fn reject_control(&mut self, request: &Message) {
        self.said.push(request.answer(REJECT_CONTROL, Bytes::new()));
    }
}

/// Converts a JAUS report to the answer to an RA message.
fn to_answer(
    now: Instant,
    request: &Message,
    (report, converted): (&Bytes, Result<(u16, Bytes), Refusal>),
    tally: &mut Tally,
) -> Option<Message> {
    match converted {
        Ok((code, data)) => {
            tally.add(Counter::ReportsToRa);
            Some(request.answer(code, data))
        }
        Err(refusal) => {
            let code = code_of(report).unwrap_or_default();
            convert::refuse(now, tally, code, &refusal);
            None
        }
    }
}

/// The JAUS topic of a report; `None` if there is no such report.
fn topic(request: &Request, peer: JausId, words: &Words) -> Option<Topic> {
    let state = pairs::state(request.code)?;
    let query = words.to_jaus(state.query(), &state.query_for(request.presence));
    let query = query.ok()?;
    Some(Topic {
        peer,
        report: code_of(&query).and_then(pairs::report_of)?,
        query,
        // The lowest rate that events can encode.
        when: When::hz(request.rate.max(1.0 / 60.0)),
    })
}

fn log_loss(request: &Message, why: ControlLost) {
    let (client, of) = (request.source, request.destination);
    tracing::info!(%client, %of, %why, "control lost");
}
