//! What the sender of each message needs, and where messages carry others.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::num::ParseIntError;
use std::sync::{Arc, LazyLock};

use super::carried::{self, Carried, Layout};

/// Of all definitions of the catalogue, whatever sets this library was built with.
static CATALOGUE: LazyLock<Table> = LazyLock::new(|| {
    let mut known = Known::default();
    for line in include_str!(concat!(env!("OUT_DIR"), "/permissions.txt")).lines() {
        // What cannot be read grants nothing; a test reads all of it.
        let _read = known.read(line);
    }
    Table(Arc::new(known))
});

/// The code of Clear Emergency (0007h) by which a client clears the emergencies of all clients. The
/// standard reserves it.
pub const CLEAR_ALL: u16 = 0xFFFF;

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
    pub const fn is_free(self) -> bool {
        matches!(
            self,
            Self::Observe | Self::Answer { .. } | Self::Release | Self::Emergency
        )
    }

    /// Whether an audit log holds each message that needs it.
    pub(super) const fn is_recorded(self) -> bool {
        !matches!(self, Self::Observe | Self::Answer { .. } | Self::Command)
    }

    fn of(word: &str) -> Option<Self> {
        Some(match word {
            "observe" => Self::Observe,
            "answer" => Self::Answer { is_granted: false },
            "release" => Self::Release,
            "emergency" => Self::Emergency,
            "command" => Self::Command,
            "clear-emergency" => Self::ClearEmergency,
            "configure" => Self::Configure,
            "control" => Self::Control { authority: 0 },
            _ => return None,
        })
    }

    /// The greater of two comes later.
    const fn rank(self) -> u8 {
        match self {
            Self::Observe => 0,
            Self::Answer { .. } => 1,
            Self::Release => 2,
            Self::Emergency => 3,
            Self::Command => 4,
            Self::ClearEmergency => 5,
            Self::ClearAnyEmergency => 6,
            Self::Configure => 7,
            Self::Control { .. } => 8,
        }
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
            Self::Command => "command",
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
}

/// What is known of a message code.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Row {
    needs: Permission,
    /// The place of the authority in the message, or of what says whether control is granted.
    place: Option<usize>,
    names: Vec<String>,
    carries: Vec<Layout>,
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
    /// writes them. Of a code that is known already, the greater right is needed.
    ///
    /// # Errors
    /// The first line that cannot be read.
    pub fn with(&self, lines: &str) -> Result<Self, TableError> {
        let mut known = Known::clone(&self.0);
        for line in lines.lines() {
            let shortened = || TableError(super::shortened(line));
            known.read(line).ok_or_else(shortened)?;
        }
        Ok(Self(Arc::new(known)))
    }

    /// The right that a message needs, which begins with its code; `None` if no definition states it.
    #[must_use]
    pub fn permission(&self, message: &[u8]) -> Option<Permission> {
        let row = self.row(message)?;
        let field = row.place.map(|place| message.get(place).copied());
        Some(match row.needs {
            Permission::Control { .. } => Permission::Control {
                // What is malformed is refused as if it asked for all.
                authority: field.map_or(0, |it| it.unwrap_or(u8::MAX)),
            },
            Permission::Answer { .. } => Permission::Answer {
                is_granted: field.flatten() == Some(0),
            },
            Permission::ClearEmergency if may_clear_all(message) => Permission::ClearAnyEmergency,
            needs => needs,
        })
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
        if self
            .permission(message)
            .is_some_and(Permission::is_recorded)
        {
            return true;
        }
        match self.carried(message) {
            Carried::Messages(carried) if depth > 0 => carried
                .into_iter()
                .any(|message| self.is_recorded_within(message, depth - 1)),
            _ => false,
        }
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
        if self.permission(message) == Some(Permission::ClearAnyEmergency) {
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
        let names_service = |urn: &str| urn == name || urn.rsplit(':').next() == Some(name);
        let services = self.0.services.iter();
        let services = services.filter(|(urn, _)| names_service(urn));
        let inputs = services.flat_map(|(_, inputs)| inputs.iter().copied());
        let messages = self.0.messages.iter();
        let messages = messages.filter(|(_, row)| row.names.iter().any(|it| it == name));
        inputs.chain(messages.map(|(code, _)| *code)).collect()
    }

    fn row(&self, message: &[u8]) -> Option<&Row> {
        self.0.messages.get(&code_of(message)?)
    }
}

impl Known {
    /// Reads a line; `None` if it is malformed.
    fn read(&mut self, line: &str) -> Option<()> {
        let mut words = line.split_whitespace();
        let first = words.next()?;
        if first == "service" {
            let urn = words.next()?.to_owned();
            let codes: Vec<_> = words.map(code).collect::<Result<_, _>>().ok()?;
            self.services.entry(urn).or_default().extend(codes);
            return Some(());
        }
        let code = code(first).ok()?;
        let needs = words.next()?;
        let (needs, place) = match needs.split_once('@') {
            Some((needs, place)) => (needs, Some(place.parse().ok()?)),
            None => (needs, None),
        };
        let names = words.next()?.split(',').map(str::to_owned).collect();
        let row = Row {
            needs: Permission::of(needs)?,
            place,
            names,
            carries: words.map(Layout::parse).collect::<Option<_>>()?,
        };
        self.add(code, row);
        Some(())
    }

    fn add(&mut self, code: u16, row: Row) {
        let Some(known) = self.messages.get_mut(&code) else {
            self.messages.insert(code, row);
            return;
        };
        if row.needs.rank() > known.needs.rank() {
            (known.needs, known.place) = (row.needs, row.place);
        }
        let names = row.names.into_iter();
        known.names.extend(
            names
                .filter(|it| !known.names.contains(it))
                .collect::<Vec<_>>(),
        );
        let carries = row.carries.into_iter();
        let new = carries.filter(|it| !known.carries.contains(it));
        known.carries.extend(new.collect::<Vec<_>>());
    }
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
