//! Which ids RA components get on the JAUS side, and when they lose them.

use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::messages::mobility::{QueryVelocityState, ReportVelocityState};
use jaus::rights::Acceptance;
use jaus::service::{Kind, Service, Stack};
use jaus_ra::gateway::{Counter, Settings, Show};
use jaus_ra::{Message, RaId};
use jaus_vehicle::mobility::Vehicle;
use jaus_vehicle::motion::{Frame, Pilot, SkidSteer, SkidSteerConfig};

use crate::gateway::world::{World, stack, subsystem};

const VEHICLE: JausId = JausId::new(101, 1, 1);
/// The operator's station on the JAUS side, and the RA component that would have its id.
const STATION: JausId = JausId::new(60, 1, 33);
const GUEST: RaId = RaId::new(60, 1, 33, 1);

fn vehicle() -> Stack {
    let rover = SkidSteer::new(SkidSteerConfig::default());
    let vehicle = Vehicle::new(Pilot::new(rover, Frame::at(52.5, 13.4)));
    let services: Vec<Box<dyn Service>> = vec![Box::new(vehicle.velocity_state_sensor())];
    stack(VEHICLE, Kind::Vehicle, "Rover", services)
}

/// A gateway with these grants, which shows a JAUS vehicle.
fn world(grants: Acceptance) -> World {
    let mut world = World::closed(Settings {
        grants,
        show: Show::Only([VEHICLE.subsystem()].into()),
        ..Settings::default()
    });
    world.add_jaus(vehicle());
    world.run(Duration::from_secs(10));
    world
}

/// An RA system whose component would have the station's id.
fn guest(world: &mut World) -> usize {
    let ra = world.add_ra(subsystem(60, "Guest", &[(33, 1, "Driver")]), None);
    world.run(Duration::from_secs(10));
    ra
}

fn granting(grants: &[&str]) -> Acceptance {
    Acceptance::new(grants.iter().map(|it| it.parse().unwrap()))
}

/// The RA component asks the vehicle for its velocity, and the gateway for the state, for a while.
fn squat(world: &mut World, ra: usize, seconds: u32) {
    for _ in 0..3 * seconds {
        for (to, code) in [
            (RaId::new(101, 1, 42, 1), 0x2404),
            (RaId::new(250, 1, 32, 1), 0x2B00),
        ] {
            let data = Bytes::from_static(b"\xFF\x00");
            world.ra_says(ra, &Message::new(GUEST, to, code, data));
        }
        world.run(Duration::from_millis(333));
    }
}

fn has_id(world: &World) -> bool {
    world.attached().contains(&STATION.to_string())
}

fn station(world: &mut World) -> usize {
    world.add_jaus(stack(
        STATION,
        Kind::OperatorControlUnit,
        "Station",
        Vec::new(),
    ))
}

fn is_answered(world: &mut World, station: usize) -> bool {
    let query = QueryVelocityState {
        presence_vector: u16::MAX,
    };
    world
        .ask::<ReportVelocityState>(station, VEHICLE, &query)
        .is_some()
}

#[test]
fn an_ra_client_that_may_only_look_loses_its_id_at_once_to_the_operator_who_has_it() {
    let mut world = world(Settings::default().grants);
    let ra = guest(&mut world);
    squat(&mut world, ra, 2);
    assert!(has_id(&world), "nobody else uses it");
    assert!(!world.ra_heard(ra, 0x4404).is_empty());
    let station = station(&mut world);
    // Its first call.
    world.run(Duration::from_secs(1));
    assert!(!has_id(&world));
    world.ra_heard(ra, 0x4404);
    for _ in 0..30 {
        squat(&mut world, ra, 10);
        assert!(!has_id(&world));
        assert!(is_answered(&mut world, station));
        assert!(world.ra_heard(ra, 0x4404).is_empty());
    }
    assert!(world.count(Counter::Collision) > 0);
}

#[test]
fn an_ra_client_that_comes_later_does_not_get_the_id_of_an_operator() {
    let mut world = world(Settings::default().grants);
    let station = station(&mut world);
    world.run(Duration::from_secs(10));
    let ra = guest(&mut world);
    squat(&mut world, ra, 2);
    assert!(!has_id(&world));
    assert!(is_answered(&mut world, station));
}

#[test]
fn an_ra_component_in_no_grant_gets_no_id() {
    let mut world = world(granting(&["20 control=127"]));
    let ra = guest(&mut world);
    squat(&mut world, ra, 2);
    assert_eq!(world.attached(), ["250.1.1"]);
    assert!(world.count(Counter::NotGranted) > 0);
}

#[test]
fn an_ra_client_with_rights_keeps_its_id() {
    let mut world = world(granting(&["60 control=127"]));
    let ra = guest(&mut world);
    squat(&mut world, ra, 2);
    station(&mut world);
    squat(&mut world, ra, 2);
    assert!(has_id(&world));
}
