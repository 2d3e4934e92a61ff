//! Packets recorded from Junior, between and within noise.

use bytes::Bytes;
use proptest::prelude::*;

use super::*;
use crate::address::JausId;
use crate::wire::tests::{any_frame, hex};

/// Junior to 2.1.1: AS5669A.
const PACKET: &str = "1001 02 1e00 1002 0a83 001e00 19 01010200 01010100 014b00000000 \
                      78787878787878787878 0100 1003 20e2";
/// The acknowledgement and another message, as received in one read.
const TWO: &str = "1001 02 0e00 1002 9b16 000e00 31 01010100 01010200 0100 1003 7c39 \
                   1001 02 1e00 1002 0a83 001e00 01 01010100 01010200 014b00000000 \
                   78787878787878787878 0100 1003 b0e8";
/// Junior: AS5669, with a DLE in the data size of its header.
const OLDER: &str = "1001 01 2400 1002 bc27 0000 2000 0602 014b 01010200 01010100 101000 0100 \
                     014b 7878787878787878787878787878 1003 97ea";

fn decode_in_parts<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> (Vec<Frame>, Counters) {
    let mut decoder = Decoder::new();
    let mut frames = Vec::new();
    for part in parts {
        decoder.push(part);
        frames.extend(std::iter::from_fn(|| decoder.next_frame()));
    }
    (frames, *decoder.counters())
}

fn decode(line: &[u8]) -> (Vec<Frame>, Counters) {
    let at_once = decode_in_parts([line]);
    assert_eq!(decode_in_parts(line.chunks(1)), at_once, "one at a time");
    at_once
}

fn sound(line: &[u8]) -> Vec<Frame> {
    let (frames, counters) = decode(line);
    let expected = Counters {
        packets: counters.packets,
        messages: frames.len() as u64,
        ..Counters::default()
    };
    assert_eq!(counters, expected, "nothing is wrong with this");
    frames
}

fn frame(payload: impl Into<Bytes>) -> Frame {
    Frame::new(JausId::new(1, 1, 1), JausId::new(2, 1, 1), payload.into())
}

#[test]
fn recorded_packets_are_read_and_written_again() {
    for (recorded, count) in [(PACKET, 1), (TWO, 2), (OLDER, 1)] {
        let frames = sound(&hex(recorded));
        assert_eq!(frames.len(), count);
        let written: Vec<_> = frames.iter().map(|frame| encode(frame).unwrap()).collect();
        assert_eq!(written.concat(), hex(recorded), "{recorded}");
    }
    let older = sound(&hex(OLDER)).remove(0);
    assert_eq!(
        (older.version, older.code()),
        (Version::As5669, Some(0x4B01))
    );
    assert_eq!(older.payload.len(), 18);
}

#[test]
fn every_octet_is_stuffed_where_it_means_itself() {
    // 2 + 14 octets make a length of 10h, in the header of both packet and message.
    let sixteen = encode(&frame(hex("1001"))).unwrap();
    assert_eq!(sixteen[..6], hex("1001 02 101000")[..]);
    assert_eq!(sound(&sixteen), [frame(hex("1001"))]);
    // Enough messages for a DLE to occur in every octet of both checksums.
    let any = (0..20_000_u16).map(|n| frame(n.to_be_bytes().to_vec()));
    for frame in any {
        assert_eq!(sound(&encode(&frame).unwrap()), [frame]);
    }
}

#[test]
fn several_messages_of_one_packet_are_read() {
    for older in [false, true] {
        let version = if older {
            Version::As5669
        } else {
            Version::As5669a
        };
        let frames: Vec<_> = (0..5_u8)
            .map(|n| Frame {
                version,
                ..frame(vec![n; usize::from(n) * 100 + 2])
            })
            .collect();
        let mut messages = BytesMut::new();
        for frame in &frames {
            if older {
                as5669::emit(frame, &mut messages).unwrap();
            } else {
                as5669a::emit(frame, &mut messages).unwrap();
            }
        }
        assert_eq!(sound(&packet_of(2 - u8::from(older), &messages)), frames);
    }
}

/// A packet with one message whose header holds an address.
fn addressed(address: &[u8]) -> BytesMut {
    let mut message = BytesMut::new();
    as5669a::emit(&frame(hex("0222")), &mut message).unwrap();
    let header = [&hex("02 1000"), address].concat();
    let mut check = CHECK.digest();
    check.update(&header);
    let header_check = check.clone().finalize().to_le_bytes();
    check.update(&header_check);
    check.update(&message);
    let mut packet = BytesMut::from(&[DLE, SOH][..]);
    stuff(&header, &mut packet);
    packet.put_slice(&[DLE, STX]);
    stuff(&header_check, &mut packet);
    stuff(&message, &mut packet);
    packet.put_slice(&[DLE, ETX]);
    stuff(&check.finalize().to_le_bytes(), &mut packet);
    packet
}

