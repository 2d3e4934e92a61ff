//! The thread that writes the files of the black box.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use jaus_cli::failure::Failure;
use jaus_view::{Dictionary, Network, Timestamp};
use jaus_viewers::{BlackBoxFiles, BlackBoxNames, Recorder, RecordingFormat, Snapshot};
use tokio::sync::mpsc;

use super::Settings;
use super::report::{Content, Report, Written};

/// Limit of files that wait to be written: the first and the complete version of one.
const WAITING: usize = 2;
/// Limit of reports that wait to be printed.
const REPORTS: usize = 16;
/// An MCAP file has samples up to this multiple of the limit of memory; then frames alone.
const SAMPLES: u64 = 8;

/// Why a file is not written if the thread has not caught up.
const BUSY: &str = "the disk is still busy with the file before it";

/// A file to write.
pub(super) struct Job {
    pub(super) file: PathBuf,
    pub(super) snapshot: Snapshot,
    pub(super) content: Content,
}

impl Job {
    /// The report that it is not written, because the thread is busy.
    pub(super) fn refused(self) -> Report {
        Report {
            file: self.file,
            content: self.content,
            deleted: 0,
            result: Err(BUSY.to_owned()),
        }
    }
}

/// Hands jobs to the thread, which ends with the last job when this is dropped.
pub(super) struct Writer {
    jobs: SyncSender<Job>,
    names: BlackBoxNames,
    format: RecordingFormat,
    /// Number of jobs that are not done.
    waiting: Arc<AtomicUsize>,
}

impl Writer {
    /// Starts the thread. The reports end when it has ended.
    pub(super) fn start(
        settings: &Settings,
        dictionary: Arc<Dictionary>,
    ) -> Result<(Self, mpsc::Receiver<Report>), Failure> {
        let (files, names) = BlackBoxFiles::open(&settings.directory, settings.files)
            .map_err(|error| Failure::file(&settings.directory, &error))?;
        let (jobs, queue) = sync_channel(WAITING);
        let (reports, written) = mpsc::channel(REPORTS);
        let waiting = Arc::new(AtomicUsize::new(0));
        let thread = Thread {
            files,
            waiting: waiting.clone(),
            format: settings.format,
            dictionary,
            sample_limit: SAMPLES * settings.limits.octets as u64,
        };
        std::thread::Builder::new()
            .name("black-box".to_owned())
            .spawn(move || thread.run(&queue, &reports))
            .map_err(|error| Failure::new(format!("cannot start a thread: {error}")))?;
        let writer = Self {
            jobs,
            names,
            format: settings.format,
            waiting,
        };
        Ok((writer, written))
    }

    /// The name of a new file.
    pub(super) fn reserve(&mut self, reason: &str) -> PathBuf {
        #[expect(
            clippy::disallowed_methods,
            reason = "files are named after the time of day"
        )]
        let time = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        let time = Timestamp::since_1970(time.unwrap_or_default(), 0);
        self.names.reserve(time, reason, self.format.extension())
    }

    /// Whether the thread still writes.
    pub(super) fn is_busy(&self) -> bool {
        self.waiting.load(Ordering::Relaxed) > 0
    }

    /// Queues a job. Never waits.
    ///
    /// # Errors
    /// A report, if the disk is too slow for one more.
    pub(super) fn enqueue(&self, job: Job) -> Result<(), Report> {
        self.waiting.fetch_add(1, Ordering::Relaxed);
        self.jobs.try_send(job).map_err(|error| {
            self.waiting.fetch_sub(1, Ordering::Relaxed);
            let (std::sync::mpsc::TrySendError::Full(job)
            | std::sync::mpsc::TrySendError::Disconnected(job)) = error;
            job.refused()
        })
    }
}

/// What the thread needs.
struct Thread {
    files: BlackBoxFiles,
    waiting: Arc<AtomicUsize>,
    format: RecordingFormat,
    dictionary: Arc<Dictionary>,
    sample_limit: u64,
}

impl Thread {
    fn run(mut self, jobs: &Receiver<Job>, reports: &mpsc::Sender<Report>) {
        for job in jobs {
            let deleted = self.files.deleted_on_full_disk();
            let written = self.write(&job.file, &job.snapshot);
            self.waiting.fetch_sub(1, Ordering::Relaxed);
            let report = Report {
                file: job.file,
                content: job.content,
                deleted: self.files.deleted_on_full_disk() - deleted,
                result: written.map_err(|error| error.to_string()),
            };
            if reports.blocking_send(report).is_err() {
                return;
            }
        }
    }

    fn write(&mut self, file: &Path, snapshot: &Snapshot) -> std::io::Result<Written> {
        let (format, dictionary) = (self.format, &self.dictionary);
        let sample_limit = self.sample_limit;
        let mut written = Written {
            octets: 0,
            left_out: 0,
        };
        self.files.write(file, |out| {
            let mut out = BufWriter::new(out);
            let network = Network::of_any_port();
            let mut recorder = Recorder::new(&mut out, format, dictionary, network)?;
            recorder.limit_samples(sample_limit);
            for kept in snapshot.frames() {
                recorder.write_frame(&kept.frame())?;
            }
            let left_out = recorder.left_out();
            let octets = recorder.finish()?;
            written = Written { octets, left_out };
            out.flush()
        })?;
        Ok(written)
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use jaus_view::LinkType;
    use jaus_viewers::{BlackBox, BlackBoxLimits, Kept};

    use super::*;

    /// 42.1.1 queries the heartbeat of 101.1.1.
    fn query() -> Kept {
        let mut octets = Vec::new();
        let datagram = b"\x02\x00\x10\x00\x01\x01\x01\x65\x00\x01\x01\x2A\x00\x02\x22\x07\x00";
        etherparse::PacketBuilder::ipv4([10, 0, 0, 1], [10, 0, 0, 2], 16)
            .udp(3794, 3794)
            .write(&mut octets, datagram)
            .unwrap();
        Kept {
            interface: "eth0".into(),
            link: LinkType::RAW,
            time: Timestamp::new(1_790_000_000, 0, 9),
            octets: octets.into(),
            lost: 0,
        }
    }

    fn settings(directory: &Path) -> Settings {
        Settings {
            directory: directory.to_owned(),
            format: RecordingFormat::Mcap,
            // No room for samples.
            limits: BlackBoxLimits {
                time: Duration::MAX,
                octets: 0,
            },
            on: Vec::new(),
            on_message: Vec::new(),
            after: Duration::ZERO,
            files: 20,
        }
    }

    #[test]
    #[expect(clippy::disallowed_methods, reason = "the test begins at some time")]
    fn a_report_has_the_number_of_messages_that_are_in_the_frames_alone() {
        let folder = tempfile::tempdir().unwrap();
        let settings = settings(folder.path());
        let started = Writer::start(&settings, Arc::new(Dictionary::new().with_catalogue()));
        let (mut writer, mut reports) = started.unwrap_or_else(|failure| panic!("{failure}"));
        let mut kept = BlackBox::new(BlackBoxLimits {
            octets: 1 << 20,
            ..settings.limits
        });
        kept.push(Instant::now(), query());
        let content = Content {
            packets: 1,
            lost: 0,
            triggers: 1,
        };
        let job = Job {
            file: writer.reserve("operator"),
            snapshot: kept.snapshot(),
            content,
        };
        assert!(writer.enqueue(job).is_ok());
        let written = reports.blocking_recv().unwrap().result.unwrap();
        assert_eq!(written.left_out, 1);
    }
}
