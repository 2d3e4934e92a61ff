//! Messages from a page: requests for the vehicle, and settings of the connection.

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::messages::core::{
    ClearEmergency, ReleaseControl, RequestControl, Resume, SetEmergency, Standby,
};
use jaus::messages::mobility::SetWrenchEffort;
use jaus::rights::{CLEAR_ALL, Table};
use jaus::wire;
use jaus_audit::Action;
use jaus_vehicle::messages::ground::{
    ApproveMission, ContinueMission, SetDestination, StopMission,
};
use jaus_vehicle::messages::handoff::ConfirmReleaseControl;
use serde::Deserialize;

use super::page_link::Seen;
use super::press::Press;
use super::users::{PageRights, UserRole};

/// One frame from a page.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Frame {
    /// A request with an id is answered.
    #[serde(default)]
    pub id: Option<u64>,
    /// The subsystem number of the vehicle that the page shows. A request for another vehicle than
    /// the page's is refused, except an emergency.
    #[serde(default)]
    pub vehicle: Option<u16>,
    /// Of a stop: the press. Of its clearing: the last press of the page, whose late copies then stop
    /// nothing any more.
    #[serde(default)]
    pub press: Option<Press>,
    /// Of the clearing of a stop: how many stops the station had taken, by the state that the page shows.
    /// Without it, stops of other pages do not matter.
    #[serde(default)]
    pub stops: Option<u64>,
    /// The content.
    #[serde(flatten)]
    pub said: Said,
}

/// Content of a frame.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Said {
    /// Authentication.
    Token {
        /// The token, as printed or stored in a file.
        token: String,
    },
    /// A state has arrived.
    Received {
        /// Its number.
        seen: u64,
    },
    /// A state is shown.
    Seen(Seen),
    /// The user is active, which keeps the session from becoming idle.
    Active,
    /// Enables or disables the message view.
    Messages {
        /// Whether to send messages.
        on: bool,
        /// Which messages to send.
        #[serde(default)]
        filter: MessageFilter,
    },
    /// Asks for what lies over the map of the vehicle.
    Overlay {
        /// Revision of the zones that the page has.
        #[serde(default)]
        zones: u32,
    },
    /// A request for the vehicle.
    #[serde(untagged)]
    OperatorRequest(OperatorRequest),
}

/// Filter of the message view. Empty fields match everything.
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize)]
#[serde(default)]
pub struct MessageFilter {
    /// Source or destination, for example `101.2.33`, or a prefix such as `101.2`.
    pub component: String,
    /// Part of the service name.
    pub service: String,
    /// Part of the message name, or the message code.
    pub message: String,
    /// Text within the message as JSON.
    pub text: String,
}

/// An operator's request for the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum OperatorRequest {
    /// Select another vehicle for this page: the one to control and drive.
    Select {
        /// Its subsystem number.
        subsystem: u16,
    },
    /// Take or release control. If another operator with an equal or higher authority has it, this
    /// requests it from that operator, or withdraws the request.
    Control {
        /// Whether to take control.
        on: bool,
    },
    /// Decide about another operator's request for control.
    Handover {
        /// The part of the vehicle that has passed it on.
        part: JausId,
        /// The operator who requests control.
        operator: JausId,
        /// Whether to hand over control.
        grant: bool,
    },
    /// Resume: make the vehicle act on commands.
    Resume,
    /// Standby: make the vehicle stop and wait.
    Standby,
    /// Set or clear an emergency.
    Emergency {
        /// Whether to set it.
        on: bool,
    },
    /// Set or clear an emergency of all vehicles.
    EmergencyAll {
        /// Whether to set it.
        on: bool,
    },
    /// Clear the emergencies that other clients have set at the vehicle, too.
    ClearAnyEmergency,
    /// Drive manually.
    Drive {
        /// Forward, -1 to 1.
        forward: f64,
        /// Right, -1 to 1.
        turn: f64,
        /// For so many milliseconds the operator's hand counts without another sign. Without it, until the page
        /// ends the drive.
        #[serde(default)]
        hand_ms: Option<u64>,
        /// What the operator sees. Without it, the vehicle is not driven.
        #[serde(flatten)]
        seen: Option<Seen>,
    },
    /// End manual drive.
    DriveEnd,
    /// Take over from the planner: stop the mission, and take control of the drivers.
    TakeOver,
    /// Plan a path to a destination.
    Destination {
        /// Metres north.
        x: f64,
        /// Metres east.
        y: f64,
        /// Speed limit in metres per second. Without one, the planner's default applies.
        #[serde(default)]
        speed: Option<f64>,
    },
    /// Approve the planned path.
    Approve {
        /// The mission to approve.
        mission: u32,
    },
    /// Continue a mission that a fault has stopped.
    Continue {
        /// The mission to continue.
        mission: u32,
    },
    /// Stop the mission.
    Stop,
}

