//! Proxy registry: opens and closes the proxies of RA components and routes their messages.

use std::collections::BTreeMap;
use std::time::Instant;

use super::counters::{Counter, Tally};
use super::proxy::{self, Plan, Proxy, QUERY_STATUS, STATUS, Target};
use super::{Action, Gateway, roles};
use crate::ids::{RaComponent, Side};
use crate::message::Message;
use crate::{RaId, node};
use jaus::address::JausId;
use jaus::codec::Message as _;
use jaus::endpoint::{ID_HELD, Outgoing, Received, Remote};
use jaus::messages::core::QueryIdentification;
use jaus::rights::Unaccepted;
use jaus::service::{Event, Kind, Profile, code_of};
use jaus::wire::Broadcast;

/// Maximum number of JAUS components that one RA message is delivered to.
const MOST_RECIPIENTS: usize = 64;

impl Gateway {
    /// Updates the proxies for a new or changed RA subsystem.
    pub(super) fn list(&mut self, now: Instant, subsystem: &node::RaSubsystemEntry) {
        let number = subsystem.id;
        let mut listed = BTreeMap::new();
        for (ra, component) in subsystem.components() {
            match self.ids.jaus_id(ra) {
                Ok(id) => drop(listed.insert(id, (ra, profile(subsystem, ra, component)))),
                Err(why) => {
                    let why = format_args!("RA component {ra}: {why}");
                    self.tally.refuse(now, Counter::Unmapped, 0, why);
                }
            }
        }
        let of_it = |proxy: &Proxy| proxy.ra().subsystem == number;
        let gone = |(id, proxy): &(&JausId, &Proxy)| {
            of_it(proxy) && proxy.kept_until.is_none() && !listed.contains_key(id)
        };
        let gone: Vec<JausId> = self
            .proxies
            .iter()
            .filter(gone)
            .map(|(&id, _)| id)
            .collect();
        for id in gone {
            self.dismiss(now, id);
        }
        for (id, (ra, profile)) in listed {
            self.admit(now, id, ra, profile);
        }
    }

    /// Opens a proxy for a listed component, or a new one if its profile has changed.
    fn admit(&mut self, now: Instant, id: JausId, ra: RaId, profile: Profile) {
        if let Some(before) = self.listed.get(&id) {
            if *before == profile {
                return;
            }
            self.dismiss(now, id);
        } else if let Some(guest) = self.proxies.get_mut(&id) {
            if guest.ra_client.is_busy() {
                // It keeps its unnamed proxy, as a new one would lose pending requests.
                guest.kept_until = None;
                self.listed.insert(id, profile);
                return;
            }
            self.dismiss(now, id);
        }
        if self.open(now, id, ra, profile.clone()) {
            self.listed.insert(id, profile);
        }
    }

    /// Opens the proxy of an RA component; returns whether it may have this id, and there was room.
    fn open(&mut self, now: Instant, id: JausId, ra: RaId, profile: Profile) -> bool {
        if let Err((counter, why)) = self.check_id(now, id, ra) {
            self.tally
                .refuse(now, counter, 0, format_args!("{ra}: {why}"));
            return false;
        }
        let mut proxy = Proxy::new(Plan {
            ra,
            own: self.own,
            id,
            profile,
            ids: self.known.clone(),
            patience: self.settings.patience,
            authority: self.settings.authority,
            timeout: self.settings.timeout,
        });
        self.actions.push_back(Action::Attach(id));
        proxy.start(now);
        self.former.remove(&id);
        self.proxies.insert(id, proxy);
        self.with_front(now, id, |_, _| {});
        self.call_everybody(id);
        true
    }

    /// Whether an RA component may have an id on the JAUS side: answers to it cross the gateway.
    fn check_id(&mut self, now: Instant, id: JausId, ra: RaId) -> Result<(), (Counter, String)> {
        let grants = &self.settings.grants;
        if !grants.accepts(id) {
            let why = format!("{} (--ra-grant)", Unaccepted::Source);
            return Err((Counter::NotGranted, why));
        }
        let of_jaus = || self.own_stack.directory().component(id).is_some();
        let is_former = self.former.get(&id).is_some_and(|until| now < *until);
        let is_taken = self.taken.get(&id).is_some_and(|until| now < *until);
        if !grants.trusts(id) && (is_taken || (of_jaus() && !is_former)) {
            let why = format!("{id} is a component of the JAUS side");
            return Err((Counter::Collision, why));
        }
        if self.proxies.len() >= self.settings.max_components || id == self.own_stack.id() {
            return Err((Counter::TooManyComponents, id.to_string()));
        }
        let claimed = self.claim(Side::Ra, ra.subsystem.into());
        claimed.map_err(|collision| (Counter::Collision, collision.to_string()))
    }

