//! What the sender of each message needs, and where messages carry others.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::{self, Write as _};
use std::num::ParseIntError;
use std::sync::{Arc, LazyLock};

use bytes::Bytes;

use super::carried::{self, Carried, Layout};

/// Of all definitions of the catalogue, whatever sets this library was built with.
static CATALOGUE: LazyLock<Table> = LazyLock::new(|| {
    let mut known = Known::default();
    for line in include_str!(concat!(env!("OUT_DIR"), "/permissions.txt")).lines() {
        // What cannot be read grants nothing; a test reads all of it.
        let _read = known.read(line, Origin::Catalogue);
    }
    Table(Arc::new(known))
});

/// The code of Clear Emergency (0007h) by which a client clears the emergencies of all clients. The
/// standard reserves it.
pub const CLEAR_ALL: u16 = 0xFFFF;

/// The word of a line by which all messages with its code stop or end something and do nothing else.
const STOPS: &str = "stops";

/// The right that the sender of a message needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Permission {
    /// To query, report and subscribe.
    Observe,
    /// To answer a request for control.
    Answer {
        /// Whether it is granted.
        is_granted: bool,
    },
    /// To end what the sender itself has, such as its control.
    Release,
    /// To set an emergency.
    Emergency,
    /// To command.
    Command,
    /// To command by what the message carries: it does nothing else.
    Carry,
    /// To clear the sender's own emergency.
    ClearEmergency,
    /// To clear the emergencies of all clients.
    ClearAnyEmergency,
    /// To shut a component down, reset it, or set its time.
    Configure,
    /// To take control.
    Control {
        /// The authority that is asked for; 255 if the message is too short to have it.
        authority: u8,
    },
}

impl Permission {
    /// Whether everybody has it who may send anything: it changes nothing, or ends what is the
    /// sender's own, or stops.
    #[must_use]
    pub const fn needs_no_right(self) -> bool {
        matches!(
            self,
            Self::Observe | Self::Answer { .. } | Self::Release | Self::Emergency
        )
    }

    /// Whether an audit log holds each message that needs it.
    pub(super) const fn is_recorded(self) -> bool {
        !self.changes_nothing() && !matches!(self, Self::Command | Self::Carry)
    }

    /// Whether it changes nothing, so that it may go to all of a group.
    pub(super) const fn changes_nothing(self) -> bool {
        matches!(self, Self::Observe | Self::Answer { .. })
    }

    fn of(word: &str) -> Option<Self> {
        Some(match word {
            "observe" => Self::Observe,
            "answer" => Self::Answer { is_granted: false },
            "release" => Self::Release,
            "emergency" => Self::Emergency,
            "command" => Self::Command,
            "carry" => Self::Carry,
            "clear-emergency" => Self::ClearEmergency,
            "configure" => Self::Configure,
            "control" => Self::Control { authority: 0 },
            _ => return None,
        })
    }
}

/// The word of a rule that gives it, or of what everybody may.
impl fmt::Display for Permission {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Observe => "observe",
            Self::Answer { .. } => "answer",
            Self::Release => "release",
            Self::Emergency => "emergency",
            Self::Command | Self::Carry => "command",
            Self::ClearEmergency => "clear-emergency",
            Self::ClearAnyEmergency => "clear-emergency=any",
            Self::Configure => "configure",
            Self::Control { .. } => "control",
        })
    }
}

/// The permissions that messages need. The default is the catalogue's; clones share their content.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table(Arc<Known>);

impl Default for Table {
    fn default() -> Self {
        CATALOGUE.clone()
    }
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Known {
    messages: BTreeMap<u16, Row>,
    /// The codes that each service receives.
    services: BTreeMap<String, Vec<u16>>,
    /// The codes behind the names of definitions that are not of the catalogue.
    further: BTreeMap<String, BTreeSet<u16>>,
}

/// Where a line of a table comes from.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Origin {
    Catalogue,
    Further,
}

/// What is known of a message code.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Row {
    /// The sender must have all of these rights, one of each kind of message with this code.
    needs: Vec<Need>,
    names: Vec<String>,
    /// Whether all messages with this code stop or end something and do nothing else.
    stops: bool,
    carries: Vec<Layout>,
}

/// A right that a message needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Need {
    right: Permission,
    /// The place of the authority in the message, or of what says whether control is granted.
    place: Option<usize>,
}

impl Need {
    /// Reads `command`, or `control@2`.
    fn read(text: &str) -> Option<Self> {
        let (word, place) = match text.split_once('@') {
            Some((word, place)) => (word, Some(place.parse().ok()?)),
            None => (text, None),
        };
        let right = Permission::of(word)?;
        Some(Self { right, place })
    }

