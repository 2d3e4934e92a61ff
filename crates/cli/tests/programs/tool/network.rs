//! `jaus demo`, `node`, `discover` and `query` over the loopback interface.

use std::fs;

use jaus_test_kit::program::assert_refused;

use crate::support::{Running, jaus, own_group, run};

#[test]
fn the_demo_drives_a_mission_round_an_obstacle_or_says_why_it_can_not() {
    let demo = |flags: &[&str]| {
        run(
            &[&["demo", "--headless", "--seconds", "90"], flags].concat(),
            b"",
        )
    };
    // At the same time: demos on one computer do not mix.
    let (there, outside) = std::thread::scope(|scope| {
        let there = scope.spawn(|| demo(&["--to", "0,2"]));
        let outside = demo(&["--to", "200,0"]);
        (there.join().unwrap(), outside)
    });
    let stories = [&there.stdout, &outside.stdout];
    assert!(
        stories.iter().any(|it| it.contains("Another demo runs")),
        "{stories:?}"
    );
    in_order(
        &there.stdout,
        &[
            "system    starts 101.1.35, the communicator",
            "starts 101.3.36, the planner",
            "operator  takes control of the planner 101.3.36 with authority 150",
            "operator  sets the destination 0 m north and 2 m east of the start",
            "planner   all stages are ready: under way",
            "planner   arrived",
            " m north, ",
            "the vehicle has arrived",
        ],
    );
    assert!(!there.stdout.contains('\x1b'), "colours are for terminals");
    // Its log is not compared: nodes of other tests on the same loopback can cause warnings.
    assert_eq!(there.status, 0, "{}", there.stderr);

    in_order(
        &outside.stdout,
        &["planner   gives up (", "has not arrived"],
    );
    assert_eq!(outside.status, 1);

    for steering in [&[][..], &["--ackermann"]] {
        let round = demo(steering);
        let told = [
            "system    an obstacle appears on the path",
            "(the range sensor sees an obstacle on the path)",
            "planner   all stages are ready: under way",
            "planner   arrived",
        ];
        in_order(&round.stdout, &told);
        assert_eq!(round.status, 0, "{}", round.stderr);
    }
}

/// Checks that the parts are in a text, one after the other.
fn in_order(text: &str, parts: &[&str]) {
    let mut rest = text;
    for part in parts {
        let place = rest.find(part);
        let place = place.unwrap_or_else(|| panic!("no `{part}` in {text}"));
        rest = &rest[place + part.len()..];
    }
}

#[test]
fn a_node_is_discovered_queried_and_ends_cleanly() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let flags = [
        "--id", "103.1.7", "--name", "Mule", "--kind", "vehicle", "--stats",
    ];
    let mut node = Running::node(&[&flags, &*network].concat());
    let introduction = node.read_until("Ctrl-C");
    assert!(
        introduction.contains("subsystem 103  vehicle \"Mule\""),
        "{introduction}"
    );
    assert!(introduction.contains("UDP 127.0.0.1:"), "{introduction}");

    let found = run(&[&["discover", "--for", "2s"], &*network].concat(), b"");
    assert!(
        found.stdout.contains("    103.1.7  \"Mule\"\n"),
        "{found:?}"
    );
    assert!(
        found.stdout.contains("urn:jaus:jss:core:Liveness"),
        "{found:?}"
    );
    assert_eq!(found.status, 0);

    let found = run(
        &[&["discover", "--json", "--for", "2s"], &*network].concat(),
        b"",
    );
    let tree = &found.only_line()["subsystems"][0];
    assert_eq!(
        (&tree["subsystem"], &tree["name"]),
        (&103.into(), &"Mule".into())
    );
    assert_eq!(tree["nodes"][0]["components"][0]["component"], "103.1.7");

    let query = [
        "query",
        "103.1.7",
        "QueryIdentification",
        "{\"QueryType\":2}",
    ];
    let answer = run(&[&query, &*network].concat(), b"");
    let line = answer.only_line();
    assert_eq!(
        (&line["source"], &line["message"]),
        (&"103.1.7".into(), &"ReportIdentification".into())
    );
    assert_eq!(line["body"]["Identification"], "Mule");
    assert_eq!((answer.status, &*answer.stderr), (0, ""));

    assert_eq!(node.terminate(), Some(0));
}

#[test]
fn a_name_from_the_network_cannot_reprogram_the_terminal() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let name = "\x1b]0;PWN\x07\x1b[2J\r\nfake line";
    let mut node = Running::node(&[&["--id", "103.1.8", "--name", name], &*network].concat());
    let introduction = node.read_until("Ctrl-C");
    let found = run(&[&["discover", "--for", "2s"], &*network].concat(), b"");
    for text in [introduction, found.stdout] {
        assert!(!text.contains(['\x1b', '\x07', '\r']), "{text:?}");
        let escaped = r#""\u{1b}]0;PWN\u{7}\u{1b}[2J\r\nfake line""#;
        assert!(text.contains(escaped), "{text}");
    }
}

#[test]
fn whoever_comes_is_watched() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let mut watcher = Running::node(&[&["--id", "104.1.1"], &*network].concat());
    watcher.read_until("Ctrl-C");
    let _comer = Running::node(&[&["--id", "105.1.1", "--name", "Latecomer"], &*network].concat());
    let seen = watcher.read_until("105.1.1 offers");
    assert!(seen.contains("105.1.1 appeared"), "{seen}");
    assert!(seen.contains("Latecomer"), "{seen}");
}

