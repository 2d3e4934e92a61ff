//! The words of the log.

use std::fmt::{self, Write as _};

/// What was done. The words are the same for a client that sends a message, a user of the page, and a
/// component that answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "their names are the words")]
pub enum Action {
    Connect,
    Disconnect,
    Login,
    Logout,
    SessionEnded,
    VehicleSelected,
    ControlRequested,
    ControlGranted,
    ControlDenied,
    ControlReleased,
    ControlEnded,
    HandoverAnswered,
    EmergencySet,
    EmergencyCleared,
    Resume,
    Standby,
    Drive,
    MissionPlanned,
    MissionApproved,
    MissionContinued,
    MissionStopped,
    /// Entries are missing.
    EntriesLost,
}

impl Action {
    /// What a client does by the message with this name.
    fn by(message: &str) -> Option<Self> {
        Some(match message {
            "RequestControl" | "RequestHandoff" => Self::ControlRequested,
            "ReleaseControl" => Self::ControlReleased,
            "ConfirmReleaseControl" => Self::HandoverAnswered,
            "SetEmergency" => Self::EmergencySet,
            "ClearEmergency" => Self::EmergencyCleared,
            "Resume" => Self::Resume,
            "Standby" => Self::Standby,
            "SetWrenchEffort" => Self::Drive,
            "SetDestination" => Self::MissionPlanned,
            "ApproveMission" => Self::MissionApproved,
            "ContinueMission" => Self::MissionContinued,
            "StopMission" => Self::MissionStopped,
            _ => return None,
        })
    }

    /// The words for the messages of a decision, such as `RequestControl, Shutdown in SetElement`. Others
    /// keep their names.
    pub(crate) fn of_messages(messages: &str) -> String {
        let (names, _) = messages.split_once(" in ").unwrap_or((messages, ""));
        let words = names.split(' ').map(|word| {
            let name = word.trim_end_matches(',');
            let action = Self::by(name).map(|it| it.to_string());
            action.map_or_else(|| word.to_owned(), |it| word.replace(name, &it))
        });
        words.collect::<Vec<_>>().join(" ")
    }
}

/// The words of its name: `control requested`.
impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, letter) in format!("{self:?}").char_indices() {
            if index > 0 && letter.is_ascii_uppercase() {
                f.write_char(' ')?;
            }
            f.write_char(letter.to_ascii_lowercase())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_have_the_words_of_what_they_do_and_others_their_names() {
        for (messages, words) in [
            ("RequestControl in CreateEvent", "control requested"),
            (
                "RequestHandoff, Shutdown in SetElement",
                "control requested, Shutdown",
            ),
            (
                "ClearEmergency of all clients",
                "emergency cleared of all clients",
            ),
            (
                "DA00h, SetEmergency and 5 others in SetElement",
                "DA00h, emergency set and 5 others",
            ),
        ] {
            assert_eq!(Action::of_messages(messages), words);
        }
    }
}
