//! Reassembly of large messages from a capture, with bounded memory, in both fragmentation styles
//! observed.
//!
//! AS5669A and Junior split the message unchanged, so only the first fragment starts with the
//! message code. JAUS++ repeats the code at the start of every fragment. A single fragment does not
//! reveal the style; decoding the whole message does.

use std::collections::{BTreeMap, VecDeque};
use std::net::IpAddr;

use bytes::Bytes;
use jaus_limits::{first_of_largest, quota_address};

use jaus::address::JausId;
use jaus::wire::{DataControl, Frame, Version, large};

/// Limit of incomplete messages. Beyond it the oldest of the network address with the most is dropped.
const MOST_OPEN: usize = 64;
/// Maximum size of a message. JAUS peers do not exceed some hundred kilobytes.
const LONGEST: usize = 16 << 20;

/// Messages being reassembled.
#[derive(Debug, Default)]
pub(super) struct LargeMessages {
    /// Oldest first.
    open: VecDeque<Open>,
    given_up: u64,
}

#[derive(Debug)]
struct Open {
    /// The network address that it comes from, if known.
    from: Option<IpAddr>,
    source: JausId,
    destination: JausId,
    version: Version,
    first: Option<u16>,
    last: Option<u16>,
    /// Payloads by sequence number.
    pieces: BTreeMap<u16, Bytes>,
    length: usize,
}

/// A completely received message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Whole {
    /// Sequence number of the first fragment.
    pub(super) sequence: u16,
    /// The concatenated payloads.
    pub(super) plain: Bytes,
    /// The same without the code at the start of every further fragment, if all repeat it.
    pub(super) without_repeated_code: Option<Bytes>,
}

impl LargeMessages {
    /// Number of dropped messages and of those still incomplete.
    pub(super) fn incomplete(&self) -> u64 {
        self.given_up + self.open.len() as u64
    }

    /// Adds a fragment from a network address. Returns the message when it is complete.
    pub(super) fn insert(&mut self, from: Option<IpAddr>, frame: &Frame) -> Option<Whole> {
        let place = self.place_for(from, frame);
        let open = &mut self.open[place];
        match frame.flags.data() {
            DataControl::First => open.first = Some(frame.sequence),
            DataControl::Last => open.last = Some(frame.sequence),
            DataControl::Middle | DataControl::Single => {}
        }
        // A duplicate replaces the original.
        let before = open.pieces.insert(frame.sequence, frame.payload.clone());
        open.length += frame.payload.len();
        open.length -= before.map_or(0, |piece| piece.len());
        if open.length > LONGEST {
            self.open.remove(place);
            self.given_up += 1;
            return None;
        }
        let whole = open.whole()?;
        self.open.remove(place);
        Some(whole)
    }

    /// The entry for the fragment's message. A second first or last fragment starts a new message.
    fn place_for(&mut self, from: Option<IpAddr>, frame: &Frame) -> usize {
        let known = self.open.iter().position(|open| {
            (open.source, open.destination, open.version)
                == (frame.source, frame.destination, frame.version)
        });
        let other = |seen: Option<u16>| seen.is_some_and(|seen| seen != frame.sequence);
        if let Some(place) = known {
            let open = &self.open[place];
            let begins_anew = match frame.flags.data() {
                DataControl::First => other(open.first),
                DataControl::Last => other(open.last),
                DataControl::Middle | DataControl::Single => false,
            };
            if !begins_anew {
                return place;
            }
            self.open.remove(place);
            self.given_up += 1;
        } else if self.open.len() == MOST_OPEN {
            let place = first_of_largest(&self.open, |it| it.from);
            place.and_then(|place| self.open.remove(place));
            self.given_up += 1;
        }
        self.open.push_back(Open {
            from: from.map(quota_address),
            source: frame.source,
            destination: frame.destination,
            version: frame.version,
            first: None,
            last: None,
            pieces: BTreeMap::new(),
            length: 0,
        });
        self.open.len() - 1
    }
}