#[test]
fn silence_is_told_with_who_did_not_answer_and_what_to_do() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let query = [
        "query",
        "9.1.1",
        "QueryHeartbeatPulse",
        "--timeout",
        "200ms",
    ];
    let asked = run(&[&query, &*network].concat(), b"");
    assert!(
        asked
            .stderr
            .contains("9.1.1 did not answer QueryHeartbeatPulse within 200 ms"),
        "{asked:?}"
    );
    assert!(asked.stderr.contains("--peer"), "{asked:?}");
    assert_eq!(asked.status, 1);

    let found = run(&[&["discover", "--for", "200ms"], &*network].concat(), b"");
    assert!(
        found.stderr.contains("no answer within 200 ms"),
        "{found:?}"
    );
    assert_eq!((found.status, &*found.stdout), (1, ""));
}

#[test]
fn a_message_of_a_service_that_the_component_does_not_list_fails_with_the_service() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let mut node = Running::node(&[&["--id", "103.1.9"], &*network].concat());
    node.read_until("Ctrl-C");
    let service = "urn:jaus:jss:core:Management";
    for (command, message) in [
        (
            &["query", "103.1.9", "QueryStatus", "--timeout", "20s"][..],
            "QueryStatus",
        ),
        (&["send", "103.1.9", "Standby"], "Standby"),
        (&["subscribe", "103.1.9", "QueryStatus"], "QueryStatus"),
    ] {
        let run = run(&[command, &*network].concat(), b"");
        let reason = format!("103.1.9 does not offer the service of {message}: {service}\n");
        assert!(run.stderr.ends_with(&reason), "{run:?}");
        assert_eq!(run.status, 1, "{command:?}");
    }
}

#[test]
fn a_wrong_flag_is_refused_with_what_would_be_right() {
    let config = std::env::temp_dir().join(format!("jaus-cli-{}.toml", std::process::id()));
    fs::write(&config, "id = \"103.1.7\"\nprot = 3794\n").unwrap();
    let config_path = config.to_str().unwrap();
    for (arguments, advice) in [
        (&["node", "--id", "103"][..], "subsystem.node.component"),
        (&["node", "--id", "103.1.255"], "1 to 254"),
        (&["node", "--id", "0.1.1"], "1 to 65534"),
        (
            &["node", "--interface", "nosuch0"],
            "there is no network interface `nosuch0`",
        ),
        (
            &["node", "--group", "10.0.0.1"],
            "224.0.0.0 to 239.255.255.255",
        ),
        (
            &["node", "--peer", "nobody"],
            "write the address of one host",
        ),
        (&["node", "--kind", "ship"], "vehicle, ocu, other"),
        (&["node", "--config", "no/such.toml"], "no/such.toml"),
        (&["node", "--config", config_path], "prot"),
        (&["demo", "--seconds", "soon"], "number of seconds"),
        (
            &["query", "103.1", "QueryStatus"],
            "subsystem.node.component",
        ),
        (
            &["query", "103.1.1", "QueryStatsu"],
            "there is no message QueryStatsu",
        ),
        (
            &["query", "103.1.1", "QueryStatsu"],
            "did you mean QueryStatus?",
        ),
        (
            &["query", "103.1.1", "QueryFoo"],
            "load that definition too",
        ),
        (
            &["query", "103.1.1", "QueryIdentification"],
            "'{\"QueryType\":2}'",
        ),
        (&["query", "103.1.1", "Resume"], "is not a query"),
        (&["query", "103.1.1", "QueryStatus", "{"], "not JSON"),
        (&["decode"], "FILE"),
        (&["frobnicate"], "frobnicate"),
        (&[], "Usage"),
    ] {
        let run = run(arguments, b"");
        assert!(run.stderr.contains(advice), "{arguments:?}: {}", run.stderr);
        assert_eq!((run.status, &*run.stdout), (2, ""), "{arguments:?}");
    }
    fs::remove_file(config).unwrap();
}

#[test]
fn a_settings_file_does_what_the_flags_do_and_flags_come_on_top() {
    let group = own_group();
    let config = std::env::temp_dir().join(format!("jaus-cli-own-{}.toml", std::process::id()));
    let text = format!(
        "id = \"106.1.1\"\nname = \"File\"\nkind = \"vehicle\"\ninterfaces = \"loopback\"\nport = 0\ngroup = \"{}\"\n",
        group[4]
    );
    fs::write(&config, text).unwrap();
    let mut node = Running::node(&["--config", config.to_str().unwrap(), "--name", "Flag"]);
    let introduction = node.read_until("Ctrl-C");
    fs::remove_file(config).unwrap();
    assert!(
        introduction.contains("subsystem 106  vehicle \"Flag\""),
        "{introduction}"
    );
    assert!(introduction.contains(&group[4]), "{introduction}");
}

#[test]
fn a_log_filter_that_makes_no_sense_is_refused() {
    let mut encode = jaus();
    encode.arg("encode").env("JAUS_LOG", "jaus=loud");
    assert_refused(&mut encode, "JAUS_LOG=jaus=loud");
}

#[test]
fn the_help_leads_from_the_demo_to_every_command() {
    let help = run(&["--help"], b"");
    for word in [
        "demo",
        "node",
        "discover",
        "query",
        "decode",
        "encode",
        "Exit status",
    ] {
        assert!(help.stdout.contains(word), "no {word} in {}", help.stdout);
    }
    assert_eq!(help.status, 0);
    for command in ["node", "discover", "query", "decode", "encode"] {
        let help = run(&[command, "--help"], b"");
        assert!(
            help.stdout.contains("Examples:"),
            "{command}: {}",
            help.stdout
        );
    }
}
