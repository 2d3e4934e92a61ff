//! Values that are read from files, shared, and read again when a file has changed.

use std::fmt;
use std::fs;
use std::path::PathBuf;
use std::sync::{Arc, PoisonError, RwLock, Weak};
use std::time::{Duration, SystemTime};

/// How often a running node looks whether its files have changed.
const INTERVAL: Duration = Duration::from_secs(1);

type Read<T, E> = Box<dyn Fn() -> Result<T, E> + Send + Sync>;

/// A value shared by its clones. Replacing it counts as a new edition.
pub(crate) struct Followed<T, E>(Arc<Inner<T, E>>);

struct Inner<T, E> {
    /// The value, and how often it was replaced.
    state: RwLock<(u64, Arc<T>)>,
    files: Vec<PathBuf>,
    /// Their state before the value was read first.
    seen: Changes,
    /// Reads the files; `None` for a value that is in none.
    read: Option<Read<T, E>>,
}

impl<T, E> Followed<T, E> {
    /// Shares a value that is not in a file.
    pub(crate) fn of(value: T) -> Self {
        Self::with(value, Vec::new(), Vec::new(), None)
    }

    /// Reads a value from these files.
    pub(crate) fn load(
        files: Vec<PathBuf>,
        read: impl Fn() -> Result<T, E> + Send + Sync + 'static,
    ) -> Result<Self, E> {
        // A change between the two is noticed later.
        let seen = changes(&files);
        let value = read()?;
        Ok(Self::with(value, files, seen, Some(Box::new(read))))
    }

    fn with(value: T, files: Vec<PathBuf>, seen: Changes, read: Option<Read<T, E>>) -> Self {
        Self(Arc::new(Inner {
            state: RwLock::new((0, Arc::new(value))),
            files,
            seen,
            read,
        }))
    }

    /// The current value.
    pub(crate) fn get(&self) -> Arc<T> {
        let state = self.0.state.read().unwrap_or_else(PoisonError::into_inner);
        state.1.clone()
    }

    /// How often the value was replaced.
    pub(crate) fn edition(&self) -> u64 {
        let state = self.0.state.read().unwrap_or_else(PoisonError::into_inner);
        state.0
    }

    /// Replaces the value.
    pub(crate) fn replace(&self, value: T) {
        let mut state = self.0.state.write().unwrap_or_else(PoisonError::into_inner);
        *state = (state.0 + 1, Arc::new(value));
    }

    /// Reads the files again. On an error the previous value stays.
    pub(crate) fn reload(&self) -> Result<(), E> {
        if let Some(read) = &self.0.read {
            self.replace(read()?);
        }
        Ok(())
    }
}

impl<T, E> Followed<T, E>
where
    T: Send + Sync + 'static,
    E: fmt::Display + 'static,
{
    /// Reads the files again whenever one of them has changed, as long as the value is in use. Must
    /// be called within a tokio runtime. A file that has become unusable changes nothing, and is
    /// logged.
    #[expect(
        clippy::disallowed_methods,
        reason = "the task only looks at files, and ends with the value"
    )]
    pub(crate) fn follow(&self) {
        if self.0.read.is_some() {
            tokio::spawn(follow(Arc::downgrade(&self.0), self.0.seen.clone()));
        }
    }
}

/// When each file was changed last, and its length; `None` if it is not there.
type Changes = Vec<Option<(SystemTime, u64)>>;

fn changes(files: &[PathBuf]) -> Changes {
    let change = |path| {
        let metadata = fs::metadata(path).ok()?;
        Some((metadata.modified().ok()?, metadata.len()))
    };
    files.iter().map(change).collect()
}

#[expect(
    clippy::disallowed_methods,
    reason = "looks at files in real time, also while a test pauses the clock"
)]
async fn follow<T, E: fmt::Display>(value: Weak<Inner<T, E>>, mut seen: Changes) {
    loop {
        tokio::time::sleep(INTERVAL).await;
        let Some(inner) = value.upgrade() else {
            return;
        };
        let now = changes(&inner.files);
        if now == seen {
            continue;
        }
        seen = now;
        let files = inner.files.iter().map(|it| it.display().to_string());
        let files = files.collect::<Vec<_>>().join(", ");
        match Followed(inner).reload() {
            Ok(()) => tracing::info!(files, "read again after a change"),
            Err(error) => tracing::error!(%error, "the previous contents stay in force"),
        }
    }
}

impl<T, E> Clone for Followed<T, E> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<T: fmt::Debug, E> fmt::Debug for Followed<T, E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Followed").field(&self.get()).finish()
    }
}
