//! Cuts messages into fragments, and assigns sequence numbers.

use bytes::{BufMut, Bytes, BytesMut};

use crate::wire::{DataControl, Frame, ra};

/// The most fragments of a message: sequence numbers have 16 bits, and 0 is skipped.
const MOST: usize = u16::MAX as usize;

/// The rules for cutting messages to one destination.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::endpoint) struct Cutting {
    /// The longest payload of a packet.
    pub(in crate::endpoint) limit: usize,
    /// Whether each fragment begins with the message code, or only the first.
    pub(in crate::endpoint) repeat_code: bool,
    /// The most fragments that the destination keeps, and the payload limit to use instead if there
    /// would be more.
    pub(in crate::endpoint) kept: Option<(usize, usize)>,
}

impl Cutting {
    /// How to cut a message of `length` octets.
    pub(in crate::endpoint) fn cut(self, length: usize) -> Cut {
        let cut = Cut::new(length, self.limit, self.repeat_code);
        match self.kept {
            Some((most, longest)) if cut.count() > most => {
                Cut::new(length, longest.max(self.limit), self.repeat_code)
            }
            _ => cut,
        }
    }

    /// The longest message that can be cut by these rules.
    pub(in crate::endpoint) fn longest(self) -> usize {
        let repeated = if self.repeat_code { ra::CODE_LEN } else { 0 };
        self.limit.saturating_sub(repeated).saturating_mul(MOST)
    }
}

/// The layout of a cut message: which octets go into which fragment. It allocates nothing; the
/// fragments are created one by one, when they are sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::endpoint) struct Cut {
    length: usize,
    /// Octets of the message in the first fragment.
    first: usize,
    /// Octets of the message in each later fragment, except the last.
    part: usize,
    /// Octets of the message's beginning that each later fragment repeats.
    repeated: usize,
}

impl Cut {
    /// Cuts a message of `length` octets into payloads of at most `limit`. The code is in the first
    /// only or, with `repeat_code`, in each. Fragments exceed `limit` if the sequence numbers would
    /// not suffice.
    pub(in crate::endpoint) fn new(length: usize, limit: usize, repeat_code: bool) -> Self {
        let repeated = if repeat_code { ra::CODE_LEN } else { 0 };
        let first = limit
            .max(repeated + 1)
            .max(length.div_ceil(MOST) + repeated);
        Self {
            length,
            first,
            part: first - repeated,
            repeated,
        }
    }

    /// The number of fragments; 1 for a message sent whole.
    pub(in crate::endpoint) fn count(&self) -> usize {
        1 + self
            .length
            .saturating_sub(self.first)
            .div_ceil(self.part.max(1))
    }

    /// The octets of the message in the fragment.
    pub(in crate::endpoint) fn range(&self, index: usize) -> std::ops::Range<usize> {
        let start = match index {
            0 => 0,
            _ => self.first + (index - 1) * self.part,
        };
        let end = self.first + index * self.part;
        start.min(self.length)..end.min(self.length)
    }

    /// The length of the fragment, in octets.
    pub(in crate::endpoint) fn fragment_len(&self, index: usize) -> usize {
        let repeated = if index == 0 { 0 } else { self.repeated };
        repeated + self.range(index).len()
    }

    /// The frame of a fragment of `whole`, if the first has the serial number `first`.
    pub(in crate::endpoint) fn frame(&self, whole: &Frame, first: u64, index: usize) -> Frame {
        let (data, payload) = self.fragment(&whole.payload, index);
        Frame {
            flags: whole.flags.with_data(data),
            sequence: (first + index as u64) as u16,
            payload,
            ..whole.clone()
        }
    }

    /// The data control and payload of the fragment.
    pub(in crate::endpoint) fn fragment(
        &self,
        message: &Bytes,
        index: usize,
    ) -> (DataControl, Bytes) {
        let data = match (index, self.count()) {
            (_, 1) => DataControl::Single,
            (0, _) => DataControl::First,
            (index, count) if index + 1 == count => DataControl::Last,
            _ => DataControl::Middle,
        };
        let range = self.range(index);
        if index == 0 || self.repeated == 0 {
            return (data, message.slice(range));
        }
        let mut payload = BytesMut::with_capacity(self.repeated + range.len());
        payload.put_slice(message.get(..self.repeated).unwrap_or_default());
        payload.put_slice(message.get(range).unwrap_or_default());
        (data, payload.freeze())
    }
}

