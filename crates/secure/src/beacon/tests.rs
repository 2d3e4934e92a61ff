//! Honest and hostile beacons, in virtual time.
#![expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]

use std::net::SocketAddr;
use std::time::Instant;

use super::*;
use crate::trust::{Trust, TrustFile};

const SECOND: Duration = Duration::from_secs(1);
/// A time of day, since 1970.
const NOON: Duration = Duration::from_secs(1_800_000_000);

fn key() -> Key {
    let folder = tempfile::tempdir().unwrap();
    Key::create(&folder.path().join("node.key")).unwrap()
}

fn trusting(key: &Key, ids: &str) -> TrustFile {
    let line = format!("rover {} {ids}", key.public());
    TrustFile::of(Trust::parse(&line).unwrap())
}

fn from(host: u8) -> SocketAddr {
    SocketAddr::from(([10, 0, 0, host], 40_000))
}

/// A rover's key, and an operator that trusts it.
struct Scene {
    now: Instant,
    rover: Key,
    operator: Neighbors,
}

impl Scene {
    fn new() -> Self {
        let rover = key();
        Self {
            now: Instant::now(),
            operator: Neighbors::new(key().public(), trusting(&rover, "101.255.255")),
            rover,
        }
    }

    fn beacon(&self, seconds: u64) -> Beacon {
        Beacon {
            fingerprint: self.rover.public().fingerprint(),
            subsystem: 101,
            node: 1,
            address: from(1).ip(),
            port: 3795,
            stamp: Stamp { seconds, number: 0 },
        }
    }

    fn signed(&self, seconds: u64) -> Bytes {
        self.beacon(seconds).sign(&self.rover).unwrap()
    }

    fn handle(&mut self, from: SocketAddr, datagram: &[u8]) -> Option<Sighting> {
        self.operator.handle(self.now, from, datagram)
    }

    fn hears(&mut self, datagram: &[u8]) -> Option<SocketAddr> {
        let sighting = self.handle(from(1), datagram)?;
        assert_eq!(sighting.key, self.rover.public());
        Some(sighting.address)
    }

    fn count(&self, counter: Counter) -> u64 {
        self.operator.counters().get(counter)
    }
}

#[test]
fn a_beacon_is_read_as_it_was_signed() {
    let key = key();
    for address in ["10.0.0.1", "fe80::1", "fd00::7:1"] {
        let beacon = Beacon {
            fingerprint: key.public().fingerprint(),
            subsystem: 60_001,
            node: 254,
            address: address.parse().unwrap(),
            port: 65_535,
            stamp: Stamp {
                seconds: u64::MAX,
                number: 7,
            },
        };
        let datagram = beacon.sign(&key).unwrap();
        assert_eq!(datagram.len(), LENGTH);
        let received = Received::decode(&datagram).unwrap();
        assert_eq!(received.verify(key.public()), Some(&beacon));
    }
}

#[test]
fn a_beacon_of_a_trusted_key_shows_where_its_link_listens() {
    let mut scene = Scene::new();
    let beacon = scene.signed(1);
    assert_eq!(scene.hears(&beacon), Some("10.0.0.1:3795".parse().unwrap()));
    assert_eq!(scene.count(Counter::BeaconsAccepted), 1);
}

#[test]
fn no_octet_of_a_beacon_can_be_changed() {
    let mut scene = Scene::new();
    let beacon = scene.signed(1);
    for index in 0..beacon.len() {
        let mut changed = beacon.to_vec();
        changed[index] ^= 1;
        assert_eq!(scene.hears(&changed), None, "octet {index}");
        scene.now += SECOND;
    }
    for length in 0..beacon.len() {
        assert_eq!(scene.hears(&beacon[..length]), None, "{length} octets");
    }
    let longer = [&beacon[..], &[0]].concat();
    assert_eq!(scene.hears(&longer), None);
    let reasons = [
        Counter::Malformed,
        Counter::Unknown,
        Counter::Misplaced,
        Counter::ForeignIds,
        Counter::Forged,
    ];
    let refused: u64 = reasons.map(|reason| scene.count(reason)).iter().sum();
    assert_eq!(refused, 2 * LENGTH as u64 + 1);
    assert!(scene.hears(&beacon).is_some(), "the original still counts");
}

