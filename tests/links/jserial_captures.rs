//! Recorded JSerial traffic of Junior: each read gives the expected frames, and our encoding of
//! them gives the same octets.

use std::fs;

use jaus::address::JausId;
use jaus::wire::jserial::{self, Counters, Decoder};
use jaus::wire::{Acknowledgement, Broadcast, Frame, Version};
use jaus_test_kit::evidence;

/// The octets of one read, from a line of the record: time, direction, length, octets.
fn octets(line: &str) -> Vec<u8> {
    let fields: Vec<_> = line.split_whitespace().collect();
    let digits = fields.last().expect("four fields");
    let octet = |at: usize| u8::from_str_radix(&digits[at..at + 2], 16).expect("hexadecimal");
    let octets: Vec<_> = (0..digits.len()).step_by(2).map(octet).collect();
    assert_eq!(octets.len().to_string(), fields[2]);
    octets
}

#[test]
fn juniors_packets_are_read_and_written_octet_for_octet() {
    let captures = evidence::captures();
    let record = fs::read_to_string(captures.join("junior/jserial-bytes.txt")).expect("a record");
    let mut decoder = Decoder::new();
    let mut frames = Vec::new();
    for line in record.lines() {
        let octets = octets(line);
        decoder.push(&octets);
        let read: Vec<Frame> = std::iter::from_fn(|| decoder.next_frame()).collect();
        let written: Vec<_> = read
            .iter()
            .map(|f| jserial::encode(f).expect("a frame"))
            .collect();
        assert_eq!(written.concat(), octets, "{line}");
        frames.extend(read);
    }
    let sound = Counters {
        packets: 18,
        messages: 18,
        ..Counters::default()
    };
    assert_eq!(*decoder.counters(), sound);
    check(&frames);
}

/// The first ping goes to an unknown id and is acknowledged. Eight pings and eight pongs alternate,
/// the first included. The last message is of the first edition.
fn check(frames: &[Frame]) {
    let (a, b) = (JausId::new(1, 1, 1), JausId::new(2, 1, 1));
    let [first, acknowledgement, rest @ .., last] = frames else {
        panic!("{} frames", frames.len());
    };
    assert_eq!((first.source, first.destination), (a, b));
    assert_eq!(first.flags.broadcast(), Some(Broadcast::Global));
    assert_eq!(first.flags.acknowledgement(), Acknowledgement::Request);
    assert!(acknowledgement.is_acknowledgement());
    assert_eq!((acknowledgement.source, acknowledgement.sequence), (b, 1));
    for (index, pong_or_ping) in rest.iter().enumerate() {
        let source = if index % 2 == 0 { b } else { a };
        assert_eq!(
            (pong_or_ping.source, pong_or_ping.code()),
            (source, Some(0x4B01))
        );
        assert_eq!(pong_or_ping.payload.len(), 16);
    }
    assert_eq!((last.version, last.source), (Version::As5669, a));
    assert_eq!((last.code(), last.payload.len()), (Some(0x4B01), 18));
}
