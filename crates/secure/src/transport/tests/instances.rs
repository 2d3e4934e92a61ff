//! Several programs with one key, in virtual time.

use super::super::instances::MOST_INSTANCES;
use super::*;

/// A vehicle, and this many programs of one operator's host that have dialled it.
fn vehicle_and_programs(programs: usize) -> (Network, TrustFile, Key) {
    let (mut network, [_, rover], [_, operator]) = vehicle_and_operator();
    for _ in 1..programs {
        network.add(&operator, &rover, &[address(1)]);
    }
    network.run(SECOND);
    (network, rover, operator)
}

/// Kills a program: without a farewell, and nothing is left at its address.
fn kill(network: &mut Network, host: usize) {
    network.hosts[host].address = address(200 + u8::try_from(host).unwrap());
    network.hosts[host].transport = Transport::new(&key(), trusting([]), []);
}

fn received(network: &mut Network, host: usize) -> Vec<Bytes> {
    std::mem::take(&mut network.hosts[host].received)
}

#[test]
fn programs_with_one_key_live_side_by_side() {
    let (mut network, ..) = vehicle_and_programs(3);
    let at_vehicle = sessions(&network, 0);
    assert_eq!(at_vehicle.len(), 3);
    for round in 0..60 {
        let sent: Vec<_> = (1..4).map(|it| judp(&format!("60.{it}.1"), 20)).collect();
        for (host, datagram) in (1..4).zip(&sent) {
            network.send(host, Priority::Standard, datagram);
        }
        network.run(SECOND);
        assert_eq!(received(&mut network, 0), sent, "round {round}");
    }
    assert_eq!(sessions(&network, 0), at_vehicle);
    assert_eq!(network.count(0, Counter::SessionsEstablished), 3);
    // What is for one of them goes to it alone.
    let report = judp("101.1.33", 20);
    network.hosts[0]
        .transport
        .send(at_vehicle[1], Priority::Standard, &report);
    network.run(SECOND);
    let each = [1, 2, 3].map(|host| network.hosts[host].received.len());
    assert_eq!(each, [0, 1, 0]);
}

#[test]
fn an_id_remains_with_the_living_program_that_uses_it() {
    let (mut network, ..) = vehicle_and_programs(2);
    let (own, of_other) = (judp("60.1.1", 20), judp("60.1.1", 30));
    network.send(1, Priority::Standard, &own);
    network.run(SECOND);
    let before = sessions(&network, 0);
    for _ in 0..60 {
        network.send(2, Priority::Standard, &of_other);
        network.send(2, Priority::Standard, &judp("60.2.1", 40));
        network.run(SECOND / 2);
        network.send(1, Priority::Standard, &own);
        network.run(SECOND / 2);
    }
    let received = received(&mut network, 0);
    assert_eq!(received.iter().filter(|it| **it == own).count(), 61);
    assert_eq!(received.iter().filter(|it| **it == of_other).count(), 0);
    assert_eq!(received.len(), 121, "its other id is free");
    assert_eq!(network.count(0, Counter::DisputedIds), 60);
    assert!(network.count(2, Counter::NoticesReceived) > 0);
    assert_eq!(sessions(&network, 0), before, "nobody is thrown out");
}

#[test]
fn a_stop_passes_from_an_id_that_another_program_uses() {
    let (mut network, ..) = vehicle_and_programs(2);
    let report = judp("101.1.33", 20);
    let from_operator = |message| raw("60.1.1", "101.1.1", message);
    let [stop, standby] = [&b"\x06\0\x01\0"[..], b"\x03\0"].map(from_operator);
    let [release, resume] = [b"\x0E\0", b"\x04\0"].map(|it| from_operator(it));
    let hold = judp("60.1.1", 20);
    network.send(1, Priority::Standard, &hold);
    network.run(SECOND);
    for datagram in [&stop, &standby, &release, &resume, &report] {
        network.send(2, Priority::Standard, datagram);
        network.run(SECOND);
    }
    network.send(1, Priority::Standard, &hold);
    network.run(SECOND);
    let expected = [hold.clone(), stop, standby, hold];
    assert_eq!(received(&mut network, 0), expected);
    let counts = [Counter::DisputedIds, Counter::ForeignIds];
    assert_eq!(counts.map(|it| network.count(0, it)), [2, 1]);
    let transport = &mut network.hosts[0].transport;
    let mut acts = std::iter::from_fn(|| transport.poll_record()).map(|(it, _)| it.act);
    let is_stop = |act| matches!(act, Act::Decided(it) if it.what == "SetEmergency");
    assert!(acts.any(is_stop));
}

