//! Reassembly of IP fragments with bounded memory.

use std::collections::{BTreeMap, VecDeque};
use std::net::IpAddr;

use jaus_limits::{first_of_largest, quota_address};

/// Limit of incomplete packets. Beyond it the oldest of the sender with the most is dropped.
const MOST_WAITING: usize = 64;
/// Maximum length of an IP packet.
const LONGEST: usize = 65_535;

/// Identifies the packet of a fragment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Key {
    pub(super) addresses: [IpAddr; 2],
    pub(super) identification: u32,
}

/// A fragment of a packet's payload.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fragment<'a> {
    pub(super) key: Key,
    /// Offset in the payload.
    pub(super) offset: usize,
    /// Whether more fragments follow.
    pub(super) more: bool,
    /// Whether the capture truncated the fragment.
    pub(super) cut: bool,
    pub(super) octets: &'a [u8],
}

/// Incomplete packets, oldest first.
#[derive(Debug, Default)]
pub(super) struct Fragments {
    waiting: VecDeque<Waiting>,
    given_up: u64,
}

#[derive(Debug)]
struct Waiting {
    key: Key,
    pieces: BTreeMap<usize, Vec<u8>>,
    /// Length of the payload, known once the last fragment has arrived.
    length: Option<usize>,
    /// Whether a fragment is truncated, so that the packet cannot be completed.
    spoiled: bool,
}

impl Fragments {
    /// Number of dropped packets and of those still incomplete.
    pub(super) fn incomplete(&self) -> u64 {
        self.given_up + self.waiting.len() as u64
    }

    /// Adds a fragment. Returns the payload when it is complete.
    pub(super) fn insert(&mut self, fragment: Fragment<'_>) -> Option<Vec<u8>> {
        let place = self.place_for(&fragment)?;
        let waiting = &mut self.waiting[place];
        waiting.spoiled |= fragment.cut;
        if !fragment.more {
            waiting.length = Some(fragment.offset + fragment.octets.len());
        }
        waiting
            .pieces
            .insert(fragment.offset, fragment.octets.to_vec());
        let payload = waiting.payload()?;
        self.waiting.remove(place);
        Some(payload)
    }

    /// The entry for the fragment's packet. A fragment that contradicts earlier ones starts a new
    /// packet, because identifications are reused after a while.
    fn place_for(&mut self, fragment: &Fragment<'_>) -> Option<usize> {
        if fragment.offset + fragment.octets.len() > LONGEST {
            self.given_up += 1;
            return None;
        }
        let known = self.waiting.iter().position(|w| w.key == fragment.key);
        match known {
            Some(place) if self.waiting[place].accepts(fragment) => return Some(place),
            Some(place) => {
                self.waiting.remove(place);
                self.given_up += 1;
            }
            None if self.waiting.len() == MOST_WAITING => {
                let place =
                    first_of_largest(&self.waiting, |it| quota_address(it.key.addresses[0]));
                place.and_then(|place| self.waiting.remove(place));
                self.given_up += 1;
            }
            None => {}
        }
        self.waiting.push_back(Waiting {
            key: fragment.key,
            pieces: BTreeMap::new(),
            length: None,
            spoiled: false,
        });
        Some(self.waiting.len() - 1)
    }
}

impl Waiting {
    /// Whether the fragment may belong to the same packet. Senders split without overlap, so it
    /// must be new or an identical duplicate.
    fn accepts(&self, fragment: &Fragment<'_>) -> bool {
        let end = fragment.offset + fragment.octets.len();
        let fits = match self.length {
            Some(length) if fragment.more => end <= length,
            Some(length) => end == length,
            None => true,
        };
        let overlapped = self.pieces.range(..end).next_back();
        fits && match overlapped {
            Some((&offset, piece)) if offset == fragment.offset => piece == fragment.octets,
            Some((&offset, piece)) => offset + piece.len() <= fragment.offset,
            None => true,
        }
    }

    /// The payload, if it is complete.
    fn payload(&self) -> Option<Vec<u8>> {
        let length = self.length?;
        let held: usize = self.pieces.values().map(Vec::len).sum();
        (held == length && !self.spoiled).then(|| self.pieces.values().flatten().copied().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fragment(identification: u32, offset: usize, more: bool, octets: &[u8]) -> Fragment<'_> {
        Fragment {
            key: Key {
                addresses: [IpAddr::from([10, 0, 0, 1]), IpAddr::from([10, 0, 0, 2])],
                identification,
            },
            offset,
            more,
            cut: false,
            octets,
        }
    }

    #[test]
    fn fragments_in_any_order_make_the_packet() {
        let mut fragments = Fragments::default();
        assert_eq!(fragments.insert(fragment(1, 16, false, b"end")), None);
        assert_eq!(fragments.insert(fragment(1, 0, true, b"01234567")), None);
        assert_eq!(fragments.insert(fragment(1, 0, true, b"01234567")), None);
        assert_eq!(
            fragments.insert(fragment(1, 8, true, b"89abcdef")).unwrap(),
            b"0123456789abcdefend"
        );
        assert_eq!(fragments.incomplete(), 0);
    }

    #[test]
    fn an_identification_that_is_used_again_does_not_mix_two_packets() {
        let mut fragments = Fragments::default();
        fragments.insert(fragment(1, 0, true, b"old old "));
        fragments.insert(fragment(1, 0, true, b"new new "));
        assert_eq!(
            fragments.insert(fragment(1, 8, false, b"!")).unwrap(),
            b"new new !"
        );
        assert_eq!(fragments.incomplete(), 1);
    }

    #[test]
    fn an_overlap_never_completes_a_packet() {
        let mut fragments = Fragments::default();
        fragments.insert(fragment(1, 0, true, &[0; 24]));
        assert_eq!(fragments.insert(fragment(1, 8, false, &[1; 16])), None);
        assert_eq!(fragments.insert(fragment(1, 0, true, &[2; 16])), None);
    }

    #[test]
    fn waiting_packets_are_bounded() {
        let mut fragments = Fragments::default();
        for identification in 0..1000 {
            fragments.insert(fragment(identification, 0, true, &[0; 8]));
        }
        assert_eq!(fragments.waiting.len(), MOST_WAITING);
        assert_eq!(fragments.incomplete(), 1000);
    }

    #[test]
    fn a_flood_of_one_sender_does_not_drop_the_packet_of_another() {
        let mut fragments = Fragments::default();
        let of_other = |offset, more, octets| {
            let mut fragment = fragment(1, offset, more, octets);
            fragment.key.addresses[0] = IpAddr::from([10, 0, 0, 3]);
            fragment
        };
        assert_eq!(fragments.insert(of_other(0, true, b"01234567")), None);
        for identification in 0..1000 {
            fragments.insert(fragment(identification, 0, true, &[0; 8]));
        }
        let whole = fragments.insert(of_other(8, false, b"end"));
        assert_eq!(whole.unwrap(), b"01234567end");
    }

    #[test]
    fn a_packet_beyond_the_longest_is_refused() {
        let mut fragments = Fragments::default();
        assert_eq!(fragments.insert(fragment(1, 65_528, false, &[0; 8])), None);
        assert_eq!(fragments.incomplete(), 1);
    }
}
