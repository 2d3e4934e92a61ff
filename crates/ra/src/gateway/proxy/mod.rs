//! Proxy: an RA component as a JAUS component. Its [`Stack`] answers from the RA component's
//! reports and queries it for missing ones.
//!
//! | client request | handling |
//! |---|---|
//! | query of a state (pose, velocity, …) | answered from the last report if that is fresh; else on the next report, within the [timeout](super::Settings::patience) |
//! | subscription to a state | a [service connection](streams) at the highest requested rate keeps the report fresh; Events reports it at each client's rate, or on change |
//! | other query | relayed; the next report that answers it goes to the client |
//! | control request | [`Lease`] requests control from the RA component, and forwards the answer |
//! | command | converted and forwarded, if the client is in control |
//! | set or execute a list | [kept here](listing), and sent to the RA driver on execution |
//!
//! The same stack is the RA component's client side towards JAUS components: see [`RaClient`].

mod codes;
mod emergency;
mod entering;
mod events;
mod held_control;
mod hold;
mod lease;
mod listing;
mod mirror;
mod motion;
mod ra_client;
mod ra_event;
mod ready;
mod stop;
mod streams;
mod subscribed;
mod target;
mod waiting;

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use bytes::Bytes;

use self::codes::{
    CONFIRM_CONTROL, REJECT_CONTROL, REPORT_CONTROL, answer_to_command, crosses, is_management,
    needs_control,
};
pub(super) use self::codes::{QUERY_STATUS, STATUS};
use self::lease::{Lease, Terms};
use self::listing::{Listed, Listing};
use self::mirror::{Mirror, Mirrored};
use self::motion::Motion;
pub(super) use self::ra_client::RaClient;
use self::ready::Readiness;
pub(super) use self::ready::status;
use self::streams::Streams;
use self::subscribed::hz_of;
use self::target::RaRequest;
pub(super) use self::target::Target;
use self::waiting::{Held, Relayed};
use super::convert::{self, Ids, Words};
use super::counters::{Counter, Tally};
use super::roles::Role;
use super::{pairs, roles};
use crate::RaId;
use crate::connection::{self, Connections, ResponseCode};
use crate::ids::RaComponent;
use crate::message::Message;
use jaus::address::JausId;
use jaus::codec::Message as _;
use jaus::endpoint::{Outgoing, Received};
use jaus::messages::core::{
    self, CreateEvent, QueryHeartbeatPulse, ReleaseControl, RequestControl, SetAuthority,
    UpdateEvent,
};
use jaus::service::{
    Discovery, Event, Liveness, Profile, Scope, Service, Stack, Timing, Transport, code_of,
};

/// JAUS proxy of an RA component.
pub(super) struct Proxy {
    ra: RaId,
    pub(super) stack: Stack,
    pub(super) ra_client: RaClient,
    /// Expiry of a guest that no RA system lists.
    pub(super) kept_until: Option<Instant>,
    patience: Duration,
    words: Words,
    mirror: Mirror,
    /// Whether its last status was the emergency state.
    in_emergency: bool,
    /// Whether its client has sent Standby without a later Resume.
    in_standby: bool,
    lease: Lease,
    motion: Motion,
    /// Readiness of the gateway as reported to the RA component.
    readiness: Readiness,
    /// The list of places, of a driver that drives to places.
    listing: Option<Listing>,
    streams: Streams,
    held: Vec<Held>,
    relayed: VecDeque<Relayed>,
    /// Service connections with the RA component, in both directions.
    connections: Connections,
    /// The gateway's RA id.
    own: RaId,
    to_ra: Vec<(u16, Bytes)>,
    /// Time of the next review of client subscriptions.
    review: Option<Instant>,
}

/// Parameters of a proxy.
pub(super) struct Plan {
    pub(super) ra: RaId,
    /// The gateway's RA id.
    pub(super) own: RaId,
    pub(super) id: JausId,
    pub(super) profile: Profile,
    pub(super) ids: Ids,
    pub(super) patience: Duration,
    pub(super) authority: u8,
    pub(super) timeout: Duration,
}

