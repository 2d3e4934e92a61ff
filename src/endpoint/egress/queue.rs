//! The egress queue of one hop: a remote end of a link, or its group.

use std::collections::VecDeque;
use std::time::Instant;

use bytes::Bytes;

use super::FragmentedSend;
use crate::endpoint::rate::Bucket;
use crate::wire::{Frame, Priority, Version};

const PRIORITIES: usize = Priority::ALL.len();

/// The unit of scheduling: the fragments or the whole messages of one priority.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::endpoint) struct Level(usize);

impl Level {
    pub(super) const COUNT: usize = 2 * PRIORITIES;

    pub(in crate::endpoint) const fn fragments(priority: Priority) -> Self {
        Self(priority.bits() as usize)
    }

    pub(in crate::endpoint) const fn whole(priority: Priority) -> Self {
        Self(PRIORITIES + priority.bits() as usize)
    }

    pub(super) const fn index(self) -> usize {
        self.0
    }

    pub(super) const fn is_fragments(self) -> bool {
        self.0 < PRIORITIES
    }

    pub(super) const fn priority(self) -> Priority {
        Priority::ALL[self.0 % PRIORITIES]
    }
}

/// The datagrams and fragments queued for one hop, by priority.
#[derive(Debug, Default)]
pub(in crate::endpoint) struct HopQueue {
    pub(super) whole: [VecDeque<Bytes>; PRIORITIES],
    fragmented: [VecDeque<FragmentedSend>; PRIORITIES],
    /// By level, whether the queue is in the list of queues with something to send.
    pub(super) listed: [bool; Level::COUNT],
    /// Until when messages wait to be packed with others.
    held_until: Option<Instant>,
    /// How far its fragments fill the remote receive buffer.
    bucket: Bucket,
    /// Until when the remote receive buffer has no room for fragments.
    blocked_until: Option<Instant>,
}

impl HopQueue {
    /// Queues a datagram. If it may be packed, it waits for others until `held_until`, or until the
    /// time already set; otherwise the whole queue stops waiting. A safety-critical datagram never
    /// waits, and does not change how long the others wait.
    pub(super) fn push(&mut self, priority: Priority, octets: Bytes, held_until: Option<Instant>) {
        self.whole[usize::from(priority.bits())].push_back(octets);
        if priority != Priority::SafetyCritical {
            self.held_until = held_until.map(|until| self.held_until.unwrap_or(until));
        }
    }

    pub(super) fn push_fragmented(&mut self, message: FragmentedSend) {
        let level = usize::from(message.whole.flags.priority().bits());
        self.fragmented[level].push_back(message);
    }

    /// Whether a level has something to send, if datagrams are packed up to `longest` octets.
    pub(super) fn is_ready(&self, level: Level, longest: usize) -> bool {
        let priority = usize::from(level.priority().bits());
        if level.is_fragments() {
            return self.blocked_until.is_none() && !self.fragmented[priority].is_empty();
        }
        let waiting = self.whole.iter().flatten();
        let fills = || waiting.map(|message| message.len() - 1).sum::<usize>() >= longest;
        !self.whole[priority].is_empty()
            && (self.held_until.is_none()
                || level.priority() == Priority::SafetyCritical
                || fills())
    }

