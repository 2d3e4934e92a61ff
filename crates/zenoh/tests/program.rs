//! The program without a network: what it says about its flags.

use std::process::Command;

use jaus_test_kit::program::{assert_help, assert_refused};

fn program(arguments: &[&str]) -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_jaus-zenoh"));
    program.args(arguments);
    program
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
        assert_refused(&mut program(&[network, flags].concat()), remedy);
    }
}

#[test]
fn it_does_not_attach_to_the_node_of_another_process() {
    let flags = ["--attach", "--listen", "tcp/127.0.0.1:0"];
    assert_refused(&mut program(&flags), "omit --attach");
}

#[test]
fn the_help_begins_with_what_it_is_and_ends_with_examples() {
    let example = "--accept \"60 control=127\"";
    assert_help(&mut program(&[]), "Bridge between JAUS systems", example);
}
