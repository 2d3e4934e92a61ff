//! `jaus send` to a vehicle, over the loopback interface.

use crate::support::{Running, own_group, run};

#[test]
fn a_command_under_control_moves_the_vehicle_and_its_end_stops_and_releases_it() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let mut vehicle = Running::command("vehicle", &[&["--id", "108.1.1"], &*network].concat());
    vehicle.read_until("Ctrl-C");
    let command = [
        "send",
        "108.1.1",
        "SetWrenchEffort",
        "{\"PropulsiveLinearEffortX\":50}",
        "--control",
        "127",
        "--hz",
        "20",
        "--for",
        "2s",
    ];
    let sent = run(&[&command, &*network].concat(), b"");
    assert!(
        sent.stdout.contains("sent SetWrenchEffort to 108.1.1 "),
        "{sent:?}"
    );
    assert_eq!((sent.status, &*sent.stderr), (0, ""));
    for event in [
        "authority 127",
        "the state is ready",
        "m/s",
        "no client is in control",
    ] {
        vehicle.read_until(event);
    }
    assert_eq!(vehicle.terminate(), Some(0));
}

#[test]
fn a_command_without_control_is_acknowledged_and_the_user_is_told_what_it_needs() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let mut vehicle = Running::command("vehicle", &[&["--id", "108.1.2"], &*network].concat());
    vehicle.read_until("Ctrl-C");
    let send =
        |arguments: &[&str]| run(&[&["send", "108.1.2"], arguments, &*network].concat(), b"");
    let sent = send(&["Standby", "--json"]);
    let line = sent.only_line();
    assert_eq!(line["acknowledged"], true, "{line}");
    assert_eq!((&line["code"], &line["sent"]), (&"0003".into(), &1.into()));
    assert!(sent.stderr.contains("--control AUTHORITY"), "{sent:?}");
    let refused = send(&["Standby", "--control", "0"]);
    assert!(
        refused.stderr.contains("no control of 108.1.2"),
        "{refused:?}"
    );
    assert_eq!(refused.status, 1);
}

#[test]
fn what_can_not_be_sent_is_told_with_what_would_be_right() {
    for (arguments, advice) in [
        (&["1.1.1", "Standby", "{"][..], "not JSON"),
        (&["1.1.1", "Standby", "{'a':1}"], "double quotes"),
        (
            &["1.1.1", "SetWrenchEffort", "{\"PropulsiveLinearEffort\":1}"],
            "PropulsiveLinearEffortX",
        ),
        (
            &[
                "1.1.1",
                "SetWrenchEffort",
                "{\"PropulsiveLinearEffortX\":101}",
            ],
            "-100",
        ),
        (&["1.1.1", "SetWrench"], "did you mean SetWrenchEffort?"),
        (
            &["1.1.255", "Standby", "--control", "1"],
            "is not a single component",
        ),
        (
            &["1.1.1", "QueryDigitalResourceEndpoint"],
            "choose with the service (--service URN)",
        ),
    ] {
        let run = run(&[&["send"], arguments].concat(), b"");
        assert!(run.stderr.contains(advice), "{arguments:?}: {}", run.stderr);
        assert_eq!((run.status, &*run.stdout), (2, ""), "{arguments:?}");
    }
    let absent = run(
        &[
            "send",
            "1.1.1",
            "Standby",
            "--loopback",
            "--timeout",
            "300ms",
        ],
        b"",
    );
    assert!(
        absent.stderr.contains("1.1.1 did not acknowledge Standby"),
        "{absent:?}"
    );
    assert_eq!(absent.status, 1);
}
