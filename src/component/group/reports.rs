//! A subscription to a whole group: it subscribes to members as they are found, drops those that
//! leave, retries those that refuse, and merges all reports into one stream.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::future::poll_fn;
use std::ops::Bound;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use futures_core::Stream;
use tokio::sync::watch;

use super::member_table::MemberTable;
use crate::address::JausId;
use crate::codec::Message;
use crate::component::{Component, SubscribeError, Subscription, Update};
use crate::node::{now, sleep_until};
use crate::service::Audience;
use crate::service::{Outage, Topic};

/// The merged reports of all current members of an [`Audience`]. Created by
/// [`Component::subscribe_all`]; dropping it ends the events at all members.
///
/// A member that restarts under the same id is `Down` and then `Up` again, as in a single
/// [`Subscription`]. A member that Discovery loses, or that withdraws its service, is `Gone`, and
/// is subscribed to again when it returns. A member that refuses is retried at growing intervals.
/// All this happens only while [`next`](Self::next) is awaited.
///
/// ```no_run
/// # use jaus::component::{GroupSubscription, GroupUpdate};
/// # use jaus::messages::mobility::ReportVelocityState;
/// # async fn example(mut speeds: GroupSubscription<ReportVelocityState>) {
/// while let Some((sensor, update)) = speeds.next().await {
///     match update {
///         GroupUpdate::Report(report) => println!("{sensor}: {:?}", report.velocity_x_m_per_s()),
///         GroupUpdate::NotSubscribed { why, .. } => eprintln!("{sensor}: {why}"),
///         other => println!("{sensor}: {other:?}"),
///     }
/// }
/// # }
/// ```
pub struct GroupSubscription<R> {
    component: Component,
    audience: Audience,
    /// The peer is filled in for each member.
    topic: Topic,
    query: &'static str,
    directories: watch::Receiver<()>,
    /// Whether the members must be looked up.
    is_stale: bool,
    member_table: MemberTable,
    asked: BTreeMap<JausId, Asking<R>>,
    subscribed: BTreeMap<JausId, Subscription<R>>,
    news: VecDeque<(JausId, GroupUpdate<R>)>,
    /// The member of the last report. The next poll starts after it.
    last: JausId,
}

/// A pending subscription to one member.
type Asking<R> = Pin<Box<dyn Future<Output = Result<Subscription<R>, SubscribeError>> + Send>>;

/// An update about one member of a group subscription.
#[derive(Debug, Clone, PartialEq)]
pub enum GroupUpdate<R> {
    /// A report.
    Report(R),
    /// It is up: for the first time, or after an outage.
    Up,
    /// Reports have stopped.
    Down {
        /// Time of the last sign of the event.
        since: Instant,
        /// The cause.
        why: Outage,
    },
    /// It belongs to the audience, but the subscription failed.
    NotSubscribed {
        /// The reason.
        why: SubscribeError,
        /// The time until the next attempt.
        again: Duration,
    },
    /// It no longer belongs to the audience.
    Gone,
}

impl<R> From<Update<R>> for GroupUpdate<R> {
    fn from(update: Update<R>) -> Self {
        match update {
            Update::Report(report) => Self::Report(report),
            Update::Up => Self::Up,
            Update::Down { since, why } => Self::Down { since, why },
        }
    }
}

impl<R: Message> GroupSubscription<R> {
    pub(super) fn new(
        component: Component,
        audience: Audience,
        topic: Topic,
        query: &'static str,
    ) -> Self {
        Self {
            last: component.id(),
            directories: component.shared.directories.clone(),
            is_stale: true,
            component,
            audience,
            topic,
            query,
            member_table: MemberTable::default(),
            asked: BTreeMap::new(),
            subscribed: BTreeMap::new(),
            news: VecDeque::new(),
        }
    }

    /// Waits for the next update and its member; `None` when the component has stopped.
    ///
    /// Cancel safe: dropping the returned future loses nothing.
    pub async fn next(&mut self) -> Option<(JausId, GroupUpdate<R>)> {
        loop {
            if std::mem::take(&mut self.is_stale) {
                self.update_members();
            }
            self.subscribe_due_members();
            if let Some(news) = self.news.pop_front() {
                return Some(news);
            }
            let wake = self.member_table.poll_timeout();
            let Self {
                directories,
                is_stale,
                member_table,
                asked,
                subscribed,
                news,
                last,
                query,
                ..
            } = self;
            let members = poll_fn(|cx| {
                let answered = poll_asked(cx, asked, subscribed, member_table, news);
                let reported = poll_subscribed(cx, *last, query, subscribed, member_table, news);
                if answered || reported {
                    return Poll::Ready(());
                }
                Poll::Pending
            });
            tokio::select! {
                biased;
                () = members => {}
                changed = directories.changed() => {
                    changed.ok()?;
                    *is_stale = true;
                }
                () = sleep_until(wake) => {}
            }
            if let Some((member, GroupUpdate::Report(_))) = self.news.back() {
                self.last = *member;
            }
        }
    }