    /// What it is for this message.
    fn in_message(self, message: &[u8]) -> Permission {
        let field = self.place.map(|place| message.get(place).copied());
        match self.right {
            Permission::Control { .. } => Permission::Control {
                // What is malformed is refused as if it asked for all.
                authority: field.map_or(0, |it| it.unwrap_or(u8::MAX)),
            },
            Permission::Answer { .. } => Permission::Answer {
                is_granted: field.flatten() == Some(0),
            },
            Permission::ClearEmergency if may_clear_all(message) => Permission::ClearAnyEmergency,
            right => right,
        }
    }
}

/// A line of a table that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no line about a message: write its code, its permission and its name, as in \
     `D103 command SetLamp`"
)]
pub struct TableError(String);

impl Table {
    /// This table with the permissions of further definitions, as `jsidl::permission::Permissions`
    /// writes them. For a code that is known already, the rights of both are needed.
    ///
    /// # Errors
    /// The first line that cannot be read.
    pub fn with(&self, lines: &str) -> Result<Self, TableError> {
        let mut known = Known::clone(&self.0);
        for line in lines.lines() {
            let shortened = || TableError(super::shortened(line));
            known.read(line, Origin::Further).ok_or_else(shortened)?;
        }
        Ok(Self(Arc::new(known)))
    }

    /// The rights that a message needs, which begins with its code: all of them, because two
    /// definitions may give one code to different messages, and a node cannot tell which is meant. None
    /// if no definition states what it needs.
    pub fn needs<'m>(&'m self, message: &'m [u8]) -> impl Iterator<Item = Permission> + 'm {
        let row = self.row(message).into_iter();
        row.flat_map(|row| row.needs.iter().map(|need| need.in_message(message)))
    }

    /// The rights that a message needs, for people: words of rules, `also` if no definition states any.
    #[must_use]
    pub fn words(&self, message: &[u8]) -> String {
        let mut words = Vec::new();
        for need in self.needs(message).filter(|it| !it.needs_no_right()) {
            let word = need.to_string();
            if !words.contains(&word) {
                words.push(word);
            }
        }
        let free = || self.needs(message).next().map(|it| it.to_string());
        match words.is_empty() {
            true => free().unwrap_or_else(|| "also".to_owned()),
            false => words.join(" "),
        }
    }

    /// Whether a definition states what messages with this code need.
    #[must_use]
    pub fn knows(&self, code: u16) -> bool {
        self.0.messages.contains_key(&code)
    }

    /// The messages inside a message.
    pub(super) fn carried<'m>(&self, message: &'m [u8]) -> Carried<'m> {
        let layouts = self.row(message).map(|it| &*it.carries);
        carried::find(layouts.unwrap_or_default(), message)
    }

    /// Whether an audit log holds a message also if it passes: it, or one that it carries, concerns
    /// control, an emergency or the configuration of a component.
    #[must_use]
    pub fn is_recorded(&self, message: &[u8]) -> bool {
        self.is_recorded_within(message, carried::DEEPEST)
    }

    fn is_recorded_within(&self, message: &[u8], depth: usize) -> bool {
        if self.needs(message).any(Permission::is_recorded) {
            return true;
        }
        match self.carried(message) {
            Carried::Messages(carried) if depth > 0 => carried
                .into_iter()
                .any(|inner| self.is_recorded_within(inner.octets, depth - 1)),
            _ => false,
        }
    }

    /// Whether all that a message does is to stop or end something: every message with its code, and each one
    /// that it carries. Its sender needs the right to it nevertheless.
    #[must_use]
    pub fn stops(&self, message: &[u8]) -> bool {
        self.stops_within(message, carried::DEEPEST)
    }

    fn stops_within(&self, message: &[u8], depth: usize) -> bool {
        let carried = match self.carried(message) {
            Carried::Messages(carried) if carried.is_empty() || depth > 0 => carried,
            // What cannot be told may move something.
            _ => return false,
        };
        let mut carried = carried.into_iter();
        self.row(message).is_some_and(|row| row.stops)
            && carried.all(|inner| self.stops_within(inner.octets, depth - 1))
    }

    /// The answer with this name by which a component says how it decides on a request for control: `None` if
    /// no definition has it. Octets other than the decision are 0.
    pub(super) fn answer(&self, name: &str, decision: u8) -> Option<Bytes> {
        self.codes_of(name).into_iter().find_map(|code| {
            let needs = &self.0.messages.get(&code)?.needs;
            let is_answer = |need: &&Need| matches!(need.right, Permission::Answer { .. });
            let place = needs.iter().find(is_answer)?.place?;
            let mut answer = vec![0; place + 1];
            answer.get_mut(..2)?.copy_from_slice(&code.to_le_bytes());
            *answer.get_mut(place)? = decision;
            Some(answer.into())
        })
    }

    /// The name of a message for people, or its code.
    #[must_use]
    pub fn name_of(&self, message: &[u8]) -> String {
        let Some(code) = code_of(message) else {
            return "a message".to_owned();
        };
        let mut name = self.names(code).join(" or ");
        if name.is_empty() {
            name = format!("{code:04X}h");
        }
        if self
            .needs(message)
            .any(|it| it == Permission::ClearAnyEmergency)
        {
            // Writing into a text never fails.
            let _written = write!(name, " of all clients");
        }
        name
    }

    /// The names of the messages with this code.
    #[must_use]
    pub fn names(&self, code: u16) -> &[String] {
        self.0.messages.get(&code).map_or(&[], |it| &it.names)
    }

    /// The codes of all messages.
    pub fn codes(&self) -> impl Iterator<Item = u16> + '_ {
        self.0.messages.keys().copied()
    }

    /// The codes of the messages with this name, and of those that the service with it receives. A
    /// service's name is its URN, or what follows the last colon of it.
    #[must_use]
    pub fn codes_of(&self, name: &str) -> Vec<u16> {
        let names_service = |urn: &str| urn == name || short(urn) == name;
        let services = self.0.services.iter();
        let services = services.filter(|(urn, _)| names_service(urn));
        let inputs = services.flat_map(|(_, inputs)| inputs.iter().copied());
        let messages = self.0.messages.iter();
        let messages = messages.filter(|(_, row)| row.names.iter().any(|it| it == name));
        inputs.chain(messages.map(|(code, _)| *code)).collect()
    }

    /// The codes for which this name stands in definitions that are not of the catalogue.
    pub(super) fn further(&self, name: &str) -> impl Iterator<Item = u16> + '_ {
        let codes = self.0.further.get(name).into_iter();
        codes.flat_map(|codes| codes.iter().copied())
    }

    fn row(&self, message: &[u8]) -> Option<&Row> {
        self.0.messages.get(&code_of(message)?)
    }
}

