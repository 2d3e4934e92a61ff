//! Marks on files: shared locks that show that a process uses their content.
#![cfg_attr(
    unix,
    expect(
        clippy::disallowed_methods,
        reason = "a lock of another process is waited for in real time"
    )
)]

use std::fs::File;
use std::path::PathBuf;

/// The marks of this process on files, until they are dropped. A mark stays with the content: a file that is
/// put in the place of a marked one is not marked.
#[derive(Debug, Default)]
pub(crate) struct UseMarks {
    /// Closing them releases the locks.
    _files: Vec<File>,
    /// Whether another process holds an exclusive lock on a file.
    is_kept_out: bool,
}

impl UseMarks {
    /// Marks files; those that cannot be opened or locked remain without a mark.
    #[cfg(unix)]
    pub(crate) fn of(files: &[PathBuf]) -> Self {
        let mut marks = Self::default();
        for path in files {
            match mark(path) {
                Mark::Made(file) => marks._files.push(file),
                Mark::KeptOut => marks.is_kept_out = true,
                Mark::Impossible => {}
            }
        }
        marks
    }

    /// Elsewhere a lock would keep others from changing the file.
    #[cfg(not(unix))]
    pub(crate) fn of(_: &[PathBuf]) -> Self {
        Self::default()
    }

    /// Whether no other process has kept this one from marking a file.
    pub(crate) const fn are_complete(&self) -> bool {
        !self.is_kept_out
    }
}

#[cfg(unix)]
enum Mark {
    Made(File),
    KeptOut,
    Impossible,
}

#[cfg(unix)]
fn mark(path: &std::path::Path) -> Mark {
    use std::fs::TryLockError;
    use std::{thread, time::Duration};

    /// How often a lock is tried: the check of [`FormerContent`](crate::FormerContent) holds one for an
    /// instant; another program could hold one for good.
    const ATTEMPTS: u32 = 5;
    const PAUSE: Duration = Duration::from_millis(1);

    // To open a pipe would disturb its writer.
    if !path.metadata().is_ok_and(|it| it.is_file()) {
        return Mark::Impossible;
    }
    let Ok(file) = File::open(path) else {
        return Mark::Impossible;
    };
    for _ in 0..ATTEMPTS {
        match file.try_lock_shared() {
            Ok(()) => return Mark::Made(file),
            Err(TryLockError::WouldBlock) => thread::sleep(PAUSE),
            Err(TryLockError::Error(_)) => return Mark::Impossible,
        }
    }
    Mark::KeptOut
}
