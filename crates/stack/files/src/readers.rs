//! Who may read a file, and the check of its mode and folder.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

/// Who may read a file besides root. Only its owner may change it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Readers {
    /// Its owner alone: keys, tokens, password hashes, audit logs. Mode 0600.
    Owner,
    /// Its owner and group: recordings and logs of traffic. Mode 0640.
    Group,
    /// Every user of the host: trusted keys and certificates. Mode 0644.
    Everyone,
}

impl Readers {
    /// The mode of a new file, which the umask may narrow.
    pub(crate) const fn mode(self) -> u32 {
        match self {
            Self::Owner => 0o600,
            Self::Group => 0o640,
            Self::Everyone => 0o644,
        }
    }
}

/// Whose files may be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Owners {
    /// Those of root and of this process's user, because the process does what they say.
    Own,
    /// Those of every user: the file is changed for its owner, who keeps it.
    Any,
}

/// Reads a file of at most `longest` octets that only `readers` can read, and that nobody but root and the
/// user of this process can change.
///
/// # Errors
/// If the file cannot be read or is longer; [`io::ErrorKind::PermissionDenied`] if other users of the host
/// can read it, change it, or replace it because its folder is theirs or they can write it.
pub fn read(path: &Path, readers: Readers, longest: u64) -> io::Result<Vec<u8>> {
    read_from(path, readers, longest, Owners::Own)
}

fn read_from(path: &Path, readers: Readers, longest: u64, owners: Owners) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    check(path, &file, readers, owners)?;
    // As large as needed, for growth would leave copies of a secret in memory. A pipe, such as
    // `<(pass show token)` of a shell, has no length beforehand.
    let length = file.metadata()?.len().min(longest) + 1;
    let mut octets = Vec::with_capacity(usize::try_from(length).unwrap_or_default());
    file.take(longest + 1).read_to_end(&mut octets)?;
    if octets.len() as u64 > longest {
        let text = format!("it is longer than {longest} octets");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, text));
    }
    Ok(octets)
}

/// Reads a text file; otherwise as [`read`].
///
/// # Errors
/// As [`read`]; [`io::ErrorKind::InvalidData`] if it is not UTF-8.
pub fn read_text(path: &Path, readers: Readers, longest: u64) -> io::Result<String> {
    read_text_from(path, readers, longest, Owners::Own)
}

pub(crate) fn read_text_from(
    path: &Path,
    readers: Readers,
    longest: u64,
    owners: Owners,
) -> io::Result<String> {
    String::from_utf8(read_from(path, readers, longest, owners)?)
        .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
}

/// Checks the open file, so that what is read is what was checked.
#[cfg(unix)]
fn check(path: &Path, file: &File, readers: Readers, owners: Owners) -> io::Result<()> {
    use std::os::unix::fs::MetadataExt as _;

    let found = file.metadata()?;
    let mode = found.mode() & 0o777;
    let excess = mode & 0o066 & !readers.mode();
    if excess & 0o004 == 0 && is_credential(path, std::env::var_os("CREDENTIALS_DIRECTORY")) {
        return Ok(());
    }
    let name = path.display();
    if excess & 0o044 != 0 {
        return denied(format!(
            "other users of this host can read it (mode {mode:03o}): run `chmod 600 {name}`, and replace \
             the secret if they may have read it"
        ));
    }
    if excess != 0 {
        let narrowed = if readers == Readers::Owner {
            "600"
        } else {
            "go-w"
        };
        return denied(format!(
            "other users of this host can change it (mode {mode:03o}): check its content, then run `chmod \
             {narrowed} {name}`"
        ));
    }
    check_owner(&found, owners, "it", path)?;
    // A link may be in another folder than the file.
    let real = path.canonicalize().ok();
    for folder in [Some(path), real.as_deref()].into_iter().flatten() {
        let folder = folder_of(folder);
        let found = folder.metadata()?;
        check_owner(&found, owners, "its folder", folder)?;
        let mode = found.mode() & 0o7777;
        // In a sticky folder, such as /tmp, only its owner replaces a file.
        if mode & 0o022 != 0 && mode & 0o1000 == 0 {
            let folder = folder.display();
            return denied(format!(
                "other users of this host can replace it, because they can write its folder (mode \
                 {mode:03o}): check its content, then run `chmod go-w {folder}`"
            ));
        }
    }
    Ok(())
}

/// Checks whose a file or folder is, because its owner can change it whatever its mode.
#[cfg(unix)]
fn check_owner(
    found: &std::fs::Metadata,
    owners: Owners,
    what: &str,
    path: &Path,
) -> io::Result<()> {
    use std::os::unix::fs::MetadataExt as _;

    let (owner, own) = (found.uid(), rustix::process::geteuid().as_raw());
    if owners == Owners::Any || [0, own].contains(&owner) {
        return Ok(());
    }
    denied(format!(
        "{what} belongs to user {owner}, who can change it, and not to this user ({own}) or root: run this \
         as that user, or check the content, then run `chown {own} {}`",
        path.display()
    ))
}

#[cfg(unix)]
fn denied(text: String) -> io::Result<()> {
    Err(io::Error::new(io::ErrorKind::PermissionDenied, text))
}

