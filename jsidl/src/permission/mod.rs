//! The right that the sender of a message needs, as the definitions state it.
//!
//! JSIDL says of a message at most that only the controlling client may send it (`is_command`). That is
//! too little for a node that decides, for each sender, which messages may pass: a request for control,
//! a change of the clock and a new waypoint are all commands. So a `message_def` may have attributes of
//! our own namespace:
//!
//! ```xml
//! <message_def name="RequestControl" message_id="000D" is_command="true"
//!     xmlns:own="urn:jaus-rs:jsidl" own:permission="control" own:authority="AuthorityCode">
//! ```
//!
//! | `permission` | the message |
//! |---|---|
//! | `observe` | changes nothing: a query, a report, an answer, a subscription |
//! | `answer` | says whether control is granted: `granted` names the field that is 0 then |
//! | `release` | ends what its sender itself has |
//! | `emergency` | stops |
//! | `clear-emergency` | ends a stop |
//! | `command` | changes or moves something |
//! | `carry` | commands by the message that it carries, and does nothing else |
//! | `control` | asks for control; `authority` names the field with the authority that it asks for |
//! | `configure` | shuts a component down, resets it, or sets its time |
//!
//! A message that a service receives needs the attribute, unless the state machine of the service marks it
//! as a query: all that it triggers is that an output of the service is sent. What a service only sends is a
//! report, unless it is a command. Nothing is guessed, and no name decides: the message has no permission
//! otherwise, and a node refuses it.
//!
//! Where several services give one code to different messages, the rights to all of them are needed: a node
//! cannot tell which of them is meant.
//!
//! A message that only stops or ends something, whatever its fields say, has `stops="true"` as well. It then
//! passes also where commands are refused because they cannot be recorded, and one for a group reaches those of
//! the group that its sender may reach. What its sender needs stays the same. `release` and `emergency` stop
//! without it.
//!
//! If the receiver of a message sends those that it carries on to other components, as a mission spooler does,
//! the attribute `destination` names the field with the id of the component: 4 octets, before the message in
//! the same element.

mod carried;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::{self, Write as _};
use std::sync::Arc;

use crate::behaviour::{StateMachine, Transition, TransitionKind};
use crate::heads::place_of;
use crate::library::Library;
use crate::model::{Message, Service};

/// What the sender of a message must be allowed to do.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Permission {
    /// To query, report and subscribe.
    Observe,
    /// To answer a request for control.
    Answer {
        /// The field that is 0 if control is granted.
        granted: String,
    },
    /// To end what the sender itself has.
    Release,
    /// To set an emergency.
    Emergency,
    /// To command.
    Command,
    /// To command by what the message carries.
    Carry,
    /// To clear an emergency.
    ClearEmergency,
    /// To shut down, to reset, and to set the time.
    Configure,
    /// To take control.
    Control {
        /// The field with the authority that is asked for; `None` if any will do.
        authority: Option<String>,
    },
}

impl Permission {
    /// The words of the attribute; their fields have attributes of their own.
    pub(crate) const WORDS: [(&str, Self); 9] = [
        ("observe", Self::Observe),
        (
            "answer",
            Self::Answer {
                granted: String::new(),
            },
        ),
        ("release", Self::Release),
        ("emergency", Self::Emergency),
        ("command", Self::Command),
        ("carry", Self::Carry),
        ("clear-emergency", Self::ClearEmergency),
        ("configure", Self::Configure),
        ("control", Self::Control { authority: None }),
    ];
}

impl Permission {
    /// Whether a message that needs it stops or ends something and does nothing else.
    const fn stops(&self) -> bool {
        matches!(self, Self::Release | Self::Emergency)
    }

    /// The field that a node reads, to decide on the message or to record it.
    pub(crate) fn field(&self) -> Option<&str> {
        match self {
            Self::Control { authority } => authority.as_deref(),
            Self::Answer { granted } => Some(granted),
            _ => None,
        }
    }
}

impl fmt::Display for Permission {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_same = |other: &Self| std::mem::discriminant(other) == std::mem::discriminant(self);
        let words = Self::WORDS;
        let word = words.iter().find(|(_, it)| is_same(it));
        f.write_str(word.map_or("", |(word, _)| word))
    }
}

/// The permissions of all messages of some services.
#[derive(Debug, Default)]
pub struct Permissions {
    rows: BTreeMap<u16, Row>,
    /// The codes that each service receives, whatever its version.
    services: BTreeMap<Arc<str>, BTreeSet<u16>>,
    /// Messages that a service receives, and of which no definition says what they need; each once.
    pub missing: Vec<Arc<Message>>,
}

/// What is known of a message code.
#[derive(Debug, Default)]
struct Row {
    /// The rights, with the places of their fields, in octets from the beginning of the message.
    needs: BTreeSet<(Permission, Option<usize>)>,
    names: BTreeSet<String>,
    /// Whether a message with this code does something else than to stop.
    acts: bool,
    /// The layouts of messages with this code that carry others.
    carries: BTreeSet<String>,
}

