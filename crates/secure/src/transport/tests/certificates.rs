//! Certificates, and the replacement of keys, in virtual time.

use std::fs;
use std::path::PathBuf;
use std::time::SystemTime;

use jaus::codec::Message as _;
use jaus::messages::core::QueryHeartbeatPulse;
use tempfile::TempDir;

use super::super::renewal::REMINDER_PAUSE;
use super::*;
use crate::ca::{CertificateAuthority, Request};
use crate::credentials::{CertificateFiles, CredentialsError};

const NOW: u64 = 1_800_000_000;
const DAY: u64 = 24 * 60 * 60;

fn at(seconds: u64) -> SystemTime {
    SystemTime::UNIX_EPOCH + Duration::from_secs(seconds)
}

/// A team: its authority, and the folders of its nodes.
struct Team {
    folder: TempDir,
    authority: CertificateAuthority,
}

impl Team {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let authority = CertificateAuthority::create(folder.path(), "team", None, at(NOW)).unwrap();
        Self { folder, authority }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Issues a certificate for the key in `NAME.key`, which is made if necessary.
    fn issue(&self, name: &str, ids: &str, days: u64, now: u64) {
        let path = self.path(&format!("{name}.key"));
        let key = Key::load(&path).or_else(|_| Key::create(&path)).unwrap();
        let request = Request {
            name: name.to_owned(),
            key: key.public(),
            ids: vec![ids.parse().unwrap()],
            life: Duration::from_secs(days * DAY),
        };
        let pem = self.authority.issue(&request, at(now)).unwrap();
        fs::write(self.path(&format!("{name}.crt")), pem).unwrap();
    }

    fn files(&self, name: &str) -> CertificateFiles {
        CertificateFiles {
            certificate: self.path(&format!("{name}.crt")),
            authority: self.path("ca.crt"),
            revoked: Some(self.path("ca.crl")),
        }
    }

    fn load(
        &self,
        name: &str,
        trust: &TrustFile,
        now: u64,
    ) -> Result<Credentials, CredentialsError> {
        let key = self.path(&format!("{name}.key"));
        Credentials::load_certified(&key, &self.files(name), trust.clone(), at(now))
    }

    fn error(&self, name: &str, now: u64) -> String {
        self.load(name, &trusting([]), now).unwrap_err().to_string()
    }

    fn node(&self, name: &str, ids: &str) -> Credentials {
        self.issue(name, ids, 30, NOW);
        self.load(name, &trusting([]), NOW).unwrap()
    }

    fn nodes(&self) -> [Credentials; 2] {
        [
            self.node("rover", "101.255.255"),
            self.node("operator", "60.255.255"),
        ]
    }
}

/// A vehicle, 101, that listens, and an operator, 60, that dials it.
fn certified() -> (Network, Team, [Credentials; 2]) {
    let team = Team::new();
    let credentials = team.nodes();
    let network = connected(&credentials);
    (network, team, credentials)
}

fn assert_no_session(network: &Network) {
    assert!(network.session(0).is_none() && network.session(1).is_none());
}

/// What a peer that may observe may send.
fn query(source: &str) -> Bytes {
    let query = QueryHeartbeatPulse {}.encode().unwrap();
    raw(source, "101.1.1", &query)
}

#[test]
fn nodes_with_certificates_of_one_authority_need_no_trust_file() {
    let (mut network, ..) = certified();
    let (at_vehicle, at_operator) = (network.session(0).unwrap(), network.session(1).unwrap());
    assert_eq!(at_vehicle.peer.name, "operator");
    assert_eq!(at_operator.peer.name, "rover");
    let [own, foreign] = ["60.1.1", "61.1.1"].map(query);
    for datagram in [&own, &foreign, &judp("60.1.1", 20)] {
        network.send(1, Priority::Standard, datagram);
    }
    network.run(SECOND);
    assert_eq!(network.hosts[0].received, [own]);
    assert_eq!(network.count(0, Counter::ForeignIds), 1);
    // It may observe only.
    assert_eq!(network.count(0, Counter::RuleForbids), 1);
}

