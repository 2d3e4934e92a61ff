//! Nodes on two hosts with a cable between them. They discover each other by multicast.

mod links;
mod roles;

use jaus_test_kit::evidence::{not_tested, this_test};
use jaus_test_kit::hosts::{on_two_hosts, run};

#[test]
fn nodes_on_two_hosts_meet_by_multicast_and_go_on_by_unicast() {
    on_two_hosts(|hosts| {
        let echo = hosts.start(0, "echo");
        assert_eq!(echo.says("listening on"), "10.213.77.1:3794");
        let caller = hosts.start(1, "caller");
        assert_eq!(echo.says("heard"), "102.1.1 at 10.213.77.2:3794");
        assert_eq!(caller.says("answered by"), "101.1.33 at 10.213.77.1:3794");
    });
}

#[test]
fn an_interface_that_comes_up_later_is_used_and_again_after_it_was_down() {
    on_two_hosts(|hosts| {
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
    });
}

#[test]
fn an_urgent_message_overtakes_what_a_slow_network_holds_back() {
    on_two_hosts(|hosts| {
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
            return not_tested(&this_test(), &reason);
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
    });
}

#[test]
fn nodes_on_two_hosts_discover_each_other_and_notice_a_death() {
    on_two_hosts(|hosts| {
        let vehicle = hosts.start(0, "vehicle");
        vehicle.says("started");
        let operator = hosts.start(1, "operator");
        operator.says("found 101.1.33 with its services");
        vehicle.says("found 102.1.1 with its services");
        drop(vehicle);
        operator.says("lost 101.1.33");
    });
}

#[test]
fn what_comes_through_two_cables_is_delivered_once() {
    on_two_hosts(|hosts| {
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
        "batch-sender" => roles::send_batches().await,
        "batch-receiver" => roles::receive_batches().await,
        "operator" => roles::operator().await,
        other => panic!("unknown role {other}"),
    });
}
