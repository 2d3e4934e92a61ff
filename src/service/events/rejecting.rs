//! Reject Event Request: why an event cannot be had, so that every known client can read it.
//!
//! JAUS++ takes the first bit of the presence vector for the text, and the code for always there.
//! With both, everything is where it looks: it understands that it was refused, instead of waiting
//! for an answer that it could not read. To all others the text is what the standard has it for.

use crate::codec::Text;
use crate::endpoint::Received;
use crate::messages::core::RejectEventRequest;
use crate::messages::core::reject_event_request::ResponseCode;
use crate::service::Outbox;

/// The event that a request names is none of the client's.
pub(super) const INVALID_EVENT: ResponseCode =
    ResponseCode::ERROR_INVALID_EVENT_ID_FOR_UPDATE_EVENT_REQUEST;

/// Refuses what a client asked for.
pub(super) fn reject(request: &Received, request_id: u8, why: ResponseCode, out: &mut Outbox) {
    tracing::debug!(client = %request.source, request_id, ?why, "event refused");
    out.reply(request, &rejection(request_id, why));
}

/// The refusal of a request.
pub(super) fn rejection(request_id: u8, why: ResponseCode) -> RejectEventRequest {
    RejectEventRequest {
        request_id,
        response_code: Some(why),
        error_message: Some(Text::from(in_words(why))),
    }
}

/// Up to 80 octets, for people.
const fn in_words(why: ResponseCode) -> &'static str {
    match why {
        ResponseCode::CONNECTION_REFUSED => "no room for another event, or not for so fast a one",
        ResponseCode::INVALID_EVENT_SETUP => "an event of this type, rate or query cannot be",
        ResponseCode::MESSAGE_NOT_SUPPORTED => "nobody here answers this query",
        INVALID_EVENT => "no event of yours has this number",
        _ => "refused",
    }
}
