//! The log: a queue, and the thread that writes what is in it.
#![expect(
    clippy::disallowed_methods,
    reason = "the thread of the log waits in real time"
)]

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::action::Action;
use crate::entry::{Entry, Outcome};
use crate::file::Limits;
use crate::forward::{ForwardTo, Forwarder};
use crate::stream::Stream;

/// Entries that may wait for the disk; refusals have half of the places.
const WAITING: usize = 1024;
/// The shortest interval between reports that the log cannot be written.
const REPORT_PAUSE: Duration = Duration::from_secs(60);
/// How often writing is tried again after an error.
const RETRY: Duration = Duration::from_secs(1);
/// A wait without an end in sight.
const LONG: Duration = Duration::from_secs(3600);

/// Why an audit log cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error("the audit log {} cannot be written: {source}", .path.display())]
pub struct AuditError {
    /// The file, or the place to which it is forwarded.
    path: PathBuf,
    /// The reason.
    source: io::Error,
}

/// What happens while the log cannot be written, such as on a full disk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unwritable {
    /// Everything goes on, with an error in the program's log.
    #[default]
    GoOn,
    /// Commands and requests for control are refused, too. Stops and queries are not.
    RefuseCommands,
}

/// The settings of a log.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct AuditSettings {
    /// The limits of each of its two files.
    pub limits: Limits,
    /// What happens while it cannot be written.
    pub unwritable: Unwritable,
    /// Where entries go besides.
    pub forward: Option<ForwardTo>,
}

impl AuditSettings {
    /// Sets what happens while the log cannot be written.
    #[must_use]
    pub const fn unwritable(mut self, unwritable: Unwritable) -> Self {
        self.unwritable = unwritable;
        self
    }

    /// Forwards entries as well.
    #[must_use]
    pub fn forward(mut self, to: Option<ForwardTo>) -> Self {
        self.forward = to;
        self
    }
}

/// An open audit log. Clones write to the same log; the last one to be dropped waits until all
/// entries are written.
#[derive(Clone, Debug)]
pub struct AuditLog(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    entries: Mutex<Option<SyncSender<Entry>>>,
    shared: Arc<Shared>,
    unwritable: Unwritable,
    thread: Mutex<Option<JoinHandle<()>>>,
}

/// What the log and its thread know of each other.
#[derive(Debug, Default)]
struct Shared {
    /// Entries for which there was no room in the queue.
    lost: AtomicU64,
    lost_refusals: AtomicU64,
    /// Refusals in the queue.
    refusals: AtomicUsize,
    /// Whether the last attempt to write has failed.
    is_broken: AtomicBool,
}

