//! Navigation with satellites: a receiver on a serial line, and a vehicle that drives to a waypoint
//! on the globe by a fused pose.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with sockets"
)]

use std::fs::File;
use std::io::Write;
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Control, State};
use jaus::messages::mobility::{
    QueryGlobalPose, ReportGlobalPose, SetGlobalVector, SetGlobalWaypoint, SetTravelSpeed,
    global_waypoint_driver, local_operating_zone,
};
use jaus::node::now;
use jaus_test_kit::waiting::within_limit;
use jaus_vehicle::ground::StageState;
use jaus_vehicle::messages::ground::QueryWheelOdometry;
use jaus_vehicle::motion::{Ackermann, DeadReckoning, Frame, Pose, WheelCount};
use jaus_vehicle::navigation::{NavigatorConfig, SimulatedReceiver};
use jaus_vehicle::parts::{
    GlobalDriver, GlobalPoseSensor, KnowledgeStore, NavigationInputs, Part, PartError, PoseSensor,
    PrimitiveDriver, SteeringGear, VelocitySensor,
};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use tokio::sync::{mpsc, oneshot, watch};

use crate::mission::zones::{keep_out, square};
use crate::scene::{POSE, PRIMITIVE, Running, STORE, Scene, VELOCITY};

const GLOBAL_POSE: JausId = JausId::new(101, 43, 43);
const DRIVER: JausId = JausId::new(101, 46, 46);

fn here() -> Frame {
    Frame::at(52.5, 13.4)
}

async fn pose(scene: &Scene) -> Option<ReportGlobalPose> {
    scene
        .client
        .query(GLOBAL_POSE, &QueryGlobalPose::all())
        .await
        .ok()
}

// In real time, as the serial line is.
#[cfg(feature = "serial")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_receiver_on_a_serial_line_gives_a_position_that_does_not_outlive_its_fix() {
    let scene = Scene::new();
    let end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
    grantpt(&end).unwrap();
    unlockpt(&end).unwrap();
    let device = ptsname(&end, Vec::new()).unwrap();
    let mut line = File::from(end);
    let sensor = GlobalPoseSensor {
        receiver: device.into_string().unwrap(),
        ..GlobalPoseSensor::default()
    };
    let running = scene.start(GLOBAL_POSE, |slot| sensor.run(slot));
    let place = here().to_global(&Pose::default());
    let mut simulated = SimulatedReceiver::default();
    // Between good sentences: noise, half a sentence, a wrong checksum, no fix.
    let mut good = move || {
        let now = now();
        let good = simulated.fix(now, &place, None);
        let wrong = good.replace("5230", "5231");
        let no_fix = simulated.no_fix(now);
        format!("\u{fffd}{}{wrong}{no_fix}{good}", &good[..25])
    };
    let report = scene.until("a position", || {
        line.write_all(good().as_bytes()).unwrap();
        async { pose(&scene).await.filter(|it| it.latitude.is_some()) }
    });
    let report = report.await;
    assert!((report.latitude_deg().unwrap() - 52.5).abs() < 1e-6);
    assert!((report.longitude_deg().unwrap() - 13.4).abs() < 1e-6);
    assert!(report.altitude_m().unwrap().abs() < 0.1);
    assert!((0.001..0.1).contains(&report.position_rms_m().unwrap()));
    assert!(report.yaw.is_none(), "unknown before it has moved");
    // The receiver repeats its last fix: it has stopped measuring.
    let frozen = good();
    scene
        .until("no position", || {
            line.write_all(frozen.as_bytes()).unwrap();
            async { pose(&scene).await.filter(|it| it.latitude.is_none()) }
        })
        .await;
    scene
        .until("a position again", || {
            line.write_all(good().as_bytes()).unwrap();
            async { pose(&scene).await.filter(|it| it.latitude.is_some()) }
        })
        .await;
    running.stop().await;
}

