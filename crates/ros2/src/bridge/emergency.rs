//! Emergency stops: sent to every part of the vehicle until its state confirms it. It does no I/O and
//! reads no clock.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use jaus::address::JausId;

/// An emergency, or the end of one, on its way to the parts of a vehicle.
#[derive(Debug, Default)]
pub struct Emergency {
    request: Option<Request>,
}

#[derive(Debug)]
struct Request {
    on: bool,
    since: Instant,
    /// The parts to which it was sent.
    parts: BTreeMap<JausId, Delivery>,
}

/// What has happened to the request at one part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Delivery {
    InProgress {
        /// Whether an earlier delivery has ended.
        is_repeated: bool,
    },
    Ended,
    /// The part has reported the state that was requested.
    Confirmed,
}

impl Emergency {
    /// How long it is repeated to a part that does not confirm it, and sent to parts that appear.
    pub const PATIENCE: Duration = Duration::from_secs(10);

    /// Sets or clears an emergency of all parts. The caller ends the deliveries of earlier requests.
    pub fn request(&mut self, now: Instant, on: bool) {
        self.request = Some(Request {
            on,
            since: now,
            parts: BTreeMap::new(),
        });
    }

    /// Handles the end of a delivery, acknowledged or not.
    pub fn handle_delivered(&mut self, part: JausId) {
        let parts = self.request.as_mut().map(|it| &mut it.parts);
        if let Some(delivery @ Delivery::InProgress { .. }) = parts.and_then(|it| it.get_mut(&part))
        {
            *delivery = Delivery::Ended;
        }
    }

    /// Handles the state that a part reports. It counts once a delivery of this request has ended:
    /// before, it may be the effect of an earlier request. A part that has confirmed is left alone
    /// from then on, so that another client can clear the emergency.
    pub fn handle_status(&mut self, part: JausId, is_emergency: bool) {
        let Some(request) = self.request.as_mut().filter(|it| it.on == is_emergency) else {
            return;
        };
        let delivery = request.parts.get_mut(&part);
        if let Some(delivery) = delivery
            && *delivery != (Delivery::InProgress { is_repeated: false })
        {
            *delivery = Delivery::Confirmed;
        }
    }

    /// The parts of the vehicle, as it is known now, to which the emergency or its end has to be
    /// delivered now: whether it is one, and to which.
    pub fn poll(
        &mut self,
        now: Instant,
        vehicle: impl IntoIterator<Item = JausId>,
    ) -> Option<(bool, Vec<JausId>)> {
        let request = self.request.as_mut()?;
        if now >= request.since + Self::PATIENCE {
            request.warn();
            self.request = None;
            return None;
        }
        let mut due = Vec::new();
        for part in vehicle {
            let is_repeated = match request.parts.get(&part) {
                None => false,
                Some(Delivery::Ended) => true,
                Some(Delivery::InProgress { .. } | Delivery::Confirmed) => continue,
            };
            let delivery = Delivery::InProgress { is_repeated };
            request.parts.insert(part, delivery);
            due.push(part);
        }
        Some((request.on, due))
    }

    /// Whether an emergency is being set.
    #[must_use]
    pub fn is_being_set(&self) -> bool {
        self.request.as_ref().is_some_and(|it| it.on)
    }
}

impl Request {
    fn warn(&self) {
        let what = match self.on {
            true => "the emergency",
            false => "the end of the emergency",
        };
        if self.parts.is_empty() {
            tracing::warn!("no component of the vehicle has received {what}");
        }
        let unconfirmed = |(_, delivery): &(_, &Delivery)| **delivery != Delivery::Confirmed;
        for (part, _) in self.parts.iter().filter(unconfirmed) {
            tracing::warn!("{part} has not confirmed {what}");
        }
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
        emergency.request(now, true);
        let poll = |emergency: &mut Emergency| emergency.poll(now, [ONE, OTHER]).unwrap().1;
        assert_eq!(poll(&mut emergency), [ONE, OTHER]);
        assert_eq!(poll(&mut emergency), [], "on their way");
        emergency.handle_delivered(ONE);
        emergency.handle_delivered(OTHER);
        emergency.handle_status(ONE, false);
        emergency.handle_status(OTHER, true);
        assert_eq!(poll(&mut emergency), [ONE]);
        emergency.handle_status(ONE, true);
        assert_eq!(poll(&mut emergency), [], "confirmed");
    }

    #[test]
    fn another_client_can_clear_an_emergency_that_was_confirmed() {
        let now = Instant::now();
        let mut emergency = Emergency::default();
        emergency.request(now, true);
        assert!(emergency.poll(now, [ONE]).is_some());
        emergency.handle_delivered(ONE);
        emergency.handle_status(ONE, true);
        emergency.handle_status(ONE, false);
        assert_eq!(emergency.poll(now, [ONE]), Some((true, vec![])));
    }

    #[test]
    fn a_part_that_never_confirms_is_given_up_after_ten_seconds() {
        let now = Instant::now();
        let mut emergency = Emergency::default();
        emergency.request(now, true);
        let end = now + Emergency::PATIENCE;
        let last = end - Duration::from_millis(1);
        assert!(emergency.poll(last, [ONE]).is_some());
        assert_eq!(emergency.poll(end, [ONE]), None);
        assert!(!emergency.is_being_set());
    }

    #[test]
    fn a_part_that_appears_after_the_request_receives_it() {
        let now = Instant::now();
        let mut emergency = Emergency::default();
        emergency.request(now, true);
        assert_eq!(emergency.poll(now, []), Some((true, vec![])));
        let later = now + Duration::from_secs(9);
        assert_eq!(emergency.poll(later, [ONE]), Some((true, vec![ONE])));
    }

    #[test]
    fn a_state_of_before_does_not_confirm_a_later_request() {
        let now = Instant::now();
        let mut emergency = Emergency::default();
        emergency.request(now, true);
        assert!(emergency.poll(now, [ONE]).is_some());
        emergency.handle_delivered(ONE);
        emergency.handle_status(ONE, true);
        emergency.request(now, false);
        assert_eq!(emergency.poll(now, [ONE]), Some((false, vec![ONE])));
        emergency.request(now, true);
        emergency.handle_status(ONE, true);
        assert_eq!(emergency.poll(now, [ONE]), Some((true, vec![ONE])));
        emergency.handle_status(ONE, true);
        emergency.handle_delivered(ONE);
        emergency.handle_status(ONE, false);
        assert_eq!(emergency.poll(now, [ONE]), Some((true, vec![ONE])));
    }
}
