//! The examples work as documented: each is run as a program and checked.
//!
//! `cargo test` builds them; to run this test alone, run `cargo build --examples` first.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::UNIX_EPOCH;

use jaus::component::{Component, Kind, Subscription, When};
use jaus::messages::mobility::{
    QueryGlobalPose, QueryGlobalPoseExt, ReportGlobalPoseExt, global_pose_sensor,
};
use jaus::node::{Config, Node};
use jaus_test_kit::example::Example;
use jaus_test_kit::waiting::within_limit;

/// Held by each test that runs a driver: the group example stops every driver on this host.
static DRIVER: Mutex<()> = Mutex::new(());

fn alone_with_a_driver() -> MutexGuard<'static, ()> {
    // The state after a failed test does not matter here.
    DRIVER.lock().unwrap_or_else(PoisonError::into_inner)
}

#[test]
fn the_client_listens_to_the_sensor_and_notices_that_it_restarts() {
    let mut sensor = Example::start("sensor");
    sensor.expect("101.1.33 is up");
    let mut client = Example::start("client");
    client.expect("101.1.33 reports its speed");
    client.expect_line("its speed in metres per second", is_speed);
    drop(sensor);
    client.expect("101.1.33 is down");
    let _sensor = Example::start("sensor");
    client.expect("101.1.33 reports its speed");
    client.expect_line("its speed in metres per second", is_speed);
}

/// Whether a line is a number with its unit, such as `1.60 m/s`.
fn is_speed(line: &str) -> bool {
    let number = line.strip_suffix(" m/s").map(str::parse::<f64>);
    matches!(number, Some(Ok(_)))
}

#[tokio::test]
async fn the_gnss_sensor_publishes_each_fix_with_the_time_of_its_measurement() {
    let mut sensor = Example::start("gnss");
    sensor.expect("105.1.43 is up");
    let node = Node::start(Config::loopback(47, 1)).unwrap();
    let client = Component::builder(Kind::OperatorControlUnit, "Test");
    let client = client.attach(&node, 1).unwrap();
    let peer = within_limit(client.find(global_pose_sensor::URN)).await;
    let (peer, query) = (peer.unwrap(), QueryGlobalPoseExt::all());
    let poses = client.subscribe(peer, &query, When::OnChange);
    let mut poses = within_limit(poses).await.unwrap();
    let first = until(&mut poses, |_| true).await;
    assert!(first.latitude.is_none(), "before the first fix: {first:?}");

    sensor.feed(b"$GPGGA,123519.25,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*6E\r\n");
    let fix = until(&mut poses, |report| report.latitude.is_some()).await;
    assert!((fix.latitude_deg().unwrap() - 48.1173).abs() < 1e-6);
    assert!((fix.longitude_deg().unwrap() - 11.516_667).abs() < 1e-6);
    assert!((fix.xy_position_rms_m().unwrap() - 3.18).abs() < 0.01);
    assert!(fix.heading.is_none(), "a receiver measures no heading");
    let (seconds, nanoseconds) = (fix.time_seconds.unwrap(), fix.time_nano_seconds.unwrap());
    let of_day = 12 * 3600 + 35 * 60 + 19;
    assert_eq!((seconds % 86_400, nanoseconds), (of_day, 250_000_000));
    let now = UNIX_EPOCH.elapsed().unwrap().as_secs();
    assert!(now.abs_diff(seconds.into()) <= 43_200, "the date is wrong");

    let older = within_limit(client.query(peer, &QueryGlobalPose::all())).await;
    let stamp = older.unwrap().time_stamp.unwrap();
    assert_eq!(
        (stamp.hour(), stamp.minutes(), stamp.milliseconds()),
        (12, 35, 250)
    );
    sensor.feed(b"$GPGSA,A,1,,,,,,,,,,,,,,,*1E\r\n");
    let lost = until(&mut poses, |report| report.latitude.is_none()).await;
    assert!(lost.time_seconds.is_some(), "{lost:?}");
}

/// The next report of which this is true.
async fn until(
    poses: &mut Subscription<ReportGlobalPoseExt>,
    is_wanted: impl Fn(&ReportGlobalPoseExt) -> bool,
) -> ReportGlobalPoseExt {
    loop {
        let report = within_limit(poses.report()).await.unwrap();
        if is_wanted(&report) {
            return report;
        }
    }
}

