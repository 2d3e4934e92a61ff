//! The files of the log: appended to, renamed when full, the oldest removed.

use std::fs::{self, File, TryLockError};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use jaus_files::{Readers, append};

use crate::chain::{ChainEnd, SealedLine};
use crate::entry::Entry;

/// Limits of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Octets of one file.
    pub file: u64,
    /// Full files that are kept beside the current one: `audit.jsonl.1` is the newest.
    pub kept: u32,
}

impl Default for Limits {
    /// Nine files of 8 MiB, about 250 000 entries.
    fn default() -> Self {
        Self {
            file: 8 << 20,
            kept: 8,
        }
    }
}

/// The current file.
#[derive(Debug)]
pub(crate) struct LogFile {
    path: PathBuf,
    limits: Limits,
    file: File,
    length: u64,
    chain: ChainEnd,
    /// Whether the last line may be torn, because writing it has failed.
    is_torn: bool,
}

impl LogFile {
    /// Opens a file, or continues it. Another program cannot open it meanwhile.
    pub(crate) fn open(path: &Path, limits: Limits) -> io::Result<Self> {
        let file = locked(path)?;
        let content = fs::read(path)?;
        let chain = match ChainEnd::of(&content) {
            Some(chain) => chain,
            None => end_of_full(path)?,
        };
        Ok(Self {
            path: path.to_owned(),
            limits,
            file,
            length: content.len() as u64,
            chain,
            is_torn: content.last().is_some_and(|&octet| octet != b'\n'),
        })
    }

    /// Appends an entry, in a single write, so that a crash tears one line at most. `sealed` gets its line,
    /// and whether it was written.
    pub(crate) fn append(
        &mut self,
        entry: &Entry,
        sealed: impl FnOnce(&Path, &SealedLine, bool),
    ) -> io::Result<()> {
        let ended = self.end_torn_line();
        let line = self.chain.seal(entry)?;
        let written = ended.and_then(|()| self.write(&line));
        sealed(&self.path, &line, written.is_ok());
        written
    }

    fn write(&mut self, line: &SealedLine) -> io::Result<()> {
        let length = line.text.len() as u64;
        if self.length > 0 && self.length + length > self.limits.file {
            self.rotate()?;
        }
        self.is_torn = true;
        self.file.write_all(line.text.as_bytes())?;
        self.is_torn = false;
        self.length += length;
        self.chain = line.end;
        Ok(())
    }

    /// Ends a line that may be torn. The chain goes on from the last whole one.
    fn end_torn_line(&mut self) -> io::Result<()> {
        if !self.is_torn {
            return Ok(());
        }
        let content = fs::read(&self.path)?;
        self.length = content.len() as u64;
        if content.last().is_some_and(|&octet| octet != b'\n') {
            self.file.write_all(b"\n")?;
            self.length += 1;
        }
        // An interrupted write may have left a whole line.
        self.chain = ChainEnd::of(&content).unwrap_or(self.chain);
        self.is_torn = false;
        Ok(())
    }

    /// Waits until the disk has what was appended.
    pub(crate) fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }

    fn rotate(&mut self) -> io::Result<()> {
        if self.limits.kept == 0 {
            fs::remove_file(&self.path)?;
        }
        // It is gone if an earlier attempt has failed to open the next one: nothing is to be moved.
        let moved = if self.path.exists() {
            self.limits.kept
        } else {
            0
        };
        for number in (1..=moved).rev() {
            let from = match number {
                1 => self.path.clone(),
                _ => full(&self.path, number - 1),
            };
            match fs::rename(from, full(&self.path, number)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        self.file = locked(&self.path)?;
        self.length = 0;
        Ok(())
    }
}

/// Opens a file for this program alone: the lines of two would break the chain.
fn locked(path: &Path) -> io::Result<File> {
    let file = append(path, Readers::Owner)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(io::Error::new(
            io::ErrorKind::ResourceBusy,
            "another program writes to it: name a file for each",
        )),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

/// A full file of the log with this path; the newest is number 1.
fn full(path: &Path, number: u32) -> PathBuf {
    let mut name = path.to_owned().into_os_string();
    name.push(format!(".{number}"));
    name.into()
}

/// The full files of the log with this path, the oldest first. A gap in their numbers is not the end: a
/// rotation may have been interrupted.
pub(crate) fn full_files(path: &Path) -> Vec<PathBuf> {
    let folder = path.parent().filter(|it| !it.as_os_str().is_empty());
    let entries = fs::read_dir(folder.unwrap_or(Path::new("."))).into_iter();
    let names = entries.flatten().flatten().map(|entry| entry.file_name());
    let mut numbers: Vec<u32> = names
        .filter_map(|name| {
            let number = name.to_str()?.strip_prefix(path.file_name()?.to_str()?)?;
            number.strip_prefix('.')?.parse().ok()
        })
        .collect();
    numbers.sort_unstable();
    numbers
        .iter()
        .rev()
        .map(|&number| full(path, number))
        .collect()
}

/// The end of the chain in the newest full file with a whole line.
fn end_of_full(path: &Path) -> io::Result<ChainEnd> {
    for file in full_files(path).iter().rev() {
        if let Some(end) = ChainEnd::of(&fs::read(file)?) {
            return Ok(end);
        }
    }
    Ok(ChainEnd::default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entry::Outcome;

    fn entry(what: &str) -> Entry {
        Entry::new("console", what, Outcome::Allowed)
    }

    #[test]
    fn a_full_file_is_renamed_and_the_oldest_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("audit.jsonl");
        let limits = Limits { file: 10, kept: 2 };
        let mut log = LogFile::open(&path, limits).unwrap();
        for what in ["one", "two", "three", "four"] {
            log.append(&entry(what), |_, _, _| {}).unwrap();
        }
        let has = |name: &str, what: &str| {
            let text = fs::read_to_string(folder.path().join(name)).unwrap();
            text.lines().count() == 1 && text.contains(what)
        };
        assert!(has("audit.jsonl", "four") && has("audit.jsonl.1", "three"));
        assert!(has("audit.jsonl.2", "two"));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
    }

    #[test]
    fn an_existing_file_is_continued_but_not_by_two_programs() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("audit.jsonl");
        for what in ["one", "two"] {
            let mut log = LogFile::open(&path, Limits::default()).unwrap();
            log.append(&entry(what), |_, _, _| {}).unwrap();
            let second = LogFile::open(&path, Limits::default()).unwrap_err();
            assert!(second.to_string().contains("another program"), "{second}");
        }
        assert_eq!(fs::read_to_string(&path).unwrap().lines().count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn only_its_owner_reads_the_log() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("audit.jsonl");
        drop(LogFile::open(&path, Limits::default()).unwrap());
        let mode = fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_or_device_is_refused_and_no_mode_is_changed() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        let [victim, link] = ["victim", "audit.jsonl"].map(|name| folder.path().join(name));
        fs::write(&victim, "").unwrap();
        fs::set_permissions(&victim, fs::Permissions::from_mode(0o644)).unwrap();
        std::os::unix::fs::symlink(&victim, &link).unwrap();
        let modes = || {
            [Path::new("/dev/null"), &victim]
                .map(|it| fs::metadata(it).unwrap().permissions().mode())
        };
        let before = modes();
        for path in [Path::new("/dev/null"), &link] {
            let refused = LogFile::open(path, Limits::default()).unwrap_err();
            assert_eq!(refused.kind(), io::ErrorKind::InvalidInput, "{refused}");
        }
        drop(LogFile::open(&victim, Limits::default()).unwrap());
        assert_eq!(modes(), before);
    }
}
