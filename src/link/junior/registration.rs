//! The registration state machine of clients of Junior's node manager, without sockets and clock.
//!
//! A client is not notified when its node manager has restarted and no longer knows it. So it sends
//! probes on the connected socket. They fail if the process that bound it is gone, however quickly
//! another took its place.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::address::JausId;

/// Interval of attempts to find the node manager or to register, and of probes.
pub(super) const INTERVAL: Duration = Duration::from_millis(500);

/// The next action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Find the node manager.
    Connect,
    /// Register this id.
    Register(JausId),
    /// Check that it is still there.
    Probe,
}

/// The state of the ids at the node manager.
#[derive(Debug, Default)]
pub(super) struct Registration {
    is_connected: bool,
    /// When to connect or to probe; `None` means at the next opportunity.
    next: Option<Instant>,
    /// The ids that it has not accepted, and when each is due.
    pending: BTreeMap<JausId, Option<Instant>>,
}

impl Registration {
    pub(super) fn is_complete(&self) -> bool {
        self.is_connected && self.pending.is_empty()
    }

    pub(super) fn add(&mut self, id: JausId) {
        self.pending.insert(id, None);
    }

    pub(super) fn remove(&mut self, id: JausId) {
        self.pending.remove(&id);
    }

    /// Notes that the node manager is present and has none of the ids.
    pub(super) fn handle_connected(&mut self, ids: impl IntoIterator<Item = JausId>) {
        self.is_connected = true;
        self.pending = ids.into_iter().map(|id| (id, None)).collect();
    }

    /// Notes that the node manager is gone.
    pub(super) fn handle_lost(&mut self) {
        self.is_connected = false;
        self.next = None;
    }

    /// Notes that the node manager has accepted an id; returns whether that is new.
    pub(super) fn handle_accept(&mut self, id: JausId) -> bool {
        self.pending.remove(&id).is_some()
    }

    /// The next action, until there is none.
    pub(super) fn poll(&mut self, now: Instant) -> Option<Step> {
        if is_due(self.next, now) {
            self.next = Some(now + INTERVAL);
            return Some(if self.is_connected {
                Step::Probe
            } else {
                Step::Connect
            });
        }
        let mut pending = self.pending.iter_mut().filter(|_| self.is_connected);
        let (&id, next) = pending.find(|(_, next)| is_due(**next, now))?;
        *next = Some(now + INTERVAL);
        Some(Step::Register(id))
    }

    /// When to call [`poll`](Self::poll) even if nothing happens.
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let pending = self.pending.values().filter(|_| self.is_connected);
        pending.chain([&self.next]).copied().flatten().min()
    }
}

fn is_due(at: Option<Instant>, now: Instant) -> bool {
    at.is_none_or(|at| at <= now)
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    const ONE: JausId = JausId::new(101, 1, 1);
    const TWO: JausId = JausId::new(101, 1, 2);

    fn steps(registration: &mut Registration, now: Instant) -> Vec<Step> {
        std::iter::from_fn(|| registration.poll(now)).collect()
    }

    /// Two ids, of which the first is accepted.
    fn half_registered(now: Instant) -> Registration {
        let mut registration = Registration::default();
        registration.add(ONE);
        registration.add(TWO);
        assert_eq!(steps(&mut registration, now), [Step::Connect]);
        registration.handle_connected([ONE, TWO]);
        let both = [Step::Register(ONE), Step::Register(TWO)];
        assert_eq!(steps(&mut registration, now), both);
        assert!(registration.handle_accept(ONE));
        registration
    }

    #[test]
    fn the_node_manager_is_looked_for_until_it_is_there() {
        let (mut registration, now) = (Registration::default(), Instant::now());
        registration.add(ONE);
        for attempt in 0..3 {
            let now = now + attempt * INTERVAL;
            assert_eq!(steps(&mut registration, now), [Step::Connect]);
            assert_eq!(registration.poll_timeout(), Some(now + INTERVAL));
            assert!(!registration.is_complete());
        }
    }

    #[test]
    fn each_id_is_registered_until_it_is_accepted() {
        let now = Instant::now();
        let mut registration = half_registered(now);
        let later = [Step::Probe, Step::Register(TWO)];
        assert_eq!(steps(&mut registration, now + INTERVAL), later);
        assert!(!registration.is_complete());
        assert!(registration.handle_accept(TWO));
        assert!(!registration.handle_accept(TWO), "no news");
        assert!(registration.is_complete());
        assert_eq!(steps(&mut registration, now + 2 * INTERVAL), [Step::Probe]);
    }

    #[test]
    fn a_node_manager_that_was_restarted_gets_all_ids_again() {
        let now = Instant::now();
        let mut registration = half_registered(now);
        registration.handle_accept(TWO);
        registration.handle_lost();
        assert!(!registration.is_complete());
        assert_eq!(steps(&mut registration, now), [Step::Connect]);
        registration.handle_connected([ONE, TWO]);
        let both = [Step::Register(ONE), Step::Register(TWO)];
        assert_eq!(steps(&mut registration, now), both);
    }

    #[test]
    fn a_component_that_comes_later_is_registered_at_once_and_one_that_has_gone_no_more() {
        let now = Instant::now();
        let mut registration = half_registered(now);
        registration.remove(TWO);
        assert!(registration.is_complete());
        registration.add(TWO);
        assert_eq!(steps(&mut registration, now), [Step::Register(TWO)]);
    }
}
