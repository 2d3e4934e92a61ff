//! `jaus convert`: converts recordings between pcapng and MCAP.

use std::io::BufWriter;
use std::path::PathBuf;

use clap::Args;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::{Output, counted, say, size};
use jaus_viewers::{Recorder, RecordingFormat};

use crate::decode::network;
use crate::definitions::Definitions;
use crate::recordings::{self, Missing};

/// Convert a recording to MCAP, for Foxglove and PlotJuggler, or back to pcapng, for Wireshark
///
/// An MCAP file has a channel for each source and message, with the fields by name, and the frames
/// themselves in the channel /jaus/frames, so that nothing is lost. Poses, positions, range points
/// and images are there in Foxglove's schemas, too. Conversion to pcapng writes the frames.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus convert drive.pcapng drive.mcap\n  \
    jaus convert drive.pcapng drive.mcap --jsidl my-services/\n  \
    jaus convert drive.mcap drive.pcapng\n\n\
    Exit status: 0 all of it is converted; 1 the recording is damaged, and what was readable is \
    converted; 2 nothing is converted.")]
pub(crate) struct Convert {
    /// The recording: pcap, pcapng or MCAP
    from: PathBuf,

    /// The file to write, which must not exist without --overwrite: MCAP if it ends with .mcap,
    /// otherwise pcapng
    to: PathBuf,

    /// Overwrite an existing file
    #[arg(long)]
    overwrite: bool,

    /// Decode what is from or to this UDP or TCP port (repeatable) [default: 3794, and what is JAUS
    /// by its content on any other]
    #[arg(long, value_name = "PORT")]
    port: Vec<u16>,

    #[command(flatten)]
    definitions: Definitions,
}

impl Convert {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let is_itself = self.from.canonicalize().ok() == self.to.canonicalize().ok();
        if is_itself && self.to.exists() {
            return Err(Failure::new(format!(
                "{} cannot be converted to itself: name another file",
                self.from.display()
            )));
        }
        let mut recording = recordings::open(&self.from)?;
        let dictionary = self.definitions.load()?;
        let failed = |error| Failure::file(&self.to, &error);
        let file = BufWriter::new(recordings::create(&self.to, self.overwrite)?);
        let format = RecordingFormat::of_path(&self.to);
        let mut recorder =
            Recorder::new(file, format, &dictionary, network(&self.port)).map_err(failed)?;
        let (mut frames, mut is_complete) = (0, true);
        while let Some(frame) = recording.next_frame() {
            match frame {
                Ok(frame) => {
                    recorder.write_frame(&frame).map_err(failed)?;
                    frames += 1;
                }
                Err(error) => {
                    say(format_args!("{}: {error}", self.from.display()));
                    is_complete = false;
                }
            }
        }
        let missing = Missing {
            left_out: recorder.left_out(),
            ..Missing::default()
        };
        missing.remarks().for_each(say);
        let octets = recorder.finish().map_err(failed)?;
        Output::new().line(format_args!(
            "{} in {}, {}",
            counted(frames, "frame"),
            self.to.display(),
            size(octets)
        ))?;
        Ok(Outcome::complete_if(is_complete))
    }
}
