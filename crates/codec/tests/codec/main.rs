//! Messages written the way the generator writes them: their octets, their views, their errors.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod messages;
mod registry;
mod scale;
mod wire;

#[cfg(feature = "arbitrary")]
mod random;
#[cfg(feature = "serde")]
mod view;
