//! `jaus examine` as a process, with our own vehicle and with scripted sockets.

use std::net::UdpSocket;
use std::time::Duration;

use super::doctor::reference_architecture;
use crate::support::{Running, own_group, run};
use serde_json::Value as Json;

/// A vehicle on loopback, with the flags of its network.
fn vehicle() -> (Running, Vec<String>) {
    let network = own_group();
    let flags: Vec<&str> = network.iter().map(String::as_str).collect();
    let named = ["--id", "77.1.1", "--name", "Mule"];
    let mut vehicle = Running::command("vehicle", &[&named, &*flags].concat());
    vehicle.read_until("Ctrl-C");
    (vehicle, network)
}

fn examine(peer: &str, network: &[String], more: &[&str]) -> (i32, Json) {
    let network: Vec<&str> = network.iter().map(String::as_str).collect();
    let flags = ["examine", peer, "--json"];
    let run = run(&[&flags, &*network, more].concat(), b"");
    (run.status, run.only_line())
}

/// The names of the exchanges with this result.
fn with_result<'j>(report: &'j Json, result: &str) -> Vec<&'j str> {
    let all = report["exchanges"].as_array().unwrap().iter();
    let of_it = all.filter(|exchange| exchange["verdict"] == result);
    of_it
        .map(|exchange| exchange["exchange"].as_str().unwrap())
        .collect()
}

#[test]
fn our_own_vehicle_has_nothing_wrong_by_id_and_by_address() {
    let (_vehicle, network) = vehicle();
    let (status, report) = examine("77.1.1", &network, &["--control"]);
    assert_eq!(with_result(&report, "failed"), [""; 0], "{report:#}");
    assert_eq!(with_result(&report, "skipped"), ["JTCP port"], "{report:#}");
    assert_eq!((status, &report["name"]), (0, &"Mule".into()));
    let address = report["address"].as_str().unwrap();
    let (status, report) = examine(address, &network, &["--id", "77.1.1"]);
    assert_eq!(with_result(&report, "failed"), ["ids"], "{report:#}");
    assert_eq!((status, &report["first_failure"]), (1, &"ids".into()));
    let skipped = ["finding it", "taking control", "JTCP port"];
    assert_eq!(with_result(&report, "skipped"), skipped, "{report:#}");
}

#[test]
fn a_port_at_which_nobody_listens_is_told_at_once() {
    let _alone = reference_architecture();
    let free = UdpSocket::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let flags = ["examine", "--loopback", "--port", "0", "--group", "off"];
    let run = run(&[&flags[..], &[&free.to_string()]].concat(), b"");
    assert_eq!(run.status, 1, "{run:?}");
    let words = run.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
    let port = free.port();
    let told = format!("127.0.0.1 reports UDP port {port} as closed");
    assert!(words.contains(&told), "{words}");
    assert!(
        words.ends_with("or it is bound to another address or port of that host."),
        "{words}"
    );
    assert!(
        run.stdout.lines().all(|line| line.chars().count() <= 80),
        "{}",
        run.stdout
    );
}

#[test]
fn who_says_nothing_is_waited_for_as_long_as_is_said() {
    let _alone = reference_architecture();
    let silent = UdpSocket::bind("127.0.0.1:0").unwrap();
    silent
        .set_read_timeout(Some(Duration::from_secs(5)))
        .unwrap();
    let address = silent.local_addr().unwrap().to_string();
    let network = ["--loopback", "--port", "0", "--group", "off"].map(str::to_owned);
    let (status, report) = examine(&address, &network, &["--timeout", "300ms"]);
    assert_eq!(
        (status, &report["first_failure"]),
        (1, &"any answer".into())
    );
    assert_eq!(report["profile"], Json::Null, "{report:#}");
    let mut heard = [0; 100];
    let (octets, _) = silent.recv_from(&mut heard).unwrap();
    // Query Heartbeat Pulse in an AS5669A datagram.
    assert_eq!(
        (heard[0], &heard[13..15], octets),
        (2, &[0x02, 0x22][..], 17)
    );
}

#[test]
fn an_address_that_is_none_is_refused_with_what_would_be_one() {
    let run = run(&["examine", "rover"], b"");
    assert_eq!(run.status, 2);
    assert!(
        run.stderr
            .contains("\"rover\" is neither an id nor an address"),
        "{run:?}"
    );
    assert!(run.stderr.contains("77.1.1@10.0.0.2"), "{run:?}");
}