/// A message, or nothing, which no rules allow.
fn encoded(message: &impl Message) -> Bytes {
    message.encode().unwrap_or_default()
}

/// A message of which the code alone matters.
fn of_code(code: u16) -> Bytes {
    Bytes::copy_from_slice(&code.to_le_bytes())
}

/// The frames that pages send most often, as arrays.
#[derive(Deserialize)]
#[serde(untagged)]
enum ShortFrame {
    Drive(u64, u64, f64, f64),
    DriveFor(u64, u64, f64, f64, u64),
    Seen(u64, u64),
    Received((u64,)),
    DriveEnd([u64; 0]),
}

impl Frame {
    /// Reads a frame. An array of numbers is the short form of the most frequent ones: `[seen]` of
    /// `received`, `[seen, held_ms]` of `seen`, `[seen, held_ms, forward, turn]` of `drive`, with
    /// `hand_ms` behind them or without, and `[]` of `drive_end`.
    ///
    /// # Errors
    /// If the text is no frame.
    pub fn read(text: &str) -> Result<Self, serde_json::Error> {
        if !text.starts_with('[') {
            return serde_json::from_str(text);
        }
        let drive = |seq, held_ms, forward, turn, hand_ms| {
            Said::OperatorRequest(OperatorRequest::Drive {
                forward,
                turn,
                hand_ms,
                seen: Some(Seen { seq, held_ms }),
            })
        };
        let said = match serde_json::from_str(text)? {
            ShortFrame::Received((seen,)) => Said::Received { seen },
            ShortFrame::Seen(seq, held_ms) => Said::Seen(Seen { seq, held_ms }),
            ShortFrame::DriveEnd([]) => Said::OperatorRequest(OperatorRequest::DriveEnd),
            ShortFrame::Drive(seq, held, forward, turn) => drive(seq, held, forward, turn, None),
            ShortFrame::DriveFor(seq, held, forward, turn, hand) => {
                drive(seq, held, forward, turn, Some(hand))
            }
        };
        Ok(Self {
            id: None,
            vehicle: None,
            press: None,
            stops: None,
            said,
        })
    }
}

impl OperatorRequest {
    /// Whether it stops vehicles, for which the right to observe them suffices.
    pub(crate) const fn is_stop(&self) -> bool {
        matches!(
            self,
            Self::Emergency { on: true } | Self::EmergencyAll { on: true }
        )
    }

    /// Whether it only ends what moves a vehicle or controls it.
    pub(crate) fn is_end(&self) -> bool {
        let table = Table::default();
        match self {
            // What it needs is the right to begin them.
            Self::Control { on: false } | Self::DriveEnd => true,
            other => {
                let messages = other.messages(0);
                !messages.is_empty() && messages.iter().all(|it| table.stops(it))
            }
        }
    }

    /// The least role that may send the messages to which it leads.
    pub(crate) fn needs(&self, rights: PageRights) -> UserRole {
        let table = Table::default();
        let messages = self.messages(rights.authority);
        let may = |role: &UserRole| {
            let rules = role.rules(rights);
            let mut messages = messages.iter();
            messages.all(|message| {
                let frame = wire::Frame::new(JausId::EVERYONE, JausId::EVERYONE, message.clone());
                rules.check(&frame, &table).is_ok()
            })
        };
        let [.., most] = UserRole::ALL;
        UserRole::ALL.into_iter().find(may).unwrap_or(most)
    }

    /// The messages to which it leads, for the table of what messages need.
    fn messages(&self, authority_code: u8) -> Vec<Bytes> {
        let clear = |code: u16| {
            encoded(&ClearEmergency {
                emergency_code: code.into(),
            })
        };
        match self {
            // It is looking at another vehicle.
            Self::Select { .. } => Vec::new(),
            // The control is the station's, and so all users': who ends it must be allowed to take it.
            Self::Control { .. } => vec![
                encoded(&RequestControl { authority_code }),
                encoded(&ReleaseControl),
            ],
            Self::Handover { .. } => vec![encoded(&ConfirmReleaseControl::default())],
            Self::Resume => vec![encoded(&Resume)],
            Self::Standby => vec![encoded(&Standby)],
            Self::Emergency { on: true } | Self::EmergencyAll { on: true } => {
                vec![encoded(&SetEmergency::default())]
            }
            Self::Emergency { on: false } | Self::EmergencyAll { on: false } => vec![clear(1)],
            // Who has stopped the vehicle may have seen what this user does not see.
            Self::ClearAnyEmergency => vec![clear(CLEAR_ALL)],
            Self::Drive { .. } | Self::DriveEnd => vec![encoded(&SetWrenchEffort::default())],
            Self::TakeOver => vec![
                encoded(&StopMission),
                encoded(&RequestControl { authority_code }),
            ],
            Self::Destination { .. } => vec![of_code(SetDestination::CODE)],
            Self::Approve { .. } => vec![of_code(ApproveMission::CODE)],
            Self::Continue { .. } => vec![of_code(ContinueMission::CODE)],
            Self::Stop => vec![encoded(&StopMission)],
        }
    }

