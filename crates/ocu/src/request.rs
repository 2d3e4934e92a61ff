//! What a page says: requests for the vehicle, and what concerns the connection alone.

use serde::Deserialize;

/// One frame from a page.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Frame {
    /// With an id, the request is answered.
    #[serde(default)]
    pub id: Option<u64>,
    /// What is wanted.
    #[serde(flatten)]
    pub said: Said,
}

/// What a page says.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Said {
    /// Who it is.
    Token {
        /// What was printed or written into a file.
        token: String,
    },
    /// Whether and which messages it wants to see.
    Messages {
        /// Whether any.
        on: bool,
        /// Which.
        #[serde(default)]
        filter: MessageFilter,
    },
    /// A request.
    #[serde(untagged)]
    OperatorRequest(OperatorRequest),
}

/// Which messages a page wants to see; what is empty lets everything through.
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize)]
#[serde(default)]
pub struct MessageFilter {
    /// Source or destination, for example `101.2.33`, or the beginning of one: `101.2`.
    pub component: String,
    /// A part of the service's name.
    pub service: String,
    /// A part of the message's name, or its code.
    pub message: String,
    /// Somewhere in the message as JSON.
    pub text: String,
}

/// What an operator wants of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum OperatorRequest {
    /// To look at another vehicle.
    Select {
        /// Its number.
        subsystem: u16,
    },
    /// To take control, or to give it back.
    Control {
        /// Whether to take it.
        on: bool,
    },
    /// To have it act on commands.
    Resume,
    /// To have it stop and wait.
    Standby,
    /// To stop everything at once, or to take that back.
    Emergency {
        /// Whether to stop.
        on: bool,
    },
    /// To drive by hand.
    Drive {
        /// Ahead, -1 to 1.
        forward: f64,
        /// To the right, -1 to 1.
        turn: f64,
    },
    /// To drive no more.
    DriveEnd,
    /// To have a path planned.
    Destination {
        /// Metres to the north.
        x: f64,
        /// Metres to the east.
        y: f64,
        /// Metres per second at most; the planner's own without it.
        #[serde(default)]
        speed: Option<f64>,
    },
    /// To have the path driven.
    Approve {
        /// Which mission's.
        mission: u32,
    },
    /// To end the mission.
    Stop,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Frame, serde_json::Error> {
        serde_json::from_str(text)
    }

    #[test]
    fn every_frame_of_the_protocol_is_understood() {
        let requests = [
            (
                r#"{"type":"select","subsystem":101}"#,
                OperatorRequest::Select { subsystem: 101 },
            ),
            (
                r#"{"type":"control","on":true}"#,
                OperatorRequest::Control { on: true },
            ),
            (r#"{"type":"resume"}"#, OperatorRequest::Resume),
            (r#"{"type":"standby"}"#, OperatorRequest::Standby),
            (
                r#"{"type":"emergency","on":false}"#,
                OperatorRequest::Emergency { on: false },
            ),
            (
                r#"{"type":"drive","forward":0.5,"turn":-1}"#,
                OperatorRequest::Drive {
                    forward: 0.5,
                    turn: -1.0,
                },
            ),
            (r#"{"type":"drive_end"}"#, OperatorRequest::DriveEnd),
            (
                r#"{"type":"destination","x":1,"y":-2.5,"speed":null}"#,
                OperatorRequest::Destination {
                    x: 1.0,
                    y: -2.5,
                    speed: None,
                },
            ),
            (
                r#"{"type":"approve","mission":3}"#,
                OperatorRequest::Approve { mission: 3 },
            ),
            (r#"{"type":"stop"}"#, OperatorRequest::Stop),
        ];
        for (text, request) in requests {
            let frame = read(text).unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!(
                frame,
                Frame {
                    id: None,
                    said: Said::OperatorRequest(request)
                },
                "{text}"
            );
        }
        let frame = read(r#"{"type":"token","token":"abc","id":7}"#).unwrap();
        let said = Said::Token {
            token: "abc".into(),
        };
        assert_eq!(frame, Frame { id: Some(7), said });
        let frame = read(r#"{"type":"messages","on":true,"filter":{"text":"x"}}"#).unwrap();
        let filter = MessageFilter {
            text: "x".into(),
            ..MessageFilter::default()
        };
        assert_eq!(frame.said, Said::Messages { on: true, filter });
    }

    #[test]
    fn what_is_no_frame_is_no_wish() {
        for text in [
            "",
            "{}",
            "[]",
            r#"{"type":"fly"}"#,
            r#"{"type":"control"}"#,
            r#"{"type":"select","subsystem":70000}"#,
            r#"{"type":"drive","forward":"fast","turn":0}"#,
            r#"{"type":"emergency","on":true,"id":-1}"#,
        ] {
            assert!(read(text).is_err(), "{text}");
        }
    }
}
