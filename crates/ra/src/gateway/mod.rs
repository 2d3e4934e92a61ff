//! Gateway between systems of the Reference Architecture 3.x and the SAE standards: each side sees
//! the components of the other as its own.
//!
//! | part | purpose |
//! |---|---|
//! | [`Gateway`] | both halves without I/O and clock: driven by datagrams, messages and time |
//! | `proxy` | an RA component as a JAUS component: services that answer from its reports |
//! | `course` | lists of places: elements on the JAUS side, numbers on the RA side |
//! | `picture` | a JAUS subsystem as an RA subsystem: each component once per service |
//! | [`RaGateway`] | the running gateway: sockets, node, timers |
//!
//! The id table ([`ra::ids`](crate::ids)) and the message conversion
//! ([`ra::convert`](crate::convert)) connect the two. A message without equivalent on the other
//! side is refused, counted, and logged once per kind.
//!
//! Towards RA systems, all JAUS clients appear as one, the gateway's commander (component type 32):
//! it queries, connects and takes control on their behalf, and the proxy of each RA component
//! arbitrates between the clients. Towards JAUS, each RA component acts under its own id.

mod convert;
mod counters;
mod course;
mod pairs;
mod picture;
mod proxy;
mod registry;
mod report;
mod rights;
mod roles;
mod running;
mod settings;

use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use bytes::Bytes;

pub use self::counters::{Counter, Counters};
pub use self::report::Report;
pub use self::running::RaGateway;
pub use self::settings::{Settings, Show};

use self::convert::Ids;
use self::counters::Tally;
use self::proxy::{Proxy, Target};
use crate::RaId;
use crate::carrier::Transmit;
use crate::ids::{Collision, IdTable, InvalidIds, RaComponent, Side, Unmapped};
use crate::message::Message;
use crate::node::{self, RaNode};
use jaus::address::JausId;
use jaus::endpoint::{Outgoing, Received};
use jaus::rights::{DecisionQueue, InControl};
use jaus::service::{
    Change, Discovery, Event, Kind, Liveness, Profile, Scope, Stack, Timing, Transport,
};

/// Both halves of a gateway, without I/O and without a clock. See the [module](self).
pub struct Gateway {
    settings: Settings,
    /// Id mapping and the subsystem numbers in use.
    ids: IdTable,
    /// The same table, shared with the message conversion.
    known: Ids,
    ra: RaNode,
    /// The gateway's own component, which discovers JAUS components.
    own_stack: Stack,
    /// The RA id of that component.
    own: RaId,
    proxies: BTreeMap<JausId, Proxy>,
    /// Profile of each listed RA component.
    listed: BTreeMap<JausId, Profile>,
    /// Changed JAUS subsystems and the time of their announcement to RA systems.
    changed: BTreeMap<u16, Instant>,
    /// JAUS components by their RA ids.
    routes: BTreeMap<RaId, Target>,
    /// Former ids of RA components: stale discovery data may still list them.
    former: BTreeMap<JausId, Instant>,
    /// Ids that RA components have lost to components of the JAUS side, and until when they do not get them.
    taken: BTreeMap<JausId, Instant>,
    /// RA numbers of the shown subsystems, by JAUS number.
    shown: BTreeMap<u16, u8>,
    actions: VecDeque<Action>,
    decisions: DecisionQueue<RaId>,
    in_control: InControl,
    /// Whether what cannot be recorded is refused.
    is_refusing: bool,
    tally: Tally,
}

/// Action on the JAUS node that a gateway requests.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Attach a component with this id to the node.
    Attach(JausId),
    /// Send a message from an attached component.
    Send(Outgoing),
    /// Detach the component with this id.
    Detach(JausId),
}

/// Reason why a gateway cannot be created.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CannotBe {
    /// The id table is invalid.
    #[error(transparent)]
    Ids(#[from] InvalidIds),
    /// The gateway itself has no RA id.
    #[error("the gateway's own id {id} has no RA id: {why}")]
    Unmapped {
        /// Its JAUS id.
        id: JausId,
        /// The reason.
        why: Unmapped,
    },
}

impl Gateway {
    /// Timeout of guests: components that send messages but are not listed by their subsystem.
    const GUEST: Duration = Duration::from_secs(30);
    /// How long the id of a vanished RA component is not accepted as a JAUS component's.
    const FORMER: Duration = Duration::from_secs(120);

