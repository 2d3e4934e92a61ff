//! What waits to be polled: messages for local components, the most urgent first, and news.

use std::collections::VecDeque;

use super::{Event, Received};
use crate::wire::Priority;

/// A bounded queue of messages for each priority, so that none can crowd out another, and one of
/// news.
#[derive(Debug)]
pub(super) struct Inbox {
    messages: [VecDeque<Received>; Priority::ALL.len()],
    news: VecDeque<Event>,
    /// How many of the news are results of messages, for which there is always room.
    results: usize,
    limit: usize,
}

impl Inbox {
    /// Room for `limit` messages of each priority, and as many news.
    pub(super) fn new(limit: usize) -> Self {
        Self {
            messages: Default::default(),
            news: VecDeque::new(),
            results: 0,
            limit,
        }
    }

    /// Whether `count` more messages of a priority fit.
    pub(super) fn has_room(&self, priority: Priority, count: usize) -> bool {
        self.messages[usize::from(priority.bits())].len() + count <= self.limit
    }

    /// Queues a message; false if too many of its priority wait.
    #[must_use]
    pub(super) fn push(&mut self, message: Received) -> bool {
        let has_room = self.has_room(message.priority, 1);
        if has_room {
            self.messages[usize::from(message.priority.bits())].push_back(message);
        }
        has_room
    }

    /// Queues news; false if too many wait.
    #[must_use]
    pub(super) fn push_news(&mut self, event: Event) -> bool {
        let has_room = self.news.len() - self.results < self.limit;
        if has_room {
            self.news.push_back(event);
        }
        has_room
    }

    /// Queues what became of a message. There is room: a message whose result was not polled counts
    /// as one that waits for its acknowledgement.
    pub(super) fn push_result(&mut self, event: Event) {
        self.results += 1;
        self.news.push_back(event);
    }

    /// How many results were not polled.
    pub(super) const fn results(&self) -> usize {
        self.results
    }

    /// The oldest news, or else the oldest message of the highest priority.
    pub(super) fn pop(&mut self) -> Option<Event> {
        let Some(news) = self.news.pop_front() else {
            let mut most_urgent_first = self.messages.iter_mut().rev();
            let message = most_urgent_first.find_map(VecDeque::pop_front);
            return message.map(Event::Received);
        };
        if let Event::Acknowledged { .. } | Event::NotAcknowledged { .. } = news {
            self.results -= 1;
        }
        Some(news)
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;
    use crate::address::JausId;
    use crate::wire::Broadcast;

    fn message(priority: Priority, name: &'static str) -> Received {
        let id = JausId::new(1, 1, 1);
        Received {
            source: id,
            destination: id,
            priority,
            broadcast: Broadcast::None,
            payload: Bytes::from_static(name.as_bytes()),
            path: None,
            to: id,
        }
    }

    #[test]
    fn the_most_urgent_comes_first_and_equals_keep_their_order() {
        let mut inbox = Inbox::new(2);
        for (priority, name) in [
            (Priority::Low, "low"),
            (Priority::Standard, "first"),
            (Priority::SafetyCritical, "stop"),
            (Priority::Standard, "second"),
        ] {
            assert!(inbox.push(message(priority, name)));
        }
        let full = message(Priority::Standard, "third");
        assert!(!inbox.push(full), "its level is full");
        let soon = message(Priority::High, "soon");
        assert!(inbox.push(soon), "another level is not");
        let order = std::iter::from_fn(|| match inbox.pop()? {
            Event::Received(message) => Some(message.payload),
            _ => None,
        });
        assert!(order.eq(["stop", "soon", "first", "second", "low"]));
    }
}
