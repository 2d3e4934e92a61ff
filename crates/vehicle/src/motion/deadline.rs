//! How long a command holds that is not repeated.

use std::time::{Duration, Instant};

/// The deadline of a platform or drive: it brakes by itself when its last command is older.
///
/// [`Pilot`](super::Pilot) repeats its command every [`STEP`](super::Pilot::STEP) (20 ms) while
/// something moves. A program that hangs repeats nothing, so that what it drives stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CommandDeadline {
    limit: Duration,
    since: Option<Instant>,
}

impl CommandDeadline {
    /// 200 ms: ten steps of a pilot.
    pub const DEFAULT: Duration = Duration::from_millis(200);

    /// A deadline of `limit` after each command; no command has come yet.
    #[must_use]
    pub const fn new(limit: Duration) -> Self {
        Self { limit, since: None }
    }

    /// A command has come at `now`. Where no clock is at hand, pass the time of the last
    /// [`has_passed`](Self::has_passed), or `None` to count from the next one.
    pub const fn restart(&mut self, now: Option<Instant>) {
        self.since = now;
    }

    /// Whether the last command is older than the limit at `now`.
    pub fn has_passed(&mut self, now: Instant) -> bool {
        let since = *self.since.get_or_insert(now);
        now.saturating_duration_since(since) > self.limit
    }

    /// When the last command expires; `None` if no command has come.
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