    /// A component of the JAUS side uses an id that the gateway has attached. It is that component's from now on,
    /// unless the settings give the RA component more rights than to look.
    pub fn handle_conflict(&mut self, now: Instant, id: JausId, from: Remote) {
        let Some(proxy) = self.proxies.get(&id) else {
            return;
        };
        if self.settings.grants.trusts(id) {
            return;
        }
        let ra = proxy.ra();
        tracing::warn!(
            "RA component {ra} loses {id}: the component of the JAUS side at {from} has this id"
        );
        self.dismiss(now, id);
        self.taken.retain(|_, until| now < *until);
        self.taken.insert(id, now + ID_HELD);
        self.settle(now);
    }

    /// Broadcasts a query so that every node learns the proxy's address: the proxy's own discovery
    /// stays within its subsystem, and clients that knew it before may still send to its old
    /// address.
    fn call_everybody(&mut self, source: JausId) {
        let query = QueryIdentification {
            query_type: 2.into(),
        };
        if let Ok(payload) = query.encode() {
            let mut call = Outgoing::new(source, JausId::EVERYONE, payload);
            call.broadcast = Broadcast::Global;
            self.actions.push_back(Action::Send(call));
        }
    }

    /// Closes the proxies of a lost RA subsystem.
    pub(super) fn lose(&mut self, now: Instant, subsystem: u8) {
        let of_it = |(_, proxy): &(&JausId, &Proxy)| proxy.ra().subsystem == subsystem;
        let gone: Vec<JausId> = self
            .proxies
            .iter()
            .filter(of_it)
            .map(|(&id, _)| id)
            .collect();
        for id in gone {
            self.dismiss(now, id);
        }
    }

    fn dismiss(&mut self, now: Instant, id: JausId) {
        self.with_front(now, id, |proxy, tally| proxy.take_leave(now, tally));
        let Some(proxy) = self.proxies.remove(&id) else {
            return;
        };
        let subsystem = proxy.ra().subsystem;
        let mut others = self.proxies.values().map(|it| it.ra().subsystem);
        if others.all(|it| it != subsystem) {
            self.release(Side::Ra, subsystem.into());
        }
        self.listed.remove(&id);
        self.former.insert(id, now + Self::FORMER);
        self.actions.push_back(Action::Detach(id));
    }

    /// Closes the proxies of expired, idle guests.
    pub(super) fn dismiss_guests(&mut self, now: Instant) {
        let mut gone = Vec::new();
        for (&id, proxy) in &mut self.proxies {
            if proxy.kept_until.is_some_and(|until| until <= now) {
                if proxy.ra_client.is_busy() {
                    proxy.kept_until = Some(now + Self::GUEST);
                } else {
                    gone.push(id);
                }
            }
        }
        for id in gone {
            self.dismiss(now, id);
        }
    }

    /// Removes a lost JAUS component from all proxies.
    pub(super) fn forget_client(&mut self, now: Instant, client: JausId) {
        let all: Vec<JausId> = self.proxies.keys().copied().collect();
        for id in all {
            self.with_front(now, id, |proxy, tally| proxy.forget(now, client, tally));
        }
    }

    /// Runs `act` on a proxy, then processes its events and outgoing messages.
    pub(super) fn with_front(
        &mut self,
        now: Instant,
        id: JausId,
        act: impl FnOnce(&mut Proxy, &mut Tally),
    ) {
        let Some(mut proxy) = self.proxies.remove(&id) else {
            return;
        };
        if let Some(heard) = self.ra.heard(proxy.ra().subsystem) {
            proxy.hear_subsystem(heard);
        }
        act(&mut proxy, &mut self.tally);
        self.handle_events(now, &mut proxy);
        for denial in self.pass_on(now, &mut proxy) {
            proxy.handle_message(now, &denial, &mut self.tally);
        }
        self.handle_events(now, &mut proxy);
        // What is denied again is not answered again: the RA client knows.
        drop(self.pass_on(now, &mut proxy));
        for message in proxy.take_said() {
            self.send_ra(now, &message);
        }
        self.proxies.insert(id, proxy);
    }

    fn handle_events(&mut self, now: Instant, proxy: &mut Proxy) {
        while let Some(event) = proxy.stack.poll_event() {
            match event {
                Event::Message(message) => self.handle_unasked(now, proxy, &message),
                event => proxy.handle_event(now, event, &mut self.tally),
            }
        }
    }

