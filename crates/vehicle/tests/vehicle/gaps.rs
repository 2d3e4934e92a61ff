//! Sensors that pause, or restart elsewhere, and a store that restarts: a short pause is no fault, a
//! longer one stops a mission for good, and no restart sets a vehicle free.
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test with sockets"
)]

use std::convert::Infallible;
use std::pin::pin;
use std::time::Duration;

use jaus::address::JausId;
use jaus::messages::mobility::primitive_driver;
use jaus_vehicle::messages::ground::report_mission::Stage;
use jaus_vehicle::motion::Pose;
use jaus_vehicle::parts::{Part, PartError, PoseSensor, Slot, VelocitySensor};
use tokio::sync::watch;
use tokio::time::sleep;

use crate::beliefs::{ahead, driving, mission, set_out, until_stage};
use crate::mission::zones::{keep_out, square};
use crate::scene::{POSE, PRIMITIVE, STORE, VELOCITY};
use crate::whole_vehicle::WholeVehicle;

/// A part that measures nothing while it is suspended. Its component goes on answering.
struct Suspendable<P> {
    part: P,
    suspended: watch::Receiver<bool>,
}

impl<P: Part> Part for Suspendable<P> {
    async fn run(mut self, slot: Slot) -> Result<Infallible, PartError> {
        let mut run = pin!(self.part.run(slot));
        loop {
            let _ = self.suspended.wait_for(|it| !it).await;
            tokio::select! {
                biased;
                _ = self.suspended.wait_for(|it| *it) => {}
                end = &mut run => return end,
            }
        }
    }
}

/// A vehicle on its mission, one of whose sensors can be suspended.
async fn driving_by(name: &str, sensor: JausId) -> (WholeVehicle, watch::Sender<bool>) {
    let mut vehicle = WholeVehicle::start(name, None);
    let (suspend, suspended) = watch::channel(false);
    vehicle.kill(sensor).await;
    match sensor {
        POSE => {
            let part = PoseSensor::default();
            vehicle.run(sensor, Suspendable { part, suspended });
        }
        _ => {
            let part = VelocitySensor::default();
            vehicle.run(sensor, Suspendable { part, suspended });
        }
    }
    (vehicle, suspend)
}

#[tokio::test(start_paused = true)]
async fn a_gap_of_samples_under_half_a_second_is_no_fault_and_a_longer_one_stops_the_mission() {
    for (sensor, millis, is_fault) in [
        (POSE, 400, false),
        (POSE, 700, true),
        (VELOCITY, 400, false),
        (VELOCITY, 700, true),
    ] {
        let (vehicle, suspend) = driving_by("gap", sensor).await;
        let planner = set_out(&vehicle).await;
        let before = mission(&vehicle).await.attempt;
        suspend.send_replace(true);
        sleep(Duration::from_millis(millis)).await;
        suspend.send_replace(false);
        if is_fault {
            let report = until_stage(&vehicle, Stage::WAITING).await;
            assert!(!report.reason.is_empty());
            let rest = vehicle.comes_to_rest().await;
            sleep(Duration::from_secs(30)).await;
            assert_eq!(vehicle.wheels().await, rest, "{sensor}: not by itself");
        } else {
            let report = until_stage(&vehicle, Stage::ARRIVED).await;
            assert_eq!(report.attempt, before, "{sensor}: without a stop");
        }
        drop(planner);
        vehicle.end().await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_pose_sensor_that_restarts_elsewhere_at_once_stops_the_mission() {
    let (mut vehicle, _planner) = driving("restart-elsewhere").await;
    let (x, y) = vehicle.here().await;
    let before = vehicle.wheels().await;
    vehicle.kill(POSE).await;
    // Farther than it could have driven meanwhile, with the reserve of the check.
    let elsewhere = PoseSensor {
        start: Pose::at(x, y - 4.0),
        ..PoseSensor::default()
    };
    vehicle.run(POSE, elsewhere);
    until_stage(&vehicle, Stage::WAITING).await;
    let rest = vehicle.comes_to_rest().await;
    assert!(rest.0 - before.0 < 1.5, "{:.2} m", rest.0 - before.0);
    sleep(Duration::from_secs(30)).await;
    assert_eq!(vehicle.wheels().await, rest, "not by itself");
    vehicle.end().await;
}

#[tokio::test(start_paused = true)]
async fn a_store_that_restarts_sets_no_vehicle_free() {
    let mut vehicle = WholeVehicle::start("store-restarts", None);
    let store = vehicle.lease(STORE).await;
    let zone = keep_out(7, &square((4.0, 0.0), 1.5));
    store.deliver(&zone).await.unwrap();
    store.release().await;
    let driver = vehicle.control(PRIMITIVE, primitive_driver::URN).await;
    sleep(Duration::from_secs(2)).await;
    let push = async |tenths: u32| {
        for _ in 0..tenths {
            let _ = driver.send(&ahead(100.0));
            sleep(Duration::from_millis(100)).await;
        }
    };
    push(80).await;
    let edge = vehicle.wheels().await.0;
    assert!((1.5..2.3).contains(&edge), "{edge:.2} m");
    vehicle.restart(STORE).await;
    push(50).await;
    let after = vehicle.wheels().await.0;
    assert!(after < edge + 0.1, "{edge:.2} to {after:.2}");
    vehicle.end().await;
}