impl Proxy {
    /// Maximum number of queued messages that wait for reports, of each kind.
    const MOST_WAITING: usize = 64;
    /// Maximum age of a report that is sent without a new query.
    const FRESH: Duration = Duration::from_millis(50);
    /// Minimum interval between queries for the same report.
    const ASK_AGAIN: Duration = Duration::from_millis(250);
    /// Rate of reports for subscriptions to changes.
    const CHANGES_HZ: f64 = 10.0;
    /// Interval of subscription reviews.
    const REVIEW: Duration = Duration::from_secs(1);

    pub(super) fn new(plan: Plan) -> Self {
        let mirror = Mirror::default();
        let role = roles::of_part(RaComponent(plan.ra.component));
        let seed = plan.id.to_u32().into();
        let (scope, timing) = (Scope::Subsystem, Timing::default());
        let discovery = Discovery::new(plan.id, plan.profile, scope, timing, seed);
        let minor = role.map_or(0, |role| role.service.minor);
        let words = Words::new(plan.ids.clone(), plan.ra.component, minor);
        let mirrored = Mirrored {
            mirror: mirror.clone(),
            words: words.clone(),
            offers: offers(plan.ra, role),
            timeout: plan.timeout,
        };
        let terms = Terms {
            patience: plan.patience,
            authority: plan.authority,
            timeout: plan.timeout,
        };
        let halt = stop::halt(RaComponent(plan.ra.component));
        let listing = Listing::of(role, plan.patience);
        let mut services: Vec<Box<dyn Service>> = vec![
            Box::new(Transport),
            Box::new(Liveness::new()),
            Box::new(mirrored),
        ];
        if let (Some(listing), Some(&role)) = (listing.clone(), role) {
            services.push(Box::new(Listed { listing, role }));
        }
        let stack = Stack::new(discovery, services);
        let motion = Motion::new(plan.id, stack.incarnation());
        Self {
            ra: plan.ra,
            stack,
            ra_client: RaClient::new(plan.patience, plan.ids),
            kept_until: None,
            patience: plan.patience,
            words,
            mirror,
            in_emergency: false,
            in_standby: false,
            lease: Lease::new(plan.own, plan.ra, halt, terms),
            motion,
            readiness: Readiness::default(),
            listing,
            streams: Streams::new(plan.ra, plan.own),
            held: Vec::new(),
            relayed: VecDeque::new(),
            connections: Connections::new(connection::Settings {
                max_provided: Self::MOST_WAITING,
                max_wanted: Self::MOST_WAITING,
                ..connection::Settings::default()
            }),
            own: plan.own,
            to_ra: Vec::new(),
            review: None,
        }
    }

    /// Starts the proxy. Releases control left over from an earlier gateway with our id.
    pub(super) fn start(&mut self, now: Instant) {
        self.stack.start(now);
        if !RaComponent(self.ra.component).is_infrastructure() {
            self.lease.reclaim(now);
        }
    }

    /// The RA component.
    pub(super) const fn ra(&self) -> RaId {
        self.ra
    }

    /// Processes a message of a JAUS component.
    pub(super) fn handle_message(&mut self, now: Instant, message: &Received, tally: &mut Tally) {
        let client = message.source;
        self.end_overdue(now);
        self.motion.hear(now, message);
        self.end_control_of_restarted(now, tally);
        match code_of(&message.payload) {
            Some(RequestControl::CODE) => {
                if let Ok(request) = RequestControl::decode(&message.payload) {
                    self.lease.request(now, client, request.authority_code);
                }
            }
            Some(SetAuthority::CODE) if self.lease.obeys(client) => {
                if let Ok(set) = SetAuthority::decode(&message.payload) {
                    self.lease.request(now, client, set.authority_code);
                }
            }
            Some(ReleaseControl::CODE) => self.lease.release(now, client),
            Some(QueryHeartbeatPulse::CODE) => {
                self.ra_client.handle_probe(now, client, &mut self.stack);
                self.stack.handle_message(now, message);
            }
            Some(CreateEvent::CODE) => {
                let created = CreateEvent::decode(&message.payload);
                let wanted = created.map(|it| (hz_of(&it), it.query_message));
                self.subscribe(now, message, wanted.ok(), tally);
            }
            Some(UpdateEvent::CODE) => {
                let updated = UpdateEvent::decode(&message.payload);
                let hz = |it: &UpdateEvent| match it.event_type.0 {
                    0 => it.requested_periodic_rate_hz(),
                    _ => Self::CHANGES_HZ,
                };
                let wanted = updated.map(|it| (hz(&it), it.query_message));
                self.subscribe(now, message, wanted.ok(), tally);
            }
            Some(code) if self.is_listed(code) => self.handle_listed(now, message, code, tally),
            Some(code) if crosses(code) => self.cross(now, message, code, tally),
            _ => self.stack.handle_message(now, message),
        }
        self.follow(now, tally);
    }

