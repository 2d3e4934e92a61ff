//! Messages of the Reference Architecture in the words of ours and the other way round, pair by
//! pair.
//!
//! [`to_jaus`] and [`to_ra`] convert one message, or refuse it with a [`Refusal`] that names the field.
//! Values are taken in engineering units and put to the nearest step of the other scale; a value
//! out of the other's range is refused, not clamped. Nothing is kept between two messages.

mod carry;
mod context;
mod control;
mod effort;
mod pair;
mod path;
mod pose;
mod refusal;
mod status;
#[cfg(test)]
mod tests;
mod vectors;
mod velocity;
mod waypoints;
#[cfg(feature = "ground")]
mod world;

use bytes::Bytes;

pub use self::context::Context;
pub use self::pair::Pair;
pub use self::refusal::{Reason, Refusal};

/// The families.
const FAMILIES: &[&[Pair]] = &[
    status::PAIRS,
    control::PAIRS,
    effort::PAIRS,
    pose::PAIRS,
    velocity::PAIRS,
    vectors::PAIRS,
    path::PAIRS,
    waypoints::PAIRS,
    #[cfg(feature = "ground")]
    world::PAIRS,
];

/// All pairs that are converted, in the order of the families.
pub fn pairs() -> impl Iterator<Item = &'static Pair> {
    FAMILIES.iter().copied().flatten()
}

/// Our payload, which begins with its code, for a message of the Reference Architecture.
///
/// # Errors
/// What has no counterpart, and why.
pub fn to_jaus(code: u16, data: &[u8]) -> Result<Bytes, Refusal> {
    to_jaus_with(Context::default(), code, data)
}

/// Code and data of a message of the Reference Architecture for a payload of ours.
///
/// # Errors
/// What has no counterpart, and why.
pub fn to_ra(payload: &Bytes) -> Result<(u16, Bytes), Refusal> {
    to_ra_with(Context::default(), payload)
}

/// Like [`to_jaus`], with what is known of the component.
///
/// # Errors
/// As there.
pub fn to_jaus_with(context: Context<'_>, code: u16, data: &[u8]) -> Result<Bytes, Refusal> {
    let pair = meant(context, |pair| pair.ra == code);
    pair.ok_or(Refusal::NoCounterpart(code))?
        .to_jaus(data, context)
}

/// Like [`to_ra`], with what is known of the component.
///
/// # Errors
/// As there.
pub fn to_ra_with(context: Context<'_>, payload: &Bytes) -> Result<(u16, Bytes), Refusal> {
    let code = payload.first_chunk().copied().map(u16::from_le_bytes);
    let code = code.ok_or(Refusal::NoCode)?;
    let pair = meant(context, |pair| pair.jaus == code);
    let pair = pair.ok_or(Refusal::NoCounterpart(code))?;
    Ok((pair.ra, pair.to_ra(payload, context)?))
}

/// Of the pairs with a code the one that is meant; the only one is in any case.
fn meant(context: Context<'_>, has_code: impl Fn(&Pair) -> bool) -> Option<&'static Pair> {
    let candidates = || pairs().filter(|pair| has_code(pair));
    let mut first_two = candidates();
    match (first_two.next(), first_two.next()) {
        (only, None) => only,
        _ => candidates().find(|pair| pair.is_meant(context)),
    }
}
