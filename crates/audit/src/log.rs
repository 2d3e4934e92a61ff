//! The log: a queue, and the thread that writes what is in it.
#![expect(
    clippy::disallowed_methods,
    reason = "the thread of the log waits in real time"
)]

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::entry::{Entry, Outcome};
use crate::file::{Limits, LogFile};
use crate::repeats::Repeats;

/// Entries that may wait for the disk.
const WAITING: usize = 1024;
/// The shortest interval between reports that the log cannot be written.
const REPORT_PAUSE: Duration = Duration::from_secs(60);
/// A wait without an end in sight.
const LONG: Duration = Duration::from_secs(3600);

/// Why an audit log cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error("the audit log {} cannot be written: {source}", .path.display())]
pub struct AuditError {
    /// The file.
    path: PathBuf,
    /// The reason.
    source: io::Error,
}

/// An open audit log. Clones write to the same log; the last one to be dropped waits until all
/// entries are written.
#[derive(Clone, Debug)]
pub struct AuditLog(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    entries: Mutex<Option<SyncSender<Entry>>>,
    lost: Arc<AtomicU64>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

impl AuditLog {
    /// Opens a log, or continues it.
    ///
    /// # Errors
    /// If the file cannot be opened for appending.
    pub fn open(path: &Path, limits: Limits) -> Result<Self, AuditError> {
        let in_file = |source| AuditError {
            path: path.to_owned(),
            source,
        };
        let file = LogFile::open(path, limits).map_err(in_file)?;
        let (entries, queue) = sync_channel(WAITING);
        let lost = Arc::new(AtomicU64::new(0));
        let writer = Writer {
            file,
            lost: lost.clone(),
            repeats: Repeats::default(),
            reported: None,
        };
        let thread = std::thread::Builder::new().name("jaus-audit".to_owned());
        let thread = thread.spawn(move || writer.run(&queue)).map_err(in_file)?;
        Ok(Self(Arc::new(Inner {
            entries: Mutex::new(Some(entries)),
            lost,
            thread: Mutex::new(Some(thread)),
        })))
    }

    /// Adds an entry. Never waits: if the disk is too slow, the entry is lost and counted.
    pub fn write(&self, entry: Entry) {
        let entries = self
            .0
            .entries
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let Some(entries) = &*entries else { return };
        if let Err(TrySendError::Full(_)) = entries.try_send(entry) {
            self.0.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        // Without a sender the thread writes the rest and ends.
        drop(self.entries.get_mut().map(Option::take));
        if let Ok(thread) = self.thread.get_mut()
            && let Some(thread) = thread.take()
        {
            // It has panicked, at worst; then there is nothing left to wait for.
            let _ = thread.join();
        }
    }
}

/// The thread of the log.
struct Writer {
    file: LogFile,
    lost: Arc<AtomicU64>,
    repeats: Repeats,
    /// When an error was last reported.
    reported: Option<Instant>,
}

impl Writer {
    fn run(mut self, queue: &Receiver<Entry>) {
        loop {
            let now = Instant::now();
            let due = self.repeats.due();
            let wait = due.map_or(LONG, |due| due.saturating_duration_since(now));
            let ended = match queue.recv_timeout(wait) {
                Ok(first) => {
                    let entries = std::iter::once(first).chain(queue.try_iter());
                    entries.for_each(|entry| self.note(&entry));
                    false
                }
                Err(RecvTimeoutError::Timeout) => false,
                Err(RecvTimeoutError::Disconnected) => true,
            };
            let until = (!ended).then(Instant::now);
            for counted in self.repeats.take(until) {
                self.append(&counted);
            }
            self.note_losses();
            if let Err(error) = self.file.sync() {
                self.report(&error);
            }
            if ended {
                return;
            }
        }
    }

    fn note(&mut self, entry: &Entry) {
        if self.repeats.is_new(Instant::now(), entry) {
            self.append(entry);
        }
    }

    fn note_losses(&mut self) {
        let lost = self.lost.swap(0, Ordering::Relaxed);
        if lost > 0 {
            let entry = Entry::new("jaus", "audit", Outcome::Failed);
            self.append(&Entry {
                times: lost,
                ..entry.because("entries lost, because the disk was too slow")
            });
        }
    }

    fn append(&mut self, entry: &Entry) {
        let line = serde_json::to_vec(entry).map_err(io::Error::from);
        let appended = line.and_then(|mut line| {
            line.push(b'\n');
            self.file.append(&line)
        });
        if let Err(error) = appended {
            self.report(&error);
        }
    }

    fn report(&mut self, error: &io::Error) {
        let now = Instant::now();
        if self.reported.is_none_or(|at| now >= at + REPORT_PAUSE) {
            self.reported = Some(now);
            tracing::error!(%error, "the audit log cannot be written; entries are lost");
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use serde_json::Value;

    use super::*;

    fn lines(path: &Path) -> Vec<Value> {
        let text = fs::read_to_string(path).unwrap();
        let lines = text.lines().map(serde_json::from_str);
        lines.collect::<Result<_, _>>().unwrap()
    }

    #[test]
    fn each_entry_is_a_line_and_repetitions_are_counted() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("audit.jsonl");
        let log = AuditLog::open(&path, Limits::default()).unwrap();
        for _ in 0..100 {
            log.clone()
                .write(Entry::new("tablet", "SetWrenchEffort", Outcome::Refused).to("101.1.1"));
        }
        log.write(Entry::new("console\n", "login", Outcome::Allowed));
        drop(log);
        let lines = lines(&path);
        assert_eq!(lines.len(), 3);
        assert_eq!(lines[0]["what"], "SetWrenchEffort");
        assert_eq!(lines[0].get("times"), None);
        assert_eq!(lines[1]["who"], r"console\n");
        assert_eq!(lines[2]["times"], 99);
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let error = AuditLog::open(Path::new("/none/audit.jsonl"), Limits::default());
        let error = error.unwrap_err().to_string();
        assert!(error.contains("/none/audit.jsonl"), "{error}");
    }
}
