//! Nodes in a simulated network, in virtual time.
#![expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]

mod beacons;
mod budget;
mod floods;
mod instances;
#[cfg(all(feature = "aws-lc", feature = "ring"))]
mod libraries;

use std::collections::BTreeMap;

use jaus::address::JausId;
use jaus::wire::{DataControl, Flags, Frame, Priority, judp};

use super::parameters::{IDLE, KEEP_ALIVE};
use super::*;
use crate::trust::{Peer, Trust};
use jaus::rights::Rules;

mod certificates;

/// The one-way delay of the network.
const DELAY: Duration = Duration::from_millis(5);

struct Host {
    address: SocketAddr,
    transport: Transport,
    received: Vec<Bytes>,
    closed: Vec<SessionId>,
    /// The ids for which the peers may speak, as the node was told last.
    spoken: Vec<JausId>,
}

/// The link of a host: a delay each way, and the share of datagrams that are lost, in percent.
#[derive(Clone, Copy)]
struct Far {
    address: SocketAddr,
    delay: Duration,
    loss: u64,
    seed: u64,
}

/// Hosts that exchange UDP datagrams.
struct Network {
    now: Instant,
    hosts: Vec<Host>,
    /// On their way, by the time of arrival: destination, source, octets.
    wire: BTreeMap<(Instant, u64), (SocketAddr, SocketAddr, Bytes)>,
    number: u64,
    /// One of so many datagrams is lost; 0 for none.
    loss: u64,
    /// A host with a link of its own.
    far: Option<Far>,
    /// Everything that was sent.
    record: Vec<(SocketAddr, SocketAddr, Bytes)>,
}

/// A number without pattern (SplitMix64).
const fn noise(number: u64) -> u64 {
    let mixed = number.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    mixed ^ (mixed >> 31)
}

fn key() -> Key {
    let folder = tempfile::tempdir().unwrap();
    Key::create(&folder.path().join("node.key")).unwrap()
}

fn peer(name: &str, key: &Key, ids: &str) -> Peer {
    Peer {
        name: name.to_owned(),
        key: key.public(),
        ids: vec![ids.parse().unwrap()],
        rules: Rules::everything(),
    }
}

fn trusting<const N: usize>(peers: [Peer; N]) -> TrustFile {
    TrustFile::of(Trust::new(peers.into()))
}

fn address(host: u8) -> SocketAddr {
    SocketAddr::from(([10, 0, 0, host], 3795))
}

impl Network {
    fn new() -> Self {
        Self {
            now: Instant::now(),
            hosts: Vec::new(),
            wire: BTreeMap::new(),
            number: 0,
            loss: 0,
            far: None,
            record: Vec::new(),
        }
    }

    fn add(&mut self, key: &Key, trust: &TrustFile, dials: &[SocketAddr]) -> usize {
        self.add_with(Credentials::pinned(key.clone(), trust.clone()), dials)
    }

    fn add_with(&mut self, credentials: Credentials, dials: &[SocketAddr]) -> usize {
        let number = u8::try_from(self.hosts.len() + 1).unwrap();
        let transport = Transport::with_credentials(credentials, dials.iter().copied());
        self.hosts.push(Host {
            address: address(number),
            transport,
            received: Vec::new(),
            closed: Vec::new(),
            spoken: Vec::new(),
        });
        self.hosts.len() - 1
    }

    fn collect(&mut self) {
        for host in &mut self.hosts {
            host.transport.handle_timeout(self.now);
            while let Some(Datagrams { to, octets, .. }) = host.transport.poll_transmit(self.now, 1)
            {
                self.number += 1;
                self.record.push((to, host.address, octets.clone()));
                let far = self
                    .far
                    .filter(|it| [to, host.address].contains(&it.address));
                let is_lost = match far {
                    Some(far) => noise(far.seed + self.number) % 100 < far.loss,
                    None => self.loss != 0 && self.number.is_multiple_of(self.loss),
                };
                if !is_lost {
                    let key = (self.now + far.map_or(DELAY, |it| it.delay), self.number);
                    self.wire.insert(key, (to, host.address, octets));
                }
            }
            while let Some(arrival) = host.transport.poll_arrival() {
                match arrival {
                    Arrival::Datagram { octets, .. } => host.received.push(octets),
                    Arrival::Closed(session) => host.closed.push(session),
                    Arrival::Speaks(ids) => host.spoken = ids,
                }
            }
        }
    }

    /// Lets this much time pass.
    fn run(&mut self, time: Duration) {
        let end = self.now + time;
        loop {
            self.collect();
            let arrives = self.wire.keys().next().map(|&(at, _)| at);
            let due = self
                .hosts
                .iter_mut()
                .filter_map(|it| it.transport.poll_timeout());
            let Some(next) = due.chain(arrives).min().filter(|&at| at <= end) else {
                break;
            };
            self.now = self.now.max(next);
            while let Some(entry) = self.wire.first_entry()
                && entry.key().0 <= self.now
            {
                let (to, from, octets) = entry.remove();
                self.deliver(to, from, &octets);
            }
        }
        self.now = end;
    }

