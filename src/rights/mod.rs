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
//! | `except=SetTravelSpeed,Time` | send none of these, whether commands or queries, nor get the reports that answer them |
//! | `also=D103h` | send these codes, too, although no definition states what they need; `also=any`: all of them |
//!
//! `only` and `except` name services, messages or message codes. A name that the definitions in use do not
//! have never gives a right: [`Rules::verify`] reports it.
//!
//! # Messages inside messages
//!
//! All rules also apply to the messages that a message carries: the query in a request for an event, the
//! elements of a list, the messages of a mission. `with` applies to the component that a mission names for
//! each message. What a message carries must be in its first fragment, unless its sender may do everything.
//! The reports inside Event and Report Events are not looked at when they are sent, because no receiver obeys
//! them; those inside Event are when they are received ([`Rules::may_receive`]).
//!
//! # `only`
//!
//! `only=PrimitiveDriver` means: it may drive by efforts, and do nothing else that a command does. So it does
//! not let lists and missions be changed (Set Element, Spool Mission), whatever they carry, unless they are
//! listed, too. Create Command Event passes, because it does nothing but what it carries, and what it carries
//! must be listed, or need no right. Requests for control, clearing of emergencies and configuration have
//! words of their own, and pass if they are sent plainly; inside other messages they must be listed as well.
//!
//! # Groups
//!
//! A message to a group of ids (with wildcards) that is wider than `with`: a command is refused, a query
//! passes. What only stops or ends (Set Emergency, Release Control, Standby: [`Table::stops`]) goes to those of
//! the group that are in `with`, and to no others: a stop does not fail because it is for a group, and does not
//! reach the vehicles of others. See [`Rules::admit`].
//!
//! # Codes with several meanings
//!
//! If definitions give one code to different messages, their sender needs the rights of all: F92Ah, Query
//! Measurement of one service and a command of another, needs `command`. A node cannot tell which is meant.
//!
//! What no definition states needs `also`: nobody knows what it does.
//!
//! Who may observe may set an emergency, because a stop must not fail for lack of a right, unless
//! `except=SetEmergency` takes it away.

mod accept;
mod carried;
mod decision;
mod in_control;
mod queue;
mod selection;
mod table;
mod words;

pub(crate) use accept::admit as admit_by_grants;
pub use accept::{Acceptance, Grant, GrantError, Unaccepted};
pub use decision::{Decision, Verdict, Weight, check_unrecorded, denial};
pub use in_control::InControl;
pub use queue::{Decided, DecisionQueue, Weighted, WeightedQueue};
pub use selection::{Selection, UnknownName};
pub use table::{CLEAR_ALL, Permission, Table, TableError, clears_all};
pub use words::RuleError;

use crate::address::JausId;
use crate::codec::{Message as _, query_code};
use crate::messages::core::{Event, SetEmergency};
use crate::wire::{DataControl, Frame};
use carried::Carried;

