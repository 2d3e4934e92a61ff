//! The id table: default rules, entries, and the check for collisions of subsystem numbers.

use std::collections::BTreeSet;

use super::error::{Collision, InvalidIds, Side, Unmapped};
use super::subsystems::Subsystems;
use super::{ComponentEntry, RaComponent, RaId, Settings, SubsystemEntry};
use jaus::address::JausId;

/// Highest type of the default rule.
const MOST_TYPES: u8 = 63;
/// Highest instance of the default rule.
const MOST_INSTANCES: u8 = 3;
/// JAUS component numbers for each instance.
const STRIDE: u8 = 64;

/// Maps the ids of each side to the other.
///
/// ```
/// use jaus::address::JausId;
/// use jaus_ra::RaId;
/// use jaus_ra::ids::{IdTable, RaComponent, Settings};
///
/// let ids = IdTable::new(&Settings::default())?;
/// let second_driver: RaId = "20.1.33.2".parse()?;
/// assert_eq!(ids.jaus_of(second_driver), Some(JausId::new(20, 1, 97)));
/// assert_eq!(ids.ra_behind(JausId::new(20, 1, 97)), Some(second_driver));
///
/// let ours = JausId::new(101, 1, 7);
/// let shown = ids.ra_of(ours, RaComponent::PRIMITIVE_DRIVER).ok_or("shown")?;
/// assert_eq!(shown.to_string(), "101.1.33.7");
/// assert_eq!(ids.jaus_behind(shown), Some(ours));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IdTable {
    ra: Subsystems,
    jaus: Subsystems,
    ra_components: Vec<ComponentEntry>,
    jaus_components: Vec<ComponentEntry>,
    /// Subsystems present on each side; bounded by the valid numbers.
    present: BTreeSet<(Side, u16)>,
}

impl IdTable {
    /// Builds the table from settings.
    ///
    /// # Errors
    /// The first invalid entry or offset, with a remedy.
    pub fn new(settings: &Settings) -> Result<Self, InvalidIds> {
        let from_ra = |entry: &SubsystemEntry| (u16::from(entry.ra), entry.jaus);
        let from_jaus = |entry: &SubsystemEntry| (entry.jaus, u16::from(entry.ra));
        let ra = settings.ra_subsystems.iter().map(from_ra);
        let jaus = settings.jaus_subsystems.iter().map(from_jaus);
        let table = Self {
            ra: Subsystems::new(Side::Ra, settings.ra_offset, ra)?,
            jaus: Subsystems::new(Side::Jaus, settings.jaus_offset, jaus)?,
            ra_components: settings.ra_components.clone(),
            jaus_components: settings.jaus_components.clone(),
            present: BTreeSet::new(),
        };
        table.check_components(Side::Ra)?;
        table.check_components(Side::Jaus)?;
        Ok(table)
    }

    /// JAUS id of an RA component.
    #[must_use]
    pub fn jaus_of(&self, id: RaId) -> Option<JausId> {
        self.jaus_id(id).ok()
    }

    /// RA id of one of our components, shown as this component type.
    #[must_use]
    pub fn ra_of(&self, id: JausId, part: RaComponent) -> Option<RaId> {
        self.ra_id(id, part).ok()
    }

    /// Like [`jaus_of`](Self::jaus_of), with the reason for `None`.
    ///
    /// # Errors
    /// Why the component cannot be shown, and the setting that would change it.
    pub fn jaus_id(&self, id: RaId) -> Result<JausId, Unmapped> {
        if !is_unicast(id) {
            return Err(Unmapped::NotUnicast);
        }
        let subsystem = self.ra.abroad(id.subsystem.into())?;
        if let Some(entry) = self.ra_components.iter().find(|entry| entry.ra == id) {
            return Ok(entry.jaus);
        }
        let by_rule = id.component <= MOST_TYPES && id.instance <= MOST_INSTANCES;
        if !by_rule {
            return Err(Unmapped::Component(id));
        }
        let component = id.component + STRIDE * (id.instance - 1);
        let shown = JausId::new(subsystem, id.node, component);
        match self.ra_components.iter().any(|entry| entry.jaus == shown) {
            true => Err(Unmapped::ComponentTaken(Side::Ra)),
            false => Ok(shown),
        }
    }