    /// What it does, for the audit log.
    pub(crate) const fn action(&self) -> Action {
        match self {
            Self::Select { .. } => Action::VehicleSelected,
            Self::Control { on: true } | Self::TakeOver => Action::ControlRequested,
            Self::Control { on: false } => Action::ControlReleased,
            Self::Handover { .. } => Action::HandoverAnswered,
            Self::Resume => Action::Resume,
            Self::Standby => Action::Standby,
            Self::Emergency { on: true } | Self::EmergencyAll { on: true } => Action::EmergencySet,
            Self::Emergency { on: false }
            | Self::EmergencyAll { on: false }
            | Self::ClearAnyEmergency => Action::EmergencyCleared,
            Self::Drive { .. } | Self::DriveEnd => Action::Drive,
            Self::Destination { .. } => Action::MissionPlanned,
            Self::Approve { .. } => Action::MissionApproved,
            Self::Continue { .. } => Action::MissionContinued,
            Self::Stop => Action::MissionStopped,
        }
    }

    /// The subsystem number of its vehicle, if the page shows the vehicle `shown`.
    pub(crate) const fn vehicle(&self, shown: Option<u16>) -> Option<u16> {
        match self {
            Self::Select { subsystem } => Some(*subsystem),
            Self::Handover { part, .. } => Some(part.subsystem()),
            Self::EmergencyAll { .. } => None,
            _ => shown,
        }
    }

