//! An operator among RA systems and the gateway to the vehicle: the controller in the cells with
//! the fault "gateway restarted".
//!
//! The two form one party without losses between them; the gateway's JAUS side is a node of the
//! simulated network.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::rights::Acceptance;
use jaus_ra::carrier::To;
use jaus_ra::convert::to_ra;
use jaus_ra::gateway::{Action, Gateway, Settings};
use jaus_ra::node::{self, RaNode, RaSubsystemEntry};
use jaus_ra::{Message, RaId};

use crate::sim::{Event as EndpointEvent, OwnedEndpoint};

use crate::cell::Driver;
use crate::commands;
use crate::vehicle::VEHICLE;

const GATEWAY: JausId = JausId::new(250, 1, 1);
/// The operator among RA systems, a commander.
const OPERATOR: RaId = RaId::new(42, 1, 32, 1);
/// Offset from a command's code to its report's.
const REPORT: u16 = 0x4000;
/// The operator's JAUS id.
pub(crate) const OPERATOR_BEHIND_GATEWAY: JausId = JausId::new(42, 1, 32);

/// A gateway, and an operator behind it.
pub(crate) struct Crossing {
    gateway: Gateway,
    operator: Operator,
    /// When the gateway attached the operator.
    pub(crate) attached: Option<Instant>,
}

/// The RA operator.
pub(crate) struct Operator {
    node: RaNode,
    driver: Driver,
    /// Whether it repeats Request Control, Resume and its commands until the vehicle moves.
    sets_out: bool,
    /// Whether it repeats its setpoints.
    streams: bool,
    /// Whether it keeps sending commands after the fault.
    insists: bool,
    ticks: u32,
    next: Instant,
}

impl Crossing {
    pub(crate) fn new(now: Instant, driver: Driver) -> Self {
        Self::with(now, Operator::new(now, driver))
    }

    fn with(now: Instant, operator: Operator) -> Self {
        let all = "65535.255.255 control=255".parse().expect("a grant");
        let settings = Settings {
            grants: Acceptance::new([all]),
            ..Settings::default()
        };
        let mut gateway = Gateway::new(GATEWAY, settings).expect("a subsystem of RA's");
        gateway.start(now);
        Self {
            gateway,
            operator,
            attached: None,
        }
    }

    /// Restarts a killed gateway; the operator keeps its state.
    pub(crate) fn restart(self, now: Instant) -> Self {
        Self::with(now, self.operator)
    }

    pub(crate) fn operator(&mut self) -> &mut Operator {
        &mut self.operator
    }

    pub(crate) fn handle_event(
        &mut self,
        now: Instant,
        endpoint: &mut OwnedEndpoint,
        event: EndpointEvent,
    ) {
        if let EndpointEvent::Received(message) = event {
            self.gateway.handle_message(now, &message);
        }
        self.settle(now, endpoint);
    }

    pub(crate) fn handle_timeout(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        self.gateway.handle_timeout(now);
        self.operator.handle_timeout(now);
        self.settle(now, endpoint);
    }

    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        let operator = self.operator.poll_timeout();
        self.gateway
            .poll_timeout()
            .into_iter()
            .chain(operator)
            .min()
    }

    /// Passes datagrams and actions on until none are left.
    pub(crate) fn settle(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        while self.carry_datagrams(now) | self.carry_actions(now, endpoint) {}
    }

    fn carry_datagrams(&mut self, now: Instant) -> bool {
        let (gateway, operator) = (address(1), address(2));
        let mut moved = false;
        while let Some(transmit) = self.gateway.poll_transmit() {
            moved = true;
            if [To::Group, To::Address(operator)].contains(&transmit.to) {
                let node = &mut self.operator.node;
                node.handle_datagram(now, gateway, transmit.datagram);
            }
        }
        moved |= self.operator.handle_events(now);
        while let Some(transmit) = self.operator.node.poll_transmit() {
            moved = true;
            if [To::Group, To::Address(gateway)].contains(&transmit.to) {
                self.gateway
                    .handle_datagram(now, operator, transmit.datagram);
            }
        }
        moved
    }

    fn carry_actions(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) -> bool {
        let mut moved = false;
        while let Some(action) = self.gateway.poll_action() {
            moved = true;
            match action {
                Action::Attach(id) => {
                    endpoint.attach(id).expect("each id once");
                    if id == OPERATOR_BEHIND_GATEWAY {
                        self.attached.get_or_insert(now);
                    }
                }
                Action::Detach(id) => endpoint.detach(id),
                Action::Send(message) => {
                    // The route to the receiver may be gone.
                    let _ = endpoint.send(now, message);
                }
            }
        }
        moved
    }
}

