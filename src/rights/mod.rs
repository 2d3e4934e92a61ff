//! What a sender may do: one table of what each message needs, and the rules of each sender.
//!
//! Secure links ask for each key, the bridge to zenoh and plain links (`grants` in `[access]`) for each
//! id. [`Table`] answers what a message needs: the definitions state it, whatever sets of messages a
//! program was built with. [`Rules`] are what a sender has:
//!
//! | word | the sender may |
//! |---|---|
//! | `observe` | query, subscribe, report, end what is its own, and set an emergency; everybody may |
//! | `command` | send commands as well |
//! | `control=127` | send commands, and take control of components with an authority up to 127 |
//! | `clear-emergency` | clear emergencies that it has set, and as the client in control those of clients that are gone |
//! | `clear-emergency=any` | clear emergencies, also those of other clients |
//! | `configure` | shut components down, reset them, set their time |
//! | `with=101.255.255,102.1.255` | exchange messages with these ids alone |
//! | `only=PrimitiveDriver,D103h` | of all commands, send these alone |
//! | `except=SetTravelSpeed,Time` | send none of these, whether commands or queries |
//! | `also=D103h` | send these codes, too, although no definition states what they need; `also=any`: all of them |
//!
//! `only` and `except` name services, messages or message codes. All rules also apply to the messages
//! that a message carries: the query in a request for an event, the elements of a list, the messages of
//! a mission. What a message carries must be in its first fragment, unless its sender may do everything.
//! Control, emergencies and configuration have words of their own: `only` does not concern them.
//!
//! What no definition states needs `also`: nobody knows what it does.
//!
//! Who may observe may set an emergency, because a stop must not fail for lack of a right, unless
//! `except=SetEmergency` takes it away.

mod accept;
mod carried;
mod decision;
mod queue;
mod selection;
mod table;

use std::fmt;
use std::str::FromStr;

pub(crate) use accept::check as check_by_grants;
pub use accept::{Acceptance, Grant, GrantError, Unaccepted};
pub use decision::{Decision, Verdict, check_unrecorded, denial};
pub use queue::{Decided, DecisionQueue};
pub use selection::{Selection, UnknownName};
pub use table::{CLEAR_ALL, Permission, Table, TableError, clears_all};

use crate::address::JausId;
use crate::codec::Message as _;
use crate::messages::core::SetEmergency;
use crate::wire::{DataControl, Frame};
use carried::Carried;

/// What a sender may do. The default is to observe.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Rules {
    /// Whether it may send commands.
    pub command: bool,
    /// The greatest authority with which it may take control; `None` if it may not.
    pub control: Option<u8>,
    /// Whether it may clear emergencies.
    pub clear_emergency: bool,
    /// Whether it may clear the emergencies of other clients, too.
    pub clear_any_emergency: bool,
    /// Whether it may shut components down, reset them, and set their time.
    pub configure: bool,
    /// The only ids with which it may exchange messages, with wildcards; all if empty.
    pub with: Vec<JausId>,
    /// The only commands that it may send; all if empty.
    pub only: Selection,
    /// Messages that it may not send.
    pub except: Selection,
    /// Messages that it may send although no definition states what they need.
    pub also: Selection,
}

/// Why a message is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The destination is not among [`Rules::with`].
    #[error("its sender may not exchange messages with this id")]
    Elsewhere,
    /// A command without [`Rules::command`].
    #[error("its sender may only observe: add `command` or `control=AUTHORITY` to its line")]
    Command,
    /// Control is requested without [`Rules::control`].
    #[error("its sender may not take control: add `control=AUTHORITY` to its line")]
    Control,
    /// Control is requested with too great an authority.
    #[error("authority {asked}, but its sender may take control with at most {most}")]
    Authority {
        /// The requested authority.
        asked: u8,
        /// The greatest one allowed.
        most: u8,
    },
    /// An emergency is cleared without [`Rules::clear_emergency`].
    #[error("its sender may not clear emergencies: add `clear-emergency` to its line")]
    ClearEmergency,
    /// The emergencies of all clients are cleared without [`Rules::clear_any_emergency`].
    #[error(
        "its sender may not clear the emergencies of others: add `clear-emergency=any` to its line"
    )]
    ClearAnyEmergency,
    /// A component is configured without [`Rules::configure`].
    #[error("its sender may not shut down, reset or set the time: add `configure` to its line")]
    Configure,
    /// A message that commands is for several ids, not all of which are among [`Rules::with`].
    #[error("`with` in the line of its sender does not cover all of these ids")]
    TooWide,
    /// What it carries cannot be told.
    #[error(
        "it does not show the messages that it carries: is it malformed, or longer than a packet? Send \
         shorter lists"
    )]
    Hidden,
    /// No definition states what it needs.
    #[error(
        "no definition states what this message needs: add `also=` with its code to the line of its \
         sender"
    )]
    Unknown,
    /// The command is not among [`Rules::only`], or the message is among [`Rules::except`].
    #[error("`only` or `except` in the line of its sender excludes this message")]
    Excluded,
    /// It would change something while the audit log cannot be written, and that is to be recorded.
    #[error("the audit log cannot be written: until then only queries and stops are accepted")]
    Unrecorded,
    /// The message is too short to have a message code.
    #[error("it has no message code")]
    NoCode,
}

impl Rules {
    /// Everything, with every authority.
    #[must_use]
    pub fn everything() -> Self {
        Self {
            command: true,
            control: Some(u8::MAX),
            clear_emergency: true,
            clear_any_emergency: true,
            configure: true,
            also: Selection::any(),
            ..Self::default()
        }
    }