    /// Like [`ra_of`](Self::ra_of), with the reason for `None`.
    ///
    /// # Errors
    /// Why the component cannot be shown, and the setting that would change it.
    pub fn ra_id(&self, id: JausId, part: RaComponent) -> Result<RaId, Unmapped> {
        if !id.is_unicast() {
            return Err(Unmapped::NotUnicast);
        }
        if part.is_infrastructure() {
            return Err(Unmapped::Reserved);
        }
        // RA subsystem numbers fit an octet.
        let subsystem = self.jaus.abroad(id.subsystem())? as u8;
        let mut entries = self.jaus_components.iter();
        let its = |entry: &&ComponentEntry| entry.jaus == id && entry.ra.component == part.0;
        if let Some(entry) = entries.find(its) {
            return Ok(entry.ra);
        }
        let shown = RaId {
            subsystem,
            node: id.node(),
            component: part.0,
            instance: id.component(),
        };
        if !is_unicast(shown) {
            return Err(Unmapped::NotUnicast);
        }
        match self.jaus_components.iter().any(|entry| entry.ra == shown) {
            true => Err(Unmapped::ComponentTaken(Side::Jaus)),
            false => Ok(shown),
        }
    }

    /// RA component with this JAUS id.
    #[must_use]
    pub fn ra_behind(&self, id: JausId) -> Option<RaId> {
        let entry = self.ra_components.iter().find(|entry| entry.jaus == id);
        let candidate = match entry {
            Some(entry) => entry.ra,
            None => RaId {
                subsystem: self.ra.home(id.subsystem())? as u8,
                node: id.node(),
                component: id.component() % STRIDE,
                instance: id.component() / STRIDE + 1,
            },
        };
        (self.jaus_of(candidate)? == id).then_some(candidate)
    }

    /// Our component with this RA id, shown as that component type.
    #[must_use]
    pub fn jaus_behind(&self, id: RaId) -> Option<JausId> {
        let entry = self.jaus_components.iter().find(|entry| entry.ra == id);
        let candidate = match entry {
            Some(entry) => entry.jaus,
            None => {
                let subsystem = self.jaus.home(id.subsystem.into())?;
                JausId::new(subsystem, id.node, id.instance)
            }
        };
        (self.ra_of(candidate, RaComponent(id.component))? == id).then_some(candidate)
    }

    /// JAUS id of the component with this RA id, on either side; `None` if its subsystem was not
    /// [claimed](Self::claim), as the same number may exist on both sides.
    #[must_use]
    pub fn known_to_jaus(&self, id: RaId) -> Option<JausId> {
        if self.is_home(Side::Ra, id.subsystem.into()) {
            return self.jaus_of(id);
        }
        self.jaus_behind(id)
            .filter(|ours| self.is_home(Side::Jaus, ours.subsystem()))
    }

    /// RA id of the component with this JAUS id, on either side; `None` as in
    /// [`known_to_jaus`](Self::known_to_jaus). Our components are mapped as subsystem commanders,
    /// as messages name clients.
    #[must_use]
    pub fn known_to_ra(&self, id: JausId) -> Option<RaId> {
        if self.is_home(Side::Jaus, id.subsystem()) {
            return self.ra_of(id, RaComponent::SUBSYSTEM_COMMANDER);
        }
        self.ra_behind(id)
            .filter(|theirs| self.is_home(Side::Ra, theirs.subsystem.into()))
    }

    fn is_home(&self, side: Side, subsystem: u16) -> bool {
        self.present.contains(&(side, subsystem))
    }

    /// Number of a `home` subsystem on the other side.
    ///
    /// # Errors
    /// The reason why it has none.
    pub fn subsystem(&self, home: Side, number: u16) -> Result<u16, Unmapped> {
        self.numbers(home).abroad(number)
    }

