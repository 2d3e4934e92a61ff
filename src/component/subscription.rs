//! The application's handle for a subscription: a stream of reports and outages.

use std::future::poll_fn;
use std::marker::PhantomData;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::{Duration, Instant};

use bytes::Bytes;
use futures_core::Stream;

use super::Component;
use super::clients::Ticket;
use super::feed::{Item, Reader};
use crate::address::JausId;
use crate::codec::{DecodeError, Message};
use crate::node::now;
use crate::service::{Outage, SubscriptionEnd};

/// The stream of one peer's reports. Created by [`Component::subscribe`]; dropping it ends the
/// event at the peer.
///
/// It renews the event, detects when reports stop, and creates the event again until the peer is
/// back, after a second or a day. In the meantime [`next`](Self::next) reports the outage. Up to
/// 256 updates wait for a slow reader, or fewer as set by [`depth`](Self::depth); then the oldest
/// report is dropped. It is a [`Stream`] too.
///
/// Several tasks read one subscription, each at its own pace ([`share`](Self::share)):
///
/// ```no_run
/// # use jaus::component::Subscription;
/// # use jaus::messages::mobility::ReportVelocityState;
/// # fn share(speeds: Subscription<ReportVelocityState>) {
/// let mut latest = speeds.share().depth(1);
/// tokio::spawn(async move {
///     while let Some(report) = latest.report().await {
///         println!("{report:?}, {:?} after its arrival", latest.age());
///     }
/// });
/// # }
/// ```
#[derive(Debug)]
pub struct Subscription<R> {
    /// Shared by all readers.
    event: Arc<Event>,
    peer: JausId,
    reader: Reader,
    /// When the report that was read last arrived.
    arrived: Option<Instant>,
    report: PhantomData<fn() -> R>,
}

/// The event at the peer. It ends with the last reader.
#[derive(Debug)]
struct Event {
    /// Dropped before the component.
    _ticket: Ticket,
    /// Keeps the component running.
    _component: Component,
}

/// An item of a subscription's stream.
///
/// ```no_run
/// # use jaus::component::{Subscription, Update};
/// # use jaus::messages::mobility::ReportVelocityState;
/// # async fn example(mut speeds: Subscription<ReportVelocityState>) {
/// while let Some(update) = speeds.next().await {
///     match update {
///         Update::Report(report) => println!("{:?} m/s", report.velocity_x_m_per_s()),
///         Update::Down { why, .. } => println!("no reports: {why}"),
///         Update::Up => println!("reports again"),
///     }
/// }
/// # }
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum Update<R> {
    /// A report.
    Report(R),
    /// No reports arrive at present.
    Down {
        /// Time of the last sign of the event.
        since: Instant,
        /// The cause.
        why: Outage,
    },
    /// The event is up: for the first time, or after an outage.
    Up,
}

/// What a [`Subscription`] yields: a type of message, or [`Undecoded`] reports.
pub trait FromReport: Sized {
    /// Reads a report, from its message code.
    ///
    /// # Errors
    /// If the octets do not match the definition.
    fn from_report(octets: &Bytes) -> Result<Self, DecodeError>;
}

impl<R: Message> FromReport for R {
    fn from_report(octets: &Bytes) -> Result<Self, DecodeError> {
        R::decode(octets)
    }
}

/// A report as it arrived, from its message code: for programs that read definitions at run time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Undecoded(pub Bytes);

impl FromReport for Undecoded {
    fn from_report(octets: &Bytes) -> Result<Self, DecodeError> {
        Ok(Self(octets.clone()))
    }
}

impl<R: Message> Subscription<R> {
    /// Reads the reports in the layout of another version, from a peer that offers only that.
    #[must_use]
    pub fn with_layout<L: Message>(self) -> Subscription<L> {
        const { assert!(L::CODE == R::CODE, "this is a layout of another report") }
        Subscription::of(self.event, self.peer, self.reader)
    }
}