/// The file of the refusals beside that of the evidence: `audit-refused.jsonl` beside `audit.jsonl`.
#[must_use]
pub fn refusals_of(path: &Path) -> PathBuf {
    let mut name = path.file_stem().map_or_else(OsString::new, OsString::from);
    name.push("-refused");
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

impl AuditLog {
    /// Opens a log, or continues it.
    ///
    /// # Errors
    /// If a file cannot be opened for appending, or is another program's; or if the place to forward to
    /// cannot be reached.
    pub fn open(path: &Path, settings: AuditSettings) -> Result<Self, AuditError> {
        let refusals = refusals_of(path);
        let at = |path: &Path| {
            let path = path.to_owned();
            move |source| AuditError { path, source }
        };
        let limits = settings.limits;
        let forward = settings.forward.map(|to| {
            let place = PathBuf::from(to.to_string());
            Forwarder::open(to).map_err(at(&place))
        });
        let shared = Arc::new(Shared::default());
        let writer = Writer {
            evidence: Stream::open(path, limits, Outcome::Allowed).map_err(at(path))?,
            refusals: Stream::open(&refusals, limits, Outcome::Refused).map_err(at(&refusals))?,
            forward: forward.transpose()?,
            shared: shared.clone(),
            unwritten: 0,
            reported: None,
        };
        let (entries, queue) = sync_channel(WAITING);
        let thread = std::thread::Builder::new().name("jaus-audit".to_owned());
        let thread = thread.spawn(move || writer.run(&queue)).map_err(at(path))?;
        Ok(Self(Arc::new(Inner {
            entries: Mutex::new(Some(entries)),
            shared,
            unwritable: settings.unwritable,
            thread: Mutex::new(Some(thread)),
        })))
    }

    /// Adds an entry. Never waits: if the disk is too slow, the entry is lost and counted, refusals first.
    pub fn write(&self, entry: Entry) {
        let entries = &self.0.entries;
        let entries = entries.lock().unwrap_or_else(PoisonError::into_inner);
        let (Some(entries), shared) = (&*entries, &self.0.shared) else {
            return;
        };
        let is_refusal = entry.result == Outcome::Refused;
        let lost = match is_refusal {
            true => &shared.lost_refusals,
            false => &shared.lost,
        };
        let one = usize::from(is_refusal);
        let waiting = shared.refusals.fetch_add(one, Ordering::Relaxed);
        let has_room = !is_refusal || waiting < WAITING / 2;
        if !has_room || entries.try_send(entry).is_err() {
            shared.refusals.fetch_sub(one, Ordering::Relaxed);
            lost.fetch_add(1, Ordering::Relaxed);
            if !is_refusal {
                // A disk that hangs gives the thread no error.
                shared.is_broken.store(true, Ordering::Relaxed);
            }
        }
    }

    /// Whether commands are to be refused, because what they do could not be recorded.
    #[must_use]
    pub fn refuses_commands(&self) -> bool {
        let is_broken = self.0.shared.is_broken.load(Ordering::Relaxed);
        is_broken && self.0.unwritable == Unwritable::RefuseCommands
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
    evidence: Stream,
    refusals: Stream,
    forward: Option<Forwarder>,
    shared: Arc<Shared>,
    /// Entries that could not be written.
    unwritten: u64,
    /// When an error was last reported.
    reported: Option<Instant>,
}

impl Writer {
    fn run(mut self, queue: &Receiver<Entry>) {
        loop {
            let now = Instant::now();
            let due = self.evidence.due().into_iter().chain(self.refusals.due());
            let due = due.min();
            let wait = due.map_or(LONG, |due| due.saturating_duration_since(now));
            let wait = if self.unwritten > 0 {
                wait.min(RETRY)
            } else {
                wait
            };
            let ended = match queue.recv_timeout(wait) {
                Ok(first) => {
                    let entries = std::iter::once(first).chain(queue.try_iter());
                    entries.for_each(|entry| self.note(&entry));
                    false
                }
                Err(RecvTimeoutError::Timeout) => false,
                Err(RecvTimeoutError::Disconnected) => true,
            };
            self.write_counted((!ended).then(Instant::now));
            self.note_losses();
            self.sync();
            if ended {
                return;
            }
        }
    }

    fn note(&mut self, entry: &Entry) {
        if self.stream(entry).admits(Instant::now(), entry) {
            self.append(entry, true);
        }
        if entry.result == Outcome::Refused {
            self.shared.refusals.fetch_sub(1, Ordering::Relaxed);
        }
    }

    fn write_counted(&mut self, until: Option<Instant>) {
        let counted = [&mut self.evidence, &mut self.refusals].map(|it| it.counted(until));
        for entry in counted.into_iter().flatten() {
            self.append(&entry, true);
        }
    }

    /// The file for entries of this kind.
    fn stream(&mut self, entry: &Entry) -> &mut Stream {
        match entry.result {
            Outcome::Refused => &mut self.refusals,
            _ => &mut self.evidence,
        }
    }

    /// Appends an entry to the file of its kind, and forwards it; also if it cannot be written, if so wanted.
    fn append(&mut self, entry: &Entry, forwards_unwritten: bool) {
        let mut forward = self.forward.take();
        let written = self.stream(entry).append(entry, |file, line, is_written| {
            if let Some(forward) = forward.as_mut()
                && (is_written || forwards_unwritten)
            {
                forward.send(entry, &line.copy(file, is_written));
            }
        });
        self.forward = forward;
        if let Err(error) = written {
            self.unwritten += 1;
            self.report(&error);
        }
    }

    /// Records what is not recorded, in the file in which it is missing.
    fn note_losses(&mut self) {
        let slow = "the disk was too slow";
        let failed = "the log could not be written";
        let unwritten = std::mem::take(&mut self.unwritten);
        for (lost, why) in [
            (self.shared.lost.swap(0, Ordering::Relaxed), slow),
            (unwritten, failed),
        ] {
            if lost > 0 {
                let entry = Entry::new("jaus", Action::EntriesLost, Outcome::Failed);
                let before = self.unwritten;
                // It is tried each second. Those that were not written have been forwarded.
                self.append(&entry.because(why).times(lost), false);
                if self.unwritten > before {
                    // Itself was not written either; it is no entry that is lost.
                    self.unwritten = before + lost;
                }
            }
        }
        let refusals = self.shared.lost_refusals.swap(0, Ordering::Relaxed);
        if refusals > 0 {
            let entry = Entry::new("jaus", Action::EntriesLost, Outcome::Refused);
            self.append(&entry.because(slow).times(refusals), false);
        }
    }

    /// Waits for the disk, and notes whether the log can be written.
    fn sync(&mut self) {
        let synced = self.evidence.sync().and_then(|()| self.refusals.sync());
        if let Err(error) = &synced {
            self.report(error);
        }
        let is_broken = synced.is_err() || self.unwritten > 0;
        let was_broken = self.shared.is_broken.swap(is_broken, Ordering::Relaxed);
        if was_broken && !is_broken {
            self.reported = None;
            tracing::info!("the audit log is written again");
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
    fn each_entry_is_a_line_and_repeated_refusals_are_counted() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("audit.jsonl");
        let log = AuditLog::open(&path, AuditSettings::default()).unwrap();
        for _ in 0..100 {
            let entry = |result| Entry::new("tablet", "Reset", result).to("101.1.1");
            log.clone().write(entry(Outcome::Refused));
            log.write(entry(Outcome::Allowed));
        }
        log.write(Entry::new("console\n", "login", Outcome::Allowed));
        drop(log);
        let evidence = lines(&path);
        assert_eq!(
            (evidence.len(), &evidence[0]["what"]),
            (101, &"Reset".into())
        );
        assert_eq!(evidence[0].get("times"), None);
        assert_eq!(evidence[100]["who"], r"console\n");
        let refused = lines(&refusals_of(&path));
        assert_eq!(refused.len(), 2);
        assert_eq!(
            (&refused[1]["times"], &refused[1]["number"]),
            (&99.into(), &2.into())
        );
    }

    #[test]
    fn refusals_have_a_file_of_their_own_and_push_no_evidence_out() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("audit.jsonl");
        let settings = AuditSettings {
            limits: Limits {
                file: 4096,
                kept: 1,
            },
            ..AuditSettings::default()
        };
        let log = AuditLog::open(&path, settings).unwrap();
        log.write(Entry::new("console", "RequestControl", Outcome::Allowed));
        for index in 0..20_000 {
            let refusal = Entry::new(format!("host {index}"), "connect", Outcome::Refused);
            log.write(refusal.because(index));
        }
        log.write(Entry::new("console", "ReleaseControl", Outcome::Allowed));
        drop(log);
        let evidence = lines(&path);
        let whats: Vec<_> = evidence.iter().map(|it| &it["what"]).collect();
        assert_eq!(whats, ["RequestControl", "ReleaseControl"]);
        let refused = lines(&folder.path().join("audit-refused.jsonl"));
        assert!(
            refused.iter().any(|it| it["times"].as_u64() > Some(1)),
            "they are counted"
        );
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn while_it_cannot_be_written_entries_are_forwarded_and_commands_refused_if_so_set() {
        // Rotation fails, because a folder is in its way.
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("audit.jsonl");
        let obstacle = folder.path().join("audit.jsonl.1");
        let journald = folder.path().join("socket");
        let copies = std::os::unix::net::UnixDatagram::bind(&journald).unwrap();
        let patience = Some(Duration::from_secs(20));
        copies.set_read_timeout(patience).unwrap();
        let settings = AuditSettings {
            limits: Limits { file: 10, kept: 1 },
            ..AuditSettings::default()
        };
        let wait_for = |what: &dyn Fn() -> bool| {
            let end = Instant::now() + Duration::from_secs(20);
            while !what() && Instant::now() < end {
                std::thread::sleep(Duration::from_millis(10));
            }
            assert!(what());
        };
        let settings = settings
            .unwritable(Unwritable::RefuseCommands)
            .forward(Some(ForwardTo::Journald(journald)));
        let log = AuditLog::open(&path, settings).unwrap();
        fs::create_dir_all(obstacle.join("not empty")).unwrap();
        for what in ["one", "two", "three"] {
            log.write(Entry::new("console", what, Outcome::Allowed));
        }
        wait_for(&|| log.refuses_commands());
        fs::remove_dir_all(&obstacle).unwrap();
        wait_for(&|| !log.refuses_commands());
        drop(log);
        let last = lines(&path).pop().unwrap();
        assert_eq!(
            (&last["result"], &last["times"]),
            (&"failed".into(), &2.into())
        );
        crate::verify(&path, None).unwrap();
        // The copy has all of them, and shows which the file lacks.
        let mut octets = [0; 2000];
        let mut copy = || -> Value {
            let length = copies.recv(&mut octets).unwrap();
            let text = std::str::from_utf8(&octets[..length]).unwrap();
            let line = text.lines().next().unwrap();
            serde_json::from_str(line.strip_prefix("MESSAGE=").unwrap()).unwrap()
        };
        let all = [copy(), copy(), copy(), copy()];
        let of = |key: &str| all.each_ref().map(|it| it[key].clone());
        assert_eq!(of("what"), ["one", "two", "three", "entries lost"]);
        assert_eq!(of("number"), [1, 2, 2, 2]);
        let (no, yes) = (Value::Null, Value::Bool(true));
        assert_eq!(of("unwritten"), [no.clone(), yes.clone(), yes, no]);
        assert_eq!(all[3]["after"], all[0]["hash"]);
        let noted = (2, all[3]["hash"].as_str().unwrap());
        crate::verify(&path, Some(noted)).unwrap();
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let error = AuditLog::open(Path::new("/none/audit.jsonl"), AuditSettings::default());
        let error = error.unwrap_err().to_string();
        assert!(error.contains("/none/audit.jsonl"), "{error}");
    }
}
