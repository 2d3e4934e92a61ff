//! Emergency stops: sent to every part of the vehicle until its state confirms it. It does no I/O and
//! reads no clock.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use jaus::address::JausId;

/// An emergency, or the end of one, on its way to the parts of a vehicle.
#[derive(Debug, Default)]
pub struct Emergency {
    request: Option<Request>,
    /// Parts with a delivery in progress.
    busy: BTreeSet<JausId>,
}

#[derive(Debug)]
struct Request {
    on: bool,
    since: Instant,
    /// The parts that have not confirmed it.
    left: BTreeSet<JausId>,
}

impl Emergency {
    /// How long it is repeated to a part that does not confirm it.
    pub const PATIENCE: Duration = Duration::from_secs(10);

    /// Sets or clears an emergency of these parts.
    pub fn request(&mut self, now: Instant, on: bool, parts: impl IntoIterator<Item = JausId>) {
        let left = parts.into_iter().collect();
        self.request = Some(Request {
            on,
            since: now,
            left,
        });
    }

    /// Handles the end of a delivery, acknowledged or not.
    pub fn handle_delivered(&mut self, part: JausId) {
        self.busy.remove(&part);
    }

    /// Handles the state that a part reports. A part that has confirmed is left alone from then on, so
    /// that another client can clear the emergency.
    pub fn handle_status(&mut self, part: JausId, is_emergency: bool) {
        if let Some(request) = &mut self.request
            && request.on == is_emergency
        {
            request.left.remove(&part);
        }
    }

    /// The parts to which the emergency, or its end, has to be delivered now: whether it is one, and
    /// to which.
    pub fn poll(&mut self, now: Instant) -> Option<(bool, Vec<JausId>)> {
        let request = self.request.as_ref()?;
        let on = request.on;
        let is_over = now >= request.since + Self::PATIENCE;
        if request.left.is_empty() || is_over {
            for part in &request.left {
                let what = match on {
                    true => "the emergency",
                    false => "the end of the emergency",
                };
                tracing::warn!("{part} has not confirmed {what}");
            }
            self.request = None;
            return None;
        }
        let due: Vec<_> = request.left.difference(&self.busy).copied().collect();
        self.busy.extend(&due);
        Some((on, due))
    }

    /// Whether an emergency is being set.
    #[must_use]
    pub fn is_being_set(&self) -> bool {
        self.request.as_ref().is_some_and(|it| it.on)
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use super::*;

    const ONE: JausId = JausId::new(101, 1, 33);
    const OTHER: JausId = JausId::new(101, 1, 44);

    #[test]
    fn an_emergency_is_repeated_until_every_part_has_reported_it() {
        let now = Instant::now();
        let mut emergency = Emergency::default();
        emergency.request(now, true, [ONE, OTHER]);
        assert_eq!(emergency.poll(now), Some((true, vec![ONE, OTHER])));
        assert_eq!(emergency.poll(now), Some((true, vec![])), "on their way");
        emergency.handle_delivered(ONE);
        emergency.handle_delivered(OTHER);
        emergency.handle_status(ONE, false);
        emergency.handle_status(OTHER, true);
        assert_eq!(emergency.poll(now), Some((true, vec![ONE])));
        emergency.handle_status(ONE, true);
        assert_eq!(emergency.poll(now), None);
        assert!(!emergency.is_being_set());
    }

    #[test]
    fn another_client_can_clear_an_emergency_that_was_confirmed() {
        let now = Instant::now();
        let mut emergency = Emergency::default();
        emergency.request(now, true, [ONE, OTHER]);
        emergency.handle_status(ONE, true);
        emergency.handle_status(ONE, false);
        assert_eq!(emergency.poll(now), Some((true, vec![OTHER])));
    }

    #[test]
    fn a_part_that_never_confirms_is_given_up_after_ten_seconds() {
        let now = Instant::now();
        let mut emergency = Emergency::default();
        emergency.request(now, true, [ONE]);
        let end = now + Emergency::PATIENCE;
        assert!(emergency.poll(end - Duration::from_millis(1)).is_some());
        assert_eq!(emergency.poll(end), None);
    }

    #[test]
    fn a_later_request_replaces_the_one_before() {
        let now = Instant::now();
        let mut emergency = Emergency::default();
        emergency.request(now, true, [ONE]);
        emergency.request(now, false, [ONE]);
        assert_eq!(emergency.poll(now), Some((false, vec![ONE])));
    }
}