#[test]
fn a_line_of_the_trust_file_narrows_the_ids_of_a_certificate() {
    let team = Team::new();
    team.issue("rover", "101.255.255", 30, NOW);
    let trust = Trust::parse("operator certificate 60.1.255,61.255.255 command also=any").unwrap();
    let trust = TrustFile::of(trust);
    let rover = team.load("rover", &trust, NOW).unwrap();
    let mut network = connected(&[rover, team.node("operator", "60.255.255")]);
    let allowed = judp("60.1.9", 20);
    // The second and third are within one of the two only.
    for datagram in [&allowed, &judp("60.2.9", 20), &judp("61.1.1", 20)] {
        network.send(1, Priority::Standard, datagram);
    }
    network.run(SECOND);
    assert_eq!(network.hosts[0].received, std::slice::from_ref(&allowed));

    assert_eq!(network.count(0, Counter::ForeignIds), 2);

    trust.replace(Trust::default());
    network.run(2 * SECOND);
    let other = query("60.2.9");
    network.send(1, Priority::Standard, &other);
    network.run(SECOND);
    assert_eq!(network.hosts[0].received, [allowed, other]);
}

#[test]
fn a_revoked_certificate_loses_its_session_within_two_seconds_and_gets_no_other() {
    let (mut network, team, credentials) = certified();
    let spoken: [JausId; 1] = ["60.255.255".parse().unwrap()];
    assert_eq!(network.hosts[0].spoken, spoken);
    team.authority.revoke("operator", at(NOW)).unwrap();
    credentials[0].reload().unwrap();
    network.run(2 * SECOND);
    assert_no_session(&network);
    network.run(20 * SECOND);
    assert_no_session(&network);
    assert!(network.count(0, Counter::RefusedRevoked) > 0);
    assert_eq!(network.count(0, Counter::SessionsEstablished), 1);
    assert_eq!(network.hosts[0].spoken, spoken, "nobody else gets its ids");
}

#[test]
fn a_session_ends_when_the_certificate_expires_and_the_new_one_continues() {
    let (mut network, team, credentials) = certified();
    // The vehicle has a longer certificate.
    team.issue("rover", "101.255.255", 365, NOW);
    credentials[0].reload().unwrap();
    network.run(2 * SECOND);
    assert!(network.session(0).is_some());
    for credentials in &credentials {
        credentials.set_clock(at(NOW + 31 * DAY));
    }
    network.run(2 * SECOND);
    assert_no_session(&network);
    network.run(20 * SECOND);
    assert!(network.count(0, Counter::RefusedTimes) > 0);

    team.issue("operator", "60.255.255", 30, NOW + 31 * DAY);
    credentials[1].reload().unwrap();
    network.run(20 * SECOND);
    assert_eq!(network.session(0).unwrap().peer.name, "operator");
}

#[test]
fn a_clock_that_is_off_by_a_year_refuses_and_recovers_when_it_is_set() {
    for wrong in [NOW - 365 * DAY, NOW + 365 * DAY] {
        let credentials = Team::new().nodes();
        credentials[0].set_clock(at(wrong));
        let mut network = connected(&credentials);
        network.run(5 * SECOND);
        assert_no_session(&network);
        assert!(network.count(0, Counter::RefusedTimes) > 0, "{wrong}");
        credentials[0].set_clock(at(NOW));
        network.run(20 * SECOND);
        assert!(network.session(0).is_some(), "{wrong}");
    }
}

#[test]
fn another_authority_is_refused_by_both_sides() {
    let (one, other) = (Team::new(), Team::new());
    let mut network = connected(&[
        one.node("rover", "101.255.255"),
        other.node("operator", "60.255.255"),
    ]);
    network.run(5 * SECOND);
    assert_no_session(&network);
    assert!(network.count(1, Counter::RefusedCertificates) > 0);
    let sessions = [0, 1].map(|host| network.count(host, Counter::SessionsEstablished));
    assert_eq!(sessions, [0, 0]);
}

#[test]
fn a_node_with_certificates_and_one_with_pinned_keys_get_no_session() {
    for certified_listens in [true, false] {
        let team = Team::new();
        let (pinned, operator) = (key(), team.node("operator", "60.255.255"));
        let trust = trusting([peer("operator", &pinned, "60.255.255")]);
        let pinned = Credentials::pinned(pinned, trust);
        let mut credentials = [operator, pinned];
        if !certified_listens {
            credentials.reverse();
        }
        let mut network = connected(&credentials);
        network.run(5 * SECOND);
        assert_no_session(&network);
        assert!(network.count(1, Counter::HandshakesFailed) > 0);
    }
}