    /// Forwards a message to the RA component.
    fn cross(&mut self, now: Instant, message: &Received, code: u16, tally: &mut Tally) {
        let (ra_code, body) = match self.words.to_ra(&message.payload) {
            Ok(converted) => converted,
            Err(refusal) => return convert::refuse(now, tally, code, &refusal),
        };
        match pairs::report_of(ra_code) {
            Some(report) if pairs::state(report).is_some() => {
                self.tell_given_speed(now, report);
                if self.is_fresh(now, report) {
                    self.stack.handle_message(now, message);
                } else {
                    self.hold(now, message, report, None, tally);
                }
            }
            Some(report) => self.relay(now, message.source, report, (ra_code, body), tally),
            None => self.command(now, message.source, (ra_code, body), tally),
        }
    }

    fn command(&mut self, now: Instant, client: JausId, words: (u16, Bytes), tally: &mut Tally) {
        let code = words.0;
        if needs_control(code) && !self.lease.obeys(client) {
            return tally.refuse(now, Counter::NotInControl, code, client);
        }
        if let Some(why) = self.holds_back(now, code) {
            return tally.refuse(now, why, code, client);
        }
        tally.add(Counter::CommandsToRa);
        self.note_command(code, &words.1);
        self.heed_management(code);
        self.give(now, words);
        if is_management(code) {
            self.mirror.outdate(STATUS);
            self.ask(STATUS);
        }
        if let Some(report) = answer_to_command(code) {
            self.expect(now, client, report);
        }
    }

    /// Processes a message of the RA component: for the gateway, or for the JAUS component at the
    /// RA id it was sent to.
    pub(super) fn handle_ra(
        &mut self,
        now: Instant,
        message: &Message,
        target: Option<Target>,
        tally: &mut Tally,
    ) {
        self.end_overdue(now);
        self.ra_client.life.hear(now, message.code);
        if self.connections.handle_message(now, message) {
            self.follow_connections(now, target, tally);
        } else if let Some(target) = target {
            let Self {
                ra_client, stack, ..
            } = self;
            ra_client.handle_ra(&mut RaRequest {
                now,
                message,
                peer: target,
                stack,
                tally,
            });
        } else {
            self.handle_for_us(now, message, tally);
        }
        self.follow(now, tally);
    }

    fn handle_for_us(&mut self, now: Instant, message: &Message, tally: &mut Tally) {
        let (code, data) = (message.code, &message.data);
        match code {
            CONFIRM_CONTROL => {
                let response = data.first().copied().unwrap_or_default();
                self.lease.handle_confirm(now, response);
            }
            REJECT_CONTROL => self.lease.handle_reject(),
            QUERY_STATUS => self.to_ra.push((STATUS, self.own_status())),
            REPORT_CONTROL => {
                if let Some(controller) = ready::controller(message) {
                    self.lease.handle_controller(now, controller);
                }
            }
            _ if pairs::query_of(code).is_some() => self.handle_report(now, code, data, tally),
            _ => tally.refuse(now, Counter::NoCounterpart, code, self.ra),
        }
    }

    /// Processes events of service connections. `target` is the provider of a new one.
    fn follow_connections(&mut self, now: Instant, target: Option<Target>, tally: &mut Tally) {
        while let Some(event) = self.connections.poll_event() {
            match event {
                connection::Event::Wanted(id, request) => {
                    self.provide(now, (id, request), target, tally);
                }
                connection::Event::Ended(id) => {
                    self.readiness.disconnect(id);
                    if !self.streams.handle_end(now, id) {
                        self.ra_client.disconnect(now, id, &mut self.stack);
                    }
                }
                connection::Event::Established(id, hz) => self.streams.handle_established(id, hz),
                connection::Event::Refused(id, _) => drop(self.streams.handle_end(now, id)),
                connection::Event::Silent(id) => self.streams.handle_silence(now, id),
                connection::Event::Report(_, message) => {
                    self.handle_report(now, message.code, &message.data, tally);
                }
            }
        }
    }

