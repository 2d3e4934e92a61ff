//! JTCP streams: the first octet determines how the rest, a stream, is cut into parts. Cut or
//! whole, it must give the same frames and the same error; decoded frames round-trip through the
//! encoder; at most one message is buffered.
#![no_main]

use jaus::wire::jtcp::{self, Decoder};
use jaus::wire::{Error, Frame, Kind};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|octets: &[u8]| {
    let Some((&part, stream)) = octets.split_first() else {
        return;
    };
    let whole = decode(stream, stream.len().max(1));
    assert_eq!(decode(stream, usize::from(part).max(1)), whole);
    for frame in whole.0 {
        come_back(frame);
    }
});

fn decode(stream: &[u8], part: usize) -> (Vec<Frame>, Option<Error>) {
    let mut decoder = Decoder::new();
    let mut frames = Vec::new();
    for part in stream.chunks(part) {
        decoder.input().extend_from_slice(part);
        loop {
            match decoder.next_frame() {
                Ok(Some(frame)) => frames.push(frame),
                Ok(None) => break,
                Err(error) => return (frames, Some(error)),
            }
        }
        assert!(decoder.buffered() <= 0x10000, "more than one message waits");
    }
    (frames, None)
}

fn come_back(frame: Frame) {
    if frame.kind != Kind::default() {
        return;
    }
    let written = jtcp::encode(&frame).expect("what was read can be written");
    assert_eq!(decode(&written, written.len()), (vec![frame], None));
}
