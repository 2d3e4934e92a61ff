//! The program without a network: what it says about its flags.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::process::Command;

/// Runs the program, which has to end by itself; returns its exit status and output.
fn run(arguments: &[&str]) -> (i32, String) {
    run_in_domain("", arguments)
}

fn run_in_domain(domain: &str, arguments: &[&str]) -> (i32, String) {
    let mut program = Command::new(env!("CARGO_BIN_EXE_jaus-ros2"));
    program.env("ROS_DOMAIN_ID", domain);
    let output = program.args(arguments).output().unwrap();
    let text = [output.stdout, output.stderr].concat();
    let text = String::from_utf8(text).unwrap();
    (output.status.code().unwrap(), text)
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
        (&["--report", "ReportWrenchEfort"], "ReportWrenchEffort?"),
        (
            &["--report", "ReportStatus", "--all-reports"],
            "--all-reports",
        ),
    ] {
        let (status, text) = run(&[&vehicle, flags].concat());
        assert_eq!(status, 2, "{flags:?}: {text}");
        assert!(text.contains(remedy), "{flags:?}: {text}");
    }
    let (status, text) = run(&["--loopback"]);
    assert_eq!(status, 2, "{text}");
    assert!(text.contains("--vehicle"), "{text}");
}

#[test]
fn the_help_begins_with_what_it_is_and_ends_with_examples() {
    let (status, text) = run(&["--help"]);
    assert_eq!(status, 0, "{text}");
    assert!(text.starts_with("Bridge between a JAUS vehicle"), "{text}");
    assert!(
        text.contains("jaus-ros2 --vehicle 101 --control 127"),
        "{text}"
    );
}

#[test]
fn the_domain_of_the_environment_may_be_empty_but_not_malformed() {
    let flags = ["--loopback", "--vehicle", "101", "--connect", "nowhere"];
    let (_, text) = run_in_domain("", &flags);
    assert!(text.contains("not a zenoh endpoint"), "{text}");
    let (status, text) = run_in_domain("seven", &flags);
    assert_eq!(status, 2, "{text}");
    assert!(text.contains("0 to 232"), "{text}");
}
