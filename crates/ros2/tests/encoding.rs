//! The encoding of messages, compared with octets that Python's cyclonedds wrote
//! (`tests/network/samples.py --golden`), and with itself.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

mod samples;

use std::sync::Arc;

use jaus_ros2::cdr::{self, LONGEST};
use jaus_ros2::interface::{Field, Kind, Primitive, Size};
use jaus_ros2::{Interface, Interfaces, Message, Value};
use proptest::prelude::*;
use proptest::strategy::{BoxedStrategy, Just};

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

fn interface(text: &str) -> Arc<Interface> {
    let mut interfaces = Interfaces::bundled().unwrap();
    interfaces.add("test_msgs/Test", text).unwrap();
    interfaces.get("test_msgs/Test").unwrap()
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

/// A random value of a type.
fn value_of(kind: &Kind) -> BoxedStrategy<Value> {
    match kind {
        Kind::Primitive(primitive) => number_of(*primitive),
        Kind::String { most } => {
            let most = most.unwrap_or(12).min(12);
            let text = "[a-zé]{0,12}".prop_filter("too long", move |text| text.len() <= most);
            text.prop_map(Value::String).boxed()
        }
        Kind::Message(nested) => message_of(nested),
    }
}

fn number_of(primitive: Primitive) -> BoxedStrategy<Value> {
    match primitive {
        Primitive::Bool => any::<bool>().prop_map(Value::from).boxed(),
        Primitive::Byte | Primitive::Uint8 => any::<u8>().prop_map(Value::from).boxed(),
        Primitive::Int8 => any::<i8>().prop_map(Value::from).boxed(),
        Primitive::Int16 => any::<i16>().prop_map(Value::from).boxed(),
        Primitive::Uint16 => any::<u16>().prop_map(Value::from).boxed(),
        Primitive::Int32 => any::<i32>().prop_map(Value::from).boxed(),
        Primitive::Uint32 => any::<u32>().prop_map(Value::from).boxed(),
        Primitive::Int64 => any::<i64>().prop_map(Value::from).boxed(),
        Primitive::Uint64 => any::<u64>().prop_map(Value::from).boxed(),
        Primitive::Float32 => any::<f32>().prop_map(Value::from).boxed(),
        Primitive::Float64 => any::<f64>().prop_map(Value::from).boxed(),
    }
}

fn field_of(field: &Field) -> BoxedStrategy<Value> {
    let count = match field.size {
        Size::One => return value_of(&field.kind),
        Size::Fixed(count) => count..=count,
        Size::AtMost(most) => 0..=most.min(4),
        Size::Any => 0..=4,
    };
    let elements = prop::collection::vec(value_of(&field.kind), count);
    elements.prop_map(Value::Sequence).boxed()
}

fn message_of(interface: &Interface) -> BoxedStrategy<Value> {
    let fields = interface.fields().iter();
    let none = Just(Vec::new()).boxed();
    let fields = fields.fold(none, |before: BoxedStrategy<Vec<Value>>, field| {
        let pair = (before, field_of(field));
        pair.prop_map(|(mut before, value)| {
            before.push(value);
            before
        })
        .boxed()
    });
    fields.prop_map(Value::Message).boxed()
}

/// Every kind of field, and the bundled types within it.
fn everything() -> Arc<Interface> {
    interface(
        "bool a\nint64 b\nbyte c\nuint16[3] d\nstring<=9 e\nfloat32[] f\nint8 g\nuint64[<=3] h\n\
         string[2] i\ndiagnostic_msgs/DiagnosticArray j\nint32 k\nstd_msgs/Empty[<=2] l\nfloat64 m\n\
         nav_msgs/Odometry n\ntf2_msgs/TFMessage[] o\nuint32 p\nint16 q\nsensor_msgs/BatteryState r",
    )
}

proptest! {
    #[test]
    fn what_is_encoded_is_decoded(value in message_of(&everything())) {
        let message = Message::from_value(&everything(), value).unwrap();
        let octets = cdr::encode(&message);
        let again = cdr::decode(message.interface(), &octets).unwrap();
        // NaN differs from itself; its octets do not.
        prop_assert_eq!(cdr::encode(&again), octets);
    }

    #[test]
    fn no_octets_panic(mut octets in prop::collection::vec(any::<u8>(), 4..400), little in any::<bool>()) {
        octets[..2].copy_from_slice(&[0, little.into()]);
        let _ = cdr::decode(&everything(), &octets);
        let _ = cdr::decode(&interface("std_msgs/Empty[] a\nstring[] b\nuint8[] c"), &octets);
    }

    #[test]
    fn no_changed_message_panics(
        value in message_of(&everything()),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let message = Message::from_value(&everything(), value).unwrap();
        let mut octets = cdr::encode(&message);
        for (index, octet) in changes {
            let at = index.index(octets.len());
            octets[at] = octet;
        }
        let _ = cdr::decode(message.interface(), &octets);
    }
}
