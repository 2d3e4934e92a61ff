//! The program without a network: what it says about its flags.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::process::Command;

/// Runs the program, which has to end by itself; returns its exit status and output.
fn run(arguments: &[&str]) -> (i32, String) {
    let mut program = Command::new(env!("CARGO_BIN_EXE_jaus-zenoh"));
    let output = program.args(arguments).output().unwrap();
    let text = [output.stdout, output.stderr].concat();
    let text = String::from_utf8(text).unwrap();
    (output.status.code().unwrap(), text)
}

#[test]
fn a_mistake_in_a_flag_is_refused_with_its_remedy() {
    let network = ["--loopback", "--listen", "tcp/127.0.0.1:0"];
    for (flags, remedy) in [
        (&[][..], "--connect tcp/HOST:7447"),
        (&["--connect", "192.168.7.2"], "tcp/192.168.7.2:7447"),
        (&["--zenoh-config", "/nowhere.json5"], "/nowhere.json5"),
        (&["--accept", "60 drive"], "control=AUTHORITY"),
        (&["--offer", "all"], "60.255.255"),
        (&["--min-period", "Speed=1s"], "jaus list messages"),
        (&["--prefix", "a/*"], "site/jaus"),
    ] {
        let is_about_network = flags.is_empty() || flags[0].ends_with("connect");
        let network = if is_about_network { &[][..] } else { &network };
        let (status, text) = run(&[network, flags].concat());
        assert_eq!(status, 2, "{flags:?}: {text}");
        assert!(text.contains(remedy), "{flags:?}: {text}");
    }
}

#[test]
fn it_does_not_attach_to_the_node_of_another_process() {
    let (status, text) = run(&["--attach", "--listen", "tcp/127.0.0.1:0"]);
    assert_eq!(status, 2, "{text}");
    assert!(text.contains("omit --attach"), "{text}");
}

#[test]
fn the_help_begins_with_what_it_is_and_ends_with_examples() {
    let (status, text) = run(&["--help"]);
    assert_eq!(status, 0, "{text}");
    assert!(text.starts_with("Bridge between JAUS systems"), "{text}");
    assert!(text.contains("--accept \"60 control=127\""), "{text}");
}
