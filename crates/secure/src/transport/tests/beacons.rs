//! Dials by beacon.

use super::super::dial::PATIENCE;
use super::*;
use crate::beacon::{Announcer, LIFETIME, Neighbors, Sighting};

/// A vehicle and an operator without addresses of each other; the operator's key is the smaller one.
struct Strangers {
    network: Network,
    keys: [Key; 2],
}

const VEHICLE: usize = 0;
const OPERATOR: usize = 1;

impl Strangers {
    fn new() -> Self {
        let mut keys = [key(), key()];
        keys.sort_by_key(|key| std::cmp::Reverse(key.public()));
        let mut network = Network::new();
        for (key, trust) in keys.iter().zip(mutual(&keys)) {
            network.add(key, &trust, &[]);
        }
        Self { network, keys }
    }

    fn run(&mut self, time: Duration) {
        self.network.run(time);
    }

    fn session(&self, host: usize) -> Option<SessionReport> {
        self.network.session(host)
    }

    fn host(&mut self, host: usize) -> &mut Host {
        &mut self.network.hosts[host]
    }

    fn established(&self) -> [u64; 2] {
        [VEHICLE, OPERATOR].map(|it| self.network.count(it, Counter::SessionsEstablished))
    }

    /// A beacon of `seen` reaches the other host.
    fn sees(&mut self, host: usize, seen: usize, address: SocketAddr) {
        let key = self.keys[seen].public();
        let transport = &mut self.network.hosts[host].transport;
        transport.handle_sighting(self.network.now, Sighting { key, address });
    }

    /// Handshakes that the host has begun.
    fn attempts(&self, host: usize) -> usize {
        let sent = self.network.record.iter();
        sent.filter(|(_, from, octets)| {
            *from == self.network.hosts[host].address && octets.first() >= Some(&0xC0)
        })
        .count()
    }
}

#[test]
fn nodes_without_addresses_of_each_other_meet_by_beacons() {
    let mut strangers = Strangers::new();
    strangers.sees(VEHICLE, OPERATOR, address(2));
    strangers.sees(OPERATOR, VEHICLE, address(1));
    strangers.run(SECOND);
    let [vehicle, operator] = [VEHICLE, OPERATOR].map(|it| strangers.session(it).unwrap());
    assert!(operator.dialed, "the one with the smaller key");
    assert!(!vehicle.dialed);
    assert_eq!(strangers.established(), [1, 1]);
    strangers.run(4 * PATIENCE);
    assert_eq!(strangers.established(), [1, 1]);
}

#[test]
fn the_greater_key_dials_if_its_own_beacons_do_not_arrive() {
    let mut strangers = Strangers::new();
    strangers.sees(VEHICLE, OPERATOR, address(2));
    strangers.run(PATIENCE - SECOND);
    assert_eq!(strangers.attempts(VEHICLE), 0);
    strangers.run(2 * SECOND);
    assert!(strangers.session(VEHICLE).unwrap().dialed);
}

#[test]
fn a_lost_session_is_dialled_again_while_beacons_come_and_no_longer() {
    let mut strangers = Strangers::new();
    strangers.sees(OPERATOR, VEHICLE, address(1));
    strangers.run(SECOND);
    strangers.host(VEHICLE).address = address(99);
    strangers.run(10 * SECOND);
    assert!(strangers.session(OPERATOR).is_none());
    // The same node at its new address.
    strangers.sees(OPERATOR, VEHICLE, address(99));
    strangers.run(10 * SECOND);
    assert_eq!(strangers.session(OPERATOR).unwrap().address, address(99));

    strangers.host(VEHICLE).address = address(98);
    strangers.run(LIFETIME + 10 * SECOND);
    let attempts = strangers.attempts(OPERATOR);
    strangers.run(100 * LIFETIME);
    assert_eq!(
        strangers.attempts(OPERATOR),
        attempts,
        "no attempt after the lifetime"
    );
}

#[test]
fn many_beacons_of_one_key_cause_one_attempt_at_a_time() {
    let mut strangers = Strangers::new();
    for host in 100..=200 {
        strangers.sees(OPERATOR, VEHICLE, address(host));
    }
    assert_eq!(strangers.host(OPERATOR).transport.sessions.len(), 1);
    assert_eq!(strangers.host(OPERATOR).transport.dials.len(), 1);
    // The last one is where the vehicle is.
    strangers.sees(OPERATOR, VEHICLE, address(1));
    strangers.run(20 * SECOND);
    assert!(strangers.session(OPERATOR).is_some());
}

#[test]
fn a_peer_that_is_out_of_sight_leaves_its_place_to_another() {
    let mut strangers = Strangers::new();
    for number in 0..20 {
        let (now, key) = (strangers.network.now, key().public());
        let address = address(50 + number);
        let operator = &mut strangers.host(OPERATOR).transport;
        operator.handle_sighting(now, Sighting { key, address });
        strangers.run(2 * LIFETIME);
    }
    let dials = strangers.host(OPERATOR).transport.dials.len();
    assert_eq!(dials, 1);
}

#[test]
fn a_replayed_beacon_does_not_affect_a_session() {
    let mut strangers = Strangers::new();
    let mut announcer = Announcer::new(&strangers.keys[VEHICLE], JausId::new(101, 1, 0), 3795);
    let old = address(50);
    let start = strangers.network.now;
    let beacons = announcer.announce(start, SECOND, [old.ip()]);
    let beacon = beacons[0].clone().unwrap();
    let trust = trusting([peer("rover", &strangers.keys[VEHICLE], "101.255.255")]);
    let mut neighbors = Neighbors::new(strangers.keys[OPERATOR].public(), trust);
    // The vehicle is elsewhere, with a session.
    strangers.sees(OPERATOR, VEHICLE, address(1));
    strangers.run(SECOND);
    let before = strangers.session(OPERATOR).unwrap();
    for _ in 0..100 {
        let now = strangers.network.now;
        if let Some(Sighting { address, .. }) = neighbors.handle(now, old, &beacon) {
            strangers.sees(OPERATOR, VEHICLE, address);
        }
        strangers.run(SECOND);
    }
    let after = strangers.session(OPERATOR).unwrap();
    assert_eq!(after.session, before.session, "the session is not affected");
    assert!(!strangers.network.record.iter().any(|(to, ..)| *to == old));
}
