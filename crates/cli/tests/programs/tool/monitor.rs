//! `jaus monitor` and the statistics of `jaus node`, over the loopback interface.

use crate::support::{Running, own_group, run};

#[test]
fn a_neighbour_is_shown_with_its_name_rates_and_round_trip() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let mut node = Running::node(&[&["--id", "111.1.9", "--name", "Mule"], &*network].concat());
    node.read_until("Ctrl-C");
    let flags = [
        "monitor",
        "--json",
        "--probe",
        "--for",
        "3s",
        "--interval",
        "500ms",
    ];
    let watched = run(&[&flags, &*network].concat(), b"");
    let views = watched.json();
    let last = views.last().unwrap();
    let peer = &last["peers"][0];
    assert_eq!(
        (&peer["id"], &peer["name"], &peer["header"]),
        (&"111.1.9".into(), &"Mule".into(), &"judp2".into()),
        "{last}"
    );
    assert!(peer["round_trip_ms"].as_f64().unwrap() > 0.0, "{last}");
    assert!(
        last["links"][0]["link"]
            .as_str()
            .unwrap()
            .contains("127.0.0.1:")
    );
    let heard = |view: &serde_json::Value| view["peers"][0]["received_per_s"].as_f64();
    assert!(
        views.iter().filter_map(heard).any(|rate| rate > 0.0),
        "{views:?}"
    );
    assert_eq!((watched.status, &*watched.stderr), (0, ""));
}

#[test]
fn one_table_has_the_names_of_components_and_says_whether_any_is_there() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let once = [&["monitor", "--once", "--interval", "300ms"], &*network].concat();
    let alone = run(&once, b"");
    assert!(alone.stdout.contains("no peers yet"), "{alone:?}");
    assert_eq!(alone.status, 1);

    let mut node = Running::node(
        &[
            &["--id", "112.1.1", "--name", "A very long name"],
            &*network,
        ]
        .concat(),
    );
    node.read_until("Ctrl-C");
    let once = [&["monitor", "--once", "--interval", "2s"], &*network].concat();
    let seen = run(&once, b"");
    // The name of the component, which has that of the subsystem.
    assert!(
        seen.stdout
            .contains("112.1.1      A very long name 127.0.0.1:"),
        "{}",
        seen.stdout
    );
    assert!(!seen.stdout.contains('\x1b'), "{}", seen.stdout);
    assert_eq!(seen.status, 0);
}

#[test]
fn the_only_table_has_the_components_own_name_and_with_probe_the_round_trip() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let mut vehicle = Running::command(
        "vehicle",
        &[&["--id", "114.1.1", "--name", "Mule"], &*network].concat(),
    );
    vehicle.read_until("Ctrl-C");
    let flags = ["monitor", "--once", "--probe", "--json", "--interval", "2s"];
    let seen = run(&[&flags, &*network].concat(), b"");
    let peer = &seen.only_line()["peers"][0];
    assert_eq!(peer["name"], "Navigation", "{seen:?}");
    assert_eq!(peer["subsystem"], "Mule", "{seen:?}");
    assert!(peer["round_trip_ms"].as_f64() > Some(0.0), "{seen:?}");
}

#[test]
fn a_node_tells_its_statistics_now_and_then() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let mut node = Running::node(&[&["--id", "113.1.1", "--stats=200ms"], &*network].concat());
    node.read_until("Ctrl-C");
    for _ in 0..2 {
        let told = node.read_until("component 113.1.1: ");
        assert!(told.contains("datagrams sent"), "{told}");
        assert!(told.contains("link lo 127.0.0.1:"), "{told}");
    }
    let wrong = run(&[&["node", "--stats=5"], &*network].concat(), b"");
    assert!(wrong.stderr.contains("`5` is not a time"), "{wrong:?}");
}

#[test]
fn the_clock_of_a_neighbour_with_the_time_service_is_measured() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let mut vehicle = Running::command("vehicle", &[&["--id", "115.1.1"], &*network].concat());
    vehicle.read_until("Ctrl-C");
    let flags = [
        "monitor",
        "--once",
        "--clocks",
        "--json",
        "--interval",
        "3s",
    ];
    let seen = run(&[&flags, &*network].concat(), b"");
    let clock = &seen.only_line()["peers"][0]["clock"];
    let number = |key: &str| clock[key].as_f64().unwrap_or(f64::NAN);
    // Both are of this host.
    let (ahead, uncertainty) = (number("ahead_ms"), number("uncertainty_ms"));
    assert!(ahead.abs() <= uncertainty, "{seen:?}");
    assert_eq!(clock["steps"], 0, "{seen:?}");
}
