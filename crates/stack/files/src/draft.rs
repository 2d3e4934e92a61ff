//! The new content of a file, beside it until it is complete.

use std::fs::{self, File};
use std::hash::{BuildHasher as _, RandomState};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use crate::log::{options, regular};
use crate::readers::{Readers, folder_of};

/// Replaces a file in one step, so that a reader finds the old or the new content, also after a loss of
/// power. Owner, mode and security context of an existing file stay; a new one is for `readers`.
///
/// # Errors
/// As [`FileDraft::new`] and [`FileDraft::replace`].
pub fn replace(path: &Path, readers: Readers, content: &[u8]) -> io::Result<()> {
    let mut draft = FileDraft::new(path, readers)?;
    draft.file().write_all(content)?;
    draft.replace()
}

/// Creates a file, which is complete or absent, also after a loss of power.
///
/// # Errors
/// As [`FileDraft::new`] and [`FileDraft::publish`].
pub fn create(path: &Path, readers: Readers, content: &[u8]) -> io::Result<()> {
    let mut draft = FileDraft::new(path, readers)?;
    draft.file().write_all(content)?;
    draft.publish()
}

/// A file that will replace another one. Its name begins with a dot and ends with `.new`; dropping it
/// removes it.
#[derive(Debug)]
pub struct FileDraft {
    target: PathBuf,
    path: PathBuf,
    file: File,
}

impl FileDraft {
    /// Creates an empty draft of `target`, with the owner, mode and security context of the file that it is
    /// to replace, or else for `readers`. A symbolic link is not replaced.
    ///
    /// # Errors
    /// If the draft cannot be created; [`io::ErrorKind::InvalidInput`] if `target` is a symbolic link or no
    /// regular file; [`io::ErrorKind::PermissionDenied`] if the draft cannot have the owner of the file:
    /// then those who read the file now would lose access to it.
    pub fn new(target: &Path, readers: Readers) -> io::Result<Self> {
        let former = regular(target)?;
        // It stays private until it gets the mode of the file.
        let readers = if former.is_some() {
            Readers::Owner
        } else {
            readers
        };
        let name = target.file_name().ok_or(io::ErrorKind::InvalidInput)?;
        let mut draft_name = std::ffi::OsString::from(".");
        draft_name.push(name);
        // No other draft has this name; a planted file is not opened.
        let random = RandomState::new().hash_one(std::process::id());
        draft_name.push(format!(".{random:016x}.new"));
        let path = target.with_file_name(draft_name);
        let file = options(readers).read(true).create_new(true).open(&path)?;
        let draft = Self {
            target: target.to_owned(),
            path,
            file,
        };
        if let Some(former) = former {
            draft.resemble(&former)?;
        }
        Ok(draft)
    }

    /// The file to write to.
    pub const fn file(&mut self) -> &mut File {
        &mut self.file
    }

    /// Puts the draft in place of the file, once it is on the disk.
    ///
    /// # Errors
    /// If it cannot be written to the disk or renamed: then the file is as before.
    pub fn replace(self) -> io::Result<()> {
        self.file.sync_all()?;
        fs::rename(&self.path, &self.target)?;
        sync_folder(&self.target);
        Ok(())
    }

    /// Gives the draft the name of its target, once it is on the disk.
    ///
    /// # Errors
    /// If it cannot be written to the disk or named; [`io::ErrorKind::AlreadyExists`] if there is a file
    /// with the name.
    pub fn publish(self) -> io::Result<()> {
        self.file.sync_all()?;
        // Unlike a renamed file, a link replaces none.
        fs::hard_link(&self.path, &self.target)?;
        sync_folder(&self.target);
        Ok(())
    }

    /// Makes the draft like the file that it is to replace.
    #[cfg(unix)]
    fn resemble(&self, former: &fs::Metadata) -> io::Result<()> {
        use std::os::unix::fs::{MetadataExt as _, fchown};

        let own = self.file.metadata()?;
        let (uid, gid) = (former.uid(), former.gid());
        if (own.uid(), own.gid()) != (uid, gid) {
            fchown(&self.file, Some(uid), Some(gid)).map_err(|error| {
                io::Error::new(
                    error.kind(),
                    format!(
                        "it belongs to user {uid} and group {gid}, who could not read what this user \
                         writes: run the command as user {uid} or as root"
                    ),
                )
            })?;
        }
        // After the owner, because a change of it clears bits of the mode.
        self.file.set_permissions(former.permissions())?;
        #[cfg(target_os = "linux")]
        for name in ["security.selinux", "system.posix_acl_access"] {
            self.copy_attribute(name)?;
        }
        Ok(())
    }

    #[cfg(not(unix))]
    fn resemble(&self, former: &fs::Metadata) -> io::Result<()> {
        self.file.set_permissions(former.permissions())
    }

