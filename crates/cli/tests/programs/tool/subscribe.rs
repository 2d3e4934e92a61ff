//! `jaus subscribe`, and the fields that queries request, over the loopback interface.

use serde_json::Value as Json;

use crate::support::{Running, own_group, run};

/// A vehicle on a network of this test alone: the process and the flags of the network.
fn vehicle(id: &str) -> (Running, Vec<String>) {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let mut vehicle = Running::command("vehicle", &[&["--id", id], &*network].concat());
    vehicle.read_until("Ctrl-C");
    (vehicle, group)
}

#[test]
fn each_report_is_a_line_with_the_chosen_fields_and_the_figures_of_its_subscription() {
    let (_vehicle, group) = vehicle("107.1.1");
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let flags = [
        "107.1.1",
        "QueryVelocityState",
        "QueryLocalPose",
        "--fields",
        "velocity_x,YawRate,X",
        "--hz",
        "20",
        "--json",
    ];
    let mut subscriber = Running::command("subscribe", &[&flags, &*network].concat());
    subscriber.read_until("\"event\":\"up\"");
    let mut bodies = Vec::new();
    for (report, event) in [
        ("ReportVelocityState", "Velocity"),
        ("ReportLocalPose", "Pose"),
    ] {
        let read = subscriber.read_until(&format!("\"message\":\"{report}\""));
        let line: Json = serde_json::from_str(read.lines().last().unwrap()).unwrap();
        assert_eq!(line["source"], "107.1.1", "{event}");
        assert_eq!(line["lost"], 0);
        assert!(line["age"].as_f64().is_some(), "{line}");
        bodies.push(line["body"].clone());
    }
    let names = |body: &Json| {
        body.as_object()
            .unwrap()
            .keys()
            .cloned()
            .collect::<Vec<_>>()
    };
    assert_eq!(names(&bodies[0]), ["Velocity_X", "YawRate"]);
    assert_eq!(names(&bodies[1]), ["X"]);
    // Once it has measured it, each line has the rate.
    subscriber.read_until("\"hz\":1");
    assert_eq!(subscriber.terminate(), Some(0));
}

#[test]
fn people_read_units_and_the_figures_at_the_end() {
    let (_vehicle, group) = vehicle("107.1.2");
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let flags = [
        "107.1.2",
        "QueryVelocityState",
        "QueryStatus",
        "--on-change",
    ];
    let mut subscriber = Running::command("subscribe", &[&flags, &*network].concat());
    subscriber.read_until("subscribed to QueryVelocityState of 107.1.2 on change");
    let read = subscriber.read_until("ReportVelocityState");
    assert!(read.contains("  Velocity_X 0 m/s  "), "{read}");
    let status = subscriber.read_until("ReportStatus");
    assert!(status.contains("  Status STANDBY"), "{status}");
    subscriber.signal("-TERM");
    let end = subscriber.read_until("QueryVelocityState of 107.1.2:");
    assert!(end.contains("0 lost, the last "), "{end}");
}

#[test]
fn a_field_is_found_by_name_and_a_wrong_one_gets_a_suggestion() {
    let (_vehicle, group) = vehicle("107.1.3");
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let query = |fields: &[&str]| {
        let arguments = ["query", "107.1.3", "QueryLocalPose"];
        run(&[&arguments, fields, &*network].concat(), b"")
    };
    let body = query(&["--fields", "x,yaw"]).only_line()["body"].to_string();
    assert_eq!(body, r#"{"X":0.0,"Yaw":0.0}"#);
    let all = query(&[]).only_line()["body"].to_string();
    assert!(all.contains("\"Z\":") && all.contains("TimeStamp"), "{all}");
    let wrong = query(&["--fields", "Yav"]);
    let advice = "QueryLocalPose has no field Yav; did you mean Yaw?";
    assert!(wrong.stderr.contains(advice), "{wrong:?}");
    assert_eq!(wrong.status, 2);
}

#[test]
fn a_refused_subscription_is_a_negative_result_with_the_reason_of_the_peer() {
    let (_vehicle, group) = vehicle("107.1.4");
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let arguments = ["subscribe", "107.1.4", "QueryRasterMaps"];
    let refused = run(&[&arguments, &*network].concat(), b"");
    assert!(
        refused
            .stderr
            .contains("no subscription to QueryRasterMaps of 107.1.4: the peer refuses it"),
        "{refused:?}"
    );
    assert_eq!((refused.status, &*refused.stdout), (1, ""));
}

#[test]
fn a_report_as_text_has_units_and_names_of_values() {
    let (_vehicle, group) = vehicle("108.1.1");
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let asked = |query: &str| {
        let arguments = ["query", "108.1.1", query, "--text"];
        run(&[&arguments, &*network].concat(), b"").stdout
    };
    let velocity = asked("QueryVelocityState");
    let begin = "108.1.1  ReportVelocityState  ";
    assert!(velocity.starts_with(begin), "{velocity}");
    assert!(velocity.contains("  Velocity_X 0 m/s"), "{velocity}");
    let status = asked("QueryStatus");
    assert!(status.contains("  Status STANDBY"), "{status}");
}

#[test]
fn the_age_of_samples_follows_from_their_time_stamps_and_the_clock_of_the_component() {
    let (_vehicle, group) = vehicle("107.1.6");
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let flags = [
        "107.1.6",
        "QueryLocalPose",
        "--hz",
        "10",
        "--clock",
        "--json",
    ];
    let mut subscriber = Running::command("subscribe", &[&flags, &*network].concat());
    // A report with a stamp, once the clock is measured.
    let read = subscriber.read_until("\"sampled\":");
    let report: serde_json::Value = serde_json::from_str(read.lines().last().unwrap()).unwrap();
    let number = |key: &str| report["sampled"][key].as_f64().unwrap();
    let (age, uncertainty) = (number("age"), number("uncertainty"));
    assert!(age >= -uncertainty && age < 5.0, "{report}");
}
