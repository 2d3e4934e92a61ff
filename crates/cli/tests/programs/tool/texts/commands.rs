//! Every command in a text has the flags that it shows.

use std::path::Path;
use std::process::Command;

use super::{split, texts};

/// Flags of features that tests are built without.
const OF_FEATURES: [&str; 2] = ["--stop-line", "--can"];

/// The program of a package that this one does not build; `.ci/zenoh` has its tests.
const OF_OTHER_PACKAGES: [&str; 2] = ["jaus-ros2", "jaus-zenoh"];

/// The commands of our programs in a line of a shell, without redirections and what follows them.
fn commands(line: &str) -> Vec<Vec<String>> {
    let words = words(line);
    let commands = words.split(|word| matches!(word, Word::End));
    commands
        .filter_map(|words| {
            let words: Vec<_> = words.iter().filter_map(Word::text).collect();
            let command = match words.as_slice() {
                ["ssh", _, command @ ..] | ["sudo", command @ ..] => command,
                command => command,
            };
            program(command.first()?)?;
            Some(command.iter().map(|&it| it.to_owned()).collect())
        })
        .collect()
}

/// The name of one of our programs.
fn program(word: &str) -> Option<&str> {
    let name = word.rsplit('/').next()?;
    let is_ours = name == "jaus" || name.strip_prefix("jaus-").is_some_and(is_part);
    is_ours.then_some(name)
}

fn is_part(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_ascii_lowercase() || c == '-')
}

#[derive(Debug)]
enum Word {
    Text(String),
    /// The end of a command: `;`, `&`, `|`, a redirection or a comment.
    End,
}

impl Word {
    fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            Self::End => None,
        }
    }
}

/// Splits a line as a shell does, as far as the texts need it.
fn words(line: &str) -> Vec<Word> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    for c in line.chars() {
        match (c, quote) {
            (c, Some(open)) if c == open => quote = None,
            (c, Some(_)) => word.get_or_insert_default().push(c),
            ('\'' | '"', None) => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            (' ', None) => words.extend(word.take().map(Word::Text)),
            ('#', None) if word.is_none() => break,
            (';' | '&' | '|' | '>' | '<', None) => {
                words.extend(word.take().map(Word::Text));
                words.push(Word::End);
            }
            (c, None) => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word.map(Word::Text));
    words
}

/// The lines of shell in a text: those of its blocks, without prompts, and the quoted ones.
fn shell_lines(text: &str) -> Vec<String> {
    let (blocks, prose) = split(text);
    let mut lines = Vec::new();
    for block in blocks {
        let joined = block.content.replace("\\\n", " ");
        match block.info.as_str() {
            "sh" => lines.extend(joined.lines().map(str::to_owned)),
            "console" => {
                let commands = joined.lines().filter_map(|it| it.split_once("$ "));
                lines.extend(commands.map(|(_, command)| command.to_owned()));
            }
            _ => {}
        }
    }
    let quoted = prose.split('`').skip(1).step_by(2);
    lines.extend(quoted.map(|it| it.replace('\n', " ")));
    lines
}

/// Placeholders of the texts, with values.
fn filled_in(word: &str) -> Option<String> {
    match word {
        "…" => None,
        "ADDRESS" => Some("192.168.7.2".to_owned()),
        "ID" => Some("101.1.1".to_owned()),
        "POLICY" => Some("stop".to_owned()),
        "IDS" => Some("101.255.255".to_owned()),
        "KEY" => Some(key()),
        // Also within a quoted line of a trust file.
        word => Some(
            word.replace('…', "")
                .replace("OPERATORS_KEY", &key())
                .replace("VEHICLES_KEY", &key()),
        ),
    }
}

/// A public key.
fn key() -> String {
    format!("{}=", "A".repeat(43))
}

/// Whether the flags of a command can be checked: `jaus help` has none, and some need features or another package.
fn is_checked(command: &[String]) -> bool {
    let is_of_other = program(&command[0]).is_some_and(|it| OF_OTHER_PACKAGES.contains(&it));
    let is_help = command.get(1).is_some_and(|it| it == "help");
    let mut flags = command.iter();
    !is_help && !is_of_other && !flags.any(|it| OF_FEATURES.contains(&it.as_str()))
}

/// The first line of the error if a program does not have the flags of a command.
fn error(command: &[String]) -> Option<String> {
    let folder = Path::new(env!("CARGO_BIN_EXE_jaus")).parent()?;
    let program = folder.join(program(&command[0])?);
    if command.len() == 1 && !program.exists() {
        return None; // the name of a crate
    }
    let words = command[1..].iter().filter_map(|it| filled_in(it));
    let words: Vec<_> = words.filter(|it| it != "--help").collect();
    let run = Command::new(&program).args(&words).arg("--help").output();
    let error = match run {
        Ok(run) if run.status.success() => return None,
        Ok(run) => String::from_utf8_lossy(&run.stderr).into_owned(),
        Err(error) => error.to_string(),
    };
    let first = error.lines().next().unwrap_or_default();
    // A text may name a flag without its value.
    if first.contains("a value is required for") {
        return None;
    }
    Some(format!("{}: {first}", command.join(" ")))
}

#[test]
fn every_command_has_the_shown_flags() {
    let (mut count, mut wrong) = (0, Vec::new());
    // The changelog names flags and commands of older versions.
    for text in texts().iter().filter(|it| it.name() != "CHANGELOG.md") {
        let lines = shell_lines(&text.content);
        let commands = lines.iter().flat_map(|line| commands(line));
        for command in commands.filter(|it| is_checked(it)) {
            let error = error(&command);
            wrong.extend(error.map(|error| format!("{}: {error}", text.name())));
            count += 1;
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count > 100, "{count}");
}

#[test]
fn commands_are_split_as_a_shell_splits_them() {
    let found =
        commands("ssh gbat jaus send 1.1.1 X '{\"A\": 1}' --hz 5 > log & kill %1; jaus list # all");
    let expected = [
        vec!["jaus", "send", "1.1.1", "X", "{\"A\": 1}", "--hz", "5"],
        vec!["jaus", "list"],
    ];
    assert_eq!(found, expected);
    assert!(commands("cargo deb -p jaus-cli").is_empty());
}
