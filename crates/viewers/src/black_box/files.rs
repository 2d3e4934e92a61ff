//! The files of a black box: bounded in number, and complete or not there.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use jaus_files::{FileDraft, FileLock, Readers};
use jaus_view::Timestamp;

/// Prefix of all file names.
const NAME: &str = "black-box-";
/// Prefix and ending of the drafts of files.
const DRAFT: (&str, &str) = (".black-box-", ".new");
/// The file that is locked while a black box uses the directory.
const LOCK: &str = ".black-box.lock";

/// A directory with numbered files, such as `black-box-000001-20260101T120000Z-emergency.pcapng`.
///
/// A file gets its name when it is complete and on the disk, so that it is whole even if the process
/// is killed a moment later. One black box at a time uses a directory.
#[derive(Debug)]
pub struct BlackBoxFiles {
    most: usize,
    /// By number, with those of earlier runs.
    files: BTreeMap<u64, PathBuf>,
    deleted_on_full_disk: u64,
    /// Locked until it is closed.
    _lock: FileLock,
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
    /// Locks the directory, adopts the files of earlier runs, and checks that files can be created.
    /// There will be at most `most` files; the oldest are deleted first.
    ///
    /// # Errors
    /// I/O errors of the directory; [`io::ErrorKind::ResourceBusy`] if another black box uses it.
    pub fn open(directory: &Path, most: usize) -> io::Result<(Self, BlackBoxNames)> {
        fs::create_dir_all(directory)?;
        let lock = lock(directory)?;
        let mut files = BTreeMap::new();
        for entry in fs::read_dir(directory)? {
            let path = entry?.path();
            let name = path.file_name().and_then(|name| name.to_str());
            if let Some(number) = name.and_then(number_of) {
                files.insert(number, path);
            } else if name.is_some_and(|it| it.starts_with(DRAFT.0) && it.ends_with(DRAFT.1)) {
                // Another black box was killed while it wrote.
                fs::remove_file(path)?;
            }
        }
        match FileDraft::new(&directory.join(NAME), Readers::Group) {
            // Writing makes room.
            Err(error) if is_full(&error) => {}
            checked => drop(checked?),
        }
        let names = BlackBoxNames {
            directory: directory.to_owned(),
            next: files.last_key_value().map_or(1, |(&last, _)| last + 1),
        };
        let files = Self {
            most: most.max(1),
            files,
            deleted_on_full_disk: 0,
            _lock: lock,
        };
        Ok((files, names))
    }

    /// Writes a file, under another name until it is complete and on the disk. A file with the name
    /// is replaced. The oldest files beyond the limit are deleted before.
    ///
    /// If the disk is full, the oldest file is deleted and `write` called again with an empty file, as
    /// long as there is one besides the newest.
    ///
    /// # Errors
    /// I/O errors, also those of `write`. A file with the name remains as it is.
    pub fn write(
        &mut self,
        path: &Path,
        mut write: impl FnMut(&mut File) -> io::Result<()>,
    ) -> io::Result<()> {
        let name = path.file_name().and_then(|name| name.to_str());
        let number = name.and_then(number_of);
        let number = number.ok_or(io::ErrorKind::InvalidInput)?;
        self.make_room(number)?;
        loop {
            match write_whole(path, &mut write) {
                Err(error) if is_full(&error) && self.has_old_files() => {
                    self.delete_oldest(number)?;
                    self.deleted_on_full_disk += 1;
                }
                Err(error) => return Err(error),
                Ok(()) => break,
            }
        }
        self.files.insert(number, path.to_owned());
        Ok(())
    }

    /// Number of files deleted because the disk was full.
    #[must_use]
    pub const fn deleted_on_full_disk(&self) -> u64 {
        self.deleted_on_full_disk
    }

    /// Whether there are files besides the newest.
    fn has_old_files(&self) -> bool {
        self.files.len() > 1
    }

    /// Deletes the oldest files, until there is room for this one.
    fn make_room(&mut self, number: u64) -> io::Result<()> {
        let others =
            |files: &BTreeMap<u64, PathBuf>| files.len() - usize::from(files.contains_key(&number));
        while others(&self.files) >= self.most {
            self.delete_oldest(number)?;
        }
        Ok(())
    }