impl Permissions {
    /// Collects the permissions of all messages of these services.
    pub fn of(library: &Library) -> Self {
        let mut found = Self::default();
        let stated = stated(library);
        let mut missing = BTreeSet::new();
        for service in library.services() {
            let received = found.services.entry(service.id.urn.clone()).or_default();
            received.extend(service.inputs.iter().map(|it| it.code));
            for message in &service.inputs {
                let needs = match stated.get(&key(message)) {
                    Some(stated) => stated.clone(),
                    None if is_query(service, message) => vec![Permission::Observe],
                    None => Vec::new(),
                };
                if needs.is_empty() && missing.insert(key(message)) {
                    found.missing.push(message.clone());
                }
                found.add(message, needs, true);
            }
        }
        for message in library.services().flat_map(|service| &service.outputs) {
            // A client sends commands, too: those that a service receives are judged there.
            let is_report = !message.is_command && !missing.contains(&key(message));
            let needs = match stated.get(&key(message)) {
                Some(stated) => stated.clone(),
                None if is_report => vec![Permission::Observe],
                None => Vec::new(),
            };
            if needs.is_empty() && missing.insert(key(message)) {
                found.missing.push(message.clone());
            }
            found.add(message, needs, false);
        }
        found
            .rows
            .retain(|code, _| !missing.iter().any(|(it, _)| it == code));
        found
    }

    fn add(&mut self, message: &Message, needs: Vec<Permission>, is_received: bool) {
        if needs.is_empty() {
            return;
        }
        let row = self.rows.entry(message.code).or_default();
        row.acts |= !message.stops && !needs.iter().all(Permission::stops);
        row.needs.extend(needs.into_iter().map(|needs| {
            let place = needs.field().and_then(|field| place_of(message, field));
            (needs, place)
        }));
        row.names.insert(message.name.clone());
        row.carries
            .extend(is_received.then(|| carried::layout(message)).flatten());
    }
}

/// A line for each message code, and for each service:
///
/// ```text
/// 000D control@2 RequestControl
/// 01F0 observe CreateEvent [4m4]
/// D112 command StopMission stops
/// F92A command,observe CBRNScanWindowConfigurationCommand,QueryMeasurement
/// service urn:jaus:jss:core:Time 0011 2011
/// ```
///
/// The code in hexadecimal digits; the rights, separated by commas, each with the place of the field that
/// belongs to it; the names, separated by commas; `stops` if all messages with the code only stop or end something; and
/// for a message that carries others, the layouts that it may have. A service has the codes that it receives.
impl fmt::Display for Permissions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (code, row) in &self.rows {
            let words = row.needs.iter().map(|(needs, place)| match place {
                Some(place) => format!("{needs}@{place}"),
                None => needs.to_string(),
            });
            let needs: Vec<_> = words.collect::<BTreeSet<_>>().into_iter().collect();
            let mut line = format!("{code:04X} {}", needs.join(","));
            let names: Vec<_> = row.names.iter().map(String::as_str).collect();
            write!(line, " {}", names.join(","))?;
            if !row.acts {
                line.push_str(" stops");
            }
            for layout in &row.carries {
                write!(line, " [{layout}]")?;
            }
            writeln!(f, "{line}")?;
        }
        for (urn, codes) in &self.services {
            let codes: Vec<_> = codes.iter().map(|code| format!("{code:04X}")).collect();
            writeln!(f, "service {urn} {}", codes.join(" "))?;
        }
        Ok(())
    }
}

/// A message, whatever services declare it.
fn key(message: &Message) -> (u16, String) {
    (message.code, message.name.clone())
}

/// What the definitions state: of several statements all count.
fn stated(library: &Library) -> BTreeMap<(u16, String), Vec<Permission>> {
    let mut stated: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for message in library.services().flat_map(|it| it.messages()) {
        if let Some(needs) = &message.permission {
            let known = stated.entry(key(message)).or_default();
            if !known.contains(needs) {
                known.push(needs.clone());
            }
        }
    }
    stated
}

/// Whether the state machines of a service mark this message as a query: wherever it triggers something, that
/// is that reports are sent, and no state changes.
fn is_query(service: &Service, message: &Message) -> bool {
    let is_report = |name: &str| {
        let output = service.outputs.iter().find(|it| it.name == name);
        let is_input = service.inputs.iter().any(|it| it.name == name);
        !is_input && output.is_some_and(|it| !it.is_command)
    };
    let only_answers = |transition: &Transition| {
        let mut actions = transition.actions.iter();
        transition.kind == TransitionKind::Internal
            && !transition.actions.is_empty()
            && actions.all(|it| it.sent().is_some_and(is_report))
    };
    let transitions = service.behaviour.iter().flat_map(StateMachine::transitions);
    let mut triggered = transitions
        .filter(|it| it.trigger.message() == Some(&message.name))
        .peekable();
    !message.is_command && triggered.peek().is_some() && triggered.all(only_answers)
}

/// Whether a node finds the destinations of the messages that this message carries.
pub(crate) fn has_destinations(message: &Message) -> bool {
    carried::has_destinations(message)
}
