//! The files of a black box: bounded in number, and complete or not there.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use jaus_view::Timestamp;

/// Prefix of all file names.
const NAME: &str = "black-box-";
/// The file that is being written.
const PART: &str = ".black-box.part";

/// A directory with numbered files, such as `black-box-000001-20260101T120000Z-emergency.pcapng`.
///
/// A file gets its name when it is complete and on the disk, so that it is whole even if the process
/// is killed a moment later.
#[derive(Debug)]
pub struct BlackBoxFiles {
    directory: PathBuf,
    most: usize,
    /// By number, with those of earlier runs.
    files: BTreeMap<u64, PathBuf>,
}

/// The names of the files that come next. Apart from the files, so that naming one never waits for
/// the disk.
#[derive(Debug)]
pub struct BlackBoxNames {
    directory: PathBuf,
    next: u64,
}

impl BlackBoxNames {
    /// Reserves the name of a file, with the time and the reason.
    pub fn reserve(&mut self, time: Timestamp, reason: &str, extension: &str) -> PathBuf {
        let number = self.next;
        self.next += 1;
        let time: String = time.to_string().chars().take(19).collect();
        let time = time.replace(['-', ':'], "");
        let name = format!("{NAME}{number:06}-{time}Z-{reason}.{extension}");
        self.directory.join(name)
    }
}

impl BlackBoxFiles {
    /// Adopts the files of earlier runs, and checks that files can be created. There will be at most
    /// `most` files; the oldest are deleted first.
    ///
    /// # Errors
    /// I/O errors of the directory.
    pub fn open(directory: &Path, most: usize) -> io::Result<(Self, BlackBoxNames)> {
        fs::create_dir_all(directory)?;
        let mut files = BTreeMap::new();
        for entry in fs::read_dir(directory)? {
            let path = entry?.path();
            let name = path.file_name().and_then(|name| name.to_str());
            if let Some(number) = name.and_then(number_of) {
                files.insert(number, path);
            }
        }
        let part = directory.join(PART);
        File::create(&part)?;
        fs::remove_file(part)?;
        let names = BlackBoxNames {
            directory: directory.to_owned(),
            next: files.last_key_value().map_or(1, |(&last, _)| last + 1),
        };
        let files = Self {
            directory: directory.to_owned(),
            most: most.max(1),
            files,
        };
        Ok((files, names))
    }

    /// Writes a file, under another name until it is complete and on the disk. A file with the name
    /// is replaced. The oldest files beyond the limit are deleted before.
    ///
    /// # Errors
    /// I/O errors, also those of `write`. A file with the name remains as it is.
    pub fn write(
        &mut self,
        path: &Path,
        write: impl FnOnce(&mut File) -> io::Result<()>,
    ) -> io::Result<()> {
        let name = path.file_name().and_then(|name| name.to_str());
        let number = name.and_then(number_of);
        let number = number.ok_or(io::ErrorKind::InvalidInput)?;
        self.make_room(number)?;
        let part = self.directory.join(PART);
        let written = File::create(&part).and_then(|mut file| {
            write(&mut file)?;
            file.sync_all()?;
            fs::rename(&part, path)
        });
        if written.is_err() {
            // The rest of it would only fill the disk.
            let _ = fs::remove_file(&part);
        }
        written?;
        self.files.insert(number, path.to_owned());
        // The name, too, survives a loss of power; not every file system can do that.
        let _ = File::open(&self.directory).and_then(|it| it.sync_all());
        Ok(())
    }

    /// Deletes the oldest files, until there is room for this one.
    fn make_room(&mut self, number: u64) -> io::Result<()> {
        let others =
            |files: &BTreeMap<u64, PathBuf>| files.len() - usize::from(files.contains_key(&number));
        while others(&self.files) >= self.most {
            let oldest = self.files.keys().copied().find(|&it| it != number);
            let Some(path) = oldest.and_then(|oldest| self.files.remove(&oldest)) else {
                break;
            };
            match fs::remove_file(path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        Ok(())
    }
}

/// The number in a name such as `black-box-000001-20260101T120000Z-emergency.pcapng`.
fn number_of(name: &str) -> Option<u64> {
    let rest = name.strip_prefix(NAME)?;
    let is_recording = rest.ends_with(".pcapng") || rest.ends_with(".mcap");
    let (number, _) = rest.split_once('-')?;
    number.parse().ok().filter(|_| is_recording)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn names_in(directory: &Path) -> Vec<String> {
        let entries = fs::read_dir(directory).unwrap();
        let mut names: Vec<_> = entries
            .map(|it| it.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn write(files: &mut BlackBoxFiles, path: &Path, content: &[u8]) -> io::Result<()> {
        files.write(path, |file| file.write_all(content))
    }

    #[test]
    fn there_are_never_more_files_than_the_limit_with_those_of_earlier_runs() {
        let directory = tempfile::tempdir().unwrap();
        fs::write(directory.path().join("other.pcapng"), "not ours").unwrap();
        for run in 0..3 {
            let (mut files, mut names) = BlackBoxFiles::open(directory.path(), 2).unwrap();
            for reason in ["fault", "emergency"] {
                let time = Timestamp::new(1_790_000_000 + run, 0, 9);
                let path = names.reserve(time, reason, "pcapng");
                write(&mut files, &path, b"content").unwrap();
                write(&mut files, &path, b"more content").unwrap();
                assert_eq!(fs::read(&path).unwrap(), b"more content");
            }
        }
        let expected = [
            "black-box-000005-20260921T141322Z-fault.pcapng",
            "black-box-000006-20260921T141322Z-emergency.pcapng",
            "other.pcapng",
        ];
        assert_eq!(names_in(directory.path()), expected);
    }

    #[test]
    fn a_file_that_cannot_be_written_leaves_nothing_and_the_one_before_it_whole() {
        let directory = tempfile::tempdir().unwrap();
        let (mut files, mut names) = BlackBoxFiles::open(directory.path(), 2).unwrap();
        let path = names.reserve(Timestamp::new(0, 0, 9), "fault", "mcap");
        write(&mut files, &path, b"whole").unwrap();
        let full = files.write(&path, |file| {
            file.write_all(b"half")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert_eq!(full.unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert_eq!(names_in(directory.path()).len(), 1);
    }
}
