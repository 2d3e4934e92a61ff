//! The generated pages of the book: commands, programs, settings. With `JAUS_RENEW_SNAPSHOTS` set,
//! the tests write them.

mod keys;
mod settings;
mod source;

use std::path::Path;
use std::process::Command;

use jaus_test_kit::snapshot;
use jaus_test_kit::tools::workspace;

use crate::packaging::programs;
use crate::support::run;

const COMMANDS: &str = "# Commands of `jaus`

<!-- Written by a test from the definition of the command line; CONTRIBUTING.md says how. -->

Every command and flag of the tool. [The tool and the programs](tool.md) is the guide to it. `jaus help COMMAND`
prints the same text in a terminal, `jaus man DIRECTORY` writes it as manual pages.

";

const PROGRAMS: &str = "# Flags of the programs

<!-- Written by a test from the definitions of the command lines; CONTRIBUTING.md says how. -->

Every flag of the programs with one component each. [The tool and the programs](tool.md) says what they are for,
[The vehicle](the-vehicle.md) how they work together. `PROGRAM --help` prints the same text in a terminal. In a
[settings file](settings.md) the flags are keys of the section `[component]`.

";

/// The line before the options that all programs have.
const COMMON: &str = "## Common options\n";

/// The output of one of our programs.
#[track_caller]
fn output(program: &str, arguments: &[&str]) -> String {
    let folder = Path::new(env!("CARGO_BIN_EXE_jaus")).parent().unwrap();
    let output = Command::new(folder.join(program)).args(arguments).output();
    let output = output.unwrap();
    assert!(output.status.success(), "{program}: {output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// The programs with one component each.
fn component_programs() -> impl Iterator<Item = String> {
    programs().into_iter().map(|name| format!("jaus-{name}"))
}

#[test]
fn the_page_of_commands_is_what_the_tool_says() {
    let reference = run(&["reference"], b"");
    assert_eq!(reference.status, 0, "{}", reference.stderr);
    let page = format!("{COMMANDS}{}", reference.stdout);
    snapshot::check(workspace("docs/commands.md"), &page);
}

#[test]
fn the_page_of_programs_is_what_they_say() {
    let mut page = PROGRAMS.to_owned();
    let mut common: Option<String> = None;
    for program in component_programs() {
        let reference = output(&program, &["--reference"]);
        let (own, shared) = reference.split_once(COMMON).unwrap();
        page.push_str(own);
        let before = common.get_or_insert_with(|| shared.to_owned());
        assert_eq!(before, shared, "{program} has other common options");
    }
    page.push_str(COMMON);
    page.push_str(&common.unwrap());
    snapshot::check(workspace("docs/programs.md"), &page);
}

#[test]
fn the_page_of_settings_is_what_the_code_says() {
    snapshot::check(workspace("docs/settings.md"), &settings::page());
}
