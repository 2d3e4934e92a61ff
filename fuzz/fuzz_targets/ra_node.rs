//! Arbitrary input to a node among systems of the Reference Architecture: no panic, no growth
//! beyond limits, advancing time.
//!
//! The input is a sequence of steps. Each begins with an octet for the time that passes, one for
//! the source host and the form (raw, or behind a valid header to one of our components), and one
//! for the length of the data that follows.
#![no_main]

use std::net::SocketAddr;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::wire::Acknowledgement;
use jaus::wire::ra::{Fields, Header, PREFIX};
use jaus_ra::RaId;
use jaus_ra::connection::{self, Connections};
use jaus_ra::node::{Event, RaComponentEntry, RaNode, RaNodeEntry, RaSubsystemEntry, Settings};
use libfuzzer_sys::fuzz_target;

/// Time zero of every input.
static START: LazyLock<Instant> = LazyLock::new(Instant::now);

/// The codes that the node itself handles, and some that it does not.
const CODES: [u16; 20] = [
    0x4202, 0x2202, 0x2B00, 0x2B01, 0x2B03, 0x4B00, 0x4B01, 0x4B03, 0x01F0, 0x01F2, 0x01F3, 0x01F4,
    0x41F1, 0x0008, 0x0009, 0x000A, 0x000B, 0x000C, 0x4402, 0x0405,
];

fuzz_target!(|octets: &[u8]| {
    let mut settings = Settings::default();
    settings.carrier.max_message = 16_384;
    settings.carrier.max_parts = 65_536;
    settings.carrier.max_parts_per_subsystem = 32_768;
    settings.max_components = 16;
    settings.queue_limit = 32;
    let mut now = *START;
    let mut node = RaNode::new(settings);
    node.announce(now, vehicle()).expect("a valid subsystem");
    let mut connections = Connections::new(connection::Settings::default());
    let mut story = octets;
    while let Some((&[pause, how, length], rest)) = story.split_first_chunk() {
        let (data, rest) = rest.split_at(rest.len().min(length.into()));
        story = rest;
        now += Duration::from_millis(u64::from(pause) * 8);
        let from = SocketAddr::from(([10, 0, 0, how & 3], 3794));
        let datagram = match how & 4 {
            0 => Bytes::copy_from_slice(data),
            _ => framed(data),
        };
        node.handle_datagram(now, from, datagram);
        node.handle_timeout(now);
        connections.handle_timeout(now);
        while let Some(event) = node.poll_event() {
            let Event::Message(message) = event else {
                continue;
            };
            connections.handle_message(now, &message);
            while let Some(event) = connections.poll_event() {
                if let connection::Event::Wanted(id, _) = event {
                    connections.accept(now, id);
                    connections.set_report(now, id, Bytes::from_static(b"report"));
                }
            }
        }
        while let Some(message) = connections.poll_transmit() {
            let _ = node.send(now, &message);
        }
        while node.poll_transmit().is_some() {}
        assert!(node.carrier().unfinished() <= 65_536);
        assert!(node.subsystems().count() <= 254);
        assert!(
            node.subsystems()
                .all(|known| known.components().count() <= 16)
        );
        assert!(node.poll_timeout().is_some_and(|next| next > now));
    }
});

fn vehicle() -> RaSubsystemEntry {
    RaSubsystemEntry {
        id: 30,
        name: "Vehicle".into(),
        nodes: vec![RaNodeEntry {
            id: 1,
            name: "Main".into(),
            components: vec![RaComponentEntry {
                component: 33,
                instance: 1,
                ..RaComponentEntry::default()
            }],
        }],
    }
}

/// A datagram with a valid header; the first octets determine the content.
fn framed(octets: &[u8]) -> Bytes {
    let (head, data) = octets.split_at(octets.len().min(5));
    let at = |index: usize| head.get(index).copied().unwrap_or_default();
    let ours = [1, 33, 35, 255];
    let fields = Fields {
        priority: 6,
        acknowledgement: match at(4) & 1 {
            0 => Acknowledgement::None,
            _ => Acknowledgement::Request,
        },
        service_connection: at(4) & 2 != 0,
        experimental: false,
        code: CODES[usize::from(at(0)) % CODES.len()],
        destination: RaId::new(30, 1, ours[usize::from(at(1)) % 4], 1),
        source: RaId::new(1 + at(2) % 4, 1, ours[usize::from(at(3)) % 3], 1),
        data_flag: [0, 0, 0, 1, 2, 4, 8, 15][usize::from(at(4) >> 5)],
        data_size: data.len(),
        sequence: u16::from(at(4) >> 2 & 7),
    };
    [&PREFIX[..], &Header::new(&fields).octets(), data]
        .concat()
        .into()
}
