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

/// The text whose session drives a vehicle; a test of its own runs it.
const README: &str = "README.md";

/// Commands that the README's session does not show, but its test needs: after a command that begins
/// with the first, the second.
const BESIDES: [(&str, &str); 3] = [
    ("jaus send", "send=$!"),
    ("jaus subscribe", "wait $send; echo $? >> statuses"),
    (
        "jaus control",
        "jaus query 101.1.1 QueryVelocityState --fields Velocity_X --timeout 20s --loopback > stopped",
    ),
];

/// The speeds in the output of `jaus subscribe`.
fn speeds(printed: &str) -> Vec<f64> {
    let values = printed.split("Velocity_X ").skip(1);
    let numbers = values.filter_map(|it| it.split_whitespace().next()?.parse().ok());
    numbers.collect()
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
            let name = text.name();
            if name != README && !TUTORIALS.contains(&name.as_str()) {
                run(&session, &format!("{name}:{}", session.line), &[]);
            }
        }
    }
    for name in TUTORIALS.iter().chain(&[README, "docs/jsidl.md"]) {
        assert!(
            with_sessions.iter().any(|it| it == name),
            "no session in {name}"
        );
    }
}

/// What the commands of a session printed, and the files that the commands besides have written.
struct Ran {
    printed: String,
    /// The exit status of each command, a line for each.
    statuses: String,
    stopped: Option<String>,
}

/// Runs the commands of a session in a shell with a directory, a network and the programs of this
/// build, and compares their output with what is shown.
fn run(session: &Block, place: &str, besides: &[(&str, &str)]) -> Ran {
    let commands = parts(&session.content);
    let name = place.replace(['/', ':'], "-");
    let directory =
        std::env::temp_dir().join(format!("jaus-session-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&directory).unwrap();
    let network = own_group().join(" ");
    let group = network.split(' ').next_back().unwrap();
    let on_own_network = |command: &str| {
        let recording = format!("--interface lo --group {group}");
        let command = command.replace("--interface lo", &recording);
        // The shell forgets a job that has ended, and this test runs beside others.
        let command = command.replace("--for 10s", "--for 20s");
        command.replace("--loopback", &network)
    };
    let mut script = "exec 2>&1\n".to_owned();
    for (command, _) in &commands {
        let own = on_own_network(command);
        writeln!(
            script,
            "cat <<'END'\n{PROMPT}{own}\nEND\n{own}\necho $? >> statuses"
        )
        .unwrap();
        for (_, besides) in besides.iter().filter(|(part, _)| command.starts_with(part)) {
            writeln!(script, "{}", on_own_network(besides)).unwrap();
        }
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
    let written = |name| std::fs::read_to_string(directory.join(name)).ok();
    let (statuses, stopped) = (written("statuses").unwrap_or_default(), written("stopped"));
    std::fs::remove_dir_all(&directory).unwrap();

    let printed = String::from_utf8_lossy(&run.stdout).into_owned();
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
    Ran {
        printed,
        statuses,
        stopped,
    }
}

#[test]
fn the_shell_alone_discovers_drives_stops_and_records_a_vehicle() {
    let readme = std::fs::read_to_string(root().join(README)).unwrap();
    let blocks = blocks(&readme);
    let mut sessions = blocks.iter().filter(|it| it.info == "console");
    let session = sessions.next().expect("a session");
    assert!(sessions.next().is_none(), "one session");
    let commands = parts(&session.content);
    for name in [
        "vehicle",
        "record",
        "discover",
        "send",
        "subscribe",
        "control",
        "watch",
    ] {
        let is_shown = |it: &(&str, _)| it.0.starts_with(&format!("jaus {name} "));
        assert!(commands.iter().any(is_shown), "no jaus {name}");
    }
    let Ran {
        printed,
        statuses,
        stopped,
    } = run(session, README, &BESIDES);

    let driven = speeds(&printed);
    let rises = driven.windows(2).take_while(|it| it[0] < it[1]).count();
    assert!(
        rises >= 3 && driven[rises] > 0.2,
        "it does not drive: {driven:?} in {printed}"
    );
    let last: serde_json::Value = serde_json::from_str(&stopped.unwrap()).unwrap();
    assert_eq!(last["body"]["Velocity_X"], 0.0, "it is not stopped: {last}");
    assert_eq!(statuses.lines().count(), commands.len() + 1, "{printed}");
    assert!(statuses.lines().all(|it| it == "0"), "{statuses}{printed}");
}
