//! The right that a message needs.

use std::ops::RangeInclusive;

use jaus::codec::Message as _;
use jaus::component::CLEAR_ALL;
use jaus::messages::core::{
    CancelEvent, ClearEmergency, ConfirmControl, ConfirmElementRequest, ConfirmEventRequest,
    CreateCommandEvent, CreateEvent, RegisterServices, RejectControl, RejectElementRequest,
    RejectEventRequest, ReleaseControl, RequestControl, Reset, SetAuthority, SetEmergency, SetTime,
    Shutdown, UpdateEvent,
};

use super::known;

/// The codes that AS5710 sets aside for commands.
const COMMANDS: RangeInclusive<u16> = 0x0000..=0x1FFF;
/// Request Handoff of Enhanced Access Control (IOP): it may hand control over at once, with the authority that it
/// names like Request Control.
pub(super) const REQUEST_HANDOFF: u16 = 0xFF31;
/// Answers that have codes of commands.
const ANSWERS: [u16; 6] = [
    ConfirmControl::CODE,
    RejectControl::CODE,
    ConfirmEventRequest::CODE,
    RejectEventRequest::CODE,
    ConfirmElementRequest::CODE,
    RejectElementRequest::CODE,
];

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
    /// To clear the emergencies of all clients.
    ClearAnyEmergency,
    Configure,
    /// All other commands.
    Command,
}

impl Permission {
    /// The right that a message, which begins with this code, needs.
    pub(super) fn of(code: u16, message: &[u8]) -> Self {
        match code {
            RequestControl::CODE | SetAuthority::CODE | REQUEST_HANDOFF => Self::Control {
                // A message without an authority is malformed, and refused as if it asked for all.
                authority: message.get(2).copied().unwrap_or(u8::MAX),
            },
            ClearEmergency::CODE if clears_all(message) => Self::ClearAnyEmergency,
            ClearEmergency::CODE => Self::ClearEmergency,
            Shutdown::CODE | Reset::CODE | SetTime::CODE => Self::Configure,
            ReleaseControl::CODE | SetEmergency::CODE | RegisterServices::CODE => Self::Observe,
            CreateEvent::CODE | UpdateEvent::CODE | CancelEvent::CODE => Self::Observe,
            _ if is_command(code) => Self::Command,
            _ => Self::Observe,
        }
    }
}

/// Whether a Clear Emergency is for those of all clients.
pub(crate) fn clears_all(message: &[u8]) -> bool {
    message.get(2..4) == Some(&CLEAR_ALL.to_le_bytes())
}

/// Whether the audit log holds each message with this code.
pub(super) const fn is_recorded(code: u16) -> bool {
    matches!(
        code,
        RequestControl::CODE
            | REQUEST_HANDOFF
            | ReleaseControl::CODE
            | SetAuthority::CODE
            | SetEmergency::CODE
            | ClearEmergency::CODE
            | Shutdown::CODE
            | Reset::CODE
            | SetTime::CODE
    )
}

/// In the range of AS5710 all but the answers are commands, whatever the definitions say; elsewhere the definitions tell.
/// What none of them has may do anything.
fn is_command(code: u16) -> bool {
    if COMMANDS.contains(&code) {
        return !ANSWERS.contains(&code);
    }
    known::is_command(code).unwrap_or(true)
}

/// What a message carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Carried<'m> {
    /// It is no message that carries another.
    Nothing,
    /// It carries this message.
    Message(&'m [u8]),
    /// It should carry one, and does not: it is malformed, or a fragment.
    Missing,
}

/// The message inside a request for an event, or for the end of a command.
pub(super) fn carried(code: u16, message: &[u8]) -> Carried<'_> {
    // After the code: request, type, rate (and event); or request and time limit; then a length.
    let offset = match code {
        CreateEvent::CODE => 2 + 1 + 1 + 2 + 4,
        UpdateEvent::CODE => 2 + 1 + 1 + 2 + 1 + 4,
        CreateCommandEvent::CODE => 2 + 1 + 4 + 4,
        _ => return Carried::Nothing,
    };
    let carried = message.get(offset..).filter(|rest| rest.len() >= 2);
    carried.map_or(Carried::Missing, Carried::Message)
}
