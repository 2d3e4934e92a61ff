//! Holding velocities and vectors, and the limits set by clients.

use super::*;
use jaus::messages::mobility::set_acceleration_limit::CommandType as AccelerationType;
use jaus::messages::mobility::set_global_vector_ext::{Speed, SpeedSpeedOverGround};
use jaus::messages::mobility::set_velocity_command::CommandType;
use jaus::messages::mobility::{
    QueryAccelerationLimit, QueryGlobalVector, QueryLocalVector, QueryVelocityCommand,
    ReportAccelerationLimit, ReportGlobalVector, ReportLocalVector, ReportVelocityCommand,
    SetAccelerationLimit, SetGlobalVector, SetLocalPose, SetLocalVector, SetLocalVectorExt,
    SetVelocityCommand,
};

fn velocity(command_type: CommandType, x: f64, yaw: f64) -> SetVelocityCommand {
    let mut command = SetVelocityCommand {
        command_type,
        ..SetVelocityCommand::default()
    };
    command.set_velocity_x_m_per_s(x).unwrap();
    command.set_yaw_rate_rad_per_s(yaw).unwrap();
    command
}

fn told(rig: &mut Rig, command_type: CommandType) -> (f64, f64) {
    let query = QueryVelocityCommand {
        command_type: command_type.0,
        ..QueryVelocityCommand::all()
    };
    let report: ReportVelocityCommand = rig.ask(&query).unwrap();
    assert_eq!(report.command_type.0, command_type.0);
    let (x, yaw) = (report.velocity_x_m_per_s(), report.yaw_rate_rad_per_s());
    (x.unwrap(), yaw.unwrap())
}

#[test]
fn a_velocity_is_kept_when_ready_and_reported() {
    let (mut rig, vehicle) = rig();
    let current = CommandType::SET_CURRENT_COMMAND;
    rig.send(STRANGER, &velocity(current, 1.0, 0.0));
    rig.stand(State::Standby, Some(CLIENT));
    rig.send(CLIENT, &velocity(current, 1.0, 0.0));
    rig.run(seconds(2.0));
    assert!(vehicle.motion().pose.distance(0.0, 0.0) < 1e-9);
    rig.stand(State::Ready, Some(CLIENT));
    rig.send(CLIENT, &velocity(current, -0.5, 0.3));
    rig.run(seconds(2.0));
    let motion = vehicle.motion().velocity;
    assert!((motion.x + 0.5).abs() < 1e-3 && (motion.yaw - 0.3).abs() < 1e-2);
    let (x, yaw) = told(&mut rig, current);
    assert!((x + 0.5).abs() < 1e-3 && (yaw - 0.3).abs() < 1e-2);
    rig.stand(State::Standby, Some(CLIENT));
    assert!(told(&mut rig, current).0.abs() < 1e-3);
}

#[test]
fn limits_are_set_in_standby_kept_when_driving_and_gone_after_a_reset() {
    let (mut rig, vehicle) = rig();
    let greatest = CommandType::SET_MAX_ALLOWED;
    rig.stand(State::Standby, Some(CLIENT));
    rig.send(CLIENT, &velocity(greatest, 0.5, 0.2));
    assert!((told(&mut rig, greatest).0 - 0.5).abs() < 1e-3);
    rig.stand(State::Ready, Some(CLIENT));
    rig.send(
        CLIENT,
        &velocity(CommandType::SET_CURRENT_COMMAND, 2.0, 1.0),
    );
    rig.run(seconds(3.0));
    let motion = vehicle.motion().velocity;
    assert!((motion.x - 0.5).abs() < 1e-3 && (motion.yaw - 0.2).abs() < 1e-2);
    rig.stand(State::Initialize, None);
    assert!((told(&mut rig, greatest).0 - 2.0).abs() < 1e-3);
}

