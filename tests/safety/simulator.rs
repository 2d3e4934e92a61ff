//! Faults of the simulated network's hosts: cuts in one direction, suspension, wall clock steps.

use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Config, Endpoint, Outgoing};

use crate::sim::{Conditions, Host, Mailbox, Network, Socket};

const IDS: [JausId; 2] = [JausId::new(1, 1, 1), JausId::new(2, 1, 1)];
const MOMENT: Duration = Duration::from_millis(50);

fn endpoint(id: JausId) -> Endpoint {
    let mut endpoint = Endpoint::new(Config::default());
    endpoint.attach(id).expect("a component");
    endpoint
}

/// Two nodes that know each other's addresses.
fn pair(conditions: Conditions) -> (Network, [Host; 2]) {
    let mut network = Network::new(1, conditions);
    let hosts = IDS.map(|id| network.join(endpoint(id), Mailbox::default()));
    for from in [0, 1] {
        say(&mut network, hosts, from, 1);
    }
    network.run_for(MOMENT);
    assert_eq!([0, 1].map(|it| received(&mut network, hosts[it])), [1, 1]);
    (network, hosts)
}

/// Sends this number of messages from one node to the other.
fn say(network: &mut Network, hosts: [Host; 2], from: usize, count: u8) {
    for number in 0..count {
        let payload = Bytes::copy_from_slice(&[2, 0x44, number]);
        let message = Outgoing::new(IDS[from], IDS[1 - from], payload);
        network.send(hosts[from], message).expect("room");
    }
}

/// Number of messages received since the last call.
fn received(network: &mut Network, host: Host) -> usize {
    network.owner(host).take_messages().len()
}

#[test]
fn a_cut_in_one_direction_lets_the_other_through() {
    let (mut network, hosts) = pair(Conditions::good());
    network.set_cut_one_way(hosts[0], hosts[1], true);
    for from in [0, 1] {
        say(&mut network, hosts, from, 1);
    }
    network.run_for(MOMENT);
    assert_eq!([0, 1].map(|it| received(&mut network, hosts[it])), [1, 0]);
    network.set_cut_one_way(hosts[0], hosts[1], false);
    say(&mut network, hosts, 0, 1);
    network.run_for(MOMENT);
    assert_eq!(received(&mut network, hosts[1]), 1);
}

#[test]
fn a_suspended_host_does_nothing_and_then_reads_what_was_queued() {
    let (mut network, hosts) = pair(Conditions::good());
    network.suspend(hosts[1]);
    say(&mut network, hosts, 0, 3);
    network.run_for(Duration::from_secs(1));
    assert_eq!(received(&mut network, hosts[1]), 0);
    network.resume(hosts[1]);
    assert_eq!(received(&mut network, hosts[1]), 3, "at once");
    say(&mut network, hosts, 1, 1);
    network.run_for(MOMENT);
    assert_eq!(received(&mut network, hosts[0]), 1, "it sends again");
}

#[test]
fn a_suspended_host_sends_nothing_though_its_timers_are_due() {
    let (mut network, hosts) = pair(Conditions::good());
    // Its acknowledgement is missing, so the sender must retransmit it.
    network.set_cut(hosts[0], hosts[1], true);
    let message = Outgoing {
        acknowledge: true,
        ..Outgoing::new(IDS[0], IDS[1], Bytes::from_static(&[2, 0x44]))
    };
    network.send(hosts[0], message).expect("room");
    network.suspend(hosts[0]);
    let carried = network.carried();
    network.run_for(Duration::from_secs(2));
    assert_eq!(network.carried(), carried);
    network.resume(hosts[0]);
    network.run_for(Duration::from_secs(2));
    assert!(network.carried() > carried);
}

#[test]
fn the_socket_of_a_suspended_host_has_a_bound() {
    let socket = Socket {
        speed: 1_000_000,
        buffer: 100,
    };
    let (mut network, hosts) = pair(Conditions {
        socket: Some(socket),
        ..Conditions::good()
    });
    network.suspend(hosts[1]);
    for _ in 0..20 {
        say(&mut network, hosts, 0, 1);
        network.run_for(MOMENT);
    }
    network.resume(hosts[1]);
    let kept = received(&mut network, hosts[1]);
    assert!((1..20).contains(&kept), "{kept} messages");
    assert_eq!(network.overflowed(), 20 - kept as u64);
}

#[test]
fn a_killed_host_loses_what_was_queued() {
    let (mut network, hosts) = pair(Conditions::good());
    network.suspend(hosts[1]);
    say(&mut network, hosts, 0, 1);
    network.run_for(MOMENT);
    network.kill(hosts[1]);
    network.resume(hosts[1]);
    assert_eq!(received(&mut network, hosts[1]), 0);
    network.restart(hosts[1], endpoint(IDS[1]), Mailbox::default());
    network.run_for(MOMENT);
    assert_eq!(received(&mut network, hosts[1]), 0);
}

#[test]
fn a_step_moves_the_wall_clock_of_one_host_and_nothing_else() {
    let (mut network, hosts) = pair(Conditions::good());
    let clocks = hosts.map(|host| network.clock(host));
    let begin = clocks.each_ref().map(|clock| clock.since_1970());
    assert_eq!(begin[0], begin[1]);
    network.step_clock(hosts[0], 3_600_000_000_000);
    network.step_clock(hosts[1], -3_600_000_000_000);
    let start = network.now();
    network.run_for(Duration::from_secs(10));
    assert_eq!(network.now() - start, Duration::from_secs(10));
    let hour = Duration::from_secs(3600);
    let seconds = Duration::from_secs(10);
    assert_eq!(clocks[0].since_1970(), begin[0] + seconds + hour);
    assert_eq!(clocks[1].since_1970(), begin[1] + seconds - hour);
}

#[test]
fn a_wall_clock_is_handed_to_the_owner_and_survives_a_restart() {
    let mut network: Network = Network::new(1, Conditions::good());
    let mut handed = None;
    let host = network.join_with(endpoint(IDS[0]), |clock| {
        handed = Some(clock);
        Mailbox::default()
    });
    let handed = handed.expect("a clock");
    network.step_clock(host, 1_000_000_000);
    network.restart(host, endpoint(IDS[0]), Mailbox::default());
    assert_eq!(network.clock(host).since_1970(), handed.since_1970());
}
