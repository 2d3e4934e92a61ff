//! Forms and levels of a program's log.

use jaus_test_kit::group::own_group;
use serde_json::Value as Json;

use crate::program::Program;

const PLANNER: &str = env!("CARGO_BIN_EXE_jaus-planner");

#[test]
fn a_log_in_json_has_an_object_a_line() {
    let group = own_group().to_string();
    let flags = ["--group", &group, "--log-format", "json"];
    let program = Program::start_as(PLANNER, &flags, &[]);
    let said = program.says("\"message\":");
    for line in said.lines() {
        let event: Json = serde_json::from_str(line).unwrap();
        for key in ["timestamp", "level", "target", "message"] {
            assert!(event[key].is_string(), "{key}: {event}");
        }
    }
}

#[test]
fn the_level_is_that_of_the_settings_file_and_read_again_at_sigusr1() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("planner.toml");
    std::fs::write(&file, "log_level = \"debug\"\n").unwrap();
    let group = own_group().to_string();
    let flags = ["--group", &group, "--config", file.to_str().unwrap()];
    let program = Program::start_as(PLANNER, &flags, &[]);
    program.says("DEBUG");
    std::fs::write(&file, "log_level = \"warn,jaus::endpoint=trace\"\n").unwrap();
    program.signal("USR1");
    let said = program.says("the log level is now ");
    assert!(said.contains("jaus::endpoint=trace"), "{said}");
    // A mistake leaves the level, and the program runs on.
    std::fs::write(&file, "log_level = \"jaus=loud\"\n").unwrap();
    program.signal("USR1");
    program.says("the log level is unchanged: ");
    std::fs::write(&file, "name = \"Rover\"\n").unwrap();
    program.signal("USR1");
    program.says("the log level is now ");
}

#[test]
fn a_level_that_is_none_is_an_error_with_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("planner.toml");
    std::fs::write(&file, "log_level = \"jaus=loud\"\n").unwrap();
    let flags = ["--config", file.to_str().unwrap()];
    let mut program = Program::start_as(PLANNER, &flags, &[]);
    program.says("write error, warn, info, debug or trace");
    assert_eq!(program.ends(), Some(2));
}

#[test]
fn without_a_settings_file_sigusr1_changes_nothing() {
    let group = own_group().to_string();
    let program = Program::start_as(PLANNER, &["--group", &group], &[]);
    program.says("127.0.0.1");
    program.signal("USR1");
    program.says("there is no settings file to read the log level from");
}
