//! The JAUS side of the bridge with a vehicle of real parts, in virtual time.
#![allow(
    clippy::disallowed_methods,
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "the tests use a clock that is paused, and fail by panicking"
)]

#[path = "../rover/mod.rs"]
mod rover;
mod scene;

use std::time::Duration;

use jaus_ros2::bridge::frames::Quaternion;
use jaus_ros2::bridge::{GoalPose, Input};
use jaus_test_kit::waiting::within_limit;

use rover::PRIMITIVE;
use scene::{PUBLISHER, Scene};

/// A vehicle and a bridge with authority 127.
fn driveable() -> Scene {
    let mut scene = Scene::new();
    scene.start_vehicle();
    scene.start_bridge(Some(127));
    scene
}

#[tokio::test(start_paused = true)]
async fn cmd_vel_drives_the_vehicle_north_which_is_y_in_map_and_silence_stops_it() {
    let scene = driveable();
    scene.until(|it| it.odometry().is_some()).await;
    assert_eq!(scene.controller().await, 0, "no control before a command");
    scene.drive_until(1.0, |it| it.speed() > 0.5).await;
    let start = scene.odometry().unwrap();
    scene
        .drive_until(1.0, |it| it.odometry().unwrap().pose.position[1] > 1.0)
        .await;
    assert_eq!(scene.controller().await, 101);
    let moved = scene.odometry().unwrap();
    assert!(
        (moved.pose.position[0] - start.pose.position[0]).abs() < 0.2,
        "{moved:?}"
    );

    scene.until(|it| it.speed().abs() < 0.01).await;
    // Control is kept for five seconds, and then released.
    scene.until(|it| it.says("control=not wanted")).await;
    within_limit(async {
        while scene.controller().await != 0 {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    })
    .await;
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn a_left_turn_is_a_positive_yaw_rate_on_both_sides() {
    let scene = driveable();
    let turns_left = |it: &Scene| it.odometry().is_some_and(|it| it.twist.angular[2] > 0.2);
    within_limit(async {
        while !turns_left(&scene) {
            scene.drive(0.0, 0.5).await;
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    })
    .await;
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn the_end_of_the_publisher_or_of_the_network_stops_the_vehicle_before_the_timeout() {
    for ends in [Input::PublisherGone(PUBLISHER), Input::Disconnected] {
        let scene = driveable();
        scene.drive_until(1.0, |it| it.speed() > 0.5).await;
        scene.input(ends.clone()).await;
        // The timeout would stop it only after 500 ms.
        tokio::time::sleep(Duration::from_millis(400)).await;
        let speed = scene.speed();
        assert!(speed < 0.3, "{ends:?}: {speed}");
        scene.until(|it| it.speed().abs() < 0.01).await;
        scene.end().await;
    }
}

#[tokio::test(start_paused = true)]
async fn without_rights_nothing_is_commanded_and_no_emergency_set() {
    let mut scene = Scene::new();
    scene.start_vehicle();
    scene.start_bridge(None);
    scene.until(|it| it.odometry().is_some()).await;
    for _ in 0..20 {
        scene.drive(1.0, 0.0).await;
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    assert!(scene.reported_speed().await.abs() < 0.01);
    assert_eq!(scene.controller().await, 0);
    scene
        .until(|it| it.says("rights of ROS (--rights)=20"))
        .await;
    scene.input(Input::EmergencyStop(PUBLISHER, true)).await;
    scene
        .until(|it| it.says("emergency stops refused by the rights of ROS (--rights)=1"))
        .await;
    tokio::time::sleep(Duration::from_secs(2)).await;
    assert!(!scene.says(": emergency"), "{}", scene.status());
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn a_bridge_that_may_only_stop_sets_an_emergency() {
    let mut scene = Scene::new();
    scene.start_vehicle();
    scene.start_bridge_with(Some("observe".to_owned()));
    scene.until(|it| it.odometry().is_some()).await;
    scene.input(Input::EmergencyStop(PUBLISHER, true)).await;
    scene.until(|it| it.says("Driver: emergency")).await;
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn an_emergency_stops_the_vehicle_and_it_drives_again_only_after_a_clear_and_a_pause() {
    let scene = driveable();
    scene.drive_until(1.0, |it| it.speed() > 0.5).await;
    scene.input(Input::EmergencyStop(PUBLISHER, true)).await;
    scene.drive_until(1.0, |it| it.speed().abs() < 0.01).await;
    scene
        .drive_until(1.0, |it| it.says("Driver: emergency"))
        .await;
    // Commands that go on while it is cleared do not drive it.
    scene.input(Input::EmergencyStop(PUBLISHER, false)).await;
    scene.drive_until(1.0, |it| !it.says(": emergency")).await;
    for _ in 0..20 {
        scene.drive(1.0, 0.0).await;
        tokio::time::sleep(Duration::from_millis(100)).await;
        assert!(scene.speed().abs() < 0.01, "{}", scene.status());
    }
    tokio::time::sleep(Duration::from_secs(1)).await;
    scene.drive_until(1.0, |it| it.speed() > 0.5).await;
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn an_emergency_stop_reaches_a_vehicle_that_appears_after_it() {
    let mut scene = Scene::new();
    scene.start_bridge(Some(127));
    scene.input(Input::EmergencyStop(PUBLISHER, true)).await;
    tokio::time::sleep(Duration::from_secs(1)).await;
    scene.start_vehicle();
    scene.until(|it| it.says("Driver: emergency")).await;
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn a_release_ends_driving_although_its_publisher_goes_on() {
    let scene = driveable();
    scene.drive_until(1.0, |it| it.speed() > 0.5).await;
    scene.input(Input::Release(PUBLISHER)).await;
    scene
        .drive_until(1.0, |it| it.says("control=not wanted"))
        .await;
    for _ in 0..20 {
        scene.drive(1.0, 0.0).await;
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    assert!(scene.reported_speed().await.abs() < 0.01);
    assert_eq!(scene.controller().await, 0, "{}", scene.status());
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn a_vehicle_without_a_driver_is_reported_if_control_is_allowed() {
    let mut scene = Scene::new();
    scene.start_bridge(Some(127));
    scene.start_sensors();
    scene.until(|it| it.says("has no driver")).await;
    scene.start_driver();
    scene.until(|it| it.says("jaus-ros2: connected")).await;
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn a_client_with_a_higher_authority_takes_the_vehicle_and_ros_does_not_take_it_back() {
    let scene = driveable();
    scene.drive_until(1.0, |it| it.speed() > 0.5).await;
    let control = scene.operator.control(PRIMITIVE, 200).await.unwrap();
    scene.drive_until(1.0, |it| it.speed().abs() < 0.01).await;
    scene.until(|it| it.says("jaus-ros2: no control of")).await;
    control.release().await;
    for _ in 0..30 {
        scene.drive(1.0, 0.0).await;
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    assert_eq!(scene.controller().await, 0, "{}", scene.status());
    assert!(scene.speed().abs() < 0.01);
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn what_a_publisher_does_with_control_and_emergencies_is_recorded_once() {
    let scene = driveable();
    scene.drive_until(1.0, |it| it.speed() > 0.5).await;
    let by = PUBLISHER.to_string();
    let requested = format!("RequestControl from 101.252.1 to {PRIMITIVE}");
    assert_eq!(scene.audit.count(&[&by, &requested, "Passed"]), 1);
    assert_eq!(scene.audit.count(&[&by, "ConfirmControl", "Granted"]), 1);

    let control = scene.operator.control(PRIMITIVE, 200).await.unwrap();
    scene
        .drive_until(1.0, |it| it.says("jaus-ros2: no control of"))
        .await;
    assert_eq!(scene.audit.count(&[&by, "RejectControl", "Ended"]), 1);
    control.release().await;

    scene.input(Input::EmergencyStop(PUBLISHER, true)).await;
    scene.until(|it| it.says("Driver: emergency")).await;
    assert_eq!(scene.audit.count(&[&by, "SetEmergency", "Passed"]), 1);
    scene.input(Input::EmergencyStop(PUBLISHER, false)).await;
    scene.until(|it| !it.says(": emergency")).await;
    assert_eq!(scene.audit.count(&[&by, "ClearEmergency", "Passed"]), 1);
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn what_the_rights_of_ros_forbid_is_recorded() {
    let mut scene = Scene::new();
    scene.start_vehicle();
    scene.start_bridge(None);
    scene.until(|it| it.odometry().is_some()).await;
    scene.drive(1.0, 0.0).await;
    scene.input(Input::EmergencyStop(PUBLISHER, true)).await;
    let refused = |it: &Scene| it.audit.count(&[&PUBLISHER.to_string(), "Refused"]);
    scene.until(|it| refused(it) == 2).await;
    assert_eq!(scene.audit.count(&["SetEmergency", "Refused"]), 1);
    scene.end().await;
}

#[tokio::test(start_paused = true)]
async fn while_nothing_can_be_recorded_ros_stops_the_vehicle_and_does_nothing_else() {
    let scene = driveable();
    scene.drive_until(1.0, |it| it.speed() > 0.5).await;
    scene.audit.set_broken(true);
    // A stop takes effect before the timeout does.
    scene.drive(0.0, 0.0).await;
    tokio::time::sleep(Duration::from_millis(400)).await;
    assert!(scene.speed() < 0.3, "{}", scene.speed());
    for _ in 0..20 {
        scene.drive(1.0, 0.0).await;
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    assert!(scene.speed().abs() < 0.01, "{}", scene.status());
    assert!(scene.audit.count(&["RequestControl", "Unrecorded"]) >= 20);
    scene.input(Input::EmergencyStop(PUBLISHER, true)).await;
    scene.until(|it| it.says("Driver: emergency")).await;
    scene.input(Input::EmergencyStop(PUBLISHER, false)).await;
    tokio::time::sleep(Duration::from_secs(2)).await;
    assert!(scene.says("Driver: emergency"), "it is not cleared");
    scene.audit.set_broken(false);
    scene.input(Input::EmergencyStop(PUBLISHER, false)).await;
    scene.until(|it| !it.says(": emergency")).await;
    scene.end().await;
}

fn goal(east: f64, north: f64) -> Input {
    let pose = GoalPose {
        frame: "map".to_owned(),
        position: [east, north, 0.0],
        orientation: Quaternion {
            x: 0.0,
            y: 0.0,
            z: 0.0,
            w: 1.0,
        },
    };
    Input::Goal(PUBLISHER, pose)
}

#[tokio::test(start_paused = true)]
async fn a_goal_is_driven_to_by_the_planner_and_cmd_vel_takes_over_from_it() {
    let mut scene = driveable();
    scene.start_planner();
    scene.until(|it| it.odometry().is_some()).await;
    scene.until(|it| it.says("Planner")).await;
    scene.input(goal(0.0, 4.0)).await;
    scene.until(|it| it.says("goal=arrived")).await;
    let position = scene.odometry().unwrap().pose.position;
    assert!((position[1] - 4.0).abs() < 1.0, "{position:?}");

    scene.input(goal(0.0, 20.0)).await;
    scene.until(|it| it.speed() > 0.3).await;
    scene.drive_until(-0.5, |it| it.speed() < -0.2).await;
    assert!(scene.says("goal=cancelled"), "{}", scene.status());
    scene.end().await;
}
