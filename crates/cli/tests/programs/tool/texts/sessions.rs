//! Runs the sessions that texts show: the programs print what is shown.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use super::{Block, blocks, root, texts};
use crate::support::own_group;

/// Stands before each command of a session.
const PROMPT: &str = "$ ";
/// The texts whose sessions build programs or need several hosts; `.ci/tutorial` runs those.
const TUTORIALS: [&str; 2] = ["docs/getting-started.md", "docs/tutorial.md"];

/// Numbers and the space between columns differ from run to run.
fn shape(line: &str) -> String {
    let words = line.split_whitespace().map(|word| {
        let mut shape = String::new();
        let mut was_digit = false;
        for c in word.chars() {
            if !c.is_ascii_digit() {
                shape.push(c);
            } else if !was_digit {
                shape.push('0');
            }
            was_digit = c.is_ascii_digit();
        }
        shape
    });
    words.collect::<Vec<_>>().join(" ")
}

/// The parts of a session: each command, with the lines that follow it.
fn parts(session: &str) -> Vec<(&str, Vec<&str>)> {
    let mut parts: Vec<(&str, Vec<&str>)> = Vec::new();
    for line in session.lines() {
        match (line.strip_prefix(PROMPT), parts.last_mut()) {
            (Some(command), _) => parts.push((command, Vec::new())),
            (None, Some((_, shown))) => shown.push(line),
            (None, None) => {}
        }
    }
    parts
}

#[test]
fn every_session_prints_what_is_shown() {
    let mut with_sessions = Vec::new();
    for text in texts() {
        let sessions = blocks(&text.content)
            .into_iter()
            .filter(|it| it.info == "console");
        for session in sessions {
            with_sessions.push(text.name());
            if !TUTORIALS.contains(&text.name().as_str()) {
                run(&session, &format!("{}:{}", text.name(), session.line));
            }
        }
    }
    for name in TUTORIALS.iter().chain(&["README.md", "docs/jsidl.md"]) {
        assert!(
            with_sessions.iter().any(|it| it == name),
            "no session in {name}"
        );
    }
}

/// Runs the commands of a session in a shell with a directory, a network and the programs of this build.
fn run(session: &Block, place: &str) {
    let commands = parts(&session.content);
    let directory = std::env::temp_dir().join(format!("jaus-session-{}", std::process::id()));
    std::fs::create_dir_all(&directory).unwrap();
    let network = own_group().join(" ");
    let group = network.split(' ').next_back().unwrap();
    let mut script = "exec 2>&1\n".to_owned();
    for (command, _) in &commands {
        let command = command.replace("--interface lo", &format!("--interface lo --group {group}"));
        let command = command.replace("--loopback", &network);
        writeln!(script, "cat <<'END'\n{PROMPT}{command}\nEND\n{command}").unwrap();
    }
    let tool = Path::new(env!("CARGO_BIN_EXE_jaus")).parent().unwrap();
    let path = format!("{}:{}", tool.display(), std::env::var("PATH").unwrap());
    let run = Command::new("bash")
        .args(["-c", &script])
        .current_dir(&directory)
        .env("PATH", path)
        .env_remove("JAUS_LOG")
        .output()
        .unwrap();
    std::fs::remove_dir_all(&directory).unwrap();

    let printed = String::from_utf8_lossy(&run.stdout);
    let printed_parts = parts(&printed);
    assert_eq!(printed_parts.len(), commands.len(), "{place}: {printed}");
    for ((command, shown), (_, lines)) in commands.iter().zip(printed_parts) {
        let mut lines = lines.iter().map(|line| shape(line));
        // An ellipsis stands for lines that are left out.
        for line in shown.iter().filter(|it| it.trim() != "…") {
            let wanted = shape(line);
            assert!(
                lines.any(|line| line == wanted),
                "{place}: `{line}` does not follow `{command}` in {printed}"
            );
        }
    }
}

#[test]
fn the_readme_discovers_drives_stops_and_records_a_vehicle() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    let sessions = blocks(&readme)
        .into_iter()
        .filter(|it| it.info == "console");
    let shown: String = sessions.map(|it| it.content).collect();
    for command in [
        "vehicle",
        "record",
        "discover",
        "send",
        "subscribe",
        "control",
        "watch",
    ] {
        assert!(
            shown.contains(&format!("{PROMPT}jaus {command} ")),
            "no {command}"
        );
    }
}
