//! Operators that compete for a vehicle over a bad wire with restarts: there are never two
//! controllers, only the controller makes the vehicle act, an emergency from any client stops it, a
//! controller soon learns of its loss of control, and on a good wire control can be taken.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::{Config, Endpoint};
use jaus::messages::core::{
    ClearEmergency, DeleteElement, Reset, Resume, SetEmergency, Standby, list_manager,
};
use jaus::service::{
    AccessControl, ControlId, ControlNews, Discovery, Event, Handlers, Kind, Management, Patience,
    Profile, Scope, Service, Stack, State, Timing,
};

use crate::rules::Rules;
use crate::sim::{Conditions, Event as EndpointEvent, Host, Network, OwnedEndpoint, Owner, Random};
use crate::totals::Counts;

const VEHICLE: JausId = JausId::new(101, 1, 1);
const OPERATORS: [JausId; 3] = [
    JausId::new(42, 1, 1),
    JausId::new(43, 1, 1),
    JausId::new(44, 1, 1),
];
/// The counted events.
const NAMES: [&str; 6] = [
    "requests",
    "restarts",
    "times in control",
    "emergencies",
    "commands obeyed",
    "controls taken after healing",
];
const TROUBLE: Duration = Duration::from_secs(120);
const ACTIONS: usize = 150;
/// On a good wire, operators and vehicle agree after this time.
const REST: Duration = Duration::from_secs(10);
/// A client knows of its loss of control at the latest when control has been unconfirmed for five
/// seconds, plus the delay of the last confirmation.
const DELUSION: Duration = Duration::from_millis(5500);

/// On a good wire, an operator with the highest authority gets control of a vehicle without an
/// emergency within this time, and is obeyed.
const TAKEN: Duration = Duration::from_secs(5);

/// Runs the scenario of a seed; an error names the broken promise.
pub(crate) fn run(seed: u64) -> Result<Counts, String> {
    let mut world = World::new(seed);
    let start = world.network.now();
    let mut times: Vec<_> = (0..ACTIONS)
        .map(|_| world.random.up_to_millis(TROUBLE.as_millis() as u64))
        .collect();
    times.sort_unstable();
    for time in times {
        let now = world.network.now();
        world.run_for((start + time).saturating_duration_since(now))?;
        world.act();
    }
    world.come_to_rest()?;
    world.take_control()?;
    Ok(world.counts)
}

/// The vehicle, with an observer's view of its messages.
struct Vehicle {
    stack: Stack,
    rules: Rules,
    /// Senders of the executed commands since the last check.
    acted: Arc<Mutex<Vec<JausId>>>,
    /// Number of executed commands since the last count.
    obeyed: u64,
    /// The first broken promise.
    broken: Option<String>,
}

struct Operator {
    stack: Stack,
    asked: Option<ControlId>,
    holds: bool,
    /// When it began to be wrong about `holds`.
    wrong: Option<Instant>,
}

enum Party {
    Vehicle(Box<Vehicle>),
    Operator(Box<Operator>),
}

fn stack(id: JausId, services: Vec<Box<dyn Service>>) -> Stack {
    let profile = Profile::new(Kind::Vehicle, "Anybody");
    let discovery = Discovery::new(id, profile, Scope::Nobody, Timing::default(), 1);
    Stack::new(discovery, services)
}

impl Vehicle {
    fn party(now: Instant, timeout: u8) -> Party {
        let acted = Arc::new(Mutex::new(Vec::new()));
        let acts = acted.clone();
        // Any command would do.
        let driver =
            Handlers::new(list_manager::LATEST).command(move |_: DeleteElement, from, _context| {
                acts.lock().expect("no panic").push(from.source);
            });
        let access = AccessControl::new().timeout(timeout);
        let mut stack = stack(VEHICLE, vec![Box::new(driver)])
            .management(Management::new().access_control(access));
        stack.start(now);
        Party::Vehicle(Box::new(Self {
            stack,
            rules: Rules::new(now, Duration::from_secs(timeout.into())),
            acted,
            obeyed: 0,
            broken: None,
        }))
    }

    fn settle(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        let mut outcome = Ok(());
        while let Some(message) = self.stack.poll_transmit() {
            outcome = outcome.and_then(|()| self.rules.say(now, &message));
            // The route to the operator may be gone.
            let _ = endpoint.send(now, message);
        }
        while self.stack.poll_event().is_some() {}
        let acted_for = std::mem::take(&mut *self.acted.lock().expect("no panic"));
        self.obeyed += acted_for.len() as u64;
        let standing = self.stack.standing();
        let outcome = outcome.and_then(|()| self.rules.judge(now, standing, &acted_for));
        if let Err(reason) = outcome {
            self.broken.get_or_insert(reason);
        }
    }
}