    /// Adds new members, and drops those that have left.
    fn update_members(&mut self) {
        self.directories.mark_unchanged();
        let directory = self.component.directory();
        let present = self.audience.members(&directory, self.component.id());
        for left in self.member_table.handle_present(&present) {
            self.asked.remove(&left);
            self.subscribed.remove(&left);
            self.news.push_back((left, GroupUpdate::Gone));
        }
    }

    fn subscribe_due_members(&mut self) {
        while let Some(peer) = self.member_table.poll_ask(now()) {
            let component = self.component.clone();
            let topic = Topic {
                peer,
                ..self.topic.clone()
            };
            let query = self.query;
            let asking = async move { component.subscribe_to(topic, query).await };
            self.asked.insert(peer, Box::pin(asking));
        }
    }
}

impl<R> GroupSubscription<R> {
    /// The audience of the subscription.
    #[must_use]
    pub const fn audience(&self) -> &Audience {
        &self.audience
    }

    /// The members that have confirmed, each with its own subscription.
    pub fn members(&self) -> impl Iterator<Item = (JausId, &Subscription<R>)> {
        self.subscribed.iter().map(|(&id, it)| (id, it))
    }
}

impl<R> fmt::Debug for GroupSubscription<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("GroupSubscription")
            .field("audience", &self.audience)
            .field("query", &self.query)
            .field("members", &self.subscribed.keys())
            .finish_non_exhaustive()
    }
}

type News<R> = VecDeque<(JausId, GroupUpdate<R>)>;

/// Polls pending subscriptions; returns whether any has completed.
fn poll_asked<R>(
    cx: &mut Context<'_>,
    asked: &mut BTreeMap<JausId, Asking<R>>,
    subscribed: &mut BTreeMap<JausId, Subscription<R>>,
    member_table: &mut MemberTable,
    news: &mut News<R>,
) -> bool {
    let before = asked.len();
    asked.retain(|&member, asking| {
        match asking.as_mut().poll(cx) {
            Poll::Pending => return true,
            Poll::Ready(Ok(subscription)) => {
                member_table.handle_subscribed(member);
                subscribed.insert(member, subscription);
            }
            // The end of the whole stream reports this.
            Poll::Ready(Err(SubscribeError::Stopped)) => {}
            Poll::Ready(Err(why)) => {
                let again = member_table.handle_refused(now(), member);
                news.push_back((member, GroupUpdate::NotSubscribed { why, again }));
            }
        }
        false
    });
    asked.len() < before
}

/// Polls for the next update, starting with the members after `last`; returns whether there was
/// one.
fn poll_subscribed<R: Message>(
    cx: &mut Context<'_>,
    last: JausId,
    query: &'static str,
    subscribed: &mut BTreeMap<JausId, Subscription<R>>,
    member_table: &mut MemberTable,
    news: &mut News<R>,
) -> bool {
    let behind = (Bound::Excluded(last), Bound::Unbounded);
    let up_to = (Bound::Unbounded, Bound::Included(last));
    for part in [behind, up_to] {
        for (&member, subscription) in subscribed.range_mut(part) {
            match Pin::new(&mut *subscription).poll_next(cx) {
                Poll::Pending => {}
                Poll::Ready(Some(update)) => {
                    news.push_back((member, update.into()));
                    return true;
                }
                Poll::Ready(None) => {
                    let end = subscription.end();
                    subscribed.remove(&member);
                    // Without a reason the component has stopped, which the end of the whole stream
                    // reports.
                    if let Some(why) = end {
                        let again = member_table.handle_refused(now(), member);
                        let why = SubscribeError::Ended {
                            peer: member,
                            query,
                            why,
                        };
                        news.push_back((member, GroupUpdate::NotSubscribed { why, again }));
                    }
                    return true;
                }
            }
        }
    }
    false
}
