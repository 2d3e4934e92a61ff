//! The file of a recording, with its counters.

use std::fmt;
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};

use jaus_cli::failure::Failure;
use jaus_cli::output::size;
use jaus_view::{Dictionary, Frame, Network};
use jaus_viewers::{Recorder, RecordingFormat};
use serde_json::{Value as Json, json};

use super::filter::Filter;
use crate::packets::Packet;
use crate::recordings::{self, Missing};

/// The name that stands for standard output.
pub(super) const STANDARD_OUTPUT: &str = "-";

/// The file.
pub(super) struct Recording<'d> {
    file: PathBuf,
    recorder: Recorder<'d, BufWriter<Box<dyn Write>>>,
    filter: Filter,
    packets: u64,
    lost: u64,
    /// The losses that no frame in the file mentions yet.
    lost_before_next: u64,
}

/// What is in a file.
pub(super) struct Tally {
    pub(super) packets: u64,
    pub(super) octets: u64,
    pub(super) missing: Missing,
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
            lost: 0,
            lost_before_next: 0,
        })
    }

    /// Counts lost packets, which the next frame in the file mentions.
    pub(super) const fn add_lost(&mut self, packets: u64) {
        self.lost += packets;
        self.lost_before_next += packets;
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
        let frame = Frame {
            lost: std::mem::take(&mut self.lost_before_next),
            ..packet.frame()
        };
        let written = self.recorder.write_frame(&frame);
        written.map_err(|error| failure(&self.file, &error))
    }

    pub(super) fn flush(&mut self) -> Result<(), Failure> {
        let flushed = self.recorder.flush();
        flushed.map_err(|error| failure(&self.file, &error))
    }

    /// Ends the file.
    pub(super) fn finish(self) -> Result<Tally, Failure> {
        let tally = self.tally();
        let octets = self.recorder.finish();
        Ok(Tally {
            octets: octets.map_err(|error| failure(&self.file, &error))?,
            ..tally
        })
    }

    pub(super) fn tally(&self) -> Tally {
        Tally {
            packets: self.packets,
            octets: self.recorder.written(),
            missing: Missing {
                lost: self.lost,
                left_out: self.recorder.left_out(),
            },
        }
    }
}

impl Tally {
    pub(super) fn to_json(&self) -> Json {
        json!({
            "packets": self.packets,
            "octets": self.octets,
            "lost": self.missing.lost,
            "left_out": self.missing.left_out,
        })
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} packets recorded, {}",
            self.packets,
            size(self.octets)
        )
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

#[cfg(test)]
mod tests {
    use super::*;

    fn packet(octets: Vec<u8>) -> Packet {
        Packet {
            interface: "eth0".to_owned(),
            time: jaus_view::Timestamp::new(1_790_000_000, 0, 9),
            octets: octets.into(),
        }
    }

    /// A component of 42 queries the heartbeat of 101.1.1.
    fn query([node, component]: [u8; 2]) -> Packet {
        let mut datagram = *b"\x02\x00\x10\x00\x01\x01\x01\x65\x00\x01\x01\x2A\x00\x02\x22\x07\x00";
        datagram[9..11].copy_from_slice(&[component, node]);
        let mut octets = Vec::new();
        etherparse::PacketBuilder::ipv4([10, 0, 0, 1], [10, 0, 0, 2], 16)
            .udp(40_000, 3794)
            .write(&mut octets, &datagram)
            .unwrap();
        packet(octets)
    }

    #[test]
    fn lost_packets_are_in_the_tally_and_with_the_next_frame_of_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let dictionary = Dictionary::new();
        for format in [RecordingFormat::Pcapng, RecordingFormat::Mcap] {
            let path = folder.path().join(format.extension());
            let created = Recording::create(&path, false, format, &[3794], &dictionary);
            let mut recording = created.unwrap();
            recording.take(&query([1, 1])).unwrap();
            recording.add_lost(5);
            recording.take(&packet(b"filtered out".to_vec())).unwrap();
            recording.add_lost(2);
            recording.take(&query([1, 1])).unwrap();
            recording.take(&query([1, 1])).unwrap();
            recording.add_lost(1);
            let tally = recording.finish().unwrap();
            assert_eq!((tally.packets, tally.missing.lost), (3, 8));
            assert!(
                tally
                    .missing
                    .remarks()
                    .any(|it| it.starts_with("8 lost packets"))
            );
            let mut read = recordings::open(&path).unwrap();
            let mut lost = Vec::new();
            while let Some(frame) = read.next_frame() {
                lost.push(frame.unwrap().lost);
            }
            assert_eq!(lost, [0, 7, 0], "{format}");
        }
    }

    #[test]
    fn messages_beyond_the_limit_of_channels_are_in_the_tally() {
        let folder = tempfile::tempdir().unwrap();
        let dictionary = Dictionary::new().with_catalogue();
        let path = folder.path().join("a.mcap");
        let format = RecordingFormat::Mcap;
        let created = Recording::create(&path, false, format, &[3794], &dictionary);
        let mut recording = created.unwrap();
        for node in 1..=20 {
            for component in 1..=250 {
                recording.take(&query([node, component])).unwrap();
            }
        }
        let missing = recording.finish().unwrap().missing;
        let expected = 5000 - jaus_viewers::MOST_CHANNELS as u64;
        assert!(missing.left_out >= expected, "{missing:?}");
        let remark = missing.remarks().next().unwrap();
        assert!(remark.contains("in the frames alone"), "{remark}");
    }

    #[test]
    fn a_complete_recording_has_no_remarks() {
        assert_eq!(Missing::default().remarks().count(), 0);
    }
}
