//! Generates a valid message of each type with nothing but its decoder.

use bytes::Bytes;
use jaus::codec::{Message, MessageInfo};
use jaus::messages::core::{QueryConfiguration, QueryIdentification};
use jaus::messages::mobility::QueryAccelerationLimit;

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
pub(super) fn shortest(info: &MessageInfo) -> Option<Bytes> {
    let mut octets = info.code.to_le_bytes().to_vec();
    while !is_valid(info, &octets) {
        if octets.len() > LONGEST {
            return None;
        }
        octets.push(0);
    }
    let meant = NOT_ZERO.iter().find(|(code, _)| *code == info.code);
    if let (Some(&(_, meant)), Some(last)) = (meant, octets.last_mut()) {
        *last = meant;
    }
    Some(octets.into())
}

/// A message of this type with an effect: with its first optional field, if its fields are
/// optional, and with nonzero values.
pub(super) fn telling(info: &MessageInfo) -> Option<Bytes> {
    let mut octets = shortest(info)?.to_vec();
    if octets.len() > 2 {
        octets = with_first_field(info, &octets).unwrap_or(octets);
    }
    // The first octet of the body may be a presence vector, which is set already.
    for at in 3..octets.len() {
        let before = std::mem::replace(&mut octets[at], FILLING);
        if !is_valid(info, &octets) {
            octets[at] = before;
        }
    }
    if octets.len() == 3 {
        let filled = [octets[0], octets[1], FILLING];
        if is_valid(info, &filled) {
            octets = filled.to_vec();
        }
    }
    Some(octets.into())
}

/// The same message with the first field of its presence vector, if it begins with one.
fn with_first_field(info: &MessageInfo, octets: &[u8]) -> Option<Vec<u8>> {
    (1..=8).find_map(|extra| {
        let mut longer = octets.to_vec();
        longer[2] |= 1;
        longer.resize(octets.len() + extra, FILLING);
        is_valid(info, &longer).then_some(longer)
    })
}

fn is_valid(info: &MessageInfo, octets: &[u8]) -> bool {
    (info.decode)(&Bytes::copy_from_slice(octets)).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_a_specimen_of_every_message() {
        for info in jaus_vehicle::messages::registry().iter() {
            for specimen in [shortest(info), telling(info)] {
                let specimen = specimen.unwrap_or_else(|| panic!("no specimen of {info:?}"));
                assert!(is_valid(info, &specimen), "{info:?}: {specimen:02X?}");
            }
        }
    }
}
