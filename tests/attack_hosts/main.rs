//! Attacks on `jaus vehicle`, on real hosts: the vehicle with its defaults in one network namespace,
//! an attacker in another, and clients that behave in two more.
//!
//! The rows of the table in docs/safety.md are printed:
//! `cargo test --test attack_hosts -- --nocapture | grep '^|'`
//!
//! Every attack is bounded in time and in packets. Making namespaces needs rights, see
//! `tests/namespaces`.
#![cfg(target_os = "linux")]
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with processes"
)]

mod attacker;
mod attacks;
mod clients;
#[path = "../namespaces/hosts.rs"]
#[allow(dead_code, reason = "shared with tests that do more")]
mod hosts;
#[path = "../support/networks.rs"]
#[allow(dead_code, reason = "shared with tests that do more")]
mod networks;
mod talkers;
#[path = "../safety_hosts/testbed.rs"]
#[allow(dead_code, reason = "shared with tests that do more")]
mod testbed;
#[path = "../support/vehicle_process.rs"]
#[allow(dead_code, reason = "shared with tests that do more")]
mod vehicle_process;

use std::collections::BTreeMap;
use std::time::Duration;

use hosts::Process;
use networks::on_hosts;
use testbed::{Host, Testbed};
use vehicle_process::VehicleProcess;

/// What `MemoryMax` of the packaged services allows, in KiB.
const MEMORY: u64 = 64 * 1024;

/// A vehicle and a client that has found it.
struct Scene<'a> {
    bed: &'a Testbed,
    vehicle: VehicleProcess,
    client: Process,
}

/// Numbers that a process has printed, by name.
type Figures = BTreeMap<String, u64>;

fn figures(line: &str) -> Figures {
    let pairs = line.split(' ').filter_map(|word| word.split_once('='));
    pairs
        .map(|(name, number)| (name.to_owned(), number.parse().unwrap()))
        .collect()
}

impl Scene<'_> {
    /// Runs an attack to its end; what it says of itself.
    fn attack(&self, name: &str) -> Figures {
        let attacker = self.bed.start(Host::Strangers, name, "");
        figures(&attacker.says("attack"))
    }

    /// What the client has seen since the last time.
    fn client(&self) -> Figures {
        self.client.says("client");
        figures(&self.client.says("client"))
    }

    /// The most memory that the vehicle has had, in KiB, without the pages of its program: an
    /// unoptimised one has many, and the kernel need not keep them.
    fn memory(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.vehicle.id()));
        let status = status.unwrap();
        let number = |name| {
            let line = status.lines().find_map(|line| line.strip_prefix(name));
            let number = line.unwrap().trim().trim_end_matches(" kB");
            number.parse::<u64>().unwrap()
        };
        number("VmHWM:") - number("RssFile:")
    }

    /// Starts a newcomer; checks that it finds the vehicle and is answered within ten seconds, and
    /// that it is in the vehicle's directory after ten more. Ends the vehicle.
    fn welcomes_newcomer(self) -> u64 {
        let newcomer = self.bed.start(Host::Observer, "newcomer", "");
        let ms = figures(&newcomer.says("newcomer"))["ms"];
        assert!(ms < 10_000, "{ms} ms");
        std::thread::sleep(Duration::from_secs(10));
        let lines = self.vehicle.terminate();
        let is_newcomer = |line: &String| line.contains("104.1.1");
        assert!(lines.iter().any(is_newcomer), "{lines:#?}");
        ms
    }
}

fn on_testbed(test: &str, body: impl FnOnce(&Testbed)) {
    let ran = on_hosts(test, Testbed::new, body);
    let may_skip = std::env::var_os("CI").is_none();
    assert!(ran || may_skip, "no network namespaces on CI");
}