#[test]
fn an_address_of_two_octets_in_the_header_is_read_past_and_no_other() {
    for (address, is_read) in [("", true), ("aa", false), ("aabb", true), ("aabbcc", false)] {
        let (frames, counters) = decode(&addressed(&hex(address)));
        assert_eq!(frames == [frame(hex("0222"))], is_read, "{address}");
        assert_eq!(counters.bad_headers > 0, !is_read, "{address}");
    }
}

#[test]
fn what_is_wrong_is_counted() {
    let counted = |line: &str| {
        let (frames, counters) = decode(&hex(line));
        assert_eq!(frames, [], "{line}");
        assert_eq!(counters.packets, 0);
        counters
    };
    assert_eq!(
        counted("ff00 01 0210").rubbish_octets,
        4,
        "the last may begin a packet"
    );
    assert_eq!(counted(&PACKET.replace("0a83", "0a82")).bad_headers, 1);
    assert_eq!(
        counted(&PACKET.replace("1001 02", "1001 03")).bad_headers,
        1
    );
    assert_eq!(counted("1001 02 1e00 00 1002 0a83").bad_headers, 1);
    assert_eq!(counted("1001 02 1e00 00 00 00").bad_headers, 1);
    assert_eq!(counted(&PACKET.replace("20e2", "20e3")).bad_checksums, 1);
    assert_eq!(
        counted(&PACKET.replace("0100 1003", "01 1003")).bad_forms,
        1
    );
    assert_eq!(
        counted(&PACKET.replace("0100 1003", "010000 1003")).bad_forms,
        1
    );
    assert_eq!(
        counted(&PACKET.replace("7878 0100", "7810 7801 00")).bad_forms,
        1
    );
    assert_eq!(counted(&PACKET.replace("1003", "")).bad_forms, 1, "no end");

    let all = hex(&PACKET.replace("20e2", "20e3"));
    assert_eq!(decode(&all).1.rubbish_octets, all.len() as u64);
}

#[test]
fn a_packet_above_the_limit_is_counted_and_the_next_one_read() {
    let (long, short) = (frame(vec![3; 100]), frame(vec![3; 86]));
    let mut decoder = Decoder::with_limit(100);
    decoder.push(&[encode(&long).unwrap(), encode(&short).unwrap()].concat());
    assert_eq!(decoder.next_frame(), Some(short));
    assert_eq!(
        (decoder.counters().too_long, decoder.counters().packets),
        (1, 1)
    );
}

#[test]
fn a_message_that_does_not_fit_its_packet_costs_the_rest_of_the_packet() {
    let mut messages = BytesMut::new();
    as5669a::emit(&frame(hex("0222")), &mut messages).unwrap();
    messages.put_slice(&hex("00 ff00 01 01010200 01010100 0222 0000"));
    let (frames, counters) = decode(&packet_of(2, &messages));
    assert_eq!(frames, [frame(hex("0222"))]);
    assert_eq!((counters.packets, counters.malformed), (1, 1));
}

/// The cases in which noise could hide the beginning of a valid packet: it ends in a DLE, it looks
/// like a beginning, or it cuts a packet in the middle of a pair.
#[test]
fn noise_does_not_hide_the_next_packet() {
    let next = hex(PACKET);
    let long = encode(&frame(vec![0x10; 300])).unwrap();
    let cut = |at: usize| long[..at].to_vec();
    for noise in [
        hex("10").to_vec(),
        hex("1001").to_vec(),
        hex("1001 10").to_vec(),
        hex("1001 02 1e00 1002 0a83 10").to_vec(),
        hex("1001 02 1e00 10").to_vec(),
        hex("1010101010").to_vec(),
        // A false beginning within a false one, and within a packet that is cut off.
        hex("1001 55 10 1001 55 10").to_vec(),
        hex("1001 02 1e00 1002 0a83 10 1001 55 10").to_vec(),
        cut(100),
        cut(101),
        cut(long.len() - 1),
    ] {
        let (frames, counters) = decode(&[&noise[..], &next].concat());
        assert_eq!(frames, sound(&next), "{noise:02x?}");
        assert_eq!(counters.rubbish_octets, noise.len() as u64, "{noise:02x?}");
    }
}

