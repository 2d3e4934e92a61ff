//! What waits for the node: messages of other bridges, and the ends of their sessions.

use std::collections::{HashMap, VecDeque};

use bytes::Bytes;
use jaus::endpoint::SessionId;
use jaus::link::custom::Arrival;

/// The most messages that wait, and octets of them.
const MOST: Load = Load {
    messages: 4096,
    octets: 16 << 20,
};
/// The most of one session: others find room however much it sends.
pub(crate) const MOST_OF_SESSION: Load = Load {
    messages: MOST.messages / 4,
    octets: MOST.octets / 4,
};

/// Messages, and their octets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Load {
    pub(crate) messages: usize,
    pub(crate) octets: usize,
}

impl Load {
    const fn has_room(self, octets: usize, most: Self) -> bool {
        self.messages < most.messages && self.octets + octets <= most.octets
    }

    const fn add(&mut self, octets: usize) {
        self.messages += 1;
        self.octets += octets;
    }

    const fn remove(&mut self, octets: usize) {
        self.messages -= 1;
        self.octets -= octets;
    }
}

/// The queue.
#[derive(Debug, Default)]
pub(crate) struct Arrivals {
    queue: VecDeque<Arrival>,
    load: Load,
    of_session: HashMap<SessionId, Load>,
}

impl Arrivals {
    /// Queues a message; returns false if there is no room for it.
    pub(crate) fn push(&mut self, session: SessionId, octets: Bytes) -> bool {
        let length = octets.len();
        let of_session = self.of_session.get(&session).copied().unwrap_or_default();
        if !self.load.has_room(length, MOST) || !of_session.has_room(length, MOST_OF_SESSION) {
            return false;
        }
        self.load.add(length);
        self.of_session.entry(session).or_default().add(length);
        self.queue.push_back(Arrival::Datagram { session, octets });
        true
    }

    /// Queues the end of a session.
    pub(crate) fn close(&mut self, session: SessionId) {
        self.queue.push_back(Arrival::Closed(session));
    }

    pub(crate) fn pop(&mut self) -> Option<Arrival> {
        let arrival = self.queue.pop_front()?;
        if let Arrival::Datagram { session, octets } = &arrival
            && let Some(of_session) = self.of_session.get_mut(session)
        {
            self.load.remove(octets.len());
            of_session.remove(octets.len());
            if of_session.messages == 0 {
                self.of_session.remove(session);
            }
        }
        Some(arrival)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: SessionId = SessionId(1);

    #[test]
    fn one_session_leaves_room_for_the_messages_of_others() {
        let mut arrivals = Arrivals::default();
        let mut fill = |session| {
            let pushed = (0..=MOST.messages).take_while(|_| arrivals.push(session, Bytes::new()));
            pushed.count()
        };
        assert_eq!(fill(ONE), MOST_OF_SESSION.messages);
        for other in 2..=4 {
            assert_eq!(fill(SessionId(other)), MOST_OF_SESSION.messages);
        }
        assert_eq!(fill(SessionId(5)), 0, "all together have a bound, too");
        while arrivals.pop().is_some() {}
        assert_eq!(arrivals.load, Load::default());
        assert!(arrivals.of_session.is_empty());
    }

    #[test]
    fn large_messages_are_bounded_by_their_octets() {
        let mut arrivals = Arrivals::default();
        let half = Bytes::from(vec![0; MOST_OF_SESSION.octets / 2]);
        for fits in [true, true, false] {
            assert_eq!(arrivals.push(ONE, half.clone()), fits);
        }
        assert!(arrivals.push(SessionId(2), half.clone()));
        arrivals.pop();
        assert!(arrivals.push(ONE, half));
    }
}
