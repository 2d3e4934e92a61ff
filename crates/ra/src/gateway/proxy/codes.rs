//! Classifies JAUS message codes by responsibility, and names the RA codes that the proxy handles.

use crate::messages::ra33;
use jaus::codec::Message as _;

pub(super) const SHUTDOWN: u16 = ra33::Shutdown::CODE;
pub(super) const STANDBY: u16 = ra33::Standby::CODE;
pub(super) const RESUME: u16 = ra33::Resume::CODE;
pub(super) const RESET: u16 = ra33::Reset::CODE;
pub(super) const SET_EMERGENCY: u16 = ra33::SetEmergency::CODE;
pub(super) const CLEAR_EMERGENCY: u16 = ra33::ClearEmergency::CODE;
pub(super) const REQUEST_CONTROL: u16 = ra33::RequestComponentControl::CODE;
pub(super) const RELEASE_CONTROL: u16 = ra33::ReleaseComponentControl::CODE;
pub(super) const CONFIRM_CONTROL: u16 = ra33::ConfirmComponentControl::CODE;
pub(super) const REJECT_CONTROL: u16 = ra33::RejectComponentControl::CODE;
pub(super) const QUERY_CONTROL: u16 = ra33::QueryComponentControl::CODE;
pub(super) const REPORT_CONTROL: u16 = ra33::ReportComponentControl::CODE;
pub(super) const SET_EFFORT: u16 = ra33::SetWrenchEffort::CODE;
pub(super) const SET_GLOBAL_VECTOR: u16 = ra33::SetGlobalVector::CODE;
pub(super) const SET_LOCAL_VECTOR: u16 = ra33::SetLocalVector::CODE;
pub(super) const SET_SPEED: u16 = ra33::SetTravelSpeed::CODE;
pub(super) const SPEED: u16 = ra33::ReportTravelSpeed::CODE;
pub(in crate::gateway) const QUERY_STATUS: u16 = ra33::QueryComponentStatus::CODE;
pub(in crate::gateway) const STATUS: u16 = ra33::ReportComponentStatus::CODE;

/// Whether a message with this code goes to the RA component. The proxy itself handles all others:
/// transport, discovery, liveness, events, access control, and driver answers about list elements
/// that the RA component has set.
pub(super) const fn crosses(code: u16) -> bool {
    if matches!(code, 0x041C | 0x041D) {
        return false;
    }
    is_management(code)
        || matches!(
            code,
            0x2002 | 0x0400..=0x04FF | 0x0A00..=0x0AFF | 0x2400..=0x24FF | 0x2A00..=0x2AFF
        )
}

/// Shutdown, Standby, Resume, Reset, Set Emergency, Clear Emergency.
pub(super) const fn is_management(code: u16) -> bool {
    matches!(code, 0x0002..=0x0007)
}

/// Whether a command requires control. Any client may set an emergency, and knowledge stores need
/// no control.
pub(super) const fn needs_control(code: u16) -> bool {
    !matches!(code, 0x0006 | 0x0007 | 0x0A00..=0x0AFF)
}

/// The report that answers a command, for the few commands with an answer.
pub(super) const fn answer_to_command(code: u16) -> Option<u16> {
    match code {
        0x0A20 => Some(0x4A20),
        0x0A24 => Some(0x4A24),
        _ => None,
    }
}
