//! The black box: keeps the latest packets in memory, and writes them when something happens.
//!
//! A file is written twice: at once when a trigger is recognised, and again with what followed. Each
//! version is complete and on the disk before it gets the name. A thread of its own writes, so that a
//! slow disk never keeps packets waiting.

mod report;
mod writer;

use std::future::Future;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Args;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::size;
use jaus_cli::runtime;
use jaus_view::{Dictionary, Filter as MessageFilter, MessageStream, Network};
use jaus_viewers::{
    BlackBox, BlackBoxLimits, Kept, RecordingFormat, Snapshot, Trigger, TriggerKind, Triggers,
};
use serde_json::json;
use tokio::sync::mpsc::Receiver;
use tokio::time::sleep_until;

use super::filter::Filter;
use crate::events::EventPrinter;
use crate::packets::{Packet, Source};
use report::{Content, Report};
use writer::{Job, Writer};

/// The flags of the black box.
#[derive(Args)]
pub(super) struct Flags {
    /// Keep this much of the latest traffic in memory, such as 5min, and write it to files in the
    /// directory when something happens
    #[arg(long, value_name = "DURATION", value_parser = runtime::duration)]
    last: Option<Duration>,

    /// What makes it write, separated by commas: emergency (a component reports an emergency, or one
    /// is commanded), fault (a component reports a failure), control-lost (a client loses control
    /// that it has not released); besides SIGUSR1
    #[arg(long, value_name = "TRIGGER", value_delimiter = ',', requires = "last")]
    on: Vec<TriggerKind>,

    /// Write when a message matches this filter (repeatable); see `jaus watch --help`
    #[arg(long, value_name = "FILTER", requires = "last")]
    on_message: Vec<MessageFilter>,

    /// Add what follows a trigger for this time
    #[arg(
        long,
        value_name = "DURATION",
        default_value = "10s",
        value_parser = within_an_hour,
        requires = "last"
    )]
    after: Duration,

    /// The limit of memory for the traffic; up to three times as much while a file is being written
    #[arg(
        long,
        value_name = "SIZE",
        default_value = "64MiB",
        value_parser = memory,
        requires = "last"
    )]
    memory: usize,

    /// The limit of files in the directory; the oldest are deleted first
    #[arg(
        long,
        value_name = "NUMBER",
        default_value_t = 20,
        value_parser = clap::value_parser!(u16).range(1..),
        requires = "last"
    )]
    files: u16,
}

fn within_an_hour(text: &str) -> Result<Duration, String> {
    runtime::duration_within(text, "100ms", "1h")
}

fn memory(text: &str) -> Result<usize, String> {
    runtime::size_within(text, 128 << 10, 16 << 30)
}

/// How the black box runs.
pub(super) struct Settings {
    directory: PathBuf,
    format: RecordingFormat,
    limits: BlackBoxLimits,
    on: Vec<TriggerKind>,
    on_message: Vec<MessageFilter>,
    after: Duration,
    files: usize,
}

impl Flags {
    /// The settings, if there is to be a black box.
    pub(super) fn settings(
        &self,
        directory: &Path,
        format: Option<RecordingFormat>,
    ) -> Option<Settings> {
        Some(Settings {
            directory: directory.to_owned(),
            format: format.unwrap_or(RecordingFormat::Pcapng),
            limits: BlackBoxLimits {
                time: self.last?,
                octets: self.memory,
            },
            on: self.on.clone(),
            on_message: self.on_message.clone(),
            after: self.after,
            files: self.files.into(),
        })
    }
}

/// Runs the black box until `end`. The file that is pending then is completed, whatever happened.
pub(super) async fn run(
    settings: &Settings,
    source: Source,
    filter: Filter,
    dictionary: Dictionary,
    printer: &mut EventPrinter,
    end: impl Future<Output = ()>,
) -> Result<Outcome, Failure> {
    let dictionary = Arc::new(dictionary);
    let (writer, mut reports) = Writer::start(settings, dictionary.clone())?;
    let mut keeper = Keeper::new(settings, writer);
    let details = json!({ "directory": settings.directory.display().to_string() });
    printer.plain("keeping", details, keeper.announcement())?;
    let watching = Watching {
        source,
        filter,
        requests: Requests::open()?,
        watcher: Watcher::new(settings, &dictionary),
    };
    let result = watching.run(&mut keeper, &mut reports, printer, end).await;
    let completed = keeper.complete(printer);
    // Without the keeper the thread ends after its last file, and so do the reports.
    drop(keeper);
    while let Some(report) = reports.recv().await {
        report.print(printer)?;
    }
    result.and(completed).map(|()| Outcome::Done)
}

