//! Which later fragments may pass: those that continue a first fragment of the same session.
//!
//! The rules of a key are asked about first fragments, for only they show what a message is. If a later
//! fragment of one session completed the message of another one, here or behind a relay, its content would
//! be from a key that was never asked. So a message belongs to the session that began it, and its fragments
//! pass in order: a sender repeats what was lost before them.

use std::collections::{BTreeMap, VecDeque};

use jaus::address::JausId;
use jaus::endpoint::SessionId;
use jaus::wire::{DataControl, Frame, Priority, Version};

/// Messages of one session that are followed at once; the oldest one gives way.
const MOST: usize = 64;
/// The most fragments of a message: half of all numbers.
const LONGEST: u16 = 1 << 15;

/// Source and destination of a message.
type Key = (JausId, JausId);

/// A message whose first fragment has passed.
#[derive(Debug)]
struct Begun {
    session: SessionId,
    version: Version,
    priority: Priority,
    first: u16,
    /// The fragments after the first that have passed.
    followed: u16,
    has_ended: bool,
}

/// The latest large message of each pair of source and destination.
#[derive(Debug, Default)]
pub(super) struct Fragments {
    begun: BTreeMap<Key, Begun>,
    /// The keys of each session, the oldest first.
    keys: BTreeMap<SessionId, VecDeque<Key>>,
}

impl Fragments {
    /// Whether a frame of a session may pass that its rules allow.
    pub(super) fn admit(&mut self, session: SessionId, frame: &Frame) -> bool {
        if frame.is_acknowledgement() {
            return true;
        }
        match frame.flags.data() {
            DataControl::Single => true,
            DataControl::First => {
                self.begin(session, frame);
                true
            }
            DataControl::Middle | DataControl::Last => self.follow(session, frame),
        }
    }

    fn begin(&mut self, session: SessionId, frame: &Frame) {
        let key = (frame.source, frame.destination);
        let is_repeated = |it: &Begun| it.is_of(session, frame) && it.first == frame.sequence;
        if self.begun.get(&key).is_some_and(is_repeated) {
            return;
        }
        self.remove(key);
        let keys = self.keys.entry(session).or_default();
        keys.push_back(key);
        let oldest = (keys.len() > MOST).then(|| keys.pop_front()).flatten();
        if let Some(oldest) = oldest {
            self.begun.remove(&oldest);
        }
        let begun = Begun {
            session,
            version: frame.version,
            priority: frame.flags.priority(),
            first: frame.sequence,
            followed: 0,
            has_ended: false,
        };
        self.begun.insert(key, begun);
    }

    fn follow(&mut self, session: SessionId, frame: &Frame) -> bool {
        let key = (frame.source, frame.destination);
        let begun = self.begun.get_mut(&key);
        let Some(begun) = begun.filter(|it| it.is_of(session, frame)) else {
            return false;
        };
        let place = frame.sequence.wrapping_sub(begun.first);
        if place == begun.followed + 1 && !begun.has_ended && place < LONGEST {
            begun.followed = place;
            begun.has_ended = frame.flags.data() == DataControl::Last;
            return true;
        }
        // One that is repeated.
        (1..=begun.followed).contains(&place)
    }

    fn remove(&mut self, key: Key) {
        if let Some(begun) = self.begun.remove(&key)
            && let Some(keys) = self.keys.get_mut(&begun.session)
        {
            keys.retain(|it| *it != key);
        }
    }

    /// Forgets a session that has ended.
    pub(super) fn forget(&mut self, session: SessionId) {
        for key in self.keys.remove(&session).into_iter().flatten() {
            self.begun.remove(&key);
        }
    }
}

impl Begun {
    /// Whether a fragment is of the same session, and has the headers that the fragments of a message share.
    fn is_of(&self, session: SessionId, frame: &Frame) -> bool {
        let headers = (frame.version, frame.flags.priority());
        self.session == session && (self.version, self.priority) == headers
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use jaus::wire::Flags;

    use super::*;

    use DataControl::{First, Last, Middle, Single};

    const ONE: SessionId = SessionId(1);
    const TWO: SessionId = SessionId(2);

    fn fragment(data: DataControl, sequence: u16) -> Frame {
        fragment_to(JausId::new(101, 1, 1), data, sequence)
    }

    fn fragment_to(to: JausId, data: DataControl, sequence: u16) -> Frame {
        Frame {
            flags: Flags::default().with_data(data),
            sequence,
            ..Frame::new(JausId::new(60, 1, 1), to, Bytes::from_static(b"\x05\x04\0"))
        }
    }

    /// Whether each of these fragments passes, in turn.
    fn passed(fragments: &[(SessionId, DataControl, u16)]) -> Vec<bool> {
        let mut known = Fragments::default();
        let each = fragments.iter();
        each.map(|&(session, data, number)| known.admit(session, &fragment(data, number)))
            .collect()
    }

    #[test]
    fn a_message_passes_in_order_and_may_be_repeated() {
        let message = [
            (ONE, First, 65_535),
            (ONE, Middle, 0),
            (ONE, First, 65_535),
            (ONE, Middle, 1),
            (ONE, Middle, 0),
            (ONE, Last, 2),
            (ONE, Last, 2),
            (ONE, Single, 9),
        ];
        assert_eq!(passed(&message), [true; 8]);
        let gaps = [
            (ONE, Middle, 1),
            (ONE, First, 1),
            (ONE, Middle, 3),
            (ONE, Last, 2),
            (ONE, Middle, 3),
        ];
        assert_eq!(passed(&gaps), [false, true, false, true, false]);
    }

    #[test]
    fn fragments_of_one_session_complete_no_message_of_another() {
        let later = [
            (ONE, First, 1),
            (TWO, Middle, 2),
            (TWO, Last, 2),
            (ONE, Last, 2),
        ];
        assert_eq!(passed(&later), [true, false, false, true]);
        // What the other one begins takes the place of what was there, with all of its numbers.
        let both = [
            (TWO, First, 1),
            (TWO, Middle, 2),
            (ONE, First, 3),
            (TWO, Middle, 3),
            (TWO, Middle, 4),
            (ONE, Last, 4),
        ];
        assert_eq!(passed(&both), [true, true, true, false, false, true]);
        let mut ended = Fragments::default();
        assert!(ended.admit(ONE, &fragment(First, 1)));
        ended.forget(ONE);
        assert!(!ended.admit(ONE, &fragment(Last, 2)));
        assert!(ended.begun.is_empty() && ended.keys.is_empty());
    }

    #[test]
    fn one_session_takes_no_room_of_another() {
        let mut known = Fragments::default();
        assert!(known.admit(ONE, &fragment(First, 1)));
        for subsystem in 1..1000 {
            let to = JausId::new(subsystem, 9, 9);
            assert!(known.admit(TWO, &fragment_to(to, First, 7)));
        }
        assert_eq!(known.begun.len(), 1 + MOST);
        assert!(known.admit(ONE, &fragment(Last, 2)));
    }
}