#[test]
fn a_program_that_was_killed_and_started_again_has_its_id_within_two_seconds() {
    let (mut network, rover, operator) = vehicle_and_programs(2);
    let old = judp("60.1.1", 20);
    network.send(1, Priority::Standard, &old);
    network.run(SECOND);
    kill(&mut network, 1);
    let again = network.add(&operator, &rover, &[address(1)]);
    network.run(SECOND / 2);
    let new = judp("60.1.1", 30);
    for _ in 0..15 {
        network.send(again, Priority::Standard, &new);
        network.run(SECOND / 10);
    }
    let received = received(&mut network, 0);
    assert!(received.contains(&new), "{}", received.len());
    assert_eq!(network.hosts[0].closed.len(), 1);
    // The other program, which uses another id, has noticed nothing.
    assert!(network.hosts[2].closed.is_empty());
}

/// A vehicle and two programs, the first of which has used an id; it is far away now, and both sides
/// have measured that.
fn vehicle_and_far_program(delay: Duration, seed: u64) -> Network {
    let (mut network, ..) = vehicle_and_programs(2);
    network.far = Some(Far {
        address: address(2),
        delay,
        loss: 0,
        seed: seed << 32,
    });
    for _ in 0..20 {
        network.send(1, Priority::Standard, &judp("60.1.1", 20));
        network.run(SECOND);
    }
    if let Some(far) = &mut network.far {
        far.loss = 30;
    }
    network
}

/// The links on which a program must keep its id: delays each way.
const FAR: [Duration; 3] = [
    DELAY,
    Duration::from_millis(150),
    Duration::from_millis(750),
];

#[test]
fn a_living_program_keeps_its_session_though_three_of_ten_packets_are_lost() {
    for (delay, seed) in FAR
        .into_iter()
        .flat_map(|it| [1, 2, 3, 4].map(|seed| (it, seed)))
    {
        let mut network = vehicle_and_far_program(delay, seed);
        let before = sessions(&network, 0);
        for round in 0..60 {
            if round % 20 == 0 {
                network.send(1, Priority::Standard, &judp("60.1.1", 20));
            }
            network.send(2, Priority::Standard, &judp("60.1.1", 30));
            network.run(SECOND / 2);
        }
        let disputed = network.count(0, Counter::DisputedIds);
        assert_eq!(sessions(&network, 0), before, "{delay:?}, seed {seed}");
        assert!(disputed > 50, "{delay:?}, seed {seed}: {disputed}");
    }
}

#[test]
fn a_killed_program_loses_its_id_within_four_round_trips_or_a_second() {
    for (delay, seed) in FAR.into_iter().flat_map(|it| [1, 2].map(|seed| (it, seed))) {
        let mut network = vehicle_and_far_program(delay, seed);
        let reports = network.hosts[0].transport.sessions();
        let round_trip = reports.map(|it| it.round_trip).max().unwrap();
        kill(&mut network, 1);
        network.run(delay);
        let began = network.now;
        let new = judp("60.1.1", 30);
        while !network.hosts[0].received.contains(&new) {
            network.send(2, Priority::Standard, &new);
            network.run(SECOND / 20);
        }
        let taken = network.now - began;
        let limit = SECOND.max(4 * round_trip) + SECOND / 5;
        assert!(taken <= limit, "{delay:?}: {taken:?} of {limit:?}");
    }
}

