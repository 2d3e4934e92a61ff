//! Captures with random damage: everything readable is read, and nothing panics.

use crate::support::{Message, RAW, ip_packet, pcap, pcapng};
use jaus_test_kit::random::Random;
use jaus_view::{Capture, Dictionary, JAUS_PORT, Line, MessageLog, Network};

/// A small generator with the same sequence in every run (xorshift64*).
/// All lines decoded from a capture.
fn lines(capture: &[u8], dictionary: &Dictionary) -> Vec<String> {
    let mut capture = match Capture::new(capture) {
        Ok(capture) => capture,
        Err(error) => return vec![error.to_string()],
    };
    let mut network = Network::new([JAUS_PORT]);
    let mut log = MessageLog::new(dictionary);
    let mut lines = Vec::new();
    while let Some(frame) = capture.next_frame() {
        match frame {
            Ok(frame) => {
                for datagram in network.handle_frame(&frame) {
                    let read = log.read(frame.time, &datagram);
                    lines.extend(read.iter().map(Line::to_json));
                }
            }
            Err(error) => lines.push(Line::from(&error).to_json()),
        }
    }
    lines
}

/// Packets of every kind: one message, several messages, fragments, acknowledgements, older
/// headers.
fn packets() -> Vec<Vec<u8>> {
    let query = Message::new(&[0x00, 0x2B, 0x02]);
    let report = Message::new(&[0x00, 0x4B, 2, 0x11, 0x27, 5, b'R', b'o', b'v', b'e', b'r']);
    let fragment = |flags, sequence, payload: &[u8]| {
        let message = Message {
            flags,
            sequence,
            ..Message::new(payload)
        };
        message.datagram()
    };
    let as5669 =
        b"\x01\0\0\0\x12\x06\x02\x00\x2b\x01\x01\x69\x00\x01\x01\x2a\x00\x01\x00\x01\x00\x02";
    let ra = b"JAUS01.0\x06\x02\x02\x42\x01\x01\xff\xff\x01\x23\x01\x0a\x00\x00\x00\x00";
    [
        query.datagram(),
        [query.datagram(), report.octets()].concat(),
        fragment(0x41, 7, &report.payload[..6]),
        fragment(0xC1, 8, &report.payload[6..]),
        fragment(0x31, 9, &[]),
        as5669.to_vec(),
        ra.to_vec(),
    ]
    .iter()
    .map(|datagram| ip_packet(datagram))
    .collect()
}

#[test]
fn no_damage_makes_the_reader_panic_or_write_a_broken_line() {
    let dictionary = Dictionary::new();
    let mut random = Random::new(1);
    for whole in [pcap(RAW, &packets()), pcapng(RAW, &packets())] {
        assert!(lines(&whole, &dictionary).len() >= packets().len());
        for _ in 0..4000 {
            let mut damaged = whole.clone();
            for _ in 0..=random.below(8) {
                let place = random.below(damaged.len());
                damaged[place] = random.below(256) as u8;
            }
            damaged.truncate(damaged.len() - random.below(4) * random.below(40));
            for line in lines(&damaged, &dictionary) {
                assert!(!line.is_empty() && !line.contains('\n'), "{line}");
            }
        }
    }
}
