//! `jaus decode`: prints captures, or lines of hex, as one JSON object per line.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use bytes::Bytes;
use clap::Args;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::{Output, say};
use jaus_view::{self, Counts, Dictionary, Line, MessageLog, Network};
use jaus_viewers::Recording;

use crate::definitions::Definitions;

/// Decode captured messages or lines of hex to JSON, one object a line
///
/// For a message that cannot be decoded, its line holds {"error":…,"offset":…}. Decoding continues,
/// and the exit status is 1.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus decode drive.pcapng\n  \
    jaus decode drive.pcap --port 3794 --port 50000 | grep ReportGlobalPose\n  \
    tcpdump -i eth0 -U -w - udp port 3794 | jaus decode -\n  \
    echo '00 2B 02' | jaus decode --hex\n  \
    jaus decode --hex --jsidl my-services/ < messages.txt\n\n\
    Offsets are in octets from 0: in a message from the first octet of its code, in a datagram or \
    capture from its start.")]
pub(crate) struct Decode {
    /// A pcap, pcapng or MCAP file, or with --hex a text file; - is standard input
    #[arg(required_unless_present = "hex", value_name = "FILE")]
    file: Option<PathBuf>,

    /// Read lines of hexadecimal digits: one message per line, starting with its two code octets
    #[arg(long)]
    hex: bool,

    /// Decode bare messages by the definitions of the Reference Architecture (RA 3.x, OpenJAUS
    /// 3.x); in a capture the headers decide
    #[arg(long, requires = "hex")]
    ra: bool,

    /// Only messages from or to this UDP or TCP port (repeatable) [default: 3794, and what is JAUS
    /// by its content on any other]
    #[arg(long, value_name = "PORT", conflicts_with = "hex")]
    port: Vec<u16>,

    #[command(flatten)]
    definitions: Definitions,
}

impl Decode {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let mut dictionary = self.definitions.load()?;
        if self.ra {
            dictionary.prefer_reference_architecture();
        }
        let input = open(self.file.as_deref())?;
        let mut printer = Printer {
            output: Output::new(),
            complete: true,
        };
        if self.hex {
            read_hex(BufReader::new(input), &dictionary, &mut printer)?;
        } else {
            self.read_capture(input, &dictionary, &mut printer)?;
        }
        Ok(Outcome::complete_if(printer.complete))
    }

    fn read_capture(
        &self,
        input: Box<dyn Read>,
        dictionary: &Dictionary,
        printer: &mut Printer,
    ) -> Result<(), Failure> {
        let name = self.file.as_deref().unwrap_or(Path::new("-"));
        let mut recording = Recording::new(BufReader::new(input))
            .map_err(|error| Failure::new(format!("{}: {error}", name.display())))?;
        let mut network = network(&self.port);
        let mut log = MessageLog::new(dictionary);
        while let Some(frame) = recording.next_frame() {
            match frame {
                Ok(frame) => {
                    for datagram in network.handle_frame(&frame) {
                        for line in log.read(frame.time, &datagram) {
                            printer.print(&line)?;
                        }
                    }
                }
                Err(error) => printer.print(&Line::of_error(None, &error, error.offset()))?,
            }
        }
        report_skipped(network.counts(), log.incomplete_messages());
        if log.stale_octets() > 0 {
            tracing::info!(octets = log.stale_octets(), "skipped after the messages");
        }
        Ok(())
    }
}

/// Standard output, and whether every line so far was readable.
struct Printer {
    output: Output,
    complete: bool,
}

impl Printer {
    fn print(&mut self, line: &Line<'_>) -> Result<(), Failure> {
        self.complete &= !line.is_error();
        self.output.line(line.to_json())
    }
}

/// What is on these ports, or without any what is JAUS by its content.
pub(crate) fn network(ports: &[u16]) -> Network {
    match ports {
        [] => Network::by_content(),
        ports => Network::new(ports.iter().copied()),
    }
}

/// Opens the file, or standard input for `-` and for no file.
fn open(path: Option<&Path>) -> Result<Box<dyn Read>, Failure> {
    match path {
        Some(path) if path != Path::new("-") => {
            let file = File::open(path).map_err(|error| Failure::file(path, &error))?;
            Ok(Box::new(file))
        }
        _ => Ok(Box::new(io::stdin())),
    }
}

/// Reads one message per line; blank lines are skipped.
fn read_hex(
    mut input: impl BufRead,
    dictionary: &Dictionary,
    printer: &mut Printer,
) -> Result<(), Failure> {
    let mut text = Vec::new();
    loop {
        text.clear();
        let length = input
            .read_until(b'\n', &mut text)
            .map_err(|error| Failure::new(format!("cannot read the lines of hex: {error}")))?;
        if length == 0 {
            return Ok(());
        }
        let text = String::from_utf8_lossy(&text);
        if text.trim().is_empty() {
            continue;
        }
        match jaus_view::from_hex(&text) {
            Ok(octets) => printer.print(&dictionary.line(&Bytes::from(octets)))?,
            Err(error) => {
                let offset = error.offset as u64;
                printer.print(&Line::of_error(None, &error, offset))?;
            }
        }
    }
}

/// Reports on standard error what a capture holds besides its messages.
pub(crate) fn report_skipped(counts: Counts, incomplete_messages: u64) {
    let notes = [
        (
            counts.foreign,
            "datagrams and TCP segments skipped: not on port 3794, and not JAUS by their content; \
             try --port",
        ),
        (
            counts.gaps,
            "gaps in TCP streams: octets are missing or unreadable",
        ),
        (
            counts.unknown_links,
            "frames skipped: unsupported link type",
        ),
        (
            counts.incomplete_datagrams,
            "datagrams skipped: IP fragments are missing",
        ),
        (
            incomplete_messages,
            "large messages skipped: fragments are missing",
        ),
    ];
    for (count, note) in notes {
        if count > 0 {
            say(format_args!("note: {count} {note}"));
        }
    }
}
