//! The feed of a subscription: a bounded queue and the state, shared by the component's task and
//! the reader.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::Instant;

use bytes::Bytes;

use crate::service::{Outage, SubscriptionEnd, SubscriptionNews};

/// The queue between a subscription and its reader.
#[derive(Debug)]
pub(super) struct Feed {
    state: Mutex<State>,
}

/// An item in the queue.
#[derive(Debug)]
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
    queue: VecDeque<Item>,
    /// Limit of reports in the queue.
    depth: usize,
    condition: Condition,
    end: Option<Option<SubscriptionEnd>>,
    /// The reader's waker while it waits; there is at most one reader.
    reader: Option<Waker>,
}

/// The state of a subscription.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Condition {
    pub(super) up: bool,
    pub(super) hz: Option<f64>,
    /// Reports that the network or the peer lost.
    pub(super) lost: u64,
    /// Reports that were dropped because the reader was slow.
    pub(super) missed: u64,
    /// Reports that did not decode.
    pub(super) unreadable: u64,
}

impl Feed {
    /// Queue limit. For a slow reader, the oldest report is dropped.
    const CAPACITY: usize = 256;

    pub(super) fn new() -> Self {
        Self {
            state: Mutex::new(State {
                depth: Self::CAPACITY,
                ..State::default()
            }),
        }
    }

    /// Sets the limit of reports in the queue, 1 to 256.
    pub(super) fn set_depth(&self, reports: usize) {
        let mut state = self.lock();
        state.depth = reports.clamp(1, Self::CAPACITY);
        state.drop_excess();
    }

    /// The number of reports in the queue.
    pub(super) fn waiting(&self) -> usize {
        self.lock().waiting()
    }

    /// The component's side: queues a notification that has arrived now.
    pub(super) fn tell(&self, now: Instant, news: SubscriptionNews) {
        let mut state = self.lock();
        match news {
            SubscriptionNews::Up { hz } => state.rise(hz),
            SubscriptionNews::Report { report, lost } => {
                state.condition.lost += u64::from(lost);
                state.push(Item::Report {
                    octets: report,
                    arrived: now,
                });
            }
            SubscriptionNews::Down { since, why } => {
                state.condition.up = false;
                state.push(Item::Down { since, why });
            }
            SubscriptionNews::Ended(end) => state.end = Some(Some(end)),
        }
        wake(state);
    }

    /// Ends the feed because the component has stopped. The reader gets the queued items, and then
    /// the end.
    pub(super) fn stop(&self) {
        let mut state = self.lock();
        state.condition.up = false;
        state.end.get_or_insert(None);
        wake(state);
    }

    /// The reader's side: the next item, or `None` at the end.
    pub(super) fn poll_next(&self, cx: &mut Context<'_>) -> Poll<Option<Item>> {
        let mut state = self.lock();
        if let Some(item) = state.queue.pop_front() {
            return Poll::Ready(Some(item));
        }
        if state.end.is_some() {
            return Poll::Ready(None);
        }
        state.reader = Some(cx.waker().clone());
        Poll::Pending
    }

    pub(super) fn condition(&self) -> Condition {
        self.lock().condition
    }

    /// Why the subscription has ended, if the peer caused it.
    pub(super) fn end(&self) -> Option<SubscriptionEnd> {
        self.lock().end.clone().flatten()
    }

    pub(super) fn count_unreadable(&self) {
        self.lock().condition.unreadable += 1;
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Releases the lock, then wakes the reader if it waits.
fn wake(mut state: MutexGuard<'_, State>) {
    let reader = state.reader.take();
    drop(state);
    if let Some(reader) = reader {
        reader.wake();
    }
}

impl State {
    fn rise(&mut self, hz: Option<f64>) {
        self.condition.hz = hz;
        if !self.condition.up {
            self.condition.up = true;
            self.push(Item::Up);
        }
    }

    fn push(&mut self, item: Item) {
        if self.queue.len() >= Feed::CAPACITY && !self.drop_oldest_report() {
            self.queue.pop_front();
        }
        self.queue.push_back(item);
        self.drop_excess();
    }

    fn drop_excess(&mut self) {
        while self.waiting() > self.depth && self.drop_oldest_report() {}
    }

    /// Drops the oldest report; returns whether there was one.
    fn drop_oldest_report(&mut self) -> bool {
        let oldest = self.queue.iter().position(Item::is_report);
        let dropped = oldest.and_then(|oldest| self.queue.remove(oldest));
        self.condition.missed += u64::from(dropped.is_some());
        dropped.is_some()
    }

    fn waiting(&self) -> usize {
        self.queue.iter().filter(|item| item.is_report()).count()
    }
}

#[cfg(test)]
mod tests {
    use std::future::poll_fn;

    use super::*;

    async fn next(feed: &Feed) -> Option<Item> {
        poll_fn(|cx| feed.poll_next(cx)).await
    }

    fn tell(feed: &Feed, news: SubscriptionNews) {
        feed.tell(Instant::now(), news);
    }

    fn report(number: u8) -> SubscriptionNews {
        SubscriptionNews::Report {
            report: Bytes::copy_from_slice(&[number]),
            lost: 0,
        }
    }

    #[tokio::test]
    async fn a_slow_reader_loses_the_oldest_reports_and_is_told_how_many() {
        let feed = Feed::new();
        tell(&feed, SubscriptionNews::Up { hz: None });
        for number in 0..=255 {
            tell(&feed, report(number));
        }
        assert_eq!(feed.condition().missed, 1);
        assert!(matches!(next(&feed).await, Some(Item::Up)));
        let Some(Item::Report { octets, .. }) = next(&feed).await else {
            panic!("a report is due");
        };
        assert_eq!(octets[..], [1], "report 0 made room");
    }

    #[tokio::test]
    async fn a_reader_that_wants_the_latest_report_gets_it_and_no_outage_is_lost() {
        let feed = Feed::new();
        tell(&feed, report(1));
        tell(&feed, report(2));
        feed.set_depth(1);
        let (since, why) = (Instant::now(), Outage::Silent);
        tell(&feed, SubscriptionNews::Down { since, why });
        tell(&feed, SubscriptionNews::Up { hz: None });
        tell(&feed, report(3));
        assert_eq!((feed.waiting(), feed.condition().missed), (1, 2));
        assert!(matches!(next(&feed).await, Some(Item::Down { .. })));
        assert!(matches!(next(&feed).await, Some(Item::Up)));
        let latest = next(&feed).await;
        assert!(matches!(latest, Some(Item::Report { octets, .. }) if octets[..] == [3]));
        assert_eq!(feed.waiting(), 0);
    }

    #[tokio::test]
    async fn what_waits_is_read_before_the_end() {
        let feed = Feed::new();
        tell(&feed, report(7));
        feed.stop();
        assert!(matches!(next(&feed).await, Some(Item::Report { .. })));
        assert!(next(&feed).await.is_none() && next(&feed).await.is_none());
    }

    #[tokio::test]
    async fn a_reader_that_waits_is_woken_by_news_and_by_the_end() {
        let feed = Feed::new();
        let telling = async {
            tell(&feed, report(1));
            tokio::task::yield_now().await;
            feed.stop();
        };
        let reading = async { (next(&feed).await, next(&feed).await) };
        let (read, ()) = tokio::join!(reading, telling);
        assert!(matches!(read, (Some(Item::Report { .. }), None)));
    }
}
