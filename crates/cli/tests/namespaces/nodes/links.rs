//! Links on real networks: IPv6, networks without multicast, cables and addresses that appear and
//! disappear.

use super::roles::DATAGRAMS;
use jaus_test_kit::hosts::{TwoHosts, on_two_hosts};

/// A caller on host 1 gets an answer from an echo on host 0.
fn answers(hosts: &TwoHosts, settings: &str, address: &str) {
    let caller = hosts.start_with(1, "caller", settings);
    assert_eq!(
        caller.says("answered by"),
        format!("101.1.33 at {address}"),
        "{settings}"
    );
}

#[test]
fn nodes_meet_by_ipv6_multicast_with_link_local_addresses_alone() {
    on_two_hosts(|hosts| {
        for host in 0..2 {
            hosts.ip(host, &["-4", "address", "flush", "dev", "jaus0"]);
        }
        let _echo = hosts.start_with(0, "echo", "ip=6");
        let caller = hosts.start_with(1, "caller", "ip=6");
        let answer = caller.says("answered by");
        assert!(answer.starts_with("101.1.33 at [fe80::"), "{answer}");
        assert!(
            answer.ends_with("]:3794") && answer.contains('%'),
            "{answer}"
        );
    });
}

#[test]
fn a_peer_behind_ipv6_is_found_without_multicast() {
    on_two_hosts(|hosts| {
        let _echo = hosts.start_with(0, "echo", "ip=both group=off group6=off");
        let address = hosts.link_local(0, "jaus0");
        let settings = format!("ip=both group=off group6=off peer={address}");
        let caller = hosts.start_with(1, "caller", &settings);
        let answer = caller.says("answered by");
        assert!(answer.starts_with("101.1.33 at [fe80::"), "{answer}");
    });
}

#[test]
fn what_comes_by_both_versions_of_ip_is_delivered_once() {
    on_two_hosts(|hosts| {
        hosts.wait_for_addresses();
        let listener = hosts.start_with(0, "listener", "ip=both");
        listener.says("listening on 2 links");
        let _announcer = hosts.start_with(1, "announcer", "ip=both");
        for number in 0..super::roles::ANNOUNCEMENTS {
            assert_eq!(listener.says("heard").parse(), Ok(number));
        }
    });
}

#[test]
fn a_network_without_multicast_is_used_by_broadcast() {
    on_two_hosts(|hosts| {
        for host in 0..2 {
            hosts.ip(host, &["link", "set", "jaus0", "multicast", "off"]);
        }
        let echo = hosts.start(0, "echo");
        assert_eq!(echo.says("listening on"), "10.213.77.1:3794");
        // Two nodes on one host share the broadcast address.
        let _neighbour = hosts.start_with(1, "listener", "port=3795");
        answers(hosts, "", "10.213.77.1:3794");
        assert_eq!(echo.says("heard"), "102.1.1 at 10.213.77.2:3794");
    });
}

#[test]
fn broadcast_is_used_beside_multicast_on_demand() {
    on_two_hosts(|hosts| {
        let echo = hosts.start_with(0, "echo", "group=off broadcast=on");
        echo.says("listening on");
        answers(hosts, "broadcast=on", "10.213.77.1:3794");
    });
}

#[test]
fn nodes_that_know_addresses_need_neither_multicast_nor_broadcast() {
    on_two_hosts(|hosts| {
        for host in 0..2 {
            hosts.ip(host, &["link", "set", "jaus0", "multicast", "off"]);
        }
        let _echo = hosts.start_with(0, "echo", "broadcast=off peer=10.213.77.2");
        answers(hosts, "broadcast=off peer=10.213.77.1", "10.213.77.1:3794");
        // The caller's address changes; it still knows the address of its peer.
        hosts.ip(1, &["address", "flush", "dev", "jaus0"]);
        hosts.ip(1, &["address", "add", "10.213.77.9/24", "dev", "jaus0"]);
        answers(hosts, "broadcast=off peer=10.213.77.1", "10.213.77.1:3794");
    });
}

#[test]
fn a_cable_that_was_out_is_used_again() {
    on_two_hosts(|hosts| {
        let _echo = hosts.start_with(0, "echo", "ip=both");
        answers(hosts, "", "10.213.77.1:3794");

        hosts.ip(0, &["link", "set", "jaus0", "down"]);
        hosts.ip(0, &["link", "set", "jaus0", "up"]);
        answers(hosts, "", "10.213.77.1:3794");

        // A new interface with the old name and address.
        hosts.ip(0, &["link", "delete", "jaus0"]);
        hosts.connect("jaus0", "10.213.77").unwrap();
        answers(hosts, "", "10.213.77.1:3794");
        let caller = hosts.start_with(1, "caller", "ip=6");
        let answer = caller.says("answered by");
        assert!(answer.starts_with("101.1.33 at [fe80::"), "{answer}");
    });
}

#[test]
fn an_interface_is_used_as_soon_as_it_has_an_address() {
    on_two_hosts(|hosts| {
        hosts.ip(0, &["address", "flush", "dev", "jaus0"]);
        let follower = hosts.start(0, "follower");
        follower.says("links at 127.0.0.1");
        // A node that missed a notification would poll later than `says` waits.
        for round in 0..5 {
            let address = format!("10.213.77.{}", 10 + round);
            hosts.ip(
                0,
                &["address", "add", &format!("{address}/24"), "dev", "jaus0"],
            );
            while !follower.says("links at").contains(&address) {}
            hosts.ip(0, &["address", "flush", "dev", "jaus0"]);
            while follower.says("links at").contains(&address) {}
        }
    });
}

#[test]
fn a_batch_of_datagrams_that_do_not_fit_a_frame_arrives_all_the_same() {
    on_two_hosts(|hosts| {
        let receiver = hosts.start(0, "batch-receiver");
        receiver.says("listening on");
        let sender = hosts.start(1, "batch-sender");
        let sent = format!("{} with 0 errors", 4 * DATAGRAMS);
        assert_eq!(sender.says("sent"), sent);
        assert_eq!(receiver.says("arrived").parse(), Ok(DATAGRAMS));
        assert_eq!(receiver.says("arrived").parse(), Ok(3 * DATAGRAMS));
    });
}
