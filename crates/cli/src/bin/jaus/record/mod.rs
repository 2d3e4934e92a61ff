//! `jaus record`: records the traffic of JAUS peers into a file, or keeps it until something happens.

mod black_box;
mod connections;
mod file;
mod filter;

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use jaus::link::Group;
use jaus::node::units;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::say;
use jaus_cli::runtime::{self, RunFor};
use jaus_view::{Dictionary, JAUS_PORT};
use jaus_viewers::RecordingFormat;
use tokio::time::{MissedTickBehavior, interval};

use crate::definitions::Definitions;
use crate::events::{EventFormat, EventPrinter};
use crate::packets::{Packet, Source};
use black_box::Flags as BlackBoxFlags;
use file::{Recording, STANDARD_OUTPUT, Tally};
use filter::Filter;

/// Record JAUS traffic to a file, for `jaus decode`, `jaus replay`, Wireshark, Foxglove and PlotJuggler
///
/// The file is pcapng, or MCAP if its name ends with .mcap: with a channel for each source and
/// message, and the frames themselves.
///
/// With --last it is a black box: the latest traffic stays in memory, and a file is written to a
/// directory when something happens: --on names what, and the signal SIGUSR1 asks for a file at any
/// time.
///
/// With the privilege to open packet sockets (root, or `setcap cap_net_raw+ep jaus`) it records all
/// traffic of this host: UDP and TCP of the chosen ports, and datagrams and TCP connections of other
/// ports whose content is JAUS. Without it, it records only the multicast group and prints a note.
/// Press Ctrl-C to end; packets are on disk within a second.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus record drive.pcapng\n  \
    jaus record drive.pcapng --interface eth0 --for 1min\n  \
    jaus record drive.pcapng --size 500MB --quiet &\n  \
    jaus record - | jaus decode -\n  \
    jaus decode drive.pcapng\n  \
    jaus record drive.mcap                 for Foxglove and PlotJuggler\n  \
    jaus record /var/log/jaus --last 5min --on emergency,fault,control-lost\n  \
    jaus record boxes --last 1min --on-message 'message=ReportStatus status=shutdown' --format mcap\n\n\
    Events of --json, on standard output: \"progress\" each second and \"end\", with \"packets\", \
    \"octets\", the number of packets \"lost\" because they came too fast, and of messages \
    \"left_out\" of the channels of an MCAP file. Of a black box: \"keeping\", then for each file \
    \"trigger\" with its \"kind\" and \"source\", and \"written\" with the \"file\", the same numbers, \
    the number of its \"triggers\", and of older files \"deleted\" because the disk was full; the \
    second time with --after. \"failed\" has an \"error\" instead of a size.")]
pub(crate) struct Record {
    /// The file to write, which must not exist without --overwrite; - is standard output. With
    /// --last, a directory
    #[arg(value_name = "FILE")]
    file: PathBuf,

    /// The format: pcapng or mcap [default: mcap if the file's name ends with .mcap, else pcapng]
    #[arg(long, value_name = "FORMAT")]
    format: Option<RecordingFormat>,

    /// Overwrite an existing file
    #[arg(long, conflicts_with = "last")]
    overwrite: bool,

    /// Record only this interface, by name or address (repeatable) [default: all, including
    /// loopback]
    #[arg(long, value_name = "INTERFACE")]
    interface: Vec<String>,

    /// Record this UDP and TCP port (repeatable)
    #[arg(long, default_values_t = [JAUS_PORT])]
    port: Vec<u16>,

    /// The multicast group to record without packet sockets
    #[arg(long, value_name = "ADDRESS", default_value_t)]
    group: Group,

    #[command(flatten)]
    run_for: RunFor,

    /// End when the file reaches this size, such as 500MB
    #[arg(long, value_name = "SIZE", value_parser = units::size, conflicts_with = "last")]
    size: Option<usize>,

    /// Print no progress
    #[arg(long, short)]
    quiet: bool,

    #[command(flatten)]
    definitions: Definitions,

    #[command(flatten)]
    black_box: BlackBoxFlags,

