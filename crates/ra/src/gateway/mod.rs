//! The gateway between systems of the Reference Architecture 3.x and those of the SAE standards: each
//! sees the components of the other as its own.
//!
//! | here | what it does |
//! |---|---|
//! | [`Gateway`] | both halves without I/O and without a clock: fed with datagrams, messages and time |
//! | `proxy` | an RA component as a JAUS component: services that answer from what it reports |
//! | `course` | lists of places across: elements here, numbers there |
//! | `picture` | a JAUS subsystem as an RA subsystem: each component once for each of its services |
//! | [`RaGateway`] | the running thing: sockets, node, timers |
//!
//! Between the two stand the id table ([`ra::ids`](crate::ids)) and the conversion of messages
//! ([`ra::convert`](crate::convert)). What cannot be said on the other side is refused, counted,
//! and told in the log once for each kind.
//!
//! Towards RA systems all JAUS clients are one, the gateway's commander (component type 32):
//! it asks, connects and takes control in their place, and each RA component's counterpart decides
//! among them. Towards JAUS each RA component speaks for itself.

mod convert;
mod counters;
mod course;
mod pairs;
mod picture;
mod proxy;
mod registry;
mod report;
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
use crate::carrier::Transmit;
use crate::ids::{Collision, IdTable, InvalidIds, RaComponent, Side, Unmapped};
use crate::node::{self, RaNode};
use crate::{Message, RaId};
use jaus::address::JausId;
use jaus::endpoint::{Outgoing, Received};
use jaus::service::{
    Change, Discovery, Event, Kind, Liveness, Profile, Scope, Stack, Timing, Transport,
};

/// Both halves of a gateway, without I/O and without a clock. See the [module](self).
pub struct Gateway {
    settings: Settings,
    /// Who is who, and whose numbers are taken.
    ids: IdTable,
    /// The same for the conversion of messages.
    known: Ids,
    ra: RaNode,
    /// The gateway's own component, which looks around among JAUS components.
    own_stack: Stack,
    /// The same component as RA systems see it.
    own: RaId,
    proxies: BTreeMap<JausId, Proxy>,
    /// How each listed RA component presents itself.
    listed: BTreeMap<JausId, Profile>,
    /// JAUS subsystems that have changed, and when RA systems are told.
    changed: BTreeMap<u16, Instant>,
    /// JAUS components by the ids by which RA systems see them.
    routes: BTreeMap<RaId, Target>,
    /// Ids that RA components had until lately: whoever looks around may still list them.
    former: BTreeMap<JausId, Instant>,
    /// The numbers of the subsystems that are shown to RA systems, by ours.
    shown: BTreeMap<u16, u8>,
    actions: VecDeque<Action>,
    tally: Tally,
}

/// What the owner of a gateway must do among JAUS components.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Attach a component with this id to the node.
    Attach(JausId),
    /// Send a message in the name of an attached component.
    Send(Outgoing),
    /// Detach the component with this id.
    Detach(JausId),
}

/// Why a gateway cannot be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CannotBe {
    /// The id table is mistaken.
    #[error(transparent)]
    Ids(#[from] InvalidIds),
    /// The gateway itself has no id among RA systems.
    #[error("the gateway's own id {id} has none among RA systems: {why}")]
    Unmapped {
        /// Its id among JAUS components.
        id: JausId,
        /// Why.
        why: Unmapped,
    },
}

impl Gateway {
    /// Guests, which speak but are not listed by their subsystem, are forgotten when nothing has
    /// come from them for so long.
    const GUEST: Duration = Duration::from_secs(30);
    /// For so long after it has gone the id of an RA component is not taken for a JAUS component's.
    const FORMER: Duration = Duration::from_secs(120);

    /// A gateway that has this id among JAUS components.
    ///
    /// # Errors
    /// What is wrong with the settings.
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
            shown: BTreeMap::new(),
            actions: VecDeque::new(),
            tally: Tally::default(),
        })
    }

    /// Whether the settings make a gateway.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn check(settings: &Settings) -> Result<(), CannotBe> {
        IdTable::new(&settings.ids)?;
        Ok(())
    }

    /// The gateway's own id among JAUS components.
    #[must_use]
    pub const fn id(&self) -> JausId {
        self.own_stack.id()
    }

    /// The gateway's own id among RA systems.
    #[must_use]
    pub const fn ra_id(&self) -> RaId {
        self.own
    }

    /// Begins to live.
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

    /// A datagram of an RA system has come.
    pub fn handle_datagram(&mut self, now: Instant, from: SocketAddr, datagram: Bytes) {
        self.ra.handle_datagram(now, from, datagram);
        self.settle(now);
    }

    /// A message for one of the gateway's JAUS components has come.
    pub fn handle_message(&mut self, now: Instant, message: &Received) {
        if message.to == self.own_stack.id() {
            self.own_stack.handle_message(now, message);
        } else {
            self.with_front(now, message.to, |proxy, tally| {
                proxy.handle_message(now, message, tally);
            });
        }
        self.settle(now);
    }

    /// The time of [`poll_timeout`](Self::poll_timeout) has come; earlier does no harm.
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

    /// Stops and releases what is controlled on either side, and gives control to no client any more.
    /// Releases that are not confirmed are repeated while the gateway still gets its time.
    pub fn release_all(&mut self, now: Instant) {
        let all: Vec<JausId> = self.proxies.keys().copied().collect();
        for id in all {
            self.with_front(now, id, |proxy, tally| proxy.take_leave(now, tally));
        }
    }

    /// Whether everything is released that was controlled on either side.
    #[must_use]
    pub fn is_released(&self) -> bool {
        self.proxies.values().all(Proxy::is_released)
    }

    /// Releases what is still controlled, and ends all else that runs with others.
    pub fn take_leave(&mut self, now: Instant) {
        self.release_all(now);
        for (_, shown) in std::mem::take(&mut self.shown) {
            self.ra.withdraw(now, shown);
        }
        self.own_stack.take_leave(now);
        self.collect_desk(now);
    }

    /// The next datagram for RA systems.
    pub fn poll_transmit(&mut self) -> Option<Transmit> {
        self.ra.poll_transmit()
    }

    /// The next thing to do among JAUS components.
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

    /// What has been carried across and refused.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        self.tally.counters()
    }

    /// How things stand, for people.
    #[must_use]
    pub fn report(&self) -> Report {
        Report::of(self)
    }

    /// Looks after all that has happened.
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

    /// Somebody among JAUS components came, changed or went.
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

    /// Tells RA systems of the JAUS subsystems that have changed.
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

    /// Notes that a subsystem is there, unless that would be a second one of its number.
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
