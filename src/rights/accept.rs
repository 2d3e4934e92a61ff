//! Which ids may come from a side that proves no identity, and what each may do.

use std::fmt;
use std::str::FromStr;

use super::{Admitted, Refusal, RuleError, Rules, Table};
use crate::address::JausId;
use crate::as_text::serde_as_text;
use crate::wire::Frame;

/// Ids, and their rights, as text `60 control=127`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Grant {
    /// The ids, with wildcards.
    pub ids: JausId,
    /// Their rights.
    pub rules: Rules,
}

/// Why a text is no grant.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GrantError {
    /// The ids are missing or malformed.
    #[error(
        "`{0}` are no ids: write a subsystem or ids first, such as 60 or 60.255.255, and then \
         rights, such as control=127"
    )]
    Ids(String),
    /// A word is no right.
    #[error(transparent)]
    Rule(#[from] RuleError),
    /// The emergencies of others can be cleared over a secure link alone.
    #[error(
        "`clear-emergency=any` has no effect on plain links, where ids are not proven: write `clear-emergency` \
         in the grant `{0}`, or use a secure link"
    )]
    ClearAny(String),
}

impl FromStr for Grant {
    type Err = GrantError;

    /// Reads ids and then rights, separated by white space, as in `60 control=127`. The rights are
    /// the words of [`Rules`].
    fn from_str(text: &str) -> Result<Self, GrantError> {
        let text = text.trim();
        let (ids, rules) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let rules = rules.parse()?;
        Ok(Self {
            ids: one_or_more(ids).ok_or_else(|| GrantError::Ids(ids.chars().take(60).collect()))?,
            rules,
        })
    }
}

/// Reads an id with wildcards, or the number of a subsystem for all of its components.
fn one_or_more(text: &str) -> Option<JausId> {
    let subsystem = text.parse().ok();
    let all_of = |subsystem| JausId::new(subsystem, JausId::ANY_NODE, JausId::ANY_COMPONENT);
    let ids = subsystem.map_or_else(|| text.parse().ok(), |it| Some(all_of(it)))?;
    (!ids.has_zero()).then_some(ids)
}

impl fmt::Display for Grant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.ids, self.rules)
    }
}

/// The ids that are accepted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Acceptance(Vec<Grant>);

/// The most grants.
const MOST_GRANTS: usize = 256;

impl Default for Acceptance {
    /// All ids, which may observe, but set no emergency: nobody has named them.
    fn default() -> Self {
        Self(vec![Grant {
            ids: JausId::EVERYONE,
            rules: Rules::watch(),
        }])
    }
}

/// Why a message is not accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, thiserror::Error)]
pub enum Unaccepted {
    /// Its source is in no grant.
    #[error("its source is not accepted")]
    Source,
    /// The rights of its source forbid it.
    #[error(transparent)]
    Rule(Refusal),
}

impl Acceptance {
    /// Accepts the ids of these grants alone. The first one that an id matches counts. Grants after
    /// the 256th are ignored.
    #[must_use]
    pub fn new(grants: impl IntoIterator<Item = Grant>) -> Self {
        Self(grants.into_iter().take(MOST_GRANTS).collect())
    }

    /// Whether messages of this component are accepted at all.
    #[must_use]
    pub fn accepts(&self, id: JausId) -> bool {
        grant_of(&self.0, id).is_some()
    }

    /// Whether no id may do more than [`Rules::watch`] allows, so that nothing is gained by the id of
    /// another one.
    #[must_use]
    pub fn only_watches(&self) -> bool {
        self.0.iter().all(|grant| grant.rules.only_watch())
    }

    /// Whether a grant names this id, instead of everybody, and lets it do more than [`Rules::watch`] allows.
    #[must_use]
    pub fn trusts(&self, id: JausId) -> bool {
        let is_trust = |it: &Grant| it.ids != JausId::EVERYONE && !it.rules.only_watch();
        grant_of(&self.0, id).is_some_and(is_trust)
    }

    /// Checks a message; the table tells what it needs.
    ///
    /// # Errors
    /// Why it is not accepted.
    pub fn check(&self, frame: &Frame, table: &Table) -> Result<(), Unaccepted> {
        let grant = grant_of(&self.0, frame.source).ok_or(Unaccepted::Source)?;
        grant.rules.check(frame, table).map_err(Unaccepted::Rule)
    }

    /// Checks a message as [`check`](Self::check), and says to which ids it may go.
    ///
    /// # Errors
    /// Why it is not accepted.
    pub fn admit(&self, frame: &Frame, table: &Table) -> Result<Admitted, Unaccepted> {
        admit(&self.0, frame, table)
    }

    /// Checks the names in the rights of all grants: see [`Rules::verify`].
    ///
    /// # Errors
    /// The first grant with a name that is wrong.
    pub fn verify(&self, table: &Table) -> Result<(), RuleError> {
        self.0.iter().try_for_each(|it| it.rules.verify(table))
    }

    /// The ids to subscribe to: none is part of another.
    #[must_use]
    pub fn patterns(&self) -> Vec<JausId> {
        let ids: Vec<_> = self.0.iter().map(|grant| grant.ids).collect();
        widest(&ids)
    }
}