    /// Handles a requested service connection: to a JAUS component, or to the gateway's status,
    /// which RA drivers need in order to move.
    fn provide(
        &mut self,
        now: Instant,
        (id, request): (connection::ConnectionId, connection::Request),
        target: Option<Target>,
        tally: &mut Tally,
    ) {
        let Self {
            ra_client,
            stack,
            connections,
            ..
        } = self;
        match target {
            Some(target) => {
                let common = ra_client::Common { stack, connections };
                ra_client.connect(now, (id, request), target, common, tally);
            }
            None if request.provider == self.own && request.code == STATUS => {
                self.connections.accept(now, id);
                self.readiness.connect(now, id);
                self.report_readiness(now);
            }
            None => self
                .connections
                .refuse(id, ResponseCode::COMPONENT_NOT_CAPABLE),
        }
    }

    /// Processes an event of the stack.
    pub(super) fn handle_event(&mut self, now: Instant, event: Event, tally: &mut Tally) {
        let Self {
            ra_client,
            stack,
            connections,
            ..
        } = self;
        match event {
            Event::Answer(inquiry, answer) => {
                ra_client.handle_answer(now, inquiry, answer, stack, tally);
            }
            Event::Subscription(id, news) => {
                ra_client.handle_subscription(now, (id, news), connections, tally);
            }
            Event::Control(id, news) => ra_client.handle_control(now, id, news, stack, tally),
            Event::Message(_) | Event::Change(_) | Event::Standing(_) | Event::Session(..) => {}
        }
    }

    fn handle_report(&mut self, now: Instant, report: u16, data: &Bytes, tally: &mut Tally) {
        if self.handle_place(now, report, data, tally) {
            return tally.add(Counter::ReportsFromRa);
        }
        let converted = match self.words.to_jaus(report, data) {
            Ok(converted) => converted,
            Err(refusal) => return convert::refuse(now, tally, report, &refusal),
        };
        if pairs::state(report).is_some() {
            tally.add(Counter::ReportsFromRa);
            self.tell_state(now, report, data.clone(), &converted);
            return;
        }
        let waiting = |it: &Relayed| it.report == report;
        match self.relayed.iter().position(waiting) {
            Some(first) => {
                if let Some(relayed) = self.relayed.remove(first) {
                    tally.add(Counter::ReportsFromRa);
                    self.stack.send_octets(relayed.client, converted);
                }
            }
            None => tally.refuse(now, Counter::Unasked, report, self.ra),
        }
    }

    fn tell_state(&mut self, now: Instant, report: u16, data: Bytes, converted: &[u8]) {
        let data = self.shown_status(report, data);
        let changed = self.mirror.keep(now, report, data);
        let (ready, held) = std::mem::take(&mut self.held)
            .into_iter()
            .partition::<Vec<_>, _>(|it| it.report == report);
        self.held = held;
        for held in ready {
            self.stack.handle_message(now, &held.message);
        }
        let query = code_of(converted).and_then(pairs::query_of);
        if let Some(query) = query.filter(|_| changed) {
            self.stack.announce(now, query);
        }
    }

    /// Notes the time of the subsystem's last message.
    pub(super) fn hear_subsystem(&mut self, at: Instant) {
        self.ra_client.life.hear_subsystem(at);
    }

    /// Removes a lost JAUS client.
    pub(super) fn forget(&mut self, now: Instant, client: JausId, tally: &mut Tally) {
        self.lease.forget(now, client);
        self.stack.forget(now, client);
        self.held.retain(|it| it.message.source != client);
        self.relayed.retain(|it| it.client != client);
        self.review = Some(now);
        self.follow(now, tally);
    }

