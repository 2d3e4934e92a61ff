//! A peer's reason for refusing an event, read from Reject Event Request (01F4h) in the layouts
//! that peers use.

use std::fmt;

use bytes::Bytes;

use crate::codec::{Message, Text};
use crate::messages::core::RejectEventRequest;

/// A peer's reason for refusing an event.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rejection {
    /// The response code of AS5710, 1 to 6, if the peer gave one.
    pub code: Option<u8>,
    /// The peer's text for people, if any.
    pub text: Option<String>,
}

impl Rejection {
    /// Reads the number of the refused request and the reason.
    pub(crate) fn read(payload: &Bytes) -> Option<(u8, Self)> {
        if let Ok(reject) = RejectEventRequest::decode(payload) {
            let text = reject.error_message.as_ref().map(Text::to_string_lossy);
            let text = text.map(|text| text.trim_end_matches(['\0', ' ']).to_owned());
            let reason = Self {
                code: reject.response_code.map(|code| code.0),
                text: text.filter(|text| !text.is_empty()),
            };
            return Some((reject.request_id, reason));
        }
        Self::read_without_presence(payload)
    }

    /// JAUS++ always writes the response code, one too low, whatever the presence vector says.
    fn read_without_presence(payload: &[u8]) -> Option<(u8, Self)> {
        let [_, _, _presence, request, code, ..] = *payload else {
            return None;
        };
        let reason = Self {
            code: code.checked_add(1),
            text: None,
        };
        Some((request, reason))
    }

    const fn in_words(&self) -> &'static str {
        match self.code {
            Some(1) => "it has no periodic events",
            Some(2) => "it has no events on change",
            Some(3) => "it refuses the connection",
            Some(4) => "it cannot set up such an event",
            Some(5) => "it has no events for this message",
            Some(6) => "it has no event with this number",
            Some(_) => "its reason code is undefined",
            None => "it gives no reason",
        }
    }
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.in_words())?;
        if let Some(code) = self.code {
            write!(f, " (code {code})")?;
        }
        match &self.text {
            // Escaped: it comes from the peer.
            Some(text) => write!(f, ": {text:?}"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(octets: &'static [u8]) -> (u8, Rejection) {
        Rejection::read(&Bytes::from_static(octets)).expect("a rejection")
    }

    #[test]
    fn the_standards_layout_says_what_is_there() {
        let (request, reason) = read(&[0xF4, 0x01, 1, 9, 5]);
        assert_eq!((request, reason.code), (9, Some(5)));
        assert_eq!(
            reason.to_string(),
            "it has no events for this message (code 5)"
        );
        let (request, reason) = read(&[0xF4, 0x01, 0, 9]);
        assert_eq!((request, reason.code), (9, None));
    }

    #[test]
    fn a_code_that_the_presence_vector_does_not_tell_of_is_one_too_low() {
        let (request, reason) = read(&[0xF4, 0x01, 0, 9, 4]);
        assert_eq!((request, reason.code), (9, Some(5)));
    }

    #[test]
    fn a_peers_text_is_shown_on_one_line_without_control_characters() {
        let reason = Rejection {
            code: Some(5),
            text: Some("\x1b[2Jno\r\nfake \u{202e}".to_owned()),
        };
        let shown = reason.to_string();
        assert!(
            shown.ends_with(r#": "\u{1b}[2Jno\r\nfake \u{202e}""#),
            "{shown}"
        );
    }

    #[test]
    fn rubbish_is_no_rejection() {
        assert_eq!(Rejection::read(&Bytes::from_static(&[0xF4, 0x01, 0])), None);
    }
}
