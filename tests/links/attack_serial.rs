//! A hostile serial line: garbage, endless messages, and ids of peers on other links. The line is a
//! pseudo-terminal; the attacked peers use UDP on loopback.
#![cfg(target_os = "linux")]

use std::fs::File;
use std::io::{Read, Write};
use std::process::Command;
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Counter, Outgoing, Remote};
use jaus::link::serial::Settings;
use jaus::node::{Config, Node, Port};
use jaus::wire::{Acknowledgement, Flags, Frame, jserial};
use jaus_test_kit::evidence::this_test;
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::LIMIT;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

const VEHICLE: JausId = JausId::new(101, 1, 1);
const CLIENT: JausId = JausId::new(102, 1, 1);
/// The id of the peer on the line.
const ON_THE_LINE: JausId = JausId::new(103, 1, 1);
/// Queries of the client, and messages of the peer on the line.
const QUESTIONS: u32 = 200;
const VALID: u16 = 100;

/// A vehicle with a serial line whose other end is the attacker's, and a client.
struct Scene {
    vehicle: Node,
    driver: Port,
    console: Port,
    line: File,
    /// Whether the client acknowledges answers, which verifies its address.
    acknowledges: bool,
    _client: Node,
}

impl Scene {
    /// Starts the nodes; `adapt` changes the vehicle's settings, given the client's address.
    fn new(adapt: impl FnOnce(Config, Remote) -> Config) -> Self {
        let end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&end).unwrap();
        unlockpt(&end).unwrap();
        let device = ptsname(&end, Vec::new()).unwrap().into_string().unwrap();
        let group = own_group();
        let client = Node::start(Config::loopback(102, 1).group(group)).unwrap();
        let config = Config::loopback(101, 1).group(group);
        let config = adapt(config, client.links()[0].local.into());
        let vehicle = Node::start(config.serial(Settings::new(device))).unwrap();
        let line = File::from(end);
        // The vehicle's output on the line is read and discarded.
        let mut other = line.try_clone().unwrap();
        std::thread::spawn(move || while let Ok(1..) = other.read(&mut [0; 4096]) {});
        Self {
            driver: vehicle.attach(1).unwrap(),
            console: client.attach(1).unwrap(),
            vehicle,
            line,
            acknowledges: true,
            _client: client,
        }
    }

    /// Sends queries while octets arrive on the line, at least until all have arrived. Returns the
    /// number of unanswered queries, and the messages that the driver received from the line.
    async fn ask_during(&mut self, octets: Vec<u8>) -> (u32, Vec<(JausId, Bytes)>) {
        self.ask(0).await;
        let mut line = self.line.try_clone().unwrap();
        let attack = std::thread::spawn(move || line.write_all(&octets));
        let mut lost = 0;
        let mut from_line = Vec::new();
        let mut number = 1;
        while number <= QUESTIONS || !attack.is_finished() {
            let (answered, more) = self.ask(number).await;
            lost += u32::from(!answered);
            from_line.extend(more);
            number += 1;
        }
        // The last part may still be in transit.
        let rest = async {
            while let Some(message) = self.driver.recv().await {
                from_line.push((message.source, message.payload));
            }
        };
        let _ = tokio::time::timeout(Duration::from_secs(1), rest).await;
        (lost, from_line)
    }

    /// Sends a query, answers it at the vehicle, and waits for the answer. Returns whether it
    /// arrived, and the driver's other messages.
    async fn ask(&mut self, number: u32) -> (bool, Vec<(JausId, Bytes)>) {
        let (console, driver) = (&mut self.console, &mut self.driver);
        let acknowledge = self.acknowledges;
        let question = [&[0x02, 0x22][..], &number.to_le_bytes()].concat();
        let question = Bytes::from(question);
        let message = Outgoing {
            acknowledge: true,
            ..Outgoing::new(CLIENT, VEHICLE, question.clone())
        };
        console.send(message).unwrap();
        let mut others = Vec::new();
        let exchange = async {
            loop {
                tokio::select! {
                    message = driver.recv() => {
                        let message = message.unwrap();
                        if message.payload == question {
                            let answer = Outgoing {
                                acknowledge,
                                ..Outgoing::new(VEHICLE, CLIENT, message.payload)
                            };
                            driver.send(answer).unwrap();
                        } else {
                            others.push((message.source, message.payload));
                        }
                    }
                    answer = console.recv() => if answer.unwrap().payload == question {
                        break;
                    },
                }
            }
        };
        let answered = tokio::time::timeout(LIMIT, exchange).await.is_ok();
        (answered, others)
    }
}

