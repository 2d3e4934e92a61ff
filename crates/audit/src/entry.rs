//! One entry of the log.

use std::fmt::Display;
use std::time::SystemTime;

use jaus::rights::{Decision, Verdict};
use serde::{Serialize, Serializer};

use crate::action::Action;

/// How an action ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Outcome {
    /// It was done, or passed on to the component that decides.
    Allowed,
    /// A rule forbids it.
    Refused,
    /// It was allowed and went wrong.
    Failed,
}

/// Who did what, and with what result.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Entry {
    /// When; in the log as RFC 3339 in UTC, to the millisecond.
    #[serde(serialize_with = "rfc3339")]
    pub time: SystemTime,
    /// The name of the key or user, as this node's files know it.
    pub who: String,
    /// What was done: the words of an [`Action`], or else the name of a message.
    pub what: String,
    /// The message by which it was done, unless `what` names it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// To whom: a JAUS id, or a user.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to: Option<String>,
    /// The result.
    pub result: Outcome,
    /// The reason for the result, or details.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// The JAUS id that acted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// The network address of who acted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub address: Option<String>,
    /// The public key of who acted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub key: Option<String>,
    /// How often, if more than once.
    #[serde(skip_serializing_if = "is_once")]
    pub times: u64,
    /// Whether everybody may do it, so that it must not fill the log.
    #[serde(skip)]
    pub(crate) is_free: bool,
}

impl Entry {
    /// An entry of this moment.
    #[expect(
        clippy::disallowed_methods,
        reason = "the log records real time, whatever clock the node runs by"
    )]
    pub fn new(who: impl Display, what: impl Display, result: Outcome) -> Self {
        Self {
            time: SystemTime::now(),
            who: text(who),
            what: text(what),
            message: None,
            to: None,
            result,
            why: None,
            id: None,
            address: None,
            key: None,
            times: 1,
            is_free: false,
        }
    }

    /// The entry of a decision. `who` is the name of the key, user or network of the client: the sender
    /// of the message, or the one that a component tells something about its control.
    pub fn of(who: impl Display, decision: &Decision) -> Self {
        let (source, destination) = (decision.source, decision.destination);
        let by_client = |result| {
            let entry = Self::new(&who, Action::of_messages(&decision.what), result);
            entry.by(&decision.what).id(source).to(destination)
        };
        let by_component = |what: Action, result| {
            let entry = Self::new(&who, what, result).by(&decision.what);
            entry.id(destination).to(source)
        };
        let entry = match decision.verdict {
            Verdict::Refused(why) => by_client(Outcome::Refused).because(why),
            Verdict::Granted => by_component(Action::ControlGranted, Outcome::Allowed),
            Verdict::Denied => by_component(Action::ControlDenied, Outcome::Refused),
            Verdict::Ended => by_component(Action::ControlEnded, Outcome::Allowed),
            // It was passed on.
            _ => by_client(Outcome::Allowed),
        };
        Self {
            is_free: decision.is_free,
            ..entry
        }
    }

    /// The message by which it was done.
    fn by(mut self, message: &str) -> Self {
        self.message = (self.what != message).then(|| text(message));
        self
    }

    /// To whom it was done.
    #[must_use]
    pub fn to(mut self, whom: impl Display) -> Self {
        self.to = Some(text(whom));
        self
    }

    /// The reason for the result, or details.
    #[must_use]
    pub fn because(mut self, why: impl Display) -> Self {
        self.why = Some(text(why));
        self
    }

    /// The JAUS id that acted.
    #[must_use]
    pub fn id(mut self, id: impl Display) -> Self {
        self.id = Some(text(id));
        self
    }

    /// The network address of who acted.
    #[must_use]
    pub fn address(mut self, address: impl Display) -> Self {
        self.address = Some(text(address));
        self
    }

    /// The public key of who acted.
    #[must_use]
    pub fn key(mut self, key: impl Display) -> Self {
        self.key = Some(text(key));
        self
    }

    /// How often it happened.
    #[must_use]
    pub const fn times(mut self, times: u64) -> Self {
        self.times = times;
        self
    }

    /// Whether it shows what was done by a right: each such entry is kept, with its own time.
    pub(crate) fn is_evidence(&self) -> bool {
        self.result == Outcome::Allowed && !self.is_free
    }
}

/// A text for the log: reasons and names can be those of peers.
fn text(it: impl Display) -> String {
    jaus_text::visible(&it.to_string()).into_owned()
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn is_once(times: &u64) -> bool {
    *times == 1
}

fn rfc3339<S: Serializer>(time: &SystemTime, to: S) -> Result<S::Ok, S::Error> {
    to.collect_str(&humantime::format_rfc3339_millis(*time))
}

#[cfg(test)]
mod tests {
    use jaus::address::JausId;
    use jaus::rights::{InControl, Table};
    use jaus::wire::Frame;

    use super::*;

    #[test]
    fn control_that_is_renewed_is_no_evidence() {
        let (console, rover) = (JausId::new(60, 1, 1), JausId::new(101, 1, 1));
        let mut in_control = InControl::default();
        let mut confirm = || {
            let confirm = Frame::new(rover, console, vec![0x0F, 0, 0].into());
            in_control.told(&confirm, &Table::default()).unwrap()
        };
        assert!(Entry::of("console", &confirm()).is_evidence());
        assert!(!Entry::of("console", &confirm()).is_evidence());
    }

    #[test]
    fn every_text_of_an_entry_is_printable_and_bounded() {
        let name = format!("Müller\x1b[2J\r\n{{}}\u{202e}\u{9b}{}", "x".repeat(70_000));
        let entry = Entry::new(&name, &name, Outcome::Failed);
        let entry = entry
            .to(&name)
            .because(&name)
            .id(&name)
            .address(&name)
            .key(&name);
        let line = serde_json::to_string(&entry).unwrap();
        assert!(!line.contains(jaus_text::is_unprintable), "{line:?}");
        assert_eq!(line.matches("Müller").count(), 7);
        assert!(line.len() < 8_000, "{}", line.len());
    }
}
