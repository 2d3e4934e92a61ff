//! Floods of first packets: forged ones, and those of real addresses.

use std::net::{Ipv6Addr, SocketAddrV6};
use std::num::NonZeroU32;

use super::super::admission::{
    FIRST_PACKETS, MOST_HANDSHAKES, MOST_HANDSHAKES_PER_ADDRESS, RETRY_FROM,
};
use super::*;

/// Addresses of hosts that are not in the network.
const STRANGER: u8 = 66;
const VEHICLE: usize = 0;
const MILLISECOND: Duration = Duration::from_millis(1);

/// The first packets of so many handshakes of a stranger with the vehicle.
fn first_packets(count: usize) -> Vec<Bytes> {
    let (now, key) = (Instant::now(), key());
    let first = |_| {
        let mut stranger = Transport::new(&key, TrustFile::default(), [address(1)]);
        stranger.handle_timeout(now);
        stranger.poll_transmit(now, 1).unwrap().octets
    };
    (0..count).map(first).collect()
}

/// First packets with a forged source.
struct Flood {
    packets: Vec<Bytes>,
    from: SocketAddr,
    sent: usize,
}

impl Flood {
    fn from(from: SocketAddr) -> Self {
        Self {
            packets: first_packets(100),
            from,
            sent: 0,
        }
    }

    fn next(&mut self) -> &Bytes {
        self.sent += 1;
        &self.packets[self.sent % self.packets.len()]
    }
}

impl Network {
    /// Lets this much time pass, while so many packets of the flood reach the vehicle in each
    /// millisecond.
    fn run_under(&mut self, flood: &mut Flood, each_millisecond: usize, time: Duration) {
        for _ in 0..time.as_millis() {
            for _ in 0..each_millisecond {
                self.deliver(address(1), flood.from, flood.next());
            }
            self.run(MILLISECOND);
        }
    }

    /// Octets that the vehicle has sent to an address since the record had this length.
    fn octets_to(&self, to: SocketAddr, start: usize) -> usize {
        let record = self.record[start..].iter();
        let sent = record.filter(|it| it.0 == to && it.1 == address(1));
        sent.map(|(_, _, octets)| octets.len()).sum()
    }
}

/// A vehicle that trusts an operator, which has not dialled yet. The second key is the operator's.
fn vehicle_alone() -> (Network, [Key; 2]) {
    let keys = [key(), key()];
    let mut network = Network::new();
    network.add(&keys[0], &mutual(&keys)[0], &[]);
    (network, keys)
}

fn rover(keys: &[Key; 2]) -> TrustFile {
    mutual(keys)[1].clone()
}

#[test]
fn twenty_thousand_forged_first_packets_a_second_from_an_operators_address_keep_no_link_out() {
    let (mut network, keys) = vehicle_alone();
    let mut flood = Flood::from(address(2));
    network.run_under(&mut flood, 20, 200 * MILLISECOND);
    network.add(&keys[1], &rover(&keys), &[address(1)]);
    // A first packet, its answer, the same with the token, the rest of the handshake, the greeting.
    network.run_under(&mut flood, 20, 6 * DELAY + 5 * MILLISECOND);
    assert_eq!(network.session(VEHICLE).unwrap().peer.name, "operator");
    assert!(network.session(1).is_some());
    assert!(network.count(VEHICLE, Counter::Retries) > 4000);
    assert_eq!(network.count(VEHICLE, Counter::FirstPacketsDropped), 0);
}

#[test]
fn a_key_in_a_token_signs_for_proven_addresses_only() {
    let keys = [key().slow(), key()];
    let network = connected(&pinned(&keys, &mutual(&keys)));
    assert!(network.session(VEHICLE).is_some());
    assert!(network.count(VEHICLE, Counter::Retries) > 0);
}

#[test]
fn an_operator_with_a_link_local_address_gets_through_a_flood() {
    let (mut network, keys) = vehicle_alone();
    network.add(&keys[1], &rover(&keys), &[address(1)]);
    let ip = Ipv6Addr::from_bits(0xFE80 << 112 | 7);
    network.hosts[1].address = SocketAddrV6::new(ip, 3795, 0, 3).into();
    let mut flood = Flood::from(network.hosts[1].address);
    network.run_under(&mut flood, 20, 100 * MILLISECOND);
    let seen = network.session(VEHICLE).unwrap();
    assert_eq!(seen.address, network.hosts[1].address);
}

