//! Compares the events of a whole component with the state machine of their definition: both get
//! the same random requests, must send the same messages to the same clients, and must keep the
//! same events.

use std::collections::BTreeMap;

use bytes::Bytes;
use proptest::prelude::*;

use crate::address::JausId;
use crate::codec::Message;
use crate::codec::machine::Outcome;
use crate::messages::core::events::machine::{
    Behaviour, CreateEventOrUpdateEvent, Event, Machine, State, UpdateEventOrCancelEvent,
};
use crate::messages::core::query_events::QueryEventsVar;
use crate::messages::core::{self, *};
use crate::service::stack_rig::StackRig;
use crate::service::{Management, Transport, code_of};

/// Queries that the component answers, queries that it never answers, and a message that is no
/// query.
fn query(number: u8) -> Bytes {
    let query = match number {
        0 => QueryStatus.encode(),
        1 => QueryControl.encode(),
        2 => QueryTimeout.encode(),
        3 => QueryTime::default().encode(),
        4 => QueryEvents::default().encode(),
        _ => Resume.encode(),
    };
    query.unwrap()
}

/// The events of all clients: the query of each, by client and number.
#[derive(Default)]
struct Kept {
    events: BTreeMap<(JausId, u8), Bytes>,
    /// The receiver and the message code.
    said: Vec<(JausId, u16)>,
}

fn wanted(message: CreateEventOrUpdateEvent<'_>) -> &Bytes {
    match message {
        CreateEventOrUpdateEvent::CreateEvent(create) => &create.query_message,
        CreateEventOrUpdateEvent::UpdateEvent(update) => &update.query_message,
    }
}

impl Behaviour for Kept {
    type Envelope = JausId;

    fn is_supported(&self, message: CreateEventOrUpdateEvent<'_>) -> bool {
        (0..3).any(|number| query(number) == wanted(message))
    }

    fn event_exists(&self, message: UpdateEventOrCancelEvent<'_>, client: &JausId) -> bool {
        let id = match message {
            UpdateEventOrCancelEvent::UpdateEvent(update) => update.event_id,
            UpdateEventOrCancelEvent::CancelEvent(cancel) => cancel.event_id,
        };
        self.events.contains_key(&(*client, id))
    }

    fn is_command_supported(&self, _: &CreateCommandEvent) -> bool {
        false
    }

    /// A client has one event per query, with the lowest free number.
    fn store_event(&mut self, message: CreateEventOrUpdateEvent<'_>, client: &JausId) {
        let query = wanted(message).clone();
        let id = match message {
            CreateEventOrUpdateEvent::UpdateEvent(update) => Some(update.event_id),
            CreateEventOrUpdateEvent::CreateEvent(_) => {
                let mut own = self.events.iter().filter(|((of, _), _)| of == client);
                own.find(|(_, known)| **known == query)
                    .map(|((_, id), _)| *id)
            }
        };
        let mut free = (1..=u8::MAX).filter(|id| !self.events.contains_key(&(*client, *id)));
        let id = id.or_else(|| free.next()).unwrap();
        self.events.insert((*client, id), query);
    }

    fn remove_event(&mut self, message: &CancelEvent, client: &JausId) {
        self.events.remove(&(*client, message.event_id));
    }

    fn store_command_event(&mut self, _: &CreateCommandEvent, _: &JausId) {
        panic!("no command can be told of");
    }

    fn send_event(&mut self, _: CreateEventOrUpdateEvent<'_>, client: &JausId) {
        self.said.push((*client, core::Event::CODE));
    }

    fn send_report_events(&mut self, client: &JausId) {
        self.said.push((*client, ReportEvents::CODE));
    }

    fn send_report_event_timeout(&mut self, client: &JausId) {
        self.said.push((*client, ReportEventTimeout::CODE));
    }

    fn send_confirm_event_request(&mut self, client: &JausId) {
        self.said.push((*client, ConfirmEventRequest::CODE));
    }

    fn send_reject_event_request(&mut self, client: &JausId) {
        self.said.push((*client, RejectEventRequest::CODE));
    }
}