#[test]
fn the_operator_drives_the_driver_and_lets_it_go() {
    let _alone = alone_with_a_driver();
    let mut driver = Example::start("driver");
    driver.expect("102.1.33 is up");
    let mut operator = Example::start("operator");
    driver.expect("ready now, controlled by 43.1.1");
    driver.expect("43.1.1 drives with 40 %");
    assert!(operator.interrupt().success());
    operator.expect("102.1.33 is free again");
    driver.expect("standby now, not controlled");
}

#[test]
fn two_vehicles_are_commanded_through_their_restarts() {
    let _alone = alone_with_a_driver();
    let mut vehicles = ["102", "103"].map(|it| Example::start_with("driver", &[it]));
    let mut operator = Example::start("two_vehicles");
    for vehicle in &mut vehicles {
        vehicle.expect("45.1.1 drives with 20 %");
    }
    // One at a time, and then both.
    let [first, second] = vehicles;
    let first = restarted("102", first, &mut operator);
    let second = restarted("103", second, &mut operator);
    drop([first, second]);
    let vehicles = ["102", "103"].map(|it| Example::start_with("driver", &[it]));
    for mut vehicle in vehicles {
        vehicle.expect("45.1.1 drives with 20 %");
    }
}

/// Stops a driver, and starts it again; the operator must notice the loss, and drive it again.
fn restarted(subsystem: &'static str, driver: Example, operator: &mut Example) -> Example {
    let lines = operator.seen().len();
    drop(driver);
    operator.expect(&format!("no control of {subsystem}.1.33"));
    let mut driver = Example::start_with("driver", &[subsystem]);
    driver.expect("45.1.1 drives with 20 %");
    operator.expect(&format!("{subsystem}.1.33 is ready"));
    let other = if subsystem == "102" { "103" } else { "102" };
    let loses_other = |line: &String| line.contains(&format!("no control of {other}.1.33"));
    let seen = &operator.seen()[lines..];
    assert!(!seen.iter().any(loses_other), "{seen:#?}");
    driver
}

#[test]
fn the_group_stops_all_vehicles_when_one_is_too_fast() {
    let _alone = alone_with_a_driver();
    let mut vehicles = ["102", "103"].map(|it| Example::start_with("driver", &[it]));
    let _operator = Example::start("two_vehicles");
    for vehicle in &mut vehicles {
        vehicle.expect("45.1.1 drives with 20 %");
    }
    let _sensor = Example::start("sensor");
    let mut group = Example::start("group");
    group.expect("101.1.33 reports its speed");
    group.expect("stopping all vehicles");
    for vehicle in &mut vehicles {
        vehicle.expect("emergency now");
    }
    group.expect("102.1.33 acknowledged the stop");
    group.expect("103.1.33 acknowledged the stop");
}

#[cfg(feature = "every-set")]
#[test]
fn two_viewers_share_large_images_and_only_the_slow_one_misses_some() {
    let mut images = Example::start("images");
    images.expect("fast: 1048576 octets, ");
    images.expect_line("that the slow viewer missed images", |line| {
        line.starts_with("slow: 1048576 octets") && !line.ends_with(" 0 missed")
    });
    let mut fast = images.seen().iter().filter(|it| it.starts_with("fast"));
    assert!(
        fast.all(|it| it.ends_with(" 0 missed")),
        "{:#?}",
        images.seen()
    );
}

#[test]
fn every_example_is_shown_and_has_fewer_than_60_lines() {
    let directory = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
    let page = include_str!("../../docs/examples.md");
    // Shown elsewhere.
    let others = [
        "speedometer.rs",
        "sensor.rs",
        "client.rs",
        "driver.rs",
        "operator.rs",
    ];
    for entry in std::fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|it| it != "rs") {
            continue;
        }
        let name = path.file_name().unwrap().to_str().unwrap();
        let lines = std::fs::read_to_string(&path).unwrap().lines().count();
        assert!(lines < 60, "{name} has {lines} lines");
        let include = format!("{{{{#include ../examples/{name}}}}}");
        assert!(
            others.contains(&name) || page.contains(&include),
            "docs/examples.md does not show {name}"
        );
    }
}

#[test]
fn the_texts_show_the_examples_as_they_are() {
    let readme = include_str!("../../README.md");
    let tutorial = include_str!("../../docs/tutorial.md");
    for (text, example) in [
        (readme, include_str!("../../examples/speedometer.rs")),
        (tutorial, include_str!("../../examples/sensor.rs")),
        (tutorial, include_str!("../../examples/client.rs")),
        (tutorial, include_str!("../../examples/driver.rs")),
        (tutorial, include_str!("../../examples/operator.rs")),
    ] {
        let (_about, program) = example.split_once("\n\n").expect("a head");
        assert!(text.contains(program), "not in the text:\n{program}");
    }
}
