//! The member table of a group subscription: which members to ask, and when. It is updated on each
//! change of the directory, does no I/O and reads no clock.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::address::JausId;

/// The members of a group, and the state of each subscription.
#[derive(Debug, Default)]
pub(super) struct MemberTable {
    members: BTreeMap<JausId, Member>,
}

#[derive(Debug)]
struct Member {
    state: State,
    /// The number of refusals since it was found.
    refusals: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Due,
    Asked,
    Subscribed,
    Pausing { until: Instant },
}

impl MemberTable {
    /// How many members are asked at the same time.
    const MOST_ASKED: usize = 32;
    /// The pause after the first refusal …
    const FIRST_PAUSE: Duration = Duration::from_secs(1);
    /// … which doubles up to this.
    const LONGEST_PAUSE: Duration = Duration::from_secs(32);

    /// Updates the members with the sorted list of those now present. Returns those that have left.
    pub(super) fn handle_present(&mut self, present: &[JausId]) -> Vec<JausId> {
        for &id in present {
            self.members.entry(id).or_insert(Member {
                state: State::Due,
                refusals: 0,
            });
        }
        let is_present = |id: &JausId| present.binary_search(id).is_ok();
        let known = self.members.keys().copied();
        let left = known.filter(|id| !is_present(id)).collect();
        self.members.retain(|id, _| is_present(id));
        left
    }

    /// The next member to ask for a subscription, if any.
    pub(super) fn poll_ask(&mut self, now: Instant) -> Option<JausId> {
        let asked = self.members.values().filter(|it| it.state == State::Asked);
        if asked.count() >= Self::MOST_ASKED {
            return None;
        }
        let is_due = |it: &Member| match it.state {
            State::Due => true,
            State::Pausing { until } => until <= now,
            State::Asked | State::Subscribed => false,
        };
        let (&id, member) = self.members.iter_mut().find(|(_, it)| is_due(it))?;
        member.state = State::Asked;
        Some(id)
    }

    /// Notes that a member has confirmed the subscription.
    pub(super) fn handle_subscribed(&mut self, id: JausId) {
        if let Some(member) = self.members.get_mut(&id) {
            member.state = State::Subscribed;
        }
    }

    /// Notes that a member has refused or ended the subscription. Returns the pause before the next
    /// request.
    pub(super) fn handle_refused(&mut self, now: Instant, id: JausId) -> Duration {
        let Some(member) = self.members.get_mut(&id) else {
            return Self::LONGEST_PAUSE;
        };
        let pause = Self::FIRST_PAUSE * 2_u32.saturating_pow(member.refusals.min(16));
        let pause = pause.min(Self::LONGEST_PAUSE);
        member.refusals += 1;
        member.state = State::Pausing { until: now + pause };
        pause
    }

    /// When the next pause ends.
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let pauses = self.members.values().filter_map(|it| match it.state {
            State::Pausing { until } => Some(until),
            State::Due | State::Asked | State::Subscribed => None,
        });
        pauses.min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: JausId = JausId::new(101, 1, 33);
    const B: JausId = JausId::new(102, 1, 33);

    fn asked(member_table: &mut MemberTable, now: Instant) -> Vec<JausId> {
        std::iter::from_fn(|| member_table.poll_ask(now)).collect()
    }

    #[test]
    fn who_comes_is_asked_once_and_who_leaves_is_told_of_once() {
        let now = Instant::now();
        let mut member_table = MemberTable::default();
        assert!(member_table.handle_present(&[A]).is_empty());
        assert_eq!(asked(&mut member_table, now), [A]);
        assert!(member_table.handle_present(&[A, B]).is_empty());
        assert_eq!(asked(&mut member_table, now), [B]);
        member_table.handle_subscribed(A);
        assert_eq!(member_table.handle_present(&[B]), [A]);
        assert!(member_table.handle_present(&[B]).is_empty());
        assert!(asked(&mut member_table, now).is_empty());
    }

    #[test]
    fn who_comes_back_is_asked_at_once_whatever_it_said_before() {
        let now = Instant::now();
        let mut member_table = MemberTable::default();
        member_table.handle_present(&[A]);
        asked(&mut member_table, now);
        member_table.handle_refused(now, A);
        assert!(asked(&mut member_table, now).is_empty());
        member_table.handle_present(&[]);
        member_table.handle_present(&[A]);
        assert_eq!(asked(&mut member_table, now), [A]);
        assert_eq!(
            member_table.handle_refused(now, A),
            MemberTable::FIRST_PAUSE
        );
    }

    #[test]
    fn who_refuses_is_asked_less_and_less_often_but_never_given_up() {
        let mut now = Instant::now();
        let mut member_table = MemberTable::default();
        member_table.handle_present(&[A]);
        let mut pauses = Vec::new();
        for _ in 0..40 {
            assert_eq!(asked(&mut member_table, now), [A]);
            pauses.push(member_table.handle_refused(now, A).as_secs());
            now = member_table.poll_timeout().expect("it is asked again");
        }
        assert_eq!(pauses[..7], [1, 2, 4, 8, 16, 32, 32]);
        assert_eq!(pauses.last(), Some(&32));
    }

    #[test]
    fn a_crowd_is_asked_in_portions() {
        let now = Instant::now();
        let crowd: Vec<JausId> = (1..=254).map(|it| JausId::new(101, 1, it)).collect();
        let mut member_table = MemberTable::default();
        member_table.handle_present(&crowd);
        let mut total = 0;
        loop {
            let portion = asked(&mut member_table, now);
            assert!(portion.len() <= MemberTable::MOST_ASKED);
            total += portion.len();
            portion
                .iter()
                .for_each(|&it| member_table.handle_subscribed(it));
            if portion.is_empty() {
                break;
            }
        }
        assert_eq!(total, crowd.len());
    }
}
