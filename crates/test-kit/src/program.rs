//! Programs that end by themselves: what they say about their flags.

use std::process::Command;

/// Runs a program; returns its exit status, and what it wrote to both outputs.
fn run(program: &mut Command) -> (Option<i32>, String) {
    let output = program.output().unwrap();
    let text = String::from_utf8([output.stdout, output.stderr].concat());
    (output.status.code(), text.unwrap())
}

/// Requires that a program refuses its flags, and names this remedy.
#[track_caller]
pub fn assert_refused(program: &mut Command, remedy: &str) {
    let (status, text) = run(program);
    assert_eq!(status, Some(2), "{program:?}: {text}");
    assert!(text.contains(remedy), "{program:?}: {text}");
}

/// Requires that a program's `--help` begins with its purpose and contains this example.
#[track_caller]
pub fn assert_help(program: &mut Command, purpose: &str, example: &str) {
    let (status, text) = run(program.arg("--help"));
    assert_eq!(status, Some(0), "{program:?}: {text}");
    assert!(text.starts_with(purpose), "{program:?}: {text}");
    assert!(text.contains(example), "{program:?}: {text}");
}
