//! Trace of the simulated network: a hash of all events, and a line per event for debugging.

use std::fmt::{self, Write};
use std::time::Instant;

/// Records all events.
pub struct Trace {
    start: Instant,
    digest: u64,
    printed: bool,
}

impl Trace {
    /// A trace from `start` on.
    pub(super) fn new(start: Instant) -> Self {
        Self {
            start,
            digest: 0,
            printed: false,
        }
    }

    /// Prints each line from now on.
    pub fn print(&mut self) {
        self.printed = true;
    }

    /// A hash of all recorded events.
    pub fn digest(&self) -> u64 {
        self.digest
    }

    /// Records an event.
    pub fn note(&mut self, now: Instant, what: fmt::Arguments<'_>) {
        let time = now.saturating_duration_since(self.start);
        // Writing into the digest never fails.
        let _written = write!(Digest(&mut self.digest), "{} {what}", time.as_nanos());
        if self.printed {
            eprintln!("{:>12.6} {what}", time.as_secs_f64());
        }
    }
}

/// Adds text to a digest (FNV-1a).
struct Digest<'a>(&'a mut u64);

impl Write for Digest<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for octet in text.bytes() {
            *self.0 = (*self.0 ^ u64::from(octet)).wrapping_mul(0x0100_0000_01B3);
        }
        Ok(())
    }
}
