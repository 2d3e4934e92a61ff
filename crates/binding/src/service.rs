//! Names of services and numbers of kinds, as programs give them.

use std::collections::BTreeSet;
use std::sync::Mutex;

use jaus::codec::ServiceId;
use jaus::component::Kind;
use jaus::messages;

use crate::lock::lock;

/// Limit of URNs that the library does not know.
const MOST: usize = 1024;

/// The program has offered too many services of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the program has offered {MOST} services of its own")]
pub struct TooManyServices;

/// The id of a service that lives as long as the program: the library's own, or a copy that is made once for
/// each URN.
///
/// # Errors
/// After 1024 URNs that the library does not know.
pub fn service_id(urn: &str, major: u8, minor: u8) -> Result<ServiceId, TooManyServices> {
    static OWN: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let known = messages::registry().services().find(|it| it.id.urn == urn);
    if let Some(known) = known {
        let urn = known.id.urn;
        return Ok(ServiceId { urn, major, minor });
    }
    let mut own = lock(&OWN);
    let urn = match own.get(urn) {
        Some(urn) => urn,
        None if own.len() >= MOST => return Err(TooManyServices),
        None => {
            let urn: &'static str = Box::leak(urn.into());
            own.insert(urn);
            urn
        }
    };
    Ok(ServiceId { urn, major, minor })
}

/// The kind of a subsystem or a component by its number in Report Identification.
#[must_use]
pub const fn kind(number: u16) -> Kind {
    match number {
        10001 => Kind::Vehicle,
        20001 => Kind::OperatorControlUnit,
        30001 => Kind::OtherSubsystem,
        40001 => Kind::Node,
        50001 => Kind::Payload,
        60001 => Kind::Component,
        other => Kind::Unknown(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_urn_of_the_library_or_of_the_program_has_one_copy() {
        let ids = ["urn:example:own", "urn:jaus:jss:core:Time"]
            .map(|urn| [(); 2].map(|()| service_id(urn, 1, 0).unwrap().urn.as_ptr()));
        for [first, second] in ids {
            assert_eq!(first, second);
        }
    }
}
