//! Secure nodes on two hosts: by two commands on each, and by beacons alone.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};

use jaus_test_kit::hosts::{TwoHosts, on_two_hosts};
use jaus_test_kit::tools::has_tshark;
use jaus_test_kit::vehicle_process::VehicleProcess;
use jaus_test_kit::waiting::block_until;
use tempfile::TempDir;

const JAUS: &str = env!("CARGO_BIN_EXE_jaus");
const VEHICLE: usize = 0;
const OPERATOR: usize = 1;
/// The UDP port of plain JAUS, and that of beacons.
const PLAIN: u16 = 3794;
const BEACONS: u16 = 3796;

/// The key files of one host.
struct Keys(TempDir);

impl Keys {
    fn flags(&self) -> [String; 2] {
        [("key", "node.key"), ("trusted-keys", "trusted_keys")]
            .map(|(flag, file)| format!("--{flag}={}", self.0.path().join(file).display()))
    }

    fn run(&self, arguments: &[&str]) -> String {
        let mut command = Command::new(JAUS);
        let output = command.arg("keys").args(arguments).args(self.flags());
        let output = output.output().unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap().trim().to_owned()
    }

    /// Keys of two hosts that trust each other.
    fn of_vehicle_and_operator() -> [Self; 2] {
        let [vehicle, operator] = [(), ()].map(|()| Self(tempfile::tempdir().unwrap()));
        let (vehicle_key, operator_key) = (vehicle.run(&["new"]), operator.run(&["new"]));
        vehicle.run(&["trust", "operator", &operator_key, "60.255.255"]);
        operator.run(&["trust", "rover", &vehicle_key, "101.255.255"]);
        [vehicle, operator]
    }
}

/// A program whose output lines are collected; killed when dropped.
struct Lines {
    child: Child,
    lines: Arc<Mutex<Vec<String>>>,
}

impl Lines {
    fn of(command: &mut Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        let lines = Arc::new(Mutex::new(Vec::new()));
        let collected = lines.clone();
        std::thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                collected.lock().unwrap().push(line);
            }
        });
        Self { child, lines }
    }

    /// Waits for a line that this holds for.
    fn wait_for(&self, holds: impl Fn(&str) -> bool) {
        block_until(|| self.lines.lock().unwrap().iter().any(|line| holds(line)));
    }
}

impl Drop for Lines {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Captures the UDP datagrams of the vehicle's cable: source, destination port and payload in hex.
/// Temporary files are in the folder.
fn capture(hosts: &TwoHosts, folder: &TempDir) -> Lines {
    let fields = ["ip.src", "udp.dstport", "udp.payload"].map(|field| ["-e", field]);
    let mut tshark = hosts.command(VEHICLE, "tshark");
    tshark
        .args(["-l", "-i", "jaus0", "-f", "udp", "-T", "fields"])
        .args(fields.concat())
        .env("TMPDIR", folder.path());
    Lines::of(&mut tshark)
}

#[derive(Debug)]
struct Datagram {
    source: String,
    port: u16,
    payload: String,
}

impl Datagram {
    fn read(line: &str) -> Option<Self> {
        let [source, port, payload] = line.split('\t').collect::<Vec<_>>()[..] else {
            return None;
        };
        Some(Self {
            source: source.to_owned(),
            port: port.parse().ok()?,
            payload: payload.to_owned(),
        })
    }

    fn is_beacon_of(&self, source: &str) -> bool {
        self.port == BEACONS && self.source == source
    }
}

fn hex(octets: &[u8]) -> String {
    octets.iter().map(|octet| format!("{octet:02x}")).collect()
}

/// Pings the vehicle from the operator's host until it answers.
fn reach(hosts: &TwoHosts, flags: &[String]) -> Lines {
    let mut ping = hosts.command(OPERATOR, JAUS);
    ping.args(["ping", "101.1.1", "--id", "60.1.1", "--json"]);
    let ping = Lines::of(ping.args(["--with", "identification"]).args(flags));
    ping.wait_for(|line| {
        let query: serde_json::Value = serde_json::from_str(line).unwrap();
        query["ms"].is_number()
    });
    ping
}

#[test]
fn two_commands_on_each_of_two_hosts_give_a_vehicle_and_an_operator() {
    on_two_hosts(|hosts| {
        let [at_vehicle, at_operator] = [(), ()].map(|()| Keys(tempfile::tempdir().unwrap()));
        let (vehicle_key, operator_key) = (at_vehicle.run(&["new"]), at_operator.run(&["new"]));

        let mut vehicle = hosts.command(VEHICLE, JAUS);
        vehicle.args(["vehicle", "--id", "101.1.1", "--secure-listen"]);
        vehicle.arg(format!("--trust=operator {operator_key} 60.255.255"));
        let _vehicle = VehicleProcess::start(vehicle.args(at_vehicle.flags()));

        let peer = "--secure-peer=10.213.77.1".to_owned();
        let trust = format!("--trust=rover {vehicle_key} 101.255.255");
        let _ping = reach(hosts, &[&[peer, trust][..], &at_operator.flags()].concat());
    });
}

#[test]
fn a_vehicle_and_an_operator_find_each_other_by_beacons_that_expose_no_ids() {
    if !has_tshark() {
        return;
    }
    on_two_hosts(|hosts| {
        let [at_vehicle, at_operator] = Keys::of_vehicle_and_operator();
        let folder = tempfile::tempdir().unwrap();
        let captured = capture(hosts, &folder);
        let mut vehicle = hosts.command(VEHICLE, JAUS);
        vehicle.args(["vehicle", "--id", "101.1.1", "--secure-listen"]);
        vehicle.arg("--secure-announce").args(at_vehicle.flags());
        let _vehicle = VehicleProcess::start(&mut vehicle);
        let announce = ["--secure-announce=jaus0".to_owned()];
        let _ping = reach(hosts, &[&announce[..], &at_operator.flags()].concat());

        for source in ["10.213.77.1", "10.213.77.2"] {
            captured
                .wait_for(|line| Datagram::read(line).is_some_and(|it| it.is_beacon_of(source)));
        }
        // Of the session itself; tshark prints what it has captured some time later.
        captured.wait_for(|line| Datagram::read(line).is_some_and(|it| it.port != BEACONS));
        let lines = captured.lines.lock().unwrap();
        let datagrams: Vec<_> = lines.iter().flat_map(|it| Datagram::read(it)).collect();
        let readable = [&b"60.255.255"[..], b"101.255.255", b"operator", b"rover"].map(hex);
        for datagram in &datagrams {
            assert_ne!(datagram.port, PLAIN, "{datagram:?}");
            let shown = readable.iter().find(|it| datagram.payload.contains(*it));
            assert_eq!(shown, None, "{datagram:?}");
            if datagram.port == BEACONS {
                assert!(datagram.payload.starts_with(&hex(b"JAUSBCN")));
                assert_eq!(datagram.payload.len(), 2 * 137, "{datagram:?}");
            }
        }
    });
}

#[test]
fn an_interface_for_beacons_that_does_not_exist_is_named_with_those_that_do() {
    on_two_hosts(|hosts| {
        let [at_vehicle, _] = Keys::of_vehicle_and_operator();
        let mut vehicle = hosts.command(VEHICLE, JAUS);
        vehicle.args(["vehicle", "--id", "101.1.1", "--secure-announce=eth9"]);
        let output = vehicle.args(at_vehicle.flags()).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success());
        for words in ["cannot announce the secure link", "eth9", "jaus0"] {
            assert!(said.contains(words), "{said}");
        }
    });
}
