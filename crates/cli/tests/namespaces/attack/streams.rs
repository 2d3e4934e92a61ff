//! Idle connections that occupy slots, and a subscriber that stops reading.

use super::bed::settings;
use super::scene::{ANSWERS, MEMORY, figures, on_scene};
use crate::testbed::Host;
use jaus_test_kit::hosts::Process;
use jaus_test_kit::hosts::run;

#[test]
fn newcomers_connect_though_many_connections_are_held() {
    let file = settings("connections", "[tcp]\nlisten = \"0.0.0.0\"\n");
    on_scene(&["--config", &file], |scene| {
        let attacker = scene.bed.start(Host::Strangers, "connections", "");
        attacker.says("begun");
        let seen = scene.client();
        assert!(seen["lost"] <= 2, "{seen:?}");
        let memory = scene.memory();
        assert!(memory < MEMORY, "{memory} KiB");
        let ms = scene.welcomes_newcomer("tcp");
        let opened = figures(&attacker.says("attack"))["opened"];
        println!("| {opened} connections | {seen:?}, {memory} KiB, newcomer after {ms} ms |");
        assert!(opened >= 160, "{opened}");
    });
}

#[test]
fn connections_beyond_the_limit_of_open_files_cost_a_client_nothing() {
    let file = settings("files", "[tcp]\nlisten = \"0.0.0.0\"\n");
    on_scene(&["--config", &file], |scene| {
        let process = scene.vehicle.id().to_string();
        run("prlimit", &["--pid", &process, "--nofile=48"]).unwrap();
        let attacker = scene.bed.start(Host::Strangers, "connections", "");
        attacker.says("begun");
        let seen = scene.client();
        println!("| 160 connections, 48 open files | {seen:?} |");
        assert!(
            seen["lost"] <= 2 && seen["answers_between"] < ANSWERS,
            "{seen:?}"
        );
    });
}

#[test]
fn a_subscriber_that_is_suspended_costs_others_nothing() {
    on_scene(&[], |scene| {
        let subscriber: Process = scene.bed.start(Host::Observer, "subscriber", "");
        subscriber.says("subscriber reads");
        subscriber.signal("STOP");
        let seen = scene.client();
        let memory = scene.memory();
        println!("| a suspended subscriber to 1000 events/s | {seen:?}, {memory} KiB |");
        assert!(
            seen["lost"] <= 2 && seen["answers_between"] < ANSWERS,
            "{seen:?}"
        );
        assert!(memory < MEMORY, "{memory} KiB");
    });
}
