//! The feed of a subscription: its state, and a bounded queue for each reader, shared by the
//! component's task and the readers.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::Instant;

use bytes::Bytes;

use crate::service::{Outage, SubscriptionEnd, SubscriptionNews};

/// The connection between a subscription and its readers.
#[derive(Debug, Default)]
pub(super) struct Feed {
    state: Mutex<State>,
}

/// One reader of a feed. Dropping it drops its queue.
#[derive(Debug)]
pub(super) struct Reader {
    feed: Arc<Feed>,
    number: u64,
}

/// An item in a queue.
#[derive(Debug, Clone)]
pub(super) enum Item {
    Report { octets: Bytes, arrived: Instant },
    Down { since: Instant, why: Outage },
    Up,
}

impl Item {
    const fn is_report(&self) -> bool {
        matches!(self, Self::Report { .. })
    }
}

#[derive(Debug, Default)]
struct State {
    condition: Condition,
    end: Option<Option<SubscriptionEnd>>,
    /// The queue of each reader, by its number.
    queues: BTreeMap<u64, Queue>,
    /// The number of the last reader.
    last: u64,
}

/// The state of a subscription.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Condition {
    pub(super) up: bool,
    pub(super) hz: Option<f64>,
    /// Reports that the network or the peer lost.
    pub(super) lost: u64,
}

/// What waits for one reader.
#[derive(Debug)]
struct Queue {
    items: VecDeque<Item>,
    /// Limit of reports.
    depth: usize,
    tally: Tally,
    /// The reader's waker while it waits.
    waker: Option<Waker>,
}

/// Reports that one reader did not get.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Tally {
    /// Dropped because the reader was slow.
    pub(super) missed: u64,
    /// Did not decode.
    pub(super) unreadable: u64,
}

impl Feed {
    /// The component's side: queues a notification that has arrived now.
    pub(super) fn tell(&self, now: Instant, news: SubscriptionNews) {
        let mut state = self.lock();
        match news {
            SubscriptionNews::Up { hz } => state.rise(hz),
            SubscriptionNews::Report { report, lost } => {
                state.condition.lost += u64::from(lost);
                state.push(&Item::Report {
                    octets: report,
                    arrived: now,
                });
            }
            SubscriptionNews::Down { since, why } => {
                state.condition.up = false;
                state.push(&Item::Down { since, why });
            }
            SubscriptionNews::Ended(end) => state.end = Some(Some(end)),
        }
        wake(state);
    }