#[test]
fn a_beacon_counts_once_and_an_older_one_not_at_all() {
    let mut scene = Scene::new();
    let [old, new] = [1, 2].map(|seconds| scene.signed(seconds));
    assert!(scene.hears(&new).is_some());
    for replayed in [&new, &old] {
        assert_eq!(scene.hears(replayed), None);
    }
    assert_eq!(scene.count(Counter::Replayed), 2);
}

#[test]
fn a_node_whose_clock_was_set_back_is_found_again_after_the_lifetime_of_its_beacons() {
    let mut scene = Scene::new();
    let [before, after] = [NOON.as_secs(), 5].map(|seconds| scene.signed(seconds));
    assert!(scene.hears(&before).is_some());
    scene.now += LIFETIME - SECOND;
    assert_eq!(scene.hears(&after), None);
    scene.now += SECOND;
    assert!(scene.hears(&after).is_some());
}

#[test]
fn beacons_of_other_keys_and_other_ids_are_ignored() {
    let mut scene = Scene::new();
    let stranger = key();
    let mut beacon = scene.beacon(1);
    // Signed with another key than it names.
    assert_eq!(scene.hears(&beacon.sign(&stranger).unwrap()), None);
    assert_eq!(scene.count(Counter::Forged), 1);
    beacon.fingerprint = stranger.public().fingerprint();
    assert_eq!(scene.hears(&beacon.sign(&stranger).unwrap()), None);
    assert_eq!(scene.count(Counter::Unknown), 1);
    for (subsystem, node) in [(102, 1), (0, 1), (101, 0), (101, 255), (65_535, 1)] {
        let foreign = Beacon {
            subsystem,
            node,
            ..scene.beacon(1)
        };
        assert_eq!(scene.hears(&foreign.sign(&scene.rover).unwrap()), None);
    }
    assert_eq!(scene.count(Counter::ForeignIds), 5);
}

#[test]
fn a_beacon_from_another_address_than_its_own_leads_nowhere() {
    let mut scene = Scene::new();
    let beacon = scene.signed(1);
    assert_eq!(scene.handle(from(66), &beacon), None);
    let portless = Beacon {
        port: 0,
        ..scene.beacon(1)
    };
    assert_eq!(scene.hears(&portless.sign(&scene.rover).unwrap()), None);
    assert_eq!(scene.count(Counter::Misplaced), 2);
}

#[test]
fn a_revoked_key_is_not_found() {
    let rover = key();
    let trust = trusting(&rover, "101.255.255");
    let mut scene = Scene {
        operator: Neighbors::new(key().public(), trust.clone()),
        rover,
        ..Scene::new()
    };
    let [first, second] = [1, 2].map(|seconds| scene.signed(seconds));
    assert!(scene.hears(&first).is_some());
    trust.replace(Trust::default());
    assert_eq!(scene.hears(&second), None);
    assert_eq!(scene.count(Counter::Unknown), 1);
}

#[test]
fn a_flood_costs_few_signature_checks_and_keeps_no_other_address_out() {
    let mut scene = Scene::new();
    let forged = forged(&scene.beacon(2));
    for _ in 0..100_000 {
        assert_eq!(scene.hears(&forged), None);
    }
    let forged = scene.count(Counter::Forged);
    assert!(forged <= 16, "{forged}");
    assert_eq!(forged + scene.count(Counter::Limited), 100_000);
    let honest = Beacon {
        address: from(2).ip(),
        ..scene.beacon(1)
    };
    let honest = honest.sign(&scene.rover).unwrap();
    let sighting = scene.handle(from(2), &honest);
    assert_eq!(sighting.unwrap().address.ip(), from(2).ip());
}

