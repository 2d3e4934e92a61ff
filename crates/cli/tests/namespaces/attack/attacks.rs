//! The attacks. Each one ends by itself and reports how much it has sent and received.

use std::net::SocketAddr;
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
    CreateEvent, QueryHeartbeatPulse, QueryServices, ReportConfiguration, ReportServices,
    RequestControl, Resume,
};
use jaus::messages::mobility::{QueryLocalPose, SetWrenchEffort};
use jaus::node::{Config, Node};
use jaus::wire::{Acknowledgement, Broadcast, DataControl, Flags, Frame, judp};
use jaus_ra::RaId;

use super::attacker::Attacker;
use super::bed::TO_STRANGERS6;
use super::clients::{CLIENT, VEHICLE};
use crate::testbed::TO_STRANGERS;
use jaus_test_kit::rover;

/// Enough for the client's two reports and for a newcomer to be found.
const LONG: Duration = Duration::from_secs(20);

/// The flood of handshakes. Handshakes from one address are cheap to refuse.
const HANDSHAKES: u32 = 10_000;

const TIME: Duration = Duration::from_secs(6);
/// Datagrams per second of a flood: fewer for an unoptimised vehicle, which shares its processor
/// with other tests.
const FLOOD: u32 = if cfg!(debug_assertions) { 5000 } else { 20_000 };

pub(crate) async fn run(attack: &str) {
    let mut attacker = match attack {
        "services" => return services().await,
        // Copied to the echo socket.
        "flood" | "unending" | "gapped" => Attacker::new().with_echo(),
        "forged-id6" => ip6(9),
        "ra-flood" | "ra-forged" => on_cable(),
        #[cfg(feature = "secure")]
        "handshakes" => super::secure::stranger(),
        _ => Attacker::new(),
    };
    match attack {
        "flood" => attacker.repeat(LONG / 2, FLOOD, mutate),
        "unending" => attacker.repeat(LONG / 2, FLOOD, unending),
        "gapped" => attacker.repeat(LONG / 2, FLOOD, gapped),
        "overlapping" => attacker.repeat(LONG / 2, FLOOD, overlapping),
        "answers" => attacker.repeat(LONG / 2, FLOOD, answers),
        "forged-id" | "forged-id6" => {
            attacker.repeat(LONG / 2, 1000, |it, _| it.send(CLIENT, &pose()));
        }
        "forged-control" => attacker.repeat(LONG / 4, 20, |it, _| {
            it.send(
                CLIENT,
                &RequestControl {
                    authority_code: 200,
                },
            );
            it.send(CLIENT, &Resume {});
            it.send(CLIENT, &effort());
        }),
        "queries" => attacker.repeat(TIME, 256, |it, number| {
            it.send(invented(number % 256), &QueryServices::default());
        }),
        "events" => attacker.repeat(TIME, 256, create_event),
        "events6" => events6(&mut attacker),
        "many-ids6" => many_addresses(&mut attacker, ip6),
        "many-addresses" => many_addresses(&mut attacker, ip4),
        "to-nobody" => attacker.repeat(TIME, 400, to_nobody),
        "configuration" => configuration(&mut attacker),
        "many-ids" => attacker.repeat(LONG, 550, |it, number| it.send(cycling(number), &pose())),
        #[cfg(feature = "secure")]
        "handshakes" => {
            let mut first = super::secure::first_packet();
            attacker.repeat(LONG / 2, HANDSHAKES, move |it, number| {
                first[6..10].copy_from_slice(&number.to_le_bytes());
                it.send_octets(&first);
            });
        }
        "ra-flood" => attacker.repeat(LONG, 3000, ra_flood),
        "ra-forged" => attacker.repeat(LONG / 4, 20, ra_forged),
        other => panic!("no attack is called {other}"),
    }
    attacker.report();
}

