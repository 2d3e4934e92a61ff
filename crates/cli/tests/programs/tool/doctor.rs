//! `jaus doctor` on the loopback interface: findings, output and exit status.

use std::net::UdpSocket;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::support::{Running, own_group, run};
use serde_json::Value as Json;

/// The findings of one check.
fn of<'j>(report: &'j Json, check: &str) -> Vec<&'j Json> {
    let findings = report["findings"].as_array().unwrap();
    findings.iter().filter(|f| f["check"] == check).collect()
}

fn examine(flags: &[&str]) -> (i32, Json) {
    let run = run(&[&["doctor", "--json", "--for", "2s"], flags].concat(), b"");
    (run.status, run.only_line())
}

#[test]
fn a_sound_network_is_found_sound_and_the_neighbours_are_named() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let mut node = Running::node(&[&["--id", "107.1.9", "--name", "Mule"], &*network].concat());
    node.read_until("Ctrl-C");
    let (status, report) = examine(&[&*network, &["--id", "108.1.1"]].concat());
    assert_eq!(report["failures"], 0, "{report}");
    assert_ne!(status, 2);
    assert_eq!(of(&report, "multicast")[0]["verdict"], "ok", "{report}");
    let neighbours = of(&report, "neighbours");
    assert!(
        neighbours[0]["what"]
            .as_str()
            .unwrap()
            .starts_with("107.1.9 of \"Mule\" is at 127.0.0.1:"),
        "{report}"
    );
    let ids = of(&report, "ids");
    assert_eq!(ids[0]["what"], "no other node has the id 108.1.1");
}

/// No AS5669A program receives OpenJAUS's messages, which use another multicast group.
/// Held by the test that plays a system of the Reference Architecture, and by tests that must not
/// receive its messages: port and group of these systems are fixed.
pub(super) fn reference_architecture() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

#[test]
fn a_system_of_the_reference_architecture_is_named_with_the_way_to_it() {
    let _alone = reference_architecture();
    // Report Heartbeat Pulse of 20.1.35.1 to all node managers, as OpenJAUS sends it every second.
    let beat = b"JAUS01.0\x06\x02\x02\x42\x01\x01\xFF\xFF\x01\x23\x01\x14\0\0\0\0";
    let heart = UdpSocket::bind("127.0.0.1:0").unwrap();
    let over = AtomicBool::new(false);
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let (status, report) = std::thread::scope(|scope| {
        scope.spawn(|| {
            while !over.load(Ordering::Relaxed) {
                heart.send_to(beat, "224.1.0.1:3794").unwrap();
                std::thread::sleep(Duration::from_millis(100));
            }
        });
        let examined = examine(&network);
        over.store(true, Ordering::Relaxed);
        examined
    });
    let neighbours = of(&report, "neighbours");
    let told = neighbours.iter().find(|it| {
        it["what"]
            .as_str()
            .unwrap()
            .contains("subsystem 20 of the Ref")
    });
    let advice = told.expect("OpenJAUS")["advice"].as_str().unwrap();
    assert!(advice.contains("jaus-ra-gateway"), "{advice}");
    assert_ne!(status, 2, "{report}");
}

#[test]
fn two_nodes_with_one_id_are_found() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let start = || {
        let mut node = Running::node(&[&["--id", "109.1.1"], &*network].concat());
        node.read_until("Ctrl-C");
        node
    };
    let _twins = [start(), start()];
    let (status, report) = examine(&[&*network, &["--id", "109.1.1"]].concat());
    let ids = of(&report, "ids");
    assert_eq!(
        (status, &ids[0]["verdict"]),
        (1, &"failed".into()),
        "{report}"
    );
    assert!(
        ids[0]["what"]
            .as_str()
            .unwrap()
            .starts_with("109.1.1 sends from")
    );
    assert!(
        ids[0]["advice"]
            .as_str()
            .unwrap()
            .contains("two nodes have this id")
    );
    assert!(
        ids[1]["what"]
            .as_str()
            .unwrap()
            .starts_with("109.1.1 runs on this host")
    );
}