impl Operator {
    fn party(now: Instant, id: JausId) -> Party {
        let mut stack = stack(id, Vec::new());
        stack.start(now);
        Party::Operator(Box::new(Self {
            stack,
            asked: None,
            holds: false,
            wrong: None,
        }))
    }

    fn settle(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        while let Some(message) = self.stack.poll_transmit() {
            // There may be no route to the vehicle yet.
            let _ = endpoint.send(now, message);
        }
        while let Some(event) = self.stack.poll_event() {
            if let Event::Control(id, news) = event
                && self.asked == Some(id)
            {
                match news {
                    ControlNews::Granted => self.holds = true,
                    ControlNews::Status(_) => {}
                    ControlNews::Lost(_) => self.holds = false,
                    ControlNews::Refused(_) | ControlNews::Released => {
                        self.holds = false;
                        self.asked = None;
                    }
                }
            }
        }
    }

    fn check(&mut self, now: Instant, controller: Option<JausId>) -> Result<(), String> {
        let id = self.stack.id();
        if !self.holds || controller == Some(id) {
            self.wrong = None;
            return Ok(());
        }
        let wrong = now.saturating_duration_since(*self.wrong.get_or_insert(now));
        if wrong > DELUSION {
            return Err(format!(
                "{id} has believed for {wrong:?} that it is in control, and {controller:?} is"
            ));
        }
        Ok(())
    }
}

impl Owner for Party {
    fn handle_event(&mut self, now: Instant, endpoint: &mut OwnedEndpoint, event: EndpointEvent) {
        let EndpointEvent::Received(message) = event else {
            return;
        };
        match self {
            Self::Vehicle(vehicle) => {
                vehicle.rules.hear(now, &message);
                vehicle.stack.handle_message(now, &message);
                vehicle.settle(now, endpoint);
            }
            Self::Operator(operator) => {
                operator.stack.handle_message(now, &message);
                operator.settle(now, endpoint);
            }
        }
    }

    fn handle_timeout(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        match self {
            Self::Vehicle(vehicle) => {
                vehicle.stack.handle_timeout(now);
                vehicle.settle(now, endpoint);
            }
            Self::Operator(operator) => {
                operator.stack.handle_timeout(now);
                operator.settle(now, endpoint);
            }
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        match self {
            Self::Vehicle(vehicle) => vehicle.stack.poll_timeout(),
            Self::Operator(operator) => operator.stack.poll_timeout(),
        }
    }
}

struct World {
    random: Random,
    network: Network<Party>,
    timeout: u8,
    vehicle: Host,
    operators: [Host; 3],
    /// The controller at the last check, and whether there was an emergency.
    seen: (Option<JausId>, bool),
    counts: Counts,
}

fn endpoint(id: JausId) -> Endpoint {
    let mut endpoint = Endpoint::new(Config::default());
    endpoint.attach(id).expect("a component");
    endpoint
}

impl World {
    fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let conditions = Conditions {
            lost: random.choose(&[0, 50, 200]),
            repeated: random.choose(&[0, 100]),
            ..Conditions::poor()
        };
        let timeout = random.choose(&[0, 2, 5]);
        let mut network = Network::new(random.number(), conditions);
        if crate::sim::seeds::is_traced() {
            network.trace().print();
        }
        let now = network.now();
        let vehicle = network.join(endpoint(VEHICLE), Vehicle::party(now, timeout));
        let operators = OPERATORS.map(|id| network.join(endpoint(id), Operator::party(now, id)));
        Self {
            random,
            network,
            timeout,
            vehicle,
            operators,
            seen: (None, false),
            counts: NAMES.map(|name| (name, 0)).into(),
        }
    }

    fn count(&mut self, name: &'static str) {
        *self.counts.entry(name).or_default() += 1;
    }

    fn act(&mut self) {
        let place = self.random.below(OPERATORS.len());
        let (host, now) = (self.operators[place], self.network.now());
        match self.random.below(40) {
            0..8 => {
                let authority = self.random.choose(&[50, 100, 200]);
                self.request(host, authority);
            }
            8..11 => self.with(host, |stack, now, asked| {
                if let Some(id) = asked.take() {
                    stack.release_control(now, id);
                }
            }),
            11..26 => self.say(host, &DeleteElement::default()),
            26..30 => self.say(host, &Resume {}),
            30 => self.say(host, &Standby {}),
            31 => self.say(host, &Reset {}),
            32 => self.say(host, &SetEmergency::default()),
            33..36 => self.say(host, &ClearEmergency::default()),
            36 => {
                self.count("restarts");
                let vehicle = Vehicle::party(now, self.timeout);
                self.network
                    .restart(self.vehicle, endpoint(VEHICLE), vehicle);
            }
            37 => {
                self.count("restarts");
                let id = OPERATORS[place];
                self.network
                    .restart(host, endpoint(id), Operator::party(now, id));
                self.vehicle().rules.restart(now, id);
            }
            cut => self.network.set_cut(self.vehicle, host, cut == 38),
        }
    }

