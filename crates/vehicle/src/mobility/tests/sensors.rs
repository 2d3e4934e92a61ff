//! Reports and settings of the sensors, and the conditions under which effort moves the vehicle.

use super::*;
use jaus::messages::mobility::report_velocity_state_ext::VelocityVar;
use jaus::messages::mobility::{
    QueryAccelerationState, QueryGeomagneticProperty, QueryGlobalPose, QueryLocalPose,
    QueryLocalPoseExt, QueryVelocityState, QueryVelocityStateExt, QueryWrenchEffort,
    ReportAccelerationState, ReportGeomagneticProperty, ReportGlobalPose, ReportLocalPose,
    ReportLocalPoseExt, ReportVelocityState, ReportVelocityStateExt, ReportWrenchEffort,
    SetGeomagneticProperty, SetGlobalPose, SetLocalPose, SetWrenchEffort,
};

fn velocity(rig: &mut Rig) -> ReportVelocityState {
    rig.ask(&QueryVelocityState::all()).unwrap()
}

fn local_pose(rig: &mut Rig) -> ReportLocalPose {
    rig.ask(&QueryLocalPose::all()).unwrap()
}

fn effort(forward: f64, turn: f64) -> SetWrenchEffort {
    let mut effort = SetWrenchEffort::default();
    effort
        .set_propulsive_linear_effort_x_percent(forward)
        .unwrap();
    effort
        .set_propulsive_rotational_effort_z_percent(turn)
        .unwrap();
    effort
}

fn pose(x: f64, y: f64) -> SetLocalPose {
    let mut pose = SetLocalPose::default();
    pose.set_x_m(x).unwrap();
    pose.set_y_m(y).unwrap();
    pose
}

#[test]
fn a_report_has_the_fields_that_were_asked_for_and_no_others() {
    let (mut rig, _) = rig();
    let report: ReportVelocityState = rig
        .ask(&QueryVelocityState::none().with_yaw_rate().with_time_stamp())
        .unwrap();
    assert!(report.yaw_rate.is_some() && report.time_stamp.is_some());
    assert_eq!(report.encode().unwrap()[2..4], [0x40, 0x01]);
    let report: ReportLocalPose = rig.ask(&QueryLocalPose::none()).unwrap();
    assert_eq!(report, ReportLocalPose::default());
    let report: ReportGlobalPose = rig.ask(&QueryGlobalPose::none()).unwrap();
    assert_eq!(report, ReportGlobalPose::default());
}

#[test]
fn time_stamps_tell_the_time_of_day_and_advance() {
    let (mut rig, vehicle) = rig();
    let stamp = velocity(&mut rig).time_stamp.unwrap();
    assert_eq!(
        (stamp.day(), stamp.hour(), stamp.minutes(), stamp.seconds()),
        (8, 1, 2, 3)
    );
    let later = Duration::from_millis(1_433_725_325_504);
    let _ = vehicle.with_clock(TimeOfDay::new(move || later));
    rig.run(seconds(2.5));
    let stamp = local_pose(&mut rig).time_stamp.unwrap();
    assert_eq!((stamp.seconds(), stamp.milliseconds()), (5, 504));
}

/// A sensor component and the vehicle it observes.
fn watched() -> (Rig, Observed) {
    let observed = Observed::default();
    let time = TimeOfDay::new(|| Duration::from_millis(1_433_725_323_004));
    let vehicle = Vehicle::new(Pilot::new(observed.clone(), Frame::default()));
    let vehicle = vehicle.with_clock(time.clone());
    let sensor = Box::new(vehicle.local_pose_sensor());
    (Rig::new(vec![sensor, Box::new(Time::new(time))]), observed)
}

#[test]
fn a_report_is_stamped_with_the_time_of_its_sample_and_not_of_the_answer() {
    let (mut rig, observed) = watched();
    observed.set(Motion {
        sampled_at: rig.now.checked_sub(seconds(0.5)),
        ..Motion::default()
    });
    let first = local_pose(&mut rig).time_stamp.unwrap();
    assert_eq!((first.seconds(), first.milliseconds()), (2, 504));
    rig.run(seconds(1.0));
    let second = local_pose(&mut rig).time_stamp.unwrap();
    assert_eq!(second, first, "the same sample");
}

