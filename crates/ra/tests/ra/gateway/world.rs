//! Two networks in virtual time with a gateway between them. Datagrams and messages arrive at once,
//! and time advances from timer to timer. The gateway can be killed, suspended, restarted, and cut
//! off on either side.

use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Outgoing, Received};
use jaus::rights::Acceptance;
use jaus::service::{
    Discovery, Event, Inquiry, Kind, Liveness, Patience, Profile, Question, Scope, Service, Stack,
    Timing, Transport,
};
use jaus_ra::carrier::To;
use jaus_ra::gateway::{Action, Counter, Gateway, Settings};
use jaus_ra::node::{self, RaNode, RaSubsystemEntry};
use jaus_ra::{Message, RaId};

use jaus_test_kit::rover::Rover;

pub(crate) const GATEWAY: JausId = JausId::new(250, 1, 1);
/// The gateway's commander among the RA systems.
pub(crate) const COMMANDER: RaId = RaId::new(250, 1, 32, 1);
pub(crate) const OPERATOR: JausId = JausId::new(42, 1, 1);

pub(crate) struct World {
    pub(crate) now: Instant,
    pub(crate) gateway: Gateway,
    attached: BTreeSet<JausId>,
    pub(crate) ra: Vec<RaPeer>,
    pub(crate) jaus: Vec<JausPeer>,
    /// RA datagrams that the gateway has sent.
    pub(crate) sent: Vec<Bytes>,
    pub(crate) power: Power,
    /// Whether all datagrams between the gateway and RA systems are lost.
    pub(crate) ra_cut: bool,
    /// Whether all messages between the gateway and JAUS components are lost.
    pub(crate) jaus_cut: bool,
}

/// State of the gateway's process.
pub(crate) enum Power {
    On,
    Killed,
    /// With everything that arrives meanwhile.
    Suspended(Vec<Arrival>),
}

/// Input of the gateway.
pub(crate) enum Arrival {
    Datagram(SocketAddr, Bytes),
    Message(Received),
}

/// An RA system: its node, the messages that its components have received, and perhaps a vehicle.
pub(crate) struct RaPeer {
    pub(crate) node: RaNode,
    pub(crate) address: SocketAddr,
    pub(crate) heard: Vec<Message>,
    pub(crate) rover: Option<Rover>,
    pub(crate) seen: Vec<node::Event>,
}

/// A JAUS component and its events.
pub(crate) struct JausPeer {
    pub(crate) stack: Stack,
    pub(crate) events: Vec<Event>,
    pub(crate) up: bool,
}

pub(crate) fn address(host: u8) -> SocketAddr {
    SocketAddr::from(([10, 77, 0, host], 3794))
}

/// A component with Discovery, Transport, Liveness and these services.
pub(crate) fn stack(id: JausId, kind: Kind, name: &str, services: Vec<Box<dyn Service>>) -> Stack {
    let profile = Profile::new(kind, name);
    let seed = id.to_u32().into();
    let discovery = Discovery::new(id, profile, Scope::System, Timing::default(), seed);
    let mut all: Vec<Box<dyn Service>> = vec![Box::new(Transport), Box::new(Liveness::new())];
    all.extend(services);
    Stack::new(discovery, all)
}

/// Every message of every RA component.
fn everything() -> Acceptance {
    let all = "65535.255.255 control=255 clear-emergency=any configure also=any";
    Acceptance::new([all.parse().unwrap()])
}

impl World {
    /// A gateway whose RA components may send everything.
    pub(crate) fn new(settings: Settings) -> Self {
        let grants = everything();
        Self::closed(Settings { grants, ..settings })
    }

    /// The same, but RA components may do no more than these settings say.
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    pub(crate) fn closed(settings: Settings) -> Self {
        let now = Instant::now();
        let mut gateway = Gateway::new(GATEWAY, settings).unwrap();
        gateway.start(now);
        Self {
            now,
            gateway,
            attached: BTreeSet::new(),
            ra: Vec::new(),
            jaus: Vec::new(),
            sent: Vec::new(),
            power: Power::On,
            ra_cut: false,
            jaus_cut: false,
        }
    }

    /// Starts a gateway with the same id in place of a killed one.
    pub(crate) fn restart_gateway(&mut self) {
        let settings = Settings {
            grants: everything(),
            ..Settings::default()
        };
        self.gateway = Gateway::new(GATEWAY, settings).unwrap();
        self.attached.clear();
        self.gateway.start(self.now);
        self.power = Power::On;
    }

    /// Resumes a suspended gateway, which then handles everything that arrived meanwhile.
    pub(crate) fn resume_gateway(&mut self) {
        let before = std::mem::replace(&mut self.power, Power::On);
        if let Power::Suspended(waiting) = before {
            waiting.into_iter().for_each(|it| self.arrive(it));
        }
        self.settle();
    }

