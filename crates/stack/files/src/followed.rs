//! Values that are read from files, shared, and read again when a file has changed.

use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard, Weak};
use std::time::Duration;

use crate::marks::UseMarks;
use crate::stamp::FileStamp;

type Read<T, E> = Box<dyn Fn() -> Result<T, E> + Send + Sync>;

/// A value that a service has read from files, shared by its clones. Replacing it counts as a new edition.
///
/// While a value is in use, its files are marked with a shared lock, by which
/// [`FormerContent`](crate::FormerContent) sees who still uses what a file contained before a change.
pub struct Followed<T, E>(Arc<Inner<T, E>>);

/// A reference to a [`Followed`] value that does not keep it in use.
pub struct WeakFollowed<T, E>(Weak<Inner<T, E>>);

struct Inner<T, E> {
    state: RwLock<State<T>>,
    files: Vec<PathBuf>,
    /// Reads the files; `None` for a value that is in none.
    read: Option<Read<T, E>>,
}

struct State<T> {
    value: Arc<T>,
    /// How often the value was replaced.
    edition: u64,
    /// Why the files could not be read last.
    fault: Option<Arc<str>>,
    /// The state of the files before they were read last.
    seen: Vec<FileStamp>,
    /// The marks of the content that the value was read from.
    marks: UseMarks,
}

impl<T, E> Followed<T, E> {
    /// How often a service calls [`refresh`](Self::refresh): a change is taken within a second, and a quarter
    /// of the time for which [`FormerContent::uptake`](crate::FormerContent::uptake) waits.
    pub const INTERVAL: Duration = Duration::from_millis(500);

    /// Shares a value that is not in a file.
    #[must_use]
    pub fn of(value: T) -> Self {
        Self::with(value, Vec::new(), None, Vec::new(), UseMarks::default())
    }

    /// Reads a value from these files.
    ///
    /// # Errors
    /// Those of `read`.
    pub fn load(
        files: Vec<PathBuf>,
        read: impl Fn() -> Result<T, E> + Send + Sync + 'static,
    ) -> Result<Self, E> {
        let (seen, marks) = begin(&files);
        let value = read()?;
        Ok(Self::with(value, files, Some(Box::new(read)), seen, marks))
    }

    fn with(
        value: T,
        files: Vec<PathBuf>,
        read: Option<Read<T, E>>,
        seen: Vec<FileStamp>,
        marks: UseMarks,
    ) -> Self {
        let state = State {
            value: Arc::new(value),
            edition: 0,
            fault: None,
            seen,
            marks,
        };
        Self(Arc::new(Inner {
            state: RwLock::new(state),
            files,
            read,
        }))
    }

    fn state(&self) -> RwLockReadGuard<'_, State<T>> {
        self.0.state.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn state_mut(&self) -> RwLockWriteGuard<'_, State<T>> {
        self.0.state.write().unwrap_or_else(PoisonError::into_inner)
    }

    /// The files; empty for a value that is in none.
    #[must_use]
    pub fn files(&self) -> &[PathBuf] {
        &self.0.files
    }

    /// The current value.
    #[must_use]
    pub fn get(&self) -> Arc<T> {
        self.state().value.clone()
    }

    /// How often the value was replaced.
    #[must_use]
    pub fn edition(&self) -> u64 {
        self.state().edition
    }

    /// Why the files could not be read last; `None` if they could.
    #[must_use]
    pub fn fault(&self) -> Option<Arc<str>> {
        self.state().fault.clone()
    }

    /// Replaces the value by one that is not in the files.
    pub fn replace(&self, value: T) {
        self.set(value, UseMarks::default());
    }

    fn set(&self, value: T, marks: UseMarks) {
        let mut state = self.state_mut();
        state.value = Arc::new(value);
        state.edition += 1;
        state.fault = None;
        // Last: without its mark the former value is out of use.
        state.marks = marks;
    }

    /// A reference that does not keep the value in use.
    #[must_use]
    pub fn downgrade(&self) -> WeakFollowed<T, E> {
        WeakFollowed(Arc::downgrade(&self.0))
    }

    /// Marks the files if another process has kept this one from it.
    fn complete_marks(&self) {
        if self.state().marks.are_complete() {
            return;
        }
        let marks = UseMarks::of(&self.0.files);
        let mut state = self.state_mut();
        // If not, the marks are those of another content, which is read in the next turn.
        if stamps(&self.0.files) == state.seen {
            state.marks = marks;
        }
    }
}

