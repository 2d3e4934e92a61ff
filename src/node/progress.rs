//! The progress of large messages to one component: when a part of an unfinished message last
//! arrived from each peer.

use std::time::{Duration, Instant};

use crate::address::JausId;

/// The peers that are sending large messages to one component.
#[derive(Debug, Default)]
pub(super) struct Progress(Vec<Peer>);

#[derive(Debug)]
struct Peer {
    source: JausId,
    latest: Instant,
    /// When the component's process was last notified, or is to be.
    noted: Instant,
    is_news: bool,
}

impl Progress {
    /// Limit of peers; the one that has been silent for the longest time makes room.
    const MOST: usize = 16;
    /// The shortest interval between notifications of the component's process.
    const PAUSE: Duration = Duration::from_millis(50);

    /// Notes the arrival of a part; returns whether the component's process is to be notified.
    pub(super) fn note(&mut self, now: Instant, source: JausId) -> bool {
        let known = self.0.iter_mut().find(|peer| peer.source == source);
        if let Some(peer) = known {
            peer.latest = now;
            if now.saturating_duration_since(peer.noted) < Self::PAUSE {
                return false;
            }
            (peer.noted, peer.is_news) = (now, true);
            return true;
        }
        if self.0.len() >= Self::MOST {
            let oldest = (0..self.0.len()).min_by_key(|&place| self.0[place].latest);
            if let Some(oldest) = oldest {
                self.0.swap_remove(oldest);
            }
        }
        self.0.push(Peer {
            source,
            latest: now,
            noted: now,
            is_news: true,
        });
        true
    }

    /// When the latest part arrived from a peer.
    pub(super) fn latest(&self, source: JausId) -> Option<Instant> {
        let peer = self.0.iter().find(|peer| peer.source == source);
        peer.map(|peer| peer.latest)
    }

    /// The peers of which the component's process is to be notified.
    pub(super) fn take_news(&mut self) -> impl Iterator<Item = JausId> {
        let news = self.0.iter_mut();
        let news = news.filter_map(|peer| std::mem::take(&mut peer.is_news).then_some(peer));
        news.map(|peer| peer.source)
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_part_is_known_and_notified_at_intervals() {
        let (mut progress, start) = (Progress::default(), Instant::now());
        let peer = JausId::new(101, 1, 1);
        let mut notified = 0;
        for millisecond in 0..200 {
            let now = start + Duration::from_millis(millisecond);
            let is_news = progress.note(now, peer);
            assert_eq!(progress.latest(peer), Some(now));
            assert_eq!(progress.take_news().count(), usize::from(is_news));
            notified += u32::from(is_news);
        }
        assert_eq!(notified, 4);
    }

    #[test]
    fn the_peer_that_is_silent_longest_makes_room() {
        let (mut progress, start) = (Progress::default(), Instant::now());
        let peer = |number| JausId::new(101, 1, number);
        for number in 1..=17 {
            progress.note(start + Duration::from_millis(number.into()), peer(number));
        }
        let known = (1..=17).filter(|&number| progress.latest(peer(number)).is_some());
        assert!(known.eq(2..=17));
    }
}