    fn is_on(&self) -> bool {
        matches!(self.power, Power::On)
    }

    fn arrive(&mut self, arrival: Arrival) {
        let cut = match arrival {
            Arrival::Datagram(..) => self.ra_cut,
            Arrival::Message(_) => self.jaus_cut,
        };
        match (&mut self.power, arrival) {
            _ if cut => {}
            (Power::On, Arrival::Datagram(from, datagram)) => {
                self.gateway.handle_datagram(self.now, from, datagram);
            }
            (Power::On, Arrival::Message(message)) => {
                self.gateway.handle_message(self.now, &message);
            }
            (Power::Suspended(waiting), arrival) => waiting.push(arrival),
            (Power::Killed, _) => {}
        }
    }

    /// Adds an RA system. Returns its index.
    pub(crate) fn add_ra(&mut self, subsystem: RaSubsystemEntry, rover: Option<Rover>) -> usize {
        let mut node = RaNode::new(node::Settings::default());
        node.announce(self.now, subsystem).unwrap();
        self.ra.push(RaPeer {
            node,
            address: address(2 + self.ra.len() as u8),
            heard: Vec::new(),
            rover,
            seen: Vec::new(),
        });
        self.ra.len() - 1
    }

    /// Adds a JAUS component. Returns its index.
    pub(crate) fn add_jaus(&mut self, mut stack: Stack) -> usize {
        stack.start(self.now);
        self.jaus.push(JausPeer {
            stack,
            events: Vec::new(),
            up: true,
        });
        self.jaus.len() - 1
    }

    /// Adds the operator 42.1.1.
    pub(crate) fn add_operator(&mut self) -> usize {
        let kind = Kind::OperatorControlUnit;
        self.add_jaus(stack(OPERATOR, kind, "Operator", Vec::new()))
    }

    /// Advances time, and runs all timers that expire meanwhile.
    pub(crate) fn run(&mut self, time: Duration) {
        let end = self.now + time;
        self.settle();
        while let Some(wake) = self.poll_timeout().filter(|&wake| wake <= end) {
            self.now = self.now.max(wake);
            self.wake();
            self.settle();
        }
        self.now = end;
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let ra = self.ra.iter().flat_map(|peer| {
            let rover = peer.rover.as_ref().and_then(Rover::poll_timeout);
            [peer.node.poll_timeout(), rover]
        });
        let jaus = self.jaus.iter().filter(|peer| peer.up);
        let jaus = jaus.map(|peer| peer.stack.poll_timeout());
        let gateway = self.gateway.poll_timeout().filter(|_| self.is_on());
        ra.chain(jaus).chain([gateway]).flatten().min()
    }

    fn wake(&mut self) {
        let now = self.now;
        if self.is_on() {
            self.gateway.handle_timeout(now);
        }
        for peer in &mut self.ra {
            peer.node.handle_timeout(now);
            if let Some(rover) = &mut peer.rover {
                rover.handle_timeout(now);
            }
        }
        for peer in self.jaus.iter_mut().filter(|peer| peer.up) {
            peer.stack.handle_timeout(now);
        }
    }

    /// Delivers datagrams and messages until none is in transit.
    pub(crate) fn settle(&mut self) {
        while self.carry_ra() | self.carry_jaus() {}
    }

    fn carry_ra(&mut self) -> bool {
        let (now, mut moved) = (self.now, false);
        while self.is_on()
            && let Some(transmit) = self.gateway.poll_transmit()
        {
            moved = true;
            self.sent.push(transmit.datagram.clone());
            for peer in self.ra.iter_mut().filter(|_| !self.ra_cut) {
                if transmit.to == To::Group || transmit.to == To::Address(peer.address) {
                    let datagram = transmit.datagram.clone();
                    peer.node.handle_datagram(now, address(1), datagram);
                }
            }
        }
        let mut arrivals = Vec::new();
        for peer in &mut self.ra {
            while let Some(event) = peer.node.poll_event() {
                moved = true;
                match event {
                    node::Event::Message(message) => {
                        if let Some(rover) = &mut peer.rover {
                            rover.handle_message(now, &message);
                        }
                        peer.heard.push(message);
                    }
                    event => peer.seen.push(event),
                }
            }
            let said = peer.rover.as_mut().map(Rover::take_said);
            for message in said.unwrap_or_default() {
                moved = true;
                // Sending to a lost peer may fail.
                let _ = peer.node.send(now, &message);
            }
            while let Some(transmit) = peer.node.poll_transmit() {
                moved = true;
                if transmit.to == To::Group || transmit.to == To::Address(address(1)) {
                    arrivals.push(Arrival::Datagram(peer.address, transmit.datagram));
                }
            }
        }
        arrivals.into_iter().for_each(|it| self.arrive(it));
        moved
    }

