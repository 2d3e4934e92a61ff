//! Values of messages, beside the files of their types.

use std::collections::BTreeSet;

use jaus_test_kit::evidence;
use jsidl::Library;
use jsidl::dynamic::{self, arbitrary, decode, encode};
use jsidl::model::{Id, Message, Service};
use jsidl::ros::{Package, PackageName, Value};

use super::definitions::{constructs, interfaces, made, package};
use super::interfaces::{Count, Field, Interfaces};
use crate::support::{self, catalogue, golden};

/// Requires that a value has the fields of its type.
fn agree(interfaces: &Interfaces, name: &str, value: &Value) {
    let Value::Message(values) = value else {
        panic!("{name}: {value:?}");
    };
    let fields = &interfaces[name];
    assert_eq!(fields.len(), values.len(), "{name}: {value:?}");
    for (field, value) in fields.iter().zip(values) {
        assert!(
            fits(interfaces, field, value),
            "{name}: {field:?}: {value:?}"
        );
    }
}

fn fits(interfaces: &Interfaces, field: &Field, value: &Value) -> bool {
    let has_length = |length: usize| match field.count {
        Count::One => false,
        Count::Any => true,
        Count::AtMost(most) => length <= most,
        Count::Exactly(number) => length == number,
    };
    match value {
        Value::Sequence(values) => {
            let fits = |value| fits_one(interfaces, &field.ty, value);
            has_length(values.len()) && values.iter().all(fits)
        }
        value => field.count == Count::One && fits_one(interfaces, &field.ty, value),
    }
}

fn fits_one(interfaces: &Interfaces, ty: &str, value: &Value) -> bool {
    match (ty, value) {
        ("bool", Value::Bool(_)) | ("float64", Value::Float(_)) => true,
        ("uint8", Value::Unsigned(number)) => u8::try_from(*number).is_ok(),
        ("uint16", Value::Unsigned(number)) => u16::try_from(*number).is_ok(),
        ("uint32", Value::Unsigned(number)) => u32::try_from(*number).is_ok(),
        ("uint64", Value::Unsigned(_)) | ("int64", Value::Signed(_)) => true,
        ("int8", Value::Signed(number)) => i8::try_from(*number).is_ok(),
        ("int16", Value::Signed(number)) => i16::try_from(*number).is_ok(),
        ("int32", Value::Signed(number)) => i32::try_from(*number).is_ok(),
        ("float32", Value::Float(number)) => {
            number.is_nan() || f64::from(*number as f32) == *number
        }
        ("string", Value::String(text)) => !text.contains('\0'),
        (name, Value::Message(_)) => {
            agree(interfaces, name, value);
            true
        }
        _ => false,
    }
}

/// The value of a decoded message, which must have the fields of its type.
fn converted(
    package: &Package,
    interfaces: &Interfaces,
    (service, message): (&Id, &Message),
    value: &dynamic::Value,
) -> Value {
    let interface = package.interface(service, message).unwrap();
    let value = interface.value(value).unwrap();
    agree(interfaces, interface.name(), &value);
    value
}

#[test]
fn every_golden_message_has_the_fields_of_its_type() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    let mut vectors = 0;
    for (source, rows) in golden::sources() {
        let library = golden::load(&corpus, &source);
        let ids: BTreeSet<_> = rows.iter().map(golden::id_of).collect();
        let wanted = |service: &Service| ids.contains(&service.id);
        let package = Package::of(&library, wanted, &PackageName::default());
        let interfaces = interfaces(&package);
        for row in &rows {
            let (id, message) = (golden::id_of(row), golden::message_of(&library, row));
            let value = decode(message, &golden::octets_of(&row["hex"])).unwrap();
            converted(&package, &interfaces, (&id, message), &value);
            vectors += 1;
        }
    }
    println!("{vectors} vectors");
    assert!(vectors > 2000, "the golden data have 2116 vectors");
}

/// Converts messages and each of them with single bits changed: another message has another value,
/// unless the text says otherwise.
fn is_lossless(library: &Library, each: u64) -> usize {
    let package = package(library);
    let interfaces = interfaces(&package);
    let mut compared = 0;
    for service in library.services() {
        for message in service.messages() {
            for seed in 0..each {
                let octets = entropy(seed << 16 | u64::from(message.code));
                // Some definitions of the tests cannot be satisfied.
                let Ok(octets) = encode(message, &arbitrary(message, &octets)) else {
                    continue;
                };
                let mut seen = BTreeSet::new();
                for octets in changed(&octets) {
                    let Ok(value) = decode(message, &octets) else {
                        continue;
                    };
                    let declared = (&service.id, message.as_ref());
                    let value = converted(&package, &interfaces, declared, &value);
                    // Distinguishes the signs of zeros.
                    let value = format!("{value:?}");
                    if !value.contains("NaN") && !value.contains("\u{FFFD}") {
                        assert!(seen.insert(value.clone()), "{}: {value}", message.name);
                        compared += 1;
                    }
                }
            }
        }
    }
    compared
}

