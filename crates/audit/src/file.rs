//! The files of the log: appended to, renamed when full, the oldest removed.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use jaus_files::{Readers, append};

/// Limits of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Octets of one file.
    pub file: u64,
    /// Full files that are kept beside the current one: `audit.jsonl.1` is the newest.
    pub kept: u32,
}

impl Default for Limits {
    /// Nine files of 8 MiB, about 400 000 entries.
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
    /// Whether the last line may be incomplete, because it could not be written.
    is_torn: bool,
}

impl LogFile {
    pub(crate) fn open(path: &Path, limits: Limits) -> io::Result<Self> {
        let file = append(path, Readers::Owner)?;
        let length = file.metadata()?.len();
        Ok(Self {
            path: path.to_owned(),
            limits,
            file,
            length,
            is_torn: false,
        })
    }

    /// Appends a line, in a single write so that a crash leaves no half of it.
    pub(crate) fn append(&mut self, line: &[u8]) -> io::Result<()> {
        if self.length > 0 && self.length + line.len() as u64 > self.limits.file {
            self.rotate()?;
        }
        if std::mem::take(&mut self.is_torn) {
            self.file.write_all(b"\n")?;
        }
        self.is_torn = true;
        self.file.write_all(line)?;
        self.is_torn = false;
        self.length += line.len() as u64;
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
                _ => self.full(number - 1),
            };
            match fs::rename(from, self.full(number)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        self.file = append(&self.path, Readers::Owner)?;
        self.length = 0;
        Ok(())
    }

    fn full(&self, number: u32) -> PathBuf {
        let mut name = self.path.clone().into_os_string();
        name.push(format!(".{number}"));
        name.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_file_is_renamed_and_the_oldest_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("audit.jsonl");
        let limits = Limits { file: 10, kept: 2 };
        let mut log = LogFile::open(&path, limits).unwrap();
        for line in ["one....\n", "two....\n", "three..\n", "four...\n"] {
            log.append(line.as_bytes()).unwrap();
        }
        let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
        assert_eq!(read("audit.jsonl"), "four...\n");
        assert_eq!(read("audit.jsonl.1"), "three..\n");
        assert_eq!(read("audit.jsonl.2"), "two....\n");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
    }

    #[test]
    fn an_existing_file_is_continued() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("audit.jsonl");
        for line in ["one\n", "two\n"] {
            let mut log = LogFile::open(&path, Limits::default()).unwrap();
            log.append(line.as_bytes()).unwrap();
        }
        assert_eq!(fs::read_to_string(&path).unwrap(), "one\ntwo\n");
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