    /// To observe and no more: not even to set an emergency, for clients that nobody has named.
    #[must_use]
    pub fn watch() -> Self {
        Self {
            except: Selection::of(SetEmergency::NAME, SetEmergency::CODE),
            ..Self::default()
        }
    }

    /// Checks a frame from the sender; the table tells what messages need. Later fragments pass: without
    /// the first one they are nothing.
    ///
    /// # Errors
    /// The rule that forbids it.
    pub fn check(&self, frame: &Frame, table: &Table) -> Result<(), Refusal> {
        if !self.may_reach(frame.destination) {
            return Err(Refusal::Elsewhere);
        }
        if frame.is_acknowledgement() || (is_later(frame) && !repeats_code(frame)) {
            return Ok(());
        }
        self.check_message(&frame.payload, frame.destination, (table, carried::DEEPEST))
    }

    /// Checks a message, and those that it carries so many levels deep.
    fn check_message(
        &self,
        message: &[u8],
        to: JausId,
        (table, depth): (&Table, usize),
    ) -> Result<(), Refusal> {
        let code = table::code_of(message).ok_or(Refusal::NoCode)?;
        let permission = table.permission(message);
        match permission {
            Some(permission) => self.check_permission(permission)?,
            None if self.also.contains(code) => {}
            None => return Err(Refusal::Unknown),
        }
        let carried = table.carried(message);
        let is_empty = matches!(&carried, Carried::Messages(carried) if carried.is_empty());
        // Of a message that carries commands, these count.
        let is_selected = !matches!(permission, Some(Permission::Command) | None)
            || !is_empty
            || self.only.is_empty()
            || self.only.contains(code);
        if !is_selected || self.except.contains(code) {
            return Err(Refusal::Excluded);
        }
        let is_free = permission.is_some_and(Permission::is_free);
        if !is_free && !self.covers(to) {
            return Err(Refusal::TooWide);
        }
        match carried {
            Carried::Messages(carried) if depth > 0 => carried
                .into_iter()
                .try_for_each(|message| self.check_message(message, to, (table, depth - 1))),
            _ if is_empty || self.are_all() => Ok(()),
            _ => Err(Refusal::Hidden),
        }
    }

    /// Whether there is no message that they forbid. Where messages may go is checked apart.
    fn are_all(&self) -> bool {
        let with = self.with.clone();
        *self
            == Self {
                with,
                ..Self::everything()
            }
    }

    fn check_permission(&self, permission: Permission) -> Result<(), Refusal> {
        let (allowed, refusal) = match permission {
            Permission::Observe
            | Permission::Answer { .. }
            | Permission::Release
            | Permission::Emergency => return Ok(()),
            Permission::Control { authority } => return self.check_authority(authority),
            Permission::Command => (self.command || self.control.is_some(), Refusal::Command),
            Permission::ClearEmergency => (self.clear_emergency, Refusal::ClearEmergency),
            Permission::ClearAnyEmergency => (self.clear_any_emergency, Refusal::ClearAnyEmergency),
            Permission::Configure => (self.configure, Refusal::Configure),
        };
        if allowed { Ok(()) } else { Err(refusal) }
    }

    fn check_authority(&self, asked: u8) -> Result<(), Refusal> {
        let most = self.control.ok_or(Refusal::Control)?;
        if asked > most {
            return Err(Refusal::Authority { asked, most });
        }
        Ok(())
    }

    /// Whether it may send to every id that a destination means.
    fn covers(&self, destination: JausId) -> bool {
        self.with.is_empty() || self.with.iter().any(|with| with.matches(destination))
    }

    /// Whether it may send to this id, which may have wildcards, or receive from it.
    #[must_use]
    pub fn may_reach(&self, id: JausId) -> bool {
        self.with.is_empty() || self.with.iter().any(|with| with.overlaps(id))
    }

    /// Whether it may send to, or receive from, any of these ids.
    #[must_use]
    pub fn may_reach_any(&self, ids: &[JausId]) -> bool {
        ids.iter().any(|id| self.may_reach(*id))
    }
}

/// Whether a frame is a later fragment.
fn is_later(frame: &Frame) -> bool {
    matches!(frame.flags.data(), DataControl::Middle | DataControl::Last)
}

/// Whether every fragment has the message code, as with the headers before AS5669A: then each is
/// checked by its own.
fn repeats_code(frame: &Frame) -> bool {
    frame.version.repeated_code_len() > 0
}

/// Whether an audit log holds this frame also if it passes; later fragments, and acknowledgements, are
/// not held. See [`Table::is_recorded`].
#[must_use]
pub fn is_recorded(frame: &Frame, table: &Table) -> bool {
    !is_later(frame) && !frame.is_acknowledgement() && table.is_recorded(&frame.payload)
}

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
    /// Reads these words. Names are those of the catalogue; other messages have codes alone.
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

fn authority(text: &str) -> Result<u8, RuleError> {
    let unknown = |_| RuleError::Authority(shortened(text));
    text.parse().map_err(unknown)
}

fn ids(text: &str) -> Result<Vec<JausId>, RuleError> {
    let id = |text: &str| text.parse().map_err(|_| RuleError::Id(shortened(text)));
    text.split(',').map(id).collect()
}

/// As much of a text as an error shows.
fn shortened(text: &str) -> String {
    text.chars().take(60).collect()
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

#[cfg(test)]
mod tests;
