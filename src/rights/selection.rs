//! A selection of messages by service, name or code.

use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

use super::Table;

/// Messages, as in `PrimitiveDriver,SetTravelSpeed,D103h`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    codes: BTreeSet<u16>,
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
            is_any: false,
            text: name.to_owned(),
        }
    }

    /// Every message.
    pub(super) fn any() -> Self {
        Self {
            codes: BTreeSet::new(),
            is_any: true,
            text: "any".to_owned(),
        }
    }

    /// The selected codes, unless it is every message.
    pub fn codes(&self) -> impl Iterator<Item = u16> + '_ {
        self.codes.iter().copied()
    }

    /// Whether it selects nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.codes.is_empty() && !self.is_any
    }

    /// Whether it selects messages with this code.
    #[must_use]
    pub fn contains(&self, code: u16) -> bool {
        self.is_any || self.codes.contains(&code)
    }
}

/// A name that is neither a service, a message nor a code.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is not a service, a message or a message code: write a name as `jaus list services` and \
     `jaus list messages` show it, or four hexadecimal digits and an h, such as D103h"
)]
pub struct UnknownName(String);

impl FromStr for Selection {
    type Err = UnknownName;

    /// Reads names, separated by commas, of messages and services of the catalogue, and codes.
    fn from_str(text: &str) -> Result<Self, UnknownName> {
        let table = Table::default();
        let mut codes = BTreeSet::new();
        for name in text.split(',') {
            let found = codes_of(name, &table);
            if found.is_empty() {
                return Err(UnknownName(super::shortened(name)));
            }
            codes.extend(found);
        }
        Ok(Self {
            codes,
            is_any: false,
            text: text.to_owned(),
        })
    }
}

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// The codes that a name stands for; none if it is unknown.
fn codes_of(name: &str, table: &Table) -> Vec<u16> {
    let digits = name.strip_suffix(['h', 'H']).filter(|it| it.len() == 4);
    let code = digits.and_then(|it| u16::from_str_radix(it, 16).ok());
    code.map_or_else(|| table.codes_of(name), |code| vec![code])
}