    /// Handles a JAUS message to an RA component that is no answer to a query.
    fn handle_unasked(&mut self, now: Instant, proxy: &mut Proxy, message: &Received) {
        if proxy.handle_entered(now, message, &mut self.tally) {
            return;
        }
        let code = code_of(&message.payload).unwrap_or_default();
        let mut parts = roles::reporting(code);
        let shown = |part: RaComponent| {
            let id = self.ids.ra_of(message.source, part)?;
            Some((id, self.routes.get(&id)?.minor))
        };
        let (to, tally) = (proxy.ra(), &mut self.tally);
        match parts.find_map(shown) {
            Some(from) => {
                let payload = &message.payload;
                proxy.ra_client.handle_report(now, from, to, payload, tally);
            }
            None => tally.refuse(now, Counter::NoCounterpart, code, message.source),
        }
    }

    /// Handles a message of an RA component that the RA node does not answer itself.
    pub(super) fn handle_ra_message(&mut self, now: Instant, message: &Message) {
        if message.destination == self.own {
            return self.handle_for_us(now, message);
        }
        let meant = |(id, _): &(&RaId, &Target)| message.destination.includes(**id);
        let routes = self.routes.iter().filter(meant);
        let targets: Vec<(RaId, Target)> = routes
            .map(|(&id, &peer)| (id, peer))
            .filter(|(id, _)| *id != self.own)
            .take(MOST_RECIPIENTS)
            .collect();
        if targets.is_empty() {
            let why = message.destination;
            return self
                .tally
                .refuse(now, Counter::NoCounterpart, message.code, why);
        }
        let Some(client) = self.client(now, message.source) else {
            return;
        };
        for (id, peer) in targets {
            let mut request = message.clone();
            request.destination = id;
            self.with_front(now, client, |proxy, tally| {
                proxy.handle_ra(now, &request, Some(peer), tally);
            });
        }
    }

    fn handle_for_us(&mut self, now: Instant, message: &Message) {
        let proxy = self.ids.jaus_of(message.source);
        let proxy = proxy.filter(|id| self.proxies.contains_key(id));
        if message.code == QUERY_STATUS && proxy.is_none() {
            return self.send_ra(now, &message.answer(STATUS, proxy::status(false)));
        }
        let Some(id) = proxy else {
            let source = message.source;
            return self
                .tally
                .refuse(now, Counter::Unasked, message.code, source);
        };
        self.with_front(now, id, |proxy, tally| {
            proxy.handle_ra(now, message, None, tally);
        });
    }

    /// The proxy of a requesting RA component; opened as a temporary guest if the component is not
    /// listed.
    fn client(&mut self, now: Instant, source: RaId) -> Option<JausId> {
        let id = match self.ids.jaus_id(source) {
            Ok(id) => id,
            Err(why) => {
                let why = format_args!("RA component {source}: {why}");
                self.tally.refuse(now, Counter::Unmapped, 0, why);
                return None;
            }
        };
        if let Some(proxy) = self.proxies.get_mut(&id) {
            if let Some(until) = &mut proxy.kept_until {
                *until = now + Self::GUEST;
            }
            return Some(id);
        }
        let name = RaComponent(source.component).to_string();
        let profile = Profile {
            component: name.clone(),
            ..Profile::new(Kind::OtherSubsystem, name)
        };
        if !self.open(now, id, source, profile) {
            return None;
        }
        let guest = self.proxies.get_mut(&id)?;
        guest.kept_until = Some(now + Self::GUEST);
        Some(id)
    }
}

/// The JAUS profile of an RA component.
fn profile(
    subsystem: &node::RaSubsystemEntry,
    ra: RaId,
    component: &node::RaComponentEntry,
) -> Profile {
    let or = |name: &str, otherwise: String| match name.is_empty() {
        true => otherwise,
        false => name.to_owned(),
    };
    let node = subsystem.nodes.iter().find(|node| node.id == ra.node);
    let node = node.map_or("", |node| &node.name);
    let own = or(&subsystem.name, format!("RA subsystem {}", subsystem.id));
    Profile {
        node: or(node, format!("RA node {}.{}", ra.subsystem, ra.node)),
        component: or(&component.name, RaComponent(ra.component).to_string()),
        ..Profile::new(kind(subsystem), own)
    }
}

/// Infers the kind of an RA subsystem from its components: RA systems do not report it.
fn kind(subsystem: &node::RaSubsystemEntry) -> Kind {
    let has = |wanted: fn(u8) -> bool| subsystem.components().any(|(id, _)| wanted(id.component));
    let drives = |part| RaComponent(part).is_driver();
    let commands = |part| matches!(part, 32 | 40);
    if has(drives) {
        Kind::Vehicle
    } else if has(commands) {
        Kind::OperatorControlUnit
    } else {
        Kind::OtherSubsystem
    }
}
