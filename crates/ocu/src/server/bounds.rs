//! Limits on the frames from a page.

use std::time::{Duration, Instant};

/// Maximum frame size in octets. The largest request takes a tenth of it.
pub(super) const LARGEST_FRAME: usize = 4096;

/// Token bucket that limits the frame rate of a page.
#[derive(Debug)]
pub(super) struct Rate {
    left: u32,
    filled: Instant,
}

impl Rate {
    /// Burst size: the frames that a page sends after a delay.
    const BURST: u32 = 100;
    /// Refill period of one frame: five times the rate of a page that drives.
    const PERIOD: Duration = Duration::from_millis(20);

    pub(super) const fn new(now: Instant) -> Self {
        Self {
            left: Self::BURST,
            filled: now,
        }
    }

    /// Whether another frame is within the limit.
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