    #[command(flatten)]
    events: EventFormat,
}

impl Record {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        if self.events.is_json() && self.file == Path::new(STANDARD_OUTPUT) {
            return Err(Failure::new(
                "--json prints events on standard output, where `-` writes the recording: name a file",
            ));
        }
        let dictionary = self.definitions.load()?;
        if let Some(settings) = self.black_box.settings(&self.file, self.format) {
            return self.keep(&settings, dictionary);
        }
        runtime::run(async {
            let mut source = Source::open(&self.interface, self.group)?;
            let mut recording = self.create(&dictionary)?;
            let mut progress = self.progress();
            let result = self
                .record(&mut source, &mut recording, &mut progress)
                .await;
            let tally = recording.finish()?;
            progress.end(&self.file, &tally)?;
            result.map(|()| Outcome::complete_if(tally.packets > 0))
        })
    }

    fn create<'d>(&self, dictionary: &'d Dictionary) -> Result<Recording<'d>, Failure> {
        let usual = RecordingFormat::of_path(&self.file);
        let format = self.format.unwrap_or(usual);
        Recording::create(&self.file, self.overwrite, format, &self.port, dictionary)
    }

    /// Runs the black box.
    fn keep(
        &self,
        settings: &black_box::Settings,
        dictionary: Dictionary,
    ) -> Result<Outcome, Failure> {
        let mut printer = self.events.printer();
        if self.quiet {
            printer.silence();
        }
        runtime::run(async {
            let source = Source::open(&self.interface, self.group)?;
            let filter = Filter::new(&self.port);
            let end = self.run_for.end();
            black_box::run(settings, source, filter, dictionary, &mut printer, end).await
        })
    }

    fn progress(&self) -> Progress {
        match (self.quiet, self.events.is_json()) {
            (true, _) => Progress::Quiet,
            (false, true) => Progress::Events(self.events.printer()),
            (false, false) => Progress::Words,
        }
    }

    async fn record(
        &self,
        source: &mut Source,
        recording: &mut Recording<'_>,
        progress: &mut Progress,
    ) -> Result<(), Failure> {
        let end = self.run_for.end();
        tokio::pin!(end);
        let mut second = interval(Duration::from_secs(1));
        second.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut told = 0;
        loop {
            tokio::select! {
                () = &mut end => {
                    let rest = source.rest()?;
                    return take(recording, &rest, source);
                }
                _ = second.tick() => {
                    recording.flush()?;
                    let tally = recording.tally();
                    if tally.packets > told {
                        told = tally.packets;
                        progress.tell(&tally)?;
                    }
                }
                packets = source.next() => take(recording, &packets?, source)?,
            }
            let limit = self.size.map(|size| size as u64);
            if limit.is_some_and(|limit| recording.tally().octets >= limit) {
                return Ok(());
            }
        }
    }
}

/// Records packets of a source, and what it has lost.
fn take(recording: &mut Recording<'_>, packets: &[Packet], source: &Source) -> Result<(), Failure> {
    packets
        .iter()
        .try_for_each(|packet| recording.take(packet))?;
    recording.add_lost(source.take_lost());
    Ok(())
}

/// Where the progress is printed.
enum Progress {
    Quiet,
    /// On standard error.
    Words,
    /// On standard output.
    Events(EventPrinter),
}

impl Progress {
    fn tell(&mut self, tally: &Tally) -> Result<(), Failure> {
        match self {
            Self::Quiet => {}
            Self::Words => say(tally),
            Self::Events(printer) => printer.plain("progress", tally.to_json(), "")?,
        }
        Ok(())
    }

    fn end(&mut self, file: &Path, tally: &Tally) -> Result<(), Failure> {
        match self {
            Self::Quiet => {}
            Self::Words if file == Path::new(STANDARD_OUTPUT) => say(tally),
            Self::Words => say(format_args!("{tally} in {}", file.display())),
            Self::Events(printer) => return printer.plain("end", tally.to_json(), ""),
        }
        // What is lost is no progress.
        tally.missing.remarks().for_each(say);
        Ok(())
    }
}
