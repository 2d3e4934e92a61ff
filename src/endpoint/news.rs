//! The event queue that [`Endpoint::poll_event`](super::Endpoint::poll_event) reads.

use std::collections::VecDeque;

use super::Event;

/// A bounded event queue.
#[derive(Debug, Default)]
pub(super) struct News {
    events: VecDeque<Event>,
    /// How many events are delivery results. There is always room for those.
    results: usize,
}

impl News {
    /// Queues an event; returns false if `limit` events wait already.
    #[must_use]
    pub(super) fn push(&mut self, event: Event, limit: usize) -> bool {
        let has_room = self.events.len() - self.results < limit;
        if has_room {
            self.events.push_back(event);
        }
        has_room
    }

    /// Queues a delivery result. There is always room: an unpolled result counts as a message that
    /// waits for its acknowledgement.
    pub(super) fn push_result(&mut self, event: Event) {
        self.results += 1;
        self.events.push_back(event);
    }

    /// How many results have not been polled.
    pub(super) const fn results(&self) -> usize {
        self.results
    }

    /// Takes the oldest event.
    pub(super) fn pop(&mut self) -> Option<Event> {
        let event = self.events.pop_front()?;
        if let Event::Acknowledged { .. } | Event::NotAcknowledged { .. } = event {
            self.results -= 1;
        }
        Some(event)
    }
}
