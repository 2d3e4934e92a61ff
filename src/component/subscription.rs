//! A subscription in the hands of an application: a stream of reports that says when it is down.

use std::future::poll_fn;
use std::marker::PhantomData;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Instant;

use super::Component;
use super::clients::Ticket;
use super::feed::{Feed, Item};
use crate::address::JausId;
use crate::codec::Message;
use crate::service::{Outage, SubscriptionEnd};

/// The reports of one peer, as they come. Made by [`Component::subscribe`]; dropping it ends the
/// event at the peer.
///
/// It looks after itself: it renews the event, notices when reports stop, and creates the event
/// anew until the peer is back, be it a second or a day later. In between, [`next`](Self::next)
/// says that it is down. Up to 256 updates wait for a slow reader; then the oldest report goes.
#[derive(Debug)]
pub struct Subscription<R> {
    /// Dropped before the component is.
    _ticket: Ticket,
    /// Keeps it running.
    _component: Component,
    peer: JausId,
    feed: Arc<Feed>,
    report: PhantomData<fn() -> R>,
}

/// What a subscription brings.
#[derive(Debug, Clone, PartialEq)]
pub enum Update<R> {
    /// A report.
    Report(R),
    /// Nothing comes at present.
    Down {
        /// When the last sign of the event came.
        since: Instant,
        /// What is the matter.
        why: Outage,
    },
    /// It is up: for the first time, or after it was down.
    Up,
}

impl<R: Message> Subscription<R> {
    pub(super) const fn new(
        ticket: Ticket,
        component: Component,
        peer: JausId,
        feed: Arc<Feed>,
    ) -> Self {
        Self {
            _ticket: ticket,
            _component: component,
            peer,
            feed,
            report: PhantomData,
        }
    }

    /// Waits for the next update; `None` when nothing will come any more, because the component
    /// has stopped or for the reason that [`end`](Self::end) gives.
    ///
    /// Nothing is lost if the returned future is dropped.
    pub async fn next(&mut self) -> Option<Update<R>> {
        poll_fn(|cx| self.poll_next(cx)).await
    }

    /// The same as [`next`](Self::next) for who writes futures by hand.
    pub fn poll_next(&mut self, cx: &mut Context<'_>) -> Poll<Option<Update<R>>> {
        loop {
            let Some(item) = ready!(self.feed.poll_next(cx)) else {
                return Poll::Ready(None);
            };
            let update = match item {
                Item::Up => Update::Up,
                Item::Down { since, why } => Update::Down { since, why },
                Item::Report(octets) => match R::decode(&octets) {
                    Ok(report) => Update::Report(report),
                    Err(error) => {
                        self.feed.count_unreadable();
                        tracing::debug!(peer = %self.peer, %error, "report cannot be read");
                        continue;
                    }
                },
            };
            return Poll::Ready(Some(update));
        }
    }

    /// Waits for the next report, whether or not the subscription was down in between; `None` as
    /// with [`next`](Self::next).
    pub async fn report(&mut self) -> Option<R> {
        loop {
            if let Update::Report(report) = self.next().await? {
                return Some(report);
            }
        }
    }
}

impl<R> Subscription<R> {
    /// Whose reports these are.
    #[must_use]
    pub const fn peer(&self) -> JausId {
        self.peer
    }

    /// Whether the event is up, as far as is known now.
    #[must_use]
    pub fn is_up(&self) -> bool {
        self.feed.condition().up
    }

    /// The rate in hertz that the peer has confirmed; `None` for reports on change.
    #[must_use]
    pub fn hz(&self) -> Option<f64> {
        self.feed.condition().hz
    }

    /// How many reports were lost on the way, told by gaps in their numbers.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.feed.condition().lost
    }

    /// How many reports were thrown away because [`next`](Self::next) was not asked often enough.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.feed.condition().missed
    }

    /// How many reports were not what their definition says.
    #[must_use]
    pub fn unreadable(&self) -> u64 {
        self.feed.condition().unreadable
    }

    /// Why the peer will send nothing any more, if it is over.
    #[must_use]
    pub fn end(&self) -> Option<SubscriptionEnd> {
        self.feed.end()
    }
}
