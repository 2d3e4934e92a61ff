//! Stop inputs: lines that must be closed before anything moves, and the interlock they control.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A stop input: a normally closed line, such as an emergency stop button.
///
/// The vehicle stops when the line is open or cannot be read, so a cut wire acts like a pressed
/// button. A dedicated thread reads the line every 10 ms.
pub trait StopInput: Send {
    /// Whether the line is closed, so that the vehicle may move.
    ///
    /// # Errors
    /// If the line cannot be read, which counts as open.
    fn is_closed(&mut self) -> io::Result<bool>;
}

/// A simulated stop input. Cheap to clone; all clones share one state.
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

/// A stop input for experiments: pressed while a file exists.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StopFile(pub PathBuf);

impl StopInput for StopFile {
    fn is_closed(&mut self) -> io::Result<bool> {
        self.0.try_exists().map(|exists| !exists)
    }
}

/// Locks [`Wheels`](super::Wheels): while the interlock is open, both sides are commanded to stop,
/// whatever other commands arrive. Cheap to clone; all clones share one state.
#[derive(Debug, Clone, Default)]
pub struct Interlock(Arc<AtomicBool>);

impl Interlock {
    /// Blocks all motion from now on.
    pub fn open(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Allows commands to take effect again.
    pub fn close(&self) {
        self.0.store(false, Ordering::Relaxed);
    }

    /// Whether motion is blocked.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
