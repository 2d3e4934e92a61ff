//! `jaus ping` over the loopback interface.

use crate::support::{Running, own_group, run};

#[test]
fn a_component_that_is_there_answers_and_its_round_trips_are_summed_up() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let mut node = Running::node(&[&["--id", "103.1.7"], &*network].concat());
    node.read_until("Ctrl-C");
    let ping = |flags: &[&str]| {
        let fixed = [
            "ping",
            "103.1.7",
            "--count",
            "3",
            "--interval",
            "10ms",
            "--timeout",
            "5s",
        ];
        run(&[&fixed, flags, &*network].concat(), b"")
    };
    let asked = ping(&[]);
    assert!(
        asked.stdout.contains("   3  heartbeat from 127.0.0.1:"),
        "{asked:?}"
    );
    assert!(
        asked
            .stdout
            .contains("3 queries, 3 answers, 0 % lost; min "),
        "{asked:?}"
    );
    assert_eq!((asked.status, &*asked.stderr), (0, ""));
    let lines = ping(&["--json"]).json();
    assert_eq!(
        (&lines[0]["query"], &lines[0]["with"]),
        (&1.into(), &"heartbeat".into())
    );
    assert!(
        lines[0]["ms"].as_f64() >= lines[3]["min_ms"].as_f64(),
        "{lines:?}"
    );
    assert_eq!(lines[3]["answers"], 3);
    let large = ping(&["--size", "100000"]);
    assert!(
        large.stdout.contains("   3  acknowledgement: "),
        "{large:?}"
    );
    let named = ping(&["--with", "identification"]);
    assert!(
        named.stdout.contains("   1  identification from "),
        "{named:?}"
    );
}

#[test]
fn silence_is_told_with_what_to_do_about_it() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let flags = ["ping", "103.1.99", "--count", "1", "--timeout", "50ms"];
    let asked = run(&[&flags, &*network].concat(), b"");
    assert!(
        asked.stdout.contains("1 queries, 0 answers, 100 % lost"),
        "{asked:?}"
    );
    assert!(
        asked.stderr.contains("103.1.99 did not answer"),
        "{asked:?}"
    );
    assert_eq!(asked.status, 1);
    let everybody = run(&["ping", "103.1.255"], b"");
    assert!(
        everybody
            .stderr
            .contains("103.1.255 is not a single component"),
        "{everybody:?}"
    );
    assert_eq!(everybody.status, 2);
}
