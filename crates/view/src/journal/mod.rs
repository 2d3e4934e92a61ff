//! The journal: a log of a node's entire traffic on disk, in rotating files.
//!
//! A [`Journal`] has a [tap](Node::tap) on the node, which is its bounded queue, and a writer
//! thread, so a slow SD card delays nothing else. Traffic beyond the thread's speed is lost and
//! counted, and the log itself records how much and where. A file ends when it reaches its maximum
//! size or age, and the oldest files are deleted before the directory exceeds its limit. Data is
//! passed to the operating system within a second, in whole blocks or lines. After a crash
//! everything up to that point is readable.

mod directory;
mod packets;
mod sink;
#[cfg(test)]
mod tests;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, PoisonError, RwLock};
use std::thread::JoinHandle;
use std::time::Duration;

use tokio::sync::oneshot;
use tokio::time::MissedTickBehavior;

use self::directory::Directory;
use self::sink::Sink;
use super::{Filter, Links};
use jaus::node::{Node, Tap, Tapped};

/// Capacity of the queue in passages.
const WAITING: usize = 8192;
/// Interval of flushes to the operating system.
const FLUSH: Duration = Duration::from_secs(1);
/// Minimum size limit of a file, sufficient for the longest datagram with headers.
pub const LEAST_FILE: u64 = 128 << 10;

/// Format of a journal.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum JournalFormat {
    /// Every datagram and fragment on the wire, as pcapng, for `jaus watch`, `jaus decode` and
    /// Wireshark. Traffic over TCP, serial lines and within the node is wrapped in headers as if it
    /// were a datagram.
    #[default]
    Packets,
    /// Whole messages as JSON, one per line, for reading and scripting.
    JsonLines,
}

/// Location, format and limits of a journal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JournalSettings {
    /// The directory. It is created if it does not exist.
    pub directory: PathBuf,
    /// The format.
    pub format: JournalFormat,
    /// Size limit of all files together, in octets.
    pub limit: u64,
    /// Size limit of one file in octets, at least [`LEAST_FILE`] and at most half of the total
    /// limit.
    pub file_limit: u64,
    /// Maximum time span of one file.
    pub file_age: Duration,
}

impl JournalSettings {
    /// Default settings: 1 GiB of packets, in files of at most 64 MiB and one hour.
    #[must_use]
    pub fn new(directory: impl Into<PathBuf>) -> Self {
        Self {
            directory: directory.into(),
            format: JournalFormat::default(),
            limit: 1 << 30,
            file_limit: 64 << 20,
            file_age: Duration::from_secs(3600),
        }
    }

    /// Sets another total limit. Each file takes at most a sixteenth of it.
    #[must_use]
    pub fn limited_to(self, octets: u64) -> Self {
        let file_limit = self.file_limit.min(octets / 16).max(LEAST_FILE);
        Self {
            limit: octets,
            file_limit,
            ..self
        }
    }
}

/// Why a journal cannot be started.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// The directory cannot be used.
    #[error("the log directory {directory} cannot be used: {source}")]
    Directory {
        /// The directory.
        directory: String,
        /// The cause.
        source: io::Error,
    },
    /// The limits contradict each other.
    #[error(
        "a log of {limit} octets in files of {file_limit} cannot be: a file has at least {LEAST_FILE} \
         octets, and the log at least twice as many as a file"
    )]
    Bounds {
        /// [`JournalSettings::limit`].
        limit: u64,
        /// [`JournalSettings::file_limit`].
        file_limit: u64,
    },
    /// The writer thread cannot be started.
    #[error("the log cannot be written: {0}")]
    Thread(io::Error),
}

/// Counters of a journal. They only increase.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct JournalCounters {
    /// Packets or lines written.
    pub written: u64,
    /// Traffic not written because the disk was slow, full or absent.
    pub lost: u64,
}

#[derive(Debug, Default)]
struct Numbers {
    written: AtomicU64,
    lost: AtomicU64,
    /// The current file.
    file: RwLock<Option<PathBuf>>,
}

