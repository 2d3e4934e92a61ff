//! Nodes connected by a serial line, with and without noise. The line is a pair of
//! pseudo-terminals; the test copies the octets between them.
#![cfg(target_os = "linux")]

use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::PathBuf;
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Outgoing, Received, Remote};
use jaus::link::serial::Settings;
use jaus::node::{Config, Node, Port};
use jaus::wire::{Frame, jserial};
use jaus_test_kit::waiting::{until, within_limit};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

const QUERY_HEARTBEAT: Bytes = Bytes::from_static(&[0x02, 0x22]);
const REPORT_HEARTBEAT: Bytes = Bytes::from_static(&[0x02, 0x42]);

/// A pseudo-terminal: the test's end, and the device that a node opens.
fn terminal() -> (File, String) {
    let end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
    grantpt(&end).unwrap();
    unlockpt(&end).unwrap();
    let device = ptsname(&end, Vec::new()).unwrap();
    (File::from(end), device.into_string().unwrap())
}

/// Copies octets from one terminal to the other until either is closed.
fn carry(mut from: File, mut to: File, mut change: impl FnMut(&[u8]) -> Vec<u8> + Send + 'static) {
    std::thread::spawn(move || {
        let mut octets = [0; 256];
        while let Ok(count @ 1..) = from.read(&mut octets) {
            if to.write_all(&change(&octets[..count])).is_err() {
                return;
            }
        }
    });
}

/// A node with only a serial line.
fn node(subsystem: u16, device: &str) -> Node {
    let config = Config::new(subsystem, 1).without_udp();
    Node::start(config.serial(Settings::new(device))).unwrap()
}

/// Two nodes and the line between them; `change` is applied to the octets in both directions.
fn line(change: impl FnMut(&[u8]) -> Vec<u8> + Clone + Send + 'static) -> (Node, Node) {
    let ((a, device_a), (b, device_b)) = (terminal(), terminal());
    let nodes = (node(101, &device_a), node(102, &device_b));
    let (a_too, b_too) = (a.try_clone().unwrap(), b.try_clone().unwrap());
    carry(a, b, change.clone());
    carry(b_too, a_too, change);
    nodes
}

async fn receive(port: &mut Port) -> Received {
    within_limit(port.recv()).await.expect("a running node")
}

#[tokio::test]
async fn nodes_talk_over_a_line() {
    let (vehicle, operator) = line(<[u8]>::to_vec);
    let mut driver = vehicle.attach(33).unwrap();
    let mut console = operator.attach(1).unwrap();

    console
        .send(Outgoing::new(console.id(), driver.id(), QUERY_HEARTBEAT))
        .unwrap();
    let query = receive(&mut driver).await;
    assert_eq!(
        (query.source, query.payload),
        (console.id(), QUERY_HEARTBEAT)
    );
    assert_eq!(query.path.unwrap().peer, Remote::Line);
    driver
        .send(Outgoing::new(driver.id(), query.source, REPORT_HEARTBEAT))
        .unwrap();
    let report = receive(&mut console).await;
    assert_eq!(
        (report.source, report.payload),
        (driver.id(), REPORT_HEARTBEAT)
    );

    // Long, and made of octets that are escaped on the line.
    let map = Bytes::from(vec![0x10; 20_000]);
    driver
        .send(Outgoing::new(
            driver.id(),
            JausId::EVERYONE,
            REPORT_HEARTBEAT,
        ))
        .unwrap();
    driver
        .send(Outgoing::new(driver.id(), console.id(), map.clone()))
        .unwrap();
    assert_eq!(receive(&mut console).await.destination, JausId::EVERYONE);
    assert!(receive(&mut console).await.payload == map);
    let counters = operator.serial_lines()[0].counters;
    assert_eq!(counters.received.rubbish_octets, 0, "{counters:?}");
}

/// Takes a copy of a message out of those that were sent once more.
fn take(spare: &mut Vec<Bytes>, received: &Bytes) {
    let copy = spare.iter().position(|it| it == received);
    spare.swap_remove(copy.unwrap_or_else(|| panic!("{received:?} is delivered twice")));
}

