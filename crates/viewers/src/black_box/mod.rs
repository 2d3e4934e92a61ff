//! A black box: the latest traffic in memory, until a trigger asks for it.

mod files;
mod triggers;

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus_view::{Frame, LinkType, Timestamp};

pub use files::{BlackBoxFiles, BlackBoxNames};
pub use triggers::{Trigger, TriggerKind, Triggers};

/// Octets of memory for a frame besides its own, about.
const AROUND: usize = 160;

/// Limits of a [`BlackBox`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlackBoxLimits {
    /// Older frames are dropped.
    pub time: Duration,
    /// Limit of memory for the frames, in octets.
    pub octets: usize,
}

/// A frame in memory. Clones share its octets.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Kept {
    /// The interface.
    pub interface: Arc<str>,
    /// Type of the link header.
    pub link: LinkType,
    /// Capture time.
    pub time: Timestamp,
    /// The frame as captured, whole.
    pub octets: Bytes,
    /// Number of frames lost before it.
    pub lost: u64,
}

/// The latest frames, within limits of time and memory.
#[derive(Debug)]
pub struct BlackBox {
    limits: BlackBoxLimits,
    kept: VecDeque<(Instant, Kept)>,
    octets: usize,
}

/// Frames of a [`BlackBox`] at one time. Taking it copies no octets.
#[derive(Debug, Clone, Default)]
pub struct Snapshot(Vec<Kept>);

impl Kept {
    /// The frame, to be written.
    #[must_use]
    pub fn frame(&self) -> Frame<'_> {
        Frame {
            time: Some(self.time),
            link: self.link,
            octets: &self.octets,
            lost: self.lost,
            // No link has frames of 4 GiB.
            length: u32::try_from(self.octets.len()).unwrap_or(u32::MAX),
            interface: &self.interface,
        }
    }

    fn cost(&self) -> usize {
        self.octets.len() + AROUND
    }
}

impl BlackBox {
    /// Starts empty.
    #[must_use]
    pub const fn new(limits: BlackBoxLimits) -> Self {
        Self {
            limits,
            kept: VecDeque::new(),
            octets: 0,
        }
    }

    /// Keeps a frame that arrived at `now`, and drops the oldest beyond the limits. A frame that
    /// exceeds the limit alone is dropped.
    pub fn push(&mut self, now: Instant, frame: Kept) {
        self.octets += frame.cost();
        self.kept.push_back((now, frame));
        while let Some((arrived, oldest)) = self.kept.front() {
            let is_old = now.saturating_duration_since(*arrived) > self.limits.time;
            if !is_old && self.octets <= self.limits.octets {
                break;
            }
            self.octets -= oldest.cost();
            self.kept.pop_front();
        }
    }

    /// The frames in memory, oldest first.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        Snapshot(self.kept.iter().map(|(_, frame)| frame.clone()).collect())
    }

    /// Octets of memory for the frames, about; at most [`BlackBoxLimits::octets`].
    #[must_use]
    pub const fn octets(&self) -> usize {
        self.octets
    }
}

impl Snapshot {
    /// The frames, oldest first.
    #[must_use]
    pub fn frames(&self) -> &[Kept] {
        &self.0
    }

    /// Number of frames lost between them, and before the oldest.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.0.iter().map(|frame| frame.lost).sum()
    }

    /// The frames of both.
    #[must_use]
    pub fn followed_by(&self, later: Self) -> Self {
        let mut frames = self.0.clone();
        frames.extend(later.0);
        Self(frames)
    }
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, reason = "tests begin at some time")]
mod tests {
    use super::*;

    fn frame(number: u8, length: usize) -> Kept {
        Kept {
            interface: "lo".into(),
            link: LinkType::RAW,
            time: Timestamp::new(number.into(), 0, 9),
            octets: vec![number; length].into(),
            lost: 0,
        }
    }

    fn numbers(kept: &BlackBox) -> Vec<u8> {
        let snapshot = kept.snapshot();
        snapshot.frames().iter().map(|it| it.octets[0]).collect()
    }

    #[test]
    fn the_oldest_frames_go_first_beyond_the_limit_of_memory() {
        let limits = BlackBoxLimits {
            time: Duration::from_secs(60),
            octets: 3 * (100 + AROUND),
        };
        let mut kept = BlackBox::new(limits);
        let now = Instant::now();
        for number in 1..=5 {
            kept.push(now, frame(number, 100));
            assert!(kept.octets() <= limits.octets);
        }
        assert_eq!(numbers(&kept), [3, 4, 5]);
        kept.push(now, frame(6, limits.octets));
        assert!(numbers(&kept).is_empty(), "too large for all of it");
        assert_eq!(kept.octets(), 0);
    }

    #[test]
    fn frames_are_kept_for_the_time_and_no_longer_whatever_the_clock_of_the_day() {
        let limits = BlackBoxLimits {
            time: Duration::from_secs(10),
            octets: 1 << 20,
        };
        let mut kept = BlackBox::new(limits);
        let start = Instant::now();
        for number in [200, 1, 2] {
            let now = start + Duration::from_secs(if number == 2 { 11 } else { 5 });
            kept.push(now, frame(number, 10));
        }
        assert_eq!(numbers(&kept), [200, 1, 2]);
        kept.push(start + Duration::from_secs(16), frame(3, 10));
        assert_eq!(numbers(&kept), [2, 3]);
    }

    #[test]
    fn a_snapshot_keeps_what_the_box_drops_and_can_be_continued() {
        let limits = BlackBoxLimits {
            time: Duration::from_secs(10),
            octets: 100 + AROUND,
        };
        let mut kept = BlackBox::new(limits);
        let now = Instant::now();
        kept.push(now, frame(1, 100));
        let before = kept.snapshot();
        kept.push(now, frame(2, 100));
        let all = before.followed_by(kept.snapshot());
        let numbers: Vec<_> = all.frames().iter().map(|it| it.octets[0]).collect();
        assert_eq!(numbers, [1, 2]);
    }
    #[test]
    fn what_was_lost_is_counted_as_long_as_the_frame_after_it_is_kept() {
        let limits = BlackBoxLimits {
            time: Duration::from_secs(10),
            octets: 2 * (100 + AROUND),
        };
        let mut kept = BlackBox::new(limits);
        let now = Instant::now();
        for (number, lost) in [(1, 5), (2, 0), (3, 7)] {
            let frame = Kept {
                lost,
                ..frame(number, 100)
            };
            assert_eq!(frame.frame().lost, lost);
            kept.push(now, frame);
        }
        assert_eq!(kept.snapshot().lost(), 7);
    }
}