#[test]
fn forged_packets_do_not_keep_the_id_of_a_killed_program() {
    let (mut network, ..) = vehicle_and_programs(2);
    network.send(1, Priority::Standard, &judp("60.1.1", 20));
    network.run(SECOND);
    let mut sent = network.record.iter().rev();
    let genuine = sent.find(|(to, from, _)| (*to, *from) == (address(1), address(2)));
    let (to, from, genuine) = genuine.unwrap().clone();
    let mut forged = genuine.to_vec();
    *forged.last_mut().unwrap() ^= 1;
    kill(&mut network, 1);
    let new = judp("60.1.1", 30);
    for _ in 0..20 {
        network.deliver(to, from, &genuine);
        network.deliver(to, from, &forged);
        network.send(2, Priority::Standard, &new);
        network.run(SECOND / 10);
    }
    assert!(network.hosts[0].received.contains(&new));
}

#[test]
fn an_id_that_is_no_longer_used_is_free() {
    let (mut network, ..) = vehicle_and_programs(2);
    network.send(1, Priority::Standard, &judp("60.1.1", 20));
    network.run(60 * SECOND);
    let datagram = judp("60.1.1", 30);
    network.send(2, Priority::Standard, &datagram);
    network.run(SECOND);
    assert!(network.hosts[0].received.contains(&datagram));
    assert_eq!(sessions(&network, 0).len(), 2);
}

#[test]
fn a_key_has_a_bounded_number_of_programs_and_a_silent_one_gives_way() {
    let (mut network, rover, operator) = vehicle_and_programs(MOST_INSTANCES);
    let before = sessions(&network, 0);
    assert_eq!(before.len(), MOST_INSTANCES);
    let late = network.add(&operator, &rover, &[address(1)]);
    network.run(60 * SECOND);
    assert!(network.session(late).is_none());
    assert_eq!(sessions(&network, 0), before, "nobody is thrown out");
    let refused = network.count(0, Counter::TooManyInstances);
    assert!((1..20).contains(&refused), "{refused}: with growing pauses");

    kill(&mut network, 5);
    network.run(10 * SECOND);
    assert!(network.session(late).is_some());
    assert_eq!(sessions(&network, 0).len(), MOST_INSTANCES);
}

#[test]
fn a_thief_of_a_key_who_runs_many_programs_does_not_keep_its_owner_out() {
    let (mut network, rover, operator) = vehicle_and_programs(1);
    kill(&mut network, 1);
    network.run(10 * SECOND);
    for program in 0..MOST_INSTANCES as u16 {
        let thief = network.add(&operator, &rover, &[address(1)]);
        network.hosts[thief].address = SocketAddr::new(address(99).ip(), 4000 + program);
    }
    network.run(5 * SECOND);
    assert_eq!(sessions(&network, 0).len(), MOST_INSTANCES);
    let owner = network.add(&operator, &rover, &[address(1)]);
    network.run(5 * SECOND);
    assert!(network.session(owner).is_some());
    network.run(60 * SECOND);
    assert!(network.session(owner).is_some());
    assert_eq!(sessions(&network, 0).len(), MOST_INSTANCES);
}

#[test]
fn a_thief_at_many_addresses_does_not_end_the_oldest_session_of_the_owner() {
    let (mut network, rover, operator) = vehicle_and_programs(1);
    let station = network.session(1).unwrap().session;
    let second = network.add(&operator, &rover, &[address(1)]);
    let at_station = network.hosts[1].address;
    network.hosts[second].address = SocketAddr::new(at_station.ip(), 4000);
    network.run(5 * SECOND);
    for _ in 2..MOST_INSTANCES + 2 {
        network.add(&operator, &rover, &[address(1)]);
    }
    network.run(60 * SECOND);
    assert_eq!(network.session(1).unwrap().session, station);
    assert_eq!(sessions(&network, 0).len(), MOST_INSTANCES);
}

#[test]
fn a_hello_is_no_key_to_the_session_of_another_program() {
    let (mut network, rover, operator) = vehicle_and_programs(1);
    let before = sessions(&network, 0);
    // With the same key, but without the number, which only the peers of the program have been told.
    for _ in 0..3 {
        network.add(&operator, &rover, &[address(1)]);
        network.run(5 * SECOND);
    }
    assert_eq!(sessions(&network, 0)[..1], before);
    assert!(network.hosts[1].closed.is_empty());
}
