//! `jaus judge` on one host, the reference vehicle on the other.

use std::process::Command;

use jaus_test_kit::hosts::{TwoHosts, on_two_hosts};
use jaus_test_kit::vehicle_process::VehicleProcess;

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
        let _vehicle = VehicleProcess::start(jaus(hosts, 0).args(["vehicle", "--id", "101.1.1"]));
        let judge = jaus(hosts, 1).args(["judge", "101.1.1"]).output().unwrap();
        let report = String::from_utf8_lossy(&judge.stdout);
        let said = String::from_utf8_lossy(&judge.stderr);
        assert!(judge.status.success(), "{report}{said}");
        assert!(report.contains(" 0 failed, 0 skipped"), "{report}");
    });
}