/// The sequence number generator of an endpoint.
///
/// One counter serves all destinations and components: Junior detects duplicates by source and
/// number alone, so a broadcast and a unicast message to it must not share a number. The numbers
/// skip 0, which JAUS++ refuses in fragments, and do not wrap around within a message, which JAUS++
/// does not support.
///
/// A *serial* number is a sequence number that does not wrap around; its lower 16 bits are
/// transmitted.
#[derive(Clone, Copy, Debug)]
pub(in crate::endpoint) struct Numbers {
    last: u64,
}

impl Numbers {
    /// Creates a generator that continues after `last`.
    pub(in crate::endpoint) fn after(last: u16) -> Self {
        Self { last: last.into() }
    }

    /// Takes `count` consecutive numbers, 1 to 65535, and returns the first.
    pub(in crate::endpoint) fn take(&mut self, count: usize) -> u64 {
        let count = count as u64;
        let first = self.peek(count);
        self.last = first + count - 1;
        first
    }

    /// What [`take`](Self::take) would return.
    pub(in crate::endpoint) fn peek(&self, count: u64) -> u64 {
        const ROUND: u64 = 1 << 16;
        if self.last % ROUND + count < ROUND {
            self.last + 1
        } else {
            (self.last / ROUND + 1) * ROUND + 1
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fragments_hold_the_message_and_know_their_place() {
        let message: Bytes = (0..=250).collect();
        for (limit, repeat) in [
            (64, false),
            (64, true),
            (83, true),
            (251, true),
            (249, true),
        ] {
            let cut = Cut::new(message.len(), limit, repeat);
            let mut joined = Vec::new();
            for index in 0..cut.count() {
                let (data, payload) = cut.fragment(&message, index);
                assert!(payload.len() <= limit);
                assert!(!payload.is_empty());
                let expected = match index {
                    0 if cut.count() == 1 => DataControl::Single,
                    0 => DataControl::First,
                    _ if index + 1 == cut.count() => DataControl::Last,
                    _ => DataControl::Middle,
                };
                assert_eq!(data, expected);
                let skip = if repeat && index > 0 { 2 } else { 0 };
                assert!(payload.starts_with(&message[..skip]));
                joined.extend_from_slice(&payload[skip..]);
                assert_eq!(cut.range(index).len(), payload.len() - skip);
            }
            assert_eq!(joined, message, "{limit} {repeat}");
        }
        assert_eq!(Cut::new(128, 64, false).count(), 2);
        assert_eq!(Cut::new(1, 64, false).count(), 1);
        assert_eq!(
            Cut::new(1 << 24, 64, true).count(),
            65_281,
            "longer fragments rather than more than there are numbers"
        );
    }

    #[test]
    fn numbers_leave_out_zero_and_do_not_go_round_within_a_message() {
        let mut numbers = Numbers::after(65_532);
        let taken: Vec<u16> = [1, 2, 1, 65_534, 2]
            .map(|count| numbers.take(count) as u16)
            .into();
        assert_eq!(taken, [65_533, 65_534, 1, 2, 1]);
        assert_eq!(Numbers::after(0).take(65_535) as u16, 1);
        assert_eq!(Numbers::after(1).take(65_535) as u16, 1);
    }

    #[test]
    fn a_destination_that_keeps_few_fragments_gets_longer_ones() {
        let cutting = |limit, most| Cutting {
            limit,
            repeat_code: false,
            kept: Some((most, 300)),
        };
        for (limit, most, expected) in [(100, 10, 10), (100, 9, 4), (400, 2, 3)] {
            assert_eq!(cutting(limit, most).cut(1000).count(), expected);
        }
        let repeating = Cutting {
            repeat_code: true,
            ..cutting(100, 10)
        };
        assert_eq!(cutting(100, 10).longest(), 100 * MOST);
        assert_eq!(repeating.longest(), 98 * MOST);
    }
}
