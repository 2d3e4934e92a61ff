//! What the drivers believe cannot be moved under them, motion does not restart by itself, and motion
//! without a command is a fault.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with sockets"
)]

use std::time::Duration;

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::component::{Component, Control, Kind, State};
use jaus::messages::mobility::delete_zone::ZoneIdRec;
use jaus::messages::mobility::{
    DeleteZone, QueryLocalOperatingZone, SetLocalPose, SetWrenchEffort, delete_zone,
    primitive_driver,
};
use jaus::node::{Config, Node, now};
use jaus_test_kit::waiting::LIMIT;
use jaus_vehicle::actuator::{MotorConfig, SimulatedMotor};
use jaus_vehicle::ground::StageState;
use jaus_vehicle::messages::ground::report_mission::Stage;
use jaus_vehicle::messages::ground::set_destination::Approved;
use jaus_vehicle::messages::ground::{
    ContinueMission, QueryMission, ReportMission, SetDestination, mission_planner,
};
use jaus_vehicle::parts::{Drives, Hardware, PrimitiveDriver};
use tokio::time::sleep;

use crate::mission::zones::{keep_out, square};
use crate::scene::{PLANNER, POSE, PRIMITIVE, STORE, Scene, VECTOR};
use crate::whole_vehicle::WholeVehicle;

/// Another client in the network.
pub(crate) struct Stranger {
    _node: Node,
    pub(crate) client: Component,
}

impl Stranger {
    pub(crate) fn new(scene: &Scene) -> Self {
        let node = Node::start(Config::loopback(77, 1).group(scene.group)).unwrap();
        let client = Component::builder(Kind::OperatorControlUnit, "Stranger");
        let client = client.attach(&node, 1).unwrap();
        Self {
            _node: node,
            client,
        }
    }

    /// Takes control of a component that nobody controls, with the lowest authority, and sends it a
    /// command.
    async fn command(&self, id: JausId, command: &impl Message) {
        let control = self.client.control(id, 1).await.unwrap();
        control.deliver(command).await.unwrap();
        sleep(Duration::from_millis(500)).await;
        control.release().await;
    }
}

pub(crate) fn pose(x: f64, y: f64, yaw: f64) -> SetLocalPose {
    let mut pose = SetLocalPose::default();
    pose.set_x_m(x).unwrap();
    pose.set_y_m(y).unwrap();
    pose.set_yaw_rad(yaw).unwrap();
    pose
}

pub(crate) async fn mission(vehicle: &Scene) -> ReportMission {
    let report = vehicle.client.query(PLANNER, &QueryMission {}).await;
    report.unwrap_or_default()
}

pub(crate) async fn until_stage(vehicle: &Scene, stage: Stage) -> ReportMission {
    let mut last = ReportMission::default();
    let start = now();
    while now() - start < LIMIT {
        last = mission(vehicle).await;
        if last.stage == stage {
            return last;
        }
        sleep(Duration::from_millis(50)).await;
    }
    panic!("not in {stage:?}: {last:?}");
}

/// A vehicle on its mission.
pub(crate) async fn driving(name: &str) -> (WholeVehicle, Control) {
    let vehicle = WholeVehicle::start(name, None);
    let planner = set_out(&vehicle).await;
    (vehicle, planner)
}

/// Sends a vehicle from its start on a mission to (6, 5), and waits until it is under way.
pub(crate) async fn set_out(vehicle: &WholeVehicle) -> Control {
    let planner = vehicle.control(PLANNER, mission_planner::URN).await;
    let go = SetDestination {
        x: 6.0,
        y: 5.0,
        speed: Some(0.6),
        approved: Approved::YES,
    };
    planner.deliver(&go).await.unwrap();
    until_stage(vehicle, Stage::DRIVING).await;
    vehicle.until_at("sets out", |x, y| x.hypot(y) > 0.5).await;
    planner
}

pub(crate) fn ahead(percent: f64) -> SetWrenchEffort {
    let mut effort = SetWrenchEffort::default();
    effort
        .set_propulsive_linear_effort_x_percent(percent)
        .unwrap();
    effort
}