    /// Copies an extended attribute that decides who may read the file.
    #[cfg(target_os = "linux")]
    fn copy_attribute(&self, name: &str) -> io::Result<()> {
        use rustix::fs::{XattrFlags, fgetxattr, fsetxattr, lgetxattr};

        let (mut former, mut own) = ([0; 4096], [0; 4096]);
        // Most files, and many file systems, have none.
        let Ok(length) = lgetxattr(&self.target, name, &mut former[..]) else {
            return Ok(());
        };
        let has =
            fgetxattr(&self.file, name, &mut own[..]).is_ok_and(|it| own[..it] == former[..length]);
        if has {
            return Ok(());
        }
        fsetxattr(&self.file, name, &former[..length], XattrFlags::empty()).map_err(|error| {
            let text =
                format!("its attribute {name} cannot be kept ({error}): run the command as root");
            io::Error::new(error.kind(), text)
        })
    }
}

impl Drop for FileDraft {
    fn drop(&mut self) {
        // After a rename it is not there.
        let _ = fs::remove_file(&self.path);
    }
}

/// Writes a new name to the disk. The change is made, so it has not failed if a file system cannot do that.
fn sync_folder(path: &Path) {
    if cfg!(unix) {
        let _ = File::open(folder_of(path)).and_then(|it| it.sync_all());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> = entries
            .map(|it| it.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_replaced_whole_and_a_draft_that_fails_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        replace(&path, Readers::Everyone, b"one").unwrap();
        replace(&path, Readers::Everyone, b"two").unwrap();
        let mut draft = FileDraft::new(&path, Readers::Everyone).unwrap();
        draft.file().write_all(b"thr").unwrap();
        drop(draft);
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[test]
    fn a_new_file_replaces_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        create(&path, Readers::Owner, b"one").unwrap();
        let error = create(&path, Readers::Owner, b"two").unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read(&path).unwrap(), b"one");
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[cfg(unix)]
    mod unix {
        use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, chown, symlink};

        use super::*;

        #[test]
        fn the_mode_of_a_file_stays_and_a_new_one_is_for_its_readers() {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("file");
            let mode = || path.metadata().unwrap().mode() & 0o777;
            replace(&path, Readers::Owner, b"one").unwrap();
            assert_eq!(mode(), 0o600);
            for kept in [0o640, 0o664, 0o400] {
                fs::set_permissions(&path, fs::Permissions::from_mode(kept)).unwrap();
                replace(&path, Readers::Owner, b"two").unwrap();
                assert_eq!(mode(), kept);
            }
        }

        #[test]
        fn a_link_is_neither_replaced_nor_followed() {
            let folder = tempfile::tempdir().unwrap();
            let [victim, link] = ["victim", "link"].map(|name| folder.path().join(name));
            fs::write(&victim, "precious").unwrap();
            symlink(&victim, &link).unwrap();
            let error = replace(&link, Readers::Everyone, b"new").unwrap_err();
            assert!(error.to_string().contains("symbolic link"), "{error}");
            assert_eq!(fs::read(&victim).unwrap(), b"precious");
            assert!(replace(Path::new("/dev/null"), Readers::Everyone, b"new").is_err());
        }

        /// Whether the test may give files to others, as root may.
        fn is_root(folder: &Path) -> bool {
            let is_root = folder.metadata().unwrap().uid() == 0;
            if !is_root {
                eprintln!("SKIPPED: only root can give a file to another user");
            }
            is_root
        }

        #[test]
        fn root_replaces_the_file_of_a_service_which_stays_its_own() {
            let folder = tempfile::tempdir().unwrap();
            if !is_root(folder.path()) {
                return;
            }
            let path = folder.path().join("file");
            fs::write(&path, "one").unwrap();
            chown(&path, Some(65534), Some(65533)).unwrap();
            fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
            replace(&path, Readers::Owner, b"two").unwrap();
            let found = path.metadata().unwrap();
            assert_eq!((found.uid(), found.gid()), (65534, 65533));
            assert_eq!(found.mode() & 0o777, 0o640);
        }

        #[test]
        fn a_file_whose_owner_cannot_be_kept_is_left_with_the_remedy() {
            let folder = tempfile::tempdir().unwrap();
            if !is_root(folder.path()) {
                return;
            }
            let path = folder.path().join("file");
            fs::write(&path, "one").unwrap();
            fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o777)).unwrap();
            // Another user's process, because an identity is that of all threads.
            let test = std::env::current_exe().unwrap();
            let child = "draft::tests::unix::as_another_user";
            let mut command = std::process::Command::new(test);
            command
                .args([child, "--exact", "--ignored"])
                .env("TARGET", &path);
            std::os::unix::process::CommandExt::uid(&mut command, 65534);
            let output = match command.output() {
                Ok(output) => output,
                // The folder of the test program is not everybody's.
                Err(error) => return eprintln!("SKIPPED: {error}"),
            };
            assert!(output.status.success(), "{output:?}");
            assert_eq!(fs::read(&path).unwrap(), b"one");
            assert_eq!(names(folder.path()), ["file"]);
        }

        #[test]
        #[ignore = "run by another test as another user"]
        fn as_another_user() {
            let path = PathBuf::from(std::env::var_os("TARGET").unwrap());
            let error = replace(&path, Readers::Everyone, b"two").unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::PermissionDenied);
            let text = error.to_string();
            assert!(
                text.contains("run the command as user 0 or as root"),
                "{text}"
            );
        }
    }
}
