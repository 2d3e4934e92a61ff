//! Converts messages between the Reference Architecture and ours, pair by pair.
//!
//! [`to_jaus`] and [`to_ra`] convert one message, or refuse it with a [`Refusal`] that names the
//! field. Values convert in engineering units to the nearest step of the other scale; a value out
//! of the other's range is refused, not clamped. Conversion is stateless. Undefined bits of a
//! presence vector are ignored in RA messages, as RA systems set them all.
//!
//! ```
//! use jaus::codec::Message;
//! use jaus::messages::mobility::SetWrenchEffort;
//! use jaus_ra::convert::{to_jaus, to_ra};
//!
//! // What the vehicle simulator of OpenJAUS is sent while it stands: a brake of 97.6 percent.
//! let payload = to_jaus(0x0405, &[0x61, 0, 0, 0, 0, 0, 0xF9])?;
//! let effort = SetWrenchEffort::decode(&payload)?;
//! assert_eq!(effort.resistive_linear_effort_x_percent().map(f64::round), Some(98.0));
//! assert_eq!(to_ra(&payload)?.0, 0x0405);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | RA | name | ours | name | lost and refused content |
//! |---|---|---|---|---|
//! | 0001h 2001h 4001h | Set, Query, Report Component Authority | same | Set, Query, Report Authority | |
//! | 0002h to 0005h | Shutdown, Standby, Resume, Reset | same | same | |
//! | 0006h 0007h | Set, Clear Emergency | same | same | codes other than 1, stop |
//! | 2002h 4002h | Query, Report Component Status | same | Query, Report Status | lost: the secondary status code; refused: states above 5 |
//! | 000Dh 000Eh | Request, Release Component Control | same | Request, Release Control | |
//! | 000Fh | Confirm Component Control | same | Confirm Control | refused: answers above 2 |
//! | 0010h | Reject Component Control | same | Reject Control | lost: why; from there it is *control released* |
//! | 200Dh 400Dh | Query, Report Component Control | same | Query, Report Control | refused: a controller without an id on the other side |
//! | 0011h 2011h 4011h | Set, Query, Report Time | same | same | |
//! | 2202h 4202h | Query, Report Heartbeat Pulse | same | same | |
//! | 0404h | Set Velocity State | 0415h | Set Velocity Command | lost: deviations, time; refused: limits and defaults, more than 65.534 m/s or 32.767 rad/s |
//! | 0405h 2405h 4405h | Set, Query, Report Wrench Effort | same | same | |
//! | 0407h 2407h 4407h | Set, Query, Report Global Vector | same | same | refused: speeds above 327.67 m/s; for version 1.0, no speed |
//! | 0408h 2408h 4408h | Set, Query, Report Local Vector | same | same | lost: Z, roll and pitch of a report; refused: those of a command, no heading, speeds as above |
//! | 040Ah | Set Travel Speed | same | same | refused: speeds above 327.67 m/s |
//! | 040Ah | Set Travel Speed of a path segment driver | 041Eh | Execute List | refused: speeds as above, from another element than the first; each speed above zero begins with the first |
//! | 240Ah 440Ah | Query, Report Travel Speed | same | same | refused: speeds as above |
//! | 240Bh 440Bh | Query, Report Waypoint Count | 241Ch 441Ch | Query, Report Element Count | |
//! | 040Ch 040Dh | Set Global, Local Waypoint | same | same | lost: the tolerance of the waypoint; refused: numbers other than 0, a limit of the path, a local Z out of -10 km to 35 km |
//! | 240Ch 240Dh | Query Global, Local Waypoint | same | same | lost: which fields are wanted; refused: numbers other than 0 |
//! | 440Ch 440Dh | Report Global, Local Waypoint | same | same | lost: number, tolerances; refused: Z as above |
//! | 240Eh 440Eh | Query, Report Path Segment Count | 241Ch 441Ch | Query, Report Element Count | |
//! | 040Fh 0410h | Set Global, Local Path Segment | 041Ah | Set Element | refused: more than one element, one that does not follow the one before it, a limit of the path |
//! | 240Fh 2410h | Query Global, Local Path Segment | same | same | refused: numbers other than 0 |
//! | 440Fh 4410h | Report Global, Local Path Segment | same | same | lost: number, limit of the path |
//! | 2402h 4402h | Query, Report Global Pose | same | same | |
//! | 2403h 4403h | Query, Report Local Pose | same | same | refused: Z out of -10 km to 35 km |
//! | 2404h 4404h | Query, Report Velocity State | same | same | refused: more than 65.534 m/s or 32.767 rad/s |
//! | 0A20h to 4A24h | the twelve of the Vector Knowledge Store | same | same | nothing: they are ours octet by octet |
//!
//! Lists of waypoints and path segments are more than one message each: [`Places`] converts only
//! the places, for a caller that keeps the list and assigns the numbers, such as the gateway.
//!
//! Messages outside the table have no counterpart: discrete devices, platform specifications,
//! cameras, manipulators, payloads, missions. Discovery, service connections and events are not
//! converted but handled by the node and the connections.

mod carry;
mod context;
mod control;
mod effort;
mod pair;
mod path;
mod places;
mod pose;
mod refusal;
mod status;
#[cfg(test)]
mod tests;
mod vectors;
mod velocity;
mod waypoints;
mod world;

use bytes::Bytes;

pub use self::context::Context;
pub use self::pair::Pair;
pub use self::places::{Element, Places, speed_to_jaus, speed_to_ra};
pub use self::refusal::{Reason, Refusal};

/// Message families.
const FAMILIES: &[&[Pair]] = &[
    status::PAIRS,
    control::PAIRS,
    effort::PAIRS,
    pose::PAIRS,
    velocity::PAIRS,
    vectors::PAIRS,
    path::PAIRS,
    waypoints::PAIRS,
    world::PAIRS,
];

/// All converted pairs, in the order of the families.
pub fn pairs() -> impl Iterator<Item = &'static Pair> {
    FAMILIES.iter().copied().flatten()
}

/// Converts an RA message to our payload, which begins with its code.
///
/// # Errors
/// The reason why it has no counterpart.
pub fn to_jaus(code: u16, data: &[u8]) -> Result<Bytes, Refusal> {
    to_jaus_with(Context::default(), code, data)
}

/// Converts our payload to code and data of an RA message.
///
/// # Errors
/// The reason why it has no counterpart.
pub fn to_ra(payload: &Bytes) -> Result<(u16, Bytes), Refusal> {
    to_ra_with(Context::default(), payload)
}

/// Like [`to_jaus`], with context about the component.
///
/// # Errors
/// As there.
pub fn to_jaus_with(context: Context<'_>, code: u16, data: &[u8]) -> Result<Bytes, Refusal> {
    let pair = meant(context, |pair| pair.ra == code);
    pair.ok_or(Refusal::NoCounterpart(code))?
        .to_jaus(data, context)
}

/// Like [`to_ra`], with context about the component.
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

/// Selects the pair for a code; a single candidate always matches.
fn meant(context: Context<'_>, has_code: impl Fn(&Pair) -> bool) -> Option<&'static Pair> {
    let candidates = || pairs().filter(|pair| has_code(pair));
    let mut first_two = candidates();
    match (first_two.next(), first_two.next()) {
        (only, None) => only,
        _ => candidates().find(|pair| pair.is_meant(context)),
    }
}
