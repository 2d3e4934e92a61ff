//! The definitions of the Reference Architecture against OpenJAUS 3.3.1: octets of its encoders,
//! stored beside this file, and recorded traffic.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test fails by panicking"
)]

mod captures;
mod encoders;
mod shown;

use std::sync::Arc;

use bytes::Bytes;
use jaus::codec::MessageInfo;
use jaus_ra::messages;
use jsidl::model::Message;
use jsidl::{Library, Loader};

/// A message of the Reference Architecture for both codecs.
struct Definition {
    generated: &'static MessageInfo,
    dynamic: Arc<Message>,
}

/// The definitions, found by code.
struct Definitions(Library);

impl Definitions {
    fn new() -> Self {
        let mut loader = Loader::new();
        loader.reference_architecture();
        Self(loader.load().library)
    }

    fn of(&self, code: u16) -> Option<Definition> {
        let mut messages = self.0.services().flat_map(|service| service.messages());
        Some(Definition {
            generated: messages::registry().by_code(code).next()?,
            dynamic: Arc::clone(messages.find(|message| message.code == code)?),
        })
    }
}

/// Decodes and encodes a message with both codecs, and requires equal results. Returns the octets
/// and the JSON view.
fn through_both(definition: &Definition, payload: &Bytes) -> (Bytes, String) {
    let generated = (definition.generated.decode)(payload);
    let dynamic = jsidl::dynamic::decode(&definition.dynamic, payload);
    let name = definition.generated.name;
    let generated = generated.unwrap_or_else(|error| panic!("{name}: {error}: {payload:02x?}"));
    let dynamic = dynamic.unwrap_or_else(|error| panic!("{name}: {error}: {payload:02x?}"));
    let octets = generated.encode().unwrap();
    let again = jsidl::dynamic::encode(&definition.dynamic, &dynamic).unwrap();
    assert_eq!(octets, again, "{name}");
    let view = serde_json::to_string(&*generated).unwrap();
    let json = jsidl::dynamic::to_json(&definition.dynamic, &dynamic).unwrap();
    assert_eq!(view, json.to_string(), "{name}");
    (octets, view)
}

/// A message as in a frame: code, then data.
fn payload(code: u16, data: &[u8]) -> Bytes {
    [&code.to_le_bytes()[..], data].concat().into()
}

fn octets(hex: &str) -> Vec<u8> {
    let pairs = hex.as_bytes().chunks(2);
    let octet = |pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    pairs.map(octet).collect()
}
