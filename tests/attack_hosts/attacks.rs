//! What the attacker does. Each attack ends by itself and says how much it has sent and got.

use std::time::Duration;

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
use jaus::wire::{Acknowledgement, DataControl, Flags, Frame, judp};

use crate::attacker::Attacker;
use crate::clients::{CLIENT, VEHICLE};
use crate::testbed::TO_STRANGERS;

/// Longer than the client needs for two looks and a newcomer to be found.
const LONG: Duration = Duration::from_secs(30);

/// The attacks that the echo socket sees too.
const FLOODS: [&str; 3] = ["flood", "unending", "gapped"];

pub(crate) async fn run(attack: &str) {
    let mut attacker = Attacker::new();
    if FLOODS.contains(&attack) {
        attacker = attacker.with_echo();
    }
    match attack {
        "flood" => attacker.repeat(LONG / 2, 10_000, mutate),
        "unending" => attacker.repeat(LONG / 2, 10_000, unending),
        "gapped" => attacker.repeat(LONG / 2, 10_000, gapped),
        "overlapping" => attacker.repeat(LONG / 2, 10_000, overlapping),
        "answers" => attacker.repeat(LONG / 2, 10_000, answers),
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

/// Datagrams with one octet changed.
fn mutate(attacker: &mut Attacker, number: u32) {
    let id = JausId::new(3000, 1, (number % 250 + 1) as u8);
    let mut frame = Frame::new(id, VEHICLE, pose().encode().unwrap());
    frame.sequence = number as u16;
    let mut datagram = judp::encode(&frame).unwrap().to_vec();
    let place = number as usize * 7 % datagram.len();
    datagram[place] ^= (number / 7 % 255 + 1) as u8;
    attacker.send_octets(&datagram);
}

fn fragment(source: JausId, sequence: u32, data: DataControl, octets: usize) -> Frame {
    Frame {
        flags: Flags::default().with_data(data),
        sequence: sequence as u16,
        ..Frame::new(source, VEHICLE, vec![0x55; octets].into())
    }
}

/// Messages of 200 ids that have a beginning, no end, and every second time no octets.
fn unending(attacker: &mut Attacker, number: u32) {
    let (id, position) = (number % 200, number / 200);
    let data = match position {
        0 => DataControl::First,
        _ => DataControl::Middle,
    };
    let octets = [1400, 0][position as usize % 2];
    let id = JausId::new(7000, 1, (id + 1) as u8);
    attacker.send_frame(&fragment(id, position + 1, data, octets));
}

/// Every second fragment of messages of 20 ids, the last ones first.
fn gapped(attacker: &mut Attacker, number: u32) {
    let (id, position) = (number % 20, number / 20);
    let id = JausId::new(7001, 1, (id + 1) as u8);
    let sequence = u32::MAX - 2 * position;
    attacker.send_frame(&fragment(id, sequence, DataControl::Middle, 64));
}

/// All numbers in an order in which any span of them is hit soon.
const fn scattered(number: u32) -> u32 {
    number.wrapping_mul(40_503)
}

/// Fragments in the client's id with any number, that overlap what it sends itself.
fn overlapping(attacker: &mut Attacker, number: u32) {
    let data = [DataControl::Middle, DataControl::Last, DataControl::First][number as usize % 3];
    attacker.send_frame(&fragment(CLIENT, scattered(number / 3), data, 1000));
}

/// Acknowledgements and refusals in the client's id of any number.
fn answers(attacker: &mut Attacker, number: u32) {
    let answer = [Acknowledgement::Negative, Acknowledgement::Positive][number as usize % 2];
    attacker.send_frame(&Frame {
        flags: Flags::default().with_acknowledgement(answer),
        sequence: scattered(number / 2) as u16,
        ..Frame::new(CLIENT, VEHICLE, Bytes::new())
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
