//! What the drivers of the chain have in common: how they stand, what they sense, and how each
//! commands the next.

mod senses;
mod standing;

pub(super) use senses::Sense;
pub(super) use standing::{Watchman, guard};