/// Those of some ids with wildcards that are part of no other.
pub(super) fn widest(ids: &[JausId]) -> Vec<JausId> {
    let covers = |wide: JausId, narrow: JausId| wide.intersection(narrow) == Some(narrow);
    let is_needed = |&(at, id): &(usize, JausId)| {
        let others = ids.iter().enumerate().filter(|&(other, _)| other != at);
        // Of two equal ones the first is needed.
        !others
            .into_iter()
            .any(|(other, &wide)| covers(wide, id) && (wide != id || other < at))
    };
    let needed = ids.iter().copied().enumerate().filter(is_needed);
    needed.map(|(_, id)| id).collect()
}

/// The first grant that an id matches.
fn grant_of(grants: &[Grant], id: JausId) -> Option<&Grant> {
    grants.iter().find(|grant| grant.ids.matches(id))
}

/// Checks a message by the first of these grants that its source matches, and says to which ids it may go.
pub(crate) fn admit(
    grants: &[Grant],
    frame: &Frame,
    table: &Table,
) -> Result<Admitted, Unaccepted> {
    let grant = grant_of(grants, frame.source).ok_or(Unaccepted::Source)?;
    grant.rules.admit(frame, table).map_err(Unaccepted::Rule)
}

serde_as_text!(Grant);

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;

    fn acceptance(grants: &[&str]) -> Acceptance {
        Acceptance::new(grants.iter().map(|text| text.parse().unwrap()))
    }

    fn frame(source: JausId, payload: &'static [u8]) -> Frame {
        Frame::new(source, JausId::new(101, 1, 33), Bytes::from_static(payload))
    }

    const OPERATOR: JausId = JausId::new(60, 1, 1);
    const QUERY: &[u8] = b"\x04\x24\xFF\xFF";
    const RESUME: &[u8] = b"\x04\x00";
    const REQUEST_CONTROL: &[u8] = b"\x0D\x00\x64";
    const SET_EMERGENCY: &[u8] = b"\x06\x00\x01\x00";

    #[test]
    fn without_grants_everybody_may_observe_and_nobody_may_command_or_set_an_emergency() {
        let all = Acceptance::default();
        assert_eq!(
            all.check(&frame(OPERATOR, QUERY), &Table::default()),
            Ok(())
        );
        for command in [RESUME, REQUEST_CONTROL, SET_EMERGENCY] {
            let refused = all.check(&frame(OPERATOR, command), &Table::default());
            assert!(matches!(refused, Err(Unaccepted::Rule(_))), "{refused:?}");
        }
    }

    #[test]
    fn a_grant_gives_its_ids_its_rights_and_excludes_all_others() {
        let some = acceptance(&["60.1.1 control=127", "60 observe"]);
        assert_eq!(
            some.check(&frame(OPERATOR, REQUEST_CONTROL), &Table::default()),
            Ok(())
        );
        let colleague = JausId::new(60, 2, 1);
        assert_eq!(
            some.check(&frame(colleague, QUERY), &Table::default()),
            Ok(())
        );
        assert_eq!(
            some.check(&frame(colleague, SET_EMERGENCY), &Table::default()),
            Ok(())
        );
        let refused = some.check(&frame(colleague, REQUEST_CONTROL), &Table::default());
        assert_eq!(refused, Err(Unaccepted::Rule(Refusal::Control)));
        let stranger = JausId::new(61, 1, 1);
        assert_eq!(
            some.check(&frame(stranger, QUERY), &Table::default()),
            Err(Unaccepted::Source)
        );
    }

    #[test]
    fn a_malformed_grant_is_refused_with_an_example() {
        for text in ["", "0", "60.1", "rover control=1", "60.0.1", "70000"] {
            let error = text.parse::<Grant>().unwrap_err().to_string();
            assert!(error.contains("60.255.255"), "{text}: {error}");
        }
        let error = "60 drive".parse::<Grant>().unwrap_err().to_string();
        assert!(error.contains("control=AUTHORITY"), "{error}");
    }

    #[test]
    fn a_grant_that_lets_an_id_do_anything_is_told_from_those_that_let_it_watch() {
        assert!(Acceptance::default().only_watches());
        assert!(acceptance(&["60 except=SetEmergency", "61 except=0006h"]).only_watches());
        for more in [
            "60 observe",
            "60 except=SetEmergency command",
            "60 except=SetEmergency control=0",
            "60 except=SetEmergency clear-emergency",
            "60 except=SetEmergency configure",
            "60 except=SetEmergency also=D103h",
        ] {
            let both = acceptance(&["61 except=SetEmergency", more]);
            assert!(!both.only_watches(), "{more}");
            assert!(both.trusts(OPERATOR), "{more}");
            assert!(!both.trusts(JausId::new(61, 1, 1)), "{more}");
        }
        let all = acceptance(&["65535.255.255 observe"]);
        assert!(
            !all.only_watches() && !all.trusts(OPERATOR),
            "nobody is named"
        );
    }

    #[test]
    fn no_message_is_subscribed_to_twice() {
        let some = acceptance(&["60.1.1 command", "60", "60", "61.1.1"]);
        let patterns = some.patterns();
        let expected = ["60.255.255", "61.1.1"].map(|id| id.parse().unwrap());
        assert_eq!(patterns, expected);
        assert_eq!(Acceptance::default().patterns(), [JausId::EVERYONE]);
    }
}
