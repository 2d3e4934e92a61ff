//! Turns a lasting fault into a failure of the component, and its end into a recovery.

use std::time::{Duration, Instant};

use jaus::component::Condition;

/// Keeps a component's Failure state in step with its faults.
#[derive(Debug, Default)]
pub(in crate::parts) struct FaultMonitor {
    since: Option<Instant>,
    /// The cause of the failure.
    failure: Option<String>,
}

impl FaultMonitor {
    /// A fault that lasts longer than this while the vehicle should move is a failure.
    pub(in crate::parts) const LIMIT: Duration = Duration::from_secs(2);

    /// Reports a fault at `now` with its cause. Returns the condition to set once the fault has
    /// lasted for `limit`.
    pub(in crate::parts) fn lacks(
        &mut self,
        now: Instant,
        why: &str,
        limit: Duration,
    ) -> Option<Condition> {
        let since = *self.since.get_or_insert(now);
        if self.failure.is_some() || now.saturating_duration_since(since) < limit {
            return None;
        }
        tracing::error!("failure: {why}");
        self.failure = Some(why.to_owned());
        Some(Condition::Failed)
    }

    /// Reports that there is no fault. Returns the condition to set if the component had failed.
    pub(in crate::parts) fn is_over(&mut self) -> Option<Condition> {
        self.since = None;
        let failure = self.failure.take()?;
        tracing::warn!("failure cleared: {failure}");
        Some(Condition::Initialized)
    }

    /// The cause of the current failure.
    pub(in crate::parts) fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    #[test]
    fn an_outage_beyond_the_limit_is_a_failure_until_it_is_over() {
        let mut monitor = FaultMonitor::default();
        let start = Instant::now();
        let limit = FaultMonitor::LIMIT;
        assert_eq!(monitor.lacks(start, "no pose", limit), None);
        assert_eq!(monitor.is_over(), None);
        let later = start + limit;
        assert_eq!(monitor.lacks(later, "no pose", limit), None, "another one");
        let failed = monitor.lacks(later + limit, "no pose", limit);
        assert_eq!(failed, Some(Condition::Failed));
        assert_eq!(monitor.failure(), Some("no pose"));
        assert_eq!(monitor.lacks(later + limit, "no pose", limit), None, "once");
        assert_eq!(monitor.is_over(), Some(Condition::Initialized));
        assert_eq!((monitor.is_over(), monitor.failure()), (None, None));
    }
}
