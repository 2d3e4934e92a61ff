//! Lists of places: a JAUS client's at an RA waypoint driver, and an RA client's at a JAUS driver.

use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::{FormattedBlob, Message as _};
use jaus::messages::core::set_element::{ElementDataFormat, ElementRec};
use jaus::messages::core::{
    QueryElementCount, QueryStatus, ReportElementCount, ReportStatus, Resume, SetElement,
    SetEmergency, list_manager, set_emergency,
};
use jaus::messages::mobility::{
    ExecuteList, QueryActiveElement, QueryTravelSpeed, ReportActiveElement, ReportTravelSpeed,
    SetGlobalWaypoint, global_waypoint_list_driver,
};
use jaus::service::{Event, Kind, Management, Patience, Service};
use jaus_ra::gateway::{Counter, Settings};
use jaus_ra::{Message, RaId};
use jaus_vehicle::mobility::Vehicle;
use jaus_vehicle::motion::{Frame, Pilot, SkidSteer, SkidSteerConfig};

use crate::gateway::world::{World, stack, subsystem};
use jaus_test_kit::rover::{Rover, SUBSYSTEM, bytes};

const JAUS_WAYPOINTS: JausId = JausId::new(20, 1, 45);
const VEHICLE: JausId = JausId::new(101, 1, 7);
const RA_WAYPOINTS: RaId = RaId::new(101, 1, 45, 7);
/// The RA operator.
const COMMANDER: RaId = RaId::new(30, 1, 32, 1);

/// Element `uid` of a list with `count` elements.
fn element(uid: u16, count: u16, latitude: f64) -> ElementRec {
    let mut waypoint = SetGlobalWaypoint::default();
    waypoint.set_latitude_deg(latitude).unwrap();
    waypoint.set_longitude_deg(13.4).unwrap();
    ElementRec {
        element_uid: uid,
        previous_uid: uid - 1,
        next_uid: if uid == count { 0 } else { uid + 1 },
        element_data: FormattedBlob::new(
            ElementDataFormat::JAUS_MESSAGE,
            waypoint.encode().unwrap(),
        ),
    }
}

fn execute(element_uid: Option<u16>, speed: f64) -> ExecuteList {
    let mut execute = ExecuteList {
        element_uid,
        ..ExecuteList::default()
    };
    execute.set_speed_m_per_s(speed).unwrap();
    execute
}

/// Codes of the unsolicited messages that a component has received.
fn told(world: &World, who: usize) -> Vec<u16> {
    let events = world.jaus[who].events.iter();
    let codes = events.filter_map(|event| match event {
        Event::Message(message) => message.payload.first_chunk().copied(),
        _ => None,
    });
    codes.map(u16::from_le_bytes).collect()
}

/// An operator and an RA waypoint driver that have discovered each other.
fn driver_of_ra() -> (World, usize, usize) {
    let mut world = World::new(Settings::default());
    let parts = [(45, 1, "Waypoints")];
    let ra = world.add_ra(subsystem(SUBSYSTEM, "Sim", &parts), Some(Rover::new()));
    let operator = world.add_operator();
    world.run(Duration::from_secs(10));
    (world, ra, operator)
}

fn take_control(world: &mut World, operator: usize) {
    let (now, patience) = (world.now, Patience::default());
    let stack = &mut world.jaus[operator].stack;
    stack
        .request_control(now, JAUS_WAYPOINTS, 127, patience)
        .unwrap();
    world.run(Duration::from_secs(2));
    world.tell(operator, JAUS_WAYPOINTS, &Resume {});
    world.run(Duration::from_millis(500));
    for peer in &mut world.ra {
        peer.rover.iter_mut().for_each(|it| it.speeds.clear());
    }
}

/// Three waypoints in a line to the north.
fn three_waypoints() -> SetElement {
    SetElement {
        element_list: (1..=3)
            .map(|uid| element(uid, 3, 52.5 + f64::from(uid) / 1000.0))
            .collect(),
        ..SetElement::default()
    }
}

