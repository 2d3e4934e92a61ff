//! Replays the requests of the public competitions' judging tool to the core services (IOP
//! Challenge, steps 3 to 26), octet for octet, and checks the answers.
#![allow(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]

use std::time::{Duration, Instant};

use bytes::Bytes;

use super::{
    AccessControl, Discovery, Kind, Liveness, Management, Profile, Scope, Service, Stack, Timing,
};
use crate::address::JausId;
use crate::endpoint::Received;
use crate::wire::{Broadcast, Priority};

const VEHICLE: JausId = JausId::new(105, 1, 1);
const JUDGE: JausId = JausId::new(42, 1, 1);
/// The judge's components that compete for control.
const A: JausId = JausId::new(42, 2, 1);
const B: JausId = JausId::new(42, 2, 2);
const C: JausId = JausId::new(42, 2, 3);
const D: JausId = JausId::new(42, 2, 4);

/// Step, client, request, and the expected messages with their destinations.
type Row = (u8, JausId, &'static str, &'static [(JausId, &'static str)]);

const EVENTS: [Row; 8] = [
    (3, JUDGE, "f0210300", &[(JUDGE, "f04100")]),
    (
        4,
        JUDGE,
        "f00101003c00020000000222",
        // Confirmed at 1 Hz, and the first report.
        &[(JUDGE, "f30101013c00"), (JUDGE, "f1410100020000000242")],
    ),
    (5, JUDGE, "f0210201", &[(JUDGE, "f041010001020000000222")]),
    (6, JUDGE, "0222", &[(JUDGE, "0242")]),
    // A report instead of a query.
    (
        7,
        JUDGE,
        "f00103001e000400000002440000",
        &[(JUDGE, NOBODY_ANSWERS)],
    ),
    (
        8,
        JUDGE,
        "f10104001e0001020000000222",
        // At 0.5 Hz, and the next report.
        &[(JUDGE, "f30104011e00"), (JUDGE, "f1410101020000000242")],
    ),
    (9, JUDGE, "f2010701", &[(JUDGE, "f30107011e00")]),
    (10, JUDGE, "f0210201", &[(JUDGE, "f04100")]),
];

const STANDBY: &str = "02400200000000";
const READY: &str = "02400100000000";
const EMERGENCY: &str = "02400500000000";

const CONTROL: [Row; 31] = [
    (12, A, "0320", &[(A, "034000")]),
    (13, A, "0d20", &[(A, "0d400000000000")]),
    (14, A, "0d0000", &[(A, "0f0002")]),
    (15, A, "0d00dc", &[(A, "0f0000")]),
    (15, A, "0d20", &[(A, "0d402a000201dc")]),
    (16, A, "0100db", &[]),
    (16, A, "0120", &[(A, "0140db")]),
    (17, B, "0d00c8", &[(B, "0f0002")]),
    (17, B, "0d20", &[(B, "0d402a000201db")]),
    (18, C, "0d00e7", &[(A, "100000"), (C, "0f0000")]),
    (18, C, "0d20", &[(C, "0d402a000203e7")]),
    (19, C, "0e00", &[(C, "100000")]),
    (20, D, "06000100", &[]),
    (20, A, "0220", &[(A, EMERGENCY)]),
    (21, A, "0d00d2", &[(A, "0f0001")]),
    (22, D, "07000100", &[]),
    (22, A, "0d00dc", &[(A, "0f0000")]),
    (22, A, "0220", &[(A, STANDBY)]),
    (23, A, "0400", &[]),
    (23, A, "0220", &[(A, READY)]),
    (24, A, "0300", &[]),
    (24, A, "0220", &[(A, STANDBY)]),
    // Control is lost, and its holder is notified.
    (25, A, "0500", &[(A, "100000")]),
    (25, A, "0220", &[(A, STANDBY)]),
    (26, D, "06000100", &[]),
    (26, A, "0220", &[(A, EMERGENCY)]),
    (26, A, "0e00", &[(A, "100001")]),
    // Only the client that has set it can clear it.
    (26, A, "07000100", &[]),
    (26, A, "0220", &[(A, EMERGENCY)]),
    (26, D, "07000100", &[]),
    (26, A, "0220", &[(A, STANDBY)]),
];

/// The code 5, and 80 octets of text: "this component does not answer this query".
const NOBODY_ANSWERS: &str = concat!(
    "f401030305",
    "7468697320636f6d706f6e656e7420646f6573206e6f7420616e737765722074686973207175657279",
    "0000000000000000000000000000",
    "00000000000000000000000000000000000000000000000000"
);

fn octets(hex: &str) -> Bytes {
    let digits: Vec<_> = hex
        .bytes()
        .filter_map(|it| char::from(it).to_digit(16))
        .collect();
    digits
        .chunks(2)
        .map(|pair| (pair[0] << 4 | pair[1]) as u8)
        .collect()
}

/// Each request goes to all components of the node, as from the tool.
fn request(source: JausId, hex: &str) -> Received {
    Received {
        source,
        destination: JausId::new(105, 1, JausId::ANY_COMPONENT),
        to: VEHICLE,
        priority: Priority::Standard,
        broadcast: Broadcast::Global,
        payload: octets(hex),
        sequence: None,
        path: None,
        acknowledged: false,
    }
}

/// Sends row after row, 10 ms apart, so that no periodic report comes between.
fn ask(rows: &[Row]) {
    let profile = Profile::new(Kind::Vehicle, "Rover");
    let discovery = Discovery::new(VEHICLE, profile, Scope::Nobody, Timing::default(), 1);
    let services: Vec<Box<dyn Service>> = vec![Box::new(Liveness::new())];
    // The judging tool requests control once and never renews it.
    let lasting = Management::new().access_control(AccessControl::new().timeout(0));
    let mut stack = Stack::new(discovery, services).management(lasting);
    let mut now = Instant::now();
    stack.start(now);
    for &(step, client, hex, told) in rows {
        now += Duration::from_millis(10);
        stack.handle_message(now, &request(client, hex));
        let said: Vec<_> = std::iter::from_fn(|| stack.poll_transmit())
            .map(|message| (message.destination, message.payload))
            .collect();
        let expected: Vec<_> = told.iter().map(|&(to, hex)| (to, octets(hex))).collect();
        assert_eq!(said, expected, "step {step}: {hex} from {client}");
    }
}

#[test]
fn steps_3_to_10_of_the_contest_are_answered_as_its_judges_expect() {
    ask(&EVENTS);
}

#[test]
fn steps_12_to_26_of_the_contest_are_answered_as_its_judges_expect() {
    ask(&CONTROL);
}
