//! Verifies the chain of a log, across its full files.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::chain::{ChainEnd, LineHash, Seal};
use crate::file::full_files;

/// A chain without a break.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct VerifiedLog {
    /// The files, the oldest first.
    pub files: Vec<PathBuf>,
    /// The number of the first line that is there. Lines before it were in files that are gone.
    pub first: u64,
    /// The number of the last line. Nothing in the log tells whether lines after it were cut off: compare
    /// it, and its hash, with what was noted elsewhere.
    pub last: u64,
    /// The hash of the last line.
    pub hash: LineHash,
    /// Torn lines, by file and number of the line there, from 1: the program was interrupted while it wrote
    /// them. The chain goes on over them.
    pub torn: Vec<(PathBuf, usize)>,
}

/// Why a log is not verified.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// A file cannot be read.
    #[error("{}: {source}", .file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The chain is broken.
    #[error("{}:{line}: {broken}", .file.display())]
    Broken {
        /// The file.
        file: PathBuf,
        /// The line of the file, from 1.
        line: usize,
        /// What is wrong there.
        broken: BrokenChain,
    },
    /// The log is shorter than it was.
    #[error("the log ends with line {last}: line {noted} with the noted hash is missing")]
    CutOff {
        /// The number of the last line.
        last: u64,
        /// The number that was noted.
        noted: u64,
    },
}

/// What is wrong with a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BrokenChain {
    /// Lines before it are missing.
    #[error("lines {first} to {last} are missing before this one")]
    Missing {
        /// The number of the first missing line.
        first: u64,
        /// The number of the last.
        last: u64,
    },
    /// The line before was changed, or replaced, or inserted.
    #[error("the line before was changed: its hash is not the one that this line has")]
    Changed,
    /// The line itself is no line of a log.
    #[error("this is no line of an audit log, and the next line does not follow the one before")]
    Unreadable,
    /// A line has the number of another one.
    #[error("this line has number {number}, but {expected} follows")]
    Number {
        /// Its number.
        number: u64,
        /// The number that is due.
        expected: u64,
    },
    /// A line with the noted number has another hash than the noted one.
    #[error("this line was changed: it had another hash when it was noted")]
    Noted,
}

/// Verifies a log: the file, and its full files beside it. `noted` is the number and the hash of a line
/// that an earlier verification reported: the log must still have it.
///
/// # Errors
/// A file that cannot be read, or the first break.
pub fn verify(path: &Path, noted: Option<(u64, &str)>) -> Result<VerifiedLog, VerifyError> {
    let mut check = Check {
        log: VerifiedLog::default(),
        before: None,
        torn_before: None,
        noted,
    };
    let mut files = full_files(path);
    // It is absent if a rotation was interrupted.
    if path.exists() || files.is_empty() {
        files.push(path.to_owned());
    }
    for file in files {
        check.file(file)?;
    }
    check.end()
}

struct Check<'n> {
    log: VerifiedLog,
    /// The whole line before; `None` at the first.
    before: Option<ChainEnd>,
    /// The torn line after it, until the next whole one shows that none is missing.
    torn_before: Option<(PathBuf, usize)>,
    noted: Option<(u64, &'n str)>,
}

