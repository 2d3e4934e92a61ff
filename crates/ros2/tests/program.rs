//! The program without a network: what it says about its flags.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::process::Command;

use jaus_test_kit::program::{assert_help, assert_refused};
use jaus_test_kit::tools::workspace;

fn program(arguments: &[&str]) -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_jaus-ros2"));
    program.env("ROS_DOMAIN_ID", "").args(arguments);
    program
}

#[test]
fn a_mistake_in_a_flag_is_refused_with_its_remedy() {
    let vehicle = ["--loopback", "--vehicle", "101"];
    for (flags, remedy) in [
        (&["--connect", "192.168.7.2"][..], "tcp/192.168.7.2:7447"),
        (&["--zenoh-config", "/nowhere.json5"], "/nowhere.json5"),
        (&["--domain", "233"], "0 to 232"),
        (&["--namespace", "v101"], "`v101`"),
        (&["--rate", "0"], "0.1 to 1000"),
        (&["--max-speed", "0"], "0.05 to 100"),
        (&["--timeout", "3s"], "50ms to 2s"),
        (&["--component", "102.1.1"], "not a part of --vehicle 101"),
        (&["--rights", "drive"], "control=AUTHORITY"),
        (&["--rights", "control=1 only=Drive"], "`Drive`"),
        (&["--report", "ReportWrenchEfort"], "ReportWrenchEffort?"),
        (
            &["--report", "ReportStatus", "--all-reports"],
            "--all-reports",
        ),
    ] {
        assert_refused(&mut program(&[&vehicle, flags].concat()), remedy);
    }
    assert_refused(&mut program(&["--loopback"]), "--vehicle");
}

#[test]
fn the_help_begins_with_what_it_is_and_ends_with_examples() {
    let example = "jaus-ros2 --vehicle 101 --rights control=127";
    assert_help(&mut program(&[]), "Bridge between a JAUS vehicle", example);
}

#[test]
fn the_domain_of_the_environment_may_be_empty_but_not_malformed() {
    let flags = ["--loopback", "--vehicle", "101", "--connect", "nowhere"];
    assert_refused(&mut program(&flags), "not a zenoh endpoint");
    assert_refused(program(&flags).env("ROS_DOMAIN_ID", "seven"), "0 to 232");
}

#[test]
fn the_settings_of_its_package_are_understood() {
    let file = workspace("packaging/bridges/etc/ros2.toml");
    jaus_cli::settings::read(&file).unwrap();
    let mut program = program(&[]);
    program.args(jaus_cli::settings::flags(&file).unwrap());
    assert_help(&mut program, "Bridge between a JAUS vehicle", "jaus-ros2");
}
