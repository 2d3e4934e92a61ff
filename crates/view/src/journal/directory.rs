//! The numbered files of a journal, with a common size limit. The oldest files are deleted first.
//!
//! A small computer may lack the time when it starts, so the number at the start of the file name
//! determines the age. The time after it is informational.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::PathBuf;

use jaus_files::{FileDraft, Readers, options};

use super::{JournalFormat, JournalSettings};
use crate::time::Timestamp;

/// Prefix of all file names.
const NAME: &str = "jaus-";

#[derive(Debug)]
pub(super) struct Directory {
    path: PathBuf,
    extension: &'static str,
    limit: u64,
    file_limit: u64,
    /// Path and size of each file, by number.
    files: BTreeMap<u64, (PathBuf, u64)>,
}

impl Directory {
    /// Adopts the files of earlier runs, and checks that files can be created.
    pub(super) fn open(settings: &JournalSettings) -> io::Result<Self> {
        fs::create_dir_all(&settings.directory)?;
        let mut directory = Self {
            path: settings.directory.clone(),
            extension: match settings.format {
                JournalFormat::Packets => "pcapng",
                JournalFormat::JsonLines => "jsonl",
            },
            limit: settings.limit,
            file_limit: settings.file_limit,
            files: BTreeMap::new(),
        };
        for entry in fs::read_dir(&directory.path)? {
            let entry = entry?;
            if let Some(number) = entry.file_name().to_str().and_then(number_of) {
                let length = entry.metadata()?.len();
                directory.files.insert(number, (entry.path(), length));
            }
        }
        directory.make_room()?;
        FileDraft::new(&directory.path.join(NAME), Readers::Group)?;
        Ok(directory)
    }

    /// Starts a new file, after deleting as many of the oldest as necessary.
    pub(super) fn begin(&mut self, time: Timestamp) -> io::Result<(File, PathBuf)> {
        self.make_room()?;
        let number = self.files.last_key_value().map_or(1, |(&last, _)| last + 1);
        let time: String = time
            .to_string()
            .chars()
            .take("2026-01-01T00:00:00".len())
            .collect();
        let time = time.replace(['-', ':'], "");
        let name = format!("{NAME}{number:06}-{time}Z.{}", self.extension);
        let path = self.path.join(name);
        // It has all that operators and vehicles send each other.
        let file = options(Readers::Group).create_new(true).open(&path)?;
        self.files.insert(number, (path.clone(), 0));
        Ok((file, path))
    }

    /// Updates the recorded size of the newest file.
    pub(super) fn note_length(&mut self, octets: u64) {
        if let Some(mut newest) = self.files.last_entry() {
            newest.get_mut().1 = octets;
        }
    }

    fn make_room(&mut self) -> io::Result<()> {
        let octets = |files: &BTreeMap<u64, (PathBuf, u64)>| -> u64 {
            files.values().map(|&(_, octets)| octets).sum()
        };
        while octets(&self.files) + self.file_limit > self.limit {
            let Some((_, (oldest, _))) = self.files.pop_first() else {
                break;
            };
            match fs::remove_file(&oldest) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        Ok(())
    }
}

/// The number in a journal file name such as `jaus-000001-20260101T000000Z.pcapng`.
fn number_of(name: &str) -> Option<u64> {
    let rest = name.strip_prefix(NAME)?;
    let ours = rest.ends_with(".pcapng") || rest.ends_with(".jsonl");
    let (number, _) = rest.split_once('-')?;
    number.parse().ok().filter(|_| ours)
}