    /// The levels in whose lists the queue must be entered.
    pub(super) fn list(&mut self, longest: usize) -> impl Iterator<Item = Level> + '_ {
        if self.whole.iter().all(VecDeque::is_empty) {
            self.held_until = None;
        }
        (0..Level::COUNT).map(Level).filter(move |level| {
            let is_new = !self.listed[level.index()] && self.is_ready(*level, longest);
            self.listed[level.index()] |= is_new;
            is_new
        })
    }

    /// The next fragment, if there is room for it, its header is the same, and it is not longer
    /// than those before it.
    pub(super) fn next_fragment(
        &mut self,
        now: Instant,
        level: Level,
        like: Option<(Version, usize)>,
    ) -> Option<Frame> {
        let waiting = &mut self.fragmented[usize::from(level.priority().bits())];
        let message = waiting.front_mut()?;
        let fits =
            |(version, octets)| message.whole.version == version && message.next_len() <= octets;
        if self.blocked_until.is_some() || !like.is_none_or(fits) {
            return None;
        }
        if let Some(pacing) = message.pacing
            && let Err(wait) = pacing.take(&mut self.bucket, now, message.next_len())
        {
            self.blocked_until = Some(now + wait);
            return None;
        }
        let frame = message.frame();
        if message.advance() {
            waiting.pop_front();
        }
        Some(frame)
    }

    /// When held messages and blocked fragments may continue.
    pub(super) fn deadlines(&self) -> impl Iterator<Item = Instant> {
        [self.held_until, self.blocked_until].into_iter().flatten()
    }

    pub(super) fn handle_timeout(&mut self, now: Instant) {
        self.held_until.take_if(|until| *until <= now);
        self.blocked_until.take_if(|until| *until <= now);
    }

    /// How many datagrams are queued, by priority, without fragments.
    pub(super) fn waiting(&self) -> [usize; PRIORITIES] {
        self.whole.each_ref().map(VecDeque::len)
    }

    /// How many fragments are queued, and their octets.
    pub(super) fn fragments(&self) -> (usize, usize) {
        let messages = self.fragmented.iter().flatten();
        messages.fold((0, 0), |(count, octets), message| {
            let left = message.cut.count() - message.next;
            (count + left, octets + message.remaining())
        })
    }

    /// Whether the queue can be dropped without losing anything.
    pub(super) fn is_idle(&self, now: Instant) -> bool {
        self.waiting() == [0; PRIORITIES] && self.fragments().0 == 0 && self.bucket.is_full(now)
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;
    use crate::address::JausId;
    use crate::endpoint::large::Cut;

    const LEVEL: Level = Level::fragments(Priority::Standard);

    /// A queue with a message of 10 octets in fragments of 4.
    fn queue() -> HopQueue {
        let payload = Bytes::from_static(b"0123456789");
        let mut queue = HopQueue::default();
        queue.push_fragmented(FragmentedSend {
            cut: Cut::new(payload.len(), 4, false),
            whole: Frame::new(JausId::new(1, 1, 1), JausId::new(2, 1, 1), payload),
            first: 1,
            next: 0,
            pacing: None,
        });
        queue
    }

    #[test]
    fn only_fragments_that_have_not_left_count_as_queued() {
        let (mut queue, now) = (queue(), Instant::now());
        for left in [(3, 10), (2, 6), (1, 2), (0, 0)] {
            assert_eq!(queue.fragments(), left);
            queue.next_fragment(now, LEVEL, None);
        }
    }

    #[test]
    fn a_fragment_joins_others_of_the_same_header_and_at_least_its_length() {
        for (like, joins) in [
            ((Version::As5669a, 4), true),
            ((Version::As5669a, 3), false),
            ((Version::Ra, 4), false),
        ] {
            let next = queue().next_fragment(Instant::now(), LEVEL, Some(like));
            assert_eq!(next.is_some(), joins, "{like:?}");
        }
    }

    #[test]
    fn held_messages_leave_when_they_fill_a_datagram_without_their_version_octets() {
        let (mut queue, until) = (HopQueue::default(), Instant::now());
        let level = Level::whole(Priority::Standard);
        for _message in 0..3 {
            let octets = Bytes::from_static(b"12345");
            queue.push(Priority::Standard, octets, Some(until));
        }
        assert!(queue.is_ready(level, 12) && !queue.is_ready(level, 13));
        queue.handle_timeout(until);
        assert!(queue.is_ready(level, 13));
    }

    #[test]
    fn a_queue_is_listed_once_for_each_level_with_something_to_send() {
        let mut queue = queue();
        queue.push(Priority::High, Bytes::from_static(b"12345"), None);
        let listed = |queue: &mut HopQueue| queue.list(0).collect::<Vec<_>>();
        let high = Level::whole(Priority::High);
        assert_eq!(listed(&mut queue), [LEVEL, high]);
        assert_eq!(listed(&mut queue), []);
        queue.listed[high.index()] = false;
        assert_eq!(listed(&mut queue), [high]);
    }

    #[test]
    fn a_queue_is_idle_without_messages_fragments_and_use_of_the_receive_buffer() {
        let now = Instant::now();
        assert!(HopQueue::default().is_idle(now) && !queue().is_idle(now));
        let mut busy = HopQueue::default();
        busy.push(Priority::Low, Bytes::from_static(b"12345"), None);
        assert!(!busy.is_idle(now));
        let mut paced = HopQueue::default();
        let time = std::time::Duration::from_millis(1);
        paced.bucket.spend(now, time);
        assert!(!paced.is_idle(now) && paced.is_idle(now + time));
    }
}
