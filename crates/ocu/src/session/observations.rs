//! What the session tells the log of events.

use std::sync::Arc;
use std::time::Instant;

use super::Session;
use crate::events::{EventInputs, EventTime};
use crate::ownership::PageId;
use jaus::node::time_of_day;

impl Session {
    /// Logs what has happened to the vehicles.
    pub(super) fn observe(&mut self, now: Instant) {
        let now = event_time(now);
        for vehicle in self.fleet.iter_mut() {
            let control = vehicle.control_state();
            let inputs = EventInputs {
                picture: &vehicle.picture,
                control: &control,
                drive: &vehicle.manual.state(),
                user: control.user.as_deref(),
            };
            self.events.observe(now, &inputs);
        }
        let fleet = &self.fleet;
        self.events.retain(|number| fleet.contains(number));
    }

    /// Logs a request for the emergency of a vehicle or of all, or for its end.
    pub(super) fn note_emergency(
        &mut self,
        now: Instant,
        target: Option<u16>,
        user: &Arc<str>,
        on: bool,
    ) {
        let vehicles = self.fleet.numbers();
        let vehicles = vehicles.filter(|it| target.is_none_or(|target| target == *it));
        let vehicles: Vec<u16> = vehicles.collect();
        let now = event_time(now);
        self.events.handle_request(now, &vehicles, user, on);
    }

    /// The user of a page; empty if the page is gone.
    pub(super) fn user(&self, page: PageId) -> Arc<str> {
        let operator = self.pages.operator(page);
        operator.map_or_else(|| Arc::from(""), |it| Arc::clone(&it.user))
    }
}

fn event_time(now: Instant) -> EventTime {
    EventTime {
        at: now,
        since_1970: time_of_day(),
    }
}