    /// Runs due timers; calls before [`poll_timeout`](Self::poll_timeout) do no harm.
    pub(super) fn handle_timeout(&mut self, now: Instant, tally: &mut Tally) {
        if self.stack.poll_timeout().is_some_and(|due| due <= now) {
            self.stack.handle_timeout(now);
        }
        self.end_overdue(now);
        self.tend_client(now, tally);
        if self.ra_client.take_probe(now) {
            self.ask(STATUS);
        }
        self.release_again(now);
        self.connections.handle_timeout(now);
        self.follow_connections(now, None, tally);
        self.to_ra.extend(self.streams.take_queries(now));
        self.handle_list_timeout(now, tally);
        let Self {
            ra_client, stack, ..
        } = self;
        ra_client.handle_timeout(now, stack, tally);
        self.ask_again(now, tally);
        self.relayed.retain(|it| {
            let waits = now < it.until;
            if !waits {
                tally.refuse(now, Counter::Unanswered, it.report, it.client);
            }
            waits
        });
        self.follow(now, tally);
    }

    /// Sends pending decisions of the lease, and updates the service connections to client
    /// subscriptions.
    fn follow(&mut self, now: Instant, tally: &mut Tally) {
        let said = self.lease.take_said();
        if said.granted {
            tally.add(Counter::ControlOfRa);
        }
        let before = self.mirror.controller_is(self.lease.controller());
        if !before {
            self.follow_controller(now);
        }
        self.stop_list_where_due(now, tally);
        self.to_ra.extend(said.to_ra);
        self.report_readiness(now);
        for (client, payload) in said.to_clients {
            self.stack.send_octets(client, payload);
        }
        if !before {
            self.stack.announce(now, core::QueryControl::CODE);
        }
        if self.review.is_some_and(|due| due <= now) {
            let wanted = self.wanted();
            self.streams.want(now, &wanted, &mut self.connections);
            self.review = (!wanted.is_empty()).then(|| now + Self::REVIEW);
        }
    }

    /// Whether everything that was under control on either side is released.
    pub(super) fn is_released(&self) -> bool {
        self.lease.is_released() && !self.stack.is_releasing()
    }

    /// Ends control and connections of the RA component at shutdown.
    pub(super) fn take_leave(&mut self, now: Instant, tally: &mut Tally) {
        self.lease.end(now);
        self.ra_client.is_closed = true;
        self.ra_client.end_control(now, &mut self.stack);
        let nothing = BTreeMap::new();
        self.streams.want(now, &nothing, &mut self.connections);
        self.follow(now, tally);
        self.stack.take_leave(now);
    }

    /// The next message to JAUS components.
    pub(super) fn poll_transmit(&mut self) -> Option<Outgoing> {
        let probe = self.motion.poll_transmit();
        probe.or_else(|| self.stack.poll_transmit())
    }

    /// Takes the queued messages to the RA component.
    pub(super) fn take_said(&mut self) -> Vec<Message> {
        let (own, ra) = (self.own, self.ra);
        let ours = std::mem::take(&mut self.to_ra).into_iter();
        let ours = ours.map(|(code, data)| Message::new(own, ra, code, data));
        let connections = std::iter::from_fn(|| self.connections.poll_transmit());
        let ra_client = self.ra_client.take_said();
        ours.chain(connections).chain(ra_client).collect()
    }

    /// Whether we control the RA component, or have requested control.
    pub(super) const fn is_engaged(&self) -> bool {
        self.lease.is_engaged()
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let held = self.held.iter().map(|it| it.next.min(it.until));
        let relayed = self.relayed.iter().map(|it| it.until);
        let listing = self.listing.as_ref();
        [
            self.ra_client.poll_timeout(),
            self.ra_client.tend_at(),
            listing.and_then(|it| it.lock().poll_timeout()),
            self.stack.poll_timeout(),
            self.lease.poll_timeout(),
            self.motion.poll_timeout(),
            self.readiness.poll_timeout(),
            self.streams.poll_timeout(),
            self.connections.poll_timeout(),
            self.review,
            self.kept_until,
        ]
        .into_iter()
        .flatten()
        .chain(held)
        .chain(relayed)
        .min()
    }
}

/// The services that the proxy offers.
fn offers(ra: RaId, role: Option<&Role>) -> Vec<jaus::codec::ServiceId> {
    let guarded = !RaComponent(ra.component).is_infrastructure();
    let guards = [
        core::access_control::V1_1,
        core::access_control::V1_0,
        core::management::V1_1,
        core::management::V1_0,
    ];
    let guards = guards.into_iter().filter(|_| guarded);
    guards.chain(role.map(|role| role.service)).collect()
}
