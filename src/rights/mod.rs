//! What a trusted key may do: the words after the ids in a trust file.
//!
//! | word | the key may |
//! |---|---|
//! | `observe` | query, subscribe, report, and set an emergency; every trusted key may |
//! | `command` | send commands as well, and messages that no definition has |
//! | `control=127` | send commands, and take control of components with an authority up to 127 |
//! | `clear-emergency` | clear emergencies that it has set, and as the client in control those of clients that are gone |
//! | `clear-emergency=any` | clear emergencies, also those of other clients |
//! | `configure` | shut components down, reset them, set their time |
//! | `with=101.255.255,102.1.255` | exchange messages with these ids alone |
//! | `only=PrimitiveDriver,D103h` | of all commands, send these alone |
//! | `except=SetTravelSpeed,Time` | send none of these, whether commands or queries |
//!
//! `only` and `except` name services, messages or message codes. All rules also apply to the message
//! inside a request for an event, but not to those inside a list or a mission. Control, emergencies
//! and configuration have words of their own: `only` does not concern them.
//!
//! A message that is in no definition counts as a command: nobody knows what it does.
//!
//! Who may observe may set an emergency, because a stop must not fail for lack of a right, unless
//! `except=SetEmergency` takes it away.

mod known;
mod permission;
mod selection;

use std::fmt;
use std::str::FromStr;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message as _;
use jaus::messages::core::{ConfirmControl, SetEmergency, confirm_control::ResponseCode};
use jaus::wire::{DataControl, EncodeError, Frame, judp};

pub(crate) use permission::clears_all;
use permission::{Carried, Permission};
pub use selection::{Selection, UnknownName};

/// What a trusted key may do. The default is to observe.
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
}

/// Why a message is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The destination is not among [`Rules::with`].
    #[error("its key may not exchange messages with this id")]
    Elsewhere,
    /// A command without [`Rules::command`].
    #[error("its key may only observe: add `command` or `control=AUTHORITY` to its line")]
    Command,
    /// Control is requested without [`Rules::control`].
    #[error("its key may not take control: add `control=AUTHORITY` to its line")]
    Control,
    /// Control is requested with too great an authority.
    #[error("authority {asked}, but its key may take control with at most {most}")]
    Authority {
        /// The requested authority.
        asked: u8,
        /// The greatest one allowed.
        most: u8,
    },
    /// An emergency is cleared without [`Rules::clear_emergency`].
    #[error("its key may not clear emergencies: add `clear-emergency` to its line")]
    ClearEmergency,
    /// The emergencies of all clients are cleared without [`Rules::clear_any_emergency`].
    #[error(
        "its key may not clear the emergencies of others: add `clear-emergency=any` to its line"
    )]
    ClearAnyEmergency,
    /// A component is configured without [`Rules::configure`].
    #[error("its key may not shut down, reset or set the time: add `configure` to its line")]
    Configure,
    /// A message that commands is for several ids, not all of which are among [`Rules::with`].
    #[error("`with` in the line of its key does not cover all of these ids")]
    TooWide,
    /// The message inside a request for an event is not within the first fragment.
    #[error("its first fragment does not show the message that it carries")]
    Hidden,
    /// The command is not among [`Rules::only`], or the message is among [`Rules::except`].
    #[error("`only` or `except` in the line of its key excludes this message")]
    Excluded,
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

    /// Checks a frame from the key. Later fragments pass: without the first one they are nothing.
    ///
    /// # Errors
    /// The rule that forbids it.
    pub fn check(&self, frame: &Frame) -> Result<(), Refusal> {
        if !self.may_reach(frame.destination) {
            return Err(Refusal::Elsewhere);
        }
        if frame.is_acknowledgement() || (is_later(frame) && !repeats_code(frame)) {
            return Ok(());
        }
        let mut message = &frame.payload[..];
        loop {
            let (permission, carried) = self.check_message(message)?;
            if permission != Permission::Observe && !self.covers(frame.destination) {
                return Err(Refusal::TooWide);
            }
            message = match carried {
                Carried::Message(carried) => carried,
                // A whole message without one is malformed, and the component refuses it.
                Carried::Missing if frame.flags.data() == DataControl::First => {
                    return Err(Refusal::Hidden);
                }
                Carried::Missing | Carried::Nothing => return Ok(()),
            };
        }
    }

    /// Checks a message by itself; returns what it needs, and the message that it carries.
    fn check_message<'m>(&self, message: &'m [u8]) -> Result<(Permission, Carried<'m>), Refusal> {
        let code = message.first_chunk().ok_or(Refusal::NoCode)?;
        let code = u16::from_le_bytes(*code);
        let permission = Permission::of(code, message);
        self.check_permission(permission)?;
        let carried = permission::carried(code, message);
        // Of a request that carries a command, the command counts.
        let is_selected = permission != Permission::Command
            || carried != Carried::Nothing
            || self.only.is_empty()
            || self.only.contains(code);
        if !is_selected || self.except.contains(code) {
            return Err(Refusal::Excluded);
        }
        Ok((permission, carried))
    }

    fn check_permission(&self, permission: Permission) -> Result<(), Refusal> {
        let (allowed, refusal) = match permission {
            Permission::Observe => return Ok(()),
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

/// Whether an audit log holds this frame also if it passes: it, or the message that it carries,
/// concerns control, an emergency or the configuration of a component.
pub(crate) fn is_recorded(frame: &Frame) -> bool {
    if is_later(frame) || frame.is_acknowledgement() {
        return false;
    }
    let mut message = &frame.payload[..];
    while let Some(code) = message.first_chunk() {
        let code = u16::from_le_bytes(*code);
        match permission::carried(code, message) {
            _ if permission::is_recorded(code) => return true,
            Carried::Message(carried) => message = carried,
            Carried::Missing | Carried::Nothing => return false,
        }
    }
    false
}

/// The answer to a refused request for control: a datagram with Confirm Control, as from the
/// component.
///
/// # Errors
/// The header cannot carry it.
pub fn denial_of_control(request: &Frame) -> Result<Bytes, EncodeError> {
    let confirm = ConfirmControl {
        response_code: ResponseCode::INSUFFICIENT_AUTHORITY,
    };
    let payload = confirm.encode().unwrap_or_default();
    judp::encode(&Frame::new(request.destination, request.source, payload))
}

/// Why a word is no rule.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RuleError {
    /// The word is unknown.
    #[error(
        "`{0}` is not a rule: write observe, command, control=AUTHORITY, clear-emergency, \
         clear-emergency=any, configure, with=IDS, only=NAMES or except=NAMES"
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
    pub(crate) fn parse<'t>(words: impl Iterator<Item = &'t str>) -> Result<Self, RuleError> {
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
                ("with" | "only" | "except", true) if value.is_empty() => {
                    return Err(RuleError::Empty(name.to_owned()));
                }
                ("control", true) => rules.control = Some(authority(value)?),
                ("with", true) => rules.with = ids(value)?,
                ("only", true) => rules.only = value.parse()?,
                ("except", true) => rules.except = value.parse()?,
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
        for (name, selection) in [("only", &self.only), ("except", &self.except)] {
            if !selection.is_empty() {
                words.push(format!("{name}={selection}"));
            }
        }
        f.write_str(&words.join(" "))
    }
}

#[cfg(test)]
mod tests;
