//! Floods: garbage, fragments, answers, reports.

use std::sync::{Mutex, MutexGuard, PoisonError};

use super::scene::{ANSWERS, MEMORY, Scene, figures, on_scene, on_testbed};
use crate::testbed::Host;

/// Held by a flood beside a client that asks for no acknowledgements, ...
pub(crate) static UNANSWERED: Mutex<()> = Mutex::new(());
/// ... and by a flood among acknowledged messages.
static ACKNOWLEDGED: Mutex<()> = Mutex::new(());

/// Waits for other floods of the same kind: many at once would only show how few processors there
/// are.
pub(crate) fn alone(floods: &Mutex<()>) -> MutexGuard<'_, ()> {
    floods.lock().unwrap_or_else(PoisonError::into_inner)
}

/// In a flood the client loses no more than an echo socket does, and the vehicle stays within the
/// memory limit.
fn a_flood_costs_nothing(attack: &str) {
    let _alone = alone(&UNANSWERED);
    on_testbed(|bed| {
        let echo = bed.start(Host::Vehicle, "echo", "");
        echo.says("echoes");
        let scene = Scene::start(bed, &[], "echo");
        let attacker = scene.bed.start(Host::Strangers, attack, "");
        attacker.says("begun");
        let seen = scene.client();
        let sent = figures(&attacker.says("attack"))["packets"];
        let memory = scene.memory();
        println!("| {sent} datagrams, {attack} | {seen:?}, {memory} KiB |");
        assert!(sent > 30_000, "{sent}");
        let (lost, echoes) = (seen["lost"], seen["echoes_lost"]);
        assert!(lost <= echoes + 2, "{seen:?}");
        assert!(echoes > 0 || seen["answers_between"] < ANSWERS, "{seen:?}");
        assert!(memory < MEMORY, "{memory} KiB");
    });
}

#[test]
fn a_flood_of_rubbish_costs_a_client_no_more_than_an_echo_socket() {
    a_flood_costs_nothing("flood");
}

#[test]
fn reports_of_many_services_stay_within_the_memory_limit() {
    on_scene(&[], |scene| {
        let attack = scene.attack("services");
        let memory = scene.memory();
        println!("| {attack:?} octets of Report Services | {memory} KiB |");
        assert!(memory < MEMORY, "{memory} KiB");
    });
}

/// Two nodes exchange acknowledged messages, one of them on the attacked host. Each message arrives
/// once and complete, and the sender receives its acknowledgement.
fn acknowledged_messages_arrive(attack: &str) {
    let _alone = alone(&ACKNOWLEDGED);
    on_testbed(|bed| {
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
    acknowledged_messages_arrive("flood");
}

#[test]
fn acknowledged_messages_arrive_whole_among_forged_fragments() {
    acknowledged_messages_arrive("overlapping");
}

#[test]
fn acknowledged_messages_arrive_among_forged_acknowledgements() {
    acknowledged_messages_arrive("answers");
}

#[test]
fn fragments_without_end_cost_neither_memory_nor_a_clients_messages() {
    a_flood_costs_nothing("unending");
}

#[test]
fn fragments_with_gaps_cost_neither_memory_nor_a_clients_messages() {
    a_flood_costs_nothing("gapped");
}

#[test]
fn reports_of_many_services_among_fragments_stay_within_the_memory_limit() {
    on_scene(&[], |scene| {
        let fragments = scene.bed.start(Host::Strangers, "unending", "");
        fragments.says("begun");
        scene.attack("services");
        let memory = scene.memory();
        println!("| Report Services among unending fragments | {memory} KiB |");
        assert!(memory < MEMORY, "{memory} KiB");
    });
}