#[test]
fn a_flood_from_invented_addresses_costs_a_bounded_number_of_signature_checks() {
    let mut scene = Scene::new();
    for number in 0..20_000_u32 {
        let address = IpAddr::from(Ipv4Addr::from_bits(0x0A00_0000 | number));
        let beacon = Beacon {
            address,
            ..scene.beacon(2)
        };
        let from = SocketAddr::new(address, 40_000);
        assert_eq!(scene.handle(from, &forged(&beacon)), None);
    }
    // One for each address that has a limit of its own, and the burst of the others.
    let forged = scene.count(Counter::Forged);
    assert!(forged <= 16 + 8, "{forged}");
}

/// A beacon with a signature that its key has not made.
fn forged(beacon: &Beacon) -> Vec<u8> {
    [&beacon.encode()[..], &[1; SIGNATURE]].concat()
}

#[test]
fn a_peer_in_sight_stays_so_while_a_forger_invents_addresses_with_its_fingerprint() {
    let mut scene = Scene::new();
    let first = scene.signed(1);
    assert!(scene.hears(&first).is_some());
    for second in 2..60 {
        scene.now += SECOND;
        for host in 2..=255 {
            let beacon = Beacon {
                address: from(host).ip(),
                ..scene.beacon(1000)
            };
            let sighting = scene.handle(from(host), &forged(&beacon));
            assert_eq!(sighting, None);
        }
        let honest = scene.signed(second);
        assert!(scene.hears(&honest).is_some(), "second {second}");
    }
}

#[test]
fn beacons_forged_with_one_fingerprint_keep_no_other_key_at_that_address_out() {
    let mut scene = Scene::new();
    let other = key();
    let lines = [(&scene.rover, 101), (&other, 102)]
        .map(|(key, id)| format!("rover{id} {} {id}.255.255\n", key.public()));
    let trust = TrustFile::of(Trust::parse(&lines.concat()).unwrap());
    scene.operator = Neighbors::new(key().public(), trust);
    for seconds in 0..1000 {
        let beacon = forged(&scene.beacon(seconds));
        assert_eq!(scene.hears(&beacon), None);
    }
    let beacon = Beacon {
        fingerprint: other.public().fingerprint(),
        subsystem: 102,
        ..scene.beacon(1)
    };
    let beacon = beacon.sign(&other).unwrap();
    assert!(scene.handle(from(1), &beacon).is_some());
}

#[test]
fn stamps_grow_whatever_the_clock_does() {
    let mut stamp = Stamp::default();
    for time in [
        NOON,
        NOON,
        Duration::ZERO,
        NOON + SECOND,
        NOON,
        Duration::MAX,
        NOON,
    ] {
        let next = stamp.after(time);
        assert!(next > stamp, "{next:?} after {stamp:?}");
        stamp = next;
    }
    let last = Stamp {
        seconds: 7,
        number: u32::MAX,
    };
    assert!(last.after(SECOND) > last);
}

#[test]
fn a_node_announces_itself_often_at_first_and_steadily_later() {
    let key = key();
    let mut now = Instant::now();
    let start = now;
    let mut announcer = Announcer::new(&key, JausId::new(101, 1, 0), 3795);
    assert!(announcer.is_due(now));
    let addresses = [from(1).ip(), from(2).ip()];
    let mut operator = Neighbors::new(self::key().public(), trusting(&key, "101.1.255"));
    let mut rounds = 0;
    while now < start + 60 * SECOND {
        let beacons = announcer.announce(now, NOON, addresses);
        rounds += 1;
        for (host, beacon) in (1..).zip(beacons) {
            let sighting = operator.handle(now, from(host), &beacon.unwrap());
            assert_eq!(sighting.unwrap().address.ip(), from(host).ip());
        }
        let due = announcer.due().unwrap();
        assert!(!announcer.is_due(now) && due > now);
        let most = if rounds <= 5 { 2 * SECOND } else { 5 * SECOND };
        assert!(due - now <= most && due - now >= most.mul_f64(0.79));
        now = due;
    }
}
