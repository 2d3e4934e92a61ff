//! Execution of waypoint lists.

use super::*;
use jaus::messages::core::delete_element::DeleteElementRec;
use jaus::messages::core::{DeleteElement, QueryHeartbeatPulse};
use jaus::messages::mobility::{
    QueryActiveElement, QueryLocalWaypoint, QueryTravelSpeed, ReportActiveElement,
    ReportLocalWaypoint, ReportTravelSpeed, SetGlobalWaypoint, SetLocalWaypointExt,
};

/// A square to drive around.
const SQUARE: [(f64, f64); 4] = [(8.0, 0.0), (8.0, 8.0), (0.0, 8.0), (0.0, 0.0)];

fn square() -> Vec<ElementRec> {
    let elements = SQUARE.iter().zip(1..);
    elements
        .map(|(&(x, y), uid)| element(uid, uid - 1, (uid + 1) % 5, &local_waypoint(x, y)))
        .collect()
}

fn active(rig: &mut Rig) -> u16 {
    let report: ReportActiveElement = rig.ask(&QueryActiveElement).unwrap();
    report.element_uid
}

/// Runs until the active element changes, and returns the time of the change.
fn run_to_next(rig: &mut Rig, vehicle: &Vehicle) -> (u16, crate::motion::Pose) {
    let before = active(rig);
    for _ in 0..2000 {
        rig.run(seconds(0.02));
        let now = active(rig);
        if now != before {
            return (now, vehicle.motion().pose);
        }
    }
    panic!("element {before} is not reached: {:?}", vehicle.motion());
}

#[test]
fn the_waypoints_of_a_list_are_reached_in_order_and_the_vehicle_stops_at_the_last() {
    let (mut rig, vehicle) = rig();
    assert!(set_elements(&mut rig, square()));
    assert_eq!(active(&mut rig), 0);
    rig.send(CLIENT, &execute(Some(1), 2.0));
    assert_eq!(active(&mut rig), 1);
    for (&(x, y), next) in SQUARE.iter().zip([2, 3, 4, 0]) {
        let report: ReportLocalWaypoint = rig
            .ask(&QueryLocalWaypoint::none().with_z().with_roll())
            .unwrap();
        assert!((report.x_m() - x).abs() < 0.01 && (report.y_m() - y).abs() < 0.01);
        let (reached, pose) = run_to_next(&mut rig, &vehicle);
        assert_eq!(reached, next);
        assert!(pose.distance(x, y) <= 0.55, "{pose:?} is not {x} {y}");
    }
    assert!(rig.changed().contains(&QueryActiveElement::CODE));
    rig.run(seconds(2.0));
    let motion = vehicle.motion();
    assert!(motion.velocity.is_rest() && motion.pose.distance(0.0, 0.0) <= 0.5);
}

#[test]
fn a_list_begins_where_the_client_says_and_0_is_its_first_element() {
    let (mut rig, _) = rig();
    assert!(set_elements(&mut rig, square()));
    rig.send(CLIENT, &execute(Some(3), 2.0));
    assert_eq!(active(&mut rig), 3);
    rig.send(CLIENT, &execute(Some(0), 2.0));
    assert_eq!(active(&mut rig), 1);
    rig.send(CLIENT, &execute(Some(9), 2.0));
    assert_eq!(active(&mut rig), 1, "there is no element 9");
}

#[test]
fn without_an_element_only_the_speed_of_a_list_that_runs_changes() {
    let (mut rig, vehicle) = rig();
    assert!(set_elements(&mut rig, square()));
    rig.send(CLIENT, &execute(None, 2.0));
    assert_eq!(active(&mut rig), 0);
    rig.send(CLIENT, &execute(Some(1), 0.5));
    rig.run(seconds(2.0));
    assert!((vehicle.motion().velocity.x - 0.5).abs() < 0.01);
    rig.send(CLIENT, &execute(None, 1.0));
    rig.run(seconds(2.0));
    assert!((vehicle.motion().velocity.x - 1.0).abs() < 0.01);
    let report: ReportTravelSpeed = rig.ask(&QueryTravelSpeed).unwrap();
    assert!((report.speed_m_per_s() - 1.0).abs() < 0.01);
}

#[test]
fn a_list_is_executed_only_for_the_client_in_control_and_only_when_ready() {
    let (mut rig, vehicle) = rig();
    assert!(set_elements(&mut rig, square()));
    rig.send(STRANGER, &execute(Some(1), 2.0));
    assert_eq!(active(&mut rig), 0);
    rig.stand(State::Standby, Some(CLIENT));
    rig.send(CLIENT, &execute(Some(1), 2.0));
    rig.run(seconds(5.0));
    assert_eq!(active(&mut rig), 1, "it is kept and reported in standby");
    rig.stand(State::Ready, Some(CLIENT));
    rig.run(seconds(5.0));
    assert_eq!(
        active(&mut rig),
        0,
        "and does not come into force afterwards"
    );
    assert!(vehicle.motion().pose.distance(0.0, 0.0) < 1e-9);
}

