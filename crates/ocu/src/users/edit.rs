//! Changes of a users file: a user is added or removed, and the rest of the file stays as it is.

use std::path::Path;

use jaus_files::{Readers, edit};

use super::file::LONGEST;
use super::{User, Users, UsersError};

/// Adds a user to a users file, which is created for its owner alone if necessary.
///
/// # Errors
/// If the file cannot be read or written, has a malformed line, or has a user of this name.
pub fn add(path: &Path, user: &User) -> Result<(), UsersError> {
    if !user.has_valid_name() {
        return Err(UsersError::Name(user.name.clone()));
    }
    change(path, |text| {
        if Users::parse(text)?.find(&user.name).is_some() {
            return Err(UsersError::Exists(user.name.clone()));
        }
        let end = if text.is_empty() || text.ends_with('\n') {
            ""
        } else {
            "\n"
        };
        let changed = [text, end, &user.line()].concat();
        Users::parse(&changed)?;
        Ok(Some(changed))
    })?;
    Ok(())
}

/// Removes a user from a users file; returns whether the user was there. A running station ends
/// the user's sessions within a second.
///
/// # Errors
/// If the file cannot be read or written, or has a malformed line.
pub fn remove(path: &Path, name: &str) -> Result<bool, UsersError> {
    change(path, |text| {
        if Users::parse(text)?.find(name).is_none() {
            return Ok(None);
        }
        let is_of_name = |line: &&str| line.split_whitespace().next() == Some(name);
        let rest = text.lines().filter(|line| !is_of_name(line));
        Ok(Some(rest.flat_map(|line| [line, "\n"]).collect()))
    })
}

fn change(
    path: &Path,
    change: impl FnOnce(&str) -> Result<Option<String>, UsersError>,
) -> Result<bool, UsersError> {
    let failed = |source| UsersError::in_file(path, source);
    edit(path, Readers::Owner, LONGEST, failed, change)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::tests::user;
    use super::super::{UserRole, UsersFile};
    use super::*;

    #[test]
    fn users_are_added_and_removed_and_comments_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("users");
        jaus_files::replace(&path, Readers::Owner, b"# our team").unwrap();
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

    #[test]
    fn users_that_are_added_at_once_are_all_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("users");
        std::thread::scope(|scope| {
            for number in 0..12 {
                let (path, user) = (&path, user(&format!("user-{number}"), UserRole::Drive));
                scope.spawn(move || add(path, &user).unwrap());
            }
        });
        assert_eq!(UsersFile::load(&path).unwrap().users().iter().len(), 12);
    }

    #[cfg(unix)]
    #[test]
    fn root_changes_the_users_of_a_service_which_still_reads_them() {
        use std::os::unix::fs::{MetadataExt as _, chown};

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("users");
        add(&path, &user("anna", UserRole::Administer)).unwrap();
        if chown(&path, Some(65534), Some(65534)).is_err() {
            return eprintln!("SKIPPED: only root can give a file to another user");
        }
        add(&path, &user("ben", UserRole::Drive)).unwrap();
        remove(&path, "anna").unwrap();
        let found = fs::metadata(&path).unwrap();
        assert_eq!(
            (found.uid(), found.gid(), found.mode() & 0o777),
            (65534, 65534, 0o600)
        );
    }
}