#[test]
fn an_ra_waypoint_driver_gets_the_list_of_a_jaus_client_in_order_and_its_speed() {
    let (mut world, ra, operator) = driver_of_ra();
    let directory = world.jaus[operator].stack.directory();
    let driver = directory.component(JAUS_WAYPOINTS).unwrap();
    assert!(
        driver.offers(global_waypoint_list_driver::URN),
        "{driver:?}"
    );
    assert!(driver.offers(list_manager::URN), "{driver:?}");

    world.tell(operator, JAUS_WAYPOINTS, &three_waypoints());
    assert_eq!(world.count(Counter::NotInControl), 1);
    take_control(&mut world, operator);
    world.tell(operator, JAUS_WAYPOINTS, &three_waypoints());
    world.tell(operator, JAUS_WAYPOINTS, &execute(Some(0), 2.0));
    world.run(Duration::from_secs(2));
    assert_eq!(told(&world, operator), [0x041C], "the list is confirmed");
    let rover = world.ra[ra].rover.as_ref().unwrap();
    let numbers: Vec<u8> = rover.waypoints.iter().map(|data| data[1]).collect();
    assert_eq!((numbers, rover.speeds.len()), (vec![0, 1, 2], 1));

    let query = QueryElementCount {};
    let count: ReportElementCount = world.ask(operator, JAUS_WAYPOINTS, &query).unwrap();
    assert_eq!(count.element_count, 3);
    let query = QueryActiveElement {};
    let active: ReportActiveElement = world.ask(operator, JAUS_WAYPOINTS, &query).unwrap();
    assert_eq!(active.element_uid, 1);
    // OpenJAUS's driver does not report its speed, so the last one set is assumed.
    world.tell(operator, JAUS_WAYPOINTS, &execute(None, 3.0));
    let query = QueryTravelSpeed {};
    let speed: ReportTravelSpeed = world.ask(operator, JAUS_WAYPOINTS, &query).unwrap();
    assert!((speed.speed_m_per_s() - 3.0).abs() < 0.2, "{speed:?}");
    let rover = world.ra[ra].rover.as_ref().unwrap();
    assert_eq!((rover.waypoints.len(), rover.speeds.len()), (3, 2));

    // The client is gone and cannot stop the driver.
    world.jaus[operator].up = false;
    world.run(Duration::from_secs(20));
    let rover = world.ra[ra].rover.as_ref().unwrap();
    assert_eq!(rover.speeds.last(), Some(&bytes("0000")));
    assert_eq!(rover.controller, None);
}

#[test]
fn in_an_emergency_a_list_is_stopped_and_none_is_executed_until_that_is_over() {
    let (mut world, ra, operator) = driver_of_ra();
    take_control(&mut world, operator);
    world.tell(operator, JAUS_WAYPOINTS, &three_waypoints());
    let speeds = |world: &mut World| {
        world.run(Duration::from_secs(2));
        world.ra[ra].rover.as_ref().unwrap().speeds.clone()
    };
    world.tell(operator, JAUS_WAYPOINTS, &execute(Some(0), 2.0));
    assert_eq!(speeds(&mut world).len(), 1);
    let emergency_code = set_emergency::EmergencyCode(1);
    world.tell(operator, JAUS_WAYPOINTS, &SetEmergency { emergency_code });
    let stopped = speeds(&mut world);
    assert_eq!(stopped.last(), Some(&bytes("0000")));
    for uid in [Some(0), None] {
        world.tell(operator, JAUS_WAYPOINTS, &execute(uid, 2.0));
        assert_eq!(speeds(&mut world), stopped, "{uid:?}");
    }
    assert_eq!(world.count(Counter::InEmergency), 2);
    world.ra[ra].rover.as_mut().unwrap().state = 1;
    // The first command detects that the emergency is cleared.
    world.tell(operator, JAUS_WAYPOINTS, &execute(Some(0), 2.0));
    speeds(&mut world);
    world.tell(operator, JAUS_WAYPOINTS, &Resume {});
    world.tell(operator, JAUS_WAYPOINTS, &execute(Some(0), 2.0));
    assert_ne!(speeds(&mut world).last(), Some(&bytes("0000")));
}