#[tokio::test(start_paused = true)]
async fn the_end_of_an_input_ends_the_sensor() {
    for (name, has_receiver) in [("gyroscope", true), ("GNSS receiver", false)] {
        let scene = Scene::new();
        let (octets, receiver) = mpsc::channel(1);
        let (rates, gyro) = watch::channel(None);
        let inputs = NavigationInputs {
            receiver,
            gyro: Some(gyro),
        };
        let octets = has_receiver.then_some(octets);
        let rates = (!has_receiver).then_some(rates);
        let (tell, end) = oneshot::channel();
        let running = scene.start(GLOBAL_POSE, |slot| async move {
            let Err(error) = GlobalPoseSensor::default().run_on(inputs, slot).await;
            tell.send(error.to_string()).unwrap();
            Err(PartError::ShutDown)
        });
        let why = within_limit(end).await.unwrap();
        assert_eq!(why, format!("the {name}'s input has ended"));
        drop((octets, rates));
        running.stop().await;
    }
}

/// The satellites over a simulated vehicle: its true pose follows from its wheels.
struct Sky {
    octets: mpsc::Sender<Vec<u8>>,
    reckoning: DeadReckoning,
    /// Error to the east in metres.
    offset: watch::Receiver<f64>,
    truth: watch::Sender<Pose>,
}

impl Sky {
    async fn shine(mut self, scene: &Scene) {
        let mut simulated = SimulatedReceiver::default();
        loop {
            tokio::time::sleep(Duration::from_millis(100)).await;
            let Ok(report) = scene.client.query(PRIMITIVE, &QueryWheelOdometry {}).await else {
                continue;
            };
            self.reckoning.handle_count(WheelCount::from(&report));
            let truth = self.reckoning.pose();
            self.truth.send_replace(truth);
            let seen = Pose::at(truth.x, truth.y + *self.offset.borrow());
            let sentence = simulated.fix(now(), &here().to_global(&seen), None);
            if self.octets.send(sentence.into_bytes()).await.is_err() {
                return;
            }
        }
    }
}

/// A vehicle that is driven on the globe: its parts, the satellites, and what they see and know.
struct Globe {
    running: Vec<Running>,
    sky: Sky,
    /// Error of the positions to the east in metres.
    offset: watch::Sender<f64>,
    /// The true pose.
    place: watch::Receiver<Pose>,
}

impl Globe {
    fn start(scene: &Scene, start: Pose, geometry: Option<Ackermann>) -> Self {
        let gear = geometry.map(SteeringGear::simulated);
        let wheels = PrimitiveDriver::default().steering(gear);
        let (octets, receiver) = mpsc::channel(16);
        let inputs = NavigationInputs {
            receiver,
            gyro: None,
        };
        let sensor = GlobalPoseSensor {
            navigator: NavigatorConfig {
                heading: Some(start.yaw),
                ..NavigatorConfig::default()
            },
            ..GlobalPoseSensor::default()
        };
        let radius = geometry.map_or(0.0, |it| it.turning_radius());
        let driver = GlobalDriver::default().turning_radius(radius);
        let running = vec![
            scene.start(PRIMITIVE, |slot| wheels.run(slot)),
            scene.start(VELOCITY, |slot| VelocitySensor::default().run(slot)),
            scene.start(GLOBAL_POSE, |slot| sensor.run_on(inputs, slot)),
            scene.start(DRIVER, |slot| driver.run(slot)),
        ];
        let (offset, offset_receiver) = watch::channel(0.0);
        let (truth, place) = watch::channel(start);
        let sky = Sky {
            octets,
            reckoning: DeadReckoning::at(start),
            offset: offset_receiver,
            truth,
        };
        Self {
            running,
            sky,
            offset,
            place,
        }
    }
}

/// Sends the vehicle to a place in metres north and east.
async fn set_out(control: &Control, (north, east): (f64, f64)) {
    let to = here().to_global(&Pose::at(north, east));
    let mut waypoint = SetGlobalWaypoint::default();
    waypoint.set_latitude_deg(to.latitude).unwrap();
    waypoint.set_longitude_deg(to.longitude).unwrap();
    let mut speed = SetTravelSpeed::default();
    speed.set_speed_m_per_s(1.0).unwrap();
    let _ = control.deliver(&waypoint).await;
    let _ = control.deliver(&speed).await;
    tokio::time::sleep(Duration::from_millis(500)).await;
}

