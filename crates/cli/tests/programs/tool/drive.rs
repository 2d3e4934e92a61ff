//! `jaus drive` of a vehicle, over the loopback interface.

use std::io::{BufRead, BufReader, Write};
use std::process::Stdio;
use std::sync::mpsc;
use std::time::Duration;

use crate::support::{Running, jaus, own_group, run};

/// The up arrow of a terminal.
const AHEAD: &[u8] = b"\x1b[A";

#[test]
fn the_vehicle_moves_while_a_key_is_pressed_stops_without_and_is_released_when_the_input_ends() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let mut vehicle = Running::command("vehicle", &[&["--id", "110.1.1"], &*network].concat());
    vehicle.read_until("Ctrl-C");
    let mut drive = jaus()
        .args([&["drive", "110.1.1"], &*network].concat())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut keyboard = drive.stdin.take().unwrap();
    let mut shown = BufReader::new(drive.stdout.take().unwrap()).lines();
    let mut expect = |text: &str| shown.by_ref().any(|line| line.unwrap().contains(text));
    assert!(expect("110.1.1 is ready; ahead 0 %"));

    // The key is pressed until the vehicle has moved.
    let (has_moved, moved) = mpsc::channel::<()>();
    let pressing = std::thread::spawn(move || {
        while moved.recv_timeout(Duration::from_millis(50)).is_err() {
            keyboard.write_all(AHEAD).unwrap();
        }
        keyboard
    });
    vehicle.read_until("at x 0.");
    has_moved.send(()).unwrap();
    let keyboard = pressing.join().unwrap();

    assert!(expect("ahead 50 %"));
    assert!(expect("ahead 0 %"), "no key is pressed any more");
    drop(keyboard);
    vehicle.read_until("no client is in control");
    assert_eq!(drive.wait().unwrap().code(), Some(0));
}

#[test]
fn what_is_no_primitive_driver_is_not_driven() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let flags = ["--id", "110.1.3", "--split"];
    let mut vehicle = Running::command("vehicle", &[&flags, &*network].concat());
    vehicle.read_until("Ctrl-C");
    let refused = run(&[&["drive", "110.1.3"], &*network].concat(), b"");
    assert!(
        refused.stderr.contains("110.1.3 is no primitive driver"),
        "{refused:?}"
    );
    assert_eq!((refused.status, &*refused.stdout), (1, ""));
}
