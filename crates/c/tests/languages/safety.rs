//! A driver or an operator in C++ that dies or hangs does not keep a vehicle moving.

use std::time::Duration;

use jaus::component::QueryError;
use jaus::component::State;
use jaus::messages::core::QueryStatus;
use jaus_test_kit::example::Example;
use jaus_test_kit::waiting::within_limit;
use tokio::task::spawn_blocking;

use super::compiler::{has_compilers, start};
use super::scene::{Scene, effort, keep_driving};

/// Waits for a line of a program, on another thread.
async fn expect(mut program: Example, line: &'static str) -> Example {
    let seen = spawn_blocking(move || {
        program.expect_line(line, |it| it.starts_with(line));
        program
    });
    within_limit(seen).await.unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_driver_whose_callback_hangs_is_stopped_and_does_not_look_alive() {
    if !has_compilers() {
        return;
    }
    let scene = Scene::new();
    let driver = start(
        "tests/programs/hung_driver.cpp",
        &["102", &scene.group, "callback"],
    );
    let mut control = scene.control().await;
    // The command lasts until it is done: only the watch over the callback stops it.
    control.send(&effort(60.0)).unwrap();
    let driver = expect(driver, "hung").await;
    let _driver = expect(driver, "stop").await;
    let status = within_limit(scene.operator.query(control.peer(), &QueryStatus {})).await;
    assert!(
        matches!(status, Err(QueryError::NoAnswer { .. })),
        "{status:?}"
    );
    within_limit(control.lost()).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_driver_whose_loop_hangs_is_stopped_and_fails_until_it_runs_again() {
    if !has_compilers() {
        return;
    }
    let scene = Scene::new();
    let driver = start(
        "tests/programs/hung_driver.cpp",
        &["102", &scene.group, "loop"],
    );
    let mut control = scene.control().await;
    control.send(&effort(60.0)).unwrap();
    let driver = expect(driver, "hung").await;
    let mut driver = expect(driver, "stop").await;
    within_limit(control.lost()).await;
    let peer = control.peer();
    let status = async || {
        let report = within_limit(scene.operator.query(peer, &QueryStatus {})).await;
        report.unwrap().status.0
    };
    assert_eq!(status().await, State::Failure as u8);
    driver.feed(b"go on\n");
    let _driver = expect(driver, "goes on").await;
    within_limit(async { while status().await != State::Standby as u8 {} }).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_driver_that_was_suspended_stops_before_it_handles_what_waits() {
    if !has_compilers() {
        return;
    }
    let scene = Scene::new();
    let driver = start("examples/driver.cpp", &["102", &scene.group]);
    let mut control = scene.control().await;
    let driver = tokio::select! {
        driver = expect(driver, "motor 4") => driver,
        () = keep_driving(&control, 42.0) => panic!("control is lost"),
    };
    driver.signal("STOP");
    // At least as long as a component may be held up while something moves.
    let suspended = tokio::time::sleep(Duration::from_millis(800));
    tokio::select! {
        () = suspended => {}
        () = keep_driving(&control, 42.0) => {}
    }
    driver.signal("CONT");
    let _driver = tokio::select! {
        driver = expect(driver, "motor 0") => driver,
        () = async { keep_driving(&control, 42.0).await; std::future::pending().await } => unreachable!(),
    };
    within_limit(control.lost()).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_client_of_a_driver_that_was_killed_loses_control() {
    if !has_compilers() {
        return;
    }
    let scene = Scene::new();
    let driver = start("examples/driver.cpp", &["102", &scene.group]);
    let mut control = scene.control().await;
    // Its motor gets no commands any more, and stops by its own deadline.
    drop(driver);
    within_limit(control.lost()).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_operator_that_hangs_loses_control_if_its_program_is_watched() {
    if !has_compilers() {
        return;
    }
    let scene = Scene::new();
    let (driver, _) = scene.driver();
    let operator = start("tests/programs/hung_operator.cpp", &["43", &scene.group]);
    let operator = expect(operator, "controls").await;
    let mut standings = driver.watch_standing();
    let released = standings.wait_for(|it| it.controller.is_none());
    within_limit(released).await.unwrap();
    let _operator = expect(
        operator,
        "control is lost: the program has not used control",
    )
    .await;
}
