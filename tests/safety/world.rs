//! The network of a trial: the vehicle with its hardware, the controller, a supervisor, other
//! peers, and a crowd of dying ids.

use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::endpoint::{Config, Endpoint, MessageHandle, Outgoing};
use jaus::messages::core::{
    QueryHeartbeatPulse, ReportIdentification, report_identification::QueryType,
};
use jaus::service::{Discovery, Kind, Liveness, Profile, Scope, Stack, Timing};

use crate::cell::{Cell, Fault};
use crate::client::Client;
use crate::commands::encode;
use crate::gateway::{Crossing, OPERATOR_BEHIND_GATEWAY, Operator};
use crate::plant::SharedPlant;
use crate::positioning::Positioning;
use crate::sim::{
    Conditions, Event as EndpointEvent, Host, Network, OwnedEndpoint, Owner, Random, WallClock,
    seeds,
};
use crate::vehicle::{Program, VEHICLE};
use crate::witness::Witness;

pub(crate) const CONTROLLER: JausId = JausId::new(42, 1, 1);
pub(crate) const SUPERVISOR: JausId = JausId::new(43, 1, 1);
/// Number of ids in the crowd.
pub(crate) const CROWD: usize = 1000;

/// One node of the network.
pub(crate) enum Party {
    Vehicle(Box<Vehicle>),
    Client(Box<Client>),
    Gateway(Box<Crossing>),
    Peer(Box<Stack>),
    Crowd,
}

/// The vehicle's program while it runs, and its observations.
pub(crate) struct Vehicle {
    program: Option<Program>,
    plant: SharedPlant,
    pub(crate) witness: Witness,
}

pub(crate) struct World {
    pub(crate) network: Network<Party>,
    pub(crate) plant: SharedPlant,
    cell: Cell,
    pub(crate) vehicle: Host,
    /// The controller; with the fault "gateway restarted" the gateway with the operator behind it.
    pub(crate) controller: Host,
    pub(crate) supervisor: Host,
    pub(crate) crowd: Host,
    crowd_size: usize,
    seed: u64,
    /// The controller's last message that it has sent by hand, with acknowledgement.
    pub(crate) last_delivery: Option<MessageHandle>,
}

impl Vehicle {
    fn settle(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        let Some(program) = &mut self.program else {
            return;
        };
        while let Some(message) = program.poll_transmit() {
            // The route to the client may be gone.
            let _ = endpoint.send(now, message);
        }
        let controller = program.standing().controller;
        self.witness
            .note_controller(now, controller.map(|it| it.id));
    }

    /// Removes the program.
    pub(crate) fn take_program(&mut self) -> Option<Program> {
        self.program.take()
    }
}

impl Owner for Party {
    fn handle_event(&mut self, now: Instant, endpoint: &mut OwnedEndpoint, event: EndpointEvent) {
        match (self, event) {
            (Self::Client(client), event) => client.handle_event(now, endpoint, event),
            (Self::Gateway(crossing), event) => crossing.handle_event(now, endpoint, event),
            (Self::Vehicle(vehicle), EndpointEvent::Received(message)) => {
                vehicle.plant.lock().advance(now);
                vehicle.witness.note_message(now, &message);
                if let Some(program) = &mut vehicle.program {
                    program.handle_message(now, &message);
                }
                vehicle.settle(now, endpoint);
            }
            (Self::Peer(stack), EndpointEvent::Received(message)) => {
                stack.handle_message(now, &message);
                settle_peer(stack, now, endpoint);
            }
            _ => {}
        }
    }