/// The octets of Event before the report that it carries: its code, id and number, and a count of four octets.
const BEFORE_REPORT: usize = 8;

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
    #[error("its sender may only observe: give it `command` or `control=AUTHORITY`")]
    Command,
    /// Control is requested without [`Rules::control`].
    #[error("its sender may not take control: give it `control=AUTHORITY`")]
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
    #[error("its sender may not clear emergencies: give it `clear-emergency`")]
    ClearEmergency,
    /// The emergencies of all clients are cleared without [`Rules::clear_any_emergency`].
    #[error("its sender may not clear the emergencies of others: give it `clear-emergency=any`")]
    ClearAnyEmergency,
    /// A component is configured without [`Rules::configure`].
    #[error("its sender may not shut down, reset or set the time: give it `configure`")]
    Configure,
    /// A message that commands is for several ids, not all of which are among [`Rules::with`].
    #[error("`with` in the rights of its sender does not cover all of these ids")]
    TooWide,
    /// What it carries cannot be told.
    #[error(
        "it does not show the messages that it carries: is it malformed, or longer than a packet? Send \
         shorter lists"
    )]
    Hidden,
    /// No definition states what it needs.
    #[error("no definition states what this message needs: give its sender `also=` with its code")]
    Unknown,
    /// The command is not among [`Rules::only`], or the message is among [`Rules::except`].
    #[error("`only` or `except` in the rights of its sender excludes this message")]
    Excluded,
    /// It would change something while the audit log cannot be written, and that is to be recorded.
    #[error("the audit log cannot be written: until then only queries and stops are accepted")]
    Unrecorded,
    /// [`Rules::except`] has a name that no definition in use has, so nobody knows what it excludes.
    #[error("`except` in the rights of its sender has a name that no definition in use has")]
    UnknownName,
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

    /// Whether they allow no more than [`watch`](Self::watch).
    #[must_use]
    pub fn only_watch(&self) -> bool {
        let everywhere = Self {
            with: Vec::new(),
            only: Selection::default(),
            except: Selection::default(),
            ..self.clone()
        };
        everywhere == Self::default() && self.except.contains(SetEmergency::CODE, &Table::default())
    }

    /// Checks a frame from the sender; the table tells what messages need. Later fragments pass: without
    /// the first one they are nothing.
    ///
    /// # Errors
    /// The rule that forbids it. [`Refusal::TooWide`] also if [`admit`](Self::admit) would let it pass to
    /// a part of the group that it is for.
    pub fn check(&self, frame: &Frame, table: &Table) -> Result<(), Refusal> {
        match self.admit(frame, table)? {
            Admitted::Whole => Ok(()),
            Admitted::Narrowed(_) => Err(Refusal::TooWide),
        }
    }

    /// Checks a frame as [`check`](Self::check), and says to which ids it may go: what ends or stops
    /// something goes to those of a group that are in [`with`](Self::with).
    ///
    /// # Errors
    /// The rule that forbids it.
    pub fn admit(&self, frame: &Frame, table: &Table) -> Result<Admitted, Refusal> {
        let to = frame.destination;
        if !self.may_reach(to) {
            return Err(Refusal::Elsewhere);
        }
        if frame.is_acknowledgement() || (is_later(frame) && !repeats_code(frame)) {
            return Ok(Admitted::Whole);
        }
        let depth = 0;
        self.check_message(&frame.payload, Within { table, to, depth })?;
        if self.covers(to) || !table.stops(&frame.payload) {
            return Ok(Admitted::Whole);
        }
        if frame.flags.data() != DataControl::Single {
            // Its other fragments could not be narrowed with it. None of these messages is that long.
            return Err(Refusal::TooWide);
        }
        Ok(Admitted::Narrowed(self.within(to)))
    }

    /// The ids of a group among [`with`](Self::with): none is part of another.
    fn within(&self, group: JausId) -> Vec<JausId> {
        let parts = self.with.iter().filter_map(|with| with.intersection(group));
        accept::widest(&parts.collect::<Vec<_>>())
    }

    /// Checks a message, and those that it carries.
    fn check_message(&self, message: &[u8], within: Within<'_>) -> Result<(), Refusal> {
        let Within { table, to, depth } = within;
        let code = table::code_of(message).ok_or(Refusal::NoCode)?;
        if !self.may_reach(to) {
            return Err(Refusal::Elsewhere);
        }
        if !table.knows(code) && !self.also.contains(code, table) {
            return Err(Refusal::Unknown);
        }
        table
            .needs(message)
            .try_for_each(|it| self.check_permission(it))?;
        self.check_selection(code, message, within)?;
        if !self.covers(to) && !may_be_wide(message, within) {
            return Err(Refusal::TooWide);
        }
        match table.carried(message) {
            Carried::Messages(carried) if carried.is_empty() => Ok(()),
            Carried::Messages(carried) if depth < carried::DEEPEST => {
                carried.into_iter().try_for_each(|inner| {
                    let (to, depth) = (inner.to.unwrap_or(to), depth + 1);
                    self.check_message(inner.octets, Within { table, to, depth })
                })
            }
            _ if self.allows_everything() => Ok(()),
            _ => Err(Refusal::Hidden),
        }
    }

    /// Checks a message against `only` and `except`.
    fn check_selection(
        &self,
        code: u16,
        message: &[u8],
        Within { table, depth, .. }: Within<'_>,
    ) -> Result<(), Refusal> {
        // A mistake in a name must not keep a stop back.
        if !table.stops(message) && self.except.has_unknown(table) {
            return Err(Refusal::UnknownName);
        }
        let concerns = |permission: Permission| match permission {
            Permission::Command => true,
            Permission::Carry => false,
            // What somebody else sends on request is not what its word allows.
            other => depth > 0 && !other.needs_no_right(),
        };
        let is_concerned = !table.knows(code) || table.needs(message).any(concerns);
        let is_left_out = is_concerned && !self.only.is_empty() && !self.only.contains(code, table);
        if is_left_out || self.except.contains(code, table) {
            return Err(Refusal::Excluded);
        }
        Ok(())
    }

    /// Whether there is no message that they forbid, to whatever component.
    fn allows_everything(&self) -> bool {
        *self == Self::everything()
    }

    fn check_permission(&self, permission: Permission) -> Result<(), Refusal> {
        let (allowed, refusal) = match permission {
            Permission::Observe
            | Permission::Answer { .. }
            | Permission::Release
            | Permission::Emergency => return Ok(()),
            Permission::Control { authority } => return self.check_authority(authority),
            Permission::Command | Permission::Carry => {
                (self.command || self.control.is_some(), Refusal::Command)
            }
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

    /// Whether a frame may go to the holder: no report that it may not query now, be it sent as it is or in an
    /// Event. So what `except` adds ends subscriptions that stand already.
    #[must_use]
    pub fn may_receive(&self, frame: &Frame, table: &Table) -> bool {
        if self.except.is_empty() || !begins(frame) {
            return true;
        }
        let message = &*frame.payload;
        let report = match table::code_of(message) {
            Some(Event::CODE) => message.get(BEFORE_REPORT..).and_then(table::code_of),
            code => code,
        };
        report.and_then(query_code).is_none_or(|query| {
            !self.except.has_unknown(table) && !self.except.contains(query, table)
        })
    }

    /// Whether it may send to, or receive from, any of these ids.
    #[must_use]
    pub fn may_reach_any(&self, ids: &[JausId]) -> bool {
        ids.iter().any(|id| self.may_reach(*id))
    }
}

/// The place of a message that is checked.
#[derive(Clone, Copy)]
struct Within<'t> {
    table: &'t Table,
    /// The component that it is for.
    to: JausId,
    /// How many messages it is inside of.
    depth: usize,
}

