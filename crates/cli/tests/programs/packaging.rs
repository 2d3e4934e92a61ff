//! Consistency of the package: programs, settings, units, and the single-machine system.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use jaus_test_kit::tools::workspace;

use crate::support::run;

fn packaging(path: &str) -> PathBuf {
    workspace("packaging").join(path)
}

/// The names of files or folders, without prefix and suffix.
fn named(folder: &Path, prefix: &str, suffix: &str) -> BTreeSet<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let middle = |name: String| {
        let name = name.strip_prefix(prefix)?.strip_suffix(suffix)?;
        Some(name.to_owned())
    };
    names.filter_map(middle).collect()
}

/// Services that do not belong on a machine that runs a whole system: one joins two networks, the
/// others need a GNSS receiver or an inertial measurement unit.
const ELSEWHERE: [&str; 4] = [
    "ra-gateway",
    "global-pose-sensor",
    "global-driver",
    "imu-sensor",
];

/// Names of our programs without `jaus-`.
pub(crate) fn programs() -> BTreeSet<String> {
    named(&workspace("crates/cli/src/bin"), "jaus-", ".rs")
}

#[test]
fn every_settings_file_and_every_unit_is_of_a_program_that_exists() {
    let (programs, settings) = (programs(), named(&packaging("etc"), "", ".toml"));
    assert!(settings.is_subset(&programs), "{settings:?}");
    let special = named(&packaging("systemd"), "jaus@", ".service.d");
    assert!(special.is_subset(&settings), "{special:?}");
    let manifest = include_str!("../../Cargo.toml");
    for part in special {
        let packed = format!("\"../../packaging/systemd/jaus@{part}.service.d/*\"");
        assert!(manifest.contains(&packed), "{packed} is not in the package");
    }
}

#[test]
fn the_system_for_one_machine_has_nothing_wrong_and_every_part_that_is_a_service() {
    let system = packaging("system.toml");
    let run = run(&["up", system.to_str().unwrap(), "--check"], b"");
    assert_eq!(run.status, 0, "{}", run.stderr);
    let parts = named(&packaging("etc"), "", ".toml");
    for part in parts
        .iter()
        .filter(|part| !ELSEWHERE.contains(&part.as_str()))
    {
        let begin = format!("{part}: ");
        let mut lines = run.stdout.lines();
        let line = lines.find(|line| line.starts_with(&begin));
        let line = line.unwrap_or_else(|| panic!("{part} is not in system.toml"));
        assert!(line.contains(&format!("/jaus-{part} ")), "{line}");
    }
}

#[test]
fn the_system_for_one_machine_has_the_ids_of_the_demo() {
    let demo = run(&["demo", "--headless", "--seconds", "1"], b"").stdout;
    let system = packaging("system.toml");
    let system = run(&["up", system.to_str().unwrap(), "--check"], b"").stdout;
    let starts = demo.lines().filter_map(|line| line.split_once(" starts "));
    let mut parts = 0;
    for (_, start) in starts {
        let (id, name) = start.split_once(", the ").unwrap();
        let begin = format!("{}: ", name.replace(' ', "-"));
        let line = system.lines().find(|line| line.starts_with(&begin));
        let line = line.unwrap_or_else(|| panic!("no {begin} in {system}"));
        assert!(line.contains(&format!("--id={id}")), "{id}: {line}");
        parts += 1;
    }
    assert_eq!(parts, 9, "{demo}");
}

#[test]
fn the_unit_of_the_motors_reaches_every_kind_of_them() {
    let unit = "systemd/jaus@primitive-driver.service.d/10-hardware.conf";
    let unit = std::fs::read_to_string(packaging(unit)).unwrap();
    for (motors, right) in [
        ("GPIO lines", "DeviceAllow=char-gpiochip rw"),
        ("serial lines", "DeviceAllow=char-ttyUSB rw"),
        ("CAN buses", "RestrictAddressFamilies=AF_CAN"),
        ("PWM outputs", "ReadWritePaths=-/sys/devices"),
        (
            "H-bridges of a killed program",
            "ExecStopPost=-/bin/sh -c 'for f in /sys/class/pwm/",
        ),
    ] {
        assert!(unit.contains(right), "{motors}: no {right}");
    }
}

#[test]
fn a_simulated_range_sensor_is_no_service_of_a_board() {
    // Drivers would take its empty surroundings for free ground.
    assert!(programs().contains("range-sensor"));
    assert!(!named(&packaging("etc"), "", ".toml").contains("range-sensor"));
}

#[test]
fn every_settings_file_is_understood_by_its_program() {
    for part in named(&packaging("etc"), "", ".toml") {
        let file = packaging(&format!("etc/{part}.toml"));
        let settings = jaus_cli::settings::read(&file);
        assert!(settings.is_ok(), "{}", settings.unwrap_err());
        // The program gets the flags of the file, and `--help` so that it does not start.
        let tool = Path::new(env!("CARGO_BIN_EXE_jaus"));
        let mut program = Command::new(tool.with_file_name(format!("jaus-{part}")));
        let flags = jaus_cli::settings::flags(&file).unwrap();
        let shown = program.args(flags).arg("--help").output().unwrap();
        let told = String::from_utf8_lossy(&shown.stderr).into_owned();
        assert!(shown.status.success(), "{}: {told}", file.display());
    }
}

#[test]
fn no_unit_may_do_more_than_it_must() {
    let unit = std::fs::read_to_string(packaging("systemd/jaus@.service")).unwrap();
    for setting in [
        "CapabilityBoundingSet=\n",
        "NoNewPrivileges=yes",
        "ProtectSystem=strict",
        "PrivateDevices=yes",
        "MemoryDenyWriteExecute=yes",
        "RestartPreventExitStatus=2",
        "User=jaus-%i",
    ] {
        assert!(unit.contains(setting), "{setting}");
    }
    for part in named(&packaging("systemd"), "jaus@", ".service.d") {
        let folder = packaging(&format!("systemd/jaus@{part}.service.d"));
        for file in std::fs::read_dir(folder).unwrap() {
            let text = std::fs::read_to_string(file.unwrap().path()).unwrap();
            // A unit with device access sees only the named devices.
            let opened = text.contains("PrivateDevices=no");
            assert_eq!(opened, text.contains("DevicePolicy=closed"), "{text}");
            for rights in [
                "CapabilityBoundingSet",
                "ProtectSystem",
                "NoNewPrivileges",
                "User=",
            ] {
                assert!(!text.contains(rights), "{part} takes rights: {rights}");
            }
        }
    }
}