    /// Ends the feed because the component has stopped. The readers get the queued items, and then
    /// the end.
    pub(super) fn stop(&self) {
        let mut state = self.lock();
        state.condition.up = false;
        state.end.get_or_insert(None);
        wake(state);
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Reader {
    /// A feed and its first reader.
    pub(super) fn new() -> (Arc<Feed>, Self) {
        let feed = Arc::<Feed>::default();
        let number = feed.lock().add(Queue::default());
        let reader = Self {
            feed: feed.clone(),
            number,
        };
        (feed, reader)
    }

    /// Another reader, for which the same items wait.
    pub(super) fn share(&self) -> Self {
        let mut state = self.feed.lock();
        let queue = state.queues.get(&self.number).map(Queue::share);
        let number = state.add(queue.unwrap_or_default());
        drop(state);
        Self {
            feed: self.feed.clone(),
            number,
        }
    }

    /// Sets the limit of reports in the queue, 1 to 256.
    pub(super) fn set_depth(&self, reports: usize) {
        self.with_queue(|queue| {
            queue.depth = reports.clamp(1, Queue::CAPACITY);
            queue.drop_excess();
        });
    }

    /// The number of reports in the queue.
    pub(super) fn waiting(&self) -> usize {
        self.with_queue(|queue| queue.waiting()).unwrap_or_default()
    }

    /// The next item, or `None` at the end.
    pub(super) fn poll_next(&self, cx: &mut Context<'_>) -> Poll<Option<Item>> {
        let mut state = self.feed.lock();
        let has_ended = state.end.is_some();
        let Some(queue) = state.queues.get_mut(&self.number) else {
            return Poll::Ready(None);
        };
        if let Some(item) = queue.items.pop_front() {
            return Poll::Ready(Some(item));
        }
        if has_ended {
            return Poll::Ready(None);
        }
        let before = queue.waker.replace(cx.waker().clone());
        // A waker may own a task with a reader, which needs the lock when it is dropped.
        drop(state);
        drop(before);
        Poll::Pending
    }

    pub(super) fn condition(&self) -> Condition {
        self.feed.lock().condition
    }

    /// Why the subscription has ended, if the peer caused it.
    pub(super) fn end(&self) -> Option<SubscriptionEnd> {
        self.feed.lock().end.clone().flatten()
    }

    pub(super) fn count_unreadable(&self) {
        self.with_queue(|queue| queue.tally.unreadable += 1);
    }

    pub(super) fn tally(&self) -> Tally {
        self.with_queue(|queue| queue.tally).unwrap_or_default()
    }

    /// Works on the reader's queue, which exists as long as the reader.
    fn with_queue<T>(&self, work: impl FnOnce(&mut Queue) -> T) -> Option<T> {
        self.feed.lock().queues.get_mut(&self.number).map(work)
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        let queue = self.feed.lock().queues.remove(&self.number);
        // Its waker, without the lock.
        drop(queue);
    }
}

/// Releases the lock, then wakes the readers that wait.
fn wake(mut state: MutexGuard<'_, State>) {
    let queues = state.queues.values_mut();
    let wakers: Vec<_> = queues.filter_map(|queue| queue.waker.take()).collect();
    drop(state);
    for waker in wakers {
        waker.wake();
    }
}

impl State {
    fn rise(&mut self, hz: Option<f64>) {
        self.condition.hz = hz;
        if !self.condition.up {
            self.condition.up = true;
            self.push(&Item::Up);
        }
    }

    /// Adds a reader's queue. Returns its number.
    fn add(&mut self, queue: Queue) -> u64 {
        self.last += 1;
        self.queues.insert(self.last, queue);
        self.last
    }

    fn push(&mut self, item: &Item) {
        for queue in self.queues.values_mut() {
            queue.push(item.clone());
        }
    }
}

impl Default for Queue {
    fn default() -> Self {
        Self {
            items: VecDeque::new(),
            depth: Self::CAPACITY,
            tally: Tally::default(),
            waker: None,
        }
    }
}

impl Queue {
    /// Limit of items. For a slow reader, the oldest report is dropped.
    const CAPACITY: usize = 256;

    /// The queue of another reader, for which the same items wait.
    fn share(&self) -> Self {
        Self {
            items: self.items.clone(),
            depth: self.depth,
            ..Self::default()
        }
    }

    fn push(&mut self, item: Item) {
        if self.items.len() >= Self::CAPACITY && !self.drop_oldest_report() {
            self.items.pop_front();
        }
        self.items.push_back(item);
        self.drop_excess();
    }

    fn drop_excess(&mut self) {
        while self.waiting() > self.depth && self.drop_oldest_report() {}
    }

    /// Drops the oldest report; returns whether there was one.
    fn drop_oldest_report(&mut self) -> bool {
        let oldest = self.items.iter().position(Item::is_report);
        let dropped = oldest.and_then(|oldest| self.items.remove(oldest));
        self.tally.missed += u64::from(dropped.is_some());
        dropped.is_some()
    }

    fn waiting(&self) -> usize {
        self.items.iter().filter(|item| item.is_report()).count()
    }
}

#[cfg(test)]
mod tests {
    use std::future::poll_fn;

    use super::*;

    async fn next(reader: &Reader) -> Option<Item> {
        poll_fn(|cx| reader.poll_next(cx)).await
    }

    fn tell(feed: &Feed, news: SubscriptionNews) {
        feed.tell(Instant::now(), news);
    }

    /// The number in a report.
    fn number(item: Option<Item>) -> Option<u8> {
        match item? {
            Item::Report { octets, .. } => octets.first().copied(),
            _ => None,
        }
    }

    fn report(number: u8) -> SubscriptionNews {
        SubscriptionNews::Report {
            report: Bytes::copy_from_slice(&[number]),
            lost: 0,
        }
    }

    #[tokio::test]
    async fn a_slow_reader_loses_the_oldest_reports_and_is_told_how_many() {
        let (feed, reader) = Reader::new();
        tell(&feed, SubscriptionNews::Up { hz: None });
        for number in 0..=255 {
            tell(&feed, report(number));
        }
        assert_eq!(reader.tally().missed, 1);
        assert!(matches!(next(&reader).await, Some(Item::Up)));
        let Some(Item::Report { octets, .. }) = next(&reader).await else {
            panic!("a report is due");
        };
        assert_eq!(octets[..], [1], "report 0 made room");
    }

    #[tokio::test]
    async fn a_reader_that_wants_the_latest_report_gets_it_and_no_outage_is_lost() {
        let (feed, reader) = Reader::new();
        tell(&feed, report(1));
        tell(&feed, report(2));
        reader.set_depth(1);
        let (since, why) = (Instant::now(), Outage::Silent);
        tell(&feed, SubscriptionNews::Down { since, why });
        tell(&feed, SubscriptionNews::Up { hz: None });
        tell(&feed, report(3));
        assert_eq!((reader.waiting(), reader.tally().missed), (1, 2));
        assert!(matches!(next(&reader).await, Some(Item::Down { .. })));
        assert!(matches!(next(&reader).await, Some(Item::Up)));
        let latest = next(&reader).await;
        assert!(matches!(latest, Some(Item::Report { octets, .. }) if octets[..] == [3]));
        assert_eq!(reader.waiting(), 0);
    }

    #[tokio::test]
    async fn what_waits_is_read_before_the_end() {
        let (feed, reader) = Reader::new();
        tell(&feed, report(7));
        feed.stop();
        assert!(matches!(next(&reader).await, Some(Item::Report { .. })));
        assert!(next(&reader).await.is_none() && next(&reader).await.is_none());
    }

    #[tokio::test]
    async fn a_reader_that_waits_is_woken_by_news_and_by_the_end() {
        let (feed, reader) = Reader::new();
        let telling = async {
            tell(&feed, report(1));
            tokio::task::yield_now().await;
            feed.stop();
        };
        let reading = async { (next(&reader).await, next(&reader).await) };
        let (read, ()) = tokio::join!(reading, telling);
        assert!(matches!(read, (Some(Item::Report { .. }), None)));
    }

    #[tokio::test]
    async fn each_reader_has_its_own_queue_and_starts_with_what_waits_for_the_first() {
        let (feed, first) = Reader::new();
        tell(&feed, report(1));
        let second = first.share();
        first.set_depth(1);
        tell(&feed, report(2));
        assert_eq!(number(next(&first).await), Some(2));
        assert_eq!(number(next(&second).await), Some(1));
        assert_eq!(number(next(&second).await), Some(2));
        assert_eq!((first.tally().missed, second.tally().missed), (1, 0));
        drop(first);
        tell(&feed, report(3));
        assert_eq!(number(next(&second).await), Some(3));
        let both = async { tokio::join!(next(&second), async { feed.stop() }) };
        assert!(both.await.0.is_none());
        assert!(next(&second.share()).await.is_none(), "after the end");
    }
}