    /// A gateway with this JAUS id.
    ///
    /// # Errors
    /// Invalid settings.
    pub fn new(id: JausId, settings: Settings) -> Result<Self, CannotBe> {
        let ids = IdTable::new(&settings.ids)?;
        let own = ids.ra_id(id, RaComponent::SUBSYSTEM_COMMANDER);
        let own = own.map_err(|why| CannotBe::Unmapped { id, why })?;
        let profile = Profile::new(Kind::OtherSubsystem, settings.name.clone());
        let seed = id.to_u32().into();
        let discovery = Discovery::new(id, profile, Scope::System, Timing::default(), seed);
        let own_stack = Stack::new(
            discovery,
            vec![Box::new(Transport), Box::new(Liveness::new())],
        );
        Ok(Self {
            ra: RaNode::new(settings.ra.clone()),
            settings,
            known: Ids::new(ids.clone()),
            ids,
            own_stack,
            own,
            proxies: BTreeMap::new(),
            listed: BTreeMap::new(),
            changed: BTreeMap::new(),
            routes: BTreeMap::new(),
            former: BTreeMap::new(),
            taken: BTreeMap::new(),
            shown: BTreeMap::new(),
            actions: VecDeque::new(),
            decisions: DecisionQueue::default(),
            in_control: InControl::default(),
            is_refusing: false,
            tally: Tally::default(),
        })
    }

    /// Validates the settings.
    ///
    /// # Errors
    /// Invalid settings.
    pub fn check(settings: &Settings) -> Result<(), CannotBe> {
        IdTable::new(&settings.ids)?;
        Ok(())
    }

    /// The gateway's own JAUS id.
    #[must_use]
    pub const fn id(&self) -> JausId {
        self.own_stack.id()
    }

    /// The gateway's own RA id.
    #[must_use]
    pub const fn ra_id(&self) -> RaId {
        self.own
    }

    /// Starts the gateway.
    pub fn start(&mut self, now: Instant) {
        self.actions.push_back(Action::Attach(self.own_stack.id()));
        let own = self.own_stack.id().subsystem();
        if let Err(collision) = self.claim(Side::Jaus, own) {
            tracing::warn!("{collision}");
        }
        self.changed.insert(own, now);
        self.own_stack.start(now);
        self.settle(now);
    }

    /// Processes a datagram of an RA system.
    pub fn handle_datagram(&mut self, now: Instant, from: SocketAddr, datagram: Bytes) {
        self.ra.handle_datagram(now, from, datagram);
        self.settle(now);
    }

    /// Processes a message for one of the gateway's JAUS components.
    pub fn handle_message(&mut self, now: Instant, message: &Received) {
        if message.to == self.own_stack.id() {
            self.own_stack.handle_message(now, message);
        } else {
            self.record_answer(now, message);
            self.with_front(now, message.to, |proxy, tally| {
                proxy.handle_message(now, message, tally);
            });
        }
        self.settle(now);
    }

