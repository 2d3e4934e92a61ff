//! Users of the host whose programs may attach, and their rights.

use std::fmt;
use std::str::FromStr;

use crate::address::JausId;
use crate::as_text::serde_as_text;
use crate::rights::{Grant, GrantError, RuleError, Rules, Table};

/// Any user that may connect.
const ANY: &str = "*";

/// A user of the host and what its programs may do that attach to the node, as text
/// `planner control=255`, or with the ids that they may have: `camera 101.1.40 observe`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LocalUser {
    /// Its name or number; `*` means any.
    name: String,
    grant: Grant,
}

/// Why a text names no user with rights.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LocalUserError {
    /// No user.
    #[error(
        "a user of this host is missing: write its name or number, or * for any, and then what its programs \
         may do, such as `camera observe`"
    )]
    Name,
    /// No rights; without this, a forgotten word would mean `observe`.
    #[error("what may the programs of {0} do? Write rights behind the name, such as `{0} observe`")]
    NoRights(String),
    /// The ids or rights are wrong.
    #[error(transparent)]
    Grant(#[from] GrantError),
}

impl LocalUser {
    /// Whether it means the user with this number and this name, as far as they are known.
    #[must_use]
    pub fn is(&self, uid: Option<u32>, name: Option<&str>) -> bool {
        let number = self.name.parse().ok();
        self.name == ANY || Some(&*self.name) == name || (number.is_some() && number == uid)
    }

    /// Whether its programs may use this id.
    #[must_use]
    pub fn may_use(&self, id: JausId) -> bool {
        self.grant.ids.matches(id)
    }

    /// The ids that its programs may use, with wildcards.
    #[must_use]
    pub const fn ids(&self) -> JausId {
        self.grant.ids
    }

    /// What its programs may send.
    #[must_use]
    pub const fn rules(&self) -> &Rules {
        &self.grant.rules
    }

    pub(super) fn verify(&self, table: &Table) -> Result<(), RuleError> {
        self.grant.rules.verify(table)
    }
}

impl FromStr for LocalUser {
    type Err = LocalUserError;

    fn from_str(text: &str) -> Result<Self, LocalUserError> {
        let mut words = text.split_whitespace().peekable();
        let name = words.next().ok_or(LocalUserError::Name)?.to_owned();
        if name.parse::<JausId>().is_ok() {
            return Err(LocalUserError::Name);
        }
        let ids = words.next_if(|word| word.starts_with(|it: char| it.is_ascii_digit()));
        if words.peek().is_none() {
            return Err(LocalUserError::NoRights(name));
        }
        let everyone = JausId::EVERYONE.to_string();
        let ids = ids.unwrap_or(&everyone);
        let rights = words.collect::<Vec<_>>().join(" ");
        let grant = format!("{ids} {rights}").parse()?;
        Ok(Self { name, grant })
    }
}

impl fmt::Display for LocalUser {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, grant } = self;
        write!(f, "{name}")?;
        if grant.ids != JausId::EVERYONE {
            write!(f, " {}", grant.ids)?;
        }
        match grant.rules.to_string() {
            none if none.is_empty() => f.write_str(" observe"),
            rights => write!(f, " {rights}"),
        }
    }
}

serde_as_text!(LocalUser);

#[cfg(test)]
mod tests {
    use super::*;

    fn user(text: &str) -> LocalUser {
        text.parse().unwrap()
    }

    #[test]
    fn a_user_is_known_by_name_or_number() {
        let camera = user("jaus-camera 101.1.40 observe");
        let uid = Some(995);
        assert!(camera.is(uid, Some("jaus-camera")) && !camera.is(uid, None));
        assert!(!camera.is(uid, Some("jaus-camera-2")) && !camera.is(None, None));
        let number = user("995 observe");
        assert!(number.is(uid, None) && !number.is(Some(99), None) && !number.is(None, None));
        assert!(user("* observe").is(Some(1), None) && user("* observe").is(None, None));
    }

    #[test]
    fn ids_may_be_left_out_and_rights_may_not() {
        let (some, all) = (user("cam 101.1.40 observe"), user("cam control=127"));
        let (own, other) = (JausId::new(101, 1, 40), JausId::new(101, 1, 41));
        assert!(some.may_use(own) && !some.may_use(other) && all.may_use(other));
        assert_eq!(all.rules().control, Some(127));
        for text in ["cam 101.1.40 observe", "cam control=127"] {
            assert_eq!(user(&user(text).to_string()), user(text));
        }
        for (text, expected) in [
            ("", "is missing"),
            ("101.1.40 observe", "is missing"),
            ("cam", "`cam observe`"),
            ("cam 101.1.40", "`cam observe`"),
            ("cam 101.1 observe", "60.255.255"),
            ("cam drive", "control=AUTHORITY"),
        ] {
            let error = text.parse::<LocalUser>().unwrap_err().to_string();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
