//! Forged source ids of other peers, and unassigned ids.

use std::io::Write as _;
use std::process::Stdio;

use jaus_test_kit::tools::workspace;

use super::bed::settings;
use super::scene::{ANSWERS, Scene, figures, on_scene, on_testbed};
use crate::testbed::Host;

#[test]
fn a_forged_id_takes_nothing_from_a_client() {
    on_scene(&[], |scene| {
        let attacker = scene.bed.start(Host::Strangers, "forged-id", "");
        attacker.says("begun");
        let seen = scene.client();
        let attack = figures(&attacker.says("attack"));
        println!(
            "| {} packets in the client's id | {seen:?}, {attack:?} |",
            attack["packets"]
        );
        assert!(
            seen["lost"] <= 2 && seen["answers_between"] < ANSWERS,
            "{seen:?}"
        );
        // Challenges and similar messages, but no stream.
        assert!(attack["octets"] < 40_000, "{attack:?}");
    });
}

#[test]
fn commands_in_a_pinned_id_are_obeyed_from_its_address_alone() {
    let pin = ["--peer", "102.1.1@10.216.1.2"];
    on_scene(&pin, |scene| {
        let attack = scene.attack("forged-control");
        let seen = scene.client();
        println!("| control in a pinned id | {seen:?}, {attack:?} |");
        assert_eq!((seen["controller"], seen["moved_mm"]), (0, 0), "{seen:?}");
        assert!(seen["lost"] <= 2, "{seen:?}");
    });
}

#[test]
fn commands_in_a_bound_id_are_obeyed_from_its_network_alone() {
    on_scene(&["--bind", "102.255.255@10.216.1.0/24"], |scene| {
        let attack = scene.attack("forged-control");
        let seen = scene.client();
        println!("| control in a bound id | {seen:?}, {attack:?} |");
        assert_eq!((seen["controller"], seen["moved_mm"]), (0, 0), "{seen:?}");
        assert!(seen["lost"] <= 2 && attack["octets"] == 0, "{seen:?}");
        scene.warns("binds this id to other networks");
    });
}

#[test]
fn without_a_binding_a_forged_id_drives_the_vehicle_and_the_log_says_so() {
    on_scene(&[], |scene| {
        let attack = scene.attack("forged-control");
        let seen = scene.client();
        println!("| control in an id that is not bound | {seen:?}, {attack:?} |");
        assert!(seen["moved_mm"] > 100, "{seen:?}");
        scene.warns("an id is used at two addresses");
    });
}

#[test]
fn no_events_stream_to_an_address_that_has_proved_nothing() {
    on_scene(&[], |scene| {
        let attack = scene.attack("events");
        println!("| 256 forged Create Events | {attack:?} |");
        // 4 KiB at once, then 1 KiB per second for 6 s.
        assert!(attack["octets"] <= 12_000, "{attack:?}");
        assert!(scene.client()["lost"] <= 2);
    });
}

#[test]
fn newcomers_are_answered_though_the_directory_was_filled() {
    on_scene(&[], |scene| {
        scene.attack("configuration");
        let ms = scene.welcomes_newcomer("");
        println!("| a configuration of 1025 components | newcomer answered after {ms} ms |");
    });
}

#[test]
fn newcomers_are_answered_among_ids_that_come_and_go() {
    on_scene(&[], |scene| {
        let attacker = scene.bed.start(Host::Strangers, "many-ids", "");
        attacker.says("begun");
        assert!(scene.client()["lost"] <= 2);
        let ms = scene.welcomes_newcomer("");
        println!("| 1100 ids in turn | newcomer answered after {ms} ms |");
    });
}

#[test]
fn queries_are_not_amplified_to_an_address_that_has_proved_nothing() {
    on_scene(&[], |scene| {
        let attack = scene.attack("queries");
        println!("| Query Services of 256 forged ids | {attack:?} |");
        // 4 KiB at once, then 1 KiB per second for 6 s.
        assert!(attack["octets"] <= 12_000, "{attack:?}");
        assert!(scene.client()["lost"] <= 2);
    });
}

#[test]
fn commands_from_a_network_that_is_not_allowed_are_not_obeyed() {
    let text = "[access]\nallow_networks = [\"10.216.1.0/24\"]\n";
    let file = settings("access", text);
    on_scene(&["--config", &file], |scene| {
        let attack = scene.attack("forged-control");
        let seen = scene.client();
        println!("| control from a network that is not allowed | {seen:?}, {attack:?} |");
        assert_eq!((seen["controller"], seen["moved_mm"]), (0, 0), "{seen:?}");
        assert!(seen["lost"] <= 2 && attack["octets"] == 0, "{seen:?}");
    });
}

/// The file of nftables in docs/hardening.md, for the cables and the client of the test bed.
fn firewall() -> String {
    let page = std::fs::read_to_string(workspace("docs/hardening.md")).unwrap();
    let (_, block) = page.split_once("```nft\n").unwrap();
    let (rules, _) = block.split_once("```").unwrap();
    let cables = [Host::Controller, Host::Strangers].map(Host::cable);
    rules
        .replace(
            "!= \"eth0\"",
            &format!("!= {{ \"{}\", \"{}\" }}", cables[0], cables[1]),
        )
        .replace("192.168.7.2", "10.216.1.2")
}

#[test]
fn commands_do_not_pass_the_firewall_of_the_hardening_page() {
    on_testbed(|bed| {
        let mut nft = bed.program(Host::Vehicle, "nft", &["-f", "-"]);
        let mut nft = nft.stdin(Stdio::piped()).spawn().unwrap();
        let mut rules = nft.stdin.take().unwrap();
        rules.write_all(firewall().as_bytes()).unwrap();
        drop(rules);
        assert!(nft.wait().unwrap().success());
        let scene = Scene::start(bed, &[], "");
        let attack = scene.attack("forged-control");
        let seen = scene.client();
        println!("| control against a firewall | {seen:?}, {attack:?} |");
        assert_eq!((seen["controller"], seen["moved_mm"]), (0, 0), "{seen:?}");
        assert!(seen["lost"] <= 2 && attack["octets"] == 0, "{seen:?}");
    });
}

#[test]
fn newcomers_are_answered_among_ids_with_addresses_of_their_own() {
    on_scene(&[], |scene| {
        let attacker = scene.bed.start(Host::Strangers, "many-addresses", "");
        attacker.says("begun");
        let seen = scene.client();
        assert!(seen["lost"] <= 2, "{seen:?}");
        let ms = scene.welcomes_newcomer("");
        println!("| 1100 ids from 500 addresses | newcomer answered after {ms} ms |");
    });
}