    /// Details for the audit log.
    pub(crate) fn details(&self) -> Option<String> {
        match self {
            Self::Destination { x, y, .. } => Some(format!("to x {x} m, y {y} m")),
            Self::Approve { mission } | Self::Continue { mission } => {
                Some(format!("mission {mission}"))
            }
            Self::Handover {
                operator, grant, ..
            } => {
                let answer = if *grant { "granted" } else { "refused" };
                Some(format!("{answer} to {operator}"))
            }
            Self::TakeOver => Some("stops the mission".to_owned()),
            Self::EmergencyAll { .. } => Some("for all vehicles".to_owned()),
            Self::ClearAnyEmergency => Some("of all clients".to_owned()),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Frame, serde_json::Error> {
        Frame::read(text)
    }

    const SEEN: Seen = Seen {
        seq: 12,
        held_ms: 40,
    };

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
            (
                r#"{"type":"handover","part":"101.3.36","operator":"43.1.1","grant":false}"#,
                OperatorRequest::Handover {
                    part: JausId::new(101, 3, 36),
                    operator: JausId::new(43, 1, 1),
                    grant: false,
                },
            ),
            (r#"{"type":"resume"}"#, OperatorRequest::Resume),
            (r#"{"type":"standby"}"#, OperatorRequest::Standby),
            (
                r#"{"type":"emergency","on":false}"#,
                OperatorRequest::Emergency { on: false },
            ),
            (
                r#"{"type":"emergency_all","on":true}"#,
                OperatorRequest::EmergencyAll { on: true },
            ),
            (
                r#"{"type":"drive","forward":0.5,"turn":-1}"#,
                OperatorRequest::Drive {
                    forward: 0.5,
                    turn: -1.0,
                    hand_ms: None,
                    seen: None,
                },
            ),
            (
                r#"{"type":"drive","forward":0.5,"turn":-1,"seen":12,"held_ms":40}"#,
                OperatorRequest::Drive {
                    forward: 0.5,
                    turn: -1.0,
                    hand_ms: None,
                    seen: Some(SEEN),
                },
            ),
            (
                "[12,40,0.5,-1]",
                OperatorRequest::Drive {
                    forward: 0.5,
                    turn: -1.0,
                    hand_ms: None,
                    seen: Some(SEEN),
                },
            ),
            (
                "[12,40,0.5,-1,250]",
                OperatorRequest::Drive {
                    forward: 0.5,
                    turn: -1.0,
                    hand_ms: Some(250),
                    seen: Some(SEEN),
                },
            ),
            (r#"{"type":"take_over"}"#, OperatorRequest::TakeOver),
            (r#"{"type":"drive_end"}"#, OperatorRequest::DriveEnd),
            ("[]", OperatorRequest::DriveEnd),
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
            (
                r#"{"type":"continue","mission":3}"#,
                OperatorRequest::Continue { mission: 3 },
            ),
            (r#"{"type":"stop"}"#, OperatorRequest::Stop),
        ];
        for (text, request) in requests {
            let frame = read(text).unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!(
                frame,
                Frame {
                    id: None,
                    vehicle: None,
                    press: None,
                    stops: None,
                    said: Said::OperatorRequest(request)
                },
                "{text}"
            );
        }
        let frame = read(r#"{"type":"token","token":"abc","id":7}"#).unwrap();
        let said = Said::Token {
            token: "abc".into(),
        };
        assert_eq!((frame.id, frame.said), (Some(7), said));
        for text in [r#"{"type":"seen","seen":12,"held_ms":40}"#, "[12,40]"] {
            assert_eq!(read(text).unwrap().said, Said::Seen(SEEN), "{text}");
        }
        for text in [r#"{"type":"received","seen":12}"#, "[12]"] {
            assert_eq!(
                read(text).unwrap().said,
                Said::Received { seen: 12 },
                "{text}"
            );
        }
        let frame = read(r#"{"type":"stop","vehicle":101}"#).unwrap();
        assert_eq!(frame.vehicle, Some(101));
        let frame = read(r#"{"type":"messages","on":true,"filter":{"text":"x"}}"#).unwrap();
        let filter = MessageFilter {
            text: "x".into(),
            ..MessageFilter::default()
        };
        assert_eq!(frame.said, Said::Messages { on: true, filter });
    }

    #[test]
    fn only_what_stops_or_ends_is_no_change() {
        use OperatorRequest as Request;
        for ends in [
            Request::Control { on: false },
            Request::Standby,
            Request::DriveEnd,
            Request::Stop,
            Request::Emergency { on: true },
        ] {
            assert!(ends.is_end(), "{ends:?}");
        }
        for changes in [
            Request::Control { on: true },
            Request::Resume,
            Request::TakeOver,
            Request::Continue { mission: 1 },
            Request::Emergency { on: false },
            Request::ClearAnyEmergency,
        ] {
            assert!(!changes.is_end(), "{changes:?}");
        }
    }

    #[test]
    fn a_role_may_what_its_rules_allow() {
        let rights = |authority, has_users| PageRights {
            authority,
            has_users,
        };
        let part = JausId::new(101, 3, 36);
        let (operator, grant) = (JausId::new(43, 1, 1), true);
        for (request, role) in [
            (
                OperatorRequest::Select { subsystem: 101 },
                UserRole::Observe,
            ),
            (OperatorRequest::Emergency { on: true }, UserRole::Observe),
            (
                OperatorRequest::EmergencyAll { on: true },
                UserRole::Observe,
            ),
            (OperatorRequest::Emergency { on: false }, UserRole::Drive),
            (OperatorRequest::EmergencyAll { on: false }, UserRole::Drive),
            (OperatorRequest::ClearAnyEmergency, UserRole::Administer),
            (OperatorRequest::Control { on: true }, UserRole::Drive),
            (OperatorRequest::Control { on: false }, UserRole::Drive),
            (
                OperatorRequest::Handover {
                    part,
                    operator,
                    grant,
                },
                UserRole::Drive,
            ),
            (OperatorRequest::Resume, UserRole::Drive),
            (OperatorRequest::Standby, UserRole::Drive),
            (OperatorRequest::DriveEnd, UserRole::Drive),
            (OperatorRequest::TakeOver, UserRole::Drive),
            (OperatorRequest::Approve { mission: 1 }, UserRole::Drive),
            (OperatorRequest::Continue { mission: 1 }, UserRole::Drive),
            (OperatorRequest::Stop, UserRole::Drive),
        ] {
            for authority in [0, 200, 255] {
                assert_eq!(request.needs(rights(authority, true)), role, "{request:?}");
            }
        }
        // Who has the token alone is the only user.
        let clear = OperatorRequest::ClearAnyEmergency;
        assert_eq!(clear.needs(rights(200, false)), UserRole::Drive);
    }

    #[test]
    fn an_invalid_frame_is_no_request() {
        for text in [
            "",
            "{}",
            "[[]]",
            r#"{"type":"fly"}"#,
            r#"{"type":"control"}"#,
            r#"{"type":"handover","part":"101.3.36","operator":"43","grant":true}"#,
            r#"{"type":"select","subsystem":70000}"#,
            r#"{"type":"drive","forward":"fast","turn":0}"#,
            r#"{"type":"emergency","on":true,"id":-1}"#,
            "[12,40,0.5]",
            "[12,40,0.5,0.5,0.5]",
            "[12,-1]",
            "[12,NaN,0.5,0]",
            "[12.5,1]",
        ] {
            assert!(read(text).is_err(), "{text}");
        }
    }
}
