//! Presses of the emergency stop. A page repeats a stop over several connections until it is confirmed,
//! and a network delivers late what it has lost before, on each connection for itself. So a copy of a stop
//! may arrive after the same page has cleared it, and must not stop the vehicle again; and the request that
//! clears a stop may arrive after the next press, and must not undo that. What pages do to each other's stops
//! has no order: the last one to arrive counts.

use std::collections::VecDeque;
use std::str::FromStr;

use serde::Deserialize;

/// One press of a stop: a random number of the page that is loaded, and the number of the press.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub struct Press(u32, u32);

/// Written `PAGE.NUMBER`.
impl FromStr for Press {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let (page, number) = text.split_once('.').ok_or(())?;
        match (page.parse(), number.parse()) {
            (Ok(page), Ok(number)) => Ok(Self(page, number)),
            _ => Err(()),
        }
    }
}

/// The page has pressed a stop since it asked to clear one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stopped again since then: clear it again")]
pub(super) struct PressedSince;

/// What pages have pressed and cleared.
#[derive(Debug, Default)]
pub(super) struct Presses {
    /// By page and target, the latest last.
    all: VecDeque<Pressed>,
}

/// What a page has pressed for one target.
#[derive(Debug, Clone, Copy)]
struct Pressed {
    page: u32,
    /// `None` for all vehicles.
    vehicle: Option<u16>,
    /// The last press that has arrived.
    taken: u32,
    /// The last press that was cleared, with those before it.
    cleared: u32,
}

impl Presses {
    /// More than pages press and clear within the time that a network delays.
    const MOST: usize = 64;

    /// Notes a press for a vehicle, or for all. Returns whether it counts: the page has not cleared it.
    pub(super) fn take(&mut self, press: Press, vehicle: Option<u16>) -> bool {
        let is_cleared = self.all.iter().any(|it| {
            let is_meant = it.vehicle.is_none() || it.vehicle == vehicle;
            it.page == press.0 && is_meant && press.1 <= it.cleared
        });
        if !is_cleared {
            let entry = self.entry(press.0, vehicle);
            entry.taken = entry.taken.max(press.1);
        }
        !is_cleared
    }

    /// The page of this press clears what it has pressed until then for a vehicle, or for all.
    ///
    /// # Errors
    /// If it has pressed another stop since, which concerns what is to be cleared.
    pub(super) fn clear(&mut self, last: Press, vehicle: Option<u16>) -> Result<(), PressedSince> {
        let is_pressed_since = self.all.iter().any(|it| {
            let is_meant = vehicle.is_none() || it.vehicle.is_none() || it.vehicle == vehicle;
            it.page == last.0 && is_meant && it.taken > last.1
        });
        if is_pressed_since {
            return Err(PressedSince);
        }
        let entry = self.entry(last.0, vehicle);
        entry.cleared = entry.cleared.max(last.1);
        Ok(())
    }

    /// The entry of a page and a target, which is now the latest.
    fn entry(&mut self, page: u32, vehicle: Option<u16>) -> &mut Pressed {
        let place = self
            .all
            .iter()
            .position(|it| (it.page, it.vehicle) == (page, vehicle));
        let known = place.and_then(|place| self.all.remove(place));
        if self.all.len() >= Self::MOST {
            self.all.pop_front();
        }
        self.all.push_back(known.unwrap_or(Pressed {
            page,
            vehicle,
            taken: 0,
            cleared: 0,
        }));
        let last = self.all.len() - 1;
        &mut self.all[last]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_press_is_cleared_with_those_before_it_and_none_after_it() {
        let mut presses = Presses::default();
        assert!(presses.take(Press(7, 3), Some(101)));
        assert!(presses.take(Press(7, 3), Some(101)), "a copy");
        assert_eq!(presses.clear(Press(7, 3), Some(101)), Ok(()));
        assert!(!presses.take(Press(7, 3), Some(101)), "a late copy");
        assert!(!presses.take(Press(7, 1), Some(101)));
        assert!(presses.take(Press(7, 3), Some(102)), "another vehicle");
        assert!(presses.take(Press(7, 3), None), "all vehicles");
        assert!(presses.take(Press(8, 1), Some(101)), "another page");
        assert!(presses.take(Press(7, 4), Some(101)), "a new press");
    }

    #[test]
    fn clearing_all_clears_the_presses_for_each() {
        let mut presses = Presses::default();
        assert_eq!(presses.clear(Press(7, 3), None), Ok(()));
        assert!(!presses.take(Press(7, 3), None));
        assert!(!presses.take(Press(7, 2), Some(101)));
        assert!(presses.take(Press(7, 4), None));
    }

    #[test]
    fn what_clears_an_earlier_press_does_not_undo_a_later_one() {
        for (stopped, cleared, is_undone) in [
            (Some(101), Some(101), false),
            (Some(101), None, false),
            (None, Some(101), false),
            (None, None, false),
            (Some(102), Some(101), true),
        ] {
            let mut presses = Presses::default();
            assert!(presses.take(Press(7, 5), Some(101)));
            assert!(presses.take(Press(7, 6), stopped));
            let late = presses.clear(Press(7, 5), cleared);
            assert_eq!(late.is_ok(), is_undone, "{stopped:?} {cleared:?}");
            assert!(presses.take(Press(7, 6), stopped), "it goes on");
            assert_eq!(presses.clear(Press(7, 6), cleared), Ok(()));
        }
        let mut presses = Presses::default();
        assert!(presses.take(Press(7, 6), Some(101)));
        assert_eq!(
            presses.clear(Press(8, 1), Some(101)),
            Ok(()),
            "another page"
        );
    }

    #[test]
    fn what_many_pages_press_is_bounded() {
        let mut presses = Presses::default();
        for page in 0..1000 {
            assert!(presses.take(Press(page, 1), None));
            assert_eq!(presses.clear(Press(page, 1), None), Ok(()));
        }
        assert_eq!(presses.all.len(), Presses::MOST);
        assert!(!presses.take(Press(999, 1), None));
    }

    #[test]
    fn a_press_is_read_from_text() {
        assert_eq!("16777215.12".parse(), Ok(Press(16_777_215, 12)));
        for wrong in ["", "1", "1.", ".1", "1.2.3", "-1.2", "1.4294967296"] {
            assert_eq!(wrong.parse::<Press>(), Err(()), "{wrong}");
        }
    }
}
