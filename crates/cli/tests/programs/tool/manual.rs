//! `jaus completions` and `jaus man`.

use std::fs;
use std::path::Path;

use crate::support::run;

/// The commands that `jaus --help` lists.
fn commands() -> Vec<String> {
    let help = run(&["--help"], b"").stdout;
    let (_, list) = help.split_once("Commands:\n").unwrap();
    let lines = list.lines().take_while(|line| !line.is_empty());
    let named = lines.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names = named.filter_map(|line| line.split_whitespace().next());
    names
        .filter(|&it| it != "help")
        .map(str::to_owned)
        .collect()
}

#[test]
fn each_shell_completes_every_command_and_its_flags() {
    for shell in ["bash", "zsh", "fish"] {
        let completions = run(&["completions", shell], b"");
        for command in commands() {
            assert!(completions.stdout.contains(&command), "{shell}: {command}");
        }
        assert!(completions.stdout.contains("on-change"), "{shell}");
        assert_eq!(completions.status, 0);
    }
}

#[test]
fn each_command_has_a_manual_page_with_its_examples() {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("man");
    // Left over from an earlier run.
    let _ = fs::remove_dir_all(&directory);
    let written = run(&["man", directory.to_str().unwrap()], b"");
    assert_eq!((written.status, &*written.stderr), (0, ""));
    for command in commands() {
        let page = fs::read_to_string(directory.join(format!("jaus-{command}.1")));
        let page = page.unwrap_or_else(|error| panic!("{command}: {error}"));
        assert!(page.contains("SYNOPSIS"), "{command}");
    }
    let query = fs::read_to_string(directory.join("jaus-query.1")).unwrap();
    assert!(query.contains("Examples:"), "{query}");
    assert!(
        !directory.join("jaus-up-warden.1").exists(),
        "it is internal"
    );
}