    /// Deletes the oldest file besides this one.
    fn delete_oldest(&mut self, number: u64) -> io::Result<()> {
        let oldest = self.files.keys().copied().find(|&it| it != number);
        let Some(path) = oldest.and_then(|oldest| self.files.remove(&oldest)) else {
            return Ok(());
        };
        match fs::remove_file(path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    }
}

fn write_whole(path: &Path, write: &mut impl FnMut(&mut File) -> io::Result<()>) -> io::Result<()> {
    let mut draft = FileDraft::new(path, Readers::Group)?;
    write(draft.file())?;
    draft.replace()
}

/// Locks the directory, unless its file system has no locks.
fn lock(directory: &Path) -> io::Result<FileLock> {
    FileLock::try_at(&directory.join(LOCK), Readers::Owner)?.ok_or_else(|| {
        io::Error::new(
            io::ErrorKind::ResourceBusy,
            "another black box uses this directory: name another directory, or end the other \
             program",
        )
    })
}

/// Whether deleting files helps.
fn is_full(error: &io::Error) -> bool {
    use io::ErrorKind::{QuotaExceeded, StorageFull};
    matches!(error.kind(), StorageFull | QuotaExceeded)
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
            .filter(|name| name != LOCK)
            .collect();
        names.sort();
        names
    }

    /// Writes to a disk with room for this many files, those with a name and the one being written.
    fn write_to_small_disk(files: &mut BlackBoxFiles, path: &Path, room: usize) -> io::Result<()> {
        let directory = path.parent().unwrap();
        files.write(path, |file| {
            file.write_all(b"new")?;
            match names_in(directory).len() > room {
                true => Err(io::ErrorKind::StorageFull.into()),
                false => Ok(()),
            }
        })
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

    #[test]
    fn what_a_killed_black_box_has_left_is_removed() {
        let directory = tempfile::tempdir().unwrap();
        let (_, mut names) = BlackBoxFiles::open(directory.path(), 2).unwrap();
        let path = names.reserve(Timestamp::new(0, 0, 9), "fault", "mcap");
        std::mem::forget(FileDraft::new(&path, Readers::Group).unwrap());
        assert_eq!(names_in(directory.path()).len(), 1);
        BlackBoxFiles::open(directory.path(), 2).unwrap();
        assert_eq!(names_in(directory.path()).len(), 0);
    }

    #[test]
    fn a_full_disk_costs_the_oldest_files_and_never_the_newest() {
        let directory = tempfile::tempdir().unwrap();
        let (mut files, mut names) = BlackBoxFiles::open(directory.path(), 20).unwrap();
        let mut reserve = || names.reserve(Timestamp::new(0, 0, 9), "fault", "pcapng");
        let old: Vec<_> = (0..4).map(|_| reserve()).collect();
        for path in &old {
            write(&mut files, path, b"old").unwrap();
        }
        let next = reserve();
        write_to_small_disk(&mut files, &next, 3).unwrap();
        assert_eq!(files.deleted_on_full_disk(), 2);
        assert_eq!(fs::read(&next).unwrap(), b"new");
        let left = old.iter().filter(|it| it.exists());
        assert!(left.eq(&old[2..]), "the oldest go first");

        let full = write_to_small_disk(&mut files, &reserve(), 1).unwrap_err();
        assert_eq!(full.kind(), io::ErrorKind::StorageFull);
        assert_eq!(files.deleted_on_full_disk(), 4);
        assert!(next.exists(), "the newest remains");
        assert_eq!(names_in(directory.path()).len(), 1);
    }

    #[test]
    fn a_complete_version_on_a_full_disk_keeps_its_first_version_until_it_is_there() {
        let directory = tempfile::tempdir().unwrap();
        let (mut files, mut names) = BlackBoxFiles::open(directory.path(), 20).unwrap();
        let mut reserve = || names.reserve(Timestamp::new(0, 0, 9), "fault", "pcapng");
        let (old, path) = (reserve(), reserve());
        write(&mut files, &old, b"old").unwrap();
        write(&mut files, &path, b"first").unwrap();
        write_to_small_disk(&mut files, &path, 1).unwrap_err();
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert!(!old.exists());
    }

    #[test]
    fn a_directory_belongs_to_one_black_box_until_it_ends() {
        let directory = tempfile::tempdir().unwrap();
        let first = BlackBoxFiles::open(directory.path(), 2).unwrap();
        let refused = BlackBoxFiles::open(directory.path(), 2).unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::ResourceBusy);
        assert!(refused.to_string().contains("name another directory"));
        drop(first);
        BlackBoxFiles::open(directory.path(), 2).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn only_the_owner_and_the_group_can_read_a_file() {
        use std::os::unix::fs::PermissionsExt;

        let directory = tempfile::tempdir().unwrap();
        let (mut files, mut names) = BlackBoxFiles::open(directory.path(), 2).unwrap();
        let path = names.reserve(Timestamp::new(0, 0, 9), "fault", "pcapng");
        write(&mut files, &path, b"content").unwrap();
        let mode = fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o137, 0, "{mode:o}");
    }
}
