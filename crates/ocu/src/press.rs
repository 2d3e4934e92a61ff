//! Presses of the emergency stop. A page repeats a stop over several connections until it is confirmed,
//! and a network delivers late what it has lost before, on each connection for itself. So a copy of a stop
//! may arrive after that was cleared, and must not stop the vehicle again; and the request that clears a stop
//! may arrive after the next press, and must not undo it, whichever page it came from. So the request says
//! which stops its operator knows about.

use std::collections::VecDeque;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// One press of a stop: a random number of the page that is loaded, and the number of the press.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
pub struct Press(u32, u32);

/// `PAGE.NUMBER`.
impl fmt::Display for Press {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.0, self.1)
    }
}

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

/// What the operator of a page knows who asks to clear stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct KnownStops {
    /// The last press of that page.
    pub(super) press: Press,
    /// How many presses of all pages the station had taken, by the state that the page shows; `None` for a
    /// page that does not say it.
    pub(super) count: Option<u64>,
}

/// There is a newer stop, which the operator who asks to clear does not know about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stopped again since then: look, and clear it again")]
pub(super) struct PressedSince;

/// What pages have pressed and cleared.
#[derive(Debug, Default)]
pub(super) struct Presses {
    /// By page and target, the latest last.
    all: VecDeque<Pressed>,
    /// How many have been taken.
    count: u64,
    /// The last one that is not listed any more, although it was not cleared.
    forgotten: u64,
}

/// What a page has pressed for one target.
#[derive(Debug, Clone, Copy)]
struct Pressed {
    /// `None` for what does not say whose press it is.
    page: Option<u32>,
    /// `None` for all vehicles.
    vehicle: Option<u16>,
    /// The last press that has arrived.
    taken: u32,
    /// The last press that was cleared, with those before it.
    cleared: u32,
    /// How many presses the station had taken with the last one.
    count: u64,
}

impl Presses {
    /// More than pages press and clear within the time that a network delays.
    const MOST: usize = 64;

    /// Notes a press for a vehicle, or for all. Returns how many presses have been taken with the last
    /// one of this page; `None` if it does not count, because it was cleared.
    pub(super) fn take(&mut self, press: Option<Press>, vehicle: Option<u16>) -> Option<u64> {
        if press.is_some_and(|press| self.is_cleared(press, vehicle)) {
            return None;
        }
        let count = self.count + 1;
        let entry = self.entry(press.map(|it| it.0), vehicle);
        // What names no press may be a copy or not: it counts as a new one.
        let number = press.map_or(entry.taken.saturating_add(1), |it| it.1);
        if number <= entry.taken {
            return Some(entry.count);
        }
        entry.taken = number;
        entry.count = count;
        self.count = count;
        Some(count)
    }

    /// Whether a press was cleared for a vehicle, or for all.
    pub(super) fn is_cleared(&self, press: Press, vehicle: Option<u16>) -> bool {
        self.all.iter().any(|it| {
            let is_meant = it.vehicle.is_none() || it.vehicle == vehicle;
            it.page == Some(press.0) && is_meant && press.1 <= it.cleared
        })
    }

    /// How many presses have been taken, without copies of them.
    pub(super) const fn count(&self) -> u64 {
        self.count
    }

    /// A page clears the presses that its operator knows of, for a vehicle or for all.
    ///
    /// # Errors
    /// If this page or another one has pressed a stop since, which concerns what is to be cleared.
    pub(super) fn clear(
        &mut self,
        known: KnownStops,
        vehicle: Option<u16>,
    ) -> Result<(), PressedSince> {
        let Press(page, last) = known.press;
        // What the station has not taken was counted by another one.
        let is_counted = |count| (self.forgotten..=self.count).contains(&count);
        let is_meant =
            |it: &Pressed| vehicle.is_none() || it.vehicle.is_none() || it.vehicle == vehicle;
        let is_pressed_since = self.all.iter().any(|it| {
            let is_known = match it.page == Some(page) {
                true => it.taken <= last,
                false => {
                    known.count.is_none_or(|known| it.count <= known) || it.taken <= it.cleared
                }
            };
            is_meant(it) && !is_known
        });
        if is_pressed_since || !known.count.is_none_or(is_counted) {
            return Err(PressedSince);
        }
        let others = self.all.iter().filter(|it| is_meant(it));
        let others = others.map(|it| (it.page, it.vehicle.or(vehicle), it.taken));
        for (page, vehicle, last) in others.collect::<Vec<_>>() {
            self.note_cleared(page, vehicle, last);
        }
        self.note_cleared(Some(page), vehicle, last);
        Ok(())
    }

