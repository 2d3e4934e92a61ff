//! Nodes on two hosts: two network namespaces with a cable between them. The nodes are processes
//! (this test binary, restarted inside a namespace) and discover each other by multicast.
//!
//! Namespaces need rights: root's, or a kernel that permits user namespaces. Without either, the
//! tests report this prominently and pass.
#![cfg(target_os = "linux")]
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test with processes"
)]

mod judge;
mod links;
mod roles;

use std::time::{Duration, Instant};

use jaus_test_kit::evidence::not_tested;
use jaus_test_kit::hosts::{on_two_hosts, run};

#[test]
fn nodes_on_two_hosts_meet_by_multicast_and_go_on_by_unicast() {
    on_two_hosts(
        "nodes_on_two_hosts_meet_by_multicast_and_go_on_by_unicast",
        |hosts| {
            let echo = hosts.start(0, "echo");
            assert_eq!(echo.says("listening on"), "10.213.77.1:3794");
            let caller = hosts.start(1, "caller");
            assert_eq!(echo.says("heard"), "102.1.1 at 10.213.77.2:3794");
            assert_eq!(caller.says("answered by"), "101.1.33 at 10.213.77.1:3794");
        },
    );
}

#[test]
fn an_interface_that_comes_up_later_is_used_and_again_after_it_was_down() {
    on_two_hosts(
        "an_interface_that_comes_up_later_is_used_and_again_after_it_was_down",
        |hosts| {
            hosts.ip(0, &["address", "flush", "dev", "jaus0"]);
            let echo = hosts.start(0, "echo");
            assert_eq!(echo.says("listening on"), "127.0.0.1:3794");

            hosts.ip(0, &["address", "add", "10.213.77.1/24", "dev", "jaus0"]);
            let caller = hosts.start(1, "caller");
            assert_eq!(caller.says("answered by"), "101.1.33 at 10.213.77.1:3794");

            hosts.ip(0, &["link", "set", "jaus0", "down"]);
            hosts.ip(0, &["address", "flush", "dev", "jaus0"]);
            hosts.ip(0, &["link", "set", "jaus0", "up"]);
            hosts.ip(0, &["address", "add", "10.213.77.9/24", "dev", "jaus0"]);
            let caller = hosts.start(1, "caller");
            assert_eq!(caller.says("answered by"), "101.1.33 at 10.213.77.9:3794");
        },
    );
}

#[test]
fn an_urgent_message_overtakes_what_a_slow_network_holds_back() {
    on_two_hosts(
        "an_urgent_message_overtakes_what_a_slow_network_holds_back",
        |hosts| {
            let slow = ["qdisc", "add", "dev", "jaus0", "root", "tbf"];
            let slow = [
                &slow[..],
                &["rate", "20mbit", "burst", "4kb", "latency", "10s"],
            ]
            .concat();
            let network = &hosts.names[1];
            if let Err(reason) = run(
                "ip",
                &[&["netns", "exec", network, "tc"], &slow[..]].concat(),
            ) {
                return not_tested("an_urgent_message_overtakes_…", &reason);
            }
            let sink = hosts.start(0, "sink");
            sink.says("listening on");
            let _flood = hosts.start(1, "flood");
            let before: usize = sink.says("urgent message after").parse().unwrap();
            assert!(
                before < roles::FLOOD / 2,
                "the urgent message came after {before} of {}",
                roles::FLOOD
            );
            assert_eq!(sink.says("all").parse(), Ok(roles::FLOOD));
        },
    );
}

#[test]
fn nodes_on_two_hosts_discover_each_other_within_a_second_and_notice_a_death() {
    let test = "nodes_on_two_hosts_discover_each_other_within_a_second_and_notice_a_death";
    on_two_hosts(test, |hosts| {
        let vehicle = hosts.start(0, "vehicle");
        vehicle.says("started");
        // Long enough that the vehicle's first announcements are over: the second party must find
        // it.
        std::thread::sleep(Duration::from_secs(4));
        let operator = hosts.start(1, "operator");
        operator.says("started");
        let started = Instant::now();
        let after = operator.says("found 101.1.33 with its services after");
        vehicle.says("found 102.1.1 with its services after");
        assert!(
            started.elapsed() < Duration::from_secs(1),
            "{:?}",
            started.elapsed()
        );
        assert!(
            after.parse::<u32>().unwrap() < 1000,
            "the operator found it after {after} ms"
        );

        drop(vehicle);
        let killed = Instant::now();
        operator.says("lost 101.1.33");
        // The rule of discovery: silent for one and a half periods, then three unanswered queries.
        assert!(
            killed.elapsed() < Duration::from_secs(14),
            "{:?}",
            killed.elapsed()
        );
    });
}

#[test]
fn what_comes_through_two_cables_is_delivered_once() {
    on_two_hosts("what_comes_through_two_cables_is_delivered_once", |hosts| {
        hosts.connect("jaus1", "10.213.78").unwrap();
        let listener = hosts.start(0, "listener");
        listener.says("listening on 2 links");
        let _announcer = hosts.start(1, "announcer");
        for number in 0..roles::ANNOUNCEMENTS {
            assert_eq!(listener.says("heard").parse(), Ok(number));
        }
    });
}

/// Not a test by itself: does nothing unless another test starts it in a role.
#[test]
fn a_process_that_plays_a_node() {
    jaus_test_kit::hosts::play(async |role| match role {
        "echo" => roles::echo().await,
        "caller" => roles::call().await,
        "follower" => roles::follow().await,
        "sink" => roles::sink().await,
        "flood" => roles::flood().await,
        "listener" => roles::listen().await,
        "announcer" => roles::announce().await,
        "vehicle" => roles::vehicle().await,
        "train" => roles::train().await,
        "station" => roles::station().await,
        "operator" => roles::operator().await,
        other => panic!("unknown role {other}"),
    });
}
