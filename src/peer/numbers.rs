//! Detects whether a peer numbers its messages over all destinations, as most do, or per
//! destination.

use crate::address::JausId;

/// The latest number sent to each of a few destinations.
///
/// A peer with a single counter cannot send number n to one destination, a message to another, and
/// then n + 1 to the first. A single case could be chance, so it must happen again. It is no case if
/// the message between the two is a retransmission, which may come at any time, or if its number is
/// near theirs, but neither of the two: it may have been overtaken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Numbers {
    latest: [Option<(JausId, u16)>; Self::DESTINATIONS],
    /// Destination and number of the message before.
    last: Option<(JausId, u16)>,
    returns: u8,
}

impl Numbers {
    /// How many destinations are tracked; a further one replaces the latest added.
    const DESTINATIONS: usize = 4;
    /// By how many messages one may be overtaken.
    const OVERTAKEN: u16 = 64;
    /// How often a per-destination count must have continued.
    const ENOUGH: u8 = 2;

    /// Records a number; returns whether the peer is known to count per destination.
    pub(super) fn handle(&mut self, destination: JausId, number: u16) -> bool {
        let mut known = self.latest.iter_mut().flatten();
        match known.find(|(id, _)| *id == destination) {
            Some((_, latest)) if *latest == number => return self.returns >= Self::ENOUGH,
            Some((_, latest)) => {
                let goes_on = number == latest.wrapping_add(1);
                let elsewhere = self.last.is_some_and(|(last, between)| {
                    last != destination && !is_overtaken(number, between)
                });
                *latest = number;
                self.returns += u8::from(goes_on && elsewhere && self.returns < Self::ENOUGH);
            }
            None => {
                let free = self.latest.iter().position(Option::is_none);
                self.latest[free.unwrap_or(Self::DESTINATIONS - 1)] = Some((destination, number));
            }
        }
        self.last = Some((destination, number));
        self.returns >= Self::ENOUGH
    }
}

/// Whether a message with the number `between` may belong before or after `number` - 1 and `number`,
/// between which it arrived.
const fn is_overtaken(number: u16, between: u16) -> bool {
    let distance = (number.wrapping_sub(between) as i16).unsigned_abs();
    let is_one_of_them = number == between || number == between.wrapping_add(1);
    !is_one_of_them && distance <= Numbers::OVERTAKEN
}