    /// With the last emergency, the stops of all vehicles are cleared.
    pub(super) fn clear_stops_of_all(&mut self) {
        for entry in self.all.iter_mut().filter(|it| it.vehicle.is_none()) {
            entry.cleared = entry.cleared.max(entry.taken);
        }
    }

    fn note_cleared(&mut self, page: Option<u32>, vehicle: Option<u16>, last: u32) {
        let entry = self.entry(page, vehicle);
        entry.cleared = entry.cleared.max(last);
    }

    /// The entry of a page and a target, which is now the latest.
    fn entry(&mut self, page: Option<u32>, vehicle: Option<u16>) -> &mut Pressed {
        let place = self
            .all
            .iter()
            .position(|it| (it.page, it.vehicle) == (page, vehicle));
        let known = place.and_then(|place| self.all.remove(place));
        if self.all.len() >= Self::MOST
            && let Some(oldest) = self.all.pop_front()
            && oldest.taken > oldest.cleared
        {
            self.forgotten = self.forgotten.max(oldest.count);
        }
        self.all.push_back(known.unwrap_or(Pressed {
            page,
            vehicle,
            taken: 0,
            cleared: 0,
            count: 0,
        }));
        let last = self.all.len() - 1;
        &mut self.all[last]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(press: Press) -> KnownStops {
        KnownStops { press, count: None }
    }

    #[test]
    fn a_press_is_cleared_with_those_before_it_and_none_after_it() {
        let mut presses = Presses::default();
        assert!(presses.take(Some(Press(7, 3)), Some(101)).is_some());
        assert!(
            presses.take(Some(Press(7, 3)), Some(101)).is_some(),
            "a copy"
        );
        assert_eq!(presses.clear(known(Press(7, 3)), Some(101)), Ok(()));
        assert!(
            presses.take(Some(Press(7, 3)), Some(101)).is_none(),
            "a late copy"
        );
        assert!(presses.take(Some(Press(7, 1)), Some(101)).is_none());
        assert!(
            presses.take(Some(Press(7, 3)), Some(102)).is_some(),
            "another vehicle"
        );
        assert!(
            presses.take(Some(Press(7, 3)), None).is_some(),
            "all vehicles"
        );
        assert!(
            presses.take(Some(Press(8, 1)), Some(101)).is_some(),
            "another page"
        );
        assert!(
            presses.take(Some(Press(7, 4)), Some(101)).is_some(),
            "a new press"
        );
    }

    #[test]
    fn a_copy_of_a_press_counts_as_the_press() {
        let mut presses = Presses::default();
        assert_eq!(presses.take(Some(Press(7, 1)), Some(101)), Some(1));
        assert_eq!(presses.take(Some(Press(8, 1)), Some(101)), Some(2));
        assert_eq!(
            presses.take(Some(Press(7, 1)), Some(101)),
            Some(1),
            "a copy"
        );
        assert_eq!(presses.take(Some(Press(7, 2)), Some(101)), Some(3));
        assert_eq!(
            presses.take(Some(Press(7, 1)), Some(101)),
            Some(3),
            "overtaken"
        );
        assert_eq!(presses.take(None, Some(101)), Some(4));
    }

    #[test]
    fn clearing_all_clears_the_presses_for_each() {
        let mut presses = Presses::default();
        assert_eq!(presses.clear(known(Press(7, 3)), None), Ok(()));
        assert!(presses.take(Some(Press(7, 3)), None).is_none());
        assert!(presses.take(Some(Press(7, 2)), Some(101)).is_none());
        assert!(presses.take(Some(Press(7, 4)), None).is_some());
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
            assert!(presses.take(Some(Press(7, 5)), Some(101)).is_some());
            assert!(presses.take(Some(Press(7, 6)), stopped).is_some());
            let late = presses.clear(known(Press(7, 5)), cleared);
            assert_eq!(late.is_ok(), is_undone, "{stopped:?} {cleared:?}");
            assert!(
                presses.take(Some(Press(7, 6)), stopped).is_some(),
                "it goes on"
            );
            assert_eq!(presses.clear(known(Press(7, 6)), cleared), Ok(()));
        }
    }

