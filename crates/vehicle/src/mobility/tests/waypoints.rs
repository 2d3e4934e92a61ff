//! Driving to one waypoint, local and global, with both message versions.

use super::*;
use jaus::messages::mobility::set_travel_speed_ext::{
    Speed, SpeedRotationsPerMinute, SpeedSpeedOverGround,
};
use jaus::messages::mobility::{
    QueryGlobalWaypoint, QueryLocalWaypoint, QueryLocalWaypointExt, QueryTravelSpeed,
    QueryTravelSpeedExt, ReportGlobalWaypoint, ReportLocalWaypoint, ReportLocalWaypointExt,
    ReportTravelSpeed, ReportTravelSpeedExt, SetGlobalPose, SetGlobalWaypoint, SetLocalPose,
    SetLocalWaypointExt, SetTravelSpeed, SetTravelSpeedExt, SetWrenchEffort,
};

const QUERY: QueryLocalWaypoint = QueryLocalWaypoint::all();

fn speed(metres_per_second: f64) -> SetTravelSpeed {
    let mut speed = SetTravelSpeed::default();
    speed.set_speed_m_per_s(metres_per_second).unwrap();
    speed
}

fn travel_speed(rig: &mut Rig) -> f64 {
    let report: ReportTravelSpeed = rig.ask(&QueryTravelSpeed).unwrap();
    report.speed_m_per_s()
}

#[test]
fn before_anything_is_set_the_speed_is_0_and_there_is_no_waypoint() {
    let (mut rig, _) = rig();
    assert!(travel_speed(&mut rig).abs() < 0.01);
    rig.send(STRANGER, &QUERY);
    assert!(rig.answer_code().is_none());
}

#[test]
fn a_waypoint_is_reported_as_it_was_set_with_the_wanted_fields_it_has() {
    let (mut rig, _) = rig();
    rig.stand(State::Standby, Some(CLIENT));
    let mut waypoint = local_waypoint(1.0, 1.0);
    waypoint.set_yaw_rad(0.5).unwrap();
    waypoint.set_waypoint_tolerance_m(0.25).unwrap();
    rig.send(CLIENT, &waypoint);
    let report: ReportLocalWaypoint = rig.ask(&QueryLocalWaypoint::none()).unwrap();
    assert!(report.x == waypoint.x && report.y == waypoint.y && report.yaw.is_none());
    let report: ReportLocalWaypoint = rig.ask(&QUERY).unwrap();
    assert!(report.yaw == waypoint.yaw && report.z.is_none());
    assert_eq!(report.waypoint_tolerance, waypoint.waypoint_tolerance);
    let query = QueryLocalWaypointExt::all();
    let report: ReportLocalWaypointExt = rig.ask(&query).unwrap();
    assert!((report.x_m() - 1.0).abs() < 0.01 && report.heading.is_some());
    assert!(rig.changed().contains(&QueryLocalWaypoint::CODE));
}

#[test]
fn strangers_set_neither_waypoint_nor_speed() {
    let (mut rig, _) = rig();
    rig.send(STRANGER, &local_waypoint(1.0, 1.0));
    rig.send(STRANGER, &QUERY);
    assert!(rig.answer_code().is_none());
    rig.send(CLIENT, &local_waypoint(1.0, 1.0));
    rig.send(STRANGER, &speed(1.0));
    assert!(travel_speed(&mut rig).abs() < 0.01);
}

#[test]
fn a_speed_counts_only_when_ready_and_with_a_waypoint() {
    let (mut rig, vehicle) = rig();
    rig.send(CLIENT, &speed(1.0));
    assert!(
        travel_speed(&mut rig).abs() < 0.01,
        "there is no waypoint yet"
    );
    rig.send(CLIENT, &local_waypoint(5.0, 5.0));
    rig.stand(State::Standby, Some(CLIENT));
    rig.send(CLIENT, &speed(1.0));
    rig.run(seconds(5.0));
    assert!(
        (travel_speed(&mut rig) - 1.0).abs() < 0.01,
        "it is kept in standby"
    );
    rig.stand(State::Ready, Some(CLIENT));
    rig.run(seconds(5.0));
    assert!(
        travel_speed(&mut rig).abs() < 0.01,
        "and does not come into force afterwards"
    );
    assert!(vehicle.motion().pose.distance(0.0, 0.0) < 1e-9);
}

