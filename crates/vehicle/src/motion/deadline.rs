//! Deadline of drive commands: how long a command holds without repetition.

use std::time::{Duration, Instant};

/// Command deadline of a platform or drive: it brakes on its own when its last command is older.
///
/// [`Pilot`](super::Pilot) repeats its command every [`STEP`](super::Pilot::STEP) (20 ms) during
/// motion. A program that hangs repeats nothing, so the vehicle stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CommandDeadline {
    limit: Duration,
    since: Option<Instant>,
}

impl CommandDeadline {
    /// 200 ms: ten pilot steps.
    pub const DEFAULT: Duration = Duration::from_millis(200);

    /// Creates a deadline of `limit` after each command, without a command so far.
    #[must_use]
    pub const fn new(limit: Duration) -> Self {
        Self { limit, since: None }
    }

    /// Restarts the deadline for a command at `now`. Callers without a clock pass the time of the
    /// last [`has_passed`](Self::has_passed), or `None` to count from the next one.
    pub const fn restart(&mut self, now: Option<Instant>) {
        self.since = now;
    }

    /// Whether the last command is older than the limit at `now`.
    pub fn has_passed(&mut self, now: Instant) -> bool {
        let since = *self.since.get_or_insert(now);
        now.saturating_duration_since(since) > self.limit
    }

    /// When the last command expires; `None` before the first command.
    #[must_use]
    pub fn expires_at(&self) -> Option<Instant> {
        self.since?.checked_add(self.limit)
    }
}

impl Default for CommandDeadline {
    fn default() -> Self {
        Self::new(Self::DEFAULT)
    }
}
