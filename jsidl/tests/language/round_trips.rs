//! Round trips of random octets and values through the dynamic codec, with hand-written, embedded
//! and public definitions: accepted input is reproduced exactly.

use std::collections::BTreeMap;

use crate::support::{emptiness, everything, framed};
use jaus_test_kit::evidence;
use jsidl::dynamic::{
    Limits, arbitrary, decode, decode_with, encode, encode_with, from_json, to_json,
};
use jsidl::model::Message;
use jsidl::{Library, Loader};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

/// Checks that octets are rejected, or encode back to themselves.
fn octets_come_back(message: &Message, octets: &[u8]) -> Result<(), TestCaseError> {
    for limits in [Limits::Enforced, Limits::Ignored] {
        if let Ok(value) = decode_with(message, octets, limits) {
            let again = encode_with(message, &value, limits);
            prop_assert_eq!(again.as_deref(), Ok(octets));
        }
    }
    Ok(())
}

/// Checks that a value survives encoding to octets and to JSON text.
fn values_come_back(message: &Message, entropy: &[u8]) -> Result<(), TestCaseError> {
    let value = arbitrary(message, entropy);
    let octets = encode(message, &value).unwrap();
    let decoded = decode(message, &octets);
    prop_assert_eq!(decoded.as_ref(), Ok(&value));
    let json = to_json(message, &value).unwrap();
    let text = json.to_string();
    let again = from_json(message, &serde_json::from_str(&text).unwrap()).unwrap();
    // A NaN has many bit patterns but one name.
    if !text.contains("\"NaN\"") {
        prop_assert_eq!(&again, &value);
    }
    prop_assert_eq!(to_json(message, &again).unwrap(), json);
    Ok(())
}

/// Random octets for the part after the message code; small values are more frequent.
fn body() -> impl Strategy<Value = Vec<u8>> {
    prop::collection::vec(prop_oneof![0_u8..4, any::<u8>()], 0..300)
}

/// Runs both checks on a message with `cases` random inputs.
fn check(message: &Message, cases: u32) {
    let config = ProptestConfig {
        cases,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let result = TestRunner::new(config).run(&body(), |body| {
        values_come_back(message, &body)?;
        // An encoded value with one octet changed reaches deeper than random octets.
        let mut octets = encode(message, &arbitrary(message, &body)).unwrap();
        let index = body
            .first()
            .map_or(0, |&first| usize::from(first) % octets.len());
        octets[index] ^= body.last().copied().unwrap_or(0);
        octets_come_back(message, &octets)?;
        octets_come_back(message, &[&message.code.to_le_bytes(), &body[..]].concat())?;
        octets_come_back(message, &body)
    });
    if let Err(error) = result {
        panic!("{} ({:04X}h): {error}", message.name, message.code);
    }
}

/// Runs both checks on every message, but only on one of those that share code and name, because
/// they seldom differ.
fn check_all(library: &Library, cases: u32) {
    let messages = library.services().flat_map(|service| service.messages());
    let unique: BTreeMap<_, _> = messages.map(|m| ((m.code, &m.name), m)).collect();
    for message in unique.values() {
        check(message, cases);
    }
    println!("{} messages, {cases} cases each", unique.len());
    assert!(unique.len() > 100, "only {} messages", unique.len());
}

#[test]
fn definitions_made_by_hand_round_trip() {
    for message in [everything(), emptiness(), framed()] {
        check(&message, 1000);
    }
}

#[test]
fn embedded_definitions_round_trip() {
    let mut loader = Loader::new();
    loader.catalogue();
    check_all(&loader.load().library, 16);
}

#[test]
fn public_definitions_round_trip() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    for family in ["jts", "fkie", "ffi"] {
        let mut loader = Loader::new();
        loader.path(corpus.join(family));
        check_all(&loader.load().library, 4);
    }
}