    /// Runs due timers; calls before [`poll_timeout`](Self::poll_timeout) do no harm.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.ra.handle_timeout(now);
        if self.own_stack.poll_timeout().is_some_and(|due| due <= now) {
            self.own_stack.handle_timeout(now);
        }
        let due = |it: &(&JausId, &Proxy)| it.1.poll_timeout().is_some_and(|due| due <= now);
        let due: Vec<JausId> = self.proxies.iter().filter(due).map(|(&id, _)| id).collect();
        for id in due {
            self.with_front(now, id, |proxy, tally| proxy.handle_timeout(now, tally));
        }
        self.dismiss_guests(now);
        self.show_changes(now);
        self.settle(now);
    }

    /// Stops and releases everything under control on either side, and grants no further control.
    /// Unconfirmed releases are repeated as long as the gateway keeps running.
    pub fn release_all(&mut self, now: Instant) {
        let all: Vec<JausId> = self.proxies.keys().copied().collect();
        for id in all {
            self.with_front(now, id, |proxy, tally| proxy.take_leave(now, tally));
        }
    }

    /// Whether everything that was under control on either side is released.
    #[must_use]
    pub fn is_released(&self) -> bool {
        self.proxies.values().all(Proxy::is_released)
    }

    /// Releases what is still under control, and ends all connections and subscriptions.
    pub fn take_leave(&mut self, now: Instant) {
        self.release_all(now);
        for (_, shown) in std::mem::take(&mut self.shown) {
            self.ra.withdraw(now, shown);
        }
        self.own_stack.take_leave(now);
        self.collect_desk(now);
    }

    /// The next datagram to RA systems.
    pub fn poll_transmit(&mut self) -> Option<Transmit> {
        self.ra.poll_transmit()
    }

    /// The next action on the JAUS node.
    pub fn poll_action(&mut self) -> Option<Action> {
        self.actions.pop_front()
    }

    /// When to call [`handle_timeout`](Self::handle_timeout).
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let own = [
            self.ra.poll_timeout(),
            self.own_stack.poll_timeout(),
            self.changed.values().min().copied(),
        ];
        let proxies = self.proxies.values().filter_map(Proxy::poll_timeout);
        own.into_iter().flatten().chain(proxies).min()
    }

    /// Counters of converted and refused messages.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        self.tally.counters()
    }

    /// State of the gateway, for display.
    #[must_use]
    pub fn report(&self) -> Report {
        Report::of(self)
    }

    /// Processes everything that is pending.
    fn settle(&mut self, now: Instant) {
        self.collect_desk(now);
        while let Some(event) = self.ra.poll_event() {
            self.handle_ra_event(now, event);
        }
    }

    fn collect_desk(&mut self, now: Instant) {
        while let Some(event) = self.own_stack.poll_event() {
            match event {
                Event::Change(change) => self.handle_change(now, change),
                Event::Message(message) => {
                    let code = jaus::service::code_of(&message.payload).unwrap_or_default();
                    let counter = Counter::NoCounterpart;
                    self.tally.refuse(now, counter, code, message.source);
                }
                _ => {}
            }
        }
        while let Some(message) = self.own_stack.poll_transmit() {
            self.actions.push_back(Action::Send(message));
        }
    }

    fn handle_ra_event(&mut self, now: Instant, event: node::Event) {
        match event {
            node::Event::Appeared(subsystem) | node::Event::Changed(subsystem) => {
                self.list(now, &subsystem);
            }
            node::Event::Lost(subsystem) => self.lose(now, subsystem),
            node::Event::Message(message) => self.handle_ra_message(now, &message),
        }
    }

    /// Handles the arrival, change or departure of a JAUS component.
    fn handle_change(&mut self, now: Instant, change: Change) {
        let subsystem = match change {
            Change::SubsystemFound(_) | Change::SubsystemLost(_) => return,
            Change::Found(id) | Change::Identified(_, id) | Change::Services(id) => id.subsystem(),
            Change::Lost(id, _) => {
                self.forget_client(now, id);
                id.subsystem()
            }
        };
        if self.settings.show.includes(subsystem) || subsystem == self.own_stack.id().subsystem() {
            let due = now + self.settings.gather;
            self.changed.entry(subsystem).or_insert(due);
        }
    }

    /// Announces changed JAUS subsystems to RA systems.
    fn show_changes(&mut self, now: Instant) {
        let due: Vec<u16> = self
            .changed
            .iter()
            .filter(|(_, due)| **due <= now)
            .map(|(&subsystem, _)| subsystem)
            .collect();
        for subsystem in due {
            self.changed.remove(&subsystem);
            self.show(now, subsystem);
        }
    }

    fn show(&mut self, now: Instant, subsystem: u16) {
        let us = self.own_stack.id();
        self.former.retain(|_, until| now < *until);
        let (proxies, former) = (&self.proxies, &self.former);
        let is_front = |id| proxies.contains_key(&id) || former.contains_key(&id);
        let picture = picture::draw(
            &self.own_stack.directory(),
            &self.ids,
            subsystem,
            us,
            is_front,
        );
        let Some(picture) = picture else {
            return self.hide(now, subsystem);
        };
        for (id, why) in &picture.unmapped {
            self.tally.refuse(
                now,
                Counter::Unmapped,
                0,
                format_args!("JAUS component {id}: {why}"),
            );
        }
        if let Err(collision) = self.claim(Side::Jaus, subsystem) {
            self.tally.refuse(now, Counter::Collision, 0, collision);
            return self.hide(now, subsystem);
        }
        let number = picture.subsystem.id;
        if let Err(why) = self.ra.announce(now, picture.subsystem) {
            self.tally.refuse(now, Counter::Collision, 0, &why);
            return self.hide(now, subsystem);
        }
        self.routes.retain(|id, _| id.subsystem != number);
        self.routes.extend(picture.routes);
        self.shown.insert(subsystem, number);
    }

    fn hide(&mut self, now: Instant, subsystem: u16) {
        if let Some(number) = self.shown.remove(&subsystem) {
            self.ra.withdraw(now, number);
            self.routes.retain(|id, _| id.subsystem != number);
            self.release(Side::Jaus, subsystem);
        }
    }

    /// Claims a subsystem number; fails if the number is already in use.
    fn claim(&mut self, home: Side, number: u16) -> Result<(), Collision> {
        self.ids.claim(home, number)?;
        self.known.set(self.ids.clone());
        Ok(())
    }

    fn release(&mut self, home: Side, number: u16) {
        self.ids.release(home, number);
        self.known.set(self.ids.clone());
    }

    fn send_ra(&mut self, now: Instant, message: &Message) {
        let (code, to) = (message.code, message.destination);
        if let Err(why) = self.ra.send(now, message) {
            let why = format_args!("to {to}: {why}");
            self.tally.refuse(now, Counter::NotSent, code, why);
        }
    }
}
