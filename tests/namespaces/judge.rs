//! `jaus judge` on one host, and the reference vehicle on the other.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use crate::hosts::{TwoHosts, on_two_hosts};

/// A vehicle; killed when dropped.
struct Vehicle(Child);

impl Vehicle {
    /// Starts it on one of the hosts, and waits until it is there.
    fn start(hosts: &TwoHosts, host: usize) -> Self {
        let mut child = jaus(hosts, host)
            .args(["vehicle", "--id", "101.1.1"])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
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

/// The tool on one of the hosts.
fn jaus(hosts: &TwoHosts, host: usize) -> Command {
    let mut command = Command::new("ip");
    command
        .args(["netns", "exec", &hosts.names[host]])
        .arg(env!("CARGO_BIN_EXE_jaus"))
        .env_remove("JAUS_LOG");
    command
}

#[test]
fn the_vehicle_passes_every_step_from_another_host() {
    let test = "judge::the_vehicle_passes_every_step_from_another_host";
    on_two_hosts(test, |hosts| {
        let _vehicle = Vehicle::start(hosts, 0);
        let judge = jaus(hosts, 1).args(["judge", "101.1.1"]).output().unwrap();
        let report = String::from_utf8_lossy(&judge.stdout);
        let said = String::from_utf8_lossy(&judge.stderr);
        assert!(judge.status.success(), "{report}{said}");
        assert!(report.contains(" 0 failed, 0 skipped"), "{report}");
    });
}
