//! Stop inputs: a line that must be closed for anything to move, and what it locks.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A stop input: a normally closed line, such as that of a mushroom button.
///
/// An open line stops the vehicle, and so does one that cannot be read: a cut wire is a pressed
/// button. It is read every 10 ms on a thread of its own.
pub trait StopInput: Send {
    /// Whether the line is closed, so that the vehicle may move.
    ///
    /// # Errors
    /// If it cannot be read; that counts as open.
    fn is_closed(&mut self) -> io::Result<bool>;
}

/// A simulated stop input. Cheap to clone; the clones are one button.
#[derive(Debug, Clone, Default)]
pub struct SimulatedStop(Arc<AtomicBool>);

impl SimulatedStop {
    /// Opens the line.
    pub fn press(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Closes the line.
    pub fn release(&self) {
        self.0.store(false, Ordering::Relaxed);
    }
}

impl StopInput for SimulatedStop {
    fn is_closed(&mut self) -> io::Result<bool> {
        Ok(!self.0.load(Ordering::Relaxed))
    }
}

/// A stop input for trying things out: it is pressed while a file exists.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StopFile(pub PathBuf);

impl StopInput for StopFile {
    fn is_closed(&mut self) -> io::Result<bool> {
        self.0.try_exists().map(|exists| !exists)
    }
}

/// Locks [`Wheels`](super::Wheels): while it is open both sides are commanded to stop, whatever
/// commands come. Cheap to clone; the clones are one interlock.
#[derive(Debug, Clone, Default)]
pub struct Interlock(Arc<AtomicBool>);

impl Interlock {
    /// From now on nothing may move.
    pub fn open(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Commands are carried out again.
    pub fn close(&self) {
        self.0.store(false, Ordering::Relaxed);
    }

    /// Whether nothing may move.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