    fn with(&mut self, host: Host, act: impl FnOnce(&mut Stack, Instant, &mut Option<ControlId>)) {
        self.network.act(host, |now, party, endpoint| {
            let Party::Operator(operator) = party else {
                return;
            };
            let before = operator.asked;
            act(&mut operator.stack, now, &mut operator.asked);
            if operator.asked != before {
                operator.holds = false;
            }
            operator.settle(now, endpoint);
        });
    }

    fn request(&mut self, host: Host, authority: u8) {
        self.count("requests");
        self.with(host, |stack, now, asked| {
            // Release lost control before requesting it again.
            if let Some(id) = *asked {
                stack.release_control(now, id);
            }
            let patience = Patience::default();
            *asked = stack
                .request_control(now, VEHICLE, authority, patience)
                .ok();
        });
    }

    fn say<M: Message>(&mut self, host: Host, message: &M) {
        self.with(host, |stack, _, _| stack.send(VEHICLE, message));
    }

    fn vehicle(&mut self) -> &mut Vehicle {
        match self.network.owner(self.vehicle) {
            Party::Vehicle(vehicle) => vehicle,
            Party::Operator(_) => panic!("the vehicle is meant"),
        }
    }

    fn operator(&mut self, host: Host) -> &mut Operator {
        match self.network.owner(host) {
            Party::Operator(operator) => operator,
            Party::Vehicle(_) => panic!("an operator is meant"),
        }
    }

    fn run_for(&mut self, time: Duration) -> Result<(), String> {
        let step = Duration::from_millis(100);
        let end = self.network.now() + time;
        while self.network.now() < end {
            let left = end.saturating_duration_since(self.network.now());
            self.network.run_for(left.min(step));
            let now = self.network.now();
            let before = self.seen;
            let vehicle = self.vehicle();
            let controller = vehicle.stack.standing().controller.map(|it| it.id);
            let is_emergency = vehicle.stack.standing().state == State::Emergency;
            let obeyed = std::mem::take(&mut vehicle.obeyed);
            if let Some(broken) = &vehicle.broken {
                return Err(format!("{VEHICLE} {broken}"));
            }
            self.seen = (controller, is_emergency);
            if controller.is_some() && controller != before.0 {
                self.count("times in control");
            }
            if is_emergency && !before.1 {
                self.count("emergencies");
            }
            *self.counts.entry("commands obeyed").or_default() += obeyed;
            for host in self.operators {
                self.operator(host).check(now, controller)?;
            }
        }
        Ok(())
    }

    /// Checks on a good wire that every client that believes itself in control really is.
    fn come_to_rest(&mut self) -> Result<(), String> {
        self.network.set_conditions(Conditions::good());
        for host in self.operators {
            self.network.set_cut(self.vehicle, host, false);
        }
        self.run_for(REST)?;
        let controller = self.vehicle().stack.standing().controller;
        for host in self.operators {
            let operator = self.operator(host);
            let id = operator.stack.id();
            if operator.holds && controller.is_none_or(|it| it.id != id) {
                return Err(format!(
                    "{id} believes to be in control, and {controller:?} is"
                ));
            }
        }
        Ok(())
    }

    /// Checks on a good wire without an emergency that the highest authority gets control and is
    /// obeyed.
    fn take_control(&mut self) -> Result<(), String> {
        for host in self.operators {
            self.say(host, &ClearEmergency::default());
            self.with(host, |stack, now, asked| {
                if let Some(id) = asked.take() {
                    stack.release_control(now, id);
                }
            });
        }
        self.run_for(Duration::from_secs(1))?;
        let host = self.operators[self.random.below(OPERATORS.len())];
        self.request(host, u8::MAX);
        self.run_for(TAKEN)?;
        let id = self.operator(host).stack.id();
        if !self.operator(host).holds {
            let standing = *self.vehicle().stack.standing();
            return Err(format!("{id} does not get control: {standing:?}"));
        }
        self.count("controls taken after healing");
        self.say(host, &Resume {});
        self.run_for(Duration::from_secs(1))?;
        let before = self.counts["commands obeyed"];
        self.say(host, &DeleteElement::default());
        self.run_for(Duration::from_secs(1))?;
        if self.counts["commands obeyed"] == before {
            let standing = *self.vehicle().stack.standing();
            return Err(format!("{id} is not obeyed: {standing:?}"));
        }
        Ok(())
    }
}
