//! The right that a message needs.

use jaus::codec::Message as _;
use jaus::messages;
use jaus::messages::core::{
    CancelEvent, ClearEmergency, CreateCommandEvent, CreateEvent, RegisterServices, ReleaseControl,
    RequestControl, Reset, SetAuthority, SetEmergency, SetTime, Shutdown, UpdateEvent,
};

/// The codes that AS5710 sets aside for commands, and those for commands of users.
const COMMANDS: [std::ops::RangeInclusive<u16>; 2] = [0x0000..=0x1FFF, 0xD000..=0xDFFF];

/// What a sender needs to be allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Permission {
    /// Queries, reports, answers, requests for events, emergencies, registration.
    Observe,
    /// Requests for control, or changes of its authority.
    Control {
        authority: u8,
    },
    ClearEmergency,
    Configure,
    /// All other commands.
    Command,
}

impl Permission {
    /// The right that a message, which begins with this code, needs. The definitions tell which
    /// messages are commands; for an unknown code its range does.
    pub(super) fn of(code: u16, message: &[u8]) -> Self {
        match code {
            RequestControl::CODE | SetAuthority::CODE => Self::Control {
                // A message without an authority is malformed, and refused as if it asked for all.
                authority: message.get(2).copied().unwrap_or(u8::MAX),
            },
            ClearEmergency::CODE => Self::ClearEmergency,
            Shutdown::CODE | Reset::CODE | SetTime::CODE => Self::Configure,
            ReleaseControl::CODE | SetEmergency::CODE | RegisterServices::CODE => Self::Observe,
            CreateEvent::CODE | UpdateEvent::CODE | CancelEvent::CODE => Self::Observe,
            _ if is_command(code) => Self::Command,
            _ => Self::Observe,
        }
    }
}

/// Whether the audit log holds each message with this code.
pub(super) fn is_recorded(code: u16) -> bool {
    let needed = Permission::of(code, &[]);
    matches!(code, ReleaseControl::CODE | SetEmergency::CODE)
        || !matches!(needed, Permission::Observe | Permission::Command)
}

fn is_command(code: u16) -> bool {
    let mut known = messages::registry().by_code(code).peekable();
    if known.peek().is_some() {
        return known.any(|message| message.is_command);
    }
    COMMANDS.iter().any(|range| range.contains(&code))
}

/// The message inside a request for an event, or for the end of a command.
pub(super) fn carried(code: u16, message: &[u8]) -> Option<&[u8]> {
    // After the code: request, type, rate (and event); or request and time limit; then a length.
    let offset = match code {
        CreateEvent::CODE => 2 + 1 + 1 + 2 + 4,
        UpdateEvent::CODE => 2 + 1 + 1 + 2 + 1 + 4,
        CreateCommandEvent::CODE => 2 + 1 + 4 + 4,
        _ => return None,
    };
    message.get(offset..).filter(|rest| rest.len() >= 2)
}
