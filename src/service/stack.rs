//! The stack: all services of one component as a single state machine without I/O.

mod client;
mod safeguard;

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Instant;

use bytes::Bytes;

use super::client::{Controls, Sessions, Subscriptions};
use super::context::News;
use super::control::{AccessControl, Control, Management};
use super::events::{CommandTrial, EventSettings, Events, Outcome, Refusal};
use super::inquiries::Inquiries;
use super::life::{Life, Rank};
use super::order::{SendOrder, is_stop};
use super::{
    Change, Context, ControlId, ControlNews, Directory, Discovery, Handled, Incarnation, Inquiry,
    NoAnswer, NotPublished, Outbox, Publication, Service, SessionId, SessionState, Standing,
    StopCause, SubscriptionId, SubscriptionNews, UnsafeService, code_of,
};
use safeguard::{Faults, is_query};

use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::{Outgoing, Received};
use crate::messages::core::{QueryAuthority, QueryControl, QueryStatus};
use crate::wire::{Broadcast, Priority};

/// A component without a network: its services, its directory, and its pending queries.
pub struct Stack {
    discovery: Discovery,
    services: Vec<Box<dyn Service>>,
    subscribers: Events,
    control: Control,
    /// The standing that the services see.
    standing: Standing,
    /// Liveness of the clients that matter.
    life: Life,
    /// The order in which clients have sent setpoints and stops.
    order: SendOrder,
    /// The client in control whose death would go undetected, once a warning about it was logged.
    mute: Option<JausId>,
    faults: Faults,
    /// When it was last called.
    called: Option<Instant>,
    news: News,
    inquiries: Inquiries,
    subscriptions: Subscriptions,
    controls: Controls,
    sessions: Sessions,
    out: Outbox,
    events: VecDeque<Event>,
}

/// A notification for the application.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// A component was found, has changed, or was lost.
    Change(Change),
    /// A query was answered, or has timed out.
    Answer(Inquiry, Result<Bytes, NoAnswer>),
    /// News of a subscription.
    Subscription(SubscriptionId, SubscriptionNews),
    /// News of the control over a peer.
    Control(ControlId, ControlNews),
    /// The progress of a session.
    Session(SessionId, SessionState),
    /// The component's own state or its controller has changed.
    Standing(Standing),
    /// A message that no service consumed.
    Message(Received),
}

impl Stack {
    /// Room for events that is kept while there are none.
    const EVENTS_AT_REST: usize = 4;

    /// A component with its discovery and its other services, to which [`Incarnation`] is added.
    #[must_use]
    pub fn new(discovery: Discovery, mut services: Vec<Box<dyn Service>>) -> Self {
        let out = Outbox::new(discovery.id());
        let incarnation = Incarnation::random();
        services.push(Box::new(incarnation));
        let stack = Self {
            discovery,
            services,
            subscribers: Events::new(EventSettings::default()),
            control: Control::default(),
            standing: Standing::default(),
            life: Life::new(incarnation),
            order: SendOrder::default(),
            mute: None,
            faults: Faults::default(),
            called: None,
            news: News::default(),
            inquiries: Inquiries::default(),
            subscriptions: Subscriptions::default(),
            controls: Controls::default(),
            sessions: Sessions::default(),
            out,
            events: VecDeque::new(),
        };
        stack.with_control(Control::default())
    }

    /// Sets the limits of events for clients.
    #[must_use]
    pub fn event_settings(mut self, settings: EventSettings) -> Self {
        self.subscribers = Events::new(settings);
        self
    }

    /// Offers Access Control: only the client in control may command.
    #[must_use]
    pub fn access_control(self, settings: AccessControl) -> Self {
        self.with_control(Control::with_access_control(settings))
    }

    /// Offers Management and Access Control: the component acts only while a client controls it and
    /// has made it ready.
    #[must_use]
    pub fn management(self, settings: Management) -> Self {
        self.with_control(Control::with_management(settings))
    }

    /// The stack with this control. Only for a stack that has not started.
    fn with_control(mut self, control: Control) -> Self {
        self.standing = *control.standing();
        self.control = control;
        self.tell_offers();
        self
    }