fn pose() -> QueryLocalPose {
    QueryLocalPose::none().with_x().with_y()
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

/// First and middle fragments from 200 ids, never a last one; every second fragment is empty.
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

/// Every second middle fragment from 20 ids, in descending order.
fn gapped(attacker: &mut Attacker, number: u32) {
    let (id, position) = (number % 20, number / 20);
    let id = JausId::new(7001, 1, (id + 1) as u8);
    let sequence = u32::MAX - 2 * position;
    attacker.send_frame(&fragment(id, sequence, DataControl::Middle, 64));
}

/// All numbers, in an order that soon hits any range of them.
const fn scattered(number: u32) -> u32 {
    number.wrapping_mul(40_503)
}

/// Fragments with the client's id and any sequence number, which overlap the client's own.
fn overlapping(attacker: &mut Attacker, number: u32) {
    let data = [DataControl::Middle, DataControl::Last, DataControl::First][number as usize % 3];
    attacker.send_frame(&fragment(CLIENT, scattered(number / 3), data, 1000));
}

/// Acknowledgements and refusals with the client's id and any sequence number.
fn answers(attacker: &mut Attacker, number: u32) {
    let answer = [Acknowledgement::Negative, Acknowledgement::Positive][number as usize % 2];
    attacker.send_frame(&Frame {
        flags: Flags::default().with_acknowledgement(answer),
        sequence: scattered(number / 2) as u16,
        ..Frame::new(CLIENT, VEHICLE, Bytes::new())
    });
}

/// One of many unused ids.
const fn invented(number: u32) -> JausId {
    JausId::new(4000 + (number / 128) as u16, 1, (number % 128 + 1) as u8)
}

/// Subscribes with 256 ids, keeps the subscriptions alive, and answers nothing.
fn create_event(attacker: &mut Attacker, number: u32) {
    if number >= 256 {
        return attacker.send(invented(number % 256), &QueryHeartbeatPulse {});
    }
    let mut create = CreateEvent {
        request_id: number as u8,
        event_type: EventType(0),
        query_message: pose().encode().unwrap(),
        ..CreateEvent::default()
    };
    create.set_requested_periodic_rate_hz(100.0).unwrap();
    attacker.send(invented(number), &create);
}

/// An attacker with one address of an IPv4 network that belongs to it entirely.
fn ip4(number: u32) -> Attacker {
    let [.., high, low] = number.to_be_bytes();
    Attacker::from(([10, 217, 100 + high, low], judp::PORT).into())
}

/// An attacker with one address of an IPv6 network that belongs to it entirely.
fn ip6(number: u32) -> Attacker {
    let own = format!("fd00:217::{number:x}").parse().unwrap();
    let victim = TO_STRANGERS6.parse().unwrap();
    Attacker::between(
        SocketAddr::new(own, judp::PORT),
        SocketAddr::new(victim, judp::PORT),
    )
}

/// Like `create_event`, but each id has its own address.
fn events6(attacker: &mut Attacker) {
    let mut others: Vec<_> = (1..=256).map(ip6).collect();
    attacker.repeat(TIME, 256, |_, number| {
        create_event(&mut others[number as usize % 256], number);
    });
    for mut other in others {
        other.listen();
        attacker.add(&other);
    }
}

/// 1100 ids in turn, from 500 addresses in turn.
fn many_addresses(attacker: &mut Attacker, from: impl Fn(u32) -> Attacker) {
    let mut others: Vec<_> = (1..=500).map(from).collect();
    attacker.repeat(LONG, 550, |_, number| {
        others[number as usize % 500].send(cycling(number), &pose());
    });
    others.iter().for_each(|other| attacker.add(other));
}

/// 1100 ids in turn.
const fn cycling(number: u32) -> JausId {
    let number = number % 1100;
    JausId::new(2000 + (number / 250) as u16, 1, (number % 250 + 1) as u8)
}

/// Messages to unused ids, and broadcasts, also from unused ids.
fn to_nobody(attacker: &mut Attacker, number: u32) {
    let nobody = JausId::new(200, 1, (number % 200 + 1) as u8);
    let (destination, flags) = match number % 4 {
        0 => (
            JausId::EVERYONE,
            Flags::default().with_broadcast(Broadcast::Global),
        ),
        1 => (
            nobody,
            Flags::default().with_acknowledgement(Acknowledgement::Request),
        ),
        _ => (nobody, Flags::default()),
    };
    let query = QueryHeartbeatPulse {}.encode().unwrap();
    attacker.send_frame(&Frame {
        flags,
        sequence: number as u16,
        ..Frame::new(invented(number % 100), destination, query)
    });
}

/// Reports five nodes of 205 components each, for two subsystems.
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

/// Reports as many services as a message can hold, from four subsystems.
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
        // The vehicle may refuse it.
        let sent = port.deliver(message);
        let _ = tokio::time::timeout(Duration::from_secs(8), sent).await;
        node.shutdown().await;
    }
    println!("\nattack messages=4");
}

/// Last octet of the attacker's address on the controller's cable.
pub(crate) const BESIDE: u8 = 9;

/// An attacker on the cable of the controller's host, beside the programs there.
fn on_cable() -> Attacker {
    let address = |host| SocketAddr::from(([10, 216, 1, host], judp::PORT));
    Attacker::between(address(BESIDE), address(1))
}

/// Messages of many codes from any source id to all nodes, also with the vehicle's own subsystem
/// id.
fn ra_flood(attacker: &mut Attacker, number: u32) {
    let number = scattered(number) as u16;
    let [one, two] = number.to_le_bytes();
    let source = RaId::new(one.clamp(1, 254), 1, two.clamp(1, 254), 1);
    let all = RaId::new(255, 255, 1, 1);
    let code = [0x4202, 0x2002, 0x4B00, 0x4402, number][usize::from(number % 5)];
    let data = vec![one; usize::from(two % 64)];
    attacker.send_octets(&rover::datagram(source, all, code, &data));
}

/// Sends Standby, Release Control and efforts in the name of the operator 20.1.32.1, to take the
/// vehicle away from it.
fn ra_forged(attacker: &mut Attacker, number: u32) {
    const STANDBY: u16 = 0x0003;
    const RELEASE: u16 = 0x000E;
    const EFFORT: u16 = 0x0405;
    let code = [STANDBY, RELEASE, EFFORT][number as usize % 3];
    let data: &[u8] = if code == EFFORT { &[1, 0, 0, 0] } else { &[] };
    let (operator, driver) = (RaId::new(20, 1, 32, 1), RaId::new(101, 1, 33, 7));
    attacker.send_octets(&rover::datagram(operator, driver, code, data));
}
