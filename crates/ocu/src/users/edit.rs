//! Changes of a users file: a user is added or removed, and the rest of the file stays as it is.

use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::path::Path;

use super::{User, Users, UsersError};

/// Adds a user to a users file, which is created for its owner alone if necessary.
///
/// # Errors
/// If the file cannot be read or written, has a malformed line, or has a user of this name.
pub fn add(path: &Path, user: &User) -> Result<(), UsersError> {
    if !user.has_valid_name() {
        return Err(UsersError::Name(user.name.clone()));
    }
    let mut text = text_of(path)?;
    if Users::parse(&text)?.find(&user.name).is_some() {
        return Err(UsersError::Exists(user.name.clone()));
    }
    if !text.is_empty() && !text.ends_with('\n') {
        text.push('\n');
    }
    text.push_str(&user.line());
    Users::parse(&text)?;
    replace(path, &text)
}

/// Removes a user from a users file; returns whether the user was there. A running station ends
/// the user's sessions within seconds.
///
/// # Errors
/// If the file cannot be read or written, or has a malformed line.
pub fn remove(path: &Path, name: &str) -> Result<bool, UsersError> {
    let text = text_of(path)?;
    if Users::parse(&text)?.find(name).is_none() {
        return Ok(false);
    }
    let names = |line: &&str| line.split_whitespace().next() == Some(name);
    let rest = text.lines().filter(|line| !names(line));
    let rest: String = rest.flat_map(|line| [line, "\n"]).collect();
    replace(path, &rest)?;
    Ok(true)
}

fn text_of(path: &Path) -> Result<String, UsersError> {
    match fs::read_to_string(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(String::new()),
        other => other.map_err(|source| UsersError::in_file(path, source)),
    }
}

/// Replaces a file in one step, so that a station reads the old or the new text. It is for its owner
/// alone.
pub(crate) fn replace(path: &Path, text: &str) -> Result<(), UsersError> {
    let draft = path.with_extension("new");
    let write = || -> io::Result<()> {
        let mut options = OpenOptions::new();
        options.write(true).create(true).truncate(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let mut file = options.open(&draft)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        fs::rename(&draft, path)
    };
    write().map_err(|source| UsersError::in_file(path, source))
}

#[cfg(test)]
mod tests {
    use super::super::tests::user;
    use super::super::{UserRole, UsersFile};
    use super::*;

    #[test]
    fn users_are_added_and_removed_and_comments_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("users");
        replace(&path, "# our team").unwrap();
        add(&path, &user("anna", UserRole::Administer)).unwrap();
        add(&path, &user("ben", UserRole::Drive)).unwrap();
        let names = || {
            let users = UsersFile::load(&path).unwrap().users();
            let names: Vec<_> = users.iter().map(|it| it.name.clone()).collect();
            names
        };
        assert_eq!(names(), ["anna", "ben"]);
        assert!(remove(&path, "anna").unwrap());
        assert!(!remove(&path, "anna").unwrap());
        assert_eq!(names(), ["ben"]);
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("# our team\nben "), "{text}");
    }

    #[test]
    fn a_change_that_would_make_the_file_unusable_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("users");
        add(&path, &user("anna", UserRole::Drive)).unwrap();
        let before = fs::read_to_string(&path).unwrap();
        for name in ["anna", "", "two words", "#ben", &"x".repeat(33)] {
            assert!(add(&path, &user(name, UserRole::Drive)).is_err(), "{name}");
        }
        assert_eq!(fs::read_to_string(&path).unwrap(), before);
    }
}