/// What the black box watches.
struct Watching<'d> {
    source: Source,
    filter: Filter,
    requests: Requests,
    watcher: Watcher<'d>,
}

impl Watching<'_> {
    async fn run(
        mut self,
        keeper: &mut Keeper<'_>,
        reports: &mut Receiver<Report>,
        printer: &mut EventPrinter,
        end: impl Future<Output = ()>,
    ) -> Result<(), Failure> {
        tokio::pin!(end);
        loop {
            let due = until(keeper.deadline());
            tokio::select! {
                () = &mut end => {
                    let packets = self.source.rest()?;
                    return self.handle_all(&packets, keeper, printer);
                }
                () = due => keeper.complete(printer)?,
                () = self.requests.next() => {
                    keeper.handle_trigger(&Trigger::of_operator(), now(), printer)?;
                }
                Some(report) = reports.recv() => report.print(printer)?,
                packets = self.source.next() => self.handle_all(&packets?, keeper, printer)?,
            }
        }
    }

    fn handle_all(
        &mut self,
        packets: &[Packet],
        keeper: &mut Keeper<'_>,
        printer: &mut EventPrinter,
    ) -> Result<(), Failure> {
        for packet in packets {
            self.handle(packet, keeper, printer)?;
        }
        keeper.add_lost(self.source.take_lost());
        Ok(())
    }

    fn handle(
        &mut self,
        packet: &Packet,
        keeper: &mut Keeper<'_>,
        printer: &mut EventPrinter,
    ) -> Result<(), Failure> {
        let Some(earlier) = self.filter.select(packet) else {
            return Ok(());
        };
        for packet in earlier.iter().chain([packet]) {
            keeper.keep(packet, now());
            if let Some(trigger) = self.watcher.handle(packet, now()) {
                keeper.handle_trigger(&trigger, now(), printer)?;
            }
        }
        Ok(())
    }
}

/// Waits until this time; forever without one.
async fn until(time: Option<Instant>) {
    match time {
        Some(time) => sleep_until(time.into()).await,
        None => std::future::pending().await,
    }
}

#[expect(clippy::disallowed_methods, reason = "a command runs in real time")]
fn now() -> Instant {
    Instant::now()
}

/// Decodes packets, and recognises triggers.
struct Watcher<'d> {
    network: Network,
    messages: MessageStream<'d>,
    triggers: Triggers,
}

impl<'d> Watcher<'d> {
    fn new(settings: &Settings, dictionary: &'d Dictionary) -> Self {
        Self {
            network: Network::of_any_port(),
            messages: MessageStream::new(dictionary, MessageFilter::default()),
            triggers: Triggers::new(&settings.on, settings.on_message.clone()),
        }
    }

    /// The last trigger in the messages that a packet contains or completes.
    fn handle(&mut self, packet: &Packet, now: Instant) -> Option<Trigger> {
        let frame = packet.frame();
        let datagrams = self.network.handle_frame(&frame);
        let entries = datagrams.iter().flat_map(|datagram| {
            let entries = self.messages.read_datagram(frame.time, datagram);
            let from = Some(datagram.source.ip());
            entries.into_iter().map(move |entry| (entry, from))
        });
        entries
            .filter_map(|(entry, from)| self.triggers.handle_entry(&entry, from, now))
            .last()
    }
}

/// The packets in memory, and the file that is not complete yet.
struct Keeper<'s> {
    settings: &'s Settings,
    kept: BlackBox,
    pending: Option<Pending>,
    /// Number of lost packets that no packet in memory mentions yet.
    lost_before_next: u64,
    writer: Writer,
}

/// A file that will be written again, with what followed.
struct Pending {
    until: Instant,
    file: PathBuf,
    /// Number of triggers so far.
    triggers: u64,
    before: Snapshot,
    since: BlackBox,
}

impl<'s> Keeper<'s> {
    const fn new(settings: &'s Settings, writer: Writer) -> Self {
        Self {
            settings,
            kept: BlackBox::new(settings.limits),
            pending: None,
            lost_before_next: 0,
            writer,
        }
    }

