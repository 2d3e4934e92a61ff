//! `jaus vehicle` as a process, over the loopback interface.

use crate::support::{Running, own_group, run};

#[test]
fn the_vehicle_is_found_as_a_vehicle_tells_its_motion_and_ends_cleanly() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let flags = ["--id", "105.1.1", "--name", "Mule", "--at", "-33.9,18.4"];
    let mut vehicle = Running::command("vehicle", &[&flags, &*network].concat());
    let introduction = vehicle.read_until("Ctrl-C");
    for part in [
        "subsystem 105  vehicle \"Mule\"",
        "105.1.1  \"Navigation\"",
        "urn:jaus:jss:core:ListManager ",
        "urn:jaus:jss:mobility:LocalPoseSensor ",
        "urn:jaus:jss:mobility:LocalWaypointListDriver ",
        "urn:jaus:jss:mobility:PrimitiveDriver ",
    ] {
        assert!(introduction.contains(part), "no `{part}` in {introduction}");
    }
    let ask = |query: &str, body: &str| {
        let arguments = ["query", "105.1.1", query, body];
        run(&[&arguments, &*network].concat(), b"").only_line()["body"].take()
    };
    let velocity = ask("QueryVelocityState", "{\"PresenceVector\":320}");
    assert!(velocity["YawRate"] == 0.0 && velocity["TimeStamp"].is_object());
    assert!(velocity.get("Velocity_X").is_none(), "{velocity}");
    let pose = ask("QueryGlobalPose", "{\"PresenceVector\":3}");
    let latitude = pose["Latitude"].as_f64().unwrap();
    assert!((latitude + 33.9).abs() < 1e-6, "{pose}");
    assert_eq!(ask("QueryTravelSpeed", "{}")["Speed"], 0.0);
    assert_eq!(ask("QueryElementCount", "{}")["ElementCount"], 0);
    assert_eq!(vehicle.terminate(), Some(0));
}

#[test]
fn a_split_vehicle_has_two_components_and_only_the_second_drives() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let mut vehicle = Running::command(
        "vehicle",
        &[&["--id", "106.1", "--split"], &*network].concat(),
    );
    vehicle.read_until("106.1.1 is Platform Management, 106.1.2 Navigation");
    vehicle.read_until("Ctrl-C");
    let ask = |component: &str, query: &str, body: &str| {
        let arguments = ["query", component, query, body, "--timeout", "30s"];
        run(&[&arguments, &*network].concat(), b"").only_line()["body"].to_string()
    };
    for (component, name, drives) in [
        ("106.1.1", "Platform Management", false),
        ("106.1.2", "Navigation", true),
    ] {
        let told = ask(component, "QueryIdentification", "{\"QueryType\":4}");
        assert!(told.contains(name), "{told}");
        // By its number only, because the other component matches the name too.
        let number = &component[6..];
        let own = format!(
            "[{{\"NodeRec\":{{\"NodeID\":1}},\"ComponentList\":[{{\"ComponentID\":{number}}}]}}]"
        );
        let services = ask(component, "QueryServices", &own);
        assert!(services.contains("urn:jaus:jss:core:AccessControl"));
        let mobility = "urn:jaus:jss:mobility:PrimitiveDriver";
        assert_eq!(services.contains(mobility), drives, "{services}");
    }
    let judge = [
        "judge",
        "106.1.2",
        "--only",
        "A2,B2,B11",
        "--timeout",
        "30s",
    ];
    let judged = run(&[&judge, &*network].concat(), b"");
    assert_eq!(judged.status, 0, "{}", judged.stdout);
}

#[test]
fn flags_out_of_their_range_are_told_with_the_range() {
    for (flags, told) in [
        (["--speed", "0"], "write a number from 0.1 to 50"),
        (["--acceleration", "fast"], "write a number from 0.1 to 20"),
        (["--noise", "NaN"], "write a number from 0 to 0.5"),
        (["--turning-radius", "101"], "write a number from 0 to 100"),
        (["--at", "91,0"], "the latitude from -85 to 85"),
    ] {
        let run = run(&[&["vehicle"][..], &flags].concat(), b"");
        assert!(run.status == 2 && run.stderr.contains(told), "{run:?}");
        assert!(run.stderr.contains(flags[0]) && run.stderr.contains(flags[1]));
    }
    let run = run(
        &["vehicle", "--split", "--id", "101.1.254", "--loopback"],
        b"",
    );
    assert!(run.status == 2 && run.stderr.contains("--id"), "{run:?}");
}
