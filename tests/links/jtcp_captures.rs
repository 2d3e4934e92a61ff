//! Recorded JTCP connections of Junior and JAUS++: decoded in any segmentation, and encoded again.

use std::path::Path;

use crate::streams::streams;
use bytes::{Bytes, BytesMut};
use jaus::wire::jtcp::{self, Decoder};
use jaus::wire::{DataControl, Frame};
use jaus_test_kit::evidence;

fn decode(stream: &[u8], part: usize) -> Vec<Frame> {
    let mut decoder = Decoder::new();
    let mut frames = Vec::new();
    for part in stream.chunks(part) {
        decoder.input().extend_from_slice(part);
        while let Some(frame) = decoder.next_frame().expect("a sound stream") {
            frames.push(frame);
        }
    }
    assert_eq!(decoder.buffered(), 0, "it ends with a message");
    frames
}

/// Our encoding: the version octet once.
fn encode(frames: &[Frame]) -> Bytes {
    let mut stream = BytesMut::new();
    for frame in frames {
        let encoded = jtcp::encode(frame).unwrap();
        stream.extend_from_slice(&encoded[usize::from(!stream.is_empty())..]);
    }
    stream.freeze()
}

/// The frames of each stream of a capture; every segmentation gives the same.
fn frames(file: &Path) -> Vec<(Vec<u8>, Vec<Frame>)> {
    let read = |stream: Vec<u8>| {
        let frames = decode(&stream, usize::MAX);
        for part in [1, 7, 1460] {
            assert_eq!(decode(&stream, part), frames, "cut every {part}");
        }
        (stream, frames)
    };
    streams(file).into_values().map(read).collect()
}

#[test]
fn juniors_streams_are_written_octet_for_octet() {
    let captures = evidence::captures();
    for (file, count) in [
        ("junior/13-jtcp.pcap", vec![8, 8]),
        ("junior/14-jtcp-64KB.pcap", vec![18]),
    ] {
        let streams = frames(&captures.join(file));
        let counts: Vec<_> = streams.iter().map(|(_, frames)| frames.len()).collect();
        assert_eq!(counts, count, "{file}");
        for (stream, frames) in streams {
            assert!(encode(&frames) == stream, "{file}");
        }
    }
}

#[test]
fn juniors_64_kb_come_in_17_parts() {
    let captures = evidence::captures();
    let (_, frames) = frames(&captures.join("junior/14-jtcp-64KB.pcap")).remove(0);
    let parts: Vec<_> = frames
        .iter()
        .filter(|f| f.flags.data() != DataControl::Single)
        .collect();
    let length: usize = parts.iter().map(|frame| frame.payload.len()).sum();
    assert_eq!((parts.len(), length), (17, 65_536));
}

/// JAUS++ writes the version octet before each message, our side only at the beginning. There is no
/// other difference.
#[test]
fn jausplusplus_streams_differ_by_their_version_octets() {
    let captures = evidence::captures();
    let mut messages = 0;
    for (stream, frames) in frames(&captures.join("jauspp/06-jtcp.pcap")) {
        let each: Vec<_> = frames
            .iter()
            .map(|frame| jtcp::encode(frame).unwrap())
            .collect();
        assert!(each.concat() == stream);
        assert_eq!(encode(&frames).len(), stream.len() - (frames.len() - 1));
        messages += frames.len();
    }
    assert!(messages > 20, "{messages}");
}
