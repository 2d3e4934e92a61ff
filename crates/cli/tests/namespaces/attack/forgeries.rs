//! Forged source ids of other peers, and unassigned ids.

use super::bed::settings;
use super::scene::{ANSWERS, figures, on_scene};
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