    #[test]
    fn a_press_of_another_page_is_cleared_by_who_knows_of_it() {
        for (press, stopped, cleared, is_undone) in [
            (Some(Press(7, 6)), Some(101), Some(101), false),
            (Some(Press(7, 6)), None, Some(101), false),
            (Some(Press(7, 6)), Some(101), None, false),
            (None, Some(101), Some(101), false),
            (Some(Press(7, 6)), Some(102), Some(101), true),
        ] {
            let mut presses = Presses::default();
            assert!(presses.take(Some(Press(9, 1)), Some(101)).is_some());
            let knows = |count| KnownStops {
                press: Press(8, 1),
                count: Some(count),
            };
            let before = presses.count();
            assert!(presses.take(press, stopped).is_some());
            let late = presses.clear(knows(before), cleared);
            assert_eq!(late.is_ok(), is_undone, "{press:?} {stopped:?} {cleared:?}");
            let now = presses.count();
            assert!(
                presses.take(press, stopped).is_some(),
                "a copy, unless it names no press"
            );
            assert_eq!(presses.count() == now, press.is_some());
            assert_eq!(presses.clear(knows(presses.count()), cleared), Ok(()));
            let is_cleared = press.map(|it| presses.is_cleared(it, cleared.or(stopped)));
            assert_eq!(is_cleared, press.map(|_| !is_undone), "a copy");
        }
    }

    #[test]
    fn a_stop_of_all_that_was_cleared_for_one_vehicle_holds_for_the_others() {
        let mut presses = Presses::default();
        let count = presses.take(Some(Press(7, 1)), None);
        let known = KnownStops {
            press: Press(8, 0),
            count,
        };
        assert_eq!(presses.clear(known, Some(101)), Ok(()));
        assert!(presses.take(Some(Press(7, 1)), None).is_some(), "a copy");
        assert!(presses.is_cleared(Press(7, 1), Some(101)));
        assert!(!presses.is_cleared(Press(7, 1), Some(102)));
        assert!(!presses.is_cleared(Press(7, 2), Some(101)), "a new press");
        presses.clear_stops_of_all();
        assert!(presses.take(Some(Press(7, 1)), None).is_none());
        assert!(presses.take(Some(Press(7, 2)), None).is_some());
    }

    #[test]
    fn what_its_own_page_has_cleared_needs_no_other_page_that_knows_of_it() {
        let mut presses = Presses::default();
        assert!(presses.take(Some(Press(7, 6)), Some(101)).is_some());
        assert_eq!(presses.clear(known(Press(7, 6)), Some(101)), Ok(()));
        assert_eq!(presses.clear(known(Press(8, 0)), Some(101)), Ok(()));
    }

    #[test]
    fn what_many_pages_press_is_bounded() {
        let mut presses = Presses::default();
        for page in 0..1000 {
            assert!(presses.take(Some(Press(page, 1)), None).is_some());
            assert_eq!(presses.clear(known(Press(page, 1)), None), Ok(()));
        }
        assert_eq!(presses.all.len(), Presses::MOST);
        assert!(presses.take(Some(Press(999, 1)), None).is_none());
    }

    #[test]
    fn a_press_that_is_not_listed_any_more_and_one_of_another_station_are_not_known() {
        let mut presses = Presses::default();
        for page in 0..100 {
            assert!(presses.take(Some(Press(page, 1)), Some(101)).is_some());
        }
        let knows = |count| KnownStops {
            press: Press(999, 0),
            count: Some(count),
        };
        assert_eq!(presses.clear(knows(35), Some(102)), Err(PressedSince));
        assert_eq!(presses.clear(knows(101), Some(101)), Err(PressedSince));
        assert_eq!(presses.clear(knows(100), Some(101)), Ok(()));
    }

    #[test]
    fn a_press_is_written_as_it_is_read() {
        let press = Press(16_777_215, 12);
        assert_eq!(press.to_string().parse(), Ok(press));
        assert_eq!(press.to_string(), "16777215.12");
        for wrong in ["", "1", "1.", ".1", "1.2.3", "-1.2", "1.4294967296"] {
            assert_eq!(wrong.parse::<Press>(), Err(()), "{wrong}");
        }
    }
}
