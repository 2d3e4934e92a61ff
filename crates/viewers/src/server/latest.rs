//! The latest sample of each channel, for viewers that subscribe after it was published.
//!
//! A report on change may be the only one for hours. The memory is bounded, and small samples, which
//! are most of them, need not compete with images for it: up to [`SMALL`] octets, the latest sample
//! of every channel is kept; larger ones share [`LARGE_TOGETHER`] octets. At most 12 MiB in all.

use std::collections::BTreeMap;

use crate::channels::MOST_CHANNELS;

/// A sample of at most this many octets is always kept.
const SMALL: usize = 1 << 10;
/// Limit of a kept sample, in octets.
const LARGEST: usize = 1 << 20;
/// Limit of all kept samples that are larger than [`SMALL`], in octets.
const LARGE_TOGETHER: usize = 8 << 20;

/// The latest samples by channel, as far as the limits permit.
#[derive(Debug, Default)]
pub(super) struct Latest {
    samples: BTreeMap<usize, LatestSample>,
    /// Octets of those that are larger than [`SMALL`].
    large_octets: usize,
}

/// A sample as it is sent.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct LatestSample {
    /// Time of the message, in nanoseconds since 1970.
    pub(super) time: u64,
    /// Boxed, because a vector may hold twice the octets that count for the limits.
    pub(super) data: Box<[u8]>,
}

impl Latest {
    /// Keeps a sample as the latest of its channel. If there is no room, the channel has none: its
    /// previous sample would be mistaken for the latest.
    pub(super) fn keep(&mut self, channel: usize, time: u64, data: Vec<u8>) {
        if let Some(previous) = self.samples.remove(&channel) {
            self.large_octets -= shared_octets(previous.data.len());
        }
        if self.has_room(data.len()) {
            self.large_octets += shared_octets(data.len());
            let data = data.into_boxed_slice();
            self.samples.insert(channel, LatestSample { time, data });
        }
    }

    /// The latest sample of a channel.
    pub(super) fn of(&self, channel: usize) -> Option<&LatestSample> {
        self.samples.get(&channel)
    }

    /// Drops the samples of channels that are closed.
    pub(super) fn forget(&mut self, is_closed: impl Fn(usize) -> bool) {
        let large = &mut self.large_octets;
        self.samples.retain(|&channel, sample| {
            let is_closed = is_closed(channel);
            if is_closed {
                *large -= shared_octets(sample.data.len());
            }
            !is_closed
        });
    }

    fn has_room(&self, octets: usize) -> bool {
        self.samples.len() < MOST_CHANNELS
            && octets <= LARGEST
            && self.large_octets + shared_octets(octets) <= LARGE_TOGETHER
    }
}

/// The octets of a sample that count for [`LARGE_TOGETHER`].
const fn shared_octets(octets: usize) -> usize {
    if octets > SMALL { octets } else { 0 }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Fills all the room there is.
    pub(in crate::server) fn full() -> Latest {
        let mut latest = Latest::default();
        let large = LARGE_TOGETHER / LARGEST;
        for channel in 0..MOST_CHANNELS {
            let octets = if channel < large { LARGEST } else { SMALL };
            latest.keep(channel, 5, vec![b' '; octets]);
        }
        assert_eq!(latest.samples.len(), MOST_CHANNELS);
        latest
    }

    #[test]
    fn a_sample_takes_the_place_of_the_previous_one_of_its_channel() {
        let mut latest = Latest::default();
        latest.keep(3, 5, b"{}".to_vec());
        latest.keep(4, 6, b"[]".to_vec());
        latest.keep(3, 7, b"{1}".to_vec());
        let sample = |time, data: &[u8]| LatestSample {
            time,
            data: data.into(),
        };
        assert_eq!(latest.of(3), Some(&sample(7, b"{1}")));
        assert_eq!(latest.of(4), Some(&sample(6, b"[]")));
        assert_eq!(latest.of(5), None);
    }

    #[test]
    fn a_sample_that_is_too_large_is_not_kept_and_its_predecessor_neither() {
        let mut latest = Latest::default();
        latest.keep(3, 5, vec![0; LARGEST]);
        assert!(latest.of(3).is_some());
        latest.keep(3, 6, vec![0; LARGEST + 1]);
        assert_eq!(latest.of(3), None);
        assert_eq!(latest.large_octets, 0);
    }

    #[test]
    fn large_samples_share_a_room_and_leave_that_of_small_ones() {
        let mut latest = full();
        let large = LARGE_TOGETHER / LARGEST;
        latest.keep(large, 6, vec![0; SMALL + 1]);
        assert_eq!(latest.of(large), None, "no room");
        latest.keep(large, 7, vec![0; SMALL]);
        assert!(latest.of(large).is_some(), "a small one always has room");
        latest.keep(0, 7, vec![0; SMALL]);
        latest.keep(large, 8, vec![0; LARGEST]);
        assert!(latest.of(large).is_some(), "in the room of another one");
    }

    #[test]
    fn samples_of_channels_beyond_the_limit_are_not_kept() {
        let mut latest = full();
        latest.keep(MOST_CHANNELS, 5, Vec::new());
        assert_eq!(latest.of(MOST_CHANNELS), None);
    }
}
