//! An RA component among JAUS components as their client: it asks, is told regularly, and takes
//! control, all in its own name, so that each JAUS component decides for itself what it may.
//!
//! | the RA component | becomes of it |
//! |---|---|
//! | sends a query | the JAUS component is asked, and its answer converted; nothing if it says nothing |
//! | creates an event | an event of the JAUS component, if that has the like |
//! | creates a service connection | an event of the JAUS component at that rate; confirmed when that one has confirmed |
//! | requests control | Request Control with its authority; Confirm or Reject when it is decided |
//! | sends a command | converted and passed on; the JAUS component obeys if this one is in control |

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
use super::target::{Target, element_query, place_report, places};
use crate::connection::{ConnectionId, Connections, Request, ResponseCode};
use crate::convert::Refusal;
use crate::messages::ra33::CreateServiceConnection;
use crate::{Message, RaId};
use jaus::address::JausId;
use jaus::codec::Message as _;
use jaus::messages::core::ReleaseControl;
use jaus::service::{
    ControlId, ControlLost, ControlNews, Inquiry, NoAnswer, Patience, Stack, SubscriptionId,
    SubscriptionNews, Topic, When, code_of,
};

/// What an RA component wants of JAUS components.
#[derive(Debug)]
pub(in crate::gateway) struct RaClient {
    pub(super) patience: Patience,
    ids: Ids,
    asked: BTreeMap<Inquiry, (Message, Target)>,
    told: BTreeMap<SubscriptionId, ServiceConnection>,
    pub(super) held_controls: BTreeMap<ControlId, HeldControl>,
    /// The places that it sets, by whom it sets them at.
    pub(super) entries: BTreeMap<RaId, (Target, Entries)>,
    /// Questions at which element a list is.
    pub(super) active: BTreeMap<Inquiry, RaId>,
    /// Its events.
    pub(super) events: BTreeMap<SubscriptionId, RaEvent>,
    /// Messages for the RA component, from those whom it asked.
    pub(super) said: Vec<Message>,
    /// Its signs of life.
    pub(super) life: ClientLife,
    /// When it was last told that it commands without control.
    pub(super) rejected: Option<Instant>,
    /// When a JAUS component probed it for the first time, and when control was disowned last.
    probed: Option<Instant>,
    disowned: Option<Instant>,
    /// Whether the gateway stops, and requests control for nobody any more.
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

/// What the client half shares with the rest of its component.
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
    /// The most questions that wait for an answer.
    const MOST_ASKED: usize = 64;
    /// The most service connections.
    const MOST_TOLD: usize = 64;
    /// The most components under control.
    const MOST_GRIPS: usize = 32;
    /// By then control from before a restart has timed out everywhere.
    const LEFTOVER: Duration = Duration::from_secs(6);
    /// Between two releases of control that the component does not have.
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
            told: BTreeMap::new(),
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

    /// Whether anything is under way.
    pub(in crate::gateway) fn is_busy(&self) -> bool {
        let is_told = !(self.told.is_empty() && self.events.is_empty());
        is_told || !(self.asked.is_empty() && self.held_controls.is_empty())
    }

