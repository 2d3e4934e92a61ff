//! The byte budget, in virtual time.

use std::num::NonZeroU32;

use super::*;

const RATE: u32 = 100_000;

/// A vehicle with a budget, and two operators that have dialled it.
fn vehicle_with_budget() -> Network {
    let keys = [key(), key(), key()];
    let mut network = Network::new();
    let one = peer("operator", &keys[1], "60.255.255");
    let two = peer("observer", &keys[2], "61.255.255");
    network.add(&keys[0], &trusting([one, two]), &[]);
    let vehicle = &mut network.hosts[0].transport;
    vehicle.budget = Some(Budget::new(NonZeroU32::new(RATE).unwrap()));
    for key in &keys[1..] {
        let rover = trusting([peer("rover", &keys[0], "101.255.255")]);
        network.add(key, &rover, &[address(1)]);
    }
    network.run(10 * SECOND);
    network
}

fn send(network: &mut Network, to: &str, priority: Priority, datagram: &Bytes) {
    let vehicle = &mut network.hosts[0].transport;
    let session = vehicle.sessions().find(|it| it.peer.name == to);
    vehicle.send(session.unwrap().session, priority, datagram);
}

/// UDP octets that the vehicle has sent since the record had this length.
fn sent_since(network: &Network, start: usize) -> usize {
    let sent = network.record[start..].iter();
    let sent = sent.filter(|(_, from, _)| *from == network.hosts[0].address);
    sent.map(|(_, _, octets)| octets.len()).sum()
}

#[test]
fn all_sessions_together_send_no_more_than_the_budget_and_use_it() {
    let mut network = vehicle_with_budget();
    let start = network.record.len();
    for number in 0..1000 {
        for peer in ["operator", "observer"] {
            for datagram in [fragment("101.1.33", number), judp("101.1.33", 200)] {
                send(&mut network, peer, Priority::Low, &datagram);
            }
        }
    }
    let seconds = 10;
    network.run(seconds * SECOND);
    let sent = sent_since(&network, start);
    let most = (RATE * seconds + RATE / 5) as usize;
    assert!(sent <= most, "{sent} octets");
    assert!(sent >= most * 9 / 10, "{sent} octets");
    let [one, two] = [1, 2].map(|host| network.hosts[host].received.len());
    assert!(one.abs_diff(two) <= 2, "equal shares: {one} and {two}");
}

#[test]
fn what_is_urgent_overtakes_what_waits_for_the_budget_in_any_session() {
    let mut network = vehicle_with_budget();
    for number in 0..500 {
        let fragment = fragment("101.1.33", number);
        send(&mut network, "operator", Priority::Low, &fragment);
    }
    network.run(SECOND);
    let urgent = judp("101.1.33", 20);
    for peer in ["operator", "observer"] {
        send(&mut network, peer, Priority::SafetyCritical, &urgent);
    }
    network.run(SECOND / 10);
    for host in [1, 2] {
        assert!(
            network.hosts[host].received.contains(&urgent),
            "host {host}"
        );
    }
    assert!(network.hosts[1].received.len() < 250);
}

#[test]
fn a_session_lives_while_its_budget_is_used_up() {
    let mut network = vehicle_with_budget();
    let before = sessions(&network, 0);
    for round in 0..60 {
        for number in 0..200 {
            let fragment = fragment("101.1.33", round * 200 + number);
            send(&mut network, "operator", Priority::Standard, &fragment);
        }
        network.run(SECOND);
    }
    assert_eq!(sessions(&network, 0), before);
    assert!(network.hosts.iter().all(|it| it.closed.is_empty()));
}
