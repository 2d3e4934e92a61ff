//! `jaus control` of a vehicle, over the loopback interface.

use crate::support::{Running, own_group, run};

fn vehicle(id: &str) -> (Running, Vec<String>) {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let mut vehicle = Running::command("vehicle", &[&["--id", id], &*network].concat());
    vehicle.read_until("Ctrl-C");
    (vehicle, group)
}

#[test]
fn actions_are_done_in_turn_and_control_is_released_at_the_end() {
    let (mut vehicle, group) = vehicle("109.1.1");
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let arguments = [
        "control",
        "109.1.1",
        "resume",
        "standby",
        "--authority",
        "99",
    ];
    let done = run(&[&arguments, &*network].concat(), b"");
    let mut rest = &*done.stdout;
    for words in ["109.1.1 is ready", "stands by", "109.1.1 is released"] {
        let place = rest.find(words);
        let place = place.unwrap_or_else(|| panic!("no `{words}` in {done:?}"));
        rest = &rest[place..];
    }
    assert_eq!((done.status, &*done.stderr), (0, ""));
    for event in ["authority 99", "is ready", "is standby", "no client"] {
        vehicle.read_until(event);
    }
}

#[test]
fn while_it_holds_it_takes_actions_from_its_input() {
    let (_vehicle, group) = vehicle("109.1.2");
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let arguments = ["control", "109.1.2", "--json"];
    let input = b"resume\nwarp\nemergency\nclear\nrelease\n";
    let held = run(&[&arguments, &*network].concat(), input);
    let events: Vec<_> = held.json();
    let events: Vec<_> = events
        .iter()
        .filter_map(|it| it["event"].as_str())
        .collect();
    let mut rest = events.iter();
    for event in ["standby", "ready", "emergency", "clear", "released"] {
        assert!(rest.any(|it| *it == event), "{event} in {events:?}");
    }
    let advice =
        "no action \"warp\": write hold, resume, standby, emergency, clear, clear-all, release";
    assert!(held.stderr.contains(advice), "{held:?}");
    assert_eq!(held.status, 0);
}

#[test]
fn refused_control_is_a_negative_result_with_its_reason() {
    let (_vehicle, group) = vehicle("109.1.3");
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let control = |id: &str, flags: &[&str]| {
        let refused = run(
            &[&["control", id, "resume"], flags, &*network].concat(),
            b"",
        );
        assert_eq!((refused.status, &*refused.stdout), (1, ""), "{refused:?}");
        refused.stderr
    };
    let refused = control("109.1.3", &["--authority", "0"]);
    assert!(refused.contains("no control of 109.1.3: "), "{refused}");
    let silent = control("109.1.9", &["--timeout", "300ms"]);
    let told = "109.1.9 did not answer the request for control within 300 ms";
    assert!(silent.contains(told), "{silent}");
}
