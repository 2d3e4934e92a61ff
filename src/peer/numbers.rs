//! Detects whether a peer numbers its messages over all destinations, as most do, or per
//! destination.

use crate::address::JausId;

/// The latest number sent to each of a few destinations.
///
/// A peer with a single counter cannot send number n to one destination, a message to another, and
/// then n + 1 to the first. A single case could be chance or a late copy, so it must happen again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Numbers {
    latest: [Option<(JausId, u16)>; Self::DESTINATIONS],
    last: Option<JausId>,
    returns: u8,
}

impl Numbers {
    /// How many destinations are tracked; a further one replaces the latest added.
    const DESTINATIONS: usize = 4;
    /// How often a per-destination count must have continued.
    const ENOUGH: u8 = 2;

    /// Records a number; returns whether the peer is known to count per destination.
    pub(super) fn handle(&mut self, destination: JausId, number: u16) -> bool {
        let mut known = self.latest.iter_mut().flatten();
        match known.find(|(id, _)| *id == destination) {
            Some((_, latest)) => {
                let goes_on = number == latest.wrapping_add(1);
                let elsewhere = self.last.is_some_and(|last| last != destination);
                *latest = number;
                self.returns += u8::from(goes_on && elsewhere && self.returns < Self::ENOUGH);
            }
            None => {
                let free = self.latest.iter().position(Option::is_none);
                self.latest[free.unwrap_or(Self::DESTINATIONS - 1)] = Some((destination, number));
            }
        }
        self.last = Some(destination);
        self.returns >= Self::ENOUGH
    }
}