    fn carry_jaus(&mut self) -> bool {
        let mut sent = Vec::new();
        while self.is_on()
            && let Some(action) = self.gateway.poll_action()
        {
            match action {
                Action::Attach(id) => assert!(self.attached.insert(id), "{id} twice"),
                Action::Detach(id) => assert!(self.attached.remove(&id), "{id} is not there"),
                Action::Send(message) => {
                    assert!(self.attached.contains(&message.source), "{message:?}");
                    sent.push(message);
                }
            }
        }
        for peer in &mut self.jaus {
            while let Some(message) = peer.stack.poll_transmit() {
                if !peer.up {
                    continue;
                }
                // The gateway's node tells it so.
                if self.attached.contains(&message.source) {
                    let from = address(99).into();
                    self.gateway.handle_conflict(self.now, message.source, from);
                }
                sent.push(message);
            }
            while let Some(event) = peer.stack.poll_event() {
                peer.events.push(event);
            }
        }
        let moved = !sent.is_empty();
        for message in sent {
            self.deliver(&message);
        }
        moved
    }

    fn deliver(&mut self, message: &Outgoing) {
        let received = |to: JausId| Received {
            source: message.source,
            destination: message.destination,
            to,
            priority: message.priority,
            broadcast: message.broadcast,
            payload: message.payload.clone(),
            sequence: None,
            path: None,
            acknowledged: false,
        };
        let meant = |id: &JausId| *id != message.source && message.destination.matches(*id);
        let attached: Vec<JausId> = self.attached.iter().copied().filter(meant).collect();
        let from_gateway = self.attached.contains(&message.source);
        for id in attached {
            self.arrive(Arrival::Message(received(id)));
        }
        let cut = self.jaus_cut && from_gateway;
        for peer in self.jaus.iter_mut().filter(|peer| peer.up && !cut) {
            let id = peer.stack.id();
            if meant(&id) {
                peer.stack.handle_message(self.now, &received(id));
            }
        }
    }

    /// The JAUS components that the gateway has attached.
    pub(crate) fn attached(&self) -> Vec<String> {
        self.attached.iter().map(ToString::to_string).collect()
    }

    pub(crate) fn count(&self, counter: Counter) -> u64 {
        self.gateway.counters().get(counter)
    }

    /// Sends a JAUS component's query. Returns the answer, if one arrives within 2 s.
    pub(crate) fn ask<R: jaus::codec::Message>(
        &mut self,
        who: usize,
        peer: JausId,
        query: &impl jaus::codec::Message,
    ) -> Option<R> {
        let patience = Patience {
            tries: 1,
            interval: Duration::from_secs(2),
        };
        let payload = query.encode().unwrap();
        let stack = &mut self.jaus[who].stack;
        let inquiry = stack.ask(self.now, peer, Question::new(payload, R::CODE), patience);
        self.run(Duration::from_millis(2100));
        let answer = self.answer(who, inquiry)?;
        Some(R::decode(&answer).unwrap())
    }

    fn answer(&mut self, who: usize, inquiry: Inquiry) -> Option<Bytes> {
        let mut events = self.jaus[who].events.iter();
        events.find_map(|event| match event {
            Event::Answer(it, answer) if *it == inquiry => answer.clone().ok(),
            _ => None,
        })
    }

    /// A JAUS component sends a command.
    pub(crate) fn tell(&mut self, who: usize, peer: JausId, command: &impl jaus::codec::Message) {
        self.jaus[who].stack.send(peer, command);
        self.settle();
    }

    /// A component of an RA system sends a message.
    pub(crate) fn ra_says(&mut self, who: usize, message: &Message) {
        self.ra[who].node.send(self.now, message).unwrap();
        self.settle();
    }

    /// Returns the messages with this code that the components of an RA system have received, and
    /// clears all received messages.
    pub(crate) fn ra_heard(&mut self, who: usize, code: u16) -> Vec<Message> {
        let heard = std::mem::take(&mut self.ra[who].heard);
        heard.into_iter().filter(|it| it.code == code).collect()
    }
}

/// An RA subsystem of one node with these components.
pub(crate) fn subsystem(id: u8, name: &str, components: &[(u8, u8, &str)]) -> RaSubsystemEntry {
    let component = |&(component, instance, name): &(u8, u8, &str)| node::RaComponentEntry {
        component,
        instance,
        name: name.to_owned(),
        services: Vec::new(),
    };
    RaSubsystemEntry {
        id,
        name: name.to_owned(),
        nodes: vec![node::RaNodeEntry {
            id: 1,
            name: format!("{name} node"),
            components: components.iter().map(component).collect(),
        }],
    }
}
