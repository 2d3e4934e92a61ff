//! The words of rules, as people write them.

use std::fmt;
use std::str::FromStr;

use super::{Rules, Selection, Table, UnknownName, shortened};
use crate::address::JausId;

/// Why a word is no rule.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RuleError {
    /// The word is unknown.
    #[error(
        "`{0}` is not a rule: write observe, command, control=AUTHORITY, clear-emergency, \
         clear-emergency=any, configure, with=IDS, only=NAMES, except=NAMES or also=CODES"
    )]
    Word(String),
    /// The authority is malformed.
    #[error("`{0}` is not an authority: write a number from 0 to 255, such as control=127")]
    Authority(String),
    /// An id is malformed.
    #[error("`{0}` is not an id such as 101.1.33, or 101.255.255 for all of 101")]
    Id(String),
    /// A service or message is unknown.
    #[error(transparent)]
    Name(#[from] UnknownName),
    /// `also` names a message that has a definition, so it gives no right.
    #[error(
        "`also` gives no right to {name}, for its definition states what it needs: write `{needs}` instead"
    )]
    Stated {
        /// The message.
        name: String,
        /// The rights that it needs.
        needs: String,
    },
    /// `only` or `with` has no entries, which would mean everything.
    #[error("`{0}=` has no entries: leave it out, or list what it is about")]
    Empty(String),
}

impl FromStr for Rules {
    type Err = RuleError;

    /// Reads words, separated by white space.
    fn from_str(text: &str) -> Result<Self, RuleError> {
        Self::parse(text.split_whitespace())
    }
}

impl Rules {
    /// Reads these words. Names that the catalogue does not have may be of other definitions: see
    /// [`verify`](Self::verify).
    ///
    /// # Errors
    /// The first word that is no rule.
    pub fn parse<'t>(words: impl IntoIterator<Item = &'t str>) -> Result<Self, RuleError> {
        let mut rules = Self::default();
        for word in words {
            let (name, value) = word.split_once('=').unwrap_or((word, ""));
            match (name, word.contains('=')) {
                ("observe", false) => {}
                ("command", false) => rules.command = true,
                ("clear-emergency", false) => rules.clear_emergency = true,
                ("clear-emergency", true) if value == "any" => {
                    (rules.clear_emergency, rules.clear_any_emergency) = (true, true);
                }
                ("configure", false) => rules.configure = true,
                ("with" | "only" | "except" | "also", true) if value.is_empty() => {
                    return Err(RuleError::Empty(name.to_owned()));
                }
                ("control", true) => rules.control = Some(authority(value)?),
                ("with", true) => rules.with = ids(value)?,
                ("only", true) => rules.only = value.parse()?,
                ("except", true) => rules.except = value.parse()?,
                ("also", true) if value == "any" => rules.also = Selection::any(),
                ("also", true) => rules.also = value.parse()?,
                _ => return Err(RuleError::Word(shortened(word))),
            }
        }
        Ok(rules)
    }
}

impl Rules {
    /// Checks that the definitions in use have all names of these rules, and that `also` is of use. Rules
    /// that do not pass give no more rights than they would without the name.
    ///
    /// # Errors
    /// The first name or code that is wrong.
    pub fn verify(&self, table: &Table) -> Result<(), RuleError> {
        let selections = [&self.only, &self.except, &self.also];
        selections.into_iter().try_for_each(|it| it.verify(table))?;
        let stated = self
            .also
            .codes(table)
            .into_iter()
            .find(|it| table.knows(*it));
        stated.map_or(Ok(()), |code| {
            Err(RuleError::Stated {
                name: table.name_of(&code.to_le_bytes()),
                needs: table.words(&code.to_le_bytes()),
            })
        })
    }
}

fn authority(text: &str) -> Result<u8, RuleError> {
    let unknown = |_| RuleError::Authority(shortened(text));
    text.parse().map_err(unknown)
}

fn ids(text: &str) -> Result<Vec<JausId>, RuleError> {
    let id = |text: &str| text.parse().map_err(|_| RuleError::Id(shortened(text)));
    text.split(',').map(id).collect()
}

impl fmt::Display for Rules {
    /// The words of a trust file; nothing for the default.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut words = Vec::new();
        let flags = [
            (self.command, "command"),
            (
                self.clear_emergency && !self.clear_any_emergency,
                "clear-emergency",
            ),
            (self.clear_any_emergency, "clear-emergency=any"),
            (self.configure, "configure"),
        ];
        words.extend(
            flags
                .iter()
                .filter(|(is_set, _)| *is_set)
                .map(|(_, word)| (*word).to_owned()),
        );
        words.extend(self.control.map(|most| format!("control={most}")));
        if !self.with.is_empty() {
            let ids: Vec<_> = self.with.iter().map(JausId::to_string).collect();
            words.push(format!("with={}", ids.join(",")));
        }
        let selections = [
            ("only", &self.only),
            ("except", &self.except),
            ("also", &self.also),
        ];
        for (name, selection) in selections {
            if !selection.is_empty() {
                words.push(format!("{name}={selection}"));
            }
        }
        f.write_str(&words.join(" "))
    }
}
