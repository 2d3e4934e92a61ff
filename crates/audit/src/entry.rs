//! One entry of the log.

use std::fmt::Display;
use std::time::SystemTime;

use jaus::rights::{Decision, Verdict};
use serde::{Serialize, Serializer};

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
    /// What was done: the name of a message, or a word such as `login`.
    pub what: String,
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
            let entry = Self::new(&who, &decision.what, result);
            entry.id(source).to(destination)
        };
        let by_component = |what, result| {
            let why = format_args!("the component's answer: {}", decision.what);
            let entry = Self::new(&who, what, result);
            entry.id(destination).to(source).because(why)
        };
        match decision.verdict {
            Verdict::Refused(why) => by_client(Outcome::Refused).because(why),
            Verdict::Granted => by_component("control", Outcome::Allowed),
            Verdict::Denied => by_component("control", Outcome::Refused),
            Verdict::Ended => by_component("end of control", Outcome::Allowed),
            // It was passed on.
            _ => Self {
                is_free: decision.is_free,
                ..by_client(Outcome::Allowed)
            },
        }
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

    /// Whether it differs from another entry in nothing but time.
    pub(crate) fn repeats(&self, other: &Self) -> bool {
        let parts = |it: &Self| {
            let Self {
                time: _,
                who,
                what,
                to,
                result,
                why,
                id,
                address,
                key,
                times: _,
                is_free: _,
            } = it;
            (who, what, to, result, why, id, address, key)
                == (
                    &self.who,
                    &self.what,
                    &self.to,
                    &self.result,
                    &self.why,
                    &self.id,
                    &self.address,
                    &self.key,
                )
        };
        parts(other)
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
    use super::*;

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