#[tokio::test(start_paused = true)]
async fn a_client_that_does_not_control_the_mission_cannot_move_the_pose_under_it() {
    let (vehicle, _planner) = driving("pose-under").await;
    let stranger = Stranger::new(&vehicle);
    let (x, y) = vehicle.here().await;
    stranger.command(POSE, &pose(x, y + 3.0, 1.5)).await;
    let (_, after) = vehicle.here().await;
    assert!(after < y + 1.5, "{y:.2} to {after:.2}");
    until_stage(&vehicle, Stage::ARRIVED).await;
    let (x, y) = vehicle.here().await;
    assert!((x - 6.0).hypot(y - 5.0) < 0.5, "{x:.2}, {y:.2}");
    // At rest, and with nobody in control of a driver, it is allowed.
    drop(_planner);
    sleep(Duration::from_secs(10)).await;
    stranger.command(POSE, &pose(1.0, 1.0, 0.0)).await;
    let (x, y) = vehicle.here().await;
    assert!((x - 1.0).hypot(y - 1.0) < 0.1, "{x:.2}, {y:.2}");
    vehicle.end().await;
}

#[tokio::test(start_paused = true)]
async fn a_pose_that_jumps_under_a_mission_stops_it_until_the_operator_continues() {
    let (vehicle, planner) = driving("pose-jumps").await;
    let (x, y) = vehicle.here().await;
    // The operator's own client controls the chain, and so may set the pose.
    let sensor = vehicle.lease(POSE).await;
    sensor.deliver(&pose(x, y - 0.8, 0.5)).await.unwrap();
    let report = until_stage(&vehicle, Stage::WAITING).await;
    let reason = report.reason.to_string();
    assert!(reason.contains("the pose jumped by"), "{reason}");
    let rest = vehicle.comes_to_rest().await;
    sleep(Duration::from_secs(60)).await;
    assert_eq!(vehicle.wheels().await, rest, "not by itself");
    let mission = report.mission;
    planner.deliver(&ContinueMission { mission }).await.unwrap();
    until_stage(&vehicle, Stage::ARRIVED).await;
    vehicle.end().await;
}

#[tokio::test(start_paused = true)]
async fn a_driver_that_dies_or_a_pose_that_is_lost_stops_a_mission_for_good() {
    for part in [VECTOR, POSE] {
        let (mut vehicle, planner) = driving("restarts").await;
        vehicle.kill(part).await;
        sleep(Duration::from_secs(1)).await;
        vehicle.start_part(part);
        let report = until_stage(&vehicle, Stage::WAITING).await;
        assert!(!report.reason.is_empty());
        let rest = vehicle.comes_to_rest().await;
        sleep(Duration::from_secs(60)).await;
        assert_eq!(vehicle.wheels().await, rest, "{part}: not by itself");
        let mission = report.mission;
        vehicle
            .until("arrival", || async {
                let now = self::mission(&vehicle).await.stage;
                if now == Stage::WAITING {
                    let _ = planner.deliver(&ContinueMission { mission }).await;
                    sleep(Duration::from_secs(1)).await;
                }
                (now == Stage::ARRIVED).then_some(())
            })
            .await;
        vehicle.end().await;
    }
}