#[test]
fn set_time_sets_the_stamps_of_the_vehicle_too() {
    let (mut rig, observed) = watched();
    observed.set(Motion {
        sampled_at: Some(rig.now),
        ..Motion::default()
    });
    assert_eq!(local_pose(&mut rig).time_stamp.unwrap().hour(), 1);
    let time = core::report_time::TimeStamp::default();
    let time = time.with_day(8).unwrap().with_hour(17).unwrap();
    rig.send(
        CLIENT,
        &core::SetTime {
            time_stamp: Some(time),
            date_stamp: None,
        },
    );
    assert_eq!(local_pose(&mut rig).time_stamp.unwrap().hour(), 17);
}

#[test]
fn a_vehicle_that_does_not_know_the_time_tells_none() {
    let services = vec![Box::new(vehicle().velocity_state_sensor()) as Box<_>];
    let report = velocity(&mut Rig::new(services));
    assert!(report.time_stamp.is_none() && report.velocity_x.is_some());
}

#[test]
fn the_local_pose_is_set_by_the_client_in_control_alone_in_every_state() {
    let (mut rig, _) = rig();
    for state in [State::Standby, State::Ready] {
        rig.stand(state, Some(CLIENT));
        rig.send(STRANGER, &pose(7.0, 7.0));
        assert!(local_pose(&mut rig).x_m().unwrap().abs() < 0.001);
        rig.send(CLIENT, &pose(-1000.0, -1000.0));
        let report = local_pose(&mut rig);
        assert!((report.x_m().unwrap() + 1000.0).abs() < 0.001);
        assert!((report.y_m().unwrap() + 1000.0).abs() < 0.001);
        rig.send(CLIENT, &pose(0.0, 0.0));
    }
    assert!(rig.changed().contains(&QueryLocalPose::CODE));
    rig.stand(State::Ready, None);
    rig.send(CLIENT, &pose(7.0, 7.0));
    assert!(local_pose(&mut rig).x_m().unwrap().abs() < 0.001);
}

#[test]
fn what_a_new_pose_does_not_tell_stays_as_it_is() {
    let (mut rig, _) = rig();
    rig.send(CLIENT, &pose(5.0, 6.0));
    let mut turned = SetLocalPose::default();
    turned.set_yaw_rad(1.0).unwrap();
    rig.send(CLIENT, &turned);
    let report = local_pose(&mut rig);
    assert!((report.x_m().unwrap() - 5.0).abs() < 0.001);
    assert!((report.yaw_rad().unwrap() - 1.0).abs() < 0.001);
}

#[test]
fn the_global_pose_is_where_it_was_put_and_the_local_one_stays() {
    let (mut rig, _) = rig();
    let query = QueryGlobalPose::all();
    let report: ReportGlobalPose = rig.ask(&query).unwrap();
    assert!((report.latitude_deg().unwrap() - FRAME.0).abs() < 1e-6);
    let mut pose = SetGlobalPose::default();
    pose.set_latitude_deg(-33.9).unwrap();
    pose.set_longitude_deg(18.4).unwrap();
    rig.send(STRANGER, &pose);
    assert_eq!(rig.ask::<ReportGlobalPose>(&query).unwrap(), report);
    rig.send(CLIENT, &pose);
    let report: ReportGlobalPose = rig.ask(&query).unwrap();
    assert!((report.latitude_deg().unwrap() + 33.9).abs() < 1e-6);
    assert!((report.longitude_deg().unwrap() - 18.4).abs() < 1e-6);
    assert!(local_pose(&mut rig).x_m().unwrap().abs() < 0.001);
}

#[test]
fn the_magnetic_variation_is_what_was_set() {
    let (mut rig, _) = rig();
    let mut property = SetGeomagneticProperty::default();
    property.set_magnetic_variation_rad(0.1).unwrap();
    rig.send(CLIENT, &property);
    let report: ReportGeomagneticProperty = rig.ask(&QueryGeomagneticProperty).unwrap();
    assert!((report.magnetic_variation_rad() - 0.1).abs() < 1e-3);
}

