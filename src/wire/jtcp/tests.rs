//! Streams recorded from Junior and JAUS++, split at every octet, and streams out of step.

use bytes::{Bytes, BytesMut};
use proptest::prelude::*;

use super::*;
use crate::address::JausId;
use crate::wire::tests::{any_frame, hex};
use crate::wire::{Flags, Problem};

/// Junior to 2.1.1, after the version octet.
const JUNIOR: &str = "00 1e00 01 01010200 01010100 014b 00000000 78787878787878787878 0100";
/// JAUS++: 101.1.1 asks 102.1.1 for its identification, for its configuration.
const JAUSPP: [&str; 2] = [
    "00 1100 01 01016600 01016500 002b02 0100",
    "00 1100 01 01016600 01016500 012b02 0200",
];

fn decode_in_parts<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> Result<Vec<Frame>, String> {
    let mut decoder = Decoder::new();
    let mut frames = Vec::new();
    for part in parts {
        decoder.input().extend_from_slice(part);
        while let Some(frame) = decoder.next_frame().map_err(|error| error.to_string())? {
            frames.push(frame);
        }
    }
    Ok(frames)
}

fn decode(stream: &str) -> Result<Vec<Frame>, String> {
    let stream = hex(stream);
    let at_once = decode_in_parts([&stream[..]]);
    assert_eq!(decode_in_parts(stream.chunks(1)), at_once, "one at a time");
    at_once
}

fn error(stream: &str) -> String {
    decode(stream).unwrap_err()
}

#[test]
fn one_version_octet_for_the_whole_connection_is_read() {
    let frames = decode(&format!("02 {JUNIOR} {JUNIOR} {JUNIOR}")).unwrap();
    assert_eq!(frames.len(), 3);
    assert_eq!(frames[0].payload.len(), 16);
    assert_eq!((frames[2].code(), frames[2].sequence), (Some(0x4B01), 1));
}

#[test]
fn a_version_octet_before_each_message_is_read() {
    let [first, second] = JAUSPP;
    let frames = decode(&format!("02 {first} 02 {second} {second} 02 {first}")).unwrap();
    let numbers: Vec<_> = frames.iter().map(|frame| frame.sequence).collect();
    assert_eq!(numbers, [1, 2, 2, 1]);
}

#[test]
fn a_version_octet_is_told_of_the_message_that_it_stands_before() {
    let [first, second] = JAUSPP;
    let stream = hex(&format!("02 {first} 02 {second} {second} 02 {first}"));
    for size in [stream.len(), 1, 7] {
        let mut decoder = Decoder::new();
        let mut told = Vec::new();
        for part in stream.chunks(size) {
            decoder.input().extend_from_slice(part);
            while decoder.next_frame().unwrap().is_some() {
                told.push(decoder.repeats_version());
            }
        }
        assert_eq!(told, [false, true, false, true], "in parts of {size}");
    }
}

#[test]
fn a_message_of_the_reserved_type_2_is_no_version_octet() {
    let reserved = "02 1100 01 01016600 01016500 002b02 0700";
    let frames = decode(&format!("02 {reserved} {} 02 {}", JAUSPP[0], JAUSPP[1])).unwrap();
    let found: Vec<_> = frames.iter().map(|f| (f.kind.0, f.sequence)).collect();
    assert_eq!(found, [(2, 7), (0, 1), (0, 2)]);
}

#[test]
fn header_compression_fields_are_read_past() {
    let offered = "40 1300 aa0c 01 01010200 01010100 002b02 0500";
    let frames = decode(&format!("02 {offered} 02 {offered} {}", JAUSPP[0])).unwrap();
    assert_eq!(frames.len(), 3);
    assert_eq!(
        (frames[1].payload.clone(), frames[1].sequence),
        (hex("002b02"), 5)
    );
}

#[test]
fn a_stream_of_the_first_edition_is_read_and_written() {
    let message = "0020 1602 014b 01010200 01010100 1000 0100 78787878787878787878787878787878";
    let frames = decode(&format!("01 {message} {message}")).unwrap();
    assert_eq!(frames.len(), 2);
    assert_eq!(
        (frames[1].version, frames[1].code()),
        (Version::As5669, Some(0x4B01))
    );
    assert_eq!(encode(&frames[1]).unwrap(), hex(&format!("01 {message}")));
}

#[test]
fn what_is_written_begins_with_the_version_octet_that_a_connection_leaves_out() {
    let frame = decode(&format!("02 {JUNIOR}")).unwrap().remove(0);
    let encoded = encode(&frame).unwrap();
    assert_eq!(encoded, hex(&format!("02 {JUNIOR}")));
    let ra = Frame {
        version: Version::Ra,
        ..frame
    };
    assert_eq!(encode(&ra), Err(EncodeError::DatagramsOnly));
}

