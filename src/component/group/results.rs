//! The results of an operation at each member of a group, and the limit of parallel operations.

use std::future::poll_fn;
use std::pin::Pin;
use std::task::Poll;

use crate::address::JausId;

/// The result at each member of a group, in order of their ids.
///
/// ```no_run
/// # use jaus::component::{Audience, Component};
/// # use jaus::messages::core::QueryIdentification;
/// # use jaus::messages::mobility::primitive_driver;
/// # async fn example(operator: Component) {
/// let drivers = Audience::from(primitive_driver::LATEST);
/// let results = operator.query_all(drivers, &QueryIdentification { query_type: 2.into() }).await;
/// for (member, error) in results.failures() {
///     eprintln!("{member}: {error}");
/// }
/// assert_eq!(results.is_complete(), results.successes().count() == results.len());
/// # }
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
#[must_use = "a group does not fail as a whole: check each member's result"]
pub struct Results<T, E>(Vec<(JausId, Result<T, E>)>);

impl<T, E> Results<T, E> {
    /// The number of members.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there were no members.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether there was at least one member and no failure.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        !self.is_empty() && self.0.iter().all(|(_, result)| result.is_ok())
    }

    /// Every member with its result.
    pub fn iter(&self) -> impl Iterator<Item = (JausId, &Result<T, E>)> {
        self.0.iter().map(|(id, result)| (*id, result))
    }

    /// The members without a failure, and their answers.
    pub fn successes(&self) -> impl Iterator<Item = (JausId, &T)> {
        let all = self.iter();
        all.filter_map(|(id, result)| result.as_ref().ok().map(|it| (id, it)))
    }

    /// The members with a failure, and the reason.
    pub fn failures(&self) -> impl Iterator<Item = (JausId, &E)> {
        let all = self.iter();
        all.filter_map(|(id, result)| result.as_ref().err().map(|it| (id, it)))
    }
}

impl<T, E> IntoIterator for Results<T, E> {
    type Item = (JausId, Result<T, E>);
    type IntoIter = std::vec::IntoIter<Self::Item>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

/// Runs an operation for each member, `at_once` of them in parallel, and waits for all.
pub(super) async fn of_each<T, E, F>(
    members: Vec<JausId>,
    at_once: usize,
    begin: impl Fn(JausId) -> F,
) -> Results<T, E>
where
    F: Future<Output = Result<T, E>>,
{
    let mut results = Vec::with_capacity(members.len());
    let mut waiting = members.into_iter();
    let mut running: Vec<(JausId, Pin<Box<F>>)> = Vec::new();
    let turn = poll_fn(|cx| {
        loop {
            let room = at_once.saturating_sub(running.len());
            let next = waiting.by_ref().take(room);
            running.extend(next.map(|member| (member, Box::pin(begin(member)))));
            let before = running.len();
            running.retain_mut(|(member, future)| match future.as_mut().poll(cx) {
                Poll::Ready(result) => {
                    results.push((*member, result));
                    false
                }
                Poll::Pending => true,
            });
            if running.is_empty() && waiting.len() == 0 {
                return Poll::Ready(());
            }
            if running.len() == before {
                return Poll::Pending;
            }
        }
    });
    turn.await;
    results.sort_unstable_by_key(|(member, _)| *member);
    Results(results)
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::time::Duration;

    use super::*;

    fn members(count: u8) -> Vec<JausId> {
        (1..=count).map(|it| JausId::new(101, 1, it)).collect()
    }

    #[tokio::test(start_paused = true)]
    async fn no_more_than_allowed_run_at_once_and_all_come_to_their_end_in_order() {
        let (running, most) = (Cell::new(0), Cell::new(0));
        let work = async |member: JausId| {
            running.set(running.get() + 1);
            most.set(most.get().max(running.get()));
            // The first ones take the longest.
            tokio::time::sleep(Duration::from_secs(100 / u64::from(member.component()))).await;
            running.set(running.get() - 1);
            match member.component() % 2 {
                0 => Ok(member),
                _ => Err(member),
            }
        };
        let results = of_each(members(20), 3, work).await;
        assert_eq!((results.len(), most.get()), (20, 3));
        assert_eq!(results.successes().count(), 10);
        assert!(results.failures().all(|(member, other)| member == *other));
        let order: Vec<JausId> = results.iter().map(|(member, _)| member).collect();
        assert_eq!(order, members(20));
    }

    #[tokio::test]
    async fn a_message_to_nobody_is_not_complete() {
        let nobody: Results<(), ()> = of_each(members(0), 3, async |_| Ok(())).await;
        assert!(nobody.is_empty() && !nobody.is_complete());
        let all: Results<(), ()> = of_each(members(2), 3, async |_| Ok(())).await;
        assert!(all.is_complete());
        let one = async |member: JausId| (member.component() == 1).then_some(()).ok_or(());
        assert!(!of_each(members(2), 3, one).await.is_complete());
    }
}
