//! Faults of motors, sensors and disks below the ready components: what stops, what is reported,
//! and how operation resumes.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with sockets"
)]

use std::time::{Duration, Instant};

use jaus::component::State;
use jaus::messages::core::Shutdown;
use jaus::messages::mobility::report_local_pose::TimeStamp;
use jaus::messages::mobility::{
    QueryLocalPose, SetLocalVector, SetWrenchEffort, local_vector_driver, primitive_driver,
};
use jaus_test_kit::waiting::LIMIT;
use jaus_vehicle::actuator::{
    Actuator, MotorConfig, SimulatedMotor, SimulatedServo, SimulatedStop,
};
use jaus_vehicle::ground::StageState;
use jaus_vehicle::messages::ground::QueryWheelOdometry;
use jaus_vehicle::motion::Ackermann;
use jaus_vehicle::parts::VelocitySensor;
use jaus_vehicle::parts::{Drives, Hardware, Part, PoseSensor, PrimitiveDriver, VectorDriver};

use crate::scene::{POSE, PRIMITIVE, Running, Scene, VECTOR, VELOCITY};

fn ahead() -> SetWrenchEffort {
    let mut effort = SetWrenchEffort::default();
    effort.set_propulsive_linear_effort_x_percent(50.0).unwrap();
    effort
}

#[tokio::test(start_paused = true)]
async fn a_motor_fault_stops_both_sides_and_is_a_failure_until_it_is_gone() {
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
    let moved = scene.until("motion", || async {
        control.send(&ahead()).unwrap();
        (scene.wheels().await.0 > 0.1).then_some(())
    });
    moved.await;
    switch.fail("no current");
    scene
        .until_state(PRIMITIVE, State::Failure, &control, &ahead())
        .await;
    scene
        .until("the reason", || async {
            let stage = scene.stage(PRIMITIVE).await?;
            let is_told = stage.state == StageState::Halted && stage.reason == "no current";
            is_told.then_some(())
        })
        .await;
    let before = scene.comes_to_rest().await;
    switch.mend();
    scene
        .until("recovery", || async {
            (scene.state(PRIMITIVE).await == Some(State::Standby as u8)).then_some(())
        })
        .await;
    drop(control);
    let again = scene.control(PRIMITIVE, primitive_driver::URN).await;
    assert_eq!(scene.wheels().await, before, "not without a new command");
    scene
        .until("motion again", || async {
            again.send(&ahead()).unwrap();
            (scene.wheels().await.0 > before.0 + 0.1).then_some(())
        })
        .await;
    running.stop().await;
}

