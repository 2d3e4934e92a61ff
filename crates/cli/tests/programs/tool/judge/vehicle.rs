//! The reference vehicle passes every step.

use crate::support::{jaus, run};
use crate::tool::judge::peer::network;
use jaus_test_kit::vehicle_process::VehicleProcess;

/// A vehicle in the network that the flags name.
fn start(flags: &[&str]) -> VehicleProcess {
    VehicleProcess::start(
        jaus()
            .args(["vehicle", "--id", "101.1.1", "--profile", "contest"])
            .args(flags),
    )
}

fn passes_every_step(by: &str, passed: u32) {
    let flags = network();
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let _vehicle = start(&network);
    let judged = run(&[&["judge", "101.1.1", by], &*network].concat(), b"");
    assert_eq!(
        (judged.status, &*judged.stderr),
        (0, ""),
        "{}",
        judged.stdout
    );
    let all = format!("{passed} ok, 0 failed, 0 skipped");
    assert!(judged.stdout.contains(&all), "{}", judged.stdout);
}

#[test]
fn the_reference_vehicle_passes_every_step_by_multicast() {
    passes_every_step("--multicast", 46);
}

#[test]
fn the_reference_vehicle_passes_every_step_by_unicast() {
    passes_every_step("--unicast", 47);
}

#[test]
fn services_of_the_reference_vehicle_ignore_who_is_not_in_control() {
    let flags = network();
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let _vehicle = start(&network);
    let services = [
        "Management",
        "ListManager",
        "LocalPoseSensor",
        "VelocityStateDriver",
        "LocalWaypointDriver",
    ];
    let services = services.map(|service| ["--service", service]).concat();
    let judge = [&["judge", "101.1.1", "--unicast"], &*services, &*network].concat();
    let judged = run(&judge, b"");
    assert_eq!(
        (judged.status, &*judged.stderr),
        (0, ""),
        "{}",
        judged.stdout
    );
    assert!(
        judged.stdout.contains(" 0 failed, 0 skipped"),
        "{}",
        judged.stdout
    );
}
