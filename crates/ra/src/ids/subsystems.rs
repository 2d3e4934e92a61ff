//! Subsystem numbers in one direction: an offset, and entries for those that it does not suit.

use super::error::{InvalidIds, Side, Unmapped};

/// By which numbers the subsystems of one side are seen on the other.
///
/// No two get the same number: a number that an entry gives is not given by the offset, so the one
/// to whom the offset would give it has none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Subsystems {
    home: Side,
    offset: i32,
    /// Number at home, number abroad.
    entries: Vec<(u16, u16)>,
}

impl Subsystems {
    pub(super) fn new(
        home: Side,
        offset: i32,
        entries: impl Iterator<Item = (u16, u16)>,
    ) -> Result<Self, InvalidIds> {
        let mut checked: Vec<(u16, u16)> = Vec::new();
        for entry in entries {
            for (side, number) in [(home, entry.0), (home.other(), entry.1)] {
                if !side.subsystems().contains(&number) {
                    return Err(InvalidIds::Subsystem { home, side, number });
                }
            }
            for &(from, to) in &checked {
                for (side, taken, number) in [(home, from, entry.0), (home.other(), to, entry.1)] {
                    if taken == number {
                        return Err(InvalidIds::SubsystemTwice { home, side, number });
                    }
                }
            }
            checked.push(entry);
        }
        let subsystems = Self {
            home,
            offset,
            entries: checked,
        };
        match home
            .subsystems()
            .any(|number| subsystems.shifted(number).is_some())
        {
            true => Ok(subsystems),
            false => Err(InvalidIds::Offset { home, offset }),
        }
    }

    /// The number by which the other side sees it.
    pub(super) fn abroad(&self, number: u16) -> Result<u16, Unmapped> {
        let side = self.home;
        if !side.subsystems().contains(&number) {
            return Err(Unmapped::NotUnicast);
        }
        if let Some(&(_, to)) = self.entries.iter().find(|(from, _)| *from == number) {
            return Ok(to);
        }
        let to = self
            .shifted(number)
            .ok_or(Unmapped::Subsystem { side, number })?;
        match self.entries.iter().find(|(_, taken)| *taken == to) {
            None => Ok(to),
            Some(&(by, _)) => Err(Unmapped::SubsystemTaken { side, number, by }),
        }
    }

    /// The subsystem that the other side sees by this number.
    pub(super) fn home(&self, number: u16) -> Option<u16> {
        let entry = self.entries.iter().find(|(_, to)| *to == number);
        let candidate = match entry {
            Some(&(from, _)) => from,
            None => u16::try_from(i32::from(number).checked_sub(self.offset)?).ok()?,
        };
        // Whoever has an entry is seen by its number alone.
        (self.abroad(candidate) == Ok(number)).then_some(candidate)
    }

    fn shifted(&self, number: u16) -> Option<u16> {
        let shifted = u16::try_from(i32::from(number).checked_add(self.offset)?).ok()?;
        self.home
            .other()
            .subsystems()
            .contains(&shifted)
            .then_some(shifted)
    }
}