/// A client's request; queries and events by number.
#[derive(Debug, Clone)]
enum Request {
    Create(u8),
    Update(u8, u8),
    Cancel(u8),
    Command,
    List,
    Timeout,
}

fn request() -> impl Strategy<Value = Request> {
    prop_oneof![
        4 => (0..6_u8).prop_map(Request::Create),
        3 => (0..5_u8, 0..6_u8).prop_map(|(event, query)| Request::Update(event, query)),
        2 => (0..5_u8).prop_map(Request::Cancel),
        1 => Just(Request::Command),
        2 => Just(Request::List),
        1 => Just(Request::Timeout),
    ]
}

/// A component and the state machine to compare it with.
struct Pair {
    rig: StackRig,
    machine: Machine,
    kept: Kept,
}

impl Pair {
    fn new() -> Self {
        let services: Vec<Box<dyn crate::service::Service>> = vec![Box::new(Transport)];
        let rig = StackRig::new(services, |stack| stack.management(Management::new()));
        let mut kept = Kept::default();
        let machine = Machine::start(&mut kept);
        Self { rig, machine, kept }
    }

    /// Both handle a message, and must send the same. Returns the messages.
    fn hear<'m, M: Message>(
        &mut self,
        client: &'m JausId,
        message: &'m M,
        event: impl FnOnce(&'m M, &'m JausId) -> Event<'m, JausId>,
    ) -> Vec<Bytes> {
        let said = self.rig.hear(*client, message);
        let outcome = self.machine.step(event(message, client), &mut self.kept);
        assert_eq!(outcome, Outcome::Handled);
        let codes = said.iter().map(|(to, said)| (*to, code_of(said).unwrap()));
        let codes: Vec<_> = codes.collect();
        assert_eq!(codes, std::mem::take(&mut self.kept.said), "{}", M::NAME);
        said.into_iter().map(|(_, said)| said).collect()
    }

    fn ask(&mut self, client: &JausId, request: &Request) {
        match *request {
            Request::Create(number) => {
                let create = CreateEvent {
                    event_type: create_event::EventType(1),
                    query_message: query(number),
                    ..CreateEvent::default()
                };
                self.hear(client, &create, Event::CreateEvent);
            }
            Request::Update(event_id, number) => {
                let update = UpdateEvent {
                    event_id,
                    event_type: update_event::EventType(1),
                    query_message: query(number),
                    ..UpdateEvent::default()
                };
                self.hear(client, &update, Event::UpdateEvent);
            }
            Request::Cancel(event_id) => {
                let cancel = CancelEvent {
                    request_id: 1,
                    event_id,
                };
                self.hear(client, &cancel, Event::CancelEvent);
            }
            Request::Command => {
                let create = CreateCommandEvent {
                    command_message: Resume.encode().unwrap(),
                    ..CreateCommandEvent::default()
                };
                self.hear(client, &create, Event::CreateCommandEvent);
            }
            Request::List => self.list(client),
            Request::Timeout => {
                self.hear(client, &QueryEventTimeout, Event::QueryEventTimeout);
            }
        }
    }

    /// A client's list of events must match that of the state machine.
    fn list(&mut self, client: &JausId) {
        let all = QueryEvents {
            query_events_var: QueryEventsVar::AllEventsRec(query_events::AllEventsRec::default()),
        };
        let said = self.hear(client, &all, Event::QueryEvents);
        let report = ReportEvents::decode(&said[0]).unwrap();
        let listed = report.event_list.into_iter();
        let listed: BTreeMap<_, _> = listed.map(|it| (it.event_id, it.query_message)).collect();
        let own = self.kept.events.iter().filter(|((of, _), _)| of == client);
        let own = own.map(|((_, id), query)| (*id, query.clone()));
        assert_eq!(listed, own.collect());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_component_keeps_the_events_that_the_machine_of_events_keeps(
        requests in prop::collection::vec((1..3_u8, request()), 1..50),
    ) {
        let mut pair = Pair::new();
        for (client, request) in &requests {
            pair.ask(&JausId::new(42, 2, *client), request);
            prop_assert_eq!(pair.rig.stack.event_count(), pair.kept.events.len());
            prop_assert_eq!(pair.machine.state(), State::Ready);
        }
    }
}
