//! Shared parts of the fuzz targets.

use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock};

use bytes::Bytes;
use jaus::codec::MessageInfo;
use jsidl::dynamic::{Limits, arbitrary, decode_with, encode, encode_with};
use jsidl::model::{Id, Message};

/// A message of the embedded definitions, and a service that declares it.
pub type Declared = (Id, Arc<Message>);

/// Every message of the embedded definitions, once for each code, name and service version.
pub fn catalogue() -> &'static [Declared] {
    static MESSAGES: LazyLock<Vec<Declared>> = LazyLock::new(|| {
        let mut loader = jsidl::Loader::new();
        loader.catalogue();
        let library = loader.load().library;
        let mut messages = BTreeMap::new();
        for service in library.services() {
            for message in service.messages() {
                let key = (message.code, message.name.clone(), service.id.version);
                messages.insert(key, (service.id.clone(), message.clone()));
            }
        }
        messages.into_values().collect()
    });
    &MESSAGES
}

/// Takes two octets that choose a message.
pub fn choose(octets: &[u8]) -> Option<(&'static Declared, &[u8])> {
    let (choice, rest) = octets.split_first_chunk()?;
    let messages = catalogue();
    messages
        .get(usize::from(u16::from_le_bytes(*choice)) % messages.len())
        .map(|m| (m, rest))
}

/// The type generated for a declared message, if its set is enabled.
pub fn generated((id, message): &Declared) -> Option<&'static MessageInfo> {
    let same = |service: &jaus::codec::ServiceId| {
        *service.urn == *id.urn
            && (service.major, service.minor) == (id.version.major, id.version.minor)
    };
    let mut types = jaus_vehicle::messages::registry().by_code(message.code);
    types.find(|info| info.name == message.name && info.services.iter().any(same))
}

/// A message's octets: this code and this body.
pub fn with_code(code: u16, body: &[u8]) -> Vec<u8> {
    [&code.to_le_bytes(), body].concat()
}

/// A payload: the octets as they are, or a chosen message filled from the rest of the octets.
/// `None` if they are too few for a message code.
pub fn message(is_chosen: bool, octets: &[u8]) -> Option<Bytes> {
    if !is_chosen {
        return (octets.len() >= 2).then(|| Bytes::copy_from_slice(octets));
    }
    let ((_, message), entropy) = choose(octets)?;
    let octets = encode(message, &arbitrary(message, entropy)).ok()?;
    Some(octets.into())
}

/// Decodes octets by their definition; accepted octets must encode to the same octets.
pub fn octets_come_back(message: &Message, octets: &[u8]) {
    for limits in [Limits::Enforced, Limits::Ignored] {
        if let Ok(value) = decode_with(message, octets, limits) {
            let again = encode_with(message, &value, limits).expect("what was decoded");
            assert_eq!(again, octets);
        }
    }
}
