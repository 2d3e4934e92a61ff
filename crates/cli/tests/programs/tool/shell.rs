//! Runs the README's shell session: what it shows is what comes.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use crate::support::own_group;

const README: &str = include_str!("../../../../../README.md");
/// Stands before each command in the output of the session.
const PROMPT: &str = "$ ";

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

/// Commands that the session does not show, but the test needs: after a command that begins with the
/// first, the second.
const BESIDES: [(&str, &str); 3] = [
    ("jaus send", "send=$!"),
    ("jaus subscribe", "wait $send; echo $? >> statuses"),
    (
        "jaus control",
        "jaus query 101.1.1 QueryVelocityState --fields Velocity_X --loopback > stopped",
    ),
];

/// The speeds in the output of `jaus subscribe`.
fn speeds(printed: &str) -> Vec<f64> {
    let values = printed.split("Velocity_X ").skip(1);
    let numbers = values.filter_map(|it| it.split_whitespace().next()?.parse().ok());
    numbers.collect()
}

#[test]
fn the_shell_alone_discovers_drives_stops_and_records_a_vehicle() {
    let session = README.split("```console\n").nth(1).unwrap();
    let session = session.split("```").next().unwrap();
    let commands = parts(session);
    assert!(commands.len() >= 8, "{commands:?}");

    // The session gets a directory, a network and the programs of this build.
    let directory = std::env::temp_dir().join(format!("jaus-shell-{}", std::process::id()));
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
        for (_, besides) in BESIDES.iter().filter(|(part, _)| command.starts_with(part)) {
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
    let written = |name| std::fs::read_to_string(directory.join(name)).unwrap();
    let (statuses, stopped) = (written("statuses"), written("stopped"));
    std::fs::remove_dir_all(&directory).unwrap();

    let printed = String::from_utf8_lossy(&run.stdout);
    let driven = speeds(&printed);
    let rises = driven.windows(2).take_while(|it| it[0] < it[1]).count();
    assert!(
        rises >= 3 && driven[rises] > 0.2,
        "it does not drive: {driven:?} in {printed}"
    );
    let last: serde_json::Value = serde_json::from_str(&stopped).unwrap();
    assert_eq!(
        last["body"]["Velocity_X"], 0.0,
        "it is not stopped: {stopped}"
    );
    assert_eq!(statuses.lines().count(), commands.len() + 1, "{printed}");
    assert!(statuses.lines().all(|it| it == "0"), "{statuses}{printed}");

    let printed_parts = parts(&printed);
    assert_eq!(printed_parts.len(), commands.len(), "{printed}");
    for ((command, shown), (_, lines)) in commands.iter().zip(printed_parts) {
        let mut lines = lines.iter().map(|line| shape(line));
        // An ellipsis stands for lines that are left out.
        for line in shown.iter().filter(|it| it.trim() != "…") {
            let wanted = shape(line);
            assert!(
                lines.any(|line| line == wanted),
                "`{line}` does not follow `{command}` in {printed}"
            );
        }
    }
}
