//! The reference vehicle passes every step.

use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};

use crate::cli_support::{jaus, run};
use crate::peer::network;

/// `jaus vehicle` in a process of its own; killed when dropped.
struct Vehicle(Child);

impl Vehicle {
    /// Starts it in the network that the flags name, and waits until it is there.
    fn start(flags: &[&str]) -> Self {
        let mut command = jaus();
        command.args(["vehicle", "--id", "101.1.1"]).args(flags);
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let mut introduction = String::new();
        while !introduction.contains("Ctrl-C") {
            let read = stdout.read_line(&mut introduction).unwrap();
            assert_ne!(read, 0, "the vehicle has ended: {introduction}");
        }
        // It may go on talking.
        std::thread::spawn(move || stdout.lines().map_while(Result::ok).for_each(drop));
        Self(child)
    }
}

impl Drop for Vehicle {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn the_reference_vehicle_passes_every_step_by_multicast_and_by_unicast() {
    let flags = network();
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let _vehicle = Vehicle::start(&network);
    let judged = run(&[&["judge", "101.1.1"], &*network].concat(), b"");
    assert_eq!(
        (judged.status, &*judged.stderr),
        (0, ""),
        "{}",
        judged.stdout
    );
    let all = "93 passed, 0 failed, 0 skipped";
    assert!(judged.stdout.contains(all), "{}", judged.stdout);
}

#[test]
fn services_of_the_reference_vehicle_ignore_who_is_not_in_control() {
    let flags = network();
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let _vehicle = Vehicle::start(&network);
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
