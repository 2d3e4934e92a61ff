//! The context of a received message.

use std::time::Instant;

use super::Path;
use crate::wire::Frame;

/// A received message, and how it arrived.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival<'a> {
    pub(super) frame: &'a Frame,
    pub(super) now: Instant,
    pub(super) path: Path,
    /// Whether it was sent to the link's group.
    pub(super) to_all: bool,
    /// Octets of memory that its payload keeps alive.
    pub(super) held: usize,
}
