//! Values that are read from files, shared, and read again when a file has changed.

use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard, Weak};
use std::time::Duration;

use jaus_files::FileStamp;

/// How often a running node looks whether its files have changed.
const INTERVAL: Duration = Duration::from_secs(1);

/// What an unusable file of trust means: it may lack what was revoked.
pub(crate) const REFUSING: &str = "new sessions are refused until it can be used again";
/// What an unusable file of the node itself means.
pub(crate) const KEEPING: &str = "its previous contents stay in use";

type Read<T, E> = Box<dyn Fn() -> Result<T, E> + Send + Sync>;

/// A value shared by its clones. Replacing it counts as a new edition.
pub(crate) struct Followed<T, E>(Arc<Inner<T, E>>);

struct Inner<T, E> {
    state: RwLock<State<T>>,
    files: Vec<PathBuf>,
    /// Their state before the value was read first.
    seen: Vec<FileStamp>,
    /// Reads the files; `None` for a value that is in none.
    read: Option<Read<T, E>>,
}

struct State<T> {
    value: Arc<T>,
    /// How often the value was replaced.
    edition: u64,
    /// Why the files could not be read last.
    fault: Option<Arc<str>>,
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
        let seen = stamps(&files);
        let value = read()?;
        Ok(Self::with(value, files, seen, Some(Box::new(read))))
    }

    fn with(value: T, files: Vec<PathBuf>, seen: Vec<FileStamp>, read: Option<Read<T, E>>) -> Self {
        Self(Arc::new(Inner {
            state: RwLock::new(State {
                value: Arc::new(value),
                edition: 0,
                fault: None,
            }),
            files,
            seen,
            read,
        }))
    }

    fn state(&self) -> RwLockReadGuard<'_, State<T>> {
        self.0.state.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn state_mut(&self) -> RwLockWriteGuard<'_, State<T>> {
        self.0.state.write().unwrap_or_else(PoisonError::into_inner)
    }

    /// The current value.
    pub(crate) fn get(&self) -> Arc<T> {
        self.state().value.clone()
    }

    /// How often the value was replaced.
    pub(crate) fn edition(&self) -> u64 {
        self.state().edition
    }

    /// Why the files could not be read last; `None` if they could.
    pub(crate) fn fault(&self) -> Option<Arc<str>> {
        self.state().fault.clone()
    }

    /// Replaces the value.
    pub(crate) fn replace(&self, value: T) {
        let mut state = self.state_mut();
        state.value = Arc::new(value);
        state.edition += 1;
        state.fault = None;
    }
}

impl<T, E: fmt::Display> Followed<T, E> {
    /// Reads the files again. On an error the previous value stays, with a [`fault`](Self::fault).
    pub(crate) fn reload(&self) -> Result<(), E> {
        match self.0.read.as_ref().map(|read| read()) {
            Some(Ok(value)) => self.replace(value),
            Some(Err(error)) => {
                self.state_mut().fault = Some(error.to_string().into());
                return Err(error);
            }
            None => {}
        }
        Ok(())
    }
}

impl<T, E> Followed<T, E>
where
    T: Send + Sync + 'static,
    E: fmt::Display + 'static,
{
    /// Reads the files again whenever one of them has changed, and while they cannot be used, as long as
    /// the value is in use. Must be called within a tokio runtime. A file that has become unusable is
    /// logged, with what this means for the node.
    #[expect(
        clippy::disallowed_methods,
        reason = "the task only looks at files, and ends with the value"
    )]
    pub(crate) fn follow(&self, consequence: &'static str) {
        if self.0.read.is_some() {
            let seen = self.0.seen.clone();
            tokio::spawn(follow(Arc::downgrade(&self.0), seen, consequence));
        }
    }
}

fn stamps(files: &[PathBuf]) -> Vec<FileStamp> {
    files.iter().map(|it| FileStamp::of(it)).collect()
}

#[expect(
    clippy::disallowed_methods,
    reason = "looks at files in real time, also while a test pauses the clock"
)]
async fn follow<T, E: fmt::Display>(
    value: Weak<Inner<T, E>>,
    mut seen: Vec<FileStamp>,
    consequence: &str,
) {
    loop {
        tokio::time::sleep(INTERVAL).await;
        let Some(value) = value.upgrade().map(Followed) else {
            return;
        };
        let now = stamps(&value.0.files);
        let fault = value.fault();
        // What makes a file usable again may be elsewhere, such as the mode of its folder.
        if now == seen && fault.is_none() {
            continue;
        }
        seen = now;
        let files = value.0.files.iter().map(|it| it.display().to_string());
        let files = files.collect::<Vec<_>>().join(", ");
        match value.reload() {
            Ok(()) => tracing::info!(files, "read again after a change"),
            Err(_) if value.fault() == fault => {}
            Err(error) => tracing::error!(files, %error, "{consequence}"),
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