fn on_scene(test: &str, flags: &[&str], body: impl FnOnce(Scene<'_>)) {
    on_testbed(test, |bed| {
        let arguments = [&["vehicle", "--id", "101.1.1"], flags].concat();
        let vehicle = VehicleProcess::start(&mut bed.jaus(Host::Vehicle, &arguments));
        let client = bed.start(Host::Controller, "client", "");
        client.says("client");
        body(Scene {
            bed,
            vehicle,
            client,
        });
    });
}

/// A flood costs the client no more than an echo socket loses, and stays within the memory limit.
fn a_flood_costs_nothing(test: &str, attack: &str) {
    on_scene(test, &[], |scene| {
        let echo = scene.bed.start(Host::Vehicle, "echo", "");
        echo.says("echoes");
        let attacker = scene.bed.start(Host::Strangers, attack, "");
        attacker.says("begun");
        let seen = scene.client();
        let sent = figures(&attacker.says("attack"))["packets"];
        let memory = scene.memory();
        println!("| {sent} datagrams, {attack} | {seen:?}, {memory} KiB |");
        assert!(sent > 50_000, "{sent}");
        let (lost, echoes) = (seen["lost"], seen["echoes_lost"]);
        assert!(lost <= echoes + 5, "{seen:?}");
        assert!(memory < MEMORY, "{memory} KiB");
    });
}

#[test]
fn a_flood_of_rubbish_costs_a_client_no_more_than_an_echo_socket() {
    let test = "a_flood_of_rubbish_costs_a_client_no_more_than_an_echo_socket";
    a_flood_costs_nothing(test, "flood");
}

#[test]
fn a_forged_id_takes_nothing_from_a_client() {
    let test = "a_forged_id_takes_nothing_from_a_client";
    on_scene(test, &[], |scene| {
        let attacker = scene.bed.start(Host::Strangers, "forged-id", "");
        attacker.says("begun");
        let seen = scene.client();
        let attack = figures(&attacker.says("attack"));
        println!(
            "| {} packets in the client's id | {seen:?}, {attack:?} |",
            attack["packets"]
        );
        assert!(seen["lost"] <= 2 && seen["gap_ms"] < 1000, "{seen:?}");
        // Challenges and the like, and no stream.
        assert!(attack["octets"] < 40_000, "{attack:?}");
    });
}

#[test]
fn commands_in_a_pinned_id_are_obeyed_from_its_address_alone() {
    let test = "commands_in_a_pinned_id_are_obeyed_from_its_address_alone";
    let pin = ["--peer", "102.1.1@10.216.1.2"];
    on_scene(test, &pin, |scene| {
        let attack = scene.attack("forged-control");
        let seen = scene.client();
        println!("| control in a pinned id | {seen:?}, {attack:?} |");
        assert_eq!((seen["controller"], seen["moved_mm"]), (0, 0), "{seen:?}");
        assert!(seen["lost"] <= 2, "{seen:?}");
    });
}

#[test]
fn no_events_stream_to_an_address_that_has_proved_nothing() {
    let test = "no_events_stream_to_an_address_that_has_proved_nothing";
    on_scene(test, &[], |scene| {
        let attack = scene.attack("events");
        println!("| 256 forged Create Events | {attack:?} |");
        // 4 KiB at once and 1 KiB a second, for 12 s.
        assert!(attack["octets"] <= 20_000, "{attack:?}");
        assert!(scene.client()["lost"] <= 2);
    });
}

#[test]
fn newcomers_are_answered_though_the_directory_was_filled() {
    let test = "newcomers_are_answered_though_the_directory_was_filled";
    on_scene(test, &[], |scene| {
        scene.attack("configuration");
        let ms = scene.welcomes_newcomer();
        println!("| a configuration of 1025 components | newcomer answered after {ms} ms |");
    });
}

#[test]
fn newcomers_are_answered_among_ids_that_come_and_go() {
    let test = "newcomers_are_answered_among_ids_that_come_and_go";
    on_scene(test, &[], |scene| {
        let attacker = scene.bed.start(Host::Strangers, "many-ids", "");
        attacker.says("begun");
        assert!(scene.client()["lost"] <= 2);
        let ms = scene.welcomes_newcomer();
        println!("| 1100 ids in turn | newcomer answered after {ms} ms |");
    });
}

#[test]
fn reports_of_many_services_stay_within_the_memory_limit() {
    let test = "reports_of_many_services_stay_within_the_memory_limit";
    on_scene(test, &[], |scene| {
        let attack = scene.attack("services");
        let memory = scene.memory();
        println!("| {attack:?} octets of Report Services | {memory} KiB |");
        assert!(memory < MEMORY, "{memory} KiB");
    });
}

/// Two nodes that send each other acknowledged messages, one of them on the attacked host: each
/// message arrives once and whole, and each is known to have arrived.
fn acknowledged_messages_arrive(test: &str, attack: &str) {
    on_testbed(test, |bed| {
        let ids = ["101.1.1", "102.1.1"];
        let talkers = [
            bed.start(Host::Vehicle, "talker", &ids.join(" ")),
            bed.start(Host::Controller, "talker", &[ids[1], ids[0]].join(" ")),
        ];
        talkers.iter().for_each(|it| drop(it.says("talker begins")));
        let attacker = bed.start(Host::Strangers, attack, "");
        attacker.says("begun");
        let seen = talkers.each_ref().map(|it| figures(&it.says("talker")));
        println!("| acknowledged messages, {attack} | {seen:?} |");
        for (one, other) in [(0, 1), (1, 0)] {
            let (sent, heard) = (&seen[one], &seen[other]);
            assert!(sent["acknowledged"] > 100, "{seen:?}");
            assert_eq!(sent["lost"], 0, "{seen:?}");
            assert_eq!(sent["acknowledged"], heard["heard"], "{seen:?}");
            assert_eq!((heard["doubles"], heard["corrupt"]), (0, 0), "{seen:?}");
        }
    });
}

#[test]
fn acknowledged_messages_arrive_in_a_flood_of_rubbish() {
    let test = "acknowledged_messages_arrive_in_a_flood_of_rubbish";
    acknowledged_messages_arrive(test, "flood");
}

#[test]
#[ignore = "answers and fragments are taken from any address yet"]
fn acknowledged_messages_arrive_whole_among_forged_fragments() {
    let test = "acknowledged_messages_arrive_whole_among_forged_fragments";
    acknowledged_messages_arrive(test, "overlapping");
}

#[test]
#[ignore = "answers and fragments are taken from any address yet"]
fn acknowledged_messages_arrive_among_forged_acknowledgements() {
    let test = "acknowledged_messages_arrive_among_forged_acknowledgements";
    acknowledged_messages_arrive(test, "answers");
}

#[test]
fn fragments_without_end_cost_neither_memory_nor_a_clients_messages() {
    let test = "fragments_without_end_cost_neither_memory_nor_a_clients_messages";
    a_flood_costs_nothing(test, "unending");
}

#[test]
fn fragments_with_gaps_cost_neither_memory_nor_a_clients_messages() {
    let test = "fragments_with_gaps_cost_neither_memory_nor_a_clients_messages";
    a_flood_costs_nothing(test, "gapped");
}

/// Not a test of its own: does nothing unless another test starts it in a role.
#[test]
fn a_process_that_plays_a_node() {
    hosts::play(async |role| match role {
        "client" => clients::client().await,
        "newcomer" => clients::newcomer().await,
        "echo" => clients::echo(),
        "talker" => talkers::talk().await,
        attack => attacks::run(attack).await,
    });
}