#[test]
fn the_vehicle_drives_to_the_waypoint_at_the_travel_speed_and_stops_there() {
    let (mut rig, vehicle) = rig();
    rig.send(CLIENT, &local_waypoint(10.0, -5.0));
    rig.send(CLIENT, &speed(1.0));
    assert!((travel_speed(&mut rig) - 1.0).abs() < 0.01);
    rig.run(seconds(5.0));
    assert!((vehicle.motion().velocity.x - 1.0).abs() < 0.05);
    rig.run(seconds(20.0));
    let motion = vehicle.motion();
    assert!(motion.pose.distance(10.0, -5.0) <= 0.5 && motion.velocity.is_rest());
    assert!(rig.poll_timeout().is_none());
}

#[test]
fn a_new_waypoint_is_driven_to_at_once_when_there_is_a_speed_and_0_stops() {
    let (mut rig, vehicle) = rig();
    rig.send(CLIENT, &local_waypoint(10.0, 0.0));
    rig.send(CLIENT, &speed(2.0));
    rig.run(seconds(3.0));
    rig.send(CLIENT, &local_waypoint(0.0, 5.0));
    rig.run(seconds(20.0));
    assert!(vehicle.motion().pose.distance(0.0, 5.0) <= 0.5);
    rig.send(CLIENT, &local_waypoint(50.0, 5.0));
    rig.run(seconds(5.0));
    rig.send(CLIENT, &speed(0.0));
    rig.run(seconds(2.0));
    let motion = vehicle.motion();
    assert!(motion.velocity.is_rest() && motion.pose.x > 1.0);
    rig.send(CLIENT, &speed(1.0));
    rig.run(seconds(2.0));
    assert!(!vehicle.motion().velocity.is_rest(), "it goes on");
}

#[test]
fn after_standby_the_vehicle_waits_for_a_new_speed() {
    let (mut rig, vehicle) = rig();
    rig.send(CLIENT, &local_waypoint(50.0, 0.0));
    rig.send(CLIENT, &speed(2.0));
    rig.run(seconds(3.0));
    rig.stand(State::Standby, Some(CLIENT));
    assert!(travel_speed(&mut rig).abs() < 0.01);
    rig.run(seconds(2.0));
    rig.stand(State::Ready, Some(CLIENT));
    rig.run(seconds(3.0));
    assert!(vehicle.motion().velocity.is_rest());
    rig.send(CLIENT, &speed(2.0));
    rig.run(seconds(40.0));
    assert!(vehicle.motion().pose.distance(50.0, 0.0) <= 0.5);
}

#[test]
fn a_reset_forgets_the_waypoint() {
    let (mut rig, _) = rig();
    rig.send(CLIENT, &local_waypoint(1.0, 1.0));
    rig.stand(State::Initialize, None);
    rig.send(STRANGER, &QUERY);
    assert!(rig.answer_code().is_none());
}

#[test]
fn another_driver_takes_over_from_the_waypoint_driver() {
    let (mut rig, vehicle) = rig();
    rig.send(CLIENT, &local_waypoint(50.0, 0.0));
    rig.send(CLIENT, &speed(2.0));
    rig.run(seconds(3.0));
    let mut brakes = SetWrenchEffort::default();
    brakes.set_resistive_linear_effort_x_percent(100.0).unwrap();
    rig.send(CLIENT, &brakes);
    rig.run(seconds(3.0));
    assert!(vehicle.motion().velocity.is_rest());
    assert!(travel_speed(&mut rig).abs() < 0.01);
}

#[test]
fn messages_of_version_1_1_drive_as_well() {
    let (mut rig, vehicle) = rig();
    let mut waypoint = SetLocalWaypointExt::default();
    waypoint.set_x_m(4.0).unwrap();
    waypoint.set_y_m(3.0).unwrap();
    waypoint.set_heading_rad(1.0).unwrap();
    rig.send(CLIENT, &waypoint);
    let rotations = SpeedRotationsPerMinute::new(100.0).unwrap();
    let speed = Speed::RotationsPerMinute(rotations);
    rig.send(CLIENT, &SetTravelSpeedExt { speed });
    assert!(
        travel_speed(&mut rig).abs() < 0.01,
        "rotations are no speed"
    );
    let speed = Speed::SpeedOverGround(SpeedSpeedOverGround::new(1.5).unwrap());
    rig.send(CLIENT, &SetTravelSpeedExt { speed });
    let report: ReportTravelSpeedExt = rig.ask(&QueryTravelSpeedExt).unwrap();
    assert_eq!(report.speed, speed);
    rig.run(seconds(20.0));
    let pose = vehicle.motion().pose;
    assert!(pose.distance(4.0, 3.0) <= 0.5 && (pose.yaw - 1.0).abs() < 0.1);
}