#[test]
fn limits_end_with_the_control_of_the_client_that_set_them() {
    let greatest = CommandType::SET_MAX_ALLOWED;
    for next in [None, Some(STRANGER)] {
        let (mut rig, vehicle) = rig();
        rig.send(CLIENT, &velocity(greatest, 0.0, 0.0));
        rig.send(CLIENT, &velocity(CommandType::SET_MIN_ALLOWED, 0.0, 0.0));
        let mut limit = SetAccelerationLimit {
            command_type: AccelerationType::MAX_DECEL,
            ..SetAccelerationLimit::default()
        };
        limit.set_acceleration_x_m_per_s2(0.1).unwrap();
        rig.send(CLIENT, &limit);
        let default = CommandType::SET_DEFAULT_COMMAND;
        rig.send(CLIENT, &velocity(default, 1.0, 0.5));
        let ahead = velocity(CommandType::SET_CURRENT_COMMAND, 1.0, 0.0);
        rig.send(CLIENT, &ahead);
        rig.run(seconds(1.0));
        let why = vehicle.held().unwrap();
        assert!(why.starts_with("any motion is limited to 0"), "{why}");
        rig.stand(State::Standby, next);
        assert!(told(&mut rig, default).0.abs() < 1e-3, "the default, too");
        rig.stand(State::Ready, Some(STRANGER));
        assert!((told(&mut rig, greatest).0 - 2.0).abs() < 1e-3);
        for _ in 0..30 {
            rig.send(STRANGER, &ahead);
            rig.run(seconds(0.1));
        }
        assert!((vehicle.motion().velocity.x - 1.0).abs() < 0.01);
        assert_eq!(vehicle.held(), None);
        vehicle.stop();
        rig.run(seconds(1.0));
        assert!(vehicle.motion().velocity.is_rest(), "full brakes");
    }
}

#[test]
fn who_watches_limits_is_told_when_they_end_with_control() {
    let (mut rig, _vehicle) = rig();
    rig.stand(State::Standby, Some(CLIENT));
    rig.send(CLIENT, &velocity(CommandType::SET_MAX_ALLOWED, 0.5, 0.2));
    rig.changed().clear();
    rig.stand(State::Standby, None);
    for code in [QueryVelocityCommand::CODE, QueryAccelerationLimit::CODE] {
        assert!(rig.changed().contains(&code), "{code:04X}");
    }
}

#[test]
fn a_speed_of_0_is_a_limit_that_no_driver_overcomes() {
    let (mut rig, vehicle) = rig();
    rig.send(CLIENT, &velocity(CommandType::SET_MAX_ALLOWED, 0.0, 0.0));
    let mut effort = jaus::messages::mobility::SetWrenchEffort::default();
    effort
        .set_propulsive_linear_effort_x_percent(100.0)
        .unwrap();
    rig.send(CLIENT, &effort);
    rig.run(seconds(3.0));
    assert!(vehicle.motion().pose.distance(0.0, 0.0) < 1e-6);
}

#[test]
fn acceleration_is_limited() {
    let (mut rig, vehicle) = rig();
    let mut limit = SetAccelerationLimit {
        command_type: AccelerationType::MAX_ACCEL,
        ..SetAccelerationLimit::default()
    };
    limit.set_acceleration_x_m_per_s2(0.1).unwrap();
    rig.send(CLIENT, &limit);
    let query = QueryAccelerationLimit {
        command_type: 1,
        ..QueryAccelerationLimit::none().with_acceleration_x()
    };
    let report: ReportAccelerationLimit = rig.ask(&query).unwrap();
    assert!((report.acceleration_x_m_per_s2().unwrap() - 0.1).abs() < 1e-3);
    assert!(report.yaw_acceleration.is_none());
    rig.send(
        CLIENT,
        &velocity(CommandType::SET_CURRENT_COMMAND, 2.0, 0.0),
    );
    rig.run(seconds(2.0));
    assert!((vehicle.motion().velocity.x - 0.2).abs() < 0.01);
}

#[test]
fn a_local_vector_is_kept_and_reported() {
    let (mut rig, vehicle) = rig();
    let mut vector = SetLocalVector::default();
    vector.set_speed_m_per_s(1.0).unwrap();
    vector.set_heading_rad(1.0).unwrap();
    rig.send(STRANGER, &vector);
    rig.run(seconds(1.0));
    assert!(vehicle.motion().velocity.is_rest());
    rig.send(CLIENT, &vector);
    rig.run(seconds(5.0));
    let motion = vehicle.motion();
    assert!((motion.pose.yaw - 1.0).abs() < 0.01 && (motion.velocity.x - 1.0).abs() < 0.01);
    let report: ReportLocalVector = rig.ask(&QueryLocalVector::all()).unwrap();
    assert!(report.speed == vector.speed && report.heading == vector.heading);
    let straight = SetLocalVectorExt {
        speed: Speed::SpeedOverGround(SpeedSpeedOverGround::new(0.5).unwrap()),
        ..SetLocalVectorExt::default()
    };
    rig.send(CLIENT, &straight);
    rig.run(seconds(3.0));
    let motion = vehicle.motion();
    assert!((motion.pose.yaw - 1.0).abs() < 0.01 && (motion.velocity.x - 0.5).abs() < 0.01);
}

