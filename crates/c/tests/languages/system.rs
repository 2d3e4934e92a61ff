//! Sensor, driver and operator, each in C++ and in Rust.

use jaus::component::{Update, When};
use jaus::messages::mobility::{QueryVelocityState, velocity_state_sensor};
use jaus::node::{Address, Config};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::within_limit;
use tokio::task::spawn_blocking;

use super::compiler::{has_compilers, start};
use super::scene::{Scene, keep_driving};

/// Several threads: the test waits for lines of programs, too.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_operator_in_cpp_hears_a_sensor_and_drives_a_driver_in_rust() {
    if !has_compilers() {
        return;
    }
    let scene = Scene::new();
    let (_sensor, (driver, _)) = (scene.sensor(), scene.driver());
    let group = scene.group.clone();
    let operator = spawn_blocking(move || {
        let mut operator = start("examples/operator.cpp", &["43", &group]);
        operator.expect("1.5");
        operator.expect("done");
        operator.end()
    });
    let mut standings = driver.watch_standing();
    let ready = standings.wait_for(|it| it.controller.is_some());
    let controller = within_limit(ready).await.unwrap().controller.unwrap();
    assert_eq!(controller.id.subsystem(), 43);
    assert!(within_limit(operator).await.unwrap().success());
    let released = standings.wait_for(|it| it.controller.is_none());
    within_limit(released).await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_operator_in_rust_hears_a_sensor_and_drives_a_driver_in_cpp() {
    if !has_compilers() {
        return;
    }
    let scene = Scene::new();
    let _sensor = start("examples/sensor.cpp", &["101", &scene.group]);
    let driver = start("examples/driver.cpp", &["102", &scene.group]);
    hears_and_drives(&scene, driver).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn components_in_cpp_attach_to_the_node_of_the_host() {
    if !has_compilers() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("node.sock");
    let group = own_group();
    let config = Config::loopback(101, 1)
        .group(group)
        .local(Address::Path(socket.clone()));
    let scene = Scene::on(config, group);
    let attach = ["--attach", socket.to_str().unwrap()];
    let _sensor = start("examples/sensor.cpp", &attach);
    let driver = start("examples/driver.cpp", &attach);
    hears_and_drives(&scene, driver).await;
}

async fn hears_and_drives(scene: &Scene, mut driver: jaus_test_kit::example::Example) {
    let sensor = scene.find(velocity_state_sensor::URN).await;
    let query = QueryVelocityState::all();
    let report = within_limit(scene.operator.query(sensor, &query)).await;
    assert!(report.unwrap().velocity_x_m_per_s().is_some());
    let speeds = scene.operator.subscribe(sensor, &query, When::OnChange);
    let mut speeds = within_limit(speeds).await.unwrap();
    assert_eq!(within_limit(speeds.next()).await, Some(Update::Up));
    for _ in 0..3 {
        assert!(within_limit(speeds.report()).await.is_some());
    }
    let control = scene.control().await;
    let moving = spawn_blocking(move || {
        driver.expect_line("an effort of 40 %", |line| {
            line.starts_with("motor 40") || line.starts_with("motor 39.9")
        });
        driver
    });
    let driver = tokio::select! {
        driver = moving => driver.unwrap(),
        () = keep_driving(&control, 40.0) => panic!("control is lost"),
    };
    within_limit(control.standby()).await.unwrap();
    let stopped = spawn_blocking(move || {
        let mut driver = driver;
        driver.expect_line("no effort", |line| line == "motor 0");
    });
    within_limit(stopped).await.unwrap();
}

#[test]
fn sensor_driver_and_operator_in_cpp_work_together() {
    if !has_compilers() {
        return;
    }
    let group = own_group().to_string();
    let _sensor = start("examples/sensor.cpp", &["101", &group]);
    let mut driver = start("examples/driver.cpp", &["102", &group]);
    let mut operator = start("examples/operator.cpp", &["42", &group]);
    operator.expect("m/s");
    driver.expect_line("an effort", |line| {
        line.starts_with("motor 40") || line.starts_with("motor 39.9")
    });
    operator.expect("done");
    driver.expect_line("no effort", |line| line == "motor 0");
}