#[test]
fn a_port_that_is_taken_is_told_with_who_has_it() {
    let group = own_group();
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let flags = ["--loopback", "--port", &port, "--group", &group[4]];
    let (status, report) = examine(&flags);
    assert_eq!(status, 1, "{report}");
    let ports = of(&report, "port");
    assert_eq!(ports[0]["verdict"], "warning", "{report}");
    let what = ports[0]["what"].as_str().unwrap();
    assert!(
        what.starts_with(&format!("UDP 127.0.0.1:{port} is taken")),
        "{what}"
    );
    if cfg!(target_os = "linux") {
        assert!(what.contains(&std::process::id().to_string()), "{what}");
    }
}

#[test]
fn a_name_cannot_forge_a_finding() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let name = "Mule\u{1b}[2J\u{202e}\nfailed   ids";
    let mut node = Running::node(&[&["--id", "107.1.9", "--name", name], &*network].concat());
    node.read_until("Ctrl-C");
    let run = run(&[&["doctor", "--for", "1s"], &*network].concat(), b"");
    assert!(
        run.stdout.contains(r#""Mule\u{1b}[2J\u{202e}\nfailed"#),
        "{run:?}"
    );
    let is_forged = |line: &str| line.starts_with("failed   ids");
    assert!(!run.stdout.lines().any(is_forged), "{run:?}");
    let is_raw = |c: char| c.is_control() && c != '\n' || c == '\u{202e}';
    assert!(!run.stdout.contains(is_raw), "{run:?}");
}

#[test]
fn a_program_that_keeps_the_group_for_itself_is_a_problem() {
    let selfish = UdpSocket::bind("0.0.0.0:0").unwrap();
    let port = selfish.local_addr().unwrap().port();
    let group = format!("239.255.77.1:{port}");
    let (status, report) = examine(&["--loopback", "--group", &group]);
    assert_eq!(status, 1, "{report}");
    let ports = of(&report, "port");
    let what = ports[0]["what"].as_str().unwrap();
    assert!(
        what.contains("cannot be received") && what.contains("Junior"),
        "{what}"
    );
    let advice = ports[0]["advice"].as_str().unwrap();
    assert!(
        advice.contains("--junior") && advice.contains("--group off --port 0"),
        "{advice}"
    );
}

#[test]
fn with_mistakes_in_the_settings_it_cannot_run() {
    let file = std::env::temp_dir().join(format!("jaus-doctor-{}.toml", std::process::id()));
    std::fs::write(&file, "interfaces = \"loopback\"\nprot = 3794\n").unwrap();
    let run = run(&["doctor", "--config", file.to_str().unwrap()], b"");
    std::fs::remove_file(&file).unwrap();
    assert!(run.stderr.contains(":2: `prot = 3794`:"), "{run:?}");
    assert!(run.stderr.contains("did you mean `port`?"), "{run:?}");
    assert_eq!((run.status, &*run.stdout), (2, ""));
}

/// The next line with these words in its JSON.
#[track_caller]
fn next_with(watch: &mut Running, words: &[&str]) -> Json {
    loop {
        let line = watch.read_until("\n");
        let event: Json = serde_json::from_str(&line).unwrap();
        if words.iter().all(|word| line.contains(word)) {
            return event;
        }
    }
}

#[test]
fn a_watch_prints_the_findings_once_and_then_differences_until_a_signal() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let flags = [&["--json", "--watch=200ms"], &*network].concat();
    let mut watch = Running::endless("doctor", &[&flags, &["--for", "1s"][..]].concat());
    let alone = next_with(&mut watch, &["\"neighbours\""]);
    assert_eq!(alone["event"], "new", "{alone}");
    let mut node = Running::node(&[&["--id", "109.1.9", "--name", "Mule"], &*network].concat());
    node.read_until("Ctrl-C");
    let over = next_with(&mut watch, &["\"neighbours\"", "\"over\""]);
    assert_eq!(over["what"], alone["what"]);
    next_with(&mut watch, &["\"new\"", "109.1.9"]);
    drop(node);
    next_with(&mut watch, &["\"over\"", "109.1.9"]);
    // A warning, because there is no other node.
    assert_eq!(watch.terminate(), Some(1));
}
