//! What shows that a file has changed.

use std::fs;
use std::path::Path;
use std::time::SystemTime;

/// The state of a file at a moment. Two that differ mean that it was changed, replaced, removed, or that
/// its owner or mode was changed, so that it may be readable now, or no more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileStamp(Option<Stamp>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stamp {
    length: u64,
    modified: Option<SystemTime>,
    /// Inode, and time of the last change of content or inode.
    #[cfg(unix)]
    inode: (u64, i64, i64),
}

impl FileStamp {
    /// The present state of a file, which need not exist.
    #[must_use]
    pub fn of(path: &Path) -> Self {
        #[cfg(unix)]
        use std::os::unix::fs::MetadataExt as _;

        let metadata = fs::metadata(path).ok();
        Self(metadata.map(|it| Stamp {
            length: it.len(),
            modified: it.modified().ok(),
            #[cfg(unix)]
            inode: (it.ino(), it.ctime(), it.ctime_nsec()),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_replacement_of_the_same_length_and_another_mode_are_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let missing = FileStamp::of(&path);
        fs::write(&path, "one").unwrap();
        let first = FileStamp::of(&path);
        assert_ne!(first, missing);
        assert_eq!(first, FileStamp::of(&path));
        crate::replace(&path, crate::Readers::Everyone, b"two").unwrap();
        let second = FileStamp::of(&path);
        assert_ne!(second, first);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            // The kernel's clock of files ticks every few milliseconds.
            while FileStamp::of(&path) == second {
                fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
            }
        }
    }
}