impl<R: FromReport> Subscription<R> {
    pub(super) fn new(ticket: Ticket, component: Component, peer: JausId, reader: Reader) -> Self {
        let event = Event {
            _ticket: ticket,
            _component: component,
        };
        Self::of(Arc::new(event), peer, reader)
    }

    /// Waits for the next update. `None` at the end, because the component has stopped or for the
    /// reason given by [`end`](Self::end).
    ///
    /// Cancel safe: dropping the returned future loses nothing.
    pub async fn next(&mut self) -> Option<Update<R>> {
        poll_fn(|cx| Pin::new(&mut *self).poll_next(cx)).await
    }

    /// Waits for the next report, across outages; `None` as for [`next`](Self::next).
    pub async fn report(&mut self) -> Option<R> {
        loop {
            if let Update::Report(report) = self.next().await? {
                return Some(report);
            }
        }
    }
}

impl<R: FromReport> Stream for Subscription<R> {
    type Item = Update<R>;

    fn poll_next(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Update<R>>> {
        loop {
            let Some(item) = ready!(self.reader.poll_next(cx)) else {
                return Poll::Ready(None);
            };
            let update = match item {
                Item::Up => Update::Up,
                Item::Down { since, why } => Update::Down { since, why },
                Item::Report { octets, arrived } => match R::from_report(&octets) {
                    Ok(report) => {
                        self.arrived = Some(arrived);
                        Update::Report(report)
                    }
                    Err(error) => {
                        self.reader.count_unreadable();
                        tracing::debug!(peer = %self.peer, %error, "cannot decode the report");
                        continue;
                    }
                },
            };
            return Poll::Ready(Some(update));
        }
    }
}

impl<R> Subscription<R> {
    const fn of(event: Arc<Event>, peer: JausId, reader: Reader) -> Self {
        Self {
            event,
            peer,
            reader,
            arrived: None,
            report: PhantomData,
        }
    }

    /// Another reader of the same event, for another task: the peer sends each report once. It
    /// starts with the updates that wait for this one and with the same [depth](Self::depth), and
    /// counts by itself what it misses. The event ends when the last reader is dropped.
    #[must_use]
    pub fn share(&self) -> Self {
        Self::of(self.event.clone(), self.peer, self.reader.share())
    }

    /// Lets at most this many reports wait for a slow reader, 1 to 256, which is the default. With
    /// 1, a reader always gets the latest report. Older ones count as [missed](Self::missed).
    #[must_use]
    pub fn depth(self, reports: usize) -> Self {
        self.reader.set_depth(reports);
        self
    }

    /// The number of reports that wait to be read.
    #[must_use]
    pub fn waiting(&self) -> usize {
        self.reader.waiting()
    }

    /// How long ago the report that was read last arrived. `None` before the first. The sample in it
    /// is older, by the time that it took to get here; only a time stamp in the report shows that.
    #[must_use]
    pub fn age(&self) -> Option<Duration> {
        self.arrived.map(|arrived| now() - arrived)
    }

    /// The component that sends the reports.
    #[must_use]
    pub const fn peer(&self) -> JausId {
        self.peer
    }

    /// Whether the event is up, as far as known now.
    #[must_use]
    pub fn is_up(&self) -> bool {
        self.reader.condition().up
    }

    /// The rate in hertz that the peer has confirmed; `None` for reports on change.
    #[must_use]
    pub fn hz(&self) -> Option<f64> {
        self.reader.condition().hz
    }

    /// The number of reports lost in transit, from gaps in the sequence numbers.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.reader.condition().lost
    }

    /// The number of reports dropped because [`next`](Self::next) was not called often enough.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.reader.tally().missed
    }

    /// The number of reports that did not decode.
    #[must_use]
    pub fn unreadable(&self) -> u64 {
        self.reader.tally().unreadable
    }

    /// Why the peer ended the subscription, if it did.
    #[must_use]
    pub fn end(&self) -> Option<SubscriptionEnd> {
        self.reader.end()
    }
}
