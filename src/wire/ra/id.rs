//! Ids of the Reference Architecture: subsystem, node, component and instance, written `20.1.33.1`.

use std::fmt;
use std::str::FromStr;

use super::Version;
use crate::address::JausId;
use crate::as_text::serde_as_text;

/// The id of a component in the Reference Architecture, with one octet per field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RaId {
    /// The subsystem, 1..=254; 255 means all.
    pub subsystem: u8,
    /// The node, 1..=254; 255 means all.
    pub node: u8,
    /// The component, whose number identifies its type (33: primitive driver).
    pub component: u8,
    /// The instance among components of that type.
    pub instance: u8,
}

impl RaId {
    /// The value that means all subsystems, nodes, components or instances.
    pub const ALL: u8 = 255;
    /// The component number of a node manager.
    pub const NODE_MANAGER: u8 = 1;
    /// The component number of a communicator.
    pub const COMMUNICATOR: u8 = 35;

    /// Creates an id from its four fields.
    #[must_use]
    pub const fn new(subsystem: u8, node: u8, component: u8, instance: u8) -> Self {
        Self {
            subsystem,
            node,
            component,
            instance,
        }
    }

    /// Whether it names one or several components as a destination.
    ///
    /// # Errors
    /// A field is 0.
    pub fn recipients(self) -> Result<Recipients, BadId> {
        let fields = self.fields();
        match fields {
            _ if fields.contains(&0) => Err(BadId::Zero(self)),
            _ if fields.contains(&Self::ALL) => Ok(Recipients::Many),
            _ => Ok(Recipients::One),
        }
    }

    /// Checks that it names one component, as every source must.
    ///
    /// # Errors
    /// A field is 0 or 255.
    pub fn require_one(self) -> Result<(), BadId> {
        match self.recipients()? {
            Recipients::One => Ok(()),
            Recipients::Many => Err(BadId::Wildcard(self)),
        }
    }

    /// Whether this destination includes `id`, which names one component.
    #[must_use]
    pub fn includes(self, id: Self) -> bool {
        let meant = |(field, other): (u8, u8)| field == other || field == Self::ALL;
        self.fields().into_iter().zip(id.fields()).all(meant)
    }

    /// The RA id in a header of this version; `None` if the header holds a JAUS id.
    ///
    /// The two older headers carry both kinds: OpenJAUS's messages of the Reference Architecture,
    /// and service messages, which Junior and its forks send in these headers. The header does not
    /// tell them apart. But the first field of an RA id is never 0, whereas that octet of a JAUS id
    /// is 0 unless its subsystem is 256 or above.
    #[must_use]
    pub fn in_header(version: Version, id: JausId) -> Option<Self> {
        let id = Self::from(id);
        (version != Version::As5669a && id.subsystem != 0).then_some(id)
    }

    const fn fields(self) -> [u8; 4] {
        [self.subsystem, self.node, self.component, self.instance]
    }
}

impl From<JausId> for RaId {
    fn from(id: JausId) -> Self {
        let [instance, component, node, subsystem] = id.to_wire();
        Self {
            subsystem,
            node,
            component,
            instance,
        }
    }
}

impl From<RaId> for JausId {
    fn from(id: RaId) -> Self {
        Self::from_wire([id.instance, id.component, id.node, id.subsystem])
    }
}

impl fmt::Display for RaId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}.{}.{}.{}",
            self.subsystem, self.node, self.component, self.instance
        )
    }
}

/// Why an id is not valid in its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BadId {
    /// A field is zero, so that the id names no component.
    #[error("{0} has a field of 0, which is not an address: use 1 to 254")]
    Zero(RaId),
    /// A source, or the destination of a message that wants an answer, must be one component.
    #[error("{0} has a field of 255, the wildcard: name one component with 1 to 254")]
    Wildcard(RaId),
}

/// How many components a destination names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recipients {
    /// One component.
    One,
    /// Several: a field is 255.
    Many,
}

/// The text is not an id of the Reference Architecture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is not an RA id: write subsystem.node.component.instance, each from 0 to 255, such as \
     20.1.33.1"
)]
pub struct InvalidRaId(String);

impl FromStr for RaId {
    type Err = InvalidRaId;

    fn from_str(text: &str) -> Result<Self, InvalidRaId> {
        const LONGEST: usize = 32;
        let wrong = || InvalidRaId(text.chars().take(LONGEST).collect());
        let mut parts = text.split('.').map(|part| {
            let plain = part.bytes().all(|octet| octet.is_ascii_digit());
            part.parse::<u8>().ok().filter(|_| plain)
        });
        let mut next = || parts.next().flatten().ok_or_else(wrong);
        let id = Self {
            subsystem: next()?,
            node: next()?,
            component: next()?,
            instance: next()?,
        };
        match parts.next() {
            None => Ok(id),
            Some(_) => Err(wrong()),
        }
    }
}

serde_as_text!(RaId);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_one_component_and_destinations_may_be_all() {
        let one = RaId::new(10, 1, 35, 1);
        assert_eq!(one.require_one(), Ok(()));
        let all = RaId::new(255, 255, 1, 1);
        assert_eq!(all.recipients(), Ok(Recipients::Many));
        assert_eq!(all.require_one(), Err(BadId::Wildcard(all)));
        let nobody = RaId::new(10, 0, 255, 1);
        assert_eq!(nobody.recipients(), Err(BadId::Zero(nobody)));
        assert!(all.includes(RaId::new(7, 3, 1, 1)));
        assert!(!all.includes(one));
    }

    #[test]
    fn an_id_is_written_with_dots_and_read_back() {
        let id: RaId = "20.1.33.2".parse().unwrap();
        assert_eq!(
            (id.subsystem, id.node, id.component, id.instance),
            (20, 1, 33, 2)
        );
        assert_eq!(id.to_string(), "20.1.33.2");
    }

    #[test]
    fn what_is_no_id_is_told_what_one_looks_like() {
        for wrong in [
            "",
            "20.1.33",
            "20.1.33.1.1",
            "256.1.1.1",
            "+1.1.1.1",
            "a.b.c.d",
            "1.1..1",
        ] {
            let error = wrong.parse::<RaId>().expect_err(wrong).to_string();
            assert!(error.contains("such as 20.1.33.1"), "{error}");
        }
    }

    #[test]
    fn a_header_holds_an_ra_id_if_it_is_an_older_one_with_a_subsystem() {
        let ra = RaId::new(20, 1, 33, 1);
        let small = JausId::new(1, 1, 1);
        for version in [Version::Ra, Version::As5669] {
            assert_eq!(RaId::in_header(version, ra.into()), Some(ra));
            assert_eq!(RaId::in_header(version, small), None);
        }
        assert_eq!(RaId::in_header(Version::As5669a, ra.into()), None);
    }
}