    fn deliver(&mut self, to: SocketAddr, from: SocketAddr, octets: &[u8]) {
        if let Some(host) = self.hosts.iter_mut().find(|it| it.address == to) {
            host.transport.handle_datagram(self.now, from, octets);
        }
    }

    fn session(&self, host: usize) -> Option<SessionReport> {
        let mut sessions = self.hosts[host].transport.sessions();
        let first = sessions.next();
        assert!(sessions.next().is_none(), "one session");
        first
    }

    fn send(&mut self, host: usize, priority: Priority, datagram: &Bytes) {
        let session = self.session(host).expect("a session").session;
        self.hosts[host].transport.send(session, priority, datagram);
    }

    fn send_to_all(&mut self, host: usize, datagram: &Bytes) {
        let transport = &mut self.hosts[host].transport;
        transport.send_to_all(Priority::Standard, datagram);
    }

    fn count(&self, host: usize, counter: Counter) -> u64 {
        self.hosts[host].transport.counters().get(counter)
    }
}

/// A JUDP datagram with one message to everyone.
fn judp(source: &str, octets: usize) -> Bytes {
    raw(source, &JausId::EVERYONE.to_string(), &vec![7; octets])
}

/// A JUDP datagram with one message.
fn raw(source: &str, destination: &str, message: &[u8]) -> Bytes {
    let (source, destination) = (source.parse().unwrap(), destination.parse().unwrap());
    let frame = Frame::new(source, destination, Bytes::copy_from_slice(message));
    judp::encode(&frame).unwrap()
}

/// A fragment of a large message, which has to arrive and begins with the number 0.
fn fragment(source: &str, number: u16) -> Bytes {
    let mut frame = Frame::new(
        source.parse().unwrap(),
        JausId::EVERYONE,
        vec![7; 1400].into(),
    );
    frame.flags = Flags::default().with_data(match number {
        0 => DataControl::First,
        _ => DataControl::Middle,
    });
    frame.sequence = number;
    judp::encode(&frame).unwrap()
}

const SECOND: Duration = Duration::from_secs(1);

/// Nodes with these credentials, the second of which has dialled the first.
fn connected(credentials: &[Credentials; 2]) -> Network {
    let mut network = Network::new();
    network.add_with(credentials[0].clone(), &[]);
    network.add_with(credentials[1].clone(), &[address(1)]);
    network.run(SECOND);
    network
}

/// What a vehicle, 101, and an operator, 60, with these keys trust.
fn mutual(keys: &[Key; 2]) -> [TrustFile; 2] {
    [
        trusting([peer("operator", &keys[1], "60.255.255")]),
        trusting([peer("rover", &keys[0], "101.255.255")]),
    ]
}

fn pinned(keys: &[Key; 2], trust: &[TrustFile; 2]) -> [Credentials; 2] {
    [0, 1].map(|it| Credentials::pinned(keys[it].clone(), trust[it].clone()))
}

/// A vehicle, 101, that listens, and an operator, 60, that dials it.
fn vehicle_and_operator() -> (Network, [TrustFile; 2], [Key; 2]) {
    let keys = [key(), key()];
    let trust = mutual(&keys);
    (connected(&pinned(&keys, &trust)), trust, keys)
}

/// The sessions of a host.
fn sessions(network: &Network, host: usize) -> Vec<SessionId> {
    let sessions = network.hosts[host].transport.sessions();
    sessions.map(|it| it.session).collect()
}

/// Checks that the hosts can send each other datagrams.
fn exchange_both_ways(network: &mut Network) {
    let (report, command) = (judp("101.1.33", 20), judp("60.1.1", 900));
    network.send(0, Priority::Standard, &report);
    network.send(1, Priority::High, &command);
    network.run(SECOND);
    assert_eq!(network.hosts[1].received, [report]);
    assert_eq!(network.hosts[0].received, [command]);
}

#[test]
fn nodes_that_trust_each_other_exchange_datagrams_both_ways() {
    let (mut network, ..) = vehicle_and_operator();
    let (at_vehicle, at_operator) = (network.session(0).unwrap(), network.session(1).unwrap());
    assert_eq!(at_vehicle.peer.name, "operator");
    assert_eq!(at_operator.peer.name, "rover");
    assert!(at_operator.dialed && !at_vehicle.dialed);

    exchange_both_ways(&mut network);
}

#[test]
fn nothing_readable_travels_on_the_wire() {
    let (mut network, ..) = vehicle_and_operator();
    network.send(0, Priority::Standard, &judp("101.1.33", 200));
    network.run(SECOND);
    let readable = |octets: &Bytes| octets.windows(16).any(|it| it == [7; 16]);
    assert!(!network.record.iter().any(|(_, _, octets)| readable(octets)));
}