    fn announcement(&self) -> String {
        let Settings {
            limits, directory, ..
        } = self.settings;
        let triggers = self.settings.on.iter().map(TriggerKind::to_string);
        let messages = self.settings.on_message.iter().map(|it| format!("`{it}`"));
        let triggers: Vec<_> = triggers.chain(messages).collect();
        let or = match triggers.is_empty() {
            true => String::new(),
            false => format!("{} or ", triggers.join(", ")),
        };
        format!(
            "the last {} stay in memory, at most {}; on {or}SIGUSR1 (kill -USR1 {}) they go to {}",
            runtime::in_words(limits.time),
            size(limits.octets as u64),
            std::process::id(),
            directory.display(),
        )
    }

    fn keep(&mut self, packet: &Packet, now: Instant) {
        let frame = packet.frame();
        let kept = Kept {
            interface: packet.interface.as_str().into(),
            link: frame.link,
            time: packet.time,
            octets: packet.octets.clone(),
            lost: std::mem::take(&mut self.lost_before_next),
        };
        if let Some(pending) = &mut self.pending {
            pending.since.push(now, kept.clone());
        }
        self.kept.push(now, kept);
    }

    /// Counts lost packets. The next packet in memory mentions them.
    const fn add_lost(&mut self, packets: u64) {
        self.lost_before_next += packets;
    }

    /// When the pending file is to be completed.
    fn deadline(&self) -> Option<Instant> {
        self.pending.as_ref().map(|pending| pending.until)
    }

    /// Writes what is in memory. A trigger while a file is pending belongs to that file, and is
    /// counted.
    fn handle_trigger(
        &mut self,
        trigger: &Trigger,
        now: Instant,
        printer: &mut EventPrinter,
    ) -> Result<(), Failure> {
        if let Some(pending) = &mut self.pending {
            pending.triggers += 1;
            return Ok(());
        }
        let details = json!({ "kind": trigger.kind.name(), "source": trigger.source });
        let of = match &*trigger.source {
            "" => String::new(),
            source => format!(" of {source}"),
        };
        printer.timed("trigger", details, format_args!("{}{of}", trigger.kind))?;
        let before = self.kept.snapshot();
        let file = self.writer.reserve(trigger.kind.name());
        let job = self.job(&file, before.clone(), 1);
        if self.writer.is_busy() {
            // One more file in memory would exceed the limit.
            return job.refused().print(printer);
        }
        self.enqueue(job, printer)?;
        self.pending = Some(Pending {
            until: now + self.settings.after,
            file,
            triggers: 1,
            before,
            since: BlackBox::new(BlackBoxLimits {
                time: Duration::MAX,
                ..self.settings.limits
            }),
        });
        Ok(())
    }

    /// Writes the pending file again, with what followed.
    fn complete(&mut self, printer: &mut EventPrinter) -> Result<(), Failure> {
        match self.pending.take() {
            Some(pending) => {
                let all = pending.before.followed_by(pending.since.snapshot());
                let job = self.job(&pending.file, all, pending.triggers);
                self.enqueue(job, printer)
            }
            None => Ok(()),
        }
    }

    fn job(&self, file: &Path, snapshot: Snapshot, triggers: u64) -> Job {
        let content = Content {
            packets: snapshot.frames().len(),
            lost: snapshot.lost() + self.lost_before_next,
            triggers,
        };
        Job {
            file: file.to_owned(),
            snapshot,
            content,
        }
    }

    fn enqueue(&self, job: Job, printer: &mut EventPrinter) -> Result<(), Failure> {
        match self.writer.enqueue(job) {
            Ok(()) => Ok(()),
            Err(refused) => refused.print(printer),
        }
    }
}

/// Requests of the operator: the signal SIGUSR1.
struct Requests {
    #[cfg(unix)]
    signal: tokio::signal::unix::Signal,
}

impl Requests {
    #[cfg(unix)]
    fn open() -> Result<Self, Failure> {
        use tokio::signal::unix::{SignalKind, signal};
        let signal = signal(SignalKind::user_defined1());
        let signal =
            signal.map_err(|error| Failure::new(format!("cannot handle SIGUSR1: {error}")));
        Ok(Self { signal: signal? })
    }

    #[cfg(unix)]
    async fn next(&mut self) {
        self.signal.recv().await;
    }

    #[cfg(not(unix))]
    fn open() -> Result<Self, Failure> {
        Ok(Self {})
    }

    #[cfg(not(unix))]
    async fn next(&mut self) {
        std::future::pending().await
    }
}
