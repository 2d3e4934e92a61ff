//! Reject Event Request: why an event was rejected, in a form that every known client can read.
//!
//! JAUS++ takes the first bit of the presence vector for that of the text, and assumes that the
//! code is always present. With both present, all fields are where it expects them. So it sees the
//! rejection instead of waiting for an answer that it could not read. For all other clients the
//! text is used as in the standard.

use crate::codec::Text;
use crate::endpoint::Received;
use crate::messages::core::RejectEventRequest;
use crate::messages::core::reject_event_request::ResponseCode;
use crate::service::Outbox;

/// The client has no event with the requested number.
pub(super) const INVALID_EVENT: ResponseCode =
    ResponseCode::ERROR_INVALID_EVENT_ID_FOR_UPDATE_EVENT_REQUEST;

/// Rejects a client's request.
pub(super) fn reject(request: &Received, request_id: u8, why: ResponseCode, out: &mut Outbox) {
    tracing::debug!(client = %request.source, request_id, ?why, "event refused");
    out.reply(request, &rejection(request_id, why));
}

/// The rejection of a request.
pub(super) fn rejection(request_id: u8, why: ResponseCode) -> RejectEventRequest {
    RejectEventRequest {
        request_id,
        response_code: Some(why),
        error_message: Some(Text::from(in_words(why))),
    }
}

/// Text for people, up to 80 octets.
const fn in_words(why: ResponseCode) -> &'static str {
    match why {
        ResponseCode::CONNECTION_REFUSED => "no room for another event, or for one this fast",
        ResponseCode::INVALID_EVENT_SETUP => "invalid event type, rate or query",
        ResponseCode::MESSAGE_NOT_SUPPORTED => "this component does not answer this query",
        INVALID_EVENT => "you have no event with this number",
        _ => "refused",
    }
}