    /// The component's id.
    #[must_use]
    pub const fn id(&self) -> JausId {
        self.out.source()
    }

    /// The component's incarnation.
    #[must_use]
    pub const fn incarnation(&self) -> Incarnation {
        self.life.own()
    }

    /// The directory of known components.
    #[must_use]
    pub fn directory(&self) -> Arc<Directory> {
        self.discovery.directory()
    }

    /// The number of events that run for clients.
    #[must_use]
    pub fn event_count(&self) -> usize {
        self.subscribers.len()
    }

    /// The current subscriptions of clients: the query and the rate in hertz, or no rate for
    /// reports on change.
    pub fn subscribed(&self) -> impl Iterator<Item = (&Bytes, Option<f64>)> {
        self.subscribers.wanted()
    }

    /// Ends the subscriptions and the control of a client that another layer has found to be gone.
    pub fn forget(&mut self, now: Instant, client: JausId) {
        self.control.forget(client, &mut self.out);
        self.subscribers.forget(client);
        self.collect(now);
    }

    /// The component's state, and who controls it.
    #[must_use]
    pub const fn standing(&self) -> &Standing {
        &self.standing
    }

    /// How many setpoints were refused because their senders had superseded them, or because they were held up.
    #[must_use]
    pub const fn refused_setpoints(&self) -> u64 {
        self.order.refused()
    }

    /// Reports, for the application, that the answer to the query with this code has changed.
    pub fn announce(&mut self, now: Instant, query: u16) {
        self.news.changed.insert(query);
        self.collect(now);
    }

    /// Publishes a report, for the application: the service that
    /// [publishes](super::Handlers::publishes) it answers queries with it from now on, and
    /// subscribers on change get it at once.
    ///
    /// # Errors
    /// If no service publishes it.
    pub fn publish(&mut self, now: Instant, publication: &Publication) -> Result<(), NotPublished> {
        let taken = self.pass_on(publication);
        self.collect(now);
        taken
    }

    fn pass_on(&mut self, publication: &Publication) -> Result<(), NotPublished> {
        let (services, mut context) = self.services_in_context();
        let is_taken = services
            .iter_mut()
            .any(|service| service.handle_publication(publication, &mut context) == Handled::Yes);
        is_taken.then_some(()).ok_or_else(|| publication.refused())
    }

    /// Reports, for the application, that the command with this code has ended, and whether
    /// successfully.
    pub fn end_command(&mut self, now: Instant, command: u16, successful: bool) {
        self.news.ended.push((command, successful));
        self.collect(now);
    }

    /// Starts the component: the services get their first wake-up.
    pub fn start(&mut self, now: Instant) {
        self.wake(now);
    }

    /// Handles a message to this component.
    pub fn handle_message(&mut self, now: Instant, message: &Received) {
        self.end_overdue(now);
        // One that was given up is watched again as soon as it says anything: before it is answered.
        self.watch_setter(now, message.source);
        if self.life.is_outdated(message) && !is_stop(&message.payload) {
            self.order.refuse(message, "it was held up for too long");
            return;
        }
        self.life.hear(now, message);
        self.end_control_of_restarted(now, message);
        self.discovery.hear(now, message);
        self.subscriptions.hear(now, message.source);
        let answered = self.inquiries.handle_message(now, message, &mut self.out);
        let mut handled = self.discovery.handle_message(now, message, &mut self.out);
        if handled == Handled::No {
            handled = self.handle_as_client(now, message);
        }
        if handled == Handled::No {
            handled = self.handle_event_request(now, message);
        }
        if handled == Handled::No {
            handled = self.handle_control(now, message);
        }
        if handled == Handled::No {
            handled = self.handle_message_for_services(now, message);
        }
        self.collect(now);
        match answered {
            Some(inquiry) => {
                self.events
                    .push_back(Event::Answer(inquiry, Ok(message.payload.clone())));
            }
            None if handled == Handled::No => {
                self.events.push_back(Event::Message(message.clone()));
            }
            None => {}
        }
    }

