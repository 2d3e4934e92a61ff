//! The program without a network: what it says about its flags, and its metrics.
#![allow(
    clippy::disallowed_types,
    clippy::unwrap_used,
    reason = "a test with its own sockets, which fails by panicking"
)]

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};

use jaus_test_kit::group::own_group;
use jaus_test_kit::program::{assert_help, assert_refused};
use jaus_test_kit::tools::workspace;

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
        (&["--accept", "60 control=127"], "--trust-network"),
        (&["--accept", "60 except=Drive"], "`Drive`"),
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

#[test]
fn the_settings_of_its_package_are_understood() {
    let file = workspace("packaging/bridges/etc/zenoh.toml");
    jaus_cli::settings::read(&file).unwrap();
    let mut program = program(&[]);
    program.args(jaus_cli::settings::flags(&file).unwrap());
    assert_help(&mut program, "Bridge between JAUS systems", "jaus-zenoh");
}

/// A bridge without peers, which serves its metrics; ended when dropped.
struct Bridge(Child);

impl Bridge {
    /// Starts it; returns the address of its metrics too.
    fn start() -> (Self, String) {
        let mut program = Command::new(env!("CARGO_BIN_EXE_jaus-zenoh"));
        let group = own_group().to_string();
        program.args(["--loopback", "--group", &group, "--metrics", "0"]);
        program.args(["--listen", "tcp/127.0.0.1:0"]);
        program.env_remove("JAUS_LOG").stderr(Stdio::piped());
        let mut bridge = Self(program.spawn().unwrap());
        let lines = BufReader::new(bridge.0.stderr.take().unwrap()).lines();
        let mut lines = lines.map(Result::unwrap);
        let address = lines.find_map(|line| {
            let (_, address) = line.split_once("metrics at http://")?;
            Some(address.strip_suffix("/metrics")?.to_owned())
        });
        // Whatever else it logs must not block it.
        std::thread::spawn(move || lines.for_each(drop));
        (bridge, address.unwrap())
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn its_counters_are_metrics_and_the_guide_describes_all() {
    let (_bridge, address) = Bridge::start();
    let mut stream = TcpStream::connect(address).unwrap();
    let request = b"GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n";
    stream.write_all(request).unwrap();
    let mut metrics = String::new();
    stream.read_to_string(&mut metrics).unwrap();
    let refused = "jaus_zenoh_dropped_total{reason=\"id that is not accepted\"} 0";
    assert!(metrics.lines().any(|line| line == refused), "{metrics}");

    let name = |line: &str| {
        let name = line.strip_prefix("# TYPE ")?.split(' ').next()?;
        name.starts_with("jaus_zenoh_").then(|| name.to_owned())
    };
    let names: BTreeSet<_> = metrics.lines().filter_map(name).collect();
    let guide = std::fs::read_to_string(workspace("docs/zenoh.md")).unwrap();
    let rows = guide.lines().filter(|line| line.starts_with("| `jaus_"));
    let words = rows.flat_map(|row| row.split('`'));
    let described = words.filter(|word| word.starts_with("jaus_zenoh_"));
    let described: BTreeSet<_> = described.map(str::to_owned).collect();
    assert_eq!(names, described);
}
