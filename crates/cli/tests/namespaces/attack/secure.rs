//! The attacks on JUDP and JTCP, repeated against a vehicle that has a secure link alone: none has an
//! effect, and none is answered.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::Instant;

use jaus::node::{Config, Node};
use jaus::rights::Rules;
use jaus_secure::transport::Transport;
use jaus_secure::{Key, Peer, SecureLink, Settings, TrustFile, edit};
use jaus_test_kit::hosts::SETTINGS;

use super::attacker::Attacker;
use super::floods::{UNANSWERED, alone};
use super::scene::{MEMORY, Scene, figures, on_testbed};
use crate::testbed::{Host, TO_STRANGERS};

/// The port of secure links.
const PORT: u16 = 3795;
/// The vehicle's address on the client's cable.
const VEHICLE: &str = "10.216.1.1:3795";
/// The setting of a client with a secure link.
const FOLDER: &str = "secure:";
/// Attacks on plain JUDP that have an effect, or would without its defences.
const ATTACKS: [&str; 12] = [
    "forged-id",
    "many-ids",
    "many-addresses",
    "forged-control",
    "queries",
    "events",
    "configuration",
    "answers",
    "unending",
    "gapped",
    "overlapping",
    "flood",
];

/// The folder of a client's keys, if it is to have a secure link.
pub(crate) fn folder_of_keys() -> Option<PathBuf> {
    let settings = std::env::var(SETTINGS).ok()?;
    settings.strip_prefix(FOLDER).map(PathBuf::from)
}

/// Starts a client's node that has a secure link to the vehicle, and nothing else.
pub(crate) fn start(subsystem: u16, folder: &Path) -> Node {
    let key = Key::load(&folder.join("client.key")).unwrap();
    let trust = TrustFile::load(&folder.join("client.trusted_keys")).unwrap();
    let settings = Settings::new(SocketAddr::from(([0; 4], 0))).connect(VEHICLE.parse().unwrap());
    let link = SecureLink::open(&key, trust, settings).unwrap();
    let config = Config::new(subsystem, 1).without_udp();
    Node::start_with(config, vec![Box::new(link)]).unwrap()
}

/// The first packet of a stranger's handshake. Its octets 6 to 9 are in the id of the connection.
#[expect(clippy::disallowed_methods, reason = "the time of a single packet")]
pub(crate) fn first_packet() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let key = Key::create(&folder.path().join("stranger.key")).unwrap();
    let victim = VEHICLE.parse().unwrap();
    let mut transport = Transport::new(&key, TrustFile::default(), [victim]);
    transport.handle_timeout(Instant::now());
    let packets = transport.poll_transmit(Instant::now(), 1).unwrap();
    packets.octets.to_vec()
}

/// An attacker that aims at the port of secure links.
pub(crate) fn stranger() -> Attacker {
    let victim = SocketAddr::new(TO_STRANGERS.parse().unwrap(), PORT);
    Attacker::between("10.217.0.9:3794".parse().unwrap(), victim)
}

/// Runs the body with a vehicle and a client that have a secure link.
fn on_secure_scene(body: impl Fn(Scene<'_>, &Path)) {
    on_testbed(|bed| {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let key = |name: &str| Key::create(&path(name)).unwrap().public();
        let peer = |name: &str, key, ids: &str| Peer {
            name: name.to_owned(),
            key,
            ids: vec![ids.parse().unwrap()],
            rules: Rules::default(),
        };
        let client = peer("client", key("client.key"), "102.255.255");
        let vehicle = peer("vehicle", key("vehicle.key"), "101.255.255");
        edit::trust(&path("vehicle.trusted_keys"), &client, false).unwrap();
        edit::trust(&path("client.trusted_keys"), &vehicle, false).unwrap();
        let [key, trusted, audit] =
            ["vehicle.key", "vehicle.trusted_keys", "audit.jsonl"].map(path);
        let flags = [
            ("--key", key),
            ("--trusted-keys", trusted),
            ("--audit", audit),
        ]
        .map(|(flag, path)| format!("{flag}={}", path.display()));
        let flags: Vec<_> = flags
            .iter()
            .map(String::as_str)
            .chain(["--secure-listen"])
            .collect();
        let settings = format!("{FOLDER}{}", folder.path().display());
        body(Scene::start(bed, &flags, &settings), folder.path());
    });
}

#[test]
fn attacks_on_plain_links_have_no_effect_on_a_secure_node() {
    let _alone = alone(&UNANSWERED);
    on_secure_scene(|scene, _| {
        for attack in ATTACKS {
            for port in ["brief:3794", "brief:3795"] {
                let sent = scene.attack_with(attack, port);
                println!("| {attack}, {port}, secure | {sent:?} |");
                assert_eq!(sent["octets"], 0, "{attack} at {port}");
            }
        }
        let seen = scene.client();
        assert_eq!((seen["controller"], seen["moved_mm"]), (0, 0), "{seen:?}");
        assert!(seen["lost"] <= 2, "{seen:?}");
        assert!(scene.memory() < MEMORY, "{} KiB", scene.memory());
        // Plain TCP is not open at all.
        let connects = "exec 3<>/dev/tcp/10.216.2.1/3794";
        let status = scene
            .bed
            .program(Host::Strangers, "bash", &["-c", connects])
            .status();
        assert!(!status.unwrap().success());
    });
}

#[test]
fn ten_thousand_handshakes_a_second_cost_a_client_nothing() {
    let _alone = alone(&UNANSWERED);
    on_secure_scene(|scene, _| {
        let attacker = scene.bed.start(Host::Strangers, "handshakes", "");
        attacker.says("begun");
        let seen = scene.client();
        let sent = figures(&attacker.says("attack"));
        println!("| {} handshakes | {seen:?}, {sent:?} |", sent["packets"]);
        assert!(sent["packets"] > 50_000, "{sent:?}");
        assert_eq!(seen["lost"], 0, "{seen:?}");
        assert!(seen["median_us"] < 10_000, "{seen:?}");
        assert!(scene.memory() < MEMORY, "{} KiB", scene.memory());
    });
}