    fn handle_control(&mut self, now: Instant, message: &Received) -> Handled {
        let (client, before) = (message.source, *self.control.standing());
        let is_alive = |client| self.life.is_alive(now, client);
        let control = &mut self.control;
        let handled = control.handle_message(now, message, is_alive, &mut self.out);
        let after = self.control.standing();
        let begins = !before.acts_for(client) && after.acts_for(client)
            || !before.obeys(client) && after.obeys(client);
        let stops = before.obeys(client) && is_stop(&message.payload);
        if begins || stops {
            self.order.note_turn(now, message);
        }
        self.watch_setter(now, client);
        handled
    }

    /// Watches the sender of a message if it has set an emergency.
    fn watch_setter(&mut self, now: Instant, sender: JausId) {
        if self.control.has_emergency_of(sender) {
            self.life.watch(now, sender, Rank::EmergencySetter);
        }
    }

    /// Handles the acknowledgement of a message by the peer's node.
    pub fn handle_acknowledged(&mut self, now: Instant, peer: JausId) {
        self.life.acknowledged(now, peer);
    }

    /// Passes a message to the services. A command ends, as unsuccessful, the command event with
    /// the same code that a client is waiting for.
    fn handle_message_for_services(&mut self, now: Instant, message: &Received) -> Handled {
        if let Some(code) = code_of(&message.payload)
            && self.standing.acts_for(message.source)
        {
            self.subscribers.end_command(code, false, &mut self.out);
        }
        self.handle_by_services(now, message)
    }

    fn handle_by_services(&mut self, now: Instant, message: &Received) -> Handled {
        let (services, mut context) = self.services_in_context();
        let handled = services
            .iter_mut()
            .any(|service| service.handle_message(now, message, &mut context) == Handled::Yes);
        if handled { Handled::Yes } else { Handled::No }
    }

    /// The services, and the context in which to call them.
    fn services_in_context(&mut self) -> (&mut Vec<Box<dyn Service>>, Context<'_>) {
        let context = Context::new(
            &mut self.out,
            &self.standing,
            &self.life,
            &mut self.order,
            &mut self.news,
        );
        (&mut self.services, context)
    }

    fn handle_event_request(&mut self, now: Instant, message: &Received) -> Handled {
        let services = &self.services;
        let events = &mut self.subscribers;
        match events.handle_message(now, message, |it| is_query(services, it), &mut self.out) {
            Outcome::NotOurs => return Handled::No,
            Outcome::Done => {}
            Outcome::TryCommand(trial) => self.carry_out(now, &trial),
            Outcome::Try(trial) => {
                let report = self.answer(now, trial.client(), &trial.query);
                let events = &mut self.subscribers;
                events.conclude(now, &trial, report, &mut self.out);
            }
        }
        if self.subscribers.has(message.source) {
            self.life.watch(now, message.source, Rank::Subscriber);
        }
        Handled::Yes
    }

    /// Runs a command for a client that requests a command event, unless it must be refused.
    fn carry_out(&mut self, now: Instant, trial: &CommandTrial) {
        let code = trial.code;
        let is_reported = self.services.iter().any(|it| it.tells_end_of(code));
        let refusal = if !is_reported {
            Some(Refusal::NobodyTells)
        } else if !self.standing.acts_for(trial.client()) {
            Some(Refusal::NotAllowed)
        } else {
            None
        };
        let events = &mut self.subscribers;
        if events.begin_command(now, trial, refusal, &mut self.out) {
            self.handle_by_services(now, &trial.command());
        }
    }

