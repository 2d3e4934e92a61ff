//! An RA vehicle, subsystem 20, on a socket. It is also an operator that queries and drives the
//! JAUS vehicle 101, if present.

use std::future::poll_fn;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::link::udp::{Settings, UdpLink};
use jaus::link::{Interfaces, Ip, Slab};
use jaus::wire::Priority;
use jaus_ra::carrier::To;
use jaus_ra::gateway::RaGateway;
use jaus_ra::node::{self, RaNode, RaSubsystemEntry};
use jaus_ra::{Message, RaId};

use jaus_test_kit::rover::Rover;

const OPERATOR: RaId = RaId::new(20, 1, 32, 1);
const DRIVER: RaId = RaId::new(101, 1, 33, 7);
const POSE: RaId = RaId::new(101, 1, 38, 7);
const VELOCITY: RaId = RaId::new(101, 1, 42, 7);

struct RaVehicle {
    node: RaNode,
    rover: Rover,
    link: UdpLink,
    /// When the next effort to the JAUS vehicle is due.
    next_effort: Option<Instant>,
    controller: Option<RaId>,
    driven: bool,
    moves: bool,
    /// Whether the RA vehicle drives, and how often it has started to.
    drives: bool,
    drives_begun: u32,
}

/// Runs it on an interface.
pub(crate) async fn play(interface: &str) {
    let named = Interfaces::Only(vec![interface.to_owned()]);
    let interface = named.choose(Ip::V4).unwrap().remove(0);
    let settings = Settings {
        group: RaGateway::group(),
        ..Settings::default()
    };
    let link = UdpLink::open(&interface, &settings).unwrap();
    println!("\nlistening on {}", link.local());
    let mut node = RaNode::new(node::Settings::default());
    node.announce(Instant::now(), subsystem()).unwrap();
    let vehicle = RaVehicle {
        node,
        rover: Rover::new(),
        link,
        next_effort: None,
        controller: None,
        driven: false,
        moves: false,
        drives: false,
        drives_begun: 0,
    };
    vehicle.run().await;
}

fn subsystem() -> RaSubsystemEntry {
    let component = |(component, name): (u8, &str)| node::RaComponentEntry {
        component,
        instance: 1,
        name: name.to_owned(),
        services: Vec::new(),
    };
    let parts = [(32, "OCU"), (33, "Driver"), (38, "Pose"), (42, "Velocity")];
    RaSubsystemEntry {
        id: 20,
        name: "Sim".to_owned(),
        nodes: vec![node::RaNodeEntry {
            id: 1,
            name: "Sim node".to_owned(),
            components: parts.map(component).into(),
        }],
    }
}

impl RaVehicle {
    async fn run(mut self) {
        let mut slab = Slab::default();
        loop {
            self.settle();
            let wake = [
                self.node.poll_timeout(),
                self.rover.poll_timeout(),
                self.next_effort,
            ];
            let wake = wake.into_iter().flatten().min();
            let look = Instant::now() + Duration::from_millis(100);
            let wake = wake.map_or(look, |wake| wake.min(look));
            tokio::select! {
                (from, datagram) = poll_fn(|cx| self.link.poll_recv(cx, &mut slab)) => {
                    self.node.handle_datagram(Instant::now(), from, datagram);
                }
                () = tokio::time::sleep_until(wake.into()) => {
                    let now = Instant::now();
                    self.node.handle_timeout(now);
                    self.rover.handle_timeout(now);
                    self.drive(now);
                }
            }
        }
    }

    fn settle(&mut self) {
        let now = Instant::now();
        while let Some(event) = self.node.poll_event() {
            match event {
                node::Event::Appeared(it) | node::Event::Changed(it) => self.look_at(now, &it),
                node::Event::Message(message) => {
                    self.rover.handle_message(now, &message);
                    self.hear(now, &message);
                }
                node::Event::Lost(_) => {}
            }
        }
        for message in self.rover.take_said() {
            // Sending to a lost peer may fail.
            let _ = self.node.send(now, &message);
        }
        self.tell();
        while let Some(transmit) = self.node.poll_transmit() {
            let datagram = &transmit.datagram;
            match transmit.to {
                To::Group => self.link.send_to_group(Priority::Standard, datagram),
                To::Address(peer) => self.link.send_to(peer, Priority::Standard, datagram),
            }
        }
    }

    /// Prints changes of the vehicle's controller and motion.
    fn tell(&mut self) {
        let controller = self.rover.controller.map(|(id, _)| id);
        if controller != self.controller {
            self.controller = controller;
            match controller {
                Some(id) => println!("controlled by {id}"),
                None => println!("controlled by nobody"),
            }
        }
        let drives = self.rover.drives(Instant::now());
        match (std::mem::replace(&mut self.drives, drives), drives) {
            (false, true) => {
                self.drives_begun += 1;
                println!("drives for the {}. time", self.drives_begun);
            }
            (true, false) => println!("stands"),
            _ => {}
        }
        if !self.driven && self.rover.efforts.len() > 10 && self.rover.controller_ready {
            self.driven = true;
            println!("driven");
        }
    }

    /// Starts to query and drive the JAUS vehicle when its subsystem appears.
    fn look_at(&mut self, now: Instant, subsystem: &RaSubsystemEntry) {
        if subsystem.components().any(|(id, _)| id == DRIVER) && self.next_effort.is_none() {
            println!("listed {} {}", subsystem.id, subsystem.name);
            self.say(now, POSE, 0x2402, &[1, 0]);
            self.say(now, DRIVER, 0x000D, &[127]);
        }
    }

    /// Handles answers of JAUS components.
    fn hear(&mut self, now: Instant, message: &Message) {
        match (message.code, message.source) {
            (0x4402, POSE) => println!("{POSE} latitude"),
            (0x000F, DRIVER) => {
                println!("in control of {DRIVER}");
                self.say(now, DRIVER, 0x0004, &[]);
                self.next_effort = Some(now);
            }
            (0x4404, VELOCITY) if !self.moves => {
                let speed = message.data.get(2..6).and_then(|it| it.first_chunk());
                if speed.is_some_and(|&speed| i32::from_le_bytes(speed) > 1000) {
                    self.moves = true;
                    println!("{VELOCITY} moves");
                }
            }
            _ => {}
        }
    }

    fn drive(&mut self, now: Instant) {
        if self.next_effort.is_some_and(|due| due <= now) {
            self.next_effort = Some(now + Duration::from_millis(100));
            self.say(now, DRIVER, 0x0405, &[1, 0, 0xFF, 0x3F]);
            self.say(now, VELOCITY, 0x2404, &[1, 0]);
        }
    }

    fn say(&mut self, now: Instant, to: RaId, code: u16, data: &[u8]) {
        let data = Bytes::copy_from_slice(data);
        let message = Message::new(OPERATOR, to, code, data);
        self.node.send(now, &message).unwrap();
    }
}