#[test]
fn a_list_can_be_filled_in_standby_and_its_first_waypoint_is_told() {
    let (mut rig, _) = rig();
    rig.stand(State::Standby, Some(CLIENT));
    assert!(set_elements(&mut rig, square()));
    let report: ReportLocalWaypoint = rig.ask(&QueryLocalWaypoint::none()).unwrap();
    assert!((report.x_m() - 8.0).abs() < 0.01);
}

#[test]
fn standby_ends_the_list_and_the_vehicle_does_not_go_on_by_itself() {
    let (mut rig, vehicle) = rig();
    assert!(set_elements(&mut rig, square()));
    rig.send(CLIENT, &execute(Some(1), 2.0));
    rig.run(seconds(2.0));
    rig.stand(State::Emergency, Some(CLIENT));
    rig.stand(State::Ready, Some(CLIENT));
    rig.run(seconds(5.0));
    assert!(vehicle.motion().velocity.is_rest());
    assert_eq!(active(&mut rig), 0);
}

#[test]
fn elements_that_are_appended_while_the_vehicle_drives_are_driven_to() {
    let (mut rig, vehicle) = rig();
    assert!(set_elements(
        &mut rig,
        vec![element(1, 0, 0, &local_waypoint(5.0, 0.0))]
    ));
    rig.send(CLIENT, &execute(Some(1), 2.0));
    rig.run(seconds(1.0));
    assert!(set_elements(
        &mut rig,
        vec![element(2, 1, 0, &local_waypoint(10.0, 0.0))]
    ));
    rig.run(seconds(20.0));
    assert!(vehicle.motion().pose.distance(10.0, 0.0) <= 0.5);
}

#[test]
fn the_vehicle_stops_when_the_element_it_drives_to_is_deleted() {
    let (mut rig, vehicle) = rig();
    assert!(set_elements(&mut rig, square()));
    rig.send(CLIENT, &execute(Some(1), 2.0));
    rig.run(seconds(2.0));
    let request_id_rec = RequestIdRec { request_id: 1 };
    let delete_element_list = vec![DeleteElementRec { element_uid: 1 }];
    rig.send(
        CLIENT,
        &DeleteElement {
            request_id_rec,
            delete_element_list,
        },
    );
    assert_eq!(rig.answer_code(), Some(ConfirmElementRequest::CODE));
    rig.run(seconds(3.0));
    assert!(vehicle.motion().velocity.is_rest() && vehicle.motion().pose.x < 8.0);
    assert_eq!(active(&mut rig), 0);
}

#[test]
fn local_and_global_waypoints_of_both_versions_may_be_in_one_list() {
    let (mut rig, vehicle) = rig();
    let mut second = SetLocalWaypointExt::default();
    second.set_x_m(10.0).unwrap();
    second.set_y_m(0.0).unwrap();
    let mut third = SetGlobalWaypoint::default();
    third.set_latitude_deg(FRAME.0 + 0.0002).unwrap();
    third.set_longitude_deg(FRAME.1).unwrap();
    let elements = vec![
        element(1, 0, 2, &local_waypoint(5.0, 0.0)),
        element(2, 1, 3, &second),
        element(3, 2, 0, &third),
    ];
    assert!(set_elements(&mut rig, elements));
    rig.send(CLIENT, &execute(Some(1), 2.0));
    rig.run(seconds(40.0));
    let x = vehicle.motion().pose.x;
    assert!((x - 22.25).abs() < 0.6, "{x}");
}

#[test]
fn elements_that_cannot_be_driven_to_are_refused() {
    let (mut rig, _) = rig();
    let mut far = SetLocalWaypointExt::default();
    far.set_x_m(1_000_000.0).unwrap();
    far.set_y_m(0.0).unwrap();
    assert!(!set_elements(&mut rig, vec![element(1, 0, 0, &far)]));
    assert!(!set_elements(
        &mut rig,
        vec![element(1, 0, 0, &QueryHeartbeatPulse)]
    ));
}

#[test]
fn an_active_element_whose_data_are_replaced_is_driven_to_at_its_new_place() {
    let (mut rig, vehicle) = rig();
    assert!(set_elements(
        &mut rig,
        vec![element(1, 0, 0, &local_waypoint(20.0, 0.0))]
    ));
    rig.send(CLIENT, &execute(Some(1), 2.0));
    rig.run(seconds(3.0));
    assert!(set_elements(
        &mut rig,
        vec![element(1, 0, 0, &local_waypoint(0.0, 15.0))]
    ));
    rig.run(seconds(30.0));
    let pose = vehicle.motion().pose;
    assert!(pose.distance(0.0, 15.0) <= 0.5, "{pose:?}");
}