#[test]
fn a_session_carries_messages_through_a_flood_from_the_address_of_its_peer() {
    let (mut network, ..) = vehicle_and_operator();
    let before = network.session(VEHICLE).unwrap().session;
    let mut flood = Flood::from(address(2));
    let (command, report) = (judp("60.1.1", 900), judp("101.1.33", 20));
    for round in 1..=10 {
        network.send(1, Priority::High, &command);
        network.send(VEHICLE, Priority::High, &report);
        network.run_under(&mut flood, 20, DELAY + MILLISECOND);
        let received = [0, 1].map(|host| network.hosts[host].received.len());
        assert_eq!(received, [round, round], "within a one-way delay");
    }
    assert_eq!(network.session(VEHICLE).unwrap().session, before);
}

#[test]
fn a_session_survives_a_flood_beyond_the_limit_which_is_dropped_unread() {
    let (mut network, ..) = vehicle_and_operator();
    let before = network.session(VEHICLE).unwrap().session;
    let mut flood = Flood::from(address(2));
    for _ in 0..8 {
        for _ in 0..20_000 {
            network.deliver(address(1), flood.from, flood.next());
        }
        network.run(SECOND);
    }
    let counters = [Counter::FirstPacketsDropped, Counter::Retries];
    let [dropped, answered] = counters.map(|counter| network.count(VEHICLE, counter));
    let most = u64::from(FIRST_PACKETS.burst);
    assert!(dropped >= 8 * (20_000 - most), "{dropped}");
    assert!(answered <= 8 * most, "{answered}");
    let command = judp("60.1.1", 20);
    network.send(1, Priority::Standard, &command);
    network.run(2 * DELAY);
    assert_eq!(network.hosts[VEHICLE].received, [command]);
    assert_eq!(network.session(VEHICLE).unwrap().session, before);
}

#[test]
fn no_answer_to_a_forged_packet_is_larger_than_the_packet() {
    let (mut network, _) = vehicle_alone();
    let victim = address(STRANGER);
    let first = first_packets(1).remove(0).to_vec();
    let with_version = |version: u32| {
        let mut packet = first.clone();
        packet[1..5].copy_from_slice(&version.to_be_bytes());
        packet
    };
    // The token begins behind both ids; its first octet is its length.
    let token = 7 + usize::from(first[5]) + usize::from(first[6 + usize::from(first[5])]);
    let mut with_token = first.clone();
    with_token[token] = 40;
    let mut flood = Flood::from(victim);
    let others = [0x0A0A_0A0A, 7].map(with_version);
    let packets = [first.clone(), with_token].into_iter().chain(others);
    // Until nothing is accepted without a token.
    network.run_under(&mut flood, 20, 100 * MILLISECOND);
    for packet in packets {
        for number in 0..1000_u32 {
            let start = network.record.len();
            let mut packet = packet.clone();
            packet[6..10].copy_from_slice(&number.to_le_bytes());
            network.deliver(address(1), victim, &packet);
            network.collect();
            let answer = network.octets_to(victim, start);
            assert!(answer <= packet.len() / 4, "{answer} octets");
        }
    }
}

#[test]
fn first_packets_of_one_forged_address_cause_four_handshakes_and_less_traffic_than_they_are() {
    let (mut network, keys) = vehicle_alone();
    let victim = address(STRANGER);
    let mut received = 0;
    // Each opens a handshake that it never finishes.
    for packet in first_packets(500) {
        received += packet.len();
        network.deliver(address(1), victim, &packet);
    }
    let open = network.hosts[VEHICLE].transport.sessions.len();
    assert!(open <= RETRY_FROM, "{open}");
    network.add(&keys[1], &rover(&keys), &[address(1)]);
    network.run(SECOND);
    assert_eq!(network.session(VEHICLE).unwrap().peer.name, "operator");
    network.run(2 * IDLE);
    let sent = network.octets_to(victim, 0);
    assert!(sent < received / 4, "{sent} of {received} octets");
}

/// Begins a handshake from a real address, which proves itself and then falls silent.
fn begin_handshake(network: &mut Network, from: SocketAddr, trust: &TrustFile) {
    let now = network.now;
    let mut stranger = Transport::new(&key(), trust.clone(), [address(1)]);
    stranger.handle_timeout(now);
    for _ in 0..2 {
        let Some(packet) = stranger.poll_transmit(now, 1) else {
            // Accepted without a token.
            return;
        };
        network.deliver(address(1), from, &packet.octets);
        let vehicle = &mut network.hosts[VEHICLE].transport;
        while let Some(answer) = vehicle.poll_transmit(now, 1) {
            if answer.to == from && answer.octets.len() < 200 {
                stranger.handle_datagram(now, address(1), &answer.octets);
            }
        }
    }
}