#[test]
fn a_session_needs_trust_in_both_directions() {
    for (vehicle_trusts, operator_trusts) in [(true, false), (false, true), (false, false)] {
        let keys = [key(), key()];
        let of = |yes, peer| if yes { trusting([peer]) } else { trusting([]) };
        let mut network = Network::new();
        let operator = peer("operator", &keys[1], "60.255.255");
        network.add(&keys[0], &of(vehicle_trusts, operator), &[]);
        let rover = peer("rover", &keys[0], "101.255.255");
        network.add(&keys[1], &of(operator_trusts, rover), &[address(1)]);
        network.run(5 * SECOND);
        assert!(network.count(1, Counter::HandshakesFailed) > 0);
        assert_eq!(network.count(0, Counter::SessionsEstablished), 0);
        assert_eq!(network.count(1, Counter::SessionsEstablished), 0);
        assert!(network.session(0).is_none() && network.session(1).is_none());
    }
}

#[test]
fn a_key_speaks_only_for_its_own_ids() {
    let (mut network, ..) = vehicle_and_operator();
    let own = judp("60.2.1", 20);
    for datagram in [&judp("61.1.1", 20), &judp("101.1.1", 20), &own] {
        network.send(1, Priority::Standard, datagram);
    }
    // A foreign message behind one of its own.
    let mut both = own.to_vec();
    both.extend_from_slice(&judp("61.1.1", 20)[1..]);
    network.send(1, Priority::Standard, &both.into());
    network.run(SECOND);
    assert_eq!(network.hosts[0].received, [own.clone(), own]);
    assert_eq!(network.count(0, Counter::ForeignIds), 3);
}

#[test]
fn a_revoked_key_loses_its_session_and_gets_no_other() {
    let (mut network, trust, _) = vehicle_and_operator();
    let ids: JausId = "60.255.255".parse().unwrap();
    assert_eq!(network.hosts[0].spoken, [ids]);
    trust[0].replace(Trust::default());
    network.run(SECOND);
    assert_eq!(network.hosts[0].spoken, [], "others may have them now");
    assert_eq!(network.hosts[0].closed.len(), 1);
    assert_eq!(network.hosts[1].closed.len(), 1);
    network.run(10 * SECOND);
    assert!(network.session(0).is_none() && network.session(1).is_none());
    assert_eq!(network.count(0, Counter::SessionsEstablished), 1);
}

#[test]
fn with_an_unusable_trust_file_sessions_remain_and_no_other_is_accepted_until_it_is_mended() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trusted_keys");
    let keys = [key(), key(), key()];
    let good = format!(
        "operator {} 60.255.255\ntablet {} 61.255.255\n",
        keys[1].public(),
        keys[2].public()
    );
    std::fs::write(&path, &good).unwrap();
    let trust = TrustFile::load(&path).unwrap();
    let rover = trusting([peer("rover", &keys[0], "101.255.255")]);
    let mut network = Network::new();
    network.add(&keys[0], &trust, &[]);
    network.add(&keys[1], &rover, &[address(1)]);
    network.run(SECOND);
    assert!(network.session(1).is_some());

    std::fs::write(&path, "operator\n").unwrap();
    trust.reload().unwrap_err();
    network.add(&keys[2], &rover, &[address(1)]);
    network.run(5 * SECOND);
    assert!(network.session(1).is_some() && network.session(2).is_none());
    assert!(network.count(0, Counter::RefusedUnusableTrust) > 0);

    std::fs::write(&path, &good).unwrap();
    trust.reload().unwrap();
    network.run(30 * SECOND);
    assert!(network.session(1).is_some() && network.session(2).is_some());
    assert_eq!(network.count(0, Counter::SessionsEstablished), 2);
}

#[test]
fn other_ids_of_a_trusted_key_take_effect_on_its_session() {
    let (mut network, trust, keys) = vehicle_and_operator();
    trust[0].replace(Trust::new(vec![peer("operator", &keys[1], "61.255.255")]));
    network.run(SECOND);
    let (old, new) = (judp("60.1.1", 20), judp("61.1.1", 20));
    network.send(1, Priority::Standard, &old);
    network.send(1, Priority::Standard, &new);
    network.run(SECOND);
    assert_eq!(network.hosts[0].received, [new]);
}

#[test]
fn fragments_arrive_though_a_tenth_of_the_packets_is_lost() {
    let (mut network, ..) = vehicle_and_operator();
    network.loss = 10;
    let fragments: Vec<_> = (0..200)
        .map(|number| fragment("101.1.33", number))
        .collect();
    for fragment in &fragments {
        network.send(0, Priority::Standard, fragment);
    }
    network.run(10 * SECOND);
    assert_eq!(network.hosts[1].received, fragments);
}

