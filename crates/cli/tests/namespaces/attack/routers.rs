//! Routers in a loop: each message passes every cable once, and then the network is silent.

use std::time::Duration;

use super::bed::settings;
use super::scene::{figures, on_testbed};
use crate::testbed::{Host, Testbed};
use jaus_test_kit::vehicle_process::VehicleProcess;

const ROUTERS: [Host; 3] = [Host::Vehicle, Host::Controller, Host::Observer];

fn start(bed: &Testbed, host: Host, id: &str, text: &str) -> VehicleProcess {
    let file = settings(&format!("router-{id}"), text);
    let arguments = ["node", "--id", id, "--config", &file];
    VehicleProcess::start(&mut bed.jaus(host, &arguments))
}

/// Checks that the routers send a bounded number of packets while attackers send to unused ids, and
/// almost none soon afterwards.
fn is_quiet_after_an_attack(bed: &Testbed, most_copies: u64) {
    let sent = || ROUTERS.iter().map(|&it| bed.packets_sent(it)).sum::<u64>();
    std::thread::sleep(Duration::from_secs(2));
    let before = sent();
    let attacker = bed.start(Host::Strangers, "to-nobody", "");
    let attack = figures(&attacker.says("attack"))["packets"];
    let during = sent() - before;
    std::thread::sleep(Duration::from_secs(2));
    let before = sent();
    std::thread::sleep(Duration::from_secs(3));
    let after = sent() - before;
    println!("| {attack} messages to nobody through routers | {during} packets, then {after} |");
    assert!(attack > 2000, "{attack}");
    assert!(during > attack, "nothing is passed on: {during}");
    assert!(during <= attack * most_copies + 1000, "{during}");
    assert!(after <= 200, "{after}");
}

#[test]
fn three_routers_in_a_circle_pass_each_message_on_once() {
    on_testbed(|bed| {
        bed.connect([Host::Controller, Host::Observer], "circle", "10.218.0");
        let ids = ["111.1.1", "112.1.1", "113.1.1"];
        let text = "[routing]\nforward = true\n";
        let routers: Vec<_> = (ROUTERS.iter().zip(ids))
            .map(|(&host, id)| start(bed, host, id, text))
            .collect();
        // The first router sends on two cables, and each of the other two on the cable between
        // them. The routers' answers to every fourth message take five more packets.
        is_quiet_after_an_attack(bed, 6);
        routers.into_iter().for_each(|it| drop(it.terminate()));
    });
}

#[test]
fn two_routers_that_name_each_other_pass_each_message_on_once() {
    on_testbed(|bed| {
        let text = |other: u8| {
            format!(
                "group = \"off\"\npeers = [\"200.255.255@10.216.1.{other}\"]\n\
                 [routing]\nforward = true\n"
            )
        };
        let routers = [
            start(bed, Host::Vehicle, "111.1.1", &text(2)),
            start(bed, Host::Controller, "112.1.1", &text(1)),
        ];
        is_quiet_after_an_attack(bed, 2);
        routers.into_iter().for_each(|it| drop(it.terminate()));
    });
}