    /// The component's answer to a client's query, if any.
    fn answer(&mut self, now: Instant, client: JausId, query: &Bytes) -> Option<Bytes> {
        let id = self.id();
        let message = Received {
            source: client,
            destination: id,
            to: id,
            priority: Priority::Standard,
            broadcast: Broadcast::None,
            payload: query.clone(),
            sequence: None,
            path: None,
            acknowledged: false,
        };
        // Messages sent meanwhile are the answer and are not transmitted. A query changes nothing.
        let out = std::mem::replace(&mut self.out, Outbox::new(id));
        let news = std::mem::take(&mut self.news);
        let discovered = self.discovery.handle_quoted(now, &message, &mut self.out);
        let by_control = self.handle_control(now, &message) == Handled::Yes;
        if discovered == Handled::No && !by_control {
            self.handle_by_services(now, &message);
        }
        let found = std::mem::replace(&mut self.news, news);
        self.news.faults.extend(found.faults);
        self.news.ended.extend(found.ended);
        self.news.published.extend(found.published);
        let mut said = std::mem::replace(&mut self.out, out);
        std::iter::from_fn(|| said.pop())
            .find(|answer| answer.destination == client)
            .map(|answer| answer.payload)
    }

    /// Call this when the time of [`poll_timeout`](Self::poll_timeout) has come. Earlier calls are
    /// harmless.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.wake(now);
    }

    /// Handles changes that another component of the node has made to the shared
    /// [directory](super::NodeDirectory).
    pub fn handle_directory(&mut self, now: Instant) {
        self.collect(now);
    }

    /// Sends a message without waiting for an answer.
    pub fn send<M: Message>(&mut self, destination: JausId, message: &M) {
        self.out.send(destination, message);
    }

    /// Sends octets that begin with a message code, without waiting for an answer.
    pub fn send_octets(&mut self, destination: JausId, payload: Bytes) {
        self.out.send_octets(destination, payload);
    }

    /// Ends all subscriptions and releases all control.
    ///
    /// Everything that the services move stops, and the component obeys no more commands.
    pub fn take_leave(&mut self, now: Instant) {
        self.stop(&StopCause::Ended);
        self.control.end(&mut self.out);
        self.follow_control(now);
        self.subscriptions.cancel_all(now, &mut self.out);
        self.controls.release_all(now, &mut self.out);
        self.sessions = Sessions::default();
    }

    /// Whether a release of control still waits for its peer's confirmation.
    #[must_use]
    pub fn is_releasing(&self) -> bool {
        self.controls.is_releasing()
    }

    /// Adds a service while the component runs, and notifies the peers.
    ///
    /// # Errors
    /// As for [`check`](Self::check).
    pub fn offer(&mut self, now: Instant, service: Box<dyn Service>) -> Result<(), UnsafeService> {
        self.check_service(service.as_ref())?;
        self.services.push(service);
        self.publish_offers(now);
        self.wake(now);
        Ok(())
    }

    /// Withdraws a service in every version, stops what it moves, and notifies the peers. Returns
    /// whether it was offered.
    pub fn withdraw(&mut self, now: Instant, urn: &str) -> bool {
        let is_meant = |service: &mut Box<dyn Service>| {
            let offers = service.offers();
            offers.iter().any(|id| id.urn == urn)
        };
        let (services, mut context) = self.services_in_context();
        let mut is_any = false;
        for mut service in services.extract_if(.., is_meant) {
            is_any = true;
            service.handle_stop(&StopCause::Ended, &mut context);
        }
        self.publish_offers(now);
        is_any
    }

    fn publish_offers(&mut self, now: Instant) {
        self.tell_offers();
        self.collect(now);
    }

    fn tell_offers(&mut self) {
        let services = self.services.iter().flat_map(|service| service.offers());
        let guards = self.subscribers.offers().into_iter();
        let offers = guards.chain(self.control.offers()).chain(services);
        self.discovery.set_offers(offers, &mut self.out);
    }

    /// The next message to send.
    pub fn poll_transmit(&mut self) -> Option<Outgoing> {
        self.out.pop()
    }

    /// The next notification for the application.
    pub fn poll_event(&mut self) -> Option<Event> {
        let event = self.events.pop_front();
        if event.is_none() {
            // A directory of hundreds of components brings as many events once: 40 KiB, which an
            // idle component would hold for as long as it lives.
            self.events.shrink_to(Self::EVENTS_AT_REST);
        }
        event
    }

    /// When to call [`handle_timeout`](Self::handle_timeout).
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let services = self
            .services
            .iter()
            .filter_map(|service| service.poll_timeout());
        services
            .chain(self.discovery.poll_timeout())
            .chain(self.control.poll_timeout())
            .chain(self.life.poll_timeout())
            .chain(self.next_beat())
            .chain(self.subscribers.poll_timeout())
            .chain(self.inquiries.poll_timeout())
            .chain(self.subscriptions.poll_timeout())
            .chain(self.controls.poll_timeout())
            .chain(self.sessions.poll_timeout())
            .min()
    }

    fn wake(&mut self, now: Instant) {
        self.end_overdue(now);
        self.discovery.handle_timeout(now, &mut self.out);
        self.probe(now);
        self.subscribers.expire(now, &mut self.out);
        let (services, mut context) = self.services_in_context();
        for service in services {
            service.handle_timeout(now, &mut context);
        }
        self.inquiries.handle_timeout(now, &mut self.out);
        self.subscriptions.handle_timeout(now, &mut self.out);
        self.controls.handle_timeout(now, &mut self.out);
        self.collect(now);
    }

    fn collect(&mut self, now: Instant) {
        while let Some(change) = self.discovery.poll_change() {
            self.subscriptions.handle_change(now, &change);
            if let Change::Lost(id, _) = change {
                self.control.forget(id, &mut self.out);
                self.subscribers.forget(id);
            }
            self.news.changed.extend(Discovery::QUERIES);
            self.events.push_back(Event::Change(change));
        }
        self.follow_services(now);
        // A stop may itself report a fault, and a change of control a handover.
        self.follow_services(now);
        self.watch_clients(now);
        for publication in std::mem::take(&mut self.news.published) {
            if let Err(error) = self.pass_on(&publication) {
                tracing::error!(%error, "report dropped");
            }
        }
        self.tell_subscribers(now);
        self.collect_client_news(now);
    }

    /// Passes what the services have reported on to control.
    fn follow_services(&mut self, now: Instant) {
        self.follow_faults();
        if let Some(client) = self.news.late.take()
            && self.is_moving()
        {
            tracing::warn!(id = %self.id(), %client, "stopped: what the client sends arrives too late");
            self.stop(&StopCause::Late(client));
        }
        if let Some(to) = self.news.handover.take() {
            self.control.hand_over(now, to, &mut self.out);
        }
        self.follow_control(now);
    }

    /// Passes the decisions of control on to the services.
    fn follow_control(&mut self, now: Instant) {
        let after = *self.control.standing();
        let before = std::mem::replace(&mut self.standing, after);
        if before == after {
            return;
        }
        if before.state != after.state {
            self.news.changed.insert(QueryStatus::CODE);
        }
        if before.controller != after.controller {
            self.news
                .changed
                .extend([QueryControl::CODE, QueryAuthority::CODE]);
        }
        if let Some(cause) = StopCause::of(&before, &after) {
            self.stop(&cause);
        }
        let (services, mut context) = self.services_in_context();
        for service in services {
            service.handle_standing(now, &before, &mut context);
        }
        self.events.push_back(Event::Standing(after));
    }

    /// Sends the reports of clients' subscriptions that are due or have changed.
    fn tell_subscribers(&mut self, now: Instant) {
        let ended = std::mem::take(&mut self.news.ended);
        let changed = std::mem::take(&mut self.news.changed);
        for (command, successful) in ended {
            let events = &mut self.subscribers;
            events.end_command(command, successful, &mut self.out);
        }
        for query in changed {
            self.subscribers.handle_change(now, query);
        }
        let mut reports: BTreeMap<Bytes, Option<Bytes>> = BTreeMap::new();
        while let Some(due) = self.subscribers.poll_due(now) {
            let report = match reports.get(&due.query) {
                Some(report) => report.clone(),
                None => self.answer(now, due.client(), &due.query),
            };
            reports.insert(due.query.clone(), report.clone());
            let events = &mut self.subscribers;
            events.report_due(now, &due, report, &mut self.out);
        }
    }
}