impl Operator {
    /// Interval of its setpoints.
    const PERIOD: Duration = Duration::from_millis(100);

    fn new(now: Instant, driver: Driver) -> Self {
        let mut node = RaNode::new(node::Settings::default());
        let announced = node.announce(now, subsystem());
        announced.expect("a subsystem of one component");
        Self {
            node,
            driver,
            sets_out: false,
            streams: false,
            insists: false,
            ticks: 0,
            next: now,
        }
    }

    /// Takes control and drives.
    pub(crate) fn begin(&mut self) {
        self.sets_out = true;
        self.streams = self.driver.is_streamed();
    }

    /// The vehicle moves: from now on the operator repeats only setpoints.
    pub(crate) fn note_motion(&mut self) {
        self.sets_out = false;
    }

    /// Repeats its commands from now on, in control or not.
    pub(crate) fn insist(&mut self) {
        self.insists = true;
    }

    pub(crate) fn request_control(&mut self, now: Instant) {
        self.say(now, part(self.driver), 0x000D, Bytes::from_static(&[100]));
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.node.handle_timeout(now);
        if self.next <= now {
            self.next = now + Self::PERIOD;
            self.ticks += 1;
            self.act(now);
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let next = (self.sets_out || self.streams || self.insists).then_some(self.next);
        self.node.poll_timeout().into_iter().chain(next).min()
    }

    fn act(&mut self, now: Instant) {
        let stage = self.sets_out.then_some(self.ticks % 20);
        match stage {
            Some(0) => self.request_control(now),
            Some(5) => self.say(now, part(self.driver), 0x0004, Bytes::new()),
            _ => {}
        }
        if stage == Some(8) || self.streams || self.insists {
            for (code, data) in motion(self.driver) {
                self.say(now, part(self.driver), code, data);
            }
        }
    }

    fn say(&mut self, now: Instant, part: u8, code: u16, data: Bytes) {
        let (subsystem, instance) = (VEHICLE.subsystem() as u8, VEHICLE.component());
        let vehicle = RaId::new(subsystem, VEHICLE.node(), part, instance);
        // The gateway may be gone.
        let _ = self
            .node
            .send(now, &Message::new(OPERATOR, vehicle, code, data));
    }

    /// Answers status queries with ready.
    fn handle_events(&mut self, now: Instant) -> bool {
        let mut moved = false;
        while let Some(event) = self.node.poll_event() {
            moved = true;
            if let node::Event::Message(message) = event
                && message.code == 0x2002
            {
                let ready = Bytes::from_static(&[1, 0, 0, 0, 0]);
                // The requester may be gone.
                let _ = self.node.send(now, &message.answer(0x4002, ready));
            }
        }
        moved
    }
}

fn address(host: u8) -> SocketAddr {
    SocketAddr::from(([10, 77, 0, host], 3794))
}

fn subsystem() -> RaSubsystemEntry {
    let commander = node::RaComponentEntry {
        component: OPERATOR.component,
        instance: OPERATOR.instance,
        name: "Commander".to_owned(),
        services: Vec::new(),
    };
    RaSubsystemEntry {
        id: OPERATOR.subsystem,
        name: "Operator".to_owned(),
        nodes: vec![node::RaNodeEntry {
            id: OPERATOR.node,
            name: "Operator".to_owned(),
            components: vec![commander],
        }],
    }
}

/// The RA component type that represents a driver.
fn part(driver: Driver) -> u8 {
    match driver {
        Driver::Effort | Driver::HeldEffort | Driver::Own => 33,
        Driver::Vector => 44,
        Driver::Waypoint | Driver::List => 46,
        Driver::Path => 48,
        Driver::Velocity | Driver::HeldVelocity => panic!("RA has no velocity command"),
        Driver::GlobalVector | Driver::GlobalWaypoint => panic!("not driven through the gateway"),
    }
}

/// The RA messages that set the vehicle in motion. An RA client makes a list by numbering its
/// places.
fn motion(driver: Driver) -> Vec<(u16, Bytes)> {
    let mut number = 0_u16;
    let message = |payload: Bytes| {
        let (code, data) = to_ra(&payload).expect("RA has this command");
        // A report has the layout of the command.
        let code = code & !REPORT;
        if !matches!(code, 0x040D | 0x0410) {
            return (code, data);
        }
        let mut numbered = data.to_vec();
        numbered[1..3].copy_from_slice(&number.to_le_bytes());
        number += 1;
        (code, numbered.into())
    };
    commands::places_and_speed(driver)
        .into_iter()
        .map(message)
        .collect()
}