#[test]
fn a_global_waypoint_is_driven_to_and_the_local_one_is_gone() {
    let (mut rig, vehicle) = rig();
    rig.send(CLIENT, &local_waypoint(1.0, 1.0));
    let mut waypoint = SetGlobalWaypoint::default();
    waypoint.set_latitude_deg(FRAME.0 + 0.0001).unwrap();
    waypoint.set_longitude_deg(FRAME.1).unwrap();
    rig.send(CLIENT, &waypoint);
    let report: ReportGlobalWaypoint = rig.ask(&QueryGlobalWaypoint::all()).unwrap();
    assert_eq!(report.latitude, waypoint.latitude);
    rig.send(STRANGER, &QUERY);
    assert!(rig.answer_code().is_none());
    rig.send(CLIENT, &speed(2.0));
    rig.run(seconds(20.0));
    let pose = vehicle.global_pose();
    assert!((pose.latitude - FRAME.0 - 0.0001).abs() < 5e-6, "{pose:?}");
}

#[test]
fn a_global_waypoint_stays_where_it_is_when_the_local_frame_moves() {
    let (mut rig, vehicle) = rig();
    let mut waypoint = SetGlobalWaypoint::default();
    waypoint.set_latitude_deg(FRAME.0 + 0.0002).unwrap();
    waypoint.set_longitude_deg(FRAME.1).unwrap();
    rig.send(CLIENT, &waypoint);
    rig.send(CLIENT, &speed(2.0));
    rig.run(seconds(5.0));
    let mut pose = SetLocalPose::default();
    pose.set_x_m(-500.0).unwrap();
    pose.set_yaw_rad(2.0).unwrap();
    rig.send(CLIENT, &pose);
    rig.run(seconds(20.0));
    let pose = vehicle.global_pose();
    assert!((pose.latitude - FRAME.0 - 0.0002).abs() < 5e-6, "{pose:?}");
    assert!(vehicle.motion().velocity.is_rest());
}

#[test]
fn a_local_waypoint_is_given_up_when_the_pose_is_set_elsewhere_on_the_way() {
    let (mut rig, vehicle) = rig();
    rig.send(CLIENT, &local_waypoint(30.0, 0.0));
    rig.send(CLIENT, &speed(2.0));
    rig.run(seconds(5.0));
    let mut pose = SetLocalPose::default();
    pose.set_y_m(4.0).unwrap();
    rig.send(CLIENT, &pose);
    rig.run(seconds(3.0));
    assert!(vehicle.motion().velocity.is_rest() && !vehicle.has_arrived());
}

#[test]
fn a_global_waypoint_is_given_up_when_the_pose_on_the_globe_is_set_elsewhere_on_the_way() {
    for (degrees, goes_on) in [(0.000_001, true), (0.000_05, false)] {
        let (mut rig, vehicle) = rig();
        let mut waypoint = SetGlobalWaypoint::default();
        waypoint.set_latitude_deg(FRAME.0 + 0.001).unwrap();
        waypoint.set_longitude_deg(FRAME.1).unwrap();
        rig.send(CLIENT, &waypoint);
        rig.send(CLIENT, &speed(2.0));
        rig.run(seconds(5.0));
        let here = vehicle.global_pose();
        let mut pose = SetGlobalPose::default();
        pose.set_latitude_deg(here.latitude).unwrap();
        pose.set_longitude_deg(here.longitude + degrees).unwrap();
        rig.send(CLIENT, &pose);
        rig.run(seconds(3.0));
        assert_eq!(!vehicle.motion().velocity.is_rest(), goes_on, "{degrees}");
        assert!(!vehicle.has_arrived());
    }
}

#[test]
fn a_new_pose_at_a_local_waypoint_does_not_set_the_vehicle_in_motion() {
    let (mut rig, vehicle) = rig();
    rig.send(CLIENT, &local_waypoint(3.0, 0.0));
    rig.send(CLIENT, &speed(2.0));
    rig.run(seconds(20.0));
    let mut pose = SetLocalPose::default();
    pose.set_x_m(0.0).unwrap();
    rig.send(CLIENT, &pose);
    rig.run(seconds(5.0));
    assert!(vehicle.motion().pose.x.abs() < 0.01);
}

#[test]
fn a_waypoint_on_another_continent_is_ignored() {
    let (mut rig, _) = rig();
    let mut far = SetGlobalWaypoint::default();
    far.set_latitude_deg(-33.9).unwrap();
    far.set_longitude_deg(18.4).unwrap();
    rig.send(CLIENT, &far);
    rig.send(STRANGER, &QueryGlobalWaypoint::all());
    assert!(rig.answer_code().is_none());
}
