//! `--json` of commands that run for a while: one object a line, as events come.

use std::process::Command;

use serde_json::Value as Json;

use crate::support::{Message, Running, jaus, own_group, pcap_of, run};

/// The next object with this event.
fn event(running: &mut Running, event: &str) -> Json {
    let read = running.read_until(&format!("\"event\":\"{event}\""));
    let line: Json = serde_json::from_str(read.lines().last().unwrap()).unwrap();
    assert!(line["seconds"].as_f64().is_some(), "{line}");
    line
}

#[test]
fn nodes_and_vehicles_print_their_start_changes_and_state() {
    let group = own_group();
    let network: Vec<&str> = group.iter().map(String::as_str).collect();
    let flags = ["--id", "118.1.1", "--json", "--stats"];
    let mut node = Running::node(&[&flags, &*network].concat());
    let started = event(&mut node, "started");
    assert_eq!(started["id"], "118.1.1");
    assert_eq!(started["links"][0]["interface"], "lo", "{started}");
    let flags = ["--id", "119.1.1", "--json"];
    let mut vehicle = Running::command("vehicle", &[&flags, &*network].concat());
    loop {
        let standing = event(&mut vehicle, "standing");
        assert_eq!(standing["controller"], Json::Null, "{standing}");
        if standing["state"] == "standby" {
            break;
        }
    }
    let found = event(&mut node, "discovery");
    assert!(found["change"].is_string(), "{found}");
    node.signal("-TERM");
    let statistics = event(&mut node, "statistics");
    let counters = statistics["counters"].as_object().unwrap();
    assert!(!counters.is_empty(), "{statistics}");
}

#[test]
fn the_demo_tells_its_story_in_objects() {
    let told = run(
        &[
            "demo",
            "--headless",
            "--json",
            "--seconds",
            "2",
            "--to",
            "0,2",
        ],
        b"",
    );
    let events = told.json();
    let starts = |it: &&Json| it["event"] == "story" && it["actor"] == "system";
    assert!(events.iter().any(|it| starts(&it)), "{told:?}");
    let last = events.last().unwrap();
    assert_eq!(
        (&last["event"], &last["arrived"]),
        (&"end".into(), &false.into())
    );
    assert_eq!(told.status, 1);
}

#[test]
fn a_replay_and_a_recording_count_in_objects() {
    let directory = tempdir("events");
    let file = directory.join("in.pcap");
    std::fs::write(&file, pcap_of(&[Message::new(&[0x02, 0x22]).datagram()])).unwrap();
    let file = file.to_str().unwrap();
    let replayed = run(&["replay", file, "--json", "--to", "127.0.0.1:9"], b"");
    let events = replayed.json();
    assert_eq!(events[0]["event"], "capture");
    assert_eq!(events[0]["senders"]["42.1.1"], 1, "{replayed:?}");
    assert_eq!(events[0]["left_out"]["not_jaus"], 0, "{replayed:?}");
    assert_eq!(
        (&events[1]["event"], &events[1]["datagrams"]),
        (&"sent".into(), &1.into())
    );

    let output = directory.join("out.pcapng");
    let output = output.to_str().unwrap();
    let flags = [
        "record",
        output,
        "--interface",
        "lo",
        "--for",
        "500ms",
        "--json",
    ];
    let recorded = run(&flags, b"");
    let last = recorded.json().pop().unwrap();
    assert_eq!(last["event"], "end", "{recorded:?}");
    assert!(last["octets"].as_u64() > Some(0) && last["packets"].is_u64());
    let both = run(&["record", "-", "--json"], b"");
    assert!(
        both.status == 2 && both.stderr.contains("name a file"),
        "{both:?}"
    );
    std::fs::remove_dir_all(directory).unwrap();
}

#[test]
fn a_recording_goes_to_standard_output_for_a_pipe() {
    let group = own_group();
    let network = group.join(" ");
    let at = group.last().unwrap();
    let tool = env!("CARGO_BIN_EXE_jaus");
    let script = format!(
        "{tool} record - --interface lo --group {at} --port {} --for 3s --quiet | {tool} decode - &\n\
         sleep 1; {tool} discover {network} --for 500ms > /dev/null 2>&1; wait",
        at.rsplit(':').next().unwrap()
    );
    let directory = tempdir("pipe");
    let piped = Command::new("bash")
        .args(["-c", &script])
        .current_dir(&directory)
        .output()
        .unwrap();
    let printed = String::from_utf8(piped.stdout).unwrap();
    assert!(printed.contains("QueryIdentification"), "{printed}");
    assert!(!directory.join("-").exists());
    std::fs::remove_dir_all(directory).unwrap();
}

#[test]
fn a_replay_takes_the_name_of_an_interface() {
    let directory = tempdir("interface");
    let file = directory.join("in.pcap");
    std::fs::write(&file, pcap_of(&[Message::new(&[0x02, 0x22]).datagram()])).unwrap();
    let file = file.to_str().unwrap();
    let to = ["--to", "127.0.0.1:9", "--interface"];
    let replay = |interface| run(&[&["replay", file][..], &to, &[interface]].concat(), b"");
    for interface in ["lo", "127.0.0.1"] {
        assert_eq!(replay(interface).status, 0, "{interface}");
    }
    let wrong = replay("eth77");
    assert!(
        wrong.stderr.contains("no network interface `eth77`"),
        "{wrong:?}"
    );
    assert!(wrong.stderr.contains("lo 127.0.0.1"), "{wrong:?}");
    std::fs::remove_dir_all(directory).unwrap();
}

#[test]
fn help_wraps_at_the_width_of_the_terminal() {
    for command in ["query", "monitor", "record"] {
        let help = jaus()
            .args([command, "-h"])
            .env("COLUMNS", "50")
            .output()
            .unwrap();
        let help = String::from_utf8(help.stdout).unwrap();
        let (usage, _) = help.split_once("Examples:").unwrap();
        let options = usage.split_once("Options:").unwrap().1;
        for line in options.lines() {
            assert!(line.chars().count() <= 50, "{command}: {line}");
        }
    }
}

fn tempdir(name: &str) -> std::path::PathBuf {
    let name = format!("jaus-{}-{name}", std::process::id());
    let directory = std::env::temp_dir().join(name);
    std::fs::create_dir_all(&directory).unwrap();
    directory
}
