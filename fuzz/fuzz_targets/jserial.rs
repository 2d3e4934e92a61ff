//! Serial lines: the first octet determines how the line is cut into parts. The second determines
//! whether the rest is the line itself, or messages written as packets with octets of the input
//! between them, so that checksums do not reject everything. The frames and counts must not depend
//! on the cuts, and the buffered data is bounded.
#![no_main]

use bytes::Bytes;
use jaus::address::JausId;
use jaus::wire::jserial::{self, Counters, Decoder};
use jaus::wire::{Flags, Frame};
use libfuzzer_sys::fuzz_target;

/// The longest packet, every octet stuffed.
const LONGEST: usize = 2 * (jserial::MAX_CONTENT + 16);

fuzz_target!(|octets: &[u8]| {
    let [part, packets, rest @ ..] = octets else {
        return;
    };
    let line = if *packets == 0 {
        rest.to_vec()
    } else {
        line_of(*packets, rest)
    };
    let whole = decode(&line, line.len().max(1));
    assert_eq!(decode(&line, usize::from(*part).max(1)), whole);
    for frame in whole.0 {
        let Ok(packet) = jserial::encode(&frame) else {
            continue;
        };
        assert_eq!(decode(&packet, packet.len()).0, [frame]);
    }
});

/// Packets with `length` octets of payload from the input, separated by as many octets of it.
fn line_of(length: u8, input: &[u8]) -> Vec<u8> {
    let mut line = Vec::new();
    for (index, part) in input.chunks(length.into()).enumerate() {
        if index % 2 == 0 {
            let payload = Bytes::copy_from_slice(part);
            let frame = Frame {
                flags: Flags(part[0]),
                ..Frame::new(JausId::new(1, 1, 1), JausId::new(2, 1, 1), payload)
            };
            line.extend_from_slice(&jserial::encode(&frame).expect("a short message"));
        } else {
            line.extend_from_slice(part);
        }
    }
    line
}

fn decode(line: &[u8], part: usize) -> (Vec<Frame>, Counters) {
    let mut decoder = Decoder::new();
    let mut frames = Vec::new();
    for octets in line.chunks(part) {
        decoder.push(octets);
        frames.extend(std::iter::from_fn(|| decoder.next_frame()));
        assert!(
            decoder.buffered() <= LONGEST + octets.len(),
            "more than one packet waits"
        );
    }
    (frames, *decoder.counters())
}