/// The octets, and with one bit changed in each of some octets.
fn changed(octets: &[u8]) -> impl Iterator<Item = Vec<u8>> {
    let places = (2..octets.len()).step_by(octets.len().div_ceil(16).max(1));
    let changed = places.map(|place| {
        let mut changed = octets.to_vec();
        changed[place] ^= 1 << (place % 8);
        changed
    });
    std::iter::once(octets.to_vec()).chain(changed)
}

/// Reproducible pseudorandom octets (an xorshift generator).
fn entropy(seed: u64) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut octet = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state.to_le_bytes()[3]
    };
    (0..200).map(|_| octet()).collect()
}

#[test]
fn different_messages_have_different_values() {
    let compared = is_lossless(&catalogue(), 1) + is_lossless(&constructs(), 4);
    let compared = compared + is_lossless(&made(), 20);
    println!("{compared} messages");
    assert!(compared > 5000, "{compared}");
}

/// The value of a built-in message.
fn built_in(code: u16, octets: &[u8]) -> Value {
    let library = catalogue();
    let package = package(&library);
    let (service, message) = library.by_code(code).last().unwrap();
    let octets = [&code.to_le_bytes(), octets].concat();
    let value = decode(message, &octets).unwrap();
    let interface = package.interface(&service.id, message).unwrap();
    interface.value(&value).unwrap()
}

fn one(value: Value) -> Value {
    Value::Sequence(vec![value])
}

fn none() -> Value {
    Value::Sequence(Vec::new())
}

#[test]
fn scaled_integers_are_in_their_units_and_absent_members_are_empty_sequences() {
    // ReportGlobalPose: latitude, longitude and the time stamp 23:59:58.999 of the 31st.
    let stamp: u32 = 31 << 27 | 23 << 22 | 59 << 16 | 58 << 10 | 999;
    let mut octets = vec![0x03, 0x01];
    octets.extend(u32::MAX.to_le_bytes());
    octets.extend(0_u32.to_le_bytes());
    octets.extend(stamp.to_le_bytes());
    let parts = [999, 58, 59, 23, 31].map(Value::Unsigned);
    let expected = [
        one(Value::Float(90.0)),
        one(Value::Float(-180.0)),
        none(),
        none(),
        none(),
        none(),
        none(),
        none(),
        one(Value::Message(parts.to_vec())),
    ];
    assert_eq!(built_in(0x4402, &octets), Value::Message(expected.to_vec()));
}

#[test]
fn strings_are_text_and_an_empty_message_has_no_fields() {
    // ReportIdentification
    let octets = [4, 0x11, 0x27, 3, b'a', 0xFF, 0];
    let expected = [
        Value::Unsigned(4),
        Value::Unsigned(10001),
        Value::String("a\u{FFFD}\u{FFFD}".to_owned()),
    ];
    assert_eq!(built_in(0x4B00, &octets), Value::Message(expected.to_vec()));
    // QueryStatus
    assert_eq!(built_in(0x2002, &[]), Value::Message(Vec::new()));
}

#[test]
fn a_value_that_does_not_fit_is_an_error_with_the_path_of_the_field() {
    let library = catalogue();
    let package = package(&library);
    let (service, message) = library.by_code(0x4B00).next().unwrap();
    let interface = package.interface(&service.id, message).unwrap();
    let text = dynamic::Value::Text(Vec::new());
    let value = dynamic::Value::Group(vec![Some(text), None, None]);
    let error = interface.value(&value).unwrap_err().to_string();
    assert_eq!(
        error,
        "ReportIdentification: QueryType: a string, but the definition has a number"
    );
    let value = dynamic::Value::Group(Vec::new());
    let error = interface.value(&value).unwrap_err().to_string();
    assert_eq!(
        error,
        "ReportIdentification: 0 slots, but the definition has 3"
    );
}

#[test]
fn a_message_of_another_service_has_no_type() {
    let library = catalogue();
    let package = package(&library);
    let (service, _) = library.by_code(0x4B00).next().unwrap();
    let message = support::everything();
    assert!(package.interface(&service.id, &message).is_none());
}
