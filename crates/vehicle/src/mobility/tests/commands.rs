//! Completion of commands, as reported by command events.

use super::*;
use jaus::address::JausId;
use jaus::messages::mobility::{ExecuteList, SetGlobalWaypoint, SetTravelSpeed};
use jaus::service::{Discovery, Kind, Profile, Scope, Stack, Timing, UnsafeService};

const WAYPOINT: u16 = SetLocalWaypoint::CODE;
const LIST: u16 = ExecuteList::CODE;

/// The vehicle drives to a waypoint ten metres ahead.
fn on_the_way() -> Rig {
    let (mut rig, _) = rig();
    rig.send(CLIENT, &local_waypoint(10.0, 0.0));
    let mut speed = SetTravelSpeed::default();
    speed.set_speed_m_per_s(2.0).unwrap();
    rig.send(CLIENT, &speed);
    rig.run(seconds(2.0));
    assert_eq!(rig.ended(), []);
    rig
}

#[test]
fn a_waypoint_has_ended_well_when_it_is_reached() {
    let mut rig = on_the_way();
    rig.run(seconds(20.0));
    assert_eq!(rig.ended(), [(WAYPOINT, true)], "told once");
}

#[test]
fn a_waypoint_has_failed_when_the_vehicle_is_stopped_on_its_way() {
    for (state, controller) in [
        (State::Standby, Some(CLIENT)),
        (State::Emergency, Some(CLIENT)),
        (State::Ready, None),
    ] {
        let mut rig = on_the_way();
        rig.stand(state, controller);
        assert_eq!(rig.ended(), [(WAYPOINT, false)], "{state}");
    }
}

#[test]
fn a_waypoint_has_failed_when_another_command_drives_elsewhere() {
    let mut rig = on_the_way();
    let mut elsewhere = SetGlobalWaypoint::default();
    elsewhere.set_latitude_deg(52.5).unwrap();
    elsewhere.set_longitude_deg(13.4).unwrap();
    rig.send(CLIENT, &elsewhere);
    assert_eq!(rig.ended(), [(WAYPOINT, false)]);
}

#[test]
fn a_list_has_ended_well_when_its_last_element_is_reached() {
    let (mut rig, _) = rig();
    let list = [
        element(1, 0, 2, &local_waypoint(3.0, 0.0)),
        element(2, 1, 0, &local_waypoint(3.0, 3.0)),
    ];
    assert!(set_elements(&mut rig, list.into()));
    rig.send(CLIENT, &execute(Some(1), 2.0));
    rig.run(seconds(1.0));
    assert_eq!(rig.ended(), []);
    rig.run(seconds(30.0));
    assert_eq!(rig.ended(), [(LIST, true)]);
}

#[test]
fn a_driver_of_a_vehicle_needs_management_and_its_sensors_do_not() {
    let vehicle = vehicle();
    let check = |service: Box<dyn Service>| {
        let id = JausId::new(101, 1, 1);
        let profile = Profile::new(Kind::Vehicle, "Rover");
        let discovery = Discovery::new(id, profile, Scope::Nobody, Timing::default(), 1);
        Stack::new(discovery, vec![service]).check()
    };
    for driver in [
        Box::new(vehicle.primitive_driver()) as Box<dyn Service>,
        Box::new(vehicle.local_path_segment_driver()),
    ] {
        assert!(matches!(
            check(driver),
            Err(UnsafeService::NoManagement { .. })
        ));
    }
    assert_eq!(check(Box::new(vehicle.velocity_state_sensor())), Ok(()));
}
