//! Subsystem numbers in one direction: an offset, and entries for exceptions.

use super::error::{InvalidIds, Side, Unmapped};

/// Numbers of one side's subsystems on the other side.
///
/// Numbers are unique: a number assigned by an entry is not assigned by the offset, so the
/// subsystem that the offset would map to it has none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Subsystems {
    home: Side,
    offset: i32,
    /// Number on the own side, number on the other side.
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

    /// The number on the other side.
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

    /// The subsystem with this number on the other side.
    pub(super) fn home(&self, number: u16) -> Option<u16> {
        let entry = self.entries.iter().find(|(_, to)| *to == number);
        let candidate = match entry {
            Some(&(from, _)) => from,
            None => u16::try_from(i32::from(number).checked_sub(self.offset)?).ok()?,
        };
        // A subsystem with an entry has that number only.
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