#[tokio::test(start_paused = true)]
async fn a_sensor_that_stays_away_is_a_failure_of_the_driver_until_it_is_back() {
    let scene = Scene::new();
    let wheels = scene.start(PRIMITIVE, |slot| PrimitiveDriver::default().run(slot));
    let pose = scene.start(POSE, |slot| PoseSensor::default().run(slot));
    let velocity = scene.start(VELOCITY, |slot| VelocitySensor::default().run(slot));
    let driver = scene.start(VECTOR, |slot| VectorDriver::default().run(slot));
    let control = scene.control(VECTOR, local_vector_driver::URN).await;
    let mut vector = SetLocalVector::default();
    vector.set_speed_m_per_s(0.5).unwrap();
    scene
        .until("motion", || async {
            control.send(&vector).unwrap();
            let query = QueryWheelOdometry {};
            let report = scene.client.query(PRIMITIVE, &query).await.ok();
            report.filter(|wheels| wheels.left > 0.2)
        })
        .await;
    pose.stop().await;
    scene
        .until_state(VECTOR, State::Failure, &control, &vector)
        .await;
    let stage = scene
        .until("the reason", || async {
            let stage = scene.stage(VECTOR).await?;
            stage.reason.starts_with("failure: ").then_some(stage)
        })
        .await;
    assert_eq!(stage.state, StageState::Blocked);
    assert!(stage.reason.contains("pose"), "{}", stage.reason);
    scene.comes_to_rest().await;
    let pose = scene.start(POSE, |slot| PoseSensor::default().run(slot));
    scene
        .until("recovery", || async {
            (scene.state(VECTOR).await == Some(State::Standby as u8)).then_some(())
        })
        .await;
    for part in [wheels, pose, velocity, driver] {
        part.stop().await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_fault_of_the_steering_stops_the_drive_and_is_a_failure() {
    let scene = Scene::new();
    let servo = SimulatedServo::new(SimulatedServo::RATE);
    let switch = servo.fault_switch();
    let hardware = Hardware {
        drives: Drives::Steered {
            drive: Box::new(SimulatedMotor::new(MotorConfig::default())),
            steering: Box::new(servo),
            geometry: Ackermann::default(),
        },
        stop: None,
    };
    let running = scene.start(PRIMITIVE, |slot| {
        PrimitiveDriver::default().run_on(hardware, slot)
    });
    let control = scene.control(PRIMITIVE, primitive_driver::URN).await;
    let mut effort = ahead();
    effort
        .set_propulsive_rotational_effort_z_percent(100.0)
        .unwrap();
    scene
        .until("a right turn", || async {
            control.send(&effort).unwrap();
            let (left, right) = scene.wheels().await;
            (left > right + 0.1).then_some(())
        })
        .await;
    switch.fail("no answer from the servo");
    scene
        .until_state(PRIMITIVE, State::Failure, &control, &effort)
        .await;
    let before = scene.comes_to_rest().await;
    switch.mend();
    scene
        .until_state(PRIMITIVE, State::Standby, &control, &effort)
        .await;
    assert_eq!(scene.wheels().await, before, "not without a new lease");
    running.stop().await;
}

// In real time, as the thread that reads the stop input is.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stop_input_is_an_emergency_and_its_release_ends_its_own_alone() {
    let scene = Scene::new();
    let [left, right] = [(); 2].map(|()| {
        let motor = SimulatedMotor::new(MotorConfig::default());
        Box::new(motor) as Box<dyn Actuator>
    });
    let button = SimulatedStop::default();
    let stop = Some(Box::new(button.clone()) as _);
    let drives = Drives::Sides { left, right };
    let hardware = Hardware { drives, stop };
    let running = scene.start(PRIMITIVE, |slot| {
        PrimitiveDriver::default().run_on(hardware, slot)
    });
    let control = scene.control(PRIMITIVE, primitive_driver::URN).await;
    let moves = async |before: f64| {
        scene
            .until("motion", || async {
                let _ = control.send(&ahead());
                (scene.wheels().await.0 > before + 0.1).then_some(())
            })
            .await;
    };
    moves(0.0).await;
    button.press();
    scene
        .until_state(PRIMITIVE, State::Emergency, &control, &ahead())
        .await;
    // A second emergency, of a client.
    scene.client.set_emergency(PRIMITIVE).await.unwrap();
    let before = scene.comes_to_rest().await;
    button.release();
    tokio::time::sleep(Duration::from_millis(300)).await;
    scene
        .until_state(PRIMITIVE, State::Emergency, &control, &ahead())
        .await;
    scene.client.clear_emergency(PRIMITIVE).await.unwrap();
    scene
        .until_state(PRIMITIVE, State::Standby, &control, &ahead())
        .await;
    tokio::time::sleep(Duration::from_millis(300)).await;
    let _ = control.send(&ahead());
    assert_eq!(scene.wheels().await, before, "not before it is resumed");
    control.resume().await.unwrap();
    moves(before.0).await;
    running.stop().await;
}

/// An actuator that stores its last command.
struct Shown(std::sync::Arc<std::sync::Mutex<jaus_vehicle::actuator::Command>>);

impl Actuator for Shown {
    fn handle_time(&mut self, _: Instant) {}

    fn command(&mut self, command: jaus_vehicle::actuator::Command) {
        *self.0.lock().unwrap() = command;
    }

    fn travel(&self) -> f64 {
        0.0
    }
}

#[tokio::test(start_paused = true)]
async fn motors_are_commanded_to_stop_when_the_part_is_stopped() {
    let scene = Scene::new();
    let last = std::sync::Arc::<std::sync::Mutex<jaus_vehicle::actuator::Command>>::default();
    let hardware = Hardware {
        drives: Drives::Sides {
            left: Box::new(Shown(last.clone())),
            right: Box::new(SimulatedMotor::new(MotorConfig::default())),
        },
        stop: None,
    };
    let running = scene.start(PRIMITIVE, |slot| {
        PrimitiveDriver::default().run_on(hardware, slot)
    });
    let control = scene.control(PRIMITIVE, primitive_driver::URN).await;
    scene
        .until("a command", || async {
            control.send(&ahead()).unwrap();
            (last.lock().unwrap().drive > 0.0).then_some(())
        })
        .await;
    running.stop().await;
    scene
        .until("the stop", || async {
            (*last.lock().unwrap() == jaus_vehicle::actuator::Command::STOP).then_some(())
        })
        .await;
}

/// Milliseconds since midnight.
fn milliseconds(stamp: TimeStamp) -> i64 {
    let minutes = i64::from(stamp.hour()) * 60 + i64::from(stamp.minutes());
    (minutes * 60 + i64::from(stamp.seconds())) * 1000 + i64::from(stamp.milliseconds())
}

// In real time, as the disk is.
#[test]
fn a_disk_that_stalls_changes_neither_the_reports_of_the_pose_nor_their_stamps() {
    let mut runtime = tokio::runtime::Builder::new_multi_thread();
    // The one thread for the disk.
    let runtime = runtime.worker_threads(2).max_blocking_threads(1);
    let runtime = runtime.enable_all().build().unwrap();
    runtime.block_on(poses_during_a_stall());
}

async fn poses_during_a_stall() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("pose.toml");
    let scene = Scene::new();
    let sensor = PoseSensor {
        file: Some(file.clone()),
        ..PoseSensor::default()
    };
    let pose = scene.start(POSE, |slot| sensor.run(slot));
    scene
        .until("the sensor, which has looked for its file", || async {
            let query = QueryLocalPose::none().with_x();
            scene.client.query(POSE, &query).await.ok()
        })
        .await;
    let (release, stall) = std::sync::mpsc::channel::<()>();
    let disk = tokio::task::spawn_blocking(move || stall.recv());
    // Its first count is what the sensor writes first.
    let wheels = scene.start(PRIMITIVE, |slot| PrimitiveDriver::default().run(slot));
    let ask = async || {
        let query = QueryLocalPose::none().with_x().with_y().with_time_stamp();
        let report = scene.client.query(POSE, &query).await.ok();
        let report = report?;
        report.x_m()?;
        Some(milliseconds(report.time_stamp?))
    };
    let first = scene.until("a pose", &ask).await;
    scene
        .until("stamps that advance by 3 s", || async {
            let stamped = ask().await? - first;
            // Time stamps restart at midnight.
            (!(0..=3000).contains(&stamped)).then_some(())
        })
        .await;
    assert!(!file.exists(), "the disk did stall");
    drop(release);
    scene
        .until("the file", || async { file.exists().then_some(()) })
        .await;
    disk.await.unwrap().unwrap_err();
    pose.stop().await;
    wheels.stop().await;
}

#[tokio::test(start_paused = true)]
async fn a_part_ends_when_the_client_in_control_shuts_it_down() {
    let scene = Scene::new();
    let running = scene.start(PRIMITIVE, |slot| PrimitiveDriver::default().run(slot));
    let control = scene.control(PRIMITIVE, primitive_driver::URN).await;
    control.send(&Shutdown {}).unwrap();
    let Running(_node, task) = running;
    let ended = tokio::time::timeout(LIMIT, task).await;
    assert!(ended.expect("it ends").is_ok());
}
