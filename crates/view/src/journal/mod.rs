//! The log of a node on disk: all traffic, in rotated files.
//!
//! A [`Journal`] reads a [tap](Node::tap) of the node, which is its bounded queue, and writes in a
//! thread of its own, so a slow card blocks nothing. If the thread is too slow, entries are dropped
//! and counted, and the log records how many and where. A file is closed at its size or age limit,
//! and the oldest files are deleted before the directory exceeds its limit. Entries reach the
//! operating system within a second, in whole blocks or lines, and remain readable after a crash.

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
use super::dictionary::Dictionary;
use super::stream::{Filter, Links, MessageStream};
use jaus::node::{Node, Tap, Tapped};

/// Passages that may wait to be written.
const WAITING: usize = 8192;
/// How often everything is handed to the operating system.
const FLUSH: Duration = Duration::from_secs(1);
/// The smallest limit of a file: the longest datagram and its headers fit.
pub const LEAST_FILE: u64 = 128 << 10;

/// The format of the files.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum JournalFormat {
    /// Every datagram and fragment unchanged, as pcapng: for `jaus watch`, `jaus decode` and
    /// Wireshark. Messages of TCP connections and serial lines, and messages within the node, are
    /// written as datagrams.
    #[default]
    Packets,
    /// Whole messages as JSON, one per line: for people and scripts.
    JsonLines,
}

/// The settings of a log: its directory, format and limits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JournalSettings {
    /// The directory; created if it is missing.
    pub directory: PathBuf,
    /// The format.
    pub format: JournalFormat,
    /// Limit of all files together, in octets.
    pub limit: u64,
    /// Limit of one file, in octets: at least [`LEAST_FILE`], at most half of `limit`.
    pub file_limit: u64,
    /// Age limit of one file.
    pub file_age: Duration,
}

impl JournalSettings {
    /// The default settings: pcapng, 1 GiB in all, files of at most 64 MiB and one hour.
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

    /// Sets the limit of all files together, and limits one file to a sixteenth of it.
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

/// Why a log cannot be started.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// The directory cannot be used.
    #[error("the log directory {directory} cannot be used: {source}")]
    Directory {
        /// The directory.
        directory: String,
        /// The error of the operating system.
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
    /// The thread cannot be started.
    #[error("the log cannot be written: {0}")]
    Thread(io::Error),
}

/// Counts of a log since its start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct JournalCounters {
    /// Packets or lines written.
    pub written: u64,
    /// Packets or messages not written, because the disk was too slow, full or missing.
    pub lost: u64,
}

#[derive(Debug, Default)]
struct Numbers {
    written: AtomicU64,
    lost: AtomicU64,
    /// The current file.
    file: RwLock<Option<PathBuf>>,
}

/// A running log. Dropping it writes the waiting entries and ends it.
///
/// ```no_run
/// # use jaus::node::Node;
/// # use jaus_view::{Dictionary, Journal, JournalError, JournalSettings};
/// # fn example(node: &Node) -> Result<(), JournalError> {
/// let settings = JournalSettings::new("/var/log/jaus").limited_to(200 << 20);
/// let journal = Journal::start(node, &settings, Dictionary::new())?;
/// println!("{} packets written", journal.counters().written);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Journal {
    numbers: Arc<Numbers>,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Journal {
    /// Starts a log of all traffic of `node` from now on. `dictionary` decodes the messages if the
    /// format is JSON.
    ///
    /// # Errors
    /// If the directory cannot be used, or the limits contradict each other.
    pub fn start(
        node: &Node,
        settings: &JournalSettings,
        dictionary: Dictionary,
    ) -> Result<Self, JournalError> {
        let (tap, links) = (node.tap(WAITING), Links::of(node.clone()));
        Self::of(tap, links, settings, dictionary)
    }

    fn of(
        tap: Tap,
        links: Links,
        settings: &JournalSettings,
        dictionary: Dictionary,
    ) -> Result<Self, JournalError> {
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
            let messages = MessageStream::new(&dictionary, Filter::default());
            runtime.block_on(write(tap, sink, messages, &settings, &theirs, stopped));
        };
        let thread = std::thread::Builder::new().name("jaus-log".to_owned());
        let thread = thread.spawn(write).map_err(JournalError::Thread)?;
        Ok(Self {
            numbers,
            stop: Some(stop),
            thread: Some(thread),
        })
    }

    /// Its counts so far.
    #[must_use]
    pub fn counters(&self) -> JournalCounters {
        JournalCounters {
            written: self.numbers.written.load(Ordering::Relaxed),
            lost: self.numbers.lost.load(Ordering::Relaxed),
        }
    }

    /// The current file; `None` before the first entry.
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
            // It has panicked, at worst; then there is nothing left to wait for.
            let _ = thread.join();
        }
    }
}

/// The thread: writes until it or the node stops.
async fn write(
    mut tap: Tap,
    mut sink: Sink,
    mut messages: MessageStream<'_>,
    settings: &JournalSettings,
    numbers: &Numbers,
    mut stopped: oneshot::Receiver<()>,
) {
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

/// A disk that does not do what it should: said once, and tried again every second.
#[derive(Debug)]
struct Trouble {
    may_try: bool,
    /// Whether the trouble was logged.
    is_logged: bool,
}

impl Default for Trouble {
    fn default() -> Self {
        Self {
            may_try: true,
            is_logged: false,
        }
    }
}

impl Trouble {
    /// Whether it went well.
    fn note(&mut self, directory: &Path, result: io::Result<()>) -> bool {
        match result {
            Ok(()) => {
                if self.may_try && std::mem::take(&mut self.is_logged) {
                    tracing::info!("the log in {} is written again", directory.display());
                }
                true
            }
            Err(error) => {
                self.may_try = false;
                if !std::mem::replace(&mut self.is_logged, true) {
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