#[tokio::test(start_paused = true)]
async fn zones_are_not_moved_from_under_a_driver_by_way_of_the_pose_or_the_store() {
    let vehicle = WholeVehicle::start("zone-moves", None);
    let store = vehicle.lease(STORE).await;
    let zone = keep_out(7, &square((4.0, 0.0), 1.5));
    store.deliver(&zone).await.unwrap();
    store.release().await;
    let driver = vehicle.control(PRIMITIVE, primitive_driver::URN).await;
    sleep(Duration::from_secs(2)).await;
    let push = async |seconds: u32| {
        for _ in 0..seconds * 10 {
            let _ = driver.send(&ahead(100.0));
            sleep(Duration::from_millis(100)).await;
        }
        vehicle.comes_to_rest().await.0
    };
    let edge = push(8).await;
    assert!(
        (1.5..2.3).contains(&edge),
        "{edge:.2} m: the edge is at 2.5 m"
    );
    let stranger = Stranger::new(&vehicle);
    stranger.command(POSE, &pose(-2.0, 0.0, 0.0)).await;
    let delete = DeleteZone {
        zone_id_list: vec![ZoneIdRec {
            zone_id: delete_zone::ZoneId(7),
        }],
    };
    stranger.command(STORE, &delete).await;
    let moved = keep_out(7, &square((40.0, 0.0), 1.5));
    stranger.command(STORE, &moved).await;
    let after = push(5).await;
    assert!(after < edge + 0.1, "{edge:.2} to {after:.2}");
    // A new zone only restricts.
    let query = QueryLocalOperatingZone::default();
    let new = keep_out(8, &square((0.0, 40.0), 1.5));
    stranger.command(STORE, &new).await;
    let zones = vehicle.client.query(STORE, &query).await.unwrap();
    assert_eq!(zones.local_exclusion_zones.len(), 2);
    // The client in control sets the pose: the vehicle is held until control is taken again.
    let sensor = vehicle.lease(POSE).await;
    sensor.deliver(&pose(-2.0, 0.0, 0.0)).await.unwrap();
    let held = push(3).await;
    assert!(held < edge + 0.1, "{edge:.2} to {held:.2}");
    let stage = vehicle
        .until("the reason", || async {
            driver.send(&ahead(100.0)).unwrap();
            let stage = vehicle.stage(PRIMITIVE).await?;
            (!stage.reason.is_empty() && stage.state == StageState::Active).then_some(stage)
        })
        .await;
    assert!(
        stage.reason.contains("the pose jumped by"),
        "{}",
        stage.reason
    );
    driver.release().await;
    sleep(Duration::from_secs(1)).await;
    let again = vehicle.control(PRIMITIVE, primitive_driver::URN).await;
    vehicle
        .until("motion", || async {
            again.send(&ahead(100.0)).ok()?;
            (vehicle.wheels().await.0 > held + 0.5).then_some(())
        })
        .await;
    vehicle.end().await;
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_turns_without_a_command_is_a_failure_with_the_reason() {
    let scene = Scene::new();
    let [left, right] = [(); 2].map(|()| SimulatedMotor::new(MotorConfig::default()));
    let switch = right.fault_switch();
    let hardware = Hardware {
        drives: Drives::Sides {
            left: Box::new(left),
            right: Box::new(right),
        },
        stop: None,
    };
    let running = scene.start(PRIMITIVE, |slot| {
        PrimitiveDriver::default().run_on(hardware, slot)
    });
    let control = scene.control(PRIMITIVE, primitive_driver::URN).await;
    scene
        .until("motion", || async {
            control.send(&ahead(50.0)).unwrap();
            (scene.wheels().await.0 > 0.1).then_some(())
        })
        .await;
    scene.comes_to_rest().await;
    switch.stick(0.3);
    scene
        .until("failure", || async {
            (scene.state(PRIMITIVE).await == Some(State::Failure as u8)).then_some(())
        })
        .await;
    let stage = scene.stage(PRIMITIVE).await.unwrap();
    assert_eq!(stage.state, StageState::Halted);
    let says = "the right drive turns without a command: cut its power";
    assert_eq!(stage.reason, says);
    switch.mend();
    scene
        .until("recovery", || async {
            (scene.state(PRIMITIVE).await == Some(State::Standby as u8)).then_some(())
        })
        .await;
    running.stop().await;
}

#[tokio::test(start_paused = true)]
async fn a_mission_without_wheel_travel_names_the_primitive_driver() {
    let mut vehicle = WholeVehicle::start("no-wheels", None);
    let planner = vehicle.control(PLANNER, mission_planner::URN).await;
    vehicle.here().await;
    vehicle.kill(PRIMITIVE).await;
    sleep(Duration::from_secs(1)).await;
    let go = SetDestination {
        x: 6.0,
        y: 5.0,
        ..SetDestination::default()
    };
    planner.deliver(&go).await.unwrap();
    let report = until_stage(&vehicle, Stage::FAILED).await;
    let reason = report.reason.to_string();
    assert!(reason.contains("no wheel travel"), "{reason}");
    vehicle.end().await;
}
