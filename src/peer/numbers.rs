//! How a peer counts: once over all destinations, as most do, or for each by itself.

use crate::address::JausId;

/// The latest number to each of a few destinations.
///
/// Whoever counts once cannot send number n to one destination, anything to another, and then n + 1
/// to the first. Once could be chance or a copy that came late; it must happen again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Numbers {
    latest: [Option<(JausId, u16)>; Self::DESTINATIONS],
    last: Option<JausId>,
    returns: u8,
}

impl Numbers {
    /// Destinations that are told apart; a further one takes the place of the one before it.
    const DESTINATIONS: usize = 4;
    /// How often a count must have gone on where it was left.
    const ENOUGH: u8 = 2;

    /// Takes note of a number; says whether the peer is known to count by destination.
    pub(super) fn handle(&mut self, destination: JausId, number: u16) -> bool {
        let known = self.latest.iter_mut().flatten();
        let known = known.into_iter().find(|(id, _)| *id == destination);
        match known {
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
