//! The same attacks over IPv6, where one host has 2^64 addresses.

use super::bed::settings;
use super::scene::{ANSWERS, Scene, figures, on_testbed};
use crate::testbed::Host;

/// A vehicle and a client that use IPv6 only.
fn on_ip6_scene(body: impl Fn(Scene<'_>)) {
    // Uses global addresses, which off-link attackers reach; by default a node uses link-local
    // ones.
    let interfaces = "[\"fd00:216:1::1\", \"fd00:216:2::1\", \"fd00:216:3::1\"]";
    let file = settings("ip6", &format!("ip = \"6\"\ninterfaces = {interfaces}\n"));
    on_testbed(|bed| {
        bed.add_ip6();
        body(Scene::start(bed, &["--config", &file], "ip6"));
    });
}

#[test]
fn a_forged_id_takes_nothing_from_a_client() {
    on_ip6_scene(|scene| {
        let attacker = scene.bed.start(Host::Strangers, "forged-id6", "");
        attacker.says("begun");
        let seen = scene.client();
        let attack = figures(&attacker.says("attack"));
        println!("| IPv6: packets in the client's id | {seen:?}, {attack:?} |");
        assert!(
            seen["lost"] <= 2 && seen["answers_between"] < ANSWERS,
            "{seen:?}"
        );
        assert!(attack["octets"] < 40_000, "{attack:?}");
    });
}

#[test]
fn no_events_stream_to_a_network_that_has_proved_nothing() {
    on_ip6_scene(|scene| {
        let attack = scene.attack("events6");
        println!("| IPv6: Create Events from 256 addresses | {attack:?} |");
        // 4 KiB at once, then 1 KiB per second for 6 s.
        assert!(attack["octets"] <= 12_000, "{attack:?}");
        assert!(scene.client()["lost"] <= 2);
    });
}

#[test]
fn newcomers_are_answered_among_ids_with_addresses_of_their_own() {
    on_ip6_scene(|scene| {
        let attacker = scene.bed.start(Host::Strangers, "many-ids6", "");
        attacker.says("begun");
        let seen = scene.client();
        assert!(seen["lost"] <= 2, "{seen:?}");
        let ms = scene.welcomes_newcomer("ip6");
        println!("| IPv6: 1100 ids from 500 addresses | newcomer answered after {ms} ms |");
    });
}