impl<T, E: fmt::Display> Followed<T, E> {
    /// Reads the files again. On an error the previous value stays, with a [`fault`](Self::fault).
    ///
    /// # Errors
    /// Those of reading.
    pub fn reload(&self) -> Result<(), E> {
        let Some(read) = &self.0.read else {
            return Ok(());
        };
        let (seen, marks) = begin(&self.0.files);
        let read = read();
        self.state_mut().seen = seen;
        match read {
            Ok(value) => {
                self.set(value, marks);
                Ok(())
            }
            Err(error) => {
                self.state_mut().fault = Some(error.to_string().into());
                Err(error)
            }
        }
    }

    /// Reads the files again if one of them has changed, or if they could not be read last: what makes a
    /// file usable again may be elsewhere, such as the mode of its folder. Returns whether the value was
    /// replaced.
    ///
    /// # Errors
    /// As [`reload`](Self::reload), once for each fault.
    pub fn refresh(&self) -> Result<bool, E> {
        let fault = self.fault();
        if fault.is_none() && stamps(&self.0.files) == self.state().seen {
            self.complete_marks();
            return Ok(false);
        }
        match self.reload() {
            Ok(()) => Ok(true),
            Err(_) if self.fault() == fault => Ok(false),
            Err(error) => Err(error),
        }
    }
}

/// What precedes reading: a change after the stamps is noticed later, and a content that is replaced after
/// the marks is seen to be in use.
fn begin(files: &[PathBuf]) -> (Vec<FileStamp>, UseMarks) {
    (stamps(files), UseMarks::of(files))
}

fn stamps(files: &[PathBuf]) -> Vec<FileStamp> {
    files.iter().map(|it| FileStamp::of(it)).collect()
}

impl<T, E> WeakFollowed<T, E> {
    /// The value, if it is still in use.
    #[must_use]
    pub fn upgrade(&self) -> Option<Followed<T, E>> {
        self.0.upgrade().map(Followed)
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

impl<T, E> fmt::Debug for WeakFollowed<T, E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("WeakFollowed").finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, io};

    use super::*;

    #[test]
    fn a_change_is_noticed_and_a_fault_reported_once_while_the_value_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "one").unwrap();
        let read = {
            let path = path.clone();
            move || match fs::read_to_string(&path)? {
                bad if bad.starts_with("bad") => Err(io::Error::other(bad)),
                text => Ok(text),
            }
        };
        let followed = Followed::load(vec![path.clone()], read).unwrap();
        assert!(!followed.refresh().unwrap(), "nothing has changed");
        fs::write(&path, "three").unwrap();
        assert!(followed.refresh().unwrap());
        assert_eq!((&**followed.get(), followed.edition()), ("three", 1));
        fs::write(&path, "bad line").unwrap();
        assert!(followed.refresh().is_err());
        assert!(!followed.refresh().unwrap(), "a fault is reported once");
        assert_eq!(followed.fault().as_deref(), Some("bad line"));
        fs::write(&path, "bad again").unwrap();
        assert!(followed.refresh().is_err(), "another fault");
        assert_eq!((&**followed.get(), followed.edition()), ("three", 1));
        fs::write(&path, "four").unwrap();
        assert!(followed.refresh().unwrap());
        assert_eq!((&**followed.get(), followed.fault()), ("four", None));
    }

    #[test]
    fn a_weak_reference_does_not_keep_a_value() {
        let followed = Followed::<_, io::Error>::of(1);
        let weak = followed.downgrade();
        assert!(!weak.upgrade().unwrap().refresh().unwrap());
        drop(followed);
        assert!(weak.upgrade().is_none());
    }
}