#[test]
fn what_cannot_be_is_said_with_its_place_in_the_stream() {
    assert_eq!(
        error("00 1100"),
        "octet 0: no JAUS transport starts with 00h (AS5669A: 02h, AS5669: 01h, RA: \"JAUS01.0\")"
    );
    assert_eq!(
        error(&format!("02 {JUNIOR} 00 0d00")),
        "octet 31: the data size 13 is less than the 14 octets of a message without payload"
    );
    assert_eq!(
        error("02 40 0f00"),
        "octet 1: the data size 15 is less than the 16 octets of a message without payload"
    );
    assert_eq!(
        error("01 2000 1602 014b 01010200 01010100 1000 0100"),
        "octet 1: the size field says 8192 octets, but the header after it 32"
    );
    assert_eq!(
        error("01 0010 1602 014b 01010200 01010100 0030 0100"),
        "octet 1: the data control 3 is not defined (0 single, 1 first, 2 or 4 middle, 8 last)"
    );
}

#[test]
fn after_an_error_there_is_nothing_but_the_error() {
    let mut decoder = Decoder::new();
    decoder
        .input()
        .extend_from_slice(&hex(&format!("03 {JUNIOR}")));
    let error = decoder.next_frame().unwrap_err();
    assert_eq!(error.problem, Problem::UnknownVersion(3));
    decoder
        .input()
        .extend_from_slice(&hex(&format!("02 {JUNIOR}")));
    assert_eq!(decoder.next_frame(), Err(error));
}

#[test]
fn no_more_than_one_unfinished_message_waits() {
    let longest = Frame {
        flags: Flags(1),
        ..Frame::new(
            JausId::new(1, 1, 1),
            JausId::new(2, 1, 1),
            Bytes::from(vec![7; as5669a::MAX_PAYLOAD]),
        )
    };
    let message = encode(&longest).unwrap();
    let mut decoder = Decoder::new();
    for part in message.chunks(1000) {
        assert_eq!(decoder.next_frame(), Ok(None));
        decoder.input().extend_from_slice(part);
        assert!(decoder.buffered() <= 0xFFFF && decoder.input().capacity() <= 3 * 0x10000);
    }
    assert_eq!(decoder.next_frame(), Ok(Some(longest)));
    assert_eq!(decoder.buffered(), 0);
}

#[test]
fn an_idle_connection_releases_its_buffer_and_no_unfinished_message() {
    let mut decoder = Decoder::new();
    decoder.input().extend_from_slice(&hex("02 00 1e"));
    assert_eq!(decoder.next_frame(), Ok(None));
    decoder.release();
    assert_eq!(decoder.buffered(), 2);
    decoder.input().clear();
    decoder.release();
    assert_eq!((decoder.buffered(), decoder.input().capacity()), (0, 0));
}

#[test]
fn a_small_payload_does_not_hold_on_to_the_buffer() {
    let mut decoder = Decoder::new();
    decoder
        .input()
        .extend_from_slice(&hex(&format!("02 {JUNIOR}")));
    let buffer = decoder.input().as_ptr_range();
    let frame = decoder.next_frame().unwrap().unwrap();
    assert!(!buffer.contains(&frame.payload.as_ptr()));
}

/// A stream of one version, with the version octet at the beginning and where `before` says.
fn stream_of(frames: &[Frame], before: &[bool]) -> BytesMut {
    let mut stream = BytesMut::new();
    for (index, frame) in frames.iter().enumerate() {
        let encoded = encode(frame).unwrap();
        let octet_wanted = index == 0 || before.get(index) == Some(&true);
        stream.extend_from_slice(&encoded[usize::from(!octet_wanted)..]);
    }
    stream
}

fn any_stream() -> impl Strategy<Value = (Vec<Frame>, BytesMut)> {
    let as5669a = (
        prop::collection::vec(any_frame(Version::As5669a), 1..8),
        prop::collection::vec(any::<bool>(), 8),
    );
    let as5669 = prop::collection::vec(any_frame(Version::As5669), 1..8);
    prop_oneof![
        as5669a.prop_map(|(frames, before)| {
            let stream = stream_of(&frames, &before);
            (frames, stream)
        }),
        as5669.prop_map(|frames| {
            let stream = stream_of(&frames, &[]);
            (frames, stream)
        }),
    ]
}

proptest! {
    #[test]
    fn frames_come_through_a_stream_however_it_is_cut(
        (frames, stream) in any_stream(),
        cuts in prop::collection::vec(any::<prop::sample::Index>(), 0..20),
    ) {
        let mut cuts: Vec<_> = cuts.iter().map(|cut| cut.index(stream.len())).collect();
        cuts.extend([0, stream.len()]);
        cuts.sort_unstable();
        let parts = cuts.windows(2).map(|cut| &stream[cut[0]..cut[1]]);
        prop_assert_eq!(decode_in_parts(parts), Ok(frames));
    }

    #[test]
    fn any_octets_give_the_same_however_they_are_cut(
        start in prop_oneof![Just(vec![2]), Just(vec![1]), Just(vec![])],
        octets in prop::collection::vec(prop_oneof![3 => 0_u8..4, 1 => 14_u8..40, 1 => any::<u8>()], 0..300),
        part in 1_usize..30,
    ) {
        let stream = [start, octets].concat();
        let at_once = decode_in_parts([&stream[..]]);
        prop_assert_eq!(decode_in_parts(stream.chunks(part)), at_once);
    }
}