    fn handle_timeout(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        match self {
            Self::Client(client) => client.handle_timeout(now, endpoint),
            Self::Gateway(crossing) => crossing.handle_timeout(now, endpoint),
            Self::Vehicle(vehicle) => {
                vehicle.plant.lock().advance(now);
                if let Some(program) = &mut vehicle.program {
                    program.handle_timeout(now);
                }
                vehicle.settle(now, endpoint);
            }
            Self::Peer(stack) => {
                stack.handle_timeout(now);
                settle_peer(stack, now, endpoint);
            }
            Self::Crowd => {}
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        match self {
            Self::Client(client) => client.poll_timeout(),
            Self::Gateway(crossing) => crossing.poll_timeout(),
            Self::Vehicle(vehicle) => vehicle.program.as_ref()?.poll_timeout(),
            Self::Peer(stack) => stack.poll_timeout(),
            Self::Crowd => None,
        }
    }
}

fn settle_peer(stack: &mut Stack, now: Instant, endpoint: &mut OwnedEndpoint) {
    while let Some(message) = stack.poll_transmit() {
        // There may be no route to the peer yet.
        let _ = endpoint.send(now, message);
    }
    while stack.poll_event().is_some() {}
}

fn endpoint(id: JausId) -> Endpoint {
    let mut endpoint = Endpoint::new(Config::default());
    endpoint.attach(id).expect("a component");
    endpoint
}

fn crowd_ids() -> impl Iterator<Item = JausId> {
    (0..CROWD).map(|number| JausId::new(200, (number / 250 + 1) as u8, (number % 250 + 1) as u8))
}

fn crowd() -> Endpoint {
    let config = Config {
        max_components: CROWD,
        ..Config::default()
    };
    let mut endpoint = Endpoint::new(config);
    for id in crowd_ids() {
        endpoint.attach(id).expect("a component");
    }
    endpoint
}

fn peer(now: Instant, id: JausId) -> Party {
    let profile = Profile::new(Kind::Vehicle, "Another");
    let seed = u64::from(id.subsystem());
    let discovery = Discovery::new(id, profile, Scope::System, Timing::default(), seed);
    let mut stack = Stack::new(discovery, vec![Box::new(Liveness::new())]);
    stack.start(now);
    Party::Peer(Box::new(stack))
}

impl World {
    const SLICE: Duration = Duration::from_millis(20);

    pub(crate) fn new(random: &mut Random, cell: Cell, conditions: Conditions) -> Self {
        let seed = random.number();
        let mut network = Network::new(seed, conditions);
        if seeds::is_traced() {
            network.trace().print();
        }
        let now = network.now();
        // Every other vehicle steers like a car.
        let turning_radius = if seed.is_multiple_of(2) { 0.0 } else { 1.0 };
        let plant = SharedPlant::new(now, turning_radius);
        plant.lock().positioning = cell.driver.is_global().then(|| Positioning::new(now));
        let vehicle = network.join_with(endpoint(VEHICLE), |clock| {
            vehicle(now, cell, &plant, clock, seed)
        });
        let scope = random.choose(&[Scope::System, Scope::Nobody]);
        let client = |id, authority| Client::new(now, id, cell.driver, authority, scope);
        let party = |client| Party::Client(Box::new(client));
        let controller = match cell.fault {
            Fault::Gateway => {
                let crossing = Crossing::new(now, cell.driver);
                let nobody = Endpoint::new(Config::default());
                network.join(nobody, Party::Gateway(Box::new(crossing)))
            }
            Fault::ForeignRestarted => {
                let foreign = client(CONTROLLER, 100).foreign();
                network.join(endpoint(CONTROLLER), party(foreign))
            }
            _ => network.join(endpoint(CONTROLLER), party(client(CONTROLLER, 100))),
        };
        let supervisor = network.join(endpoint(SUPERVISOR), party(client(SUPERVISOR, 200)));
        let crowd = network.join(crowd(), Party::Crowd);
        for place in 0..random.below(4) {
            let id = JausId::new(110 + place as u16, 1, 1);
            network.join(endpoint(id), peer(now, id));
        }
        Self {
            network,
            plant,
            cell,
            vehicle,
            controller,
            supervisor,
            crowd,
            crowd_size: 0,
            seed,
            last_delivery: None,
        }
    }

    pub(crate) fn run_for(&mut self, time: Duration) {
        let end = self.network.now() + time;
        while self.network.now() < end {
            let left = end.saturating_duration_since(self.network.now());
            self.network.run_for(left.min(Self::SLICE));
            self.plant.lock().advance(self.network.now());
        }
    }

    /// Runs `act` on a client, and sends its messages.
    pub(crate) fn with_client(&mut self, host: Host, act: impl FnOnce(Instant, &mut Client)) {
        self.network.act(host, |now, party, endpoint| {
            let Party::Client(client) = party else {
                panic!("a client is meant");
            };
            act(now, client);
            client.settle(now, endpoint);
        });
    }

