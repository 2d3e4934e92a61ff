//! The users file of a running station.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use jaus_files::{Followed, Readers};

use super::{User, UserRole, Users};

/// Why a users file cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum UsersError {
    /// The file cannot be read or written.
    #[error("the users file {}: {source}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The file has a malformed line.
    #[error("the users file {}, {source}", .path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The line, and what is wrong.
        source: Box<Self>,
    },
    /// A line is malformed.
    #[error("line {line}: {source}")]
    Line {
        /// Its number, from 1.
        line: usize,
        /// The reason.
        source: Box<Self>,
    },
    /// A line has not three parts.
    #[error("write a name, a role and a password hash; `jaus users add` writes such a line")]
    Parts,
    /// A text is not a user name.
    #[error(
        "`{0}` is not a user name: write 1 to {longest} letters, digits and -._@",
        longest = User::LONGEST_NAME
    )]
    Name(String),
    /// A text is not a role.
    #[error(
        "`{0}` is not a role: write {observe}, {drive} or {administer}",
        observe = UserRole::Observe,
        drive = UserRole::Drive,
        administer = UserRole::Administer
    )]
    Role(String),
    /// A text is not the hash of a password.
    #[error("it has no usable password hash; `jaus users add` makes one")]
    Password,
    /// A name appears twice.
    #[error("`{name}` is already in line {first}: remove one of them")]
    Twice {
        /// The name.
        name: String,
        /// The number of the first line.
        first: usize,
    },
    /// There are too many users.
    #[error("at most {} users are possible", Users::MOST)]
    TooMany,
    /// A user to be added exists.
    #[error("`{0}` exists: remove the user first to change the password or role")]
    Exists(String),
}

impl UsersError {
    pub(super) fn in_line(self, line: usize) -> Self {
        Self::Line {
            line,
            source: Box::new(self),
        }
    }

    pub(super) fn in_file(path: &Path, source: io::Error) -> Self {
        Self::File {
            path: path.to_owned(),
            source,
        }
    }
}

/// The longest users file, in octets.
pub(super) const LONGEST: u64 = 256 << 10;

/// The users of a running station. Clones share them.
#[derive(Clone, Debug)]
pub struct UsersFile(Followed<Users, UsersError>);

impl UsersFile {
    /// How often a station calls [`refresh`](Self::refresh).
    pub(crate) const INTERVAL: Duration = Followed::<Users, UsersError>::INTERVAL;

    /// Reads a users file.
    ///
    /// # Errors
    /// If it cannot be read, can be read by other users of this host, or has a malformed line.
    pub fn load(path: &Path) -> Result<Self, UsersError> {
        let owned = path.to_owned();
        Followed::load(vec![path.to_owned()], move || read(&owned)).map(Self)
    }

    /// The users as last read.
    #[must_use]
    pub fn users(&self) -> Arc<Users> {
        self.0.get()
    }

    /// Reads the file again if it has changed or could not be used last; returns whether the users were
    /// replaced. On an error the previous users remain, with a [`fault`](Self::fault).
    ///
    /// # Errors
    /// As [`load`](Self::load), once for each fault.
    pub fn refresh(&self) -> Result<bool, UsersError> {
        self.0.refresh()
    }

    /// Why the file could not be used last; `None` if it could. The previous users may lack a change.
    #[must_use]
    pub fn fault(&self) -> Option<Arc<str>> {
        self.0.fault()
    }
}

fn read(path: &Path) -> Result<Users, UsersError> {
    let text = jaus_files::read_text(path, Readers::Owner, LONGEST);
    let text = text.map_err(|source| UsersError::in_file(path, source))?;
    Users::parse(&text).map_err(|source| UsersError::Malformed {
        path: path.to_owned(),
        source: Box::new(source),
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::tests::user;
    use super::super::{add, remove};
    use super::*;

    #[test]
    fn a_change_of_the_file_is_noticed_and_an_unusable_one_leaves_the_users_with_a_fault() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("users");
        add(&path, &user("anna", UserRole::Drive)).unwrap();
        let file = UsersFile::load(&path).unwrap();
        assert!(!file.refresh().unwrap());
        add(&path, &user("ben", UserRole::Observe)).unwrap();
        assert!(file.refresh().unwrap());
        assert_eq!(file.users().iter().len(), 2);
        fs::write(&path, "ben\n").unwrap();
        assert!(file.refresh().is_err());
        assert!(!file.refresh().unwrap(), "an error is reported once");
        assert_eq!(file.users().iter().len(), 2);
        let fault = file.fault().unwrap();
        let named = format!("the users file {}, line 1: ", path.display());
        assert!(fault.starts_with(&named), "{fault}");
        fs::remove_file(&path).unwrap();
        assert!(file.refresh().is_err());
        add(&path, &user("carl", UserRole::Drive)).unwrap();
        assert!(file.refresh().unwrap());
        assert_eq!(file.fault(), None);
        remove(&path, "carl").unwrap();
        assert!(file.refresh().unwrap());
        assert_eq!(file.users().iter().len(), 0);
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_others_can_read_is_refused_with_the_remedy() {
        use std::os::unix::fs::PermissionsExt as _;

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("users");
        add(&path, &user("anna", UserRole::Drive)).unwrap();
        UsersFile::load(&path).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        let error = UsersFile::load(&path).unwrap_err().to_string();
        assert!(error.contains("chmod 600"), "{error}");
    }
}