fn north() -> SetGlobalVector {
    let mut vector = SetGlobalVector::default();
    vector.set_speed_m_per_s(1.0).unwrap();
    vector.set_heading_rad(0.0).unwrap();
    vector
}

#[tokio::test(start_paused = true)]
async fn a_vehicle_drives_to_a_waypoint_on_the_globe_and_stops_when_its_position_jumps() {
    for geometry in [None, Some(Ackermann::default())] {
        let scene = Scene::new();
        let start = Pose {
            yaw: 1.0,
            ..Pose::default()
        };
        let globe = Globe::start(&scene, start, geometry);
        let place = &globe.place;
        let drive = async {
            let control = scene.control(DRIVER, global_waypoint_driver::URN).await;
            scene
                .until("the waypoint", || async {
                    let is_there = place.borrow().distance(-4.0, 3.0) < 0.8;
                    // Before the first position, the waypoint is out of reach.
                    if !is_there && place.borrow().distance(0.0, 0.0) < 0.1 {
                        set_out(&control, (-4.0, 3.0)).await;
                    }
                    is_there.then_some(())
                })
                .await;
            let before = place.borrow().x;
            scene
                .until("driving north", || async {
                    let _ = control.send(&north());
                    (place.borrow().x > before + 2.0).then_some(())
                })
                .await;
            // The receiver is deceived, or sees reflections: nobody knows which position is right.
            globe.offset.send_replace(40.0);
            scene
                .until_state(DRIVER, State::Failure, &control, &north())
                .await;
            scene.comes_to_rest().await;
        };
        tokio::select! {
            () = drive => {}
            () = globe.sky.shine(&scene) => panic!("the sensor has ended"),
        }
        for part in globe.running {
            part.stop().await;
        }
    }
}

#[tokio::test(start_paused = true)]
async fn on_the_globe_it_stops_before_a_zone_also_when_the_store_is_dead() {
    let scene = Scene::new();
    let globe = Globe::start(&scene, Pose::default(), None);
    let file = std::env::temp_dir().join(format!("jaus-globe-{}.redb", std::process::id()));
    let _ = std::fs::remove_file(&file);
    let knowledge = KnowledgeStore {
        file: file.clone(),
        ..KnowledgeStore::default()
    };
    let store = scene.start(STORE, |slot| knowledge.run(slot));
    let pose = scene.start(POSE, |slot| PoseSensor::default().run(slot));
    let place = &globe.place;
    let drive = async {
        let zones = scene
            .until("control of the store", || async {
                scene.client.find(local_operating_zone::URN).await.ok()?;
                scene.client.control(STORE, 200).await.ok()
            })
            .await;
        zones
            .deliver(&keep_out(7, &square((4.0, 0.0), 1.5)))
            .await
            .unwrap();
        let control = scene.control(DRIVER, global_waypoint_driver::URN).await;
        let held = || async {
            let stage = scene.stage(DRIVER).await?;
            let is_held = stage.state == StageState::Blocked;
            (is_held && stage.reason.starts_with("keep-out zone 7 is")).then_some(())
        };
        scene
            .until("a stop before the zone", || async {
                if place.borrow().distance(0.0, 0.0) < 0.1 {
                    set_out(&control, (8.0, 0.0)).await;
                }
                held().await
            })
            .await;
        store.stop().await;
        for _ in 0..60 {
            let _ = control.send(&north());
            tokio::time::sleep(Duration::from_millis(50)).await;
            assert!(place.borrow().x < 2.3, "in the zone: {:?}", place.borrow());
        }
        scene.until("the same reason", held).await;
    };
    tokio::select! {
        () = drive => {}
        () = globe.sky.shine(&scene) => panic!("the sensor has ended"),
    }
    for part in globe.running.into_iter().chain([pose]) {
        part.stop().await;
    }
    std::fs::remove_file(&file).unwrap();
}