#[tokio::test]
async fn acknowledged_messages_come_through_noise_each_once() {
    const MESSAGES: u16 = 60;
    let mut passed = 0_usize;
    // One octet in 331 is changed, one in 401 dropped, and one inserted per 239.
    let noise = move |octets: &[u8]| {
        let mut changed = Vec::new();
        for &octet in octets {
            passed += 1;
            match passed {
                n if n.is_multiple_of(331) => changed.push(octet ^ 0x11),
                n if n.is_multiple_of(401) => {}
                n if n.is_multiple_of(239) => changed.extend([0x10, 0x01, octet]),
                _ => changed.push(octet),
            }
        }
        changed
    };
    let (vehicle, operator) = line(noise);
    let (mut driver, console) = (vehicle.attach(33).unwrap(), operator.attach(1).unwrap());

    // Copies that were sent again in vain: the first copy was only late.
    let mut spare: Vec<Bytes> = Vec::new();
    for number in 0..MESSAGES {
        let payload = Bytes::copy_from_slice(&number.to_be_bytes());
        let message = Outgoing {
            acknowledge: true,
            ..Outgoing::new(console.id(), driver.id(), payload.clone())
        };
        console.send(message.clone()).unwrap();
        let arrives = async {
            loop {
                let arrival = tokio::time::timeout(Duration::from_secs(2), driver.recv());
                let Ok(received) = arrival.await else {
                    // Noise destroyed every attempt, so it is sent again, as an application would.
                    console.send(message.clone()).unwrap();
                    spare.push(payload.clone());
                    continue;
                };
                let received = received.expect("a running node").payload;
                if received == payload {
                    return;
                }
                take(&mut spare, &received);
            }
        };
        within_limit(arrives).await;
    }
    while let Some(received) = driver.try_recv() {
        take(&mut spare, &received.payload);
    }
    let received = vehicle.serial_lines()[0].counters.received;
    assert!(
        received.packets >= MESSAGES.into() && received.rubbish_octets > 0,
        "{received:?}"
    );
}

/// The device of a USB converter reappears under its name.
#[tokio::test]
async fn a_port_that_went_away_is_used_again_when_it_is_back() {
    let folder = std::env::temp_dir().join(format!("jaus-serial-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let name: PathBuf = folder.join("ttyUSB0");
    let plug_in = || {
        let (end, device) = terminal();
        // Replaces the old one atomically.
        std::os::unix::fs::symlink(device, folder.join("new")).unwrap();
        fs::rename(folder.join("new"), &name).unwrap();
        end
    };
    let first = plug_in();
    let vehicle = node(101, name.to_str().unwrap());
    let mut driver = vehicle.attach(33).unwrap();
    let hello = Frame::new(JausId::new(102, 1, 1), driver.id(), QUERY_HEARTBEAT);
    (&first)
        .write_all(&jserial::encode(&hello).unwrap())
        .unwrap();
    receive(&mut driver).await;

    drop(first);
    until(|| !vehicle.serial_lines()[0].is_open).await;
    assert!(vehicle.peers().is_empty(), "who was behind it is unknown");

    let second = plug_in();
    until(|| vehicle.serial_lines()[0].is_open).await;
    let again = Frame {
        sequence: 2,
        ..hello
    };
    (&second)
        .write_all(&jserial::encode(&again).unwrap())
        .unwrap();
    assert_eq!(receive(&mut driver).await.source, again.source);
    assert_eq!(vehicle.serial_lines()[0].counters.failures, 1);
    fs::remove_dir_all(folder).unwrap();
}

#[tokio::test]
async fn a_port_that_cannot_be_used_is_refused_with_the_reason_and_the_remedy() {
    let refused = |device: &str| {
        let config = Config::new(101, 1).without_udp();
        Node::start(config.serial(Settings::new(device)))
            .unwrap_err()
            .to_string()
    };
    let missing = refused("/dev/ttyNone7");
    assert!(
        missing.contains("`/dev/ttyNone7`") && missing.contains("plug it in"),
        "{missing}"
    );
    let no_port = refused("/dev/null");
    assert!(no_port.contains("it is not a serial port"), "{no_port}");
}
