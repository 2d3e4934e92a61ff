//! Writing frames in either format.

use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, Write};
use std::path::Path;
use std::str::FromStr;

use jaus_view::{CaptureWriter, Dictionary, Frame, InterfaceNumber, LinkType, Network};

use crate::mcap::McapRecorder;

/// Limit of the interfaces of a recording.
const MOST_INTERFACES: usize = 4096;

/// Format of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordingFormat {
    /// For Wireshark, tcpdump and others.
    Pcapng,
    /// For Foxglove, PlotJuggler and others.
    Mcap,
}

impl RecordingFormat {
    /// The format of a file name: MCAP if it ends so, otherwise pcapng.
    #[must_use]
    pub fn of_path(path: &Path) -> Self {
        let extension = path.extension().unwrap_or_default();
        match extension.eq_ignore_ascii_case("mcap") {
            true => Self::Mcap,
            false => Self::Pcapng,
        }
    }

    /// The ending of file names.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Pcapng => "pcapng",
            Self::Mcap => "mcap",
        }
    }
}

impl fmt::Display for RecordingFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.extension())
    }
}

impl FromStr for RecordingFormat {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "pcapng" => Ok(Self::Pcapng),
            "mcap" => Ok(Self::Mcap),
            _ => Err("write pcapng or mcap"),
        }
    }
}

/// Writes frames to a recording.
pub struct Recorder<'d, W: Write>(Form<'d, W>);

enum Form<'d, W: Write> {
    Pcapng {
        writer: CaptureWriter<W>,
        interfaces: BTreeMap<(String, u16), InterfaceNumber>,
    },
    Mcap(Box<McapRecorder<'d, W>>),
}

impl<'d, W: Write> Recorder<'d, W> {
    /// Starts a recording. `dictionary` decodes the datagrams that `network` selects, for MCAP.
    ///
    /// # Errors
    /// I/O errors of the writer.
    pub fn new(
        out: W,
        format: RecordingFormat,
        dictionary: &'d Dictionary,
        network: Network,
    ) -> io::Result<Self> {
        Ok(Self(match format {
            RecordingFormat::Pcapng => Form::Pcapng {
                writer: CaptureWriter::new(out, concat!("jaus ", env!("CARGO_PKG_VERSION")))?,
                interfaces: BTreeMap::new(),
            },
            RecordingFormat::Mcap => {
                Form::Mcap(Box::new(McapRecorder::new(out, dictionary, network)?))
            }
        }))
    }

    /// Writes a frame.
    ///
    /// # Errors
    /// I/O errors of the writer; [`io::ErrorKind::InvalidInput`] for a frame from too many
    /// interfaces.
    pub fn write_frame(&mut self, frame: &Frame<'_>) -> io::Result<()> {
        match &mut self.0 {
            Form::Pcapng { writer, interfaces } => {
                let on = interface(writer, interfaces, frame.interface, frame.link)?;
                writer.write_frame(on, frame)
            }
            Form::Mcap(recorder) => recorder.write_frame(frame),
        }
    }

    /// Limits the samples of an MCAP file: beyond this size it gets frames alone.
    pub fn limit_samples(&mut self, octets: u64) {
        if let Form::Mcap(recorder) = &mut self.0 {
            recorder.limit_samples(octets);
        }
    }

    /// Octets written so far, without those that wait in memory.
    #[must_use]
    pub fn written(&self) -> u64 {
        match &self.0 {
            Form::Pcapng { writer, .. } => writer.written(),
            Form::Mcap(recorder) => recorder.written(),
        }
    }

    /// Number of samples left out of an MCAP file.
    #[must_use]
    pub fn left_out(&self) -> u64 {
        match &self.0 {
            Form::Pcapng { .. } => 0,
            Form::Mcap(recorder) => recorder.summary().left_out,
        }
    }

    /// Hands everything to the operating system.
    ///
    /// # Errors
    /// I/O errors of the writer.
    pub fn flush(&mut self) -> io::Result<()> {
        match &mut self.0 {
            Form::Pcapng { writer, .. } => writer.flush(),
            Form::Mcap(recorder) => recorder.flush(),
        }
    }

    /// Ends the recording. Returns its size in octets.
    ///
    /// # Errors
    /// I/O errors of the writer.
    pub fn finish(self) -> io::Result<u64> {
        match self.0 {
            Form::Pcapng { mut writer, .. } => {
                writer.flush()?;
                Ok(writer.written())
            }
            Form::Mcap(recorder) => Ok(recorder.finish()?.octets),
        }
    }
}

/// The interface with this name and link type, which is described at its first frame.
fn interface<W: Write>(
    writer: &mut CaptureWriter<W>,
    interfaces: &mut BTreeMap<(String, u16), InterfaceNumber>,
    name: &str,
    link: LinkType,
) -> io::Result<InterfaceNumber> {
    let key = (name.to_owned(), link.0);
    if let Some(&known) = interfaces.get(&key) {
        return Ok(known);
    }
    if interfaces.len() >= MOST_INTERFACES {
        let problem = "the recording has too many interfaces";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    }
    let on = writer.add_interface(name, link)?;
    interfaces.insert(key, on);
    Ok(on)
}

#[cfg(test)]
mod tests {
    use jaus_view::Timestamp;

    use super::*;
    use crate::Recording;

    #[test]
    fn frames_come_back_from_both_formats() {
        let dictionary = Dictionary::new();
        let frame = |number: u32, interface, link| Frame {
            time: Some(Timestamp::new(1_790_000_000, number, 9)),
            link,
            octets: b"octets of a frame",
            lost: u64::from(number % 2),
            length: 17 + number,
            interface,
        };
        let frames = [
            frame(0, "eth0", LinkType::ETHERNET),
            frame(1, "lo", LinkType::RAW),
            frame(2, "eth0", LinkType::ETHERNET),
        ];
        for format in [RecordingFormat::Pcapng, RecordingFormat::Mcap] {
            let mut file = Vec::new();
            let network = Network::by_content();
            let mut recorder = Recorder::new(&mut file, format, &dictionary, network).unwrap();
            for frame in &frames {
                recorder.write_frame(frame).unwrap();
            }
            let octets = recorder.finish().unwrap();
            assert_eq!(octets, file.len() as u64);
            let mut recording = Recording::new(&file[..]).unwrap();
            for frame in &frames {
                assert_eq!(&recording.next_frame().unwrap().unwrap(), frame);
            }
            assert!(recording.next_frame().is_none());
        }
    }
}
