//! The generated codec against the dynamic one, which shares only the definitions: for every
//! generated message both accept and reject the same octets, show the same JSON text and write the
//! same octets.
//!
//! The messages of the Reference Architecture are compared in `roundtrip` and `ra33`.
//!
//! `JAUS_CASES=500` tests 500 inputs per message instead of a few.

use std::collections::BTreeSet;
use std::sync::Arc;

use bytes::Bytes;
use jaus::codec::view;
use jaus::codec::{AnyMessage, MessageInfo, Registry, ServiceId};
use jsidl::dynamic::{arbitrary, decode, encode, to_json};
use jsidl::model::{Id, Message, Version};
use jsidl::{Library, Loader};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use crate::generated;

fn catalogue() -> Library {
    let mut loader = Loader::new();
    loader.catalogue().reference_architecture();
    loader.load().library
}

fn id(service: &ServiceId) -> Id {
    let version = Version {
        major: service.major,
        minor: service.minor,
    };
    Id {
        urn: service.urn.into(),
        version,
    }
}

/// A service's definition of a generated message.
fn definition(library: &Library, service: &ServiceId, info: &MessageInfo) -> Arc<Message> {
    let service = library
        .service(&id(service))
        .unwrap_or_else(|| panic!("{service} is unknown"));
    let mut messages = service.messages();
    let found = messages.find(|message| message.code == info.code && message.name == info.name);
    found
        .unwrap_or_else(|| panic!("{} has no {info:?}", service.id))
        .clone()
}

/// Checks that both codecs agree on the octets.
fn agree(info: &MessageInfo, message: &Message, octets: &[u8]) -> Result<(), TestCaseError> {
    let shared = Bytes::copy_from_slice(octets);
    let (generated, value) = match ((info.decode)(&shared), decode(message, octets)) {
        (Ok(generated), Ok(value)) => (generated, value),
        (Err(_), Err(_)) => return Ok(()),
        (generated, value) => {
            return Err(TestCaseError::fail(format!(
                "{generated:?}, but {value:?}: {octets:x?}"
            )));
        }
    };
    prop_assert_eq!(&generated.encode().unwrap()[..], octets);
    prop_assert_eq!(&encode(message, &value).unwrap()[..], octets);
    let text = to_json(message, &value).unwrap().to_string();
    prop_assert_eq!(&serde_json::to_string(&*generated).unwrap(), &text);
    prop_assert_eq!(
        &serde_json::to_value(&*generated).unwrap().to_string(),
        &text
    );
    let again = from_text(info, &text);
    // A NaN has many bit patterns but one name.
    if !text.contains("\"NaN\"") {
        prop_assert_eq!(&again.encode().unwrap()[..], octets);
    }
    prop_assert_eq!(serde_json::to_string(&*again).unwrap(), text);
    Ok(())
}

fn from_text(info: &MessageInfo, text: &str) -> Box<dyn AnyMessage> {
    let view: view::Value = serde_json::from_str(text).unwrap();
    (info.from_view)(&view).unwrap_or_else(|error| panic!("{info:?}: {error}: {text}"))
}

/// Random values, values with one octet changed, values cut short, and random octets.
fn check(info: &MessageInfo, message: &Message, cases: u32) {
    let config = ProptestConfig {
        cases,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let input = prop::collection::vec(prop_oneof![0_u8..4, any::<u8>()], 0..300);
    let result = TestRunner::new(config).run(&input, |entropy| {
        let mut octets = encode(message, &arbitrary(message, &entropy)).unwrap();
        agree(info, message, &octets)?;
        let index = entropy
            .first()
            .map_or(0, |&first| usize::from(first) % octets.len());
        agree(info, message, &octets[..index])?;
        octets[index] ^= entropy.last().copied().unwrap_or(0);
        agree(info, message, &octets)?;
        agree(
            info,
            message,
            &[&message.code.to_le_bytes(), &entropy[..]].concat(),
        )?;
        agree(info, message, &entropy)
    });
    if let Err(error) = result {
        panic!("{info:?}: {error}");
    }
}

#[test]
fn both_codecs_agree_on_every_generated_message() {
    let library = catalogue();
    let wanted = std::env::var("JAUS_CASES").ok();
    let wanted = wanted.map_or(12, |cases| cases.parse().unwrap());
    let mut types = 0;
    for info in jaus_vehicle::messages::registry().iter() {
        for service in info.services {
            let message = definition(&library, service, info);
            let cases = if *service == info.services[0] {
                wanted
            } else {
                2
            };
            check(info, &message, cases);
        }
        types += 1;
    }
    println!("{types} message types, {wanted} inputs for each, five readings of each input");
    assert!(types > 100, "the registry has only {types} message types");
}

#[test]
fn every_message_of_the_definitions_is_generated() {
    let library = catalogue();
    let messages = generated().into_iter().flat_map(|it| it.iter());
    let types: BTreeSet<(ServiceId, u16, &str)> = messages
        .flat_map(|info| {
            info.services
                .iter()
                .map(|service| (*service, info.code, info.name))
        })
        .collect();
    for info in generated().iter().flat_map(Registry::services) {
        let service = library.service(&id(&info.id)).unwrap();
        for message in service.messages() {
            let key = (info.id, message.code, message.name.as_str());
            assert!(types.contains(&key), "{} {}", service.id, message.name);
        }
    }
}
