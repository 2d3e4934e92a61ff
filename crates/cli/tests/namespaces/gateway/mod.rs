//! `jaus-ra-gateway` on a separate host: an RA vehicle that is also an operator on one host, the
//! gateway with a JAUS vehicle and a JAUS operator on the other.
//!
//! To drive a running OpenJAUS by hand with the same operator, run
//! `JAUS_TEST_ROLE=operator namespaces --exact gateway::a_process_that_plays_a_node --nocapture`
//! beside a gateway.

pub(crate) mod operator;
pub(crate) mod ra_vehicle;

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use jaus_test_kit::hosts::{Process, TwoHosts, on_host, on_two_hosts};
use jaus_test_kit::vehicle_process::VehicleProcess;
use jaus_test_kit::waiting::block_until;

/// A running gateway; killed when dropped.
pub(crate) struct Gateway(Child);

impl Gateway {
    /// Starts it on a host, with RA systems behind an interface.
    pub(crate) fn start(host: &str, interface: &str, flags: &[&str], stdout: Stdio) -> Self {
        let mut command = on_host(host, env!("CARGO_BIN_EXE_jaus-ra-gateway"));
        let grant = [
            "--ra-grant",
            "65535.255.255 control=255 clear-emergency=any",
        ];
        command
            .args(["--interface", interface])
            .args(grant)
            .args(flags);
        Self(command.stdout(stdout).spawn().unwrap())
    }

    /// Its process id.
    pub(crate) fn id(&self) -> u32 {
        self.0.id()
    }

    /// Kills it without warning.
    fn kill(mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }

    /// Ends it. Returns its output.
    fn end(mut self) -> String {
        let id = self.0.id().to_string();
        let told = Command::new("kill").args(["-TERM", &id]).status();
        assert!(told.unwrap().success());
        let mut printed = String::new();
        let stdout = self.0.stdout.take();
        std::io::Read::read_to_string(&mut stdout.unwrap(), &mut printed).unwrap();
        assert!(self.0.wait().unwrap().success());
        printed
    }
}

impl Drop for Gateway {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A gateway on the second host, with RA systems on the first.
fn gateway(hosts: &TwoHosts, flags: &[&str]) -> Gateway {
    Gateway::start(&hosts.names[1], "jaus0", flags, Stdio::piped())
}

#[test]
fn an_ra_vehicle_is_found_watched_and_driven_from_jaus() {
    on_two_hosts(|hosts| watch_and_drive(hosts, &[]));
}

#[test]
fn an_ra_vehicle_that_multicast_does_not_reach_is_driven_when_it_is_named() {
    let unicast = ["--ra-group", "off", "--ra-peer", "10.213.77.1"];
    on_two_hosts(|hosts| watch_and_drive(hosts, &unicast));
}

/// An RA vehicle on the first host, observed and driven from the second through a gateway with
/// these flags.
fn watch_and_drive(hosts: &TwoHosts, flags: &[&str]) {
    let running = gateway(hosts, &[flags, &["--stats", "--json"]].concat());
    let vehicle = hosts.start(0, "ra-vehicle");
    vehicle.says("listening on");
    let operator = hosts.start(1, "operator");
    assert_eq!(operator.says("found 20.1.38"), "Pose");
    assert!(operator.says("latitude").starts_with("37.2"));
    let poses: u32 = operator.says("poses in 3 s").parse().unwrap();
    assert!((25..=35).contains(&poses), "{poses}");
    operator.says("in control");
    vehicle.says("controlled by 250.1.32.1");
    vehicle.says("driven");
    operator.says("released");
    vehicle.says("controlled by nobody");
    let printed = running.end();
    let report: serde_json::Value = serde_json::from_str(&printed).unwrap();
    let components = report["ra_components"].as_array().unwrap();
    let pose = components.iter().find(|it| it["ra"] == "20.1.38.1");
    assert_eq!(pose.unwrap()["jaus"], "20.1.38", "{printed}");
}

/// An RA vehicle on the first host that a JAUS client on the second drives through a gateway.
fn driving(hosts: &TwoHosts) -> (Gateway, Process, Process) {
    let gateway = gateway(hosts, &[]);
    let vehicle = hosts.start(0, "ra-vehicle");
    vehicle.says("listening on");
    let operator = hosts.start(1, "operator");
    operator.says("in control");
    vehicle.says("drives for the 1. time");
    (gateway, vehicle, operator)
}

/// The vehicle stands still and has no controller; another client then drives it, and nothing has
/// moved it meanwhile.
fn is_driven_by_the_next_client_alone(hosts: &TwoHosts, vehicle: &Process) {
    std::thread::sleep(Duration::from_secs(3));
    let operator = hosts.start(1, "operator");
    operator.says("in control");
    assert_eq!(vehicle.says("drives for the"), "2. time");
}

#[test]
fn after_a_gateway_was_killed_and_started_again_the_vehicle_moves_for_a_new_client_alone() {
    on_two_hosts(|hosts| {
        let (running, vehicle, operator) = driving(hosts);
        running.kill();
        vehicle.says("stands");
        drop(operator);
        let _gateway = gateway(hosts, &[]);
        vehicle.says("controlled by nobody");
        is_driven_by_the_next_client_alone(hosts, &vehicle);
    });
}

#[test]
fn a_gateway_that_is_terminated_stops_and_releases_the_vehicle() {
    on_two_hosts(|hosts| {
        let (running, vehicle, operator) = driving(hosts);
        running.end();
        vehicle.says("stands");
        vehicle.says("controlled by nobody");
        drop(operator);
        let _gateway = gateway(hosts, &[]);
        is_driven_by_the_next_client_alone(hosts, &vehicle);
    });
}

#[test]
fn the_vehicle_of_a_client_that_was_killed_stops_and_is_free() {
    on_two_hosts(|hosts| {
        let (_gateway, vehicle, operator) = driving(hosts);
        drop(operator);
        vehicle.says("stands");
        vehicle.says("controlled by nobody");
    });
}

/// Waits until an audit log has an entry with all of these texts.
fn wait_for_entry(log: &Path, texts: &[&str]) {
    let has_all = |line: &str| texts.iter().all(|text| line.contains(text));
    block_until(|| {
        let entries = std::fs::read_to_string(log).unwrap_or_default();
        entries.lines().any(has_all)
    });
}

#[test]
fn a_jaus_vehicle_is_listed_asked_and_driven_from_ra() {
    on_two_hosts(|hosts| {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("audit.jsonl");
        let _gateway = gateway(hosts, &["--audit", log.to_str().unwrap()]);
        let mut jaus = hosts.command(1, env!("CARGO_BIN_EXE_jaus"));
        let vehicle = jaus.args(["vehicle", "--id", "101.1.7", "--port", "0"]);
        let _vehicle = VehicleProcess::start(vehicle);
        let operator = hosts.start(0, "ra-vehicle");
        assert_eq!(operator.says("listed 101"), "Rover");
        operator.says("101.1.38.7 latitude");
        operator.says("in control of 101.1.33.7");
        operator.says("101.1.42.7 moves");
        for message in ["RequestControl", "ConfirmControl"] {
            wait_for_entry(&log, &["\"who\":\"RA 20.1.32.1\"", "101.1.7", message]);
        }
    });
}

/// Not a test by itself: does nothing unless another test starts it in a role.
#[test]
fn a_process_that_plays_a_node() {
    jaus_test_kit::hosts::play(async |role| match role {
        "ra-vehicle" => ra_vehicle::play("jaus0").await,
        "operator" => operator::play().await,
        other => panic!("unknown role {other}"),
    });
}