/// A journal in progress. Dropping it writes the queued data and ends it.
#[derive(Debug)]
pub struct Journal {
    numbers: Arc<Numbers>,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Journal {
    /// Starts a journal of all traffic of `node` from now on.
    ///
    /// # Errors
    /// If the directory is unusable or the limits are invalid.
    pub fn start(node: &Node, settings: &JournalSettings) -> Result<Self, JournalError> {
        Self::of(node.tap(WAITING), Links::of(node.clone()), settings)
    }

    fn of(tap: Tap, links: Links, settings: &JournalSettings) -> Result<Self, JournalError> {
        let (limit, file_limit) = (settings.limit, settings.file_limit);
        if file_limit < LEAST_FILE || file_limit > limit / 2 {
            return Err(JournalError::Bounds { limit, file_limit });
        }
        let unusable = |source| JournalError::Directory {
            directory: settings.directory.display().to_string(),
            source,
        };
        let directory = Directory::open(settings).map_err(unusable)?;
        let numbers = Arc::new(Numbers::default());
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_time()
            .build()
            .map_err(JournalError::Thread)?;
        let (stop, stopped) = oneshot::channel();
        let (theirs, settings) = (numbers.clone(), settings.clone());
        let write = move || {
            let sink = Sink::new(directory, &settings, links);
            runtime.block_on(write(tap, sink, &settings, &theirs, stopped));
        };
        let thread = std::thread::Builder::new().name("jaus-log".to_owned());
        let thread = thread.spawn(write).map_err(JournalError::Thread)?;
        Ok(Self {
            numbers,
            stop: Some(stop),
            thread: Some(thread),
        })
    }

    /// The current counters.
    #[must_use]
    pub fn counters(&self) -> JournalCounters {
        JournalCounters {
            written: self.numbers.written.load(Ordering::Relaxed),
            lost: self.numbers.lost.load(Ordering::Relaxed),
        }
    }

    /// The current file, once there has been traffic.
    #[must_use]
    pub fn file(&self) -> Option<PathBuf> {
        let file = self.numbers.file.read();
        file.unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            // Fails only if the thread has panicked, and then there is nothing to wait for.
            let _ = thread.join();
        }
    }
}

/// The writer thread: runs until the journal is dropped or the node has stopped.
async fn write(
    mut tap: Tap,
    mut sink: Sink,
    settings: &JournalSettings,
    numbers: &Numbers,
    mut stopped: oneshot::Receiver<()>,
) {
    let dictionary = super::Dictionary::new();
    let mut messages = super::MessageStream::new(&dictionary, Filter::default());
    let mut turns = tokio::time::interval(FLUSH);
    turns.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut trouble = Trouble::default();
    let mut is_last = false;
    loop {
        let tapped = tokio::select! {
            biased;
            _ = &mut stopped, if !is_last => { is_last = true; continue; }
            _ = turns.tick() => {
                trouble.may_try = true;
                trouble.note(&settings.directory, sink.flush());
                continue;
            }
            tapped = tap.next(), if !is_last => tapped,
            () = std::future::ready(()), if is_last => tap.try_next(),
        };
        let Some(tapped) = tapped else { break };
        match tapped {
            Tapped::Lost(count) => sink.lose(count),
            Tapped::Passage(passage) if trouble.may_try => {
                let written = match settings.format {
                    JournalFormat::Packets => sink.write_packets(&passage),
                    JournalFormat::JsonLines => sink.write_lines(&passage, &mut messages),
                };
                if !trouble.note(&settings.directory, written) {
                    sink.give_up();
                }
            }
            Tapped::Passage(_) => sink.lose(1),
        }
        sink.tell(numbers);
    }
    trouble.note(&settings.directory, sink.end());
    sink.tell(numbers);
}

/// A failing disk: logged once, and retried every second.
#[derive(Debug)]
struct Trouble {
    may_try: bool,
    told: bool,
}

impl Default for Trouble {
    fn default() -> Self {
        Self {
            may_try: true,
            told: false,
        }
    }
}

impl Trouble {
    /// Records a result. Returns whether it was successful.
    fn note(&mut self, directory: &Path, result: io::Result<()>) -> bool {
        match result {
            Ok(()) => {
                if self.may_try && std::mem::take(&mut self.told) {
                    tracing::info!("the log in {} is written again", directory.display());
                }
                true
            }
            Err(error) => {
                self.may_try = false;
                if !std::mem::replace(&mut self.told, true) {
                    let directory = directory.display();
                    tracing::warn!(
                        "the log in {directory} cannot be written, and is tried again: {error}"
                    );
                }
                false
            }
        }
    }
}