#[test]
fn effort_moves_the_vehicle_and_all_sensors_agree_on_it() {
    let (mut rig, _) = rig();
    rig.send(CLIENT, &effort(100.0, 0.0));
    rig.changed().clear();
    rig.run(seconds(0.5));
    let report: ReportAccelerationState = rig.ask(&QueryAccelerationState::all()).unwrap();
    assert!(report.acceleration_x_m_per_s2().unwrap() > 0.5);
    rig.run(seconds(4.5));
    let speed = velocity(&mut rig).velocity_x_m_per_s().unwrap();
    assert!(speed > 1.5, "{speed}");
    assert!(local_pose(&mut rig).x_m().unwrap() > 3.0);
    let query = QueryVelocityStateExt::none()
        .with_velocity_x()
        .with_speed_over_ground();
    let report: ReportVelocityStateExt = rig.ask(&query).unwrap();
    let VelocityVar::VelocityVehicleXyzRec(along) = &report.velocity_var else {
        panic!("not along the vehicle's axes: {report:?}");
    };
    assert!(along.velocity_x.is_some() && along.velocity_y.is_none());
    assert_eq!(report.report_velocity_state_ext_rec.yaw_rate, None);
    let over_ground = report
        .report_velocity_state_ext_rec
        .speed_over_ground
        .unwrap();
    assert!((over_ground.value() - speed).abs() < 0.02);
    let report: ReportLocalPoseExt = rig.ask(&QueryLocalPoseExt::all()).unwrap();
    let difference = report.x_m().unwrap() - local_pose(&mut rig).x_m().unwrap();
    assert!(difference.abs() < 0.02);
    let report: ReportGlobalPose = rig.ask(&QueryGlobalPose::all()).unwrap();
    assert!(report.latitude_deg().unwrap() > FRAME.0 + 1e-5);
    for code in [
        QueryVelocityState::CODE,
        QueryAccelerationState::CODE,
        QueryLocalPose::CODE,
        QueryGlobalPose::CODE,
    ] {
        assert!(rig.changed().contains(&code), "{code:04X}");
    }
}

#[test]
fn effort_is_reported_as_it_was_set_and_0_where_nothing_was() {
    let (mut rig, _) = rig();
    let query = QueryWrenchEffort::all();
    let report: ReportWrenchEffort = rig.ask(&query).unwrap();
    assert!(report.propulsive_linear_effort_x_percent().unwrap().abs() < 0.01);
    rig.send(CLIENT, &effort(-100.0, 100.0));
    let report: ReportWrenchEffort = rig.ask(&query).unwrap();
    assert!((report.propulsive_linear_effort_x_percent().unwrap() + 100.0).abs() < 0.01);
    assert!((report.propulsive_rotational_effort_z_percent().unwrap() - 100.0).abs() < 0.01);
    assert!(
        report
            .resistive_rotational_effort_z_percent()
            .unwrap()
            .abs()
            < 0.5
    );
}

#[test]
fn effort_is_ignored_from_strangers_and_in_every_state_but_ready() {
    let (mut rig, vehicle) = rig();
    rig.send(STRANGER, &effort(100.0, 0.0));
    let states = [
        State::Initialize,
        State::Standby,
        State::Shutdown,
        State::Failure,
        State::Emergency,
    ];
    for state in states {
        rig.stand(state, Some(CLIENT));
        rig.send(CLIENT, &effort(100.0, 0.0));
    }
    rig.stand(State::Ready, None);
    rig.send(CLIENT, &effort(100.0, 0.0));
    rig.run(seconds(5.0));
    assert!(vehicle.motion().pose.distance(0.0, 0.0) < 1e-9);
    assert!(
        rig.poll_timeout().is_none(),
        "a vehicle at rest wants no time"
    );
}

#[test]
fn the_vehicle_stops_when_it_may_no_longer_act_and_does_not_go_on_by_itself() {
    let cases = [
        (State::Standby, Some(CLIENT)),
        (State::Emergency, Some(CLIENT)),
        (State::Shutdown, Some(CLIENT)),
        (State::Failure, None),
        (State::Ready, None),
        (State::Ready, Some(STRANGER)),
    ];
    for (state, controller) in cases {
        let (mut rig, vehicle) = rig();
        rig.send(CLIENT, &effort(100.0, 0.0));
        rig.run(seconds(5.0));
        assert!(!vehicle.motion().velocity.is_rest());
        rig.stand(state, controller);
        rig.run(seconds(1.5));
        assert!(
            vehicle.motion().velocity.is_rest(),
            "{state} {controller:?}"
        );
        rig.stand(State::Ready, Some(CLIENT));
        rig.run(seconds(5.0));
        assert!(
            vehicle.motion().velocity.is_rest(),
            "{state} {controller:?}"
        );
    }
}
