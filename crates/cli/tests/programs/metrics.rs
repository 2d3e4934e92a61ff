//! The metrics of programs as processes: the endpoint, the dashboard, and the guide.

use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::path::Path;
use std::time::{Duration, Instant};

use jaus_test_kit::group::own_group;
use jaus_test_kit::tools::workspace;
use jaus_test_kit::waiting::LIMIT;
use serde_json::Value as Json;

use crate::program::Program;
use crate::support::run;

const PLANNER: &str = env!("CARGO_BIN_EXE_jaus-planner");

/// A program with its metrics at any free port, and their address.
fn start(program: &str, flags: &[&str]) -> (Program, String) {
    let group = own_group().to_string();
    let flags = [&["--group", &group, "--metrics", "0"], flags].concat();
    let program = Program::start_as(program, &flags, &[]);
    let said = program.says("metrics at http://");
    let (_, address) = said.split_once("metrics at http://").unwrap();
    let (address, _) = address.split_once("/metrics").unwrap();
    (program, address.to_owned())
}

/// The flags with the files of a new key, in a folder; and the public key.
fn new_key(folder: &Path, name: &str) -> ([String; 2], String) {
    let file = |kind: &str| folder.join(format!("{name}.{kind}")).display().to_string();
    let flags = [
        format!("--key={}", file("key")),
        format!("--trusted-keys={}", file("trusted")),
    ];
    let made = run(&["keys", "new", &flags[0], &flags[1]], b"");
    assert_eq!(made.status, 0, "{made:?}");
    (flags, made.stdout.trim().to_owned())
}

/// A planner with a secure link that trusts nobody who runs, the address of the link, its public
/// key, and the address of its metrics.
fn start_secure(folder: &Path) -> (Program, SocketAddr, String, String) {
    let ([key_file, trusted_keys], key) = new_key(folder, "planner");
    let (_, absent) = new_key(folder, "absent");
    let trust = format!("absent {absent} 60.255.255");
    let listen = UdpSocket::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let flag = format!("--secure-listen={listen}");
    let flags = [&*key_file, &trusted_keys, "--trust", &trust, &flag];
    let (program, address) = start(PLANNER, &flags);
    (program, listen, key, address)
}

