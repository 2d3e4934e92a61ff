//! The gateway to the Reference Architecture, with an attacker among the RA systems.

use std::process::Stdio;

use super::attacks::BESIDE;
use super::floods::{UNANSWERED, alone};
use super::scene::{MEMORY, memory, on_testbed};
use crate::gateway::Gateway;
use crate::testbed::{Host, Testbed};
use jaus_test_kit::hosts::Process;
use jaus_test_kit::vehicle_process::VehicleProcess;

/// A gateway on the vehicle's host, with RA systems on the controller's host.
fn gateway(bed: &Testbed) -> Gateway {
    let beside = format!("10.216.1.{BESIDE}/24");
    let cable = Host::Controller.cable();
    bed.ip(Host::Controller, &["address", "add", &beside, "dev", cable]);
    Gateway::start(&bed.name(Host::Vehicle), cable, &[], Stdio::null())
}

fn ra_vehicle(bed: &Testbed) -> Process {
    let vehicle = bed.start(Host::Controller, "ra-vehicle", "");
    vehicle.says("listening on");
    vehicle
}

#[test]
fn an_ra_vehicle_is_watched_and_driven_in_a_flood_of_ra_messages() {
    let _alone = alone(&UNANSWERED);
    on_testbed(|bed| {
        let running = gateway(bed);
        let vehicle = ra_vehicle(bed);
        let operator = bed.start(Host::Vehicle, "operator", "");
        operator.says("found 20.1.38");
        let attacker = bed.start(Host::Controller, "ra-flood", "");
        attacker.says("begun");
        let poses: u32 = operator.says("poses in 3 s").parse().unwrap();
        operator.says("in control");
        vehicle.says("driven");
        operator.says("released");
        let memory = memory(running.id());
        println!("| 3000 RA messages/s of all subsystems | {poses} poses in 3 s, {memory} KiB |");
        assert!((20..=35).contains(&poses), "{poses}");
        assert!(memory < MEMORY, "{memory} KiB");
    });
}

#[test]
fn a_forged_ra_controller_neither_stops_nor_releases_a_jaus_vehicle() {
    on_testbed(|bed| {
        let _gateway = gateway(bed);
        let arguments = ["vehicle", "--id", "101.1.7", "--port", "0"];
        let vehicle = VehicleProcess::start(&mut bed.jaus(Host::Vehicle, &arguments));
        let operator = ra_vehicle(bed);
        operator.says("in control of 101.1.33.7");
        let attacker = bed.start(Host::Controller, "ra-forged", "");
        attacker.says("begun");
        operator.says("101.1.42.7 moves");
        attacker.says("attack");
        let lines = vehicle.terminate();
        let is_news = |line: &&String| line.contains("in control") || line.contains("standby");
        let news: Vec<_> = lines.iter().filter(is_news).collect();
        println!("| Standby, Release Control in an RA controller's id | {news:?} |");
        let losses = news
            .iter()
            .filter(|it| it.contains("no client is in control"));
        assert_eq!(losses.count(), 0, "{lines:#?}");
        let speeds = lines.iter().filter(|line| line.ends_with(" m/s"));
        let slow = speeds.skip(4).filter(|line| line.ends_with(" 0.0 m/s"));
        assert_eq!(slow.count(), 0, "{lines:#?}");
    });
}
