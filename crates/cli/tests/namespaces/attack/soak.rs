//! Soak test: consecutive attacks on one vehicle. By hand for an hour: `JAUS_SOAK_SECONDS=3600
//! cargo test --test namespaces -- --ignored --nocapture soak`

use std::time::{Duration, Instant};

use super::scene::{MEMORY, Scene, on_testbed};
use crate::testbed::Host;
use jaus_test_kit::hosts::SOAK;

/// The table of the other tests has their results.
const ATTACKS: [&str; 10] = [
    "flood",
    "forged-id",
    "unending",
    "many-ids",
    "events",
    "gapped",
    "configuration",
    "services",
    "overlapping",
    "answers",
];

#[test]
#[ignore = "takes as long as JAUS_SOAK_SECONDS says"]
fn soak() {
    let seconds = std::env::var(SOAK).expect("the number of seconds that it is to take");
    let time = Duration::from_secs(seconds.parse().unwrap());
    on_testbed(|bed| {
        let echo = bed.start(Host::Vehicle, "echo", "");
        echo.says("echoes");
        let scene = Scene::start(bed, &[], "echo");
        let end = Instant::now() + time;
        let (mut pings, mut lost, mut rounds) = (0, 0, Vec::new());
        while Instant::now() < end {
            for attack in ATTACKS {
                let attacker = scene.bed.start(Host::Strangers, attack, "");
                let seen = scene.client();
                println!("| {attack} | {seen:?}, {} KiB |", scene.memory());
                pings += seen["pings"];
                lost += seen["lost"].saturating_sub(seen["echoes_lost"]);
                drop(attacker);
            }
            rounds.push(scene.memory());
        }
        println!("| {pings} pings | {lost} lost, KiB after each round: {rounds:?} |");
        assert!(lost * 200 <= pings, "{lost} of {pings}");
        // Bounded tables fill in the first half; in the second, memory must not grow.
        let (middle, last) = (rounds[rounds.len() / 2], rounds[rounds.len() - 1]);
        assert!(last < MEMORY && last <= middle * 102 / 100, "{rounds:?}");
    });
}