#[test]
fn an_emergency_that_somebody_else_has_set_ends_a_list_before_its_speed_is_told() {
    let (mut world, ra, operator) = driver_of_ra();
    take_control(&mut world, operator);
    // It does not answer waypoint queries, so the hand-over is slow.
    world.ra[ra].rover.as_mut().unwrap().mute = true;
    world.tell(operator, JAUS_WAYPOINTS, &three_waypoints());
    world.tell(operator, JAUS_WAYPOINTS, &execute(Some(0), 2.0));
    let speeds = |world: &World| world.ra[ra].rover.as_ref().unwrap().speeds.len();
    assert_eq!(speeds(&world), 0, "still being handed over");
    world.ra[ra].rover.as_mut().unwrap().state = 5;
    let status: ReportStatus = world
        .ask(operator, JAUS_WAYPOINTS, &QueryStatus {})
        .unwrap();
    assert_eq!(status.status.0, 5);
    world.run(Duration::from_secs(10));
    assert_eq!(speeds(&world), 0);
}

fn says(code: u16, hex: &str) -> Message {
    Message::new(COMMANDER, RA_WAYPOINTS, code, bytes(hex))
}

/// Set Global Waypoint.
fn waypoint(number: u8, latitude: f64) -> Message {
    let scaled = |degrees: f64, limit: f64| (degrees / limit * f64::from(i32::MAX)) as i32;
    let mut data = vec![0, number, 0];
    data.extend(scaled(latitude, 90.0).to_le_bytes());
    data.extend(scaled(13.4, 180.0).to_le_bytes());
    Message::new(COMMANDER, RA_WAYPOINTS, 0x040C, Bytes::from(data))
}

#[test]
fn an_ra_client_drives_a_jaus_vehicle_along_its_waypoints_and_changes_the_speed_on_the_way() {
    let mut world = World::new(Settings::default());
    let ra = world.add_ra(subsystem(30, "OCU", &[(32, 1, "Commander")]), None);
    let rover = SkidSteer::new(SkidSteerConfig::default());
    let vehicle = Vehicle::new(Pilot::new(rover, Frame::at(52.5, 13.4)));
    let services: Vec<Box<dyn Service>> = vec![
        Box::new(vehicle.global_waypoint_list_driver()),
        Box::new(vehicle.list_manager()),
    ];
    let vehicle = stack(VEHICLE, Kind::Vehicle, "Rover", services);
    world.add_jaus(vehicle.management(Management::new()));
    let operator = world.add_operator();
    world.run(Duration::from_secs(10));

    world.ra_says(ra, &says(0x000D, "7f"));
    world.run(Duration::from_secs(1));
    world.ra_says(ra, &says(0x0004, ""));
    // About 11 m apart.
    for number in 0..3 {
        world.ra_says(ra, &waypoint(number, 52.5 + f64::from(number + 1) * 0.0001));
    }
    world.run(Duration::from_secs(1));
    world.ra_says(ra, &says(0x240B, ""));
    world.ra_says(ra, &says(0x240C, "0200"));
    world.run(Duration::from_secs(1));
    let heard = std::mem::take(&mut world.ra[ra].heard);
    let count = heard.iter().find(|it| it.code == 0x440B).unwrap();
    assert_eq!(count.data, bytes("0300"));
    let third = heard.iter().find(|it| it.code == 0x440C).unwrap();
    assert_eq!(third.data[1..3], [2, 0]);
    assert_eq!(third.data[3..11], waypoint(2, 52.5003).data[3..11]);

    let active = |world: &mut World| {
        let query = QueryActiveElement {};
        let report: ReportActiveElement = world.ask(operator, VEHICLE, &query).unwrap();
        report.element_uid
    };
    // 2 m/s, until the vehicle is on its way to the second waypoint.
    world.ra_says(ra, &says(0x040A, "0d00"));
    assert_eq!(active(&mut world), 1);
    for _ in 0..30 {
        if active(&mut world) == 2 {
            break;
        }
    }
    world.ra_says(ra, &says(0x040A, "0700"));
    assert_eq!(active(&mut world), 2, "it does not begin again");
    for _ in 0..60 {
        if active(&mut world) == 0 {
            break;
        }
    }
    world.ra_says(ra, &says(0x040A, "0d00"));
    assert_eq!(
        active(&mut world),
        0,
        "it was driven, and is not driven again"
    );
    assert_eq!(world.count(Counter::NotListed), 0);
}
