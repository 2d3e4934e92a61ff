//! The file of a recording, with its counters.

use std::fmt;
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};

use jaus_cli::failure::Failure;
use jaus_cli::output::size;
use jaus_view::{Dictionary, Network};
use jaus_viewers::{Recorder, RecordingFormat};
use serde_json::{Value as Json, json};

use super::filter::Filter;
use crate::packets::Packet;
use crate::recordings;

/// The name that stands for standard output.
pub(super) const STANDARD_OUTPUT: &str = "-";

/// The file.
pub(super) struct Recording<'d> {
    file: PathBuf,
    recorder: Recorder<'d, BufWriter<Box<dyn Write>>>,
    filter: Filter,
    packets: u64,
}

/// What is in a file.
pub(super) struct Tally {
    pub(super) packets: u64,
    pub(super) octets: u64,
}

impl<'d> Recording<'d> {
    pub(super) fn create(
        path: &Path,
        overwrite: bool,
        format: RecordingFormat,
        ports: &[u16],
        dictionary: &'d Dictionary,
    ) -> Result<Self, Failure> {
        let file: Box<dyn Write> = match path == Path::new(STANDARD_OUTPUT) {
            true => Box::new(standard_output()?),
            false => Box::new(recordings::create(path, overwrite)?),
        };
        // The filter has chosen the packets, and those of a port are decoded whatever their content.
        let network = Network::of_any_port();
        let recorder = Recorder::new(BufWriter::new(file), format, dictionary, network)
            .map_err(|error| failure(path, &error))?;
        Ok(Self {
            file: path.to_owned(),
            recorder,
            filter: Filter::new(ports),
            packets: 0,
        })
    }

    /// Writes a packet, if it is selected.
    pub(super) fn take(&mut self, packet: &Packet) -> Result<(), Failure> {
        let Some(earlier) = self.filter.select(packet) else {
            return Ok(());
        };
        earlier.iter().try_for_each(|packet| self.write(packet))?;
        self.write(packet)
    }

    fn write(&mut self, packet: &Packet) -> Result<(), Failure> {
        self.packets += 1;
        let written = self.recorder.write_frame(&packet.frame());
        written.map_err(|error| failure(&self.file, &error))
    }

    pub(super) fn flush(&mut self) -> Result<(), Failure> {
        let flushed = self.recorder.flush();
        flushed.map_err(|error| failure(&self.file, &error))
    }

    /// Ends the file.
    pub(super) fn finish(self) -> Result<Tally, Failure> {
        let octets = self.recorder.finish();
        Ok(Tally {
            packets: self.packets,
            octets: octets.map_err(|error| failure(&self.file, &error))?,
        })
    }

    pub(super) fn tally(&self) -> Tally {
        Tally {
            packets: self.packets,
            octets: self.recorder.written(),
        }
    }
}

impl Tally {
    pub(super) fn to_json(&self) -> Json {
        json!({ "packets": self.packets, "octets": self.octets })
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { packets, octets } = self;
        write!(f, "{packets} packets recorded, {}", size(*octets))
    }
}

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

/// A recording that cannot be written on. A closed pipe is the end that its reader has chosen.
fn failure(path: &Path, error: &io::Error) -> Failure {
    match error.kind() {
        io::ErrorKind::BrokenPipe => Failure::OutputClosed,
        _ => Failure::file(path, error),
    }
}
