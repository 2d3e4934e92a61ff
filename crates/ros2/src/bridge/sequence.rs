//! Runs of commands: those of one publisher whose sequence numbers follow each other, and which of them are
//! fresh. It reads no clock.

use std::time::{Duration, Instant};

use super::ports::Command;
use super::publishers::Outdated;

/// After this silence zenoh has closed a connection that was interrupted, so that nothing from before it
/// can arrive. The publisher begins anew, and another one may take its place.
pub(super) const SILENCE: Duration = Duration::from_secs(10);
/// A number that is later than the last one by more than this, and one for each millisecond since, of which
/// so many count, is not of the same run. So a forged number leaves the publisher its own run, or is soon
/// overtaken by it.
const LEAP: i128 = 100;
const LEAP_OF_PAUSE: i128 = 500;
/// A number that is so much earlier is not of the same run. No command from before is delayed by so many.
pub(super) const FAR: i128 = 1_000_000;
/// One part in this many of the time passed is not counted as delay, because clocks drift.
const DRIFT: i128 = 1000;

/// Commands whose numbers follow each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    /// The last one that was fresh.
    last: Last,
    /// When any of them arrived.
    heard: Instant,
}

/// The last command that was fresh.
#[derive(Debug, Clone, Copy)]
struct Last {
    arrival: Instant,
    sequence: i64,
    stamp: i64,
    /// How much longer than the fastest command it took, in nanoseconds. The offset of the clocks, and
    /// with it the whole delay, is unknown.
    excess: i128,
}

impl Run {
    /// A run that begins with this command.
    pub(super) const fn new(now: Instant, command: &Command) -> Self {
        Self {
            last: Last::first(command),
            heard: now,
        }
    }

    /// The number of its last fresh command.
    pub(super) const fn sequence(&self) -> i64 {
        self.last.sequence
    }

    /// A command of it has arrived that is not fresh.
    pub(super) const fn hear(&mut self, now: Instant) {
        self.heard = now;
    }

    /// How far the number of a command is ahead of the last one.
    fn lead(&self, command: &Command) -> i128 {
        i128::from(command.sequence) - i128::from(self.last.sequence)
    }

    /// Whether a command may be the next one.
    pub(super) fn is_continued_by(&self, command: &Command) -> bool {
        let passed = nanoseconds(self.last.arrival, command.arrival) / 1_000_000;
        let more = passed.clamp(0, LEAP_OF_PAUSE);
        (1..=LEAP + more).contains(&self.lead(command))
    }

    /// Whether a command is the last one again, or an earlier one.
    pub(super) fn is_before(&self, command: &Command) -> bool {
        (-FAR..=0).contains(&self.lead(command))
    }

    /// Whether nothing from before can arrive any more.
    pub(super) fn is_over(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.heard) >= SILENCE
    }

    /// Enters the next command if it is fresh.
    pub(super) fn advance(
        &mut self,
        now: Instant,
        command: &Command,
        timeout: Duration,
    ) -> Result<(), Outdated> {
        let is_over = self.is_over(now);
        self.heard = now;
        self.last = match is_over {
            true => Last::first(command),
            false => self.last.followed_by(command, timeout)?,
        };
        Ok(())
    }
}

impl Last {
    const fn first(command: &Command) -> Self {
        Self {
            arrival: command.arrival,
            sequence: command.sequence,
            stamp: command.stamp,
            excess: 0,
        }
    }

    /// The next command, if it is fresh.
    fn followed_by(self, command: &Command, timeout: Duration) -> Result<Self, Outdated> {
        let next = Self::first(command);
        let passed = nanoseconds(self.arrival, command.arrival);
        let between = i128::from(command.stamp) - i128::from(self.stamp);
        if between < 0 {
            // The clock of the publisher was set back: the sequence number says that it is later.
            return Ok(next);
        }
        let drift = passed.max(0) / DRIFT;
        let excess = (self.excess + passed - between - drift).max(0);
        let limit = i128::try_from(timeout.as_nanos()).unwrap_or(i128::MAX);
        match excess > limit {
            true => Err(Outdated::Late),
            false => Ok(Self { excess, ..next }),
        }
    }
}

/// From one time to another, which may be earlier.
fn nanoseconds(from: Instant, to: Instant) -> i128 {
    let signed = |time: Duration| i128::try_from(time.as_nanos()).unwrap_or(i128::MAX);
    match to.checked_duration_since(from) {
        Some(later) => signed(later),
        None => -signed(from.saturating_duration_since(to)),
    }
}
