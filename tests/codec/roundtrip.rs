//! Round trips of every generated message: encoded messages decode to the same value, accepted
//! octets encode to the same octets, and no octets make the decoder panic. New messages are covered
//! by the registry. The generated codec and the dynamic one of `jsidl` agree in all cases.

use bytes::Bytes;
use jaus::codec::arbitrary::Unstructured;
use jaus::codec::{AnyMessage, MessageInfo, Registry};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

/// All messages of the service sets, and the constructs that no set uses.
fn every_message() -> impl Iterator<Item = &'static MessageInfo> {
    let constructs = Registry::new(crate::constructs::SETS);
    let registries = crate::generated().into_iter().chain([constructs]);
    registries.flat_map(|registry| registry.iter())
}

/// Octets from which a random message is created.
fn seed() -> impl Strategy<Value = Vec<u8>> {
    prop::collection::vec(any::<u8>(), 0..400)
}

fn for_every_message<S: Strategy>(
    strategy: &S,
    property: impl Fn(&MessageInfo, S::Value) -> Result<(), TestCaseError>,
) {
    for info in every_message() {
        let config = ProptestConfig {
            cases: 48,
            failure_persistence: None,
            ..Default::default()
        };
        let mut runner = TestRunner::new(config);
        let outcome = runner.run(strategy, |value| property(info, value));
        if let Err(failure) = outcome {
            panic!("{info:?}: {failure}");
        }
    }
}

fn message(info: &MessageInfo, seed: &[u8]) -> Box<dyn AnyMessage> {
    (info.arbitrary)(&mut Unstructured::new(seed)).unwrap()
}

/// Octets that the decoder accepts encode to the same octets.
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
mod people {
    use std::collections::HashMap;
    use std::path::Path;

    use jsidl::Loader;
    use jsidl::dynamic;
    use jsidl::model::Message;

    use super::*;

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

    /// The definitions of all messages, by service and code.
    fn definitions() -> HashMap<(String, u16), Message> {
        let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("jsidl/tests/rust");
        let mut loader = Loader::new();
        loader.catalogue().reference_architecture().path(directory);
        let loaded = loader.load();
        assert!(loaded.diagnostics.is_empty(), "{}", loaded.diagnostics);
        let mut definitions = HashMap::new();
        for service in loaded.library.services() {
            for message in service.messages() {
                let key = (service.id.to_string(), message.code);
                definitions.insert(key, message.as_ref().clone());
            }
        }
        definitions
    }

    #[test]
    fn the_generated_and_the_dynamic_codec_show_the_same_and_refuse_the_same() {
        let definitions = definitions();
        let damage = (seed(), any::<prop::sample::Index>(), any::<Option<u8>>());
        for_every_message(&damage, |info, (seed, place, damage)| {
            let mut octets = Vec::from(message(info, &seed).encode().unwrap());
            if let Some(octet) = damage {
                let place = place.index(octets.len());
                octets[place] = octet;
            }
            let definition = &definitions[&(info.services[0].to_string(), info.code)];
            let octets = Bytes::from(octets);
            let generated = (info.decode)(&octets);
            let dynamic = dynamic::decode(definition, &octets);
            match (generated, dynamic) {
                (Ok(generated), Ok(dynamic)) => {
                    let ours = serde_json::to_string(&*generated).unwrap();
                    let theirs = dynamic::to_json(definition, &dynamic).unwrap().to_string();
                    prop_assert_eq!(ours, theirs);
                }
                // If a list cannot fit, the generated codec reports it before the first element.
                (Err(generated), Err(dynamic)) => {
                    prop_assert!(
                        generated.offset() <= dynamic.offset,
                        "{generated}\n{dynamic}"
                    );
                }
                (Ok(_), Err(error)) => prop_assert!(
                    false,
                    "only the generated codec accepts it: \
                    {error}"
                ),
                (Err(error), Ok(_)) => prop_assert!(
                    false,
                    "only the dynamic codec accepts it: \
                    {error}"
                ),
            }
            Ok(())
        });
    }
}