#[test]
fn real_addresses_that_hold_every_place_give_way_to_a_newcomer() {
    let (mut network, keys) = vehicle_alone();
    let rover = rover(&keys);
    for round in 0..8 {
        for host in 100..120 {
            begin_handshake(&mut network, address(host), &rover);
        }
        network.run(10 * MILLISECOND);
        let held = network.hosts[VEHICLE].transport.sessions.len();
        assert!(held <= MOST_HANDSHAKES, "{held}");
        let is_full = held == MOST_HANDSHAKES;
        assert_eq!(is_full, round >= 3, "{held} in round {round}");
    }
    network.add(&keys[1], &rover, &[address(1)]);
    for _ in 0..10 {
        network.run(10 * MILLISECOND);
        (100..120).for_each(|host| begin_handshake(&mut network, address(host), &rover));
    }
    assert_eq!(network.session(VEHICLE).unwrap().peer.name, "operator");
    assert!(network.count(VEHICLE, Counter::HandshakesDisplaced) > 100);
}

#[test]
fn of_the_handshakes_from_one_real_address_the_oldest_gives_way() {
    let (mut network, keys) = vehicle_alone();
    let (rover, from) = (rover(&keys), address(STRANGER));
    let hold = |network: &mut Network| begin_handshake(network, from, &rover);
    for _ in 0..MOST_HANDSHAKES_PER_ADDRESS {
        hold(&mut network);
    }
    let ids = |network: &Network| -> Vec<SessionId> {
        let sessions = &network.hosts[VEHICLE].transport.sessions;
        sessions.keys().copied().collect()
    };
    let before = ids(&network);
    assert_eq!(before.len(), MOST_HANDSHAKES_PER_ADDRESS);
    hold(&mut network);
    let after = ids(&network);
    assert_eq!(after[..before.len() - 1], before[1..]);
    assert_eq!(network.count(VEHICLE, Counter::HandshakesDisplaced), 1);
    // More than an address may begin.
    (0..200).for_each(|_| hold(&mut network));
    assert!(network.count(VEHICLE, Counter::HandshakesDropped) > 90);
}

#[test]
fn a_peer_that_had_a_session_needs_no_further_round_trip_during_a_flood() {
    let (mut network, ..) = vehicle_and_operator();
    let mut flood = Flood::from(address(STRANGER));
    network.run_under(&mut flood, 20, 100 * MILLISECOND);
    let (start, now) = (network.record.len(), network.now);
    let before = network.session(1).unwrap().session;
    network.hosts[1]
        .transport
        .end(now, before, code::SHUTDOWN, "a test");
    network.run_under(&mut flood, 20, 350 * MILLISECOND);
    assert_ne!(network.session(1).unwrap().session, before);
    let is_retry = |octets: &Bytes| octets[0] & 0xB0 == 0xB0;
    let mut retries = network.record[start..].iter();
    assert!(!retries.any(|(to, _, octets)| *to == address(2) && is_retry(octets)));
}

#[test]
fn a_token_is_valid_after_a_restart_of_the_vehicle() {
    let (mut network, trust, keys) = vehicle_and_operator();
    network.hosts[VEHICLE].transport = Transport::new(&keys[0], trust[0].clone(), []);
    let mut flood = Flood::from(address(STRANGER));
    network.run_under(&mut flood, 5, 2 * SECOND);
    assert!(network.session(VEHICLE).is_some());
    let mut retries = network.record.iter().filter(|(to, ..)| *to == address(2));
    assert!(!retries.any(|(_, _, octets)| octets[0] & 0xB0 == 0xB0));
}

#[test]
fn answers_to_a_flood_leave_the_sessions_their_byte_budget() {
    const RATE: u32 = 100_000;
    let (mut network, ..) = vehicle_and_operator();
    let vehicle = &mut network.hosts[VEHICLE].transport;
    vehicle.budget = Some(Budget::new(NonZeroU32::new(RATE).unwrap()));
    let start = network.record.len();
    for number in 0..500 {
        network.send(VEHICLE, Priority::Low, &fragment("101.1.33", number));
    }
    let mut flood = Flood::from(address(STRANGER));
    network.run_under(&mut flood, 5, 2 * SECOND);
    let sent = network.octets_to(address(2), start);
    assert!(sent >= 2 * RATE as usize * 3 / 4, "{sent} octets");
    let answers = network.octets_to(address(STRANGER), start);
    assert!(answers <= 2 * RATE as usize / 3, "{answers} octets");
}