#[test]
fn an_urgent_message_overtakes_a_large_one() {
    let (mut network, ..) = vehicle_and_operator();
    for number in 0..1000 {
        network.send(0, Priority::Low, &fragment("101.1.33", number));
    }
    let urgent = judp("101.1.33", 20);
    network.send(0, Priority::SafetyCritical, &urgent);
    network.run(4 * DELAY);
    let received = &network.hosts[1].received;
    assert!(received.contains(&urgent), "{} before it", received.len());
    assert!(received.len() < 500, "{}", received.len());
}

#[test]
fn of_two_sessions_between_the_same_nodes_one_stays() {
    let keys = [key(), key()];
    let trust = mutual(&keys);
    let mut network = Network::new();
    network.add(&keys[0], &trust[0], &[address(2)]);
    network.add(&keys[1], &trust[1], &[address(1)]);
    network.run(10 * SECOND);
    let (one, other) = (network.session(0).unwrap(), network.session(1).unwrap());
    assert_ne!(one.dialed, other.dialed, "both keep the same one");
    assert_eq!(one.dialed, keys[0].public() < keys[1].public());
    assert!(network.count(0, Counter::SessionsEstablished) <= 2);
    network.send(0, Priority::Standard, &judp("101.1.33", 20));
    network.run(SECOND);
    assert_eq!(network.hosts[1].received.len(), 1);
}

#[test]
fn a_silent_peer_is_lost_and_dialled_until_it_is_back() {
    let (mut network, ..) = vehicle_and_operator();
    network.hosts[0].address = address(99);
    network.run(IDLE + KEEP_ALIVE);
    assert!(network.session(1).is_none());
    assert_eq!(network.hosts[1].closed.len(), 1);
    network.hosts[0].address = address(1);
    network.run(10 * SECOND);
    assert_eq!(network.session(1).unwrap().peer.name, "rover");
}

#[test]
fn a_peer_that_was_started_again_replaces_its_session() {
    let (mut network, trust, keys) = vehicle_and_operator();
    let before = network.session(0).unwrap().session;
    network.hosts[1].transport = Transport::new(&keys[1], trust[1].clone(), [address(1)]);
    network.run(SECOND);
    assert_ne!(network.session(0).unwrap().session, before);
    assert_eq!(network.hosts[0].closed, [before]);
}

#[test]
fn a_session_survives_a_change_of_address() {
    let (mut network, ..) = vehicle_and_operator();
    let before = network.session(0).unwrap();
    network.hosts[1].address = SocketAddr::from(([172, 16, 0, 9], 40_000));
    network.send(1, Priority::Standard, &judp("60.1.1", 20));
    network.run(SECOND);
    let after = network.session(0).unwrap();
    assert_eq!(after.session, before.session);
    assert_eq!(after.address, network.hosts[1].address);
    network.send(0, Priority::Standard, &judp("101.1.33", 20));
    network.run(SECOND);
    assert_eq!(network.hosts[1].received.len(), 1);
}

#[test]
fn replayed_and_damaged_packets_have_no_effect() {
    let (mut network, ..) = vehicle_and_operator();
    network.send(1, Priority::Standard, &judp("60.1.1", 20));
    network.run(SECOND);
    assert_eq!(network.hosts[0].received.len(), 1);
    for (to, from, octets) in network.record.clone() {
        network.deliver(to, from, &octets);
        network.deliver(to, address(77), &octets);
        network.deliver(to, from, &octets[..octets.len() / 2]);
        let mut damaged = octets.to_vec();
        let middle = damaged.len() / 2;
        damaged[middle] ^= 1;
        network.deliver(to, from, &damaged);
    }
    network.run(10 * SECOND);
    assert_eq!(network.hosts[0].received.len(), 1);
    assert_eq!(network.session(0).unwrap().peer.name, "operator");
    assert_eq!(network.count(0, Counter::SessionsEstablished), 1);
}

#[test]
fn a_restarted_node_is_noticed_before_its_session_times_out() {
    let (mut network, trust, keys) = vehicle_and_operator();
    // No goodbye: its state is gone.
    network.hosts[0].transport = Transport::new(&keys[0], trust[0].clone(), []);
    network.run(2 * SECOND);
    assert_eq!(network.hosts[1].closed.len(), 1);
    assert!(network.session(0).is_some() && network.session(1).is_some());
    const { assert!(IDLE.as_secs() > 2) };
}

#[test]
fn a_node_that_stops_tells_its_peers() {
    let (mut network, ..) = vehicle_and_operator();
    assert!(network.hosts[0].transport.close(network.now));
    assert!(!network.hosts[0].transport.close(network.now), "only once");
    network.run(4 * DELAY);
    assert!(network.session(1).is_none());
}

mod rules;