/// The answer to a request.
fn ask(address: &str, request: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

fn scrape(address: &str) -> String {
    ask(address, "GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n")
}

/// Scrapes until a line is there.
#[track_caller]
fn scrape_until(address: &str, line: &str) -> String {
    scrape_until_any(address, |it| it == line)
}

/// Scrapes until one line is as wanted.
#[track_caller]
fn scrape_until_any(address: &str, is_wanted: impl Fn(&str) -> bool) -> String {
    let start = Instant::now();
    loop {
        let metrics = scrape(address);
        if metrics.lines().any(&is_wanted) {
            return metrics;
        }
        assert!(start.elapsed() < LIMIT, "{metrics}");
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// The names of all metrics of a program with a node, a component and a secure link.
fn names() -> BTreeSet<String> {
    let folder = tempfile::tempdir().unwrap();
    let (_planner, _, _, address) = start_secure(folder.path());
    let metrics = scrape_until(&address, "jaus_mission_under_way 0");
    let name = |line: &str| {
        let name = line.strip_prefix("# TYPE ")?.split(' ').next()?;
        Some(name.to_owned())
    };
    metrics.lines().filter_map(name).collect()
}

/// The words in a query that name metrics of ours.
fn mentioned(query: &str) -> BTreeSet<String> {
    // A `::` belongs to the path of a module, the target of a log line.
    let words = query.split(|c: char| !c.is_ascii_alphanumeric() && c != '_' && c != ':');
    let ours = words.filter(|word| word.starts_with("jaus_") && !word.contains("::"));
    let ours = ours.map(|word| word.trim_end_matches(':'));
    ours.map(str::to_owned).collect()
}

/// The texts of all keys `expr` and `definition` in a dashboard.
fn queries(value: &Json, into: &mut Vec<String>) {
    match value {
        Json::Object(entries) => {
            for (key, value) in entries {
                match value.as_str() {
                    Some(query) if matches!(key.as_str(), "expr" | "definition") => {
                        into.push(query.to_owned());
                    }
                    _ => queries(value, into),
                }
            }
        }
        Json::Array(values) => values.iter().for_each(|value| queries(value, into)),
        _ => {}
    }
}

#[test]
fn the_dashboard_queries_metrics_that_exist_and_the_guide_describes_all() {
    let names = names();
    assert!(names.len() > 40, "{names:?}");
    let dashboard = std::fs::read_to_string(workspace("packaging/grafana/jaus.json")).unwrap();
    let mut asked = Vec::new();
    queries(&serde_json::from_str(&dashboard).unwrap(), &mut asked);
    assert!(asked.len() > 20, "{asked:?}");
    for query in asked {
        let unknown: Vec<_> = mentioned(&query).difference(&names).cloned().collect();
        assert!(unknown.is_empty(), "`{query}` asks for {unknown:?}");
    }
    let guide = std::fs::read_to_string(workspace("docs/metrics.md")).unwrap();
    let rows = guide.lines().filter(|line| line.starts_with("| `jaus_"));
    let described: BTreeSet<_> = rows.flat_map(mentioned).collect();
    let missing: Vec<_> = names.difference(&described).collect();
    assert!(missing.is_empty(), "docs/metrics.md lacks {missing:?}");
    let outdated: Vec<_> = described.difference(&names).collect();
    assert!(outdated.is_empty(), "docs/metrics.md has {outdated:?}");
}

#[test]
fn state_services_and_counters_of_a_program_are_served() {
    let driver = env!("CARGO_BIN_EXE_jaus-primitive-driver");
    let (_driver, address) = start(driver, &["--id", "131.1.33"]);
    let state = "jaus_component_state{component=\"131.1.33\",state=\"standby\"} 1";
    let metrics = scrape_until(&address, state);
    for expected in [
        "jaus_node_info{node=\"131.1\"} 1",
        "jaus_component_controlled{component=\"131.1.33\"} 0",
        "jaus_component_emergencies_total{component=\"131.1.33\"} 0",
        "jaus_component_refused_setpoints_total{component=\"131.1.33\"} 0",
        "jaus_dropped_total{reason=\"malformed\"} 0",
        "jaus_vehicle_speed_meters_per_second 0",
    ] {
        assert!(
            metrics.lines().any(|it| it == expected),
            "{expected}: {metrics}"
        );
    }
    let service = "jaus_service_info{component=\"131.1.33\",service=\"urn:jaus:jss:mobility:\
        PrimitiveDriver\",version=\"";
    assert!(metrics.contains(service), "{metrics}");
}

#[test]
fn a_secure_link_counts_refused_handshakes_by_reason() {
    let folder = tempfile::tempdir().unwrap();
    let (_planner, listen, key, address) = start_secure(folder.path());
    let refused = "jaus_secure_handshakes_refused_total{reason=\"untrusted key\"} ";
    let metrics = scrape_until(&address, &format!("{refused}0"));
    let unsent = "jaus_secure_not_sent_total{reason=\"session has ended\"} 0";
    assert!(metrics.lines().any(|it| it == unsent), "{metrics}");

    let ([key_file, trusted_keys], _) = new_key(folder.path(), "stranger");
    let (peer, trust) = (listen.to_string(), format!("planner {key} 101.255.255"));
    let flags = [
        &*key_file,
        &trusted_keys,
        "--trust",
        &trust,
        "--secure-peer",
        &peer,
    ];
    let driver = env!("CARGO_BIN_EXE_jaus-primitive-driver");
    let (_stranger, _) = start(driver, &flags);
    let count = |line: &str| line.strip_prefix(refused)?.parse().ok();
    scrape_until_any(&address, |line| count(line).is_some_and(|it: u64| it > 0));
}

#[test]
fn openmetrics_is_complete_for_clients_that_accept_it() {
    let (_planner, address) = start(PLANNER, &[]);
    let request = "GET /metrics HTTP/1.1\r\nHost: localhost\r\n\
        Accept: application/openmetrics-text; version=1.0.0\r\n\r\n";
    let answer = ask(&address, request);
    assert!(answer.contains("application/openmetrics-text"), "{answer}");
    assert!(answer.ends_with("# EOF\n"), "{answer}");
    assert!(
        answer.contains("# UNIT jaus_sample_age_seconds seconds\n"),
        "{answer}"
    );
}

#[test]
fn the_settings_file_may_name_the_address_and_a_taken_one_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("planner.toml");
    std::fs::write(&file, "metrics = \"127.0.0.1:0\"\n").unwrap();
    let group = own_group().to_string();
    let config = ["--group", &group, "--config", file.to_str().unwrap()];
    let program = Program::start_as(PLANNER, &config, &[]);
    program.says("metrics at http://127.0.0.1:");

    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let mut program = Program::start_as(PLANNER, &["--group", &group, "--metrics", &address], &[]);
    program.says(&format!("no metrics at {address}: "));
    // So it is started again, unlike after a mistake in its settings.
    assert_eq!(program.ends(), Some(1));
}