/// Whether systemd has put the file into the folder of this service's credentials. There an access control
/// list lets the service's user alone read it, and the mode shows its mask as the rights of the group.
#[cfg(unix)]
fn is_credential(path: &Path, folder: Option<std::ffi::OsString>) -> bool {
    use std::os::unix::fs::MetadataExt as _;

    let Some(folder) = folder.filter(|it| path.parent() == Some(Path::new(it))) else {
        return false;
    };
    let is_guarded = |it: std::fs::Metadata| it.uid() == 0 && it.mode() & 0o022 == 0;
    let plain = path.symlink_metadata().ok().filter(|it| it.is_file());
    plain.is_some_and(is_guarded) && Path::new(&folder).metadata().is_ok_and(is_guarded)
}

#[cfg(not(unix))]
fn check(_: &Path, _: &File, _: Readers, _: Owners) -> io::Result<()> {
    Ok(())
}

/// The folder of a file: `.` for a bare name.
pub(crate) fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|it| !it.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

#[cfg(all(test, unix))]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    fn set_mode(path: &Path, mode: u32) {
        assert!(fs::set_permissions(path, fs::Permissions::from_mode(mode)).is_ok());
    }

    #[test]
    fn a_secret_is_its_owners_and_what_is_trusted_is_changed_by_its_owner_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "content").unwrap();
        let denied = |readers, mode, remedy: &str| {
            set_mode(&path, mode);
            let error = read(&path, readers, 100).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::PermissionDenied);
            assert!(error.to_string().contains(remedy), "{error}");
        };
        for mode in [0o640, 0o604, 0o620, 0o644, 0o666] {
            denied(Readers::Owner, mode, "chmod 600 /");
        }
        for mode in [0o664, 0o646, 0o666] {
            denied(Readers::Everyone, mode, "chmod go-w /");
        }
        for (readers, mode) in [
            (Readers::Owner, 0o600),
            (Readers::Owner, 0o400),
            (Readers::Group, 0o640),
            (Readers::Everyone, 0o600),
            (Readers::Everyone, 0o755),
        ] {
            set_mode(&path, mode);
            assert_eq!(read(&path, readers, 100).unwrap(), b"content");
        }
    }

    #[test]
    fn a_credential_of_systemd_may_show_the_mask_of_its_list_as_rights_of_the_group() {
        use std::os::unix::fs::chown;

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("node.key");
        fs::write(&path, "content").unwrap();
        let credentials = || Some(folder.path().as_os_str().to_owned());
        set_mode(&path, 0o440);
        if chown(&path, Some(0), Some(0)).is_err() {
            return println!("NOT TESTED: only root can make a file of root");
        }
        assert!(is_credential(&path, credentials()));
        assert!(!is_credential(&path, None), "not a service");
        assert!(!is_credential(&path, Some("/run/credentials/other".into())));
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&path, &link).unwrap();
        assert!(!is_credential(&link, credentials()));
        set_mode(&path, 0o460);
        assert!(!is_credential(&path, credentials()));
        set_mode(&path, 0o440);
        chown(&path, Some(4711), None).unwrap();
        assert!(!is_credential(&path, credentials()), "another user's");
    }

    #[test]
    fn a_file_in_a_folder_that_others_can_write_is_refused_also_behind_a_link() {
        let folders = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let [path, link] = [
            folders[0].path().join("file"),
            folders[1].path().join("link"),
        ];
        fs::write(&path, "content").unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        let reads = || [&path, &link].map(|it| read(it, Readers::Everyone, 100));
        assert!(reads().iter().all(Result::is_ok));
        set_mode(folders[0].path(), 0o777);
        for refused in reads() {
            let error = refused.unwrap_err().to_string();
            assert!(error.contains("chmod go-w /"), "{error}");
        }
        set_mode(folders[0].path(), 0o775);
        assert!(reads().iter().all(Result::is_err), "a group may write it");
        set_mode(folders[0].path(), 0o1777);
        assert!(
            reads().iter().all(Result::is_ok),
            "only its owner replaces it"
        );
        set_mode(folders[1].path(), 0o777);
        assert!(reads()[0].is_ok() && reads()[1].is_err());
    }

    #[test]
    fn a_file_of_another_user_or_in_his_folder_is_read_to_change_it_alone() {
        use std::os::unix::fs::chown;

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "content").unwrap();
        for others in [path.as_path(), folder.path()] {
            if chown(others, Some(4711), None).is_err() {
                return println!("NOT TESTED: only root can make a file of another user");
            }
            for readers in [Readers::Owner, Readers::Everyone] {
                set_mode(&path, readers.mode());
                let error = read(&path, readers, 100).unwrap_err();
                assert_eq!(error.kind(), io::ErrorKind::PermissionDenied);
                let error = error.to_string();
                assert!(error.contains("belongs to user 4711"), "{error}");
                let remedy = format!("chown 0 {}`", others.display());
                assert!(error.contains(&remedy), "{error}");
                let changed = read_text_from(&path, readers, 100, Owners::Any);
                assert_eq!(changed.unwrap(), "content");
            }
            chown(others, Some(0), None).unwrap();
        }
        assert!(read(&path, Readers::Everyone, 100).is_ok());
    }

    #[test]
    fn a_file_that_is_too_long_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "content").unwrap();
        assert_eq!(read(&path, Readers::Everyone, 7).unwrap(), b"content");
        let error = read(&path, Readers::Everyone, 6).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
    }
}
