//! `jaus judge` on one host, the reference vehicle on the other.

use jaus_test_kit::hosts::on_two_hosts;
use jaus_test_kit::vehicle_process::VehicleProcess;

/// Without the slow steps: `tool::judge` runs all steps, on one host.
const STEPS: &str = "A1-A5,B1-B8,B13-B19";

#[test]
fn the_vehicle_passes_from_another_host() {
    on_two_hosts(|hosts| {
        let jaus = |host| hosts.command(host, env!("CARGO_BIN_EXE_jaus"));
        let _vehicle = VehicleProcess::start(jaus(0).args(["vehicle", "--id", "101.1.1"]));
        let steps = ["judge", "101.1.1", "--only", STEPS];
        let judge = jaus(1).args(steps).output().unwrap();
        let report = String::from_utf8_lossy(&judge.stdout);
        let said = String::from_utf8_lossy(&judge.stderr);
        assert!(judge.status.success(), "{report}{said}");
        assert!(report.contains(" 0 failed, 0 skipped"), "{report}");
    });
}