impl Open {
    /// The message, if all fragments from first to last are present. Sequence numbers wrap around.
    fn whole(&self) -> Option<Whole> {
        let (first, last) = (self.first?, self.last?);
        let fragments = last.wrapping_sub(first);
        if usize::from(fragments) >= self.pieces.len() {
            return None;
        }
        let pieces: Vec<&Bytes> = (0..=fragments)
            .map(|step| self.pieces.get(&first.wrapping_add(step)))
            .collect::<Option<_>>()?;
        pieces.first()?.get(..large::CODE_LEN)?;
        let repeated = large::repeats_code(pieces.iter().copied());
        let join = |skip| large::join(pieces.iter().copied(), skip);
        // In the older versions the code is in the header, so every payload starts with it.
        let (plain, without_repeated_code) = match self.version {
            Version::As5669a => (join(0), repeated.then(|| join(large::CODE_LEN))),
            Version::As5669 | Version::Ra => (repeated.then(|| join(large::CODE_LEN))?, None),
        };
        Some(Whole {
            sequence: first,
            plain,
            without_repeated_code,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jaus::wire::Flags;

    fn fragment(data: DataControl, sequence: u16, payload: &'static [u8]) -> Frame {
        Frame {
            flags: Flags::default().with_data(data),
            sequence,
            ..Frame::new(
                JausId::new(1, 1, 1),
                JausId::new(2, 1, 1),
                Bytes::from_static(payload),
            )
        }
    }

    #[test]
    fn fragments_in_any_order_make_the_message_even_across_the_wrap() {
        let mut large = LargeMessages::default();
        assert_eq!(
            large.insert(None, &fragment(DataControl::Middle, 65_535, b"cd")),
            None
        );
        assert_eq!(
            large.insert(None, &fragment(DataControl::Last, 0, b"ef")),
            None
        );
        assert_eq!(
            large.insert(None, &fragment(DataControl::Middle, 65_535, b"cd")),
            None
        );
        let whole = large
            .insert(None, &fragment(DataControl::First, 65_534, b"ab"))
            .unwrap();
        assert_eq!(whole.plain, b"abcdef"[..]);
        assert_eq!(whole.sequence, 65_534);
        assert_eq!(whole.without_repeated_code, None);
        assert_eq!(large.incomplete(), 0);
    }

    #[test]
    fn a_code_in_every_fragment_is_offered_to_be_left_out() {
        let mut large = LargeMessages::default();
        large.insert(None, &fragment(DataControl::First, 1, b"\x03\x4Bab"));
        let whole = large
            .insert(None, &fragment(DataControl::Last, 2, b"\x03\x4Bcd"))
            .unwrap();
        assert_eq!(whole.plain, b"\x03\x4Bab\x03\x4Bcd"[..]);
        assert_eq!(whole.without_repeated_code.unwrap(), b"\x03\x4Babcd"[..]);
    }

    #[test]
    fn a_second_beginning_gives_up_the_first_message() {
        let mut large = LargeMessages::default();
        large.insert(None, &fragment(DataControl::First, 1, b"ab"));
        large.insert(None, &fragment(DataControl::First, 9, b"cd"));
        let whole = large
            .insert(None, &fragment(DataControl::Last, 10, b"ef"))
            .unwrap();
        assert_eq!(whole.plain, b"cdef"[..]);
        assert_eq!(large.incomplete(), 1);
    }

    #[test]
    fn open_messages_are_bounded() {
        let mut large = LargeMessages::default();
        for component in 0..=255 {
            let mut frame = fragment(DataControl::First, 1, b"ab");
            frame.source = JausId::new(1, 1, component);
            large.insert(None, &frame);
        }
        assert_eq!(large.open.len(), MOST_OPEN);
        assert_eq!(large.incomplete(), 256);
    }

    #[test]
    fn a_flood_of_one_address_does_not_drop_the_message_of_another() {
        let mut large = LargeMessages::default();
        let [other, flood] = [1, 66].map(|host| Some(IpAddr::from([10, 0, 0, host])));
        assert_eq!(
            large.insert(other, &fragment(DataControl::First, 1, b"\x03\x4Bab")),
            None
        );
        for component in 0..=255 {
            let mut frame = fragment(DataControl::First, 1, b"ab");
            frame.source = JausId::new(66, 1, component);
            large.insert(flood, &frame);
        }
        assert!(
            large
                .insert(other, &fragment(DataControl::Last, 2, b"cd"))
                .is_some()
        );
    }
}
