//! The encoding of messages, compared with octets that Python's cyclonedds wrote
//! (`tests/network/samples.py --golden`), and with those of an encoder of the tests.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

mod arbitrary;
mod samples;

use jaus_ros2::cdr::{self, LONGEST};
use jaus_ros2::{Interfaces, Message};
use proptest::prelude::*;

use arbitrary::{everything, interface, message_of};

/// The lines of the file: name, byte order, octets.
fn golden() -> Vec<(&'static str, &'static str, Vec<u8>)> {
    let lines = include_str!("golden/cdr.txt").lines().map(|line| {
        let mut words = line.split(' ');
        let mut word = || words.next().unwrap();
        (word(), word(), octets(word()))
    });
    lines.collect()
}

fn octets(hex: &str) -> Vec<u8> {
    let pairs = hex.as_bytes().chunks(2);
    let octet = |pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    pairs.map(octet).collect()
}

#[test]
fn messages_are_encoded_as_cyclonedds_encodes_them() {
    let samples = samples::all();
    let little: Vec<_> = golden().into_iter().filter(|it| it.1 == "little").collect();
    assert_eq!(little.len(), samples.len());
    for (name, _, octets) in little {
        let sample = samples
            .iter()
            .find(|it| it.interface().name().to_string() == name);
        assert_eq!(cdr::encode(sample.unwrap()), octets, "{name}");
    }
}

#[test]
fn messages_of_cyclonedds_are_decoded_in_both_byte_orders() {
    let samples = samples::all();
    for (name, order, octets) in golden() {
        let sample = samples
            .iter()
            .find(|it| it.interface().name().to_string() == name);
        let decoded = cdr::decode(sample.unwrap().interface(), &octets).unwrap();
        assert_eq!(&decoded, sample.unwrap(), "{name} {order}");
    }
}

#[test]
fn a_message_that_ends_early_is_refused_at_every_length() {
    for (name, order, octets) in golden() {
        let interface = Interfaces::bundled().unwrap().get(name).unwrap();
        for length in 0..octets.len() {
            let error = cdr::decode(&interface, &octets[..length]).unwrap_err();
            assert!(
                error.offset <= octets.len(),
                "{name} {order} {length}: {error}"
            );
        }
        let padded = [&octets[..], &[0; 7]].concat();
        cdr::decode(&interface, &padded).unwrap();
        let longer = [&octets[..], &[0; 8]].concat();
        let error = cdr::decode(&interface, &longer).unwrap_err().to_string();
        assert!(error.contains("8 octets follow"), "{error}");
    }
}

#[test]
fn what_the_type_does_not_allow_is_refused_with_its_path() {
    for (text, hex, part) in [
        (
            "bool a",
            "0001000002",
            "`a`: octet 5: 2 is not a truth value",
        ),
        (
            "string a",
            "00010000020000006161",
            "`a`: octet 10: the text does not end",
        ),
        (
            "string a",
            "0001000003000000610000",
            "does not end with its only NUL",
        ),
        ("string a", "0001000002000000ff00", "is not UTF-8"),
        (
            "string<=1 a",
            "000100000300000061610000",
            "2 octets, which are too many",
        ),
        (
            "string a",
            "00010000ffffffff",
            "4294967295 octets are needed, and 0 are left",
        ),
        (
            "uint8[<=2] a",
            "0001000003000000010203",
            "3 elements, and at most 2",
        ),
        (
            "uint8[] a",
            "00010000ffffff7f",
            "elements do not fit in 0 octets",
        ),
        (
            "std_msgs/Empty[] a",
            "00010000ffffff7f00",
            "elements do not fit in 1 octets",
        ),
        (
            "std_msgs/Bool[] a",
            "00010000020000000102",
            "`a[1].data`: octet 10: 2 is not",
        ),
        (
            "std_msgs/Bool a",
            "0001000002",
            "`a.data`: octet 5: 2 is not",
        ),
        (
            "bool a",
            "0003000001",
            "the encoding 00 03 is not plain CDR",
        ),
        (
            "bool a",
            "0007000001",
            "the encoding 00 07 is not plain CDR",
        ),
        ("bool a", "0001", "there is no header"),
    ] {
        let error = cdr::decode(&interface(text), &octets(hex))
            .unwrap_err()
            .to_string();
        assert!(error.contains(part), "{text}: {error}");
        assert!(error.starts_with("test_msgs/msg/Test: "), "{error}");
    }
    let error = cdr::decode(&interface("uint8[] a"), &vec![0; LONGEST + 1]).unwrap_err();
    assert!(error.reason.contains("are more than"), "{error}");
}

#[test]
fn a_text_without_its_nul_is_empty() {
    let message = cdr::decode(&interface("string a"), &octets("0001000000000000")).unwrap();
    assert_eq!(message.text("a"), Ok(""));
}

#[test]
fn numbers_after_an_empty_sequence_are_aligned_where_they_are() {
    let interface = interface("float64[] a\nuint8 b\nuint16 c\nstd_msgs/Empty d\nuint64 e");
    let mut message = Message::new(&interface);
    for (field, value) in [("b", 1), ("c", 2), ("e", 3)] {
        message.set(field, value).unwrap();
    }
    let expected = "00010000 00000000 01 00 0200 00 00000000000000 0300000000000000";
    assert_eq!(cdr::encode(&message), octets(&expected.replace(' ', "")));
}

#[test]
fn only_plain_cdr_is_read_in_either_byte_order_and_its_options_do_not_matter() {
    let interface = interface("uint8 a");
    let message = |header: [u8; 4]| [&header[..], &[7]].concat();
    for [first, second] in (0..=u16::MAX).map(u16::to_be_bytes) {
        let is_plain = matches!([first, second], [0, 0 | 1]);
        let decoded = cdr::decode(&interface, &message([first, second, 0, 0]));
        assert_eq!(decoded.is_ok(), is_plain, "{first:02x} {second:02x}");
    }
    for [first, second] in (0..=u16::MAX).map(u16::to_be_bytes) {
        let decoded = cdr::decode(&interface, &message([0, 1, first, second]));
        assert_eq!(decoded.unwrap().float("a"), Ok(7.0));
    }
}

proptest! {
    #[test]
    fn a_message_is_encoded_as_by_another_encoder_and_decoded_in_both_byte_orders(
        message in message_of(&everything()),
    ) {
        let ours = cdr::encode(&message);
        let (little, _) = arbitrary::encode(&message, true);
        prop_assert_eq!(&ours, &little);
        let (big, _) = arbitrary::encode(&message, false);
        for octets in [little, big] {
            let decoded = cdr::decode(message.interface(), &octets).unwrap();
            // NaN differs from itself; its octets do not.
            prop_assert_eq!(&cdr::encode(&decoded), &ours);
        }
    }
}