    /// The `home` subsystem that has this number on the other side.
    #[must_use]
    pub fn subsystem_behind(&self, home: Side, number: u16) -> Option<u16> {
        self.numbers(home).home(number)
    }

    /// Claims a subsystem number for a side and returns the number on the other side; `None` if it
    /// has none. Call it before the subsystem is shown; the other functions work without a claim.
    ///
    /// # Errors
    /// [`Collision`] if a subsystem with that number exists on the other side, or if a subsystem of
    /// the other side is already shown under its number. The first claim stays valid; the later one
    /// is not recorded.
    pub fn claim(&mut self, home: Side, number: u16) -> Result<Option<u16>, Collision> {
        let abroad = home.other();
        let shown = self.numbers(home).abroad(number).ok();
        if let Some(shown_as) = shown
            && self.present.contains(&(abroad, shown_as))
        {
            return Err(Collision {
                home,
                number,
                shown_as,
            });
        }
        if let Some(guest) = self.numbers(abroad).home(number)
            && self.present.contains(&(abroad, guest))
        {
            return Err(Collision {
                home: abroad,
                number: guest,
                shown_as: number,
            });
        }
        if home.subsystems().contains(&number) {
            self.present.insert((home, number));
        }
        Ok(shown)
    }

    /// Removes the claim of a lost subsystem.
    pub fn release(&mut self, home: Side, number: u16) {
        self.present.remove(&(home, number));
    }

    const fn numbers(&self, home: Side) -> &Subsystems {
        match home {
            Side::Ra => &self.ra,
            Side::Jaus => &self.jaus,
        }
    }

    /// Checks that component entries name a single component and stay in its node.
    fn check_components(&self, home: Side) -> Result<(), InvalidIds> {
        let entries = match home {
            Side::Ra => &self.ra_components,
            Side::Jaus => &self.jaus_components,
        };
        for (index, &entry) in entries.iter().enumerate() {
            self.check_component(home, entry)?;
            let ComponentEntry { ra, jaus } = entry;
            let same = |other: &ComponentEntry| match home {
                Side::Ra => other.ra == ra || other.jaus == jaus,
                Side::Jaus => {
                    let same_part = other.ra.component == ra.component;
                    other.ra == ra || other.jaus == jaus && same_part
                }
            };
            if entries[..index].iter().any(same) {
                return Err(InvalidIds::ComponentTwice { home, ra, jaus });
            }
        }
        Ok(())
    }

    fn check_component(&self, home: Side, entry: ComponentEntry) -> Result<(), InvalidIds> {
        let ComponentEntry { ra, jaus } = entry;
        if !is_unicast(ra) || !jaus.is_unicast() {
            return Err(InvalidIds::NotUnicast { home, ra, jaus });
        }
        if home == Side::Jaus && RaComponent(ra.component).is_infrastructure() {
            return Err(InvalidIds::Reserved(ra));
        }
        let (number, seen_as) = match home {
            Side::Ra => (ra.subsystem.into(), jaus.subsystem()),
            Side::Jaus => (jaus.subsystem(), ra.subsystem.into()),
        };
        let expected = match self.numbers(home).abroad(number) {
            Ok(expected) if expected != seen_as => {
                let other = home.other();
                format!("{home} subsystem {number} is {other} subsystem {expected}")
            }
            Ok(_) if ra.node != jaus.node() => "write the same node in both".to_owned(),
            Ok(_) => return Ok(()),
            Err(unmapped) => unmapped.to_string(),
        };
        Err(InvalidIds::LeavesNode {
            home,
            ra,
            jaus,
            expected,
        })
    }
}

/// Whether the id names one component: no field is 0 or 255.
const fn is_unicast(id: RaId) -> bool {
    const fn one(number: u8) -> bool {
        number != 0 && number != u8::MAX
    }
    one(id.subsystem) && one(id.node) && one(id.component) && one(id.instance)
}
