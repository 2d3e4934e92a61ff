//! Locks that keep two programs from changing one file, or using one folder, at the same time.
#![expect(
    clippy::disallowed_methods,
    reason = "a lock of another process is waited for in real time"
)]

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use crate::log::open_or_create;
use crate::readers::{Readers, folder_of};

/// How often a lock is tried before it is given up: for 5 s.
const ATTEMPTS: u32 = 250;
const PAUSE: Duration = Duration::from_millis(20);

/// A lock, held until it is dropped or the process ends. Its file stays.
#[derive(Debug)]
pub struct FileLock {
    /// Closing it releases the lock.
    _file: File,
}

impl FileLock {
    /// Locks a file, waiting up to 5 s for another program. The lock is that of a file beside it with
    /// `.lock` appended, because the file itself is replaced.
    ///
    /// # Errors
    /// If the lock cannot be created, or [`io::ErrorKind::TimedOut`] if another program holds it.
    pub fn of(path: &Path) -> io::Result<Self> {
        Self::within(path, ATTEMPTS)
    }

    fn within(path: &Path, attempts: u32) -> io::Result<Self> {
        let lock = beside(path);
        let named = |error: io::Error| {
            let text = format!("its lock {}: {error}", lock.display());
            io::Error::new(error.kind(), text)
        };
        let (file, is_new) = open(&lock, Readers::Owner).map_err(named)?;
        if is_new {
            give_to_owner_of(path, &file);
        }
        for _ in 0..attempts {
            if is_locked_now(&file).map_err(named)? {
                return Ok(Self { _file: file });
            }
            thread::sleep(PAUSE);
        }
        let lock = lock.display();
        Err(io::Error::new(
            io::ErrorKind::TimedOut,
            format!(
                "another program holds the lock {lock}: end it (`fuser {lock}` finds it), and repeat"
            ),
        ))
    }

    /// Locks the file at `lock`, which is created if necessary; `None` if another program holds it. Who
    /// can read the file can also hold it. On a file system without locks it always succeeds.
    ///
    /// # Errors
    /// If the file cannot be created or opened.
    pub fn try_at(lock: &Path, readers: Readers) -> io::Result<Option<Self>> {
        let (file, _) = open(lock, readers)?;
        Ok(is_locked_now(&file)?.then_some(Self { _file: file }))
    }
}

/// The file of a lock, and whether it was created.
fn open(lock: &Path, readers: Readers) -> io::Result<(File, bool)> {
    open_or_create(lock, readers, OpenOptions::new().read(true))
}

fn is_locked_now(file: &File) -> io::Result<bool> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Ok(false),
        Err(TryLockError::Error(error)) if error.kind() != io::ErrorKind::Unsupported => Err(error),
        _ => Ok(true),
    }
}

/// A lock that root has made must not keep the owner of the file, or else of its folder, from changing the
/// file later.
#[cfg(unix)]
fn give_to_owner_of(path: &Path, lock: &File) {
    use std::os::unix::fs::{MetadataExt as _, fchown};

    let owner = fs::symlink_metadata(path).or_else(|_| fs::metadata(folder_of(path)));
    if let (Ok(owner), Ok(own)) = (owner, lock.metadata())
        && owner.uid() != own.uid()
    {
        // Only root can, and only root has to.
        let _ = fchown(lock, Some(owner.uid()), Some(owner.gid()));
    }
}

#[cfg(not(unix))]
fn give_to_owner_of(_: &Path, _: &File) {}

fn beside(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".lock");
    name.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_that_another_program_keeps_is_named_after_a_while() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let held = FileLock::of(&path).unwrap();
        let error = FileLock::within(&path, 2).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert!(error.to_string().contains("file.lock"), "{error}");
        drop(held);
        FileLock::of(&path).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn root_gives_a_lock_that_it_has_made_to_the_owner_of_the_file_and_no_other() {
        use std::os::unix::fs::{MetadataExt as _, chown};

        let folder = tempfile::tempdir().unwrap();
        let [made, planted] = ["made", "planted"].map(|name| folder.path().join(name));
        for path in [&made, &planted] {
            fs::write(path, "one").unwrap();
            if chown(path, Some(65534), Some(65534)).is_err() {
                return eprintln!("SKIPPED: only root can give a file to another user");
            }
        }
        // Perhaps a second name of a file of root.
        fs::write(beside(&planted), "precious").unwrap();
        let owner = |path: &Path| {
            FileLock::of(path).unwrap();
            beside(path).metadata().unwrap().uid()
        };
        assert_eq!([owner(&made), owner(&planted)], [65534, 0]);
    }

    #[cfg(unix)]
    #[test]
    fn a_lock_is_private_and_no_link() {
        use std::os::unix::fs::{PermissionsExt as _, symlink};

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        FileLock::of(&path).unwrap();
        let mode = beside(&path).metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        let [other, victim] = ["other", "victim"].map(|name| folder.path().join(name));
        symlink(&victim, beside(&other)).unwrap();
        assert!(FileLock::of(&other).is_err());
        assert!(!victim.exists());
    }
}
