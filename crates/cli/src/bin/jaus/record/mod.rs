//! `jaus record`: records the traffic of JAUS peers into a capture file.

mod connections;
mod filter;

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use jaus::link::Group;
use jaus::node::units;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::{self, say};
use jaus_cli::runtime::{self, RunFor};
use jaus_view::{CaptureWriter, InterfaceNumber, JAUS_PORT, LinkType};
use serde_json::{Value as Json, json};
use tokio::time::{MissedTickBehavior, interval};

use crate::events::{EventFormat, EventPrinter};
use crate::packets::{Packet, Source};
use filter::Filter;

/// Record JAUS traffic to a capture file, for `jaus decode`, `jaus replay` and Wireshark
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
    jaus decode drive.pcapng\n\n\
    Events of --json, on standard output: \"progress\" each second and \"end\", with \"packets\" and \
    \"octets\".")]
pub(crate) struct Record {
    /// The file to write (pcapng), which must not exist without --overwrite; - is standard output
    file: PathBuf,

    /// Overwrite an existing file
    #[arg(long)]
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
    #[arg(long, value_name = "SIZE", value_parser = units::size)]
    size: Option<usize>,

    /// Print no progress
    #[arg(long, short)]
    quiet: bool,

    #[command(flatten)]
    format: EventFormat,
}

impl Record {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        if self.format.is_json() && self.file == Path::new(STANDARD_OUTPUT) {
            return Err(Failure::new(
                "--json prints events on standard output, where `-` writes the recording: name a file",
            ));
        }
        runtime::run(async {
            let mut source = Source::open(&self.interface, self.group)?;
            let mut recording = Recording::create(&self.file, self.overwrite, &self.port)?;
            let mut progress = self.progress();
            let result = self
                .record(&mut source, &mut recording, &mut progress)
                .await;
            recording.flush()?;
            progress.end(&recording)?;
            result.map(|()| Outcome::complete_if(recording.packets > 0))
        })
    }

    fn progress(&self) -> Progress {
        match (self.quiet, self.format.is_json()) {
            (true, _) => Progress::Quiet,
            (false, true) => Progress::Events(self.format.printer()),
            (false, false) => Progress::Words,
        }
    }

    async fn record(
        &self,
        source: &mut Source,
        recording: &mut Recording,
        progress: &mut Progress,
    ) -> Result<(), Failure> {
        let end = self.run_for.end();
        tokio::pin!(end);
        let mut second = interval(Duration::from_secs(1));
        second.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut told = 0;
        loop {
            tokio::select! {
                () = &mut end => return Ok(()),
                _ = second.tick() => {
                    recording.flush()?;
                    if recording.packets > told {
                        told = recording.packets;
                        progress.tell(recording)?;
                    }
                }
                packets = source.next() => {
                    packets?.iter().try_for_each(|packet| recording.take(packet))?;
                }
            }
            let limit = self.size.map(|size| size as u64);
            if limit.is_some_and(|limit| recording.writer.written() >= limit) {
                return Ok(());
            }
        }
    }
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
    fn tell(&mut self, recording: &Recording) -> Result<(), Failure> {
        match self {
            Self::Quiet => {}
            Self::Words => say(recording.tally()),
            Self::Events(printer) => printer.plain("progress", recording.to_json(), "")?,
        }
        Ok(())
    }

    fn end(&mut self, recording: &Recording) -> Result<(), Failure> {
        let file = recording.file.display();
        match self {
            Self::Quiet => {}
            Self::Words if recording.file == Path::new(STANDARD_OUTPUT) => say(recording.tally()),
            Self::Words => say(format_args!("{} in {file}", recording.tally())),
            Self::Events(printer) => printer.plain("end", recording.to_json(), "")?,
        }
        Ok(())
    }
}

/// The file with its counters.
struct Recording {
    file: PathBuf,
    writer: CaptureWriter<BufWriter<Box<dyn Write>>>,
    interfaces: BTreeMap<String, InterfaceNumber>,
    filter: Filter,
    packets: u64,
}

impl Recording {
    fn create(path: &Path, overwrite: bool, ports: &[u16]) -> Result<Self, Failure> {
        let file: Box<dyn Write> = match path == Path::new(STANDARD_OUTPUT) {
            true => Box::new(standard_output()?),
            false => Box::new(new_file(path, overwrite)?),
        };
        let program = concat!("jaus ", env!("CARGO_PKG_VERSION"));
        let writer = CaptureWriter::new(BufWriter::new(file), program)
            .map_err(|error| failure(path, &error))?;
        Ok(Self {
            file: path.to_owned(),
            writer,
            interfaces: BTreeMap::new(),
            filter: Filter::new(ports),
            packets: 0,
        })
    }

    /// Writes a packet, if it is selected.
    fn take(&mut self, packet: &Packet) -> Result<(), Failure> {
        let Some(earlier) = self.filter.select(packet) else {
            return Ok(());
        };
        earlier.iter().try_for_each(|packet| self.write(packet))?;
        self.write(packet)
    }

    fn write(&mut self, packet: &Packet) -> Result<(), Failure> {
        let failed = |error| failure(&self.file, &error);
        let known = self.interfaces.get(&packet.interface).copied();
        let on = match known {
            Some(on) => on,
            None => {
                let name = &packet.interface;
                let on = self.writer.add_interface(name, LinkType::RAW);
                let on = on.map_err(failed)?;
                self.interfaces.insert(name.clone(), on);
                on
            }
        };
        self.packets += 1;
        self.writer
            .write(on, packet.time, &packet.octets)
            .map_err(failed)
    }

    fn flush(&mut self) -> Result<(), Failure> {
        let flushed = self.writer.flush();
        flushed.map_err(|error| failure(&self.file, &error))
    }

    fn to_json(&self) -> Json {
        json!({ "packets": self.packets, "octets": self.writer.written() })
    }

    fn tally(&self) -> String {
        let written = output::size(self.writer.written());
        format!("{} packets recorded, {written}", self.packets)
    }
}

/// The name that stands for standard output.
const STANDARD_OUTPUT: &str = "-";

fn standard_output() -> Result<io::Stdout, Failure> {
    let output = io::stdout();
    match output.is_terminal() {
        true => Err(Failure::new(
            "standard output is a terminal, and a recording is not text: write to a file, or to a \
             pipe as in `jaus record - | jaus decode -`",
        )),
        false => Ok(output),
    }
}

fn new_file(path: &Path, overwrite: bool) -> Result<File, Failure> {
    let mut options = OpenOptions::new();
    options.write(true).truncate(true);
    let options = if overwrite {
        options.create(true)
    } else {
        options.create_new(true)
    };
    options.open(path).map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => Failure::new(format!(
            "{} exists already: choose another name, or add --overwrite",
            path.display()
        )),
        _ => Failure::file(path, &error),
    })
}

/// A recording that cannot be written on. A closed pipe is the end that its reader has chosen.
fn failure(path: &Path, error: &io::Error) -> Failure {
    match error.kind() {
        io::ErrorKind::BrokenPipe => Failure::OutputClosed,
        _ => Failure::file(path, error),
    }
}