impl Known {
    /// Reads a line; `None` if it is malformed.
    fn read(&mut self, line: &str, origin: Origin) -> Option<()> {
        let mut words = line.split_whitespace();
        let first = words.next()?;
        if first == "service" {
            let urn = words.next()?;
            let codes: Vec<_> = words.map(code).collect::<Result<_, _>>().ok()?;
            if origin == Origin::Further {
                self.name(urn, &codes);
                self.name(short(urn), &codes);
            }
            let known = self.services.entry(urn.to_owned()).or_default();
            known.extend(codes);
            return Some(());
        }
        let code = code(first).ok()?;
        let needs = words.next()?.split(',').map(Need::read);
        let needs = needs.collect::<Option<_>>()?;
        let names: Vec<_> = words.next()?.split(',').map(str::to_owned).collect();
        let mut words = words.peekable();
        let stops = words.next_if_eq(&STOPS).is_some();
        let carries = words.map(Layout::parse).collect::<Option<_>>()?;
        if origin == Origin::Further {
            names.iter().for_each(|name| self.name(name, &[code]));
        }
        let row = Row {
            needs,
            names,
            stops,
            carries,
        };
        self.add(code, row);
        Some(())
    }

    fn name(&mut self, name: &str, codes: &[u16]) {
        let known = self.further.entry(name.to_owned()).or_default();
        known.extend(codes);
    }

    fn add(&mut self, code: u16, row: Row) {
        let Some(known) = self.messages.get_mut(&code) else {
            self.messages.insert(code, row);
            return;
        };
        add_new(&mut known.needs, row.needs);
        add_new(&mut known.names, row.names);
        known.stops &= row.stops;
        add_new(&mut known.carries, row.carries);
    }
}

/// Adds the items that a list does not have.
fn add_new<T: PartialEq>(list: &mut Vec<T>, items: Vec<T>) {
    for item in items {
        if !list.contains(&item) {
            list.push(item);
        }
    }
}

/// A service's name for people: what follows the last colon of its URN.
fn short(urn: &str) -> &str {
    urn.rsplit(':').next().unwrap_or(urn)
}

fn code(digits: &str) -> Result<u16, ParseIntError> {
    u16::from_str_radix(digits, 16)
}

/// The code at the head of a message.
pub(super) fn code_of(message: &[u8]) -> Option<u16> {
    message.first_chunk().map(|code| u16::from_le_bytes(*code))
}

/// Whether a Clear Emergency is for those of all clients.
#[must_use]
pub fn clears_all(message: &[u8]) -> bool {
    message.get(2..4) == Some(&CLEAR_ALL.to_le_bytes())
}

/// Whether a Clear Emergency may be for those of all clients: it is, or the rest of its code is in
/// another fragment.
fn may_clear_all(message: &[u8]) -> bool {
    message.len() < 4 || clears_all(message)
}
