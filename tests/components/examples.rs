//! The examples work as documented: each is run as a program and checked.
//!
//! `cargo test` builds them; to run this test alone, run `cargo build --examples` first.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use jaus_test_kit::waiting::LIMIT;

/// Held by each test that runs a driver: the group example stops every driver on this host.
static DRIVER: Mutex<()> = Mutex::new(());

fn alone_with_a_driver() -> MutexGuard<'static, ()> {
    // The state after a failed test does not matter here.
    DRIVER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An example that runs until it is dropped.
struct Example {
    name: &'static str,
    program: Child,
    lines: Receiver<String>,
    seen: Vec<String>,
}

impl Example {
    fn start(name: &'static str) -> Self {
        Self::start_with(name, &[])
    }

    fn start_with(name: &'static str, arguments: &[&str]) -> Self {
        let mut program = Command::new(path(name))
            .args(arguments)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{name}: {error}; run cargo build --examples"));
        let output = BufReader::new(program.stdout.take().unwrap());
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                // The test may be over.
                let _ = sender.send(line);
            }
        });
        Self {
            name,
            program,
            lines,
            seen: Vec::new(),
        }
    }

    /// Waits until it prints a line that contains this text.
    fn expect(&mut self, wanted: &str) {
        self.expect_line(wanted, |line| line.contains(wanted));
    }

    /// Waits until it prints a line of which this is true.
    fn expect_line(&mut self, wanted: &str, is_wanted: impl Fn(&str) -> bool) {
        let end = Instant::now() + LIMIT;
        while self.seen.last().is_none_or(|line| !is_wanted(line)) {
            let left = end.saturating_duration_since(Instant::now());
            match self.lines.recv_timeout(left) {
                Ok(line) => self.seen.push(line),
                Err(_) => panic!("{} did not print {wanted:?}: {:#?}", self.name, self.seen),
            }
        }
    }
}

impl Drop for Example {
    fn drop(&mut self) {
        // It may have exited already.
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

fn path(name: &str) -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let profile = test.parent().and_then(|deps| deps.parent()).unwrap();
    let file = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    profile.join("examples").join(file)
}

#[test]
fn the_client_listens_to_the_sensor_and_notices_that_it_restarts() {
    let mut sensor = Example::start("sensor");
    sensor.expect("101.1.33 is up");
    let mut client = Example::start("client");
    client.expect("101.1.33 reports its speed at Some(5.0) Hz");
    client.expect("m/s");
    drop(sensor);
    client.expect("101.1.33 is down");
    let _sensor = Example::start("sensor");
    client.expect("101.1.33 reports its speed");
    client.expect("m/s");
}

#[test]
fn the_operator_drives_the_driver_and_lets_it_go() {
    let _alone = alone_with_a_driver();
    let mut driver = Example::start("driver");
    driver.expect("102.1.33 is up");
    let mut operator = Example::start("operator");
    driver.expect("ready now, controlled by Some");
    driver.expect("43.1.1 drives with 40 %");
    operator.expect("102.1.33 is free again");
    driver.expect("standby now, controlled by None");
    assert!(operator.program.wait().unwrap().success());
}

#[test]
fn two_vehicles_are_commanded_through_their_restarts() {
    let _alone = alone_with_a_driver();
    let first = Example::start_with("driver", &["102"]);
    let mut second = Example::start_with("driver", &["103"]);
    let mut operator = Example::start("two_vehicles");
    operator.expect("102.1.33 is ready");
    second.expect("44.1.1 drives with 20 %");
    drop(first);
    operator.expect("no control of 102.1.33");
    let mut first = Example::start_with("driver", &["102"]);
    first.expect("44.1.1 drives with 20 %");
    operator.expect("102.1.33 is ready");
    assert!(
        !operator
            .seen
            .iter()
            .any(|line| line.contains("no control of 103.1.33"))
    );
}

#[test]
fn the_group_stops_everybody_when_one_is_too_fast() {
    let _alone = alone_with_a_driver();
    let _sensor = Example::start("sensor");
    let mut driver = Example::start("driver");
    driver.expect("102.1.33 is up");
    let mut group = Example::start("group");
    group.expect("101.1.33 reports its speed");
    group.expect("stopping all vehicles");
    group.expect("102.1.33 acknowledged the stop");
}

#[cfg(feature = "every-set")]
#[test]
fn a_slow_viewer_gets_the_latest_of_large_images() {
    let mut images = Example::start("images");
    images.expect("1048576 octets");
    images.expect_line("that the viewer missed images", |line| {
        !line.ends_with(" 0 missed")
    });
}

#[test]
fn the_readme_shows_the_sensor_and_the_client_as_they_are() {
    let readme = include_str!("../../README.md");
    let examples = [
        include_str!("../../examples/sensor.rs"),
        include_str!("../../examples/client.rs"),
    ];
    for example in examples {
        let (_about, program) = example.split_once("\n\n").expect("a head");
        assert!(readme.contains(program), "not in the README:\n{program}");
    }
}
