//! An inertial measurement unit in a directory of files: its faults, and its place beside the
//! velocity sensor of the wheels.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with sockets"
)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use jaus::address::JausId;
use jaus::messages::mobility::{
    QueryAccelerationState, QueryGlobalPose, QueryVelocityState, SetLocalVector,
    local_vector_driver,
};
use jaus::node::now;
use jaus_vehicle::motion::{Frame, Pose};
use jaus_vehicle::navigation::{NavigatorConfig, SimulatedReceiver};
use jaus_vehicle::parts::{
    GlobalPoseSensor, Gyro, IioDevice, ImuSensor, NavigationInputs, Part, PoseSensor,
    PrimitiveDriver, VectorDriver, VelocitySensor,
};
use tokio::sync::mpsc;

use crate::scene::{POSE, PRIMITIVE, Running, Scene, VECTOR, VELOCITY};

const IMU: JausId = JausId::new(101, 52, 52);
const GLOBAL_POSE: JausId = JausId::new(101, 43, 43);
const YAW: &str = "in_anglvel_z_raw";
const SOUND: &str = "100";

/// A device that measures a left turn of about 0.1 rad/s, with noise, and gravity alone.
struct Device {
    directory: PathBuf,
    noise: tokio::task::JoinHandle<()>,
}

impl Device {
    fn new(name: &str) -> Self {
        let name = format!("jaus-imu-{name}-{}", std::process::id());
        let directory = std::env::temp_dir().join(name);
        fs::create_dir_all(&directory).unwrap();
        for (file, text) in [
            ("in_anglvel_scale", "0.001"),
            ("in_accel_scale", "0.01"),
            ("in_accel_x_raw", "0"),
            ("in_accel_y_raw", "0"),
            ("in_accel_z_raw", "981"),
            (YAW, SOUND),
        ] {
            set(&directory, file, text);
        }
        let noise = make_noise(&directory);
        Self { directory, noise }
    }

    fn start(&self, scene: &Scene) -> Running {
        let sensor = ImuSensor {
            device: IioDevice {
                directory: self.directory.clone(),
                inverted: false,
            },
            ..ImuSensor::default()
        };
        scene.start(IMU, |slot| sensor.run(slot))
    }

    /// The device measures no more, as the fault says.
    async fn fail(&mut self, fault: Fault) {
        self.noise.abort();
        let _ = (&mut self.noise).await;
        match fault {
            Fault::Frozen => {}
            Fault::Writes(text) => set(&self.directory, YAW, text),
            Fault::Hangs => {
                fs::remove_file(self.directory.join(YAW)).unwrap();
                let made = Command::new("mkfifo")
                    .arg(self.directory.join(YAW))
                    .status();
                assert!(made.unwrap().success());
            }
        }
    }

    async fn mend(&mut self, fault: Fault) {
        if matches!(fault, Fault::Hangs) {
            // Ends the read that hangs.
            let pipe = self.directory.join(YAW);
            let written = tokio::task::spawn_blocking(|| fs::write(pipe, SOUND));
            written.await.unwrap().unwrap();
        }
        self.noise = make_noise(&self.directory);
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.noise.abort();
        let _ = fs::remove_dir_all(&self.directory);
    }
}

