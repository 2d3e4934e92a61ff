//! The users of the page, and what each of them may do.
//!
//! A users file has a line for each user: a name, a role, and the hash of the password, which
//! `jaus users add` makes.
//!
//! ```text
//! # name  role        password
//! anna    administer  $argon2id$v=19$m=19456,t=2,p=1$…
//! ben     drive       $argon2id$v=19$m=19456,t=2,p=1$…
//! ```

mod edit;
mod file;
mod password;

use std::fmt;
use std::str::FromStr;

use jaus::rights::Rules;
use serde::Serialize;

pub use self::edit::{add, remove};
pub use self::file::{UsersError, UsersFile};
pub use self::password::{PasswordError, PasswordHash};

/// What a user may do; each role includes those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum UserRole {
    /// See everything, and change nothing.
    Observe,
    /// Take control of vehicles, drive them, and send them on missions.
    Drive,
    /// See who is logged in, and end their sessions.
    Administer,
}

impl UserRole {
    /// All roles, from the least to the most.
    pub const ALL: [Self; 3] = [Self::Observe, Self::Drive, Self::Administer];

    /// What users of this role may send through a station, in the words of the permission table.
    pub(crate) fn rules(self, rights: PageRights) -> Rules {
        let mut rules = Rules::default();
        if self >= Self::Drive {
            rules.control = Some(rights.authority);
            rules.clear_emergency = true;
        }
        // Who has the token alone is the only user.
        rules.clear_any_emergency =
            self >= Self::Administer || self >= Self::Drive && !rights.has_users;
        rules
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Observe => "observe",
            Self::Drive => "drive",
            Self::Administer => "administer",
        }
    }
}

impl fmt::Display for UserRole {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for UserRole {
    type Err = UsersError;

    fn from_str(text: &str) -> Result<Self, UsersError> {
        let known = Self::ALL.into_iter().find(|it| it.name() == text);
        known.ok_or_else(|| UsersError::Role(text.chars().take(40).collect()))
    }
}

/// What a station gives its roles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PageRights {
    /// The authority with which it takes control.
    pub(crate) authority: u8,
    /// Whether users log in; else there is one, who has the token.
    pub(crate) has_users: bool,
}

/// A user of the page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct User {
    /// The name: 1 to 32 letters, digits and `-._@`.
    pub name: String,
    /// What the user may do.
    pub role: UserRole,
    /// The hash of the password.
    pub password: PasswordHash,
}

impl User {
    /// The longest name, in characters.
    pub const LONGEST_NAME: usize = 32;

    fn has_valid_name(&self) -> bool {
        let plain = |it: u8| it.is_ascii_alphanumeric() || b"-._@".contains(&it);
        (1..=Self::LONGEST_NAME).contains(&self.name.len()) && self.name.bytes().all(plain)
    }

    /// The user's line in a users file.
    fn line(&self) -> String {
        let Self {
            name,
            role,
            password,
        } = self;
        format!("{name} {role} {}\n", password.as_str())
    }
}

/// The users of a station.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Users(Vec<User>);

impl Users {
    /// The most users of a file.
    pub const MOST: usize = 256;

    /// Users that are not in a file.
    #[must_use]
    pub const fn of(users: Vec<User>) -> Self {
        Self(users)
    }

    /// Reads the text of a users file.
    ///
    /// # Errors
    /// The first line that is malformed.
    pub fn parse(text: &str) -> Result<Self, UsersError> {
        let mut users: Vec<(usize, User)> = Vec::new();
        for (index, text) in text.lines().enumerate() {
            let line = index + 1;
            let text = text.split('#').next().unwrap_or_default().trim();
            if text.is_empty() {
                continue;
            }
            let user = parse_line(text).map_err(|error| error.in_line(line))?;
            if let Some(&(first, _)) = users.iter().find(|(_, it)| it.name == user.name) {
                let name = user.name;
                return Err(UsersError::Twice { name, first }.in_line(line));
            }
            if users.len() == Self::MOST {
                return Err(UsersError::TooMany.in_line(line));
            }
            users.push((line, user));
        }
        Ok(Self(users.into_iter().map(|(_, user)| user).collect()))
    }

    /// The user with this name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<&User> {
        self.0.iter().find(|user| user.name == name)
    }

    /// All users, in the order of the file.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &User> {
        self.0.iter()
    }
}

fn parse_line(text: &str) -> Result<User, UsersError> {
    let parts: Vec<_> = text.split_whitespace().collect();
    let [name, role, password] = parts[..] else {
        return Err(UsersError::Parts);
    };
    let user = User {
        name: name.to_owned(),
        role: role.parse()?,
        password: PasswordHash::parse(password).ok_or(UsersError::Password)?,
    };
    if !user.has_valid_name() {
        return Err(UsersError::Name(name.chars().take(40).collect()));
    }
    Ok(user)
}

#[cfg(test)]
pub(crate) mod tests {
    use std::sync::LazyLock;

    use super::*;

    /// Hashing takes long in a test.
    pub(crate) const PASSWORD: &str = "correct horse battery";
    static HASH: LazyLock<PasswordHash> = LazyLock::new(|| PasswordHash::of(PASSWORD).unwrap());

    /// A user whose password is [`PASSWORD`].
    pub(crate) fn user(name: &str, role: UserRole) -> User {
        User {
            name: name.to_owned(),
            role,
            password: HASH.clone(),
        }
    }

    pub(crate) fn users(users: &[(&str, UserRole)]) -> Users {
        Users::of(users.iter().map(|(name, role)| user(name, *role)).collect())
    }

    #[test]
    fn each_line_names_a_user_a_role_and_a_hash() {
        let [anna, ben] = [
            user("anna", UserRole::Administer),
            user("ben@hq", UserRole::Observe),
        ];
        let text = format!("# the team\n\n{}{}", anna.line(), ben.line());
        let users = Users::parse(&text).unwrap();
        assert_eq!(users.find("anna"), Some(&anna));
        assert_eq!(users.find("ben@hq"), Some(&ben));
        assert_eq!(users.find("Anna"), None);
        assert_eq!(users.iter().len(), 2);
    }

    #[test]
    fn a_role_includes_those_before_it() {
        assert!(UserRole::Observe < UserRole::Drive && UserRole::Drive < UserRole::Administer);
        for role in UserRole::ALL {
            assert_eq!(role.to_string().parse::<UserRole>().unwrap(), role);
        }
    }

    #[test]
    fn a_malformed_line_is_named_with_the_remedy() {
        let line = user("anna", UserRole::Drive).line();
        let twice = line.clone() + &line;
        let many: String = (0..=Users::MOST)
            .map(|it| user(&format!("user{it}"), UserRole::Drive).line())
            .collect();
        for (text, words) in [
            ("anna", "line 1: write a name, a role and a password hash"),
            (&*line.replace("drive", "fly"), "`fly` is not a role"),
            (
                &*line.replace("anna", "an/na"),
                "`an/na` is not a user name",
            ),
            (&*line.replace("argon2id", "md5"), "no usable password hash"),
            (&*twice, "line 2: `anna` is already in line 1"),
            (&*many, "line 257: at most 256 users"),
        ] {
            let error = Users::parse(text).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
