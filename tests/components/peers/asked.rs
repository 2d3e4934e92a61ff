//! Required answers to requests.

use jaus::codec::Message;
use jaus::messages::core::{
    CancelEvent, ConfirmControl, ConfirmElementRequest, ConfirmEventRequest, CreateEvent,
    RejectControl, ReleaseControl, RequestControl, SetElement,
};

/// The codes of the required answers.
pub(crate) fn answers_to(code: u16) -> Vec<u16> {
    match code {
        CreateEvent::CODE | CancelEvent::CODE => vec![ConfirmEventRequest::CODE],
        RequestControl::CODE => vec![ConfirmControl::CODE],
        ReleaseControl::CODE => vec![RejectControl::CODE],
        SetElement::CODE => vec![ConfirmElementRequest::CODE],
        query if query >> 12 == 2 => vec![query + 0x2000],
        _ => Vec::new(),
    }
}
