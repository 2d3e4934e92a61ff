//! A selection of messages by service, name or code.

use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

use super::Table;

/// Messages, as in `PrimitiveDriver,SetTravelSpeed,D103h`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// The codes that are named, and those of the catalogue behind the names.
    codes: BTreeSet<u16>,
    /// The names: further definitions may have codes for them.
    names: Vec<String>,
    /// Those names that the catalogue does not have.
    unknown: Vec<String>,
    /// Whether it selects every message.
    is_any: bool,
    /// As it was written.
    text: String,
}

impl Selection {
    /// The message with this name and code.
    pub(super) fn of(name: &str, code: u16) -> Self {
        Self {
            codes: BTreeSet::from([code]),
            names: vec![name.to_owned()],
            text: name.to_owned(),
            ..Self::default()
        }
    }

    /// Every message.
    pub(super) fn any() -> Self {
        Self {
            is_any: true,
            text: "any".to_owned(),
            ..Self::default()
        }
    }

    /// The selected codes, unless it is every message.
    #[must_use]
    pub fn codes(&self, table: &Table) -> BTreeSet<u16> {
        let further = self.names.iter().flat_map(|name| table.further(name));
        further.chain(self.codes.iter().copied()).collect()
    }

    /// Whether it was written without anything, and so selects nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.text.is_empty()
    }

    /// Whether it selects messages with this code, with the names of this table.
    #[must_use]
    pub fn contains(&self, code: u16, table: &Table) -> bool {
        let has = |name: &String| table.further(name).any(|it| it == code);
        self.is_any || self.codes.contains(&code) || self.names.iter().any(has)
    }

    /// Whether it has a name that no definition in use has.
    pub(super) fn has_unknown(&self, table: &Table) -> bool {
        self.verify(table).is_err()
    }

    /// Checks that the definitions in use have all of its names.
    ///
    /// # Errors
    /// The first name that they do not have.
    pub fn verify(&self, table: &Table) -> Result<(), UnknownName> {
        let is_unknown = |name: &&String| table.further(name).next().is_none();
        let unknown = self.unknown.iter().find(is_unknown);
        unknown.map_or(Ok(()), |name| Err(UnknownName::of(name)))
    }
}

/// A name that is neither a service, a message nor a code.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is not a service, a message or a message code of the definitions in use: write a name as `jaus \
     list services` and `jaus list messages` show it, or four hexadecimal digits and an h, such as D103h"
)]
pub struct UnknownName(String);

impl UnknownName {
    fn of(name: &str) -> Self {
        Self(super::shortened(name))
    }
}

impl FromStr for Selection {
    type Err = UnknownName;

    /// Reads names of messages and services, and codes, separated by commas. Names that the catalogue does
    /// not have may be of other definitions: see [`Selection::verify`].
    fn from_str(text: &str) -> Result<Self, UnknownName> {
        let table = Table::default();
        let mut selection = Self {
            text: text.to_owned(),
            ..Self::default()
        };
        for name in text.split(',') {
            if let Some(code) = code_of(name) {
                selection.codes.insert(code);
                continue;
            }
            if !may_be_name(name) {
                return Err(UnknownName::of(name));
            }
            let codes = table.codes_of(name);
            if codes.is_empty() {
                selection.unknown.push(name.to_owned());
            }
            selection.codes.extend(codes);
            selection.names.push(name.to_owned());
        }
        Ok(selection)
    }
}

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// The code of `D103h`.
fn code_of(name: &str) -> Option<u16> {
    let digits = name.strip_suffix(['h', 'H']).filter(|it| it.len() == 4)?;
    u16::from_str_radix(digits, 16).ok()
}

/// Whether a definition may have this name.
fn may_be_name(name: &str) -> bool {
    let is_part = |it: char| it.is_ascii_alphanumeric() || matches!(it, '_' | '-' | '.' | ':');
    name.starts_with(|it: char| it.is_ascii_alphabetic()) && name.chars().all(is_part)
}