/// A message on the line with this acknowledgement field.
fn on_line(source: JausId, sequence: u16, acknowledgement: Acknowledgement) -> Bytes {
    let payload = [&[0x02, 0x42][..], &sequence.to_le_bytes()].concat();
    let frame = Frame {
        flags: Flags::default().with_acknowledgement(acknowledgement),
        sequence,
        ..Frame::new(source, VEHICLE, payload.into())
    };
    jserial::encode(&frame).unwrap()
}

/// Whether this test has its process, whose memory it measures, to itself. Otherwise runs it in such
/// a process.
fn has_own_process() -> bool {
    const OWN: &str = "JAUS_TEST_OWN_PROCESS";
    if std::env::var_os(OWN).is_some() {
        return true;
    }
    let this = std::env::current_exe().unwrap();
    let mut again = Command::new(this);
    again.args(["--exact", &this_test(), "--nocapture"]);
    assert!(again.env(OWN, "1").status().unwrap().success());
    false
}

/// Resident memory of this process, in octets.
fn resident() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmRSS:"));
    let kib = line.and_then(|line| line.split_whitespace().nth(1));
    1024 * kib.unwrap().parse::<usize>().unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn rubbish_and_halves_on_a_line_lose_no_message_of_others_and_none_behind_them() {
    if !has_own_process() {
        return;
    }
    let mut scene = Scene::new(|config, _| config);
    let mut octets = Vec::new();
    let mut state = 1_u32;
    for sequence in 1..=VALID {
        let rubbish = (0..20_000).map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        });
        octets.extend(rubbish);
        let long = Frame::new(ON_THE_LINE, VEHICLE, vec![0x10; 1000].into());
        let long = jserial::encode(&long).unwrap();
        octets.extend(&long[..long.len() / 2]);
        octets.extend(on_line(ON_THE_LINE, sequence, Acknowledgement::Request));
    }
    let before = resident();
    let (lost, from_line) = scene.ask_during(octets).await;
    let grown = resident().saturating_sub(before);
    let valid = from_line.iter().filter(|it| it.0 == ON_THE_LINE).count();
    let counters = scene.vehicle.serial_lines()[0].counters.received;
    println!("{lost} lost, {valid} from the line, {grown} octets more, {counters:?}");
    assert_eq!((lost, valid), (0, VALID.into()));
    assert!(counters.rubbish_octets > 1_000_000, "{counters:?}");
    assert!(grown < 8 << 20, "{grown}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_forged_id_on_a_line_takes_nothing_from_its_owner() {
    forged_ids_take_nothing(true).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_forged_id_on_a_line_takes_nothing_from_an_owner_that_has_only_asked() {
    forged_ids_take_nothing(false).await;
}

async fn forged_ids_take_nothing(acknowledges: bool) {
    let mut scene = Scene::new(|config, _| config);
    scene.acknowledges = acknowledges;
    let forged = (1..=5000).flat_map(|number: u16| {
        let kinds = [Acknowledgement::None, Acknowledgement::Request];
        on_line(CLIENT, number, kinds[usize::from(number % 2)])
    });
    let (lost, from_line) = scene.ask_during(forged.collect()).await;
    println!("{lost} lost, {} in the client's id", from_line.len());
    assert_eq!(lost, 0);
    assert!(from_line.len() > 1000, "the attack came through");
    let peers = scene.vehicle.peers();
    let client = peers.iter().find(|peer| peer.id == CLIENT).unwrap();
    assert_ne!(client.path.peer, Remote::Line, "{client:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_pinned_id_is_refused_from_a_line() {
    let mut scene = Scene::new(|config, client| {
        let peer = format!("{CLIENT}@{client}");
        config.peer(peer.parse().unwrap())
    });
    let forged = (1..=2000).flat_map(|number| on_line(CLIENT, number, Acknowledgement::None));
    let (lost, from_line) = scene.ask_during(forged.collect()).await;
    assert_eq!((lost, from_line), (0, Vec::new()));
    let refused = scene.vehicle.counters().get(Counter::PinnedElsewhere);
    assert_eq!(refused, 2000);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_bound_id_is_refused_from_a_line() {
    let mut scene = Scene::new(|mut config, client| {
        let address = client.socket().unwrap().ip();
        let bound = format!("{CLIENT}@{address}").parse();
        config.access.bind.push(bound.unwrap());
        config
    });
    let forged = (1..=2000).flat_map(|number| on_line(CLIENT, number, Acknowledgement::None));
    let (lost, from_line) = scene.ask_during(forged.collect()).await;
    assert_eq!((lost, from_line), (0, Vec::new()));
    let refused = scene.vehicle.counters().get(Counter::BoundElsewhere);
    assert_eq!(refused, 2000);
}