    /// Runs `act` on the vehicle, and sends the messages that it returns.
    pub(crate) fn with_vehicle(
        &mut self,
        act: impl FnOnce(Instant, &mut Vehicle) -> Vec<Outgoing>,
    ) {
        self.network.act(self.vehicle, |now, party, endpoint| {
            let Party::Vehicle(vehicle) = party else {
                panic!("the vehicle is meant");
            };
            vehicle.plant.lock().advance(now);
            for message in act(now, vehicle) {
                // The route to the client may be gone.
                let _ = endpoint.send(now, message);
            }
        });
    }

    pub(crate) fn witness(&mut self) -> &mut Witness {
        match self.network.owner(self.vehicle) {
            Party::Vehicle(vehicle) => &mut vehicle.witness,
            _ => panic!("the vehicle is meant"),
        }
    }

    /// Restarts the vehicle's program on the same hardware.
    pub(crate) fn restart_vehicle(&mut self) {
        let (now, clock) = (self.network.now(), self.network.clock(self.vehicle));
        let witness = self.witness().clone();
        let mut party = vehicle(now, self.cell, &self.plant, clock, self.seed);
        if let Party::Vehicle(vehicle) = &mut party {
            vehicle.witness = witness;
        }
        self.network.restart(self.vehicle, endpoint(VEHICLE), party);
    }

    /// Starts another controller with the same id.
    pub(crate) fn restart_controller(&mut self, insists: bool) {
        let now = self.network.now();
        let mut client = Client::new(now, CONTROLLER, self.cell.driver, 100, Scope::System);
        if self.cell.fault == Fault::ForeignRestarted {
            client = client.foreign();
        }
        if insists {
            client.insist();
        }
        let party = Party::Client(Box::new(client));
        self.network
            .restart(self.controller, endpoint(CONTROLLER), party);
    }

    /// Runs `act` on the operator behind the gateway.
    pub(crate) fn with_operator(&mut self, act: impl FnOnce(Instant, &mut Operator)) {
        self.network.act(self.controller, |now, party, endpoint| {
            let Party::Gateway(crossing) = party else {
                panic!("the gateway is meant");
            };
            act(now, crossing.operator());
            crossing.settle(now, endpoint);
        });
    }

    /// Restarts the gateway; the operator behind it keeps its state.
    pub(crate) fn restart_gateway(&mut self) {
        let party = std::mem::replace(self.network.owner(self.controller), Party::Crowd);
        let Party::Gateway(crossing) = party else {
            panic!("the gateway is meant");
        };
        let crossing = crossing.restart(self.network.now());
        let nobody = Endpoint::new(Config::default());
        let party = Party::Gateway(Box::new(crossing));
        self.network.restart(self.controller, nobody, party);
    }

    /// When the gateway, as it runs now, attached the operator.
    pub(crate) fn operator_attached(&mut self) -> Option<Instant> {
        match self.network.owner(self.controller) {
            Party::Gateway(crossing) => crossing.attached,
            _ => None,
        }
    }

    /// Sends one message each from `count` more ids of the crowd.
    pub(crate) fn let_crowd_come(&mut self, random: &mut Random, count: usize) {
        let ids: Vec<_> = crowd_ids().skip(self.crowd_size).take(count).collect();
        self.crowd_size += ids.len();
        let report = ReportIdentification {
            query_type: QueryType(4),
            ..ReportIdentification::default()
        };
        let payloads = [encode(&QueryHeartbeatPulse {}), encode(&report)];
        for some in ids.chunks(20) {
            self.network.act(self.crowd, |now, _, endpoint| {
                for &id in some {
                    let payload = payloads[random.below(2)].clone();
                    // A datagram refused by a full queue does not matter.
                    let _ = endpoint.send(now, Outgoing::new(id, VEHICLE, payload));
                }
            });
            self.run_for(Self::SLICE);
        }
    }
}

fn vehicle(now: Instant, cell: Cell, plant: &SharedPlant, clock: WallClock, seed: u64) -> Party {
    let controller = match cell.fault {
        Fault::Gateway => OPERATOR_BEHIND_GATEWAY,
        _ => CONTROLLER,
    };
    Party::Vehicle(Box::new(Vehicle {
        program: Some(Program::new(now, cell, plant, clock, seed)),
        plant: plant.clone(),
        witness: Witness::new(cell.driver, controller),
    }))
}
