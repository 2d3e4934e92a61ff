//! Presses of the emergency stop. A page repeats a stop over several connections until it is confirmed,
//! and a network delivers late what it has lost before: a copy may arrive after the same page has cleared
//! the stop. It must not stop the vehicle again.

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

/// The presses that their own pages have cleared.
#[derive(Debug, Default)]
pub(super) struct ClearedPresses {
    /// The last press of each page and target, by when it was cleared. The target `None` is all vehicles.
    last: VecDeque<(Press, Option<u16>)>,
}

impl ClearedPresses {
    /// More than pages clear within the time that a network delays.
    const MOST: usize = 64;

    /// The page of this press clears what it has pressed so far for a vehicle, or for all.
    pub(super) fn add(&mut self, last: Press, vehicle: Option<u16>) {
        let is_same = |it: &(Press, Option<u16>)| (it.0.0, it.1) == (last.0, vehicle);
        self.last.retain(|it| !is_same(it));
        if self.last.len() >= Self::MOST {
            self.last.pop_front();
        }
        self.last.push_back((last, vehicle));
    }

    /// Whether a press for a vehicle, or for all, was cleared.
    pub(super) fn contains(&self, press: Press, vehicle: Option<u16>) -> bool {
        self.last.iter().any(|&(last, cleared)| {
            let is_meant = cleared.is_none() || cleared == vehicle;
            is_meant && last.0 == press.0 && press.1 <= last.1
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_press_is_cleared_with_those_before_it_and_none_after_it() {
        let mut cleared = ClearedPresses::default();
        cleared.add(Press(7, 3), Some(101));
        assert!(cleared.contains(Press(7, 3), Some(101)));
        assert!(cleared.contains(Press(7, 1), Some(101)));
        assert!(!cleared.contains(Press(7, 4), Some(101)), "a new press");
        assert!(!cleared.contains(Press(8, 1), Some(101)), "another page");
        assert!(!cleared.contains(Press(7, 3), Some(102)), "another vehicle");
        assert!(!cleared.contains(Press(7, 3), None), "all vehicles");
    }

    #[test]
    fn clearing_all_clears_the_presses_for_each() {
        let mut cleared = ClearedPresses::default();
        cleared.add(Press(7, 3), None);
        assert!(cleared.contains(Press(7, 3), None));
        assert!(cleared.contains(Press(7, 2), Some(101)));
        assert!(!cleared.contains(Press(7, 4), None));
    }

    #[test]
    fn what_many_pages_clear_is_bounded() {
        let mut cleared = ClearedPresses::default();
        for page in 0..1000 {
            cleared.add(Press(page, 1), None);
            cleared.add(Press(page, 2), None);
        }
        assert_eq!(cleared.last.len(), ClearedPresses::MOST);
        assert!(cleared.contains(Press(999, 2), None));
    }

    #[test]
    fn a_press_is_read_from_text() {
        assert_eq!("16777215.12".parse(), Ok(Press(16_777_215, 12)));
        for wrong in ["", "1", "1.", ".1", "1.2.3", "-1.2", "1.4294967296"] {
            assert_eq!(wrong.parse::<Press>(), Err(()), "{wrong}");
        }
    }
}
