//! For every generated message: what is encoded decodes to the same, what is accepted encodes to
//! the same, and no octets whatever make the decoder panic. New messages are covered by being in
//! the registry.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test fails by panicking"
)]

use bytes::Bytes;
use jaus::codec::arbitrary::Unstructured;
use jaus::codec::{AnyMessage, MessageInfo};
use jaus::messages::registry;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

/// Octets that a random message is made from.
fn seed() -> impl Strategy<Value = Vec<u8>> {
    prop::collection::vec(any::<u8>(), 0..400)
}

fn for_every_message<S: Strategy>(
    strategy: &S,
    property: impl Fn(&MessageInfo, S::Value) -> Result<(), TestCaseError>,
) {
    for info in registry().iter() {
        let mut runner = TestRunner::new(ProptestConfig::with_cases(48));
        let outcome = runner.run(strategy, |value| property(info, value));
        if let Err(failure) = outcome {
            panic!("{info:?}: {failure}");
        }
    }
}

fn message(info: &MessageInfo, seed: &[u8]) -> Box<dyn AnyMessage> {
    (info.arbitrary)(&mut Unstructured::new(seed)).unwrap()
}

/// What the decoder accepts encodes to the same octets.
fn accepted_octets_come_back(info: &MessageInfo, octets: &Bytes) -> Result<(), TestCaseError> {
    match (info.decode)(octets) {
        Ok(message) => prop_assert_eq!(&message.encode().unwrap(), octets),
        Err(error) => {
            prop_assert!(error.offset() <= octets.len());
            prop_assert_eq!(error.message(), Some(info.name));
            prop_assert!(error.to_string().starts_with(info.name));
        }
    }
    Ok(())
}

#[test]
fn what_is_encoded_decodes_to_the_same() {
    for_every_message(&seed(), |info, seed| {
        let message = message(info, &seed);
        let octets = message.encode().unwrap();
        let decoded = (info.decode)(&octets).map_err(|e| TestCaseError::fail(e.to_string()))?;
        prop_assert!(*decoded == *message, "{decoded:?} instead of {message:?}");
        Ok(())
    });
}

#[test]
fn any_octets_are_refused_or_come_back() {
    for_every_message(&seed(), |info, tail| {
        let octets = [&info.code.to_le_bytes()[..], &tail].concat();
        accepted_octets_come_back(info, &octets.into())
    });
}

#[test]
fn damaged_messages_are_refused_or_come_back() {
    let damage = (
        seed(),
        any::<prop::sample::Index>(),
        any::<u8>(),
        any::<bool>(),
    );
    for_every_message(&damage, |info, (seed, place, octet, cut)| {
        let mut octets = Vec::from(message(info, &seed).encode().unwrap());
        let place = place.index(octets.len());
        if cut {
            octets.truncate(place);
        } else {
            octets[place] = octet;
        }
        accepted_octets_come_back(info, &octets.into())
    });
}

#[cfg(feature = "serde")]
#[test]
fn what_people_read_is_what_they_may_write() {
    for_every_message(&seed(), |info, seed| {
        let message = message(info, &seed);
        let text = serde_json::to_string(&*message).unwrap();
        let value = serde_json::from_str(&text).unwrap();
        let read = (info.from_view)(&value).map_err(|e| TestCaseError::fail(e.to_string()))?;
        prop_assert!(*read == *message, "{text}: {read:?} instead of {message:?}");
        Ok(())
    });
}