#[test]
fn a_global_vector_is_measured_from_north_however_the_local_frame_lies() {
    let (mut rig, vehicle) = rig();
    let mut turned = SetLocalPose::default();
    turned.set_yaw_rad(2.0).unwrap();
    rig.send(CLIENT, &turned);
    let mut vector = SetGlobalVector::default();
    vector.set_speed_m_per_s(1.0).unwrap();
    vector.set_heading_rad(-1.0).unwrap();
    rig.send(CLIENT, &vector);
    rig.run(seconds(5.0));
    assert!((vehicle.global_pose().yaw + 1.0).abs() < 0.01);
    let report: ReportGlobalVector = rig.ask(&QueryGlobalVector::all()).unwrap();
    assert!(report.speed == vector.speed && report.heading == vector.heading);
}

#[test]
fn a_global_vector_keeps_its_heading_when_the_local_frame_is_set_anew_on_the_way() {
    let (mut rig, vehicle) = rig();
    let mut vector = SetGlobalVector::default();
    vector.set_speed_m_per_s(1.0).unwrap();
    vector.set_heading_rad(-1.0).unwrap();
    rig.send(CLIENT, &vector);
    rig.run(seconds(5.0));
    let mut turned = SetLocalPose::default();
    turned.set_yaw_rad(2.0).unwrap();
    rig.send(CLIENT, &turned);
    rig.run(seconds(5.0));
    assert!((vehicle.global_pose().yaw + 1.0).abs() < 0.01);
}

#[test]
fn a_vector_ends_when_the_pose_that_it_is_held_by_is_set_elsewhere() {
    let (mut rig, vehicle) = rig();
    let mut vector = SetLocalVector::default();
    vector.set_speed_m_per_s(1.0).unwrap();
    vector.set_heading_rad(0.0).unwrap();
    for (x, yaw, goes_on) in [(0.2, 0.0, true), (3.0, 0.0, false), (0.0, 1.5, false)] {
        rig.send(CLIENT, &vector);
        rig.run(seconds(5.0));
        let here = vehicle.motion().pose;
        let mut pose = SetLocalPose::default();
        pose.set_x_m(here.x + x).unwrap();
        pose.set_yaw_rad(here.yaw + yaw).unwrap();
        rig.send(CLIENT, &pose);
        rig.run(seconds(3.0));
        assert_eq!(!vehicle.motion().velocity.is_rest(), goes_on, "{x} {yaw}");
        let told = vehicle.last_stop().map(|cause| cause.to_string());
        let is_told = told.is_some_and(|it| it.starts_with("the pose jumped by"));
        assert_eq!(is_told, !goes_on);
    }
}

#[test]
fn a_global_vector_without_a_speed_takes_none_from_before_another_driver_replaced_it() {
    let (mut rig, vehicle) = rig();
    let mut vector = SetGlobalVector::default();
    vector.set_speed_m_per_s(1.0).unwrap();
    rig.send(CLIENT, &vector);
    rig.run(seconds(2.0));
    rig.send(
        CLIENT,
        &velocity(CommandType::SET_CURRENT_COMMAND, 0.0, 0.0),
    );
    rig.run(seconds(2.0));
    let mut heading = SetGlobalVector::default();
    heading.set_heading_rad(0.5).unwrap();
    rig.send(CLIENT, &heading);
    rig.run(seconds(2.0));
    assert!(vehicle.motion().velocity.x.abs() < 0.01);
}

#[test]
fn a_vector_ends_when_its_client_has_shown_no_life_for_a_second_and_stays_ended() {
    let (mut rig, vehicle) = rig();
    let mut vector = SetLocalVector::default();
    vector.set_speed_m_per_s(1.0).unwrap();
    rig.send(CLIENT, &vector);
    rig.run(seconds(10.0));
    assert!(vehicle.motion().velocity.x > 0.9);
    rig.client_lives = false;
    rig.run(seconds(1.0));
    assert_eq!(
        vehicle.last_stop(),
        Some(StopCause::ControllerSilent(CLIENT))
    );
    rig.client_lives = true;
    rig.run(seconds(5.0));
    assert!(vehicle.motion().velocity.is_rest());
}

#[test]
fn a_velocity_ends_half_a_second_after_it_unless_it_is_repeated() {
    let (mut rig, vehicle) = rig();
    let vehicle = vehicle.motion_policy(MotionPolicy::default());
    let ahead = velocity(CommandType::SET_CURRENT_COMMAND, 1.0, 0.0);
    for _ in 0..10 {
        rig.send(CLIENT, &ahead);
        rig.run(seconds(0.4));
    }
    assert!(vehicle.motion().velocity.x > 0.9 && vehicle.last_stop().is_none());
    rig.run(seconds(0.1));
    assert_eq!(vehicle.last_stop(), Some(StopCause::Expired(CLIENT)));
    rig.run(seconds(2.0));
    assert!(vehicle.motion().velocity.is_rest());
}