impl Check<'_> {
    fn file(&mut self, file: PathBuf) -> Result<(), VerifyError> {
        let content = fs::read(&file).map_err(|source| VerifyError::File {
            file: file.clone(),
            source,
        })?;
        let content = content.strip_suffix(b"\n").unwrap_or(&content);
        let lines = content.split(|&octet| octet == b'\n').enumerate();
        for (index, line) in lines.filter(|_| !content.is_empty()) {
            let place = (file.clone(), index + 1);
            let Some(seal) = Seal::of(line) else {
                self.log.torn.push(place.clone());
                self.torn_before.get_or_insert(place);
                continue;
            };
            let hash = LineHash::of(line);
            self.line(place, &seal, hash)?;
            self.before = Some(ChainEnd {
                number: seal.number,
                hash,
            });
        }
        self.log.files.push(file);
        Ok(())
    }

    fn line(
        &mut self,
        (file, line): (PathBuf, usize),
        seal: &Seal,
        hash: LineHash,
    ) -> Result<(), VerifyError> {
        let number = seal.number;
        // The first line that is there may follow others, which were in files that are gone.
        let is_first = self.before.is_none() && number != 1;
        let before = self.before.unwrap_or_default();
        let is_chained = is_first || seal.after == before.hash.to_string();
        let expected = before.number + 1;
        let torn_before = self.torn_before.take();
        if let Some((file, line)) = torn_before.filter(|_| !is_chained) {
            let broken = BrokenChain::Unreadable;
            return Err(VerifyError::Broken { file, line, broken });
        }
        let broken = if is_first && self.is_noted_gone(seal) {
            Some(BrokenChain::Missing {
                first: self.noted.map_or(1, |(noted, _)| noted),
                last: number - 1,
            })
        } else if number > expected && !is_first {
            Some(BrokenChain::Missing {
                first: expected,
                last: number - 1,
            })
        } else if !is_chained {
            Some(BrokenChain::Changed)
        } else if number != expected && !is_first {
            Some(BrokenChain::Number { number, expected })
        } else if self.is_other_than_noted(number, hash) {
            Some(BrokenChain::Noted)
        } else {
            None
        };
        if let Some(broken) = broken {
            return Err(VerifyError::Broken { file, line, broken });
        }
        if self.log.first == 0 {
            self.log.first = number;
        }
        (self.log.last, self.log.hash) = (number, hash);
        Ok(())
    }

    fn is_other_than_noted(&self, number: u64, hash: LineHash) -> bool {
        self.noted
            .is_some_and(|(noted, was)| noted == number && was != hash.to_string())
    }

    /// Whether the noted line was before the first one that is there, which does not follow it.
    fn is_noted_gone(&self, first: &Seal) -> bool {
        self.noted.is_some_and(|(noted, was)| {
            noted < first.number && (noted + 1 != first.number || was != first.after)
        })
    }

    fn end(self) -> Result<VerifiedLog, VerifyError> {
        if let Some((noted, _)) = self.noted
            && noted > self.log.last
        {
            let last = self.log.last;
            return Err(VerifyError::CutOff { last, noted });
        }
        Ok(self.log)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entry::{Entry, Outcome};
    use crate::file::{Limits, LogFile};

    /// A log of so many lines, about three in a file, and of several starts.
    fn log(lines: usize) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("audit.jsonl");
        for index in 0..lines {
            let limits = Limits { file: 600, kept: 9 };
            let mut file = LogFile::open(&path, limits).unwrap();
            let entry = Entry::new("console", format!("act {index}"), Outcome::Allowed);
            file.append(&entry, |_, _, _| {}).unwrap();
        }
        (folder, path)
    }

    fn edit(file: &Path, change: impl Fn(&mut Vec<String>)) {
        let text = fs::read_to_string(file).unwrap();
        let mut lines: Vec<_> = text.lines().map(str::to_owned).collect();
        change(&mut lines);
        fs::write(file, lines.join("\n") + "\n").unwrap();
    }

    fn broken(path: &Path) -> String {
        let error = verify(path, None).unwrap_err().to_string();
        error.rsplit('/').next().unwrap().to_owned()
    }

    #[test]
    fn the_chain_goes_on_across_files_and_starts() {
        let (_folder, path) = log(10);
        let verified = verify(&path, None).unwrap();
        assert!(verified.files.len() > 2, "{verified:?}");
        assert_eq!((verified.first, verified.last), (1, 10));
        assert_eq!(verified.torn, []);
        // The oldest file may be removed, as by rotation.
        fs::remove_file(&verified.files[0]).unwrap();
        let verified = verify(&path, None).unwrap();
        assert!(verified.first > 1 && verified.last == 10, "{verified:?}");
    }

    #[test]
    fn the_first_changed_or_missing_line_is_named() {
        let (_folder, path) = log(10);
        let oldest = verify(&path, None).unwrap().files[0].clone();
        let text = fs::read_to_string(&oldest).unwrap();
        assert_eq!(text.lines().count(), 3, "{text}");
        let name = oldest.file_name().unwrap().to_str().unwrap().to_owned();
        edit(&oldest, |lines| {
            lines[0] = lines[0].replace("console", "nobody");
        });
        assert!(broken(&path).starts_with(&format!("{name}:2: the line before was changed")));
        fs::write(&oldest, &text).unwrap();
        edit(&oldest, |lines| drop(lines.remove(1)));
        let missing = format!("{name}:2: lines 2 to 2 are missing");
        assert!(broken(&path).starts_with(&missing), "{}", broken(&path));
        fs::write(&oldest, &text).unwrap();
        edit(&oldest, |lines| lines.insert(1, lines[0].clone()));
        assert!(broken(&path).starts_with(&format!("{name}:2: ")));
        fs::write(&oldest, &text).unwrap();
        verify(&path, None).unwrap();
    }

    #[test]
    fn a_missing_file_between_others_is_named_by_its_lines() {
        let (_folder, path) = log(10);
        let files = verify(&path, None).unwrap().files;
        fs::remove_file(&files[1]).unwrap();
        let error = broken(&path);
        assert!(error.contains(":1: lines 4 to 6 are missing"), "{error}");
    }

    #[test]
    fn a_noted_line_before_the_first_that_is_there_is_missing_unless_that_follows_it() {
        let (_folder, path) = log(10);
        let files = verify(&path, None).unwrap().files;
        let (_short, same) = log(3);
        let third = verify(&same, None).unwrap().hash.to_string();
        fs::remove_file(&files[0]).unwrap();
        // Line 4 has the hash of the third line of this log, not of another with the same acts.
        let error = verify(&path, Some((3, &third))).unwrap_err().to_string();
        assert!(error.contains("lines 3 to 3 are missing"), "{error}");
        let text = fs::read_to_string(&files[1]).unwrap();
        let after = text
            .split("\"after\":\"")
            .nth(1)
            .unwrap()
            .split('"')
            .next()
            .unwrap();
        verify(&path, Some((3, after))).unwrap();
        let error = verify(&path, Some((1, after))).unwrap_err().to_string();
        assert!(error.contains("lines 1 to 3 are missing"), "{error}");
    }

    #[test]
    fn a_cut_off_end_is_found_by_a_noted_line_alone() {
        let (_folder, path) = log(10);
        let before = verify(&path, None).unwrap();
        let hash = before.hash.to_string();
        let noted = Some((before.last, &*hash));
        verify(&path, noted).unwrap();
        fs::write(&path, "").unwrap();
        assert!(verify(&path, None).is_ok(), "nothing in the log tells");
        let error = verify(&path, noted).unwrap_err().to_string();
        assert!(
            error.contains("line 10 with the noted hash is missing"),
            "{error}"
        );
        // The program goes on, with other lines of the same numbers.
        for _ in 0..4 {
            let mut file = LogFile::open(&path, Limits::default()).unwrap();
            let entry = Entry::new("console", "another act", Outcome::Allowed);
            file.append(&entry, |_, _, _| {}).unwrap();
        }
        let error = verify(&path, noted).unwrap_err().to_string();
        assert!(error.contains("another hash when it was noted"), "{error}");
    }

    #[test]
    fn after_a_crash_at_any_octet_the_log_goes_on_and_only_the_torn_line_is_told() {
        let add = |path: &Path| {
            let mut file = LogFile::open(path, Limits { file: 600, kept: 9 }).unwrap();
            let entry = Entry::new("console", "another act", Outcome::Allowed);
            file.append(&entry, |_, _, _| {}).unwrap();
        };
        // The current file has three lines, or one, which follows a rotation.
        for (lines, cut) in [3, 4]
            .into_iter()
            .flat_map(|it| (0..700).map(move |cut| (it, cut)))
        {
            let (_folder, path) = log(lines);
            let text = fs::read(&path).unwrap();
            if cut > text.len() {
                continue;
            }
            fs::write(&path, &text[..cut]).unwrap();
            // A line that lacks its end alone is whole.
            let is_torn = cut > 0 && text[cut - 1] != b'\n' && text[cut] != b'\n';
            let before = verify(&path, None).unwrap();
            assert_eq!(before.torn.len(), usize::from(is_torn), "cut at {cut}");
            // The next start is interrupted as well.
            for interrupted in 0..2 {
                add(&path);
                let after = verify(&path, None).unwrap();
                assert_eq!(after.last, before.last + 1 + interrupted, "cut at {cut}");
                let torn = usize::from(is_torn) + interrupted as usize;
                assert_eq!(after.torn.len(), torn, "cut at {cut}");
                let mut text = fs::read(&path).unwrap();
                text.extend(&br#"{"time":"2026-11-29T"#[..]);
                fs::write(&path, text).unwrap();
            }
        }
    }

    #[test]
    fn an_interrupted_rotation_loses_nothing() {
        let (_folder, path) = log(4);
        let next = path.with_extension("jsonl.2");
        fs::rename(path.with_extension("jsonl.1"), next).unwrap();
        assert_eq!(verify(&path, None).unwrap().last, 4);
        fs::rename(&path, path.with_extension("jsonl.1")).unwrap();
        assert_eq!(verify(&path, None).unwrap().last, 4);
        drop(LogFile::open(&path, Limits::default()).unwrap());
        assert_eq!(verify(&path, None).unwrap().last, 4);
    }

    #[test]
    fn a_torn_line_in_place_of_a_whole_one_is_named() {
        let (_folder, path) = log(3);
        edit(&path, |lines| lines[1].truncate(20));
        assert!(broken(&path).starts_with("audit.jsonl:2: this is no line"));
    }
}