/// Whether a message may be for ids some of which its sender may not reach. What changes nothing may; and what
/// stops something, because it is narrowed then, which nobody can do inside of another message.
fn may_be_wide(message: &[u8], Within { table, depth, .. }: Within<'_>) -> bool {
    let mut needs = table.needs(message).peekable();
    let changes_nothing = needs.peek().is_some() && needs.all(Permission::changes_nothing);
    changes_nothing || (depth == 0 && table.stops(message))
}

/// To which ids an admitted frame may go.
#[derive(Clone, Debug, PartialEq, Eq)]
#[must_use]
pub enum Admitted {
    /// To all that it is for.
    Whole,
    /// To these of the group that it is for: a copy to each.
    Narrowed(Vec<JausId>),
}

impl Admitted {
    /// Copies of a frame for the ids to which it may go; `None` if it may go as it is.
    #[must_use]
    pub fn copies(self, frame: &Frame) -> Option<Vec<Frame>> {
        let Self::Narrowed(ids) = self else {
            return None;
        };
        let copy = |destination| Frame {
            destination,
            ..frame.clone()
        };
        Some(ids.into_iter().map(copy).collect())
    }
}

/// Whether a frame is a later fragment.
fn is_later(frame: &Frame) -> bool {
    matches!(frame.flags.data(), DataControl::Middle | DataControl::Last)
}

/// Whether a frame has the beginning of a message, and so its code.
fn begins(frame: &Frame) -> bool {
    !is_later(frame) && !frame.is_acknowledgement()
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
    begins(frame) && table.is_recorded(&frame.payload)
}

/// As much of a text as an error shows.
fn shortened(text: &str) -> String {
    text.chars().take(60).collect()
}

#[cfg(test)]
mod tests;