    /// What is to be sent to the RA component since this was asked last.
    pub(super) fn take_said(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.said)
    }

    /// The RA component sends a message to what it takes for another one, and is a JAUS component.
    pub(super) fn handle_ra(
        &mut self,
        now: Instant,
        request: &Message,
        peer: Target,
        stack: &mut Stack,
        tally: &mut Tally,
    ) {
        match request.code {
            REQUEST_CONTROL => self.request_control(now, request, peer, stack, tally),
            RELEASE_CONTROL => self.release_control(now, peer.id, stack),
            // Answers to what JAUS components never ask of RA components.
            CONFIRM_CONTROL | REJECT_CONTROL => {
                tally.refuse(now, Counter::Unasked, request.code, request.source);
            }
            _ => self.pass_on(now, request, peer, stack, tally),
        }
    }

    fn pass_on(
        &mut self,
        now: Instant,
        request: &Message,
        peer: Target,
        stack: &mut Stack,
        tally: &mut Tally,
    ) {
        let drives = is_management(request.code) || matches!(request.code, 0x0400..=0x04FF);
        if drives
            && needs_control(request.code)
            && self.refuse_uncontrolled(now, request, peer, tally)
        {
            return;
        }
        if self.enter(now, request, peer, stack, tally)
            || self.handle_event_request(now, request, peer, stack, tally)
        {
            return;
        }
        let words = self.words(request.destination, peer.minor);
        let place = places(request, peer).filter(|it| it.query == request.code);
        let payload = match place.and_then(|places| element_query(places, request)) {
            Some(query) => Ok(query),
            None => words.to_jaus(request.code, &request.data),
        };
        let payload = match payload {
            Ok(payload) => payload,
            Err(refusal) => return convert::refuse(now, tally, request.code, &refusal),
        };
        let Some(report) = code_of(&payload).and_then(pairs::report_of) else {
            tally.add(Counter::CommandsFromRa);
            self.note_setpoint(now, (request, &payload), peer, stack);
            return stack.send_octets(peer.id, payload);
        };
        let same = |it: &Message| {
            it.destination == request.destination
                && it.code == request.code
                && it.data == request.data
        };
        if self.asked.values().any(|(it, _)| same(it)) {
            return tally.add(Counter::Repeated);
        }
        if self.asked.len() >= Self::MOST_ASKED {
            return tally.refuse(now, Counter::TooManyWaiting, request.code, request.source);
        }
        tally.add(Counter::QueriesFromRa);
        let inquiry = stack.ask(now, peer.id, payload, report, self.patience);
        self.asked.insert(inquiry, (request.clone(), peer));
    }

    /// A question has been answered, or nobody will.
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
                let told = match place {
                    Some(places) => place_report(places, &report),
                    None => self.words(request.destination, peer.minor).to_ra(&report),
                };
                let told = tell(now, &request, (&report, told), tally);
                self.said.extend(told);
            }
            Err(none) => tally.refuse(now, Counter::Unanswered, request.code, none.peer),
        }
    }

    /// A JAUS component says something that was not asked for, such as what it made of a command.
    pub(in crate::gateway) fn handle_report(
        &mut self,
        now: Instant,
        (from, minor): (RaId, u8),
        to: RaId,
        report: &Bytes,
        tally: &mut Tally,
    ) {
        let request = Message::new(to, from, 0, Bytes::new());
        let told = self.words(from, minor).to_ra(report);
        let told = tell(now, &request, (report, told), tally);
        self.said.extend(told);
    }

    /// The RA component wants to be told a report regularly.
    pub(super) fn connect(
        &mut self,
        now: Instant,
        (id, request): (ConnectionId, Request),
        peer: Target,
        Common { stack, connections }: Common<'_>,
        tally: &mut Tally,
    ) {
        // At another rate than before, perhaps.
        self.disconnect(now, id, stack);
        let report = request.code;
        if self.told.len() >= Self::MOST_TOLD {
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
                let told = ServiceConnection {
                    connection: id,
                    words,
                    confirmed: false,
                };
                self.told.insert(subscription, told);
            }
            Err(why) => {
                tally.refuse(now, Counter::NotConverted, report, why);
                connections.refuse(id, ResponseCode::CONNECTION_REFUSED);
            }
        }
    }

    /// The RA component does not want to be told any more.
    pub(super) fn disconnect(&mut self, now: Instant, id: ConnectionId, stack: &mut Stack) {
        let ended = self.told.iter().find(|(_, it)| it.connection == id);
        if let Some((&subscription, _)) = ended {
            self.told.remove(&subscription);
            stack.unsubscribe(now, subscription);
        }
    }

    /// Something has become of an event.
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
        let Some(told) = self.told.get_mut(&id) else {
            return;
        };
        let connection = told.connection;
        match news {
            SubscriptionNews::Up { .. } => {
                if !std::mem::replace(&mut told.confirmed, true) {
                    connections.accept(now, connection);
                }
            }
            SubscriptionNews::Report { report, .. } => match told.words.to_ra(&report) {
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
                let confirmed = told.confirmed;
                self.told.remove(&id);
                tally.refuse(now, Counter::Unanswered, CreateServiceConnection::CODE, why);
                match confirmed {
                    true => connections.end(connection),
                    false => connections.refuse(connection, ResponseCode::COMPONENT_NOT_CAPABLE),
                }
            }
        }
    }

    fn request_control(
        &mut self,
        now: Instant,
        request: &Message,
        peer: Target,
        stack: &mut Stack,
        tally: &mut Tally,
    ) {
        let Some(&authority) = request.data.first() else {
            return tally.refuse(now, Counter::NotConverted, request.code, request.source);
        };
        if let Some(held_control) = self
            .held_controls
            .values_mut()
            .find(|it| it.peer == peer.id)
        {
            held_control.request = request.clone();
            if held_control.held {
                self.confirm_control(request);
            }
            return;
        }
        if self.is_closed {
            return self.reject_control(request);
        }
        if self.held_controls.len() >= Self::MOST_GRIPS {
            tally.refuse(now, Counter::TooManyWaiting, request.code, request.source);
            return self.reject_control(request);
        }
        match stack.request_control(now, peer.id, authority, self.patience) {
            Ok(id) => {
                let held_control = HeldControl {
                    request: request.clone(),
                    peer: peer.id,
                    held: false,
                    hold: Hold::new(),
                };
                self.held_controls.insert(id, held_control);
            }
            Err(why) => {
                tally.refuse(now, Counter::NotInControl, request.code, why);
                self.reject_control(request);
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

    /// A JAUS component probes the RA component. If that has no control of it and requests none, this
    /// may be a gateway that was started again, and the component may still obey the RA component,
    /// which the answer would show to be alive. Such control is released at once, instead of by its
    /// timeout. The release is repeated with the probes, because it may be lost.
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

    /// Something has become of control.
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

    /// OpenJAUS takes any confirmation for a yes, and says no by rejecting.
    pub(super) fn reject_control(&mut self, request: &Message) {
        self.said.push(request.answer(REJECT_CONTROL, Bytes::new()));
    }
}

/// A JAUS report, and what it became, as an answer to an RA message.
fn tell(
    now: Instant,
    request: &Message,
    (report, told): (&Bytes, Result<(u16, Bytes), Refusal>),
    tally: &mut Tally,
) -> Option<Message> {
    match told {
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

/// What stands for a report among JAUS components; `None` if there is no such report.
fn topic(request: &Request, peer: JausId, words: &Words) -> Option<Topic> {
    let state = pairs::state(request.code)?;
    let query = words.to_jaus(state.query(), &state.query_for(request.presence));
    let query = query.ok()?;
    Some(Topic {
        peer,
        report: code_of(&query).and_then(pairs::report_of)?,
        query,
        // What events can say at least.
        when: When::hz(request.rate.max(1.0 / 60.0)),
    })
}

fn log_loss(request: &Message, why: ControlLost) {
    let (client, of) = (request.source, request.destination);
    tracing::info!(%client, %of, %why, "control lost");
}
