//! Generates a valid message with nothing but a decoder for its definition.

use bytes::Bytes;
use jaus::codec::Message as _;
use jaus::messages::core::{QueryConfiguration, QueryIdentification};
use jaus::messages::mobility::QueryAccelerationLimit;
use jsidl::dynamic;
use jsidl::model::Message;

/// Maximum octets of a body.
const LONGEST: usize = 96;
/// Fill value of fields: valid in most, and far from typical values.
const FILLING: u8 = 0x40;
/// Queries whose last octet must not be zero, as it selects the subject of the query: a subsystem,
/// and an acceleration limit.
const NOT_ZERO: [(u16, u8); 3] = [
    (QueryIdentification::CODE, 2),
    (QueryConfiguration::CODE, 2),
    (QueryAccelerationLimit::CODE, 1),
];

/// The shortest message of this type, all zeros if possible.
pub(super) fn shortest(message: &Message) -> Option<Bytes> {
    let mut octets = message.code.to_le_bytes().to_vec();
    while !is_valid(message, &octets) {
        if octets.len() > LONGEST {
            return None;
        }
        octets.push(0);
    }
    let meant = NOT_ZERO.iter().find(|(code, _)| *code == message.code);
    if let (Some(&(_, meant)), Some(last)) = (meant, octets.last_mut()) {
        *last = meant;
    }
    Some(octets.into())
}

/// A message of this type with an effect: with its first optional field, if its fields are
/// optional, and with nonzero values.
pub(super) fn telling(message: &Message) -> Option<Bytes> {
    let mut octets = shortest(message)?.to_vec();
    if octets.len() > 2 {
        octets = with_first_field(message, &octets).unwrap_or(octets);
    }
    // The first octet of the body may be a presence vector, which is set already.
    for at in 3..octets.len() {
        let before = std::mem::replace(&mut octets[at], FILLING);
        if !is_valid(message, &octets) {
            octets[at] = before;
        }
    }
    if octets.len() == 3 {
        let filled = [octets[0], octets[1], FILLING];
        if is_valid(message, &filled) {
            octets = filled.to_vec();
        }
    }
    Some(octets.into())
}

/// The same message with the first field of its presence vector, if it begins with one.
fn with_first_field(message: &Message, octets: &[u8]) -> Option<Vec<u8>> {
    (1..=8).find_map(|extra| {
        let mut longer = octets.to_vec();
        longer[2] |= 1;
        longer.resize(octets.len() + extra, FILLING);
        is_valid(message, &longer).then_some(longer)
    })
}

fn is_valid(message: &Message, octets: &[u8]) -> bool {
    dynamic::decode(message, octets).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_a_specimen_of_every_message() {
        let mut loader = jsidl::Loader::new();
        loader.catalogue();
        for service in loader.load().library.services() {
            for message in service.messages() {
                for specimen in [shortest(message), telling(message)] {
                    let name = &message.name;
                    let specimen = specimen.unwrap_or_else(|| panic!("no specimen of {name}"));
                    assert!(is_valid(message, &specimen), "{name}: {specimen:02X?}");
                }
            }
        }
    }
}
