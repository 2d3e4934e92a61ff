//! A subscription to a whole group: it takes in who comes, lets go of who leaves, and asks again
//! who refuses, and is one stream to its reader.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::future::poll_fn;
use std::ops::Bound;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use tokio::sync::watch;

use super::Audience;
use super::member_table::MemberTable;
use crate::address::JausId;
use crate::codec::Message;
use crate::component::driver::sleep_until;
use crate::component::{Component, SubscribeError, Subscription, Update};
use crate::service::{Outage, Topic};

/// The reports of all members of an [`Audience`], as they come, whoever they are at the time. Made
/// by [`Component::subscribe_all`]; dropping it ends the events at all of them.
///
/// A member that restarts under the same id is `Down` and `Up` again, as in a single
/// [`Subscription`]; one that Discovery gives up, or that takes its service back, is `Gone`, and is
/// subscribed to anew when it comes again. One that refuses is asked again, less and less often.
/// It works while [`next`](Self::next) is waited for.
pub struct GroupSubscription<R> {
    component: Component,
    audience: Audience,
    /// With the peer left to be filled in.
    topic: Topic,
    query: &'static str,
    directories: watch::Receiver<()>,
    /// Whether the members are to be looked up.
    is_stale: bool,
    member_table: MemberTable,
    asked: BTreeMap<JausId, Asking<R>>,
    subscribed: BTreeMap<JausId, Subscription<R>>,
    news: VecDeque<(JausId, GroupUpdate<R>)>,
    /// Who had a report last: the next one's turn is first.
    last: JausId,
}

/// A subscription to one member in the making.
type Asking<R> = Pin<Box<dyn Future<Output = Result<Subscription<R>, SubscribeError>> + Send>>;

/// What a group subscription brings of one member.
#[derive(Debug, Clone, PartialEq)]
pub enum GroupUpdate<R> {
    /// A report.
    Report(R),
    /// It is up: for the first time, or after it was down.
    Up,
    /// Nothing comes at present.
    Down {
        /// When the last sign of the event came.
        since: Instant,
        /// What is the matter.
        why: Outage,
    },
    /// It belongs to the audience, but cannot be subscribed to.
    NotSubscribed {
        /// Why not.
        why: SubscribeError,
        /// After how long it is tried again.
        again: Duration,
    },
    /// It does not belong to the audience any more.
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

    /// Waits for the next update, and says whose it is; `None` when the component has stopped.
    ///
    /// Nothing is lost if the returned future is dropped.
    pub async fn next(&mut self) -> Option<(JausId, GroupUpdate<R>)> {
        loop {
            if std::mem::take(&mut self.is_stale) {
                self.call_the_roll();
            }
            self.ask_who_is_due();
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

    /// Takes in who has come, and lets go of who has left.
    fn call_the_roll(&mut self) {
        self.directories.mark_unchanged();
        let directory = self.component.directory();
        let present = self.audience.members(&directory, self.component.id());
        for left in self.member_table.handle_present(&present) {
            self.asked.remove(&left);
            self.subscribed.remove(&left);
            self.news.push_back((left, GroupUpdate::Gone));
        }
    }

    fn ask_who_is_due(&mut self) {
        while let Some(peer) = self.member_table.poll_ask(Instant::now()) {
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
    /// Whose reports these are.
    #[must_use]
    pub const fn audience(&self) -> &Audience {
        &self.audience
    }

    /// Those who have confirmed, each with its own subscription.
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

/// Sees who has answered; says whether anybody has.
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
            // That is told by the end of everything.
            Poll::Ready(Err(SubscribeError::Stopped)) => {}
            Poll::Ready(Err(why)) => {
                let again = member_table.handle_refused(Instant::now(), member);
                news.push_back((member, GroupUpdate::NotSubscribed { why, again }));
            }
        }
        false
    });
    asked.len() < before
}

/// Looks for the next update, first of those behind `last`; says whether there was anything.
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
            match subscription.poll_next(cx) {
                Poll::Pending => {}
                Poll::Ready(Some(update)) => {
                    news.push_back((member, update.into()));
                    return true;
                }
                Poll::Ready(None) => {
                    let end = subscription.end();
                    subscribed.remove(&member);
                    // Without a reason the component has stopped, which is told by the end of all.
                    if let Some(why) = end {
                        let again = member_table.handle_refused(Instant::now(), member);
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
