//! Files of recordings: opened for reading, and created for writing; and what they lack.

use std::fs::{self, File, Metadata};
use std::io::{self, BufReader};
use std::path::Path;

use jaus_cli::failure::Failure;
use jaus_cli::output::counted;
use jaus_files::Readers;
use jaus_viewers::Recording;

/// Opens a recording: pcap, pcapng or MCAP.
pub(crate) fn open(path: &Path) -> Result<Recording<BufReader<File>>, Failure> {
    let file = File::open(path).map_err(|error| Failure::file(path, &error))?;
    Recording::new(BufReader::new(file))
        .map_err(|error| Failure::new(format!("{}: {error}", path.display())))
}

/// Creates a file for its owner and group, because it has all that operators and vehicles send each other. It
/// must not exist without `overwrite`.
pub(crate) fn create(path: &Path, overwrite: bool) -> Result<File, Failure> {
    let failed = |error: io::Error| Failure::file(path, &error);
    let there = path.symlink_metadata().ok().filter(|_| overwrite);
    // A device or a pipe is written as it is. A file is replaced, so that neither its mode nor what a link
    // leads to gets the recording.
    let is_special = |it: &Metadata| !it.is_file() && !it.is_symlink();
    let mut options = jaus_files::options(Readers::Group);
    match &there {
        Some(it) if is_special(it) => return options.create(true).open(path).map_err(failed),
        Some(_) => fs::remove_file(path).map_err(failed)?,
        None => {}
    }
    options
        .create_new(true)
        .open(path)
        .map_err(|error| match error.kind() {
            io::ErrorKind::AlreadyExists => Failure::new(format!(
                "{} exists already: choose another name, or add --overwrite",
                path.display()
            )),
            _ => Failure::file(path, &error),
        })
}

/// What a recording lacks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Missing {
    /// Packets of this host, JAUS or not, that were lost because they came too fast.
    pub(crate) lost: u64,
    /// Messages of an MCAP file that are in its frames alone.
    pub(crate) left_out: u64,
}

impl Missing {
    /// A remark for people on each kind of loss.
    pub(crate) fn remarks(self) -> impl Iterator<Item = String> {
        let remark = |count: u64, what, why| {
            let count = usize::try_from(count).unwrap_or(usize::MAX);
            (count > 0).then(|| format!("{}: {why}", counted(count, what)))
        };
        let lost = remark(
            self.lost,
            "lost packet",
            "they came faster than they were recorded, and need not be JAUS",
        );
        let left_out = remark(
            self.left_out,
            "message",
            "in the frames alone, because an MCAP file has limits of channels and of samples",
        );
        lost.into_iter().chain(left_out)
    }
}
