//! How much a page may say.

use std::time::{Duration, Instant};

/// The largest frame of a page, in octets; the largest request has a tenth of it.
pub(super) const LARGEST_FRAME: usize = 4096;

/// How often a page may say something: a bucket that fills evenly and that every frame takes
/// something out of.
#[derive(Debug)]
pub(super) struct Rate {
    left: u32,
    filled: Instant,
}

impl Rate {
    /// Frames at once: what a page that was held up says when it goes on.
    const BURST: u32 = 100;
    /// Between two frames in the long run: five times what a page does that drives.
    const PERIOD: Duration = Duration::from_millis(20);

    pub(super) const fn new(now: Instant) -> Self {
        Self {
            left: Self::BURST,
            filled: now,
        }
    }

    /// Whether one more frame is all right.
    pub(super) fn allows(&mut self, now: Instant) -> bool {
        while self.left < Self::BURST && self.filled + Self::PERIOD <= now {
            self.filled += Self::PERIOD;
            self.left += 1;
        }
        if self.left == Self::BURST {
            self.filled = now;
        }
        let allowed = self.left > 0;
        self.left = self.left.saturating_sub(1);
        allowed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_that_drives_is_never_too_fast() {
        let start = Instant::now();
        let mut rate = Rate::new(start);
        for step in 0..1000 {
            assert!(rate.allows(start + Duration::from_millis(20) * step));
        }
    }

    #[test]
    fn a_flood_is_noticed_after_its_first_hundred_frames_and_forgiven_later() {
        let start = Instant::now();
        let mut rate = Rate::new(start);
        let allowed = (0..1000).filter(|_| rate.allows(start)).count();
        assert_eq!(allowed, 100);
        assert!(rate.allows(start + Duration::from_secs(3600)));
    }
}
