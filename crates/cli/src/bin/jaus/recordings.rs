//! Files of recordings: opened for reading, and created for writing.

use std::fs::{File, OpenOptions};
use std::io::{self, BufReader};
use std::path::Path;

use jaus_cli::failure::Failure;
use jaus_viewers::Recording;

/// Opens a recording: pcap, pcapng or MCAP.
pub(crate) fn open(path: &Path) -> Result<Recording<BufReader<File>>, Failure> {
    let file = File::open(path).map_err(|error| Failure::file(path, &error))?;
    Recording::new(BufReader::new(file))
        .map_err(|error| Failure::new(format!("{}: {error}", path.display())))
}

/// Creates a file, which must not exist without `overwrite`.
pub(crate) fn create(path: &Path, overwrite: bool) -> Result<File, Failure> {
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
