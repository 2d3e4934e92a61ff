//! Outputs of the judge: report, JSON lines, JUnit XML, recording, exit status.

use std::fs;
use std::path::PathBuf;

use jaus::messages::core::{access_control, liveness};

use crate::support::run;
use crate::tool::judge::peer::{Peer, free_port, network};

/// A test's own file, removed when dropped.
struct OutputFile(PathBuf);

impl OutputFile {
    fn new(name: &str) -> Self {
        Self(std::env::temp_dir().join(format!("jaus-judge-{}-{name}", std::process::id())))
    }

    fn path(&self) -> &str {
        self.0.to_str().unwrap()
    }

    fn read(&self) -> String {
        fs::read_to_string(&self.0).unwrap()
    }
}

impl Drop for OutputFile {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

#[test]
fn what_is_not_offered_is_skipped_and_counted_and_the_rest_conforms_as_tested() {
    let flags = network();
    let _peer = Peer::offering(&[liveness::URN]).start(&flags);
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let judge = ["judge", "105.1.1", "--only", "A2-A4,B1-B6"];
    let run = run(&[&judge, &*network].concat(), b"");
    for part in [
        "105.1.1 \"Puppet\" offers",
        "    urn:jaus:jss:core:Liveness 1.1",
        "by multicast, to all components of the node",
        "  ok       A2   Capabilities discovery",
        "  skipped  A3   System management  (AccessControl is not offered)",
        "by unicast, to the component",
        "  ok       B6   Query Heartbeat Pulse during the event",
        "8 ok, 0 failed, 10 skipped",
        "105.1.1 conforms to the contests' script as tested: 8 steps passed; 10 steps did not apply",
    ] {
        assert!(run.stdout.contains(part), "no `{part}` in {}", run.stdout);
    }
    assert!(!run.stdout.contains('\x1b'), "colours are for terminals");
    assert_eq!((run.status, &*run.stderr), (0, ""));
}

#[test]
fn names_of_a_peer_and_its_services_cannot_forge_lines_of_the_report() {
    let flags = network();
    let urn = "urn:ours:x\n  ok       C5   Emergency";
    let peer = Peer::offering(&[liveness::URN, urn]).named("Pup\u{1b}]0;x\u{7}pet\n\u{202e}offers");
    let _peer = peer.start(&flags);
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let judge = ["judge", "105.1.1", "--unicast", "--only", "A2"];
    let run = run(&[&judge, &*network].concat(), b"");
    for part in [
        r#"105.1.1 "Pup\u{1b}]0;x\u{7}pet\n\u{202e}offers" offers"#,
        r#"    "urn:ours:x\n  ok       C5   Emergency" 1.1"#,
    ] {
        assert!(run.stdout.contains(part), "no `{part}` in {}", run.stdout);
    }
    let is_raw = |c: char| c.is_control() && c != '\n' || c == '\u{202e}';
    assert!(!run.stdout.contains(is_raw), "{run:?}");
}

#[test]
fn a_run_is_written_down_in_every_form_that_is_asked_for() {
    let flags = network();
    let _peer = Peer::offering(&[liveness::URN, access_control::URN]).start(&flags);
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let (json, junit, record) = (
        OutputFile::new("json"),
        OutputFile::new("xml"),
        OutputFile::new("pcapng"),
    );
    let json_flag = format!("--json={}", json.path());
    let port = free_port().to_string();
    let judge = [
        "judge",
        "105.1.1",
        "--multicast",
        "--timeout",
        "200ms",
        "--only",
        "B3,B6,B13",
        &json_flag,
        "--junit",
        junit.path(),
        "--record",
        record.path(),
        "--port",
        &port,
    ];
    let judged = run(&[&judge, &*network].concat(), b"");
    assert_eq!((judged.status, &*judged.stderr), (1, ""), "{judged:?}");
    assert!(
        judged
            .stdout
            .contains("does not conform to the contests' script as tested: 1 step failed"),
        "{judged:?}"
    );

    let lines = json.read();
    let lines: Vec<serde_json::Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(lines.len(), 4);
    assert_eq!(lines[0]["verdict"], "skipped");
    let exchange = &lines[1]["proceedings"][0];
    assert_eq!(exchange["sent"]["destination"], "105.1.255");
    assert_eq!(exchange["received"][0]["message"], "ReportHeartbeatPulse");
    assert!(exchange["latency_ms"].as_f64().unwrap() > 0.0);
    assert_eq!(
        lines[2]["reason"],
        "no ReportControl reached 42.2.1 within 0.2 s"
    );
    assert_eq!(
        (&lines[3]["failed"], &lines[3]["conforms"]),
        (&1.into(), &false.into())
    );

    let xml = junit.read();
    assert!(
        xml.contains("tests=\"3\" failures=\"1\" errors=\"0\" skipped=\"1\""),
        "{xml}"
    );
    assert!(
        xml.contains("<skipped message=\"Events is not offered\"/>"),
        "{xml}"
    );
    assert!(
        xml.contains("<failure message=\"no ReportControl reached 42.2.1 within 0.2 s\">"),
        "{xml}"
    );

    let group_port = flags.last().unwrap().rsplit(':').next().unwrap();
    let ports = ["--port", group_port, "--port", &port];
    let decoded = run(&[&["decode", record.path()], &ports[..]].concat(), b"");
    let of_step: Vec<_> = decoded
        .stdout
        .lines()
        .filter(|line| line.contains("HeartbeatPulse"))
        .collect();
    assert!(
        of_step
            .iter()
            .any(|line| line.contains("\"source\":\"105.1.1\"")),
        "{decoded:?}"
    );
    assert!(
        of_step
            .iter()
            .any(|line| line.contains("\"destination\":\"105.1.255\"")),
        "{decoded:?}"
    );
    assert_eq!(decoded.status, 0);
}

#[test]
fn a_peer_that_is_not_there_is_told_with_what_to_do() {
    let flags = network();
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let judge = ["judge", "9.1.1", "--timeout", "100ms"];
    let run = run(&[&judge, &*network].concat(), b"");
    assert!(run.stderr.contains("9.1.1 did not answer"), "{run:?}");
    assert!(run.stderr.contains("--peer"), "{run:?}");
    assert_eq!(run.status, 1);
}

#[test]
fn a_wrong_flag_is_refused_with_what_would_be_right() {
    for (arguments, advice) in [
        (&["judge"][..], "ADDRESS"),
        (&["judge", "105.1.255"], "one component at a time"),
        (
            &["judge", "105.1.1", "--only", "D1"],
            "write A1 to A6, B1 to B36 or C1 to C5",
        ),
        (
            &["judge", "105.1.1", "--service", "Livness"],
            "there is no service Livness",
        ),
        (
            &["judge", "105.1.1", "--only", "B37"],
            "there is no step B37",
        ),
        (&["judge", "105.1.1", "--only", "B9-B3"], "write B3-B9"),
        (&["judge", "105.1.1", "--timeout", "soon"], "is not a time"),
        (
            &["judge", "105.1.1", "--unicast", "--multicast"],
            "cannot be used with",
        ),
        (&["judge", "105.1.1", "--attach"], "omit --attach"),
        (
            &[
                "judge",
                "105.1.1",
                "--loopback",
                "--record",
                "/no/such/file",
            ],
            "/no/such/file",
        ),
    ] {
        let run = run(arguments, b"");
        assert!(run.stderr.contains(advice), "{arguments:?}: {}", run.stderr);
        assert_eq!((run.status, &*run.stdout), (2, ""), "{arguments:?}");
    }
}

#[test]
fn a_service_is_walked_through_by_its_definition() {
    let flags = network();
    let _peer = Peer::offering(&[liveness::URN]).start(&flags);
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let judge = ["judge", "105.1.1", "--service", "Liveness", "--unicast"];
    let run = run(&[&judge, &*network].concat(), b"");
    let conclusion = "105.1.1 conforms to urn:jaus:jss:core:Liveness as tested: 1 step passed";
    assert!(run.stdout.contains(conclusion), "{run:?}");
    assert_eq!(run.status, 0);
}

#[test]
fn the_steps_can_be_listed_without_a_network() {
    let run = run(&["judge", "--list"], b"");
    assert_eq!(run.stdout.lines().count(), 47);
    assert!(
        run.stdout
            .starts_with("A1   Transport discovery  (Discovery)\n"),
        "{run:?}"
    );
    assert_eq!((run.status, &*run.stderr), (0, ""));
}