/// Exhaustive: each octet of two packets is replaced by every other value. A 16-bit checksum
/// detects any single changed octet; a lost or added marker or stuffing octet breaks the form.
#[test]
fn no_flipped_octet_makes_another_message() {
    for recorded in [PACKET, OLDER] {
        let recorded = hex(recorded);
        let genuine = sound(&recorded);
        for place in 0..recorded.len() {
            for octet in 0..=u8::MAX {
                let mut flipped = recorded.to_vec();
                flipped[place] = octet;
                let (frames, _) = decode_in_parts([&flipped[..]]);
                assert!(
                    frames.is_empty() || frames == genuine,
                    "{octet:02X}h at {place}: {frames:?}"
                );
            }
        }
    }
}

/// Nested headers, each valid and announcing much content: the worst case for the search.
#[test]
fn nested_beginnings_do_not_multiply_the_work_or_the_memory() {
    let header = &packet_of(2, &[0; 60_000])[..9];
    let mut stuffed = BytesMut::new();
    stuff(header, &mut stuffed);
    let mut decoder = Decoder::new();
    decoder.push(header);
    for _ in 0..20_000 {
        decoder.push(&stuffed);
        assert_eq!(decoder.next_frame(), None);
        assert!(decoder.buffered() < 2 * 0x10000 + 64);
    }
    let counters = *decoder.counters();
    assert!(counters.bad_forms < 20_000, "{counters:?}");
}

#[test]
fn what_was_searched_once_is_not_searched_again_after_a_valid_header() {
    let header = "1001 02 1e00 1002 0a83";
    let cut_off = hex(&format!("{header} 10 {header} 00 00 00 00 1010 01 0000"));
    let (frames, counters) = decode(&[&cut_off[..], &hex(PACKET)].concat());
    assert_eq!(frames, sound(&hex(PACKET)));
    assert_eq!((counters.bad_forms, counters.bad_headers), (2, 0));
    assert_eq!(counters.rubbish_octets, cut_off.len() as u64);
}

#[test]
fn only_an_unfinished_packet_is_buffered() {
    let packet = hex(PACKET);
    let mut decoder = Decoder::new();
    decoder.push(&packet[..20]);
    assert_eq!((decoder.next_frame(), decoder.buffered()), (None, 20));
    decoder.push(&packet[20..]);
    assert!(decoder.next_frame().is_some());
    assert_eq!(decoder.buffered(), 0);
}

fn any_frames() -> impl Strategy<Value = Vec<Frame>> {
    let version = prop_oneof![Just(Version::As5669a), Just(Version::As5669)];
    prop::collection::vec(version.prop_flat_map(any_frame), 1..6)
}

/// Octets with a high share of those that are special on a line.
fn noise(most: usize) -> impl Strategy<Value = Vec<u8>> {
    let octet = prop_oneof![4 => Just(DLE), 2 => 1_u8..4, 2 => any::<u8>()];
    prop::collection::vec(octet, 0..most)
}

proptest! {
    #[test]
    fn frames_come_through_a_line_however_it_is_read(frames in any_frames(), part in 1_usize..50) {
        let line: Vec<_> = frames.iter().map(|frame| encode(frame).unwrap()).collect();
        let (read, counters) = decode_in_parts(line.concat().chunks(part));
        prop_assert_eq!(read, frames);
        prop_assert_eq!(counters.rubbish_octets, 0);
    }

    #[test]
    fn noise_between_packets_costs_none(frames in any_frames(), noise in prop::collection::vec(noise(12), 6)) {
        let parts = frames.iter().zip(&noise).map(|(frame, noise)| [noise, &encode(frame).unwrap()[..]].concat());
        let (read, _) = decode(&parts.collect::<Vec<_>>().concat());
        prop_assert_eq!(read, frames);
    }

    #[test]
    fn noise_within_a_packet_costs_only_that_packet(
        frames in any_frames(),
        hit in any::<prop::sample::Index>(),
        place in any::<prop::sample::Index>(),
        lost in 0_usize..20,
        noise in noise(20),
    ) {
        let hit = hit.index(frames.len());
        let mut packets: Vec<_> = frames.iter().map(|frame| encode(frame).unwrap().to_vec()).collect();
        let at = place.index(packets[hit].len());
        let end = (at + lost).min(packets[hit].len());
        packets[hit].splice(at..end, noise);
        let (read, _) = decode(&packets.concat());
        let mut expected = frames.clone();
        if read.len() < frames.len() {
            expected.remove(hit);
        }
        prop_assert_eq!(read, expected);
    }

    #[test]
    fn any_octets_give_the_same_however_they_are_read(line in noise(400), part in 1_usize..30) {
        prop_assert_eq!(decode_in_parts(line.chunks(part)), decode_in_parts([&line[..]]));
    }
}
