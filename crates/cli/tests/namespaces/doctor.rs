//! `jaus doctor` and `jaus examine` on one host, peers on the other: each symptom gets its verdict.

use std::net::UdpSocket;
use std::os::unix::net::UnixDatagram;

use jaus_test_kit::evidence::{not_tested, this_test};
use jaus_test_kit::hosts::{SETTINGS, TwoHosts, on_two_hosts, run};
use jaus_test_kit::vehicle_process::VehicleProcess;
use serde_json::Value as Json;

/// The first host, with the peers.
const PEERS: usize = 0;
/// The second host.
const HERE: usize = 1;

/// Runs `jaus` with `--json` on a host; returns the exit status and the report.
fn jaus(hosts: &TwoHosts, host: usize, arguments: &[&str]) -> (i32, Json) {
    let mut command = hosts.command(host, env!("CARGO_BIN_EXE_jaus"));
    let run = command.args(arguments).arg("--json").output().unwrap();
    let report = serde_json::from_slice(&run.stdout).unwrap_or_else(|_| panic!("{run:?}"));
    (run.status.code().unwrap(), report)
}

fn doctor(hosts: &TwoHosts, host: usize, flags: &[&str]) -> (i32, Json) {
    jaus(hosts, host, &[&["doctor", "--for", "1s"], flags].concat())
}

fn vehicle(hosts: &TwoHosts) -> VehicleProcess {
    let mut command = hosts.command(PEERS, env!("CARGO_BIN_EXE_jaus"));
    VehicleProcess::start(command.args(["vehicle", "--id", "101.1.1"]))
}

/// The findings other than ok, as verdict, check, what and advice.
fn complaints(report: &Json) -> Vec<[&str; 4]> {
    let findings = report["findings"].as_array().unwrap().iter();
    let complaints = findings.filter(|it| it["verdict"] != "ok");
    let keys = ["verdict", "check", "what", "advice"];
    complaints
        .map(|it| keys.map(|key| it[key].as_str().unwrap_or_default()))
        .collect()
}

/// The only finding other than ok.
#[track_caller]
fn only_complaint(report: &Json) -> [&str; 4] {
    let complaints = complaints(report);
    assert_eq!(complaints.len(), 1, "{report:#}");
    complaints[0]
}

/// Drops the multicasts of the discovery group in this direction, `input` or `output`, on the
/// peers' host. Returns whether that is possible here.
fn drop_multicast(hosts: &TwoHosts, direction: &str) -> bool {
    let rules = format!(
        "add table ip test; add chain ip test drops {{ type filter hook {direction} priority 0; \
         }}; add rule ip test drops ip daddr 239.255.0.1 drop"
    );
    let nft = ["netns", "exec", &hosts.names[PEERS], "nft", &rules];
    match run("ip", &nft) {
        Ok(()) => true,
        Err(reason) => {
            not_tested(&this_test(), &format!("no nft here: {reason}"));
            false
        }
    }
}

#[test]
fn a_sound_network_is_found_well() {
    on_two_hosts(|hosts| {
        let _vehicle = vehicle(hosts);
        let (status, report) = doctor(hosts, HERE, &[]);
        assert_eq!(report["conclusion"], "All is well.", "{report:#}");
        assert_eq!(status, 0);
    });
}

#[test]
fn a_peer_whose_multicasts_do_not_arrive_is_a_warning() {
    on_two_hosts(|hosts| {
        if !drop_multicast(hosts, "output") {
            return;
        }
        let _vehicle = vehicle(hosts);
        let (status, report) = doctor(hosts, HERE, &[]);
        let [verdict, check, what, advice] = only_complaint(&report);
        assert_eq!((status, verdict, check), (1, "warning", "neighbours"));
        let told =
            "101.1.1 of \"Rover\" is at 10.213.77.1:3794, but none of its multicasts arrived";
        assert!(what.contains(told), "{what}");
        assert!(
            advice.contains("firewall drop outgoing multicast"),
            "{advice}"
        );
        assert!(advice.contains("--peer 10.213.77.1"), "{advice}");
        // With that remedy, nothing is missing.
        let (_, report) = doctor(hosts, HERE, &["--peer", "10.213.77.1"]);
        assert_eq!(report["conclusion"], "All is well.", "{report:#}");
    });
}

#[test]
fn a_peer_of_another_subnet_on_the_same_cable_is_a_warning_that_names_both_networks() {
    on_two_hosts(|hosts| {
        hosts.ip(PEERS, &["address", "flush", "dev", "jaus0"]);
        hosts.ip(PEERS, &["address", "add", "10.99.0.2/24", "dev", "jaus0"]);
        // A host may drop what comes from a network without a route.
        let accept = "for it in /proc/sys/net/ipv4/conf/*/rp_filter; do echo 0 > $it; done";
        let shell = ["netns", "exec", &hosts.names[HERE], "sh", "-c", accept];
        run("ip", &shell).unwrap();
        let _vehicle = vehicle(hosts);
        let (status, report) = doctor(hosts, HERE, &[]);
        let [verdict, check, what, advice] = only_complaint(&report);
        assert_eq!((status, verdict, check), (1, "warning", "neighbours"));
        for told in [
            "101.1.1",
            "10.99.0.2",
            "jaus0",
            "10.213.77.0/24",
            "10.99.0.0/24",
        ] {
            assert!(what.contains(told), "no {told} in {what}");
        }
        assert!(advice.contains("addresses of one network"), "{advice}");
    });
}

