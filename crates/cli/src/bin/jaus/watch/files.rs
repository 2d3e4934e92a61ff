//! Reads messages from captures, lines of JSON, and log directories.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::say;
use jaus_view::{Counts, Filter, MessageStream, Network};
use jaus_viewers::Recording;

use super::{Printer, tell_lost};
use crate::decode::report_skipped;

/// Maximum length of a line of JSON.
const LONGEST: u64 = 64 << 20;

pub(super) fn watch(
    places: &[PathBuf],
    filter: &Filter,
    printer: &mut Printer<'_>,
) -> Result<Outcome, Failure> {
    let mut files = Vec::new();
    for place in places {
        if place.is_dir() {
            files.append(&mut logs_in(place)?);
        } else {
            files.push(place.clone());
        }
    }
    let mut stream = MessageStream::new(printer.dictionary, filter.clone());
    let mut complete = true;
    let mut skipped = Counts::default();
    for path in &files {
        let failed = |error| Failure::file(path, &error);
        let mut file = BufReader::new(File::open(path).map_err(failed)?);
        let begin = file.fill_buf().map_err(failed)?;
        complete &= match begin.first() {
            // An empty log: the power failed before the first write.
            None => true,
            Some(b'{') => read_lines(path, file, &stream, printer)?,
            Some(_) => {
                let (is_complete, counts) = read_capture(path, file, &mut stream, printer)?;
                skipped += counts;
                is_complete
            }
        };
    }
    report_skipped(skipped, stream.incomplete_messages());
    Ok(Outcome::complete_if(complete))
}

/// The files of a log, ordered by name.
fn logs_in(directory: &Path) -> Result<Vec<PathBuf>, Failure> {
    let failed = |error| Failure::file(directory, &error);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let extension = path.extension().unwrap_or_default();
        if ["pcapng", "mcap", "jsonl"]
            .iter()
            .any(|it| extension == *it)
        {
            files.push(path);
        }
    }
    files.sort();
    if files.is_empty() {
        return Err(Failure::new(format!(
            "{} holds no log: it has no .pcapng, .mcap or .jsonl files",
            directory.display()
        )));
    }
    Ok(files)
}

/// Returns whether all of it was readable, and what was skipped.
fn read_capture(
    path: &Path,
    file: impl BufRead,
    stream: &mut MessageStream<'_>,
    printer: &mut Printer<'_>,
) -> Result<(bool, Counts), Failure> {
    let name = path.display();
    let mut recording = match Recording::new(file) {
        Ok(recording) => recording,
        Err(error) => return Err(Failure::new(format!("{name}: {error}"))),
    };
    let mut network = Network::by_content();
    let mut complete = true;
    while let Some(frame) = recording.next_frame() {
        let frame = match frame {
            Ok(frame) => frame,
            Err(error) => {
                say(format_args!("{name}: {error}; the part before it is shown"));
                complete = false;
                continue;
            }
        };
        if frame.lost > 0 {
            printer.lost(frame.lost)?;
        }
        for datagram in network.handle_frame(&frame) {
            for entry in stream.read_datagram(frame.time, &datagram) {
                printer.entry(&entry)?;
            }
        }
    }
    Ok((complete, network.counts()))
}

/// Returns whether all lines were readable.
fn read_lines(
    path: &Path,
    mut file: impl BufRead,
    stream: &MessageStream<'_>,
    printer: &mut Printer<'_>,
) -> Result<bool, Failure> {
    let name = path.display();
    let mut complete = true;
    let mut number = 0;
    loop {
        let mut line = Vec::new();
        let read = file.by_ref().take(LONGEST).read_until(b'\n', &mut line);
        if read.map_err(|error| Failure::file(path, &error))? == 0 {
            return Ok(complete);
        }
        number += 1;
        let text = String::from_utf8_lossy(&line);
        if text.trim().is_empty() {
            continue;
        }
        match stream.read_json(&text) {
            Ok(Some(entry)) => printer.object(&entry)?,
            Ok(None) => tell_lost(&text, printer)?,
            Err(error) => {
                say(format_args!("{name}:{number}: {error}"));
                complete = false;
            }
        }
    }
}