#[derive(Debug, Clone, Copy)]
enum Fault {
    Frozen,
    Writes(&'static str),
    Hangs,
}

/// Replaces a file at once, as a device does.
fn set(directory: &Path, file: &str, text: &str) {
    let new = directory.join(format!("{file}.new"));
    fs::write(&new, text).unwrap();
    fs::rename(new, directory.join(file)).unwrap();
}

/// Changes all readings a little, again and again.
fn make_noise(directory: &Path) -> tokio::task::JoinHandle<()> {
    let directory = directory.to_owned();
    tokio::spawn(async move {
        for last in (0..=9).cycle() {
            set(&directory, YAW, &format!("10{last}"));
            set(&directory, "in_accel_x_raw", &last.to_string());
            set(&directory, "in_accel_y_raw", &last.to_string());
            set(&directory, "in_accel_z_raw", &format!("98{last}"));
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    })
}

/// The yaw rate and the downward acceleration.
async fn measured(scene: &Scene) -> (Option<f64>, Option<f64>) {
    let velocity = scene.client.query(IMU, &QueryVelocityState::all()).await;
    let acceleration = scene
        .client
        .query(IMU, &QueryAccelerationState::all())
        .await;
    let velocity = velocity.unwrap();
    assert_eq!((velocity.velocity_x, velocity.roll_rate), (None, None));
    // Until the first sample there is no time of one.
    let is_stamped = velocity.time_stamp.is_some();
    assert!(is_stamped || velocity.yaw_rate.is_none());
    let down = acceleration.unwrap().acceleration_z_m_per_s2();
    (velocity.yaw_rate_rad_per_s(), down)
}

async fn until_known(scene: &Scene) {
    let known = scene.until("values", || async {
        let (yaw, down) = measured(scene).await;
        yaw.zip(down)
    });
    let (yaw, down) = known.await;
    assert!((-0.110..=-0.099).contains(&yaw), "{yaw}");
    assert!(down.abs() < 0.1, "{down}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_values_of_a_device_that_does_not_measure_are_unknown_until_it_does() {
    let scene = Scene::new();
    let mut device = Device::new("faults");
    let running = device.start(&scene);
    scene
        .until("the sensor", || async {
            let answer = scene.client.query(IMU, &QueryVelocityState::all()).await;
            answer.ok()
        })
        .await;
    until_known(&scene).await;
    for fault in [
        Fault::Frozen,
        Fault::Writes("nan"),
        Fault::Writes("99999"),
        Fault::Writes(""),
        Fault::Hangs,
    ] {
        device.fail(fault).await;
        scene
            .until(&format!("no values, {fault:?}"), || async {
                (measured(&scene).await == (None, None)).then_some(())
            })
            .await;
        device.mend(fault).await;
        until_known(&scene).await;
    }
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_driver_does_not_take_the_imu_for_the_sensor_of_its_speed() {
    let scene = Scene::new();
    let device = Device::new("beside");
    let imu = device.start(&scene);
    let wheels = scene.start(PRIMITIVE, |slot| PrimitiveDriver::default().run(slot));
    let pose = scene.start(POSE, |slot| PoseSensor::default().run(slot));
    let driver = scene.start(VECTOR, |slot| VectorDriver::default().run(slot));
    let control = scene.control(VECTOR, local_vector_driver::URN).await;
    // The IMU reports long before the wheels do.
    until_known(&scene).await;
    let velocity = scene.start(VELOCITY, |slot| VelocitySensor::default().run(slot));
    let mut vector = SetLocalVector::default();
    vector.set_speed_m_per_s(0.5).unwrap();
    scene
        .until("motion", || async {
            let _ = control.send(&vector);
            let _ = control.resume().await;
            (scene.wheels().await.0 > 0.2).then_some(())
        })
        .await;
    for part in [imu, wheels, pose, driver, velocity] {
        part.stop().await;
    }
}

/// The receiver of a vehicle at rest.
async fn receive(octets: mpsc::Sender<Vec<u8>>) {
    let mut simulated = SimulatedReceiver::default();
    let place = Frame::at(52.5, 13.4).to_global(&Pose::default());
    loop {
        let sentence = simulated.fix(now(), &place, None);
        if octets.send(sentence.into_bytes()).await.is_err() {
            return;
        }
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
}

async fn heading(scene: &Scene) -> Option<f64> {
    let query = QueryGlobalPose::all();
    let report = scene.client.query(GLOBAL_POSE, &query).await.ok()?;
    report.yaw_rad()
}

/// Waits until the heading turns left by 0.05 rad.
async fn turns(scene: &Scene) {
    let before = scene.until("a heading", || heading(scene)).await;
    scene
        .until("a left turn", || async {
            (heading(scene).await? < before - 0.05).then_some(())
        })
        .await;
}

/// Waits until the heading is the same for a second.
async fn does_not_turn(scene: &Scene) {
    scene
        .until("the same heading", || async {
            let before = heading(scene).await?;
            tokio::time::sleep(Duration::from_secs(1)).await;
            let after = heading(scene).await?;
            ((after - before).abs() < 0.001).then_some(())
        })
        .await;
}

// In real time, as the device is.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_imu_component_turns_the_heading_while_it_measures() {
    let scene = Scene::new();
    let mut device = Device::new("fused");
    let (octets, receiver) = mpsc::channel(16);
    let sensor = GlobalPoseSensor {
        gyro: Some(Gyro::Component),
        navigator: NavigatorConfig {
            heading: Some(0.0),
            ..NavigatorConfig::default()
        },
        ..GlobalPoseSensor::default()
    };
    let inputs = NavigationInputs {
        receiver,
        gyro: None,
    };
    let pose = scene.start(GLOBAL_POSE, |slot| sensor.run_on(inputs, slot));
    let receiving = tokio::spawn(receive(octets));
    does_not_turn(&scene).await;
    let imu = device.start(&scene);
    turns(&scene).await;
    for fault in [Fault::Frozen, Fault::Writes("nan")] {
        device.fail(fault).await;
        does_not_turn(&scene).await;
        device.mend(fault).await;
        turns(&scene).await;
    }
    imu.stop().await;
    does_not_turn(&scene).await;
    let imu = device.start(&scene);
    turns(&scene).await;
    receiving.abort();
    for part in [imu, pose] {
        part.stop().await;
    }
}
