//! Single-component programs as processes: their default log, their reports to systemd, and their
//! stop input.

use std::io::ErrorKind;
use std::os::unix::net::UnixDatagram;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::link::Group;
use jaus::messages::mobility::primitive_driver;
use jaus::node::{Config, Node};
use jaus_test_kit::group::own_group;
use jaus_test_kit::program::assert_refused;
use jaus_test_kit::waiting::LIMIT;

use crate::program::Program;

const DRIVER: JausId = JausId::new(101, 33, 33);

fn group_flag(group: Group) -> String {
    match group {
        Group::At(address) => address.to_string(),
        other => panic!("{other:?}"),
    }
}

fn scratch(name: &str) -> PathBuf {
    let directory = std::env::temp_dir().join(format!("jaus-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&directory).unwrap();
    directory
}

#[test]
fn a_program_reports_to_systemd_that_it_is_ready_alive_and_stopping() {
    let directory = scratch("notify");
    let name = directory.join("socket");
    let socket = UnixDatagram::bind(&name).unwrap();
    let hear = |limit: Duration| {
        let mut state = [0; 64];
        socket.set_read_timeout(Some(limit)).unwrap();
        // The end of another test's process interrupts a call that has a time limit.
        let heard = loop {
            match socket.recv(&mut state) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                heard => break heard,
            }
        };
        let length = heard.ok()?;
        Some(String::from_utf8_lossy(&state[..length]).into_owned())
    };
    let group = group_flag(own_group());
    let program = Program::start(
        &["--group", &group],
        &[
            ("NOTIFY_SOCKET", name.to_str().unwrap()),
            ("WATCHDOG_USEC", "200000"),
        ],
    );
    assert_eq!(hear(LIMIT).as_deref(), Some("READY=1"));
    for _ in 0..5 {
        assert_eq!(hear(LIMIT).as_deref(), Some("WATCHDOG=1"));
    }
    // A hung program prints nothing.
    program.signal("STOP");
    while hear(Duration::from_secs(2)).is_some() {}
    program.signal("CONT");
    assert_eq!(hear(LIMIT).as_deref(), Some("WATCHDOG=1"));
    program.signal("TERM");
    let last = std::iter::from_fn(|| hear(LIMIT)).find(|state| state != "WATCHDOG=1");
    assert_eq!(last.as_deref(), Some("STOPPING=1"));
    drop(program);
    std::fs::remove_dir_all(directory).unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn emergencies_and_the_stop_input_are_logged_without_a_flag() {
    let directory = scratch("stop");
    let pressed = directory.join("pressed");
    let group = own_group();
    let flags = ["--group", &group_flag(group), "--stop-file"];
    let flags = [&flags[..], &[pressed.to_str().unwrap()]].concat();
    let program = Program::start(&flags, &[]);
    let node = Node::start(Config::loopback(42, 1).group(group)).unwrap();
    let operator = Component::builder(Kind::OperatorControlUnit, "Operator");
    let operator = operator.attach(&node, 1).unwrap();
    operator.find(primitive_driver::URN).await.unwrap();
    operator.set_emergency(DRIVER).await.unwrap();
    program.says("emergency");
    operator.clear_emergency(DRIVER).await.unwrap();
    std::fs::write(&pressed, "").unwrap();
    program.says("emergency: the stop input is pressed");
    std::fs::remove_file(&pressed).unwrap();
    program.says("the stop input is closed again");
    program.signal("TERM");
    let mut program = program;
    assert_eq!(program.ends(), Some(0));
    std::fs::remove_dir_all(directory).unwrap();
}

#[test]
fn the_operators_token_is_never_logged_and_printed_only_if_it_was_generated() {
    const TOKEN: &str = "0123456789abcdef-of-the-file";
    let directory = scratch("token");
    let file = directory.join("token");
    jaus_files::replace(&file, jaus_files::Readers::Owner, TOKEN.as_bytes()).unwrap();
    let group = group_flag(own_group());
    let station = env!("CARGO_BIN_EXE_jaus-ocu");
    let flags = ["--group", &group, "--listen"];
    let from_file = ["127.0.0.1:0", "--token-file", file.to_str().unwrap()];
    let flags_of = |more: &[&str]| -> Vec<String> {
        flags.iter().chain(more).map(|&it| it.to_owned()).collect()
    };
    let state = ("STATE_DIRECTORY", directory.to_str().unwrap());
    let mut kept = std::collections::BTreeSet::new();
    for (more, generates) in [
        (&from_file[..], false),
        (&["0.0.0.0:0"][..], true),
        (&["127.0.0.1:0"][..], true),
    ] {
        let flags = flags_of(more);
        let flags: Vec<_> = flags.iter().map(String::as_str).collect();
        let mut program = Program::start_as(station, &flags, &[state]);
        let said = program.says("the operator's page is at http://");
        assert!(!said.contains(TOKEN) && !said.contains("token="), "{said}");
        if generates {
            let printed = program.prints();
            let (_, token) = printed.split_once("/#token=").unwrap();
            kept.insert(token.trim().to_owned());
        } else {
            program.signal("TERM");
            assert_eq!(program.prints(), "");
        }
    }
    assert_eq!(kept.len(), 1, "a restart keeps it");
    // The journal is a log too, and so is the output of `jaus up` into a file.
    let flags = flags_of(&["127.0.0.1:0"]);
    let flags: Vec<_> = flags.iter().map(String::as_str).collect();
    for log in [("JOURNAL_STREAM", "8:1"), ("JAUS_OUTPUT_IS_LOG", "1")] {
        let mut program = Program::start_as(station, &flags, &[log, state]);
        let said = program.says("the operator's page is at http://");
        assert!(
            said.contains("it is in /") && said.contains("page.token"),
            "{said}"
        );
        program.signal("TERM");
        assert_eq!(program.prints(), "");
    }
    std::fs::remove_dir_all(directory).unwrap();
}

#[test]
fn flags_of_motors_and_receivers_out_of_their_range_are_told_with_the_range() {
    let tool = std::path::Path::new(env!("CARGO_BIN_EXE_jaus"));
    let refused = |program: &str, flags: &str, told: &str| {
        let mut program = Command::new(tool.with_file_name(program));
        assert_refused(program.args(flags.split(' ')), told);
    };
    for (flags, told) in [
        ("--wheelbase 0", "write a number from 0.05 to 20"),
        (
            "--wheelbase 1 --steering-angle 81",
            "write a number from 1 to 80",
        ),
        (
            "--wheelbase 1 --servo pwmchip0",
            "/sys/class/pwm/pwmchip0:0",
        ),
        ("--servo /sys/class/pwm/pwmchip0:0", "--wheelbase"),
        (
            "--sabertooth /dev/null --sabertooth-address 127",
            "127 is not in 128..=135",
        ),
        ("--pwm /sys/class/pwm/pwmchip0", "--pwm-left"),
        ("--pwm-frequency 49", "write a number from 50 to 100000"),
        (
            "--pwm x --pwm-right 2,3 --pwm-left 1,1",
            "two different numbers",
        ),
        #[cfg(feature = "can")]
        ("--can can0", "--can-counts-per-metre"),
        #[cfg(feature = "can")]
        (
            "--can can0 --can-counts-per-metre 0",
            "write a number from 1 to 1000000",
        ),
        #[cfg(feature = "can")]
        (
            "--can can0 --can-counts-per-metre 9 --can-left 255",
            "255 is not in 0..=254",
        ),
        #[cfg(feature = "can")]
        (
            "--can can0 --can-counts-per-metre 9 --sabertooth /dev/null",
            "cannot be used with",
        ),
    ] {
        refused("jaus-primitive-driver", flags, told);
    }
    for (flags, told) in [
        ("--outage 0s", "write more than 0"),
        ("--outage 10", "units us, ms, s, min and h"),
        ("--max-rms 0", "write a number from 0.01 to 100"),
        ("--gyro-inverted", "--gyro"),
        ("--imu --gyro /dev/null", "cannot be used with"),
        ("--baud 1", "1 is not in 300..=4000000"),
    ] {
        refused("jaus-global-pose-sensor", flags, told);
    }
    for (flags, told) in [
        (
            "--control-timeout 2.5s",
            "whole seconds up to 255s, or never",
        ),
        (
            "--control-timeout 256s",
            "whole seconds up to 255s, or never",
        ),
        ("--reaction 11s", "write a duration from 0s to 10s"),
    ] {
        refused("jaus-local-vector-driver", flags, told);
    }
    refused("jaus-imu-sensor", "--silence 0s", "write more than 0");
    refused(
        "jaus-global-driver",
        "--turning-radius 101",
        "write a number from 0 to 100",
    );
}

#[cfg(feature = "can")]
#[test]
fn a_can_bus_that_does_not_exist_is_told_with_the_remedy() {
    let program = Program::start(&["--can", "nocan7", "--can-counts-per-metre", "200"], &[]);
    program.says("bring it up with `ip link set nocan7 up type can bitrate 500000`");
}

#[cfg(not(any(feature = "can", feature = "gpio")))]
#[test]
fn motors_that_a_build_does_not_support_are_refused_with_the_remedy() {
    for (flags, feature) in [
        (
            &["--can", "can0", "--can-counts-per-metre", "200"][..],
            "can",
        ),
        (
            &[
                "--gpio",
                "/dev/gpiochip0",
                "--left",
                "17,27",
                "--right",
                "23,24",
            ],
            "gpio",
        ),
        (&["--stop-line", "/dev/gpiochip0:5"], "gpio"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_jaus-primitive-driver"));
        let output = command.args(flags).output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(error.contains(flags[0]), "{error}");
        assert!(error.contains(&format!("--features {feature}")), "{error}");
    }
}