#[test]
fn the_certificate_of_another_key_cannot_be_used() {
    let team = Team::new();
    team.issue("rover", "101.255.255", 30, NOW);
    team.issue("thief", "66.255.255", 30, NOW);
    // The node itself notices it.
    fs::copy(team.path("rover.crt"), team.path("thief.crt")).unwrap();
    let error = team.error("thief", NOW);
    assert!(error.contains("another key"), "{error}");

    // A thief's own program would not; the signature of the handshake shows it.
    let thief = Key::load(&team.path("thief.key")).unwrap();
    let rover = crate::Certificate::load(&team.path("rover.crt")).unwrap();
    let rover_node = team.load("rover", &trusting([]), NOW).unwrap();
    let stolen = rover_node.with_own(thief, rover);
    let mut network = connected(&[team.node("operator", "60.255.255"), stolen]);
    network.run(5 * SECOND);
    assert_no_session(&network);
    assert!(network.count(0, Counter::RefusedCertificates) > 0);
}

#[test]
fn an_own_certificate_that_is_not_valid_is_an_error_that_says_what_to_do() {
    let team = Team::new();
    team.issue("rover", "101.255.255", 30, NOW);
    for (now, words) in [
        (NOW + 31 * DAY, ["has expired", "jaus keys ca issue"]),
        (NOW - 365 * DAY, ["is valid from", "set the clock"]),
    ] {
        let error = team.error("rover", now);
        assert!(words.iter().all(|it| error.contains(it)), "{error}");
    }
    team.authority.revoke("rover", at(NOW)).unwrap();
    let error = team.error("rover", NOW);
    assert!(error.contains("is revoked"), "{error}");
}

#[test]
fn a_certificate_that_expires_soon_is_warned_of_once_a_day() {
    let (mut network, _team, credentials) = certified();
    assert_eq!(network.count(0, Counter::ExpiryReminders), 0);
    credentials[0].set_clock(at(NOW + 25 * DAY));
    network.run(60 * SECOND);
    assert_eq!(network.count(0, Counter::ExpiryReminders), 1);
    network.now += REMINDER_PAUSE;
    network.run(60 * SECOND);
    assert_eq!(network.count(0, Counter::ExpiryReminders), 2);
}

#[test]
fn replayed_and_cut_handshakes_with_certificates_have_no_effect() {
    let (mut network, ..) = certified();
    for (to, from, octets) in network.record.clone() {
        for source in [from, address(77)] {
            network.deliver(to, source, &octets);
            network.deliver(to, source, &octets[..octets.len() / 2]);
        }
    }
    network.run(10 * SECOND);
    assert_eq!(network.count(0, Counter::SessionsEstablished), 1);
    assert_eq!(network.session(0).unwrap().peer.name, "operator");
}

#[test]
fn a_pinned_key_is_replaced_and_the_link_is_back_within_a_second() {
    for rotating in [0, 1] {
        let folder = tempfile::tempdir().unwrap();
        let paths = ["rover.key", "operator.key"].map(|it| folder.path().join(it));
        let keys = paths.each_ref().map(|it| Key::create(it).unwrap());
        let trust = mutual(&keys);
        let load = |host: usize| Credentials::load(&paths[host], trust[host].clone());
        let credentials = [0, 1].map(|host| load(host).unwrap());
        let mut network = connected(&credentials);
        assert!(network.session(0).is_some());

        let next = Key::create(&Key::next_path(&paths[rotating])).unwrap();
        let (name, ids) = [("rover", "101.255.255"), ("operator", "60.255.255")][rotating];
        let old = peer(name, &keys[rotating], ids);
        let new = peer(name, &next, ids);
        let other = 1 - rotating;
        trust[other].replace(Trust::new(vec![old, new.clone()]));
        network.run(2 * SECOND);
        let established = network.count(other, Counter::SessionsEstablished);
        assert_eq!(established, 1, "the session stays");

        Key::replace_by_next(&paths[rotating]).unwrap();
        credentials[rotating].reload().unwrap();
        network.run(SECOND);
        assert_eq!(network.session(other).unwrap().peer.key, next.public());
        trust[other].replace(Trust::new(vec![new]));
        network.run(2 * SECOND);
        let established = network.count(other, Counter::SessionsEstablished);
        assert_eq!(established, 2, "the session stays");
        assert_eq!(network.session(other).unwrap().peer.name, name);
    }
}
