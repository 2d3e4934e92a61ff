//! Limits of size and rate.

use jaus_limits::Rate;

/// Maximum frame size in octets. The largest request takes a tenth of it.
pub(super) const LARGEST_FRAME: usize = 4096;

/// Frames of a page: a burst for those that it sends after a delay, and five times the rate of a
/// page that drives.
pub(super) const FRAMES: Rate = Rate::new(50, 100);

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use jaus_limits::Bucket;

    use super::*;

    #[test]
    fn a_page_that_drives_is_never_too_fast() {
        let start = Instant::now();
        let mut bucket = Bucket::default();
        for step in 0..1000 {
            let now = start + Duration::from_millis(20) * step;
            assert_eq!(bucket.take(now, FRAMES, 1), Ok(()));
        }
    }

    #[test]
    fn a_flood_is_noticed_after_its_first_hundred_frames_and_forgiven_later() {
        let start = Instant::now();
        let mut bucket = Bucket::default();
        let taken = (0..1000).filter(|_| bucket.take(start, FRAMES, 1).is_ok());
        assert_eq!(taken.count(), 100);
        let later = start + Duration::from_secs(3600);
        assert_eq!(bucket.take(later, FRAMES, 1), Ok(()));
    }
}