#[test]
fn an_isolated_host_is_said_to_be_sound_and_alone() {
    on_two_hosts(|hosts| {
        let (status, report) = doctor(hosts, HERE, &[]);
        let [verdict, check, what, advice] = only_complaint(&report);
        assert_eq!((status, verdict, check), (1, "warning", "neighbours"));
        assert!(what.starts_with("no other node was heard"), "{what}");
        assert!(advice.contains("IGMP snooping"), "{advice}");
        let conclusion = "This host is sound, but no other node was heard.";
        assert_eq!(report["conclusion"], conclusion, "{report:#}");
    });
}

#[test]
fn a_program_that_holds_the_port_is_one_failure_whose_remedy_is_accepted() {
    on_two_hosts(|hosts| {
        hosts.connect("jaus1", "10.213.78").unwrap();
        let folder = std::env::temp_dir().join(format!("jaus-doctor-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let folder = folder.to_str().unwrap();
        let junior = hosts.start_with(PEERS, "junior", folder);
        junior.says("holds the port");
        let through_it = format!("--junior={folder}");
        let through_it = through_it.as_str();
        for flags in [&[][..], &["--interface", "jaus0"], &["--loopback"]] {
            let (status, report) = doctor(hosts, PEERS, flags);
            let [verdict, check, what, advice] = only_complaint(&report);
            assert_eq!(
                (status, verdict, check),
                (1, "failed", "port"),
                "{report:#}"
            );
            assert_eq!(report["failures"], 1, "{report:#}");
            assert!(what.contains("(JuniorRTE)"), "{what}");
            let (told, remedy) = match flags {
                ["--loopback"] => ("--junior instead of --loopback", vec![through_it]),
                _ => (
                    "the same flags and --junior",
                    [flags, &[through_it]].concat(),
                ),
            };
            assert!(advice.contains(told), "{advice}");
            // No other node is there, but the port is in order.
            let (status, report) = doctor(hosts, PEERS, &remedy);
            assert_eq!((status, only_complaint(&report)[1]), (1, "neighbours"));
        }
        drop(junior);
        std::fs::remove_dir_all(folder).unwrap();
    });
}

/// Holds the port of all addresses and serves clients, as far as that is checked.
async fn junior() {
    let folder = std::env::var(SETTINGS).unwrap();
    let _port = UdpSocket::bind("0.0.0.0:3794").unwrap();
    let _clients = UnixDatagram::bind(format!("{folder}/JuniorRTE")).unwrap();
    let main_thread = format!("/proc/self/task/{}/comm", std::process::id());
    std::fs::write(main_thread, "JuniorRTE").unwrap();
    println!("\nholds the port");
    std::future::pending::<()>().await;
}

#[test]
fn examine_takes_a_vehicle_of_ours_for_no_other_implementation_without_multicast() {
    on_two_hosts(|hosts| {
        if !drop_multicast(hosts, "input") {
            return;
        }
        let _vehicle = vehicle(hosts);
        let (status, report) = jaus(hosts, HERE, &["examine", "101.1.1@10.213.77.1"]);
        assert_eq!(report["first_failure"], "multicast to it", "{report:#}");
        assert_eq!(
            (status, &report["profile"]["peer"]),
            (1, &"standard".into())
        );
        assert_eq!(report["profile"]["departures"], Json::Array(Vec::new()));
    });
}

#[test]
fn examine_says_of_a_stopped_process_that_it_hangs() {
    on_two_hosts(|hosts| {
        let vehicle = vehicle(hosts);
        vehicle.signal("STOP");
        for peer in ["10.213.77.1", "101.1.1@10.213.77.1"] {
            let (status, report) = jaus(hosts, HERE, &["examine", peer, "--timeout", "2s"]);
            let cause = report["likely_cause"].as_str().unwrap();
            assert!(cause.contains("hangs or is stopped"), "{report:#}");
            assert_eq!(
                (status, &report["first_failure"]),
                (1, &"any answer".into())
            );
            assert!(report["remedy"].as_str().unwrap().contains("kill -CONT"));
        }
    });
}

#[test]
fn examine_names_the_new_address_of_a_peer_that_moved() {
    on_two_hosts(|hosts| {
        hosts.ip(PEERS, &["address", "flush", "dev", "jaus0"]);
        hosts.ip(PEERS, &["address", "add", "10.213.77.9/24", "dev", "jaus0"]);
        let _vehicle = vehicle(hosts);
        for peer in ["10.213.77.1", "101.1.1@10.213.77.1"] {
            let (status, report) = jaus(hosts, HERE, &["examine", peer]);
            let remedy = report["remedy"].as_str().unwrap();
            assert!(
                remedy.contains("jaus examine 101.1.1@10.213.77.9:3794"),
                "{report:#}"
            );
            assert_eq!(status, 1);
        }
    });
}

/// Not a test by itself: does nothing unless another test starts it in a role.
#[test]
fn a_process_that_plays_a_node() {
    jaus_test_kit::hosts::play(async |role| match role {
        "junior" => junior().await,
        other => panic!("unknown role {other}"),
    });
}
