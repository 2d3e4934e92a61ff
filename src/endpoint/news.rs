//! News that wait to be polled.

use std::collections::VecDeque;

use super::Event;

/// A bounded queue of news.
#[derive(Debug)]
pub(super) struct News {
    events: VecDeque<Event>,
    /// How many of them are results of messages, for which there is always room.
    results: usize,
    limit: usize,
}

impl News {
    pub(super) fn new(limit: usize) -> Self {
        Self {
            events: VecDeque::new(),
            results: 0,
            limit,
        }
    }

    /// Queues an event; false if too many wait.
    #[must_use]
    pub(super) fn push(&mut self, event: Event) -> bool {
        let has_room = self.events.len() - self.results < self.limit;
        if has_room {
            self.events.push_back(event);
        }
        has_room
    }

    /// Queues what became of a message. There is room: a message whose result was not polled counts
    /// as one that waits for its acknowledgement.
    pub(super) fn push_result(&mut self, event: Event) {
        self.results += 1;
        self.events.push_back(event);
    }

    /// How many results were not polled.
    pub(super) const fn results(&self) -> usize {
        self.results
    }

    /// The oldest.
    pub(super) fn pop(&mut self) -> Option<Event> {
        let event = self.events.pop_front()?;
        if let Event::Acknowledged { .. } | Event::NotAcknowledged { .. } = event {
            self.results -= 1;
        }
        Some(event)
    }
}
