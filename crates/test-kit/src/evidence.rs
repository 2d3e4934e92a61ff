//! Locates recorded evidence: messages and captures of other stacks, for comparison with ours.
//!
//! Most of it is in the repository, under `tests/evidence`, and always available. Evidence that
//! must not be redistributed is in the folder named by `JAUS_SHARED` (by default `../shared` beside
//! the repository). A test without its evidence bypasses the test harness to report this, and fails if
//! `JAUS_EVIDENCE=required` is set. `tests/summary.rs` of this package, the last program of a
//! `cargo test`, counts those tests.

use std::fs::{self, File};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};

/// Messages written by the encoders of the JAUS Tool Set, `*.jsonl`.
#[must_use]
pub fn golden() -> &'static Path {
    Path::new(concat!(env!("OUT_DIR"), "/golden"))
}

/// Captures of Junior, JAUS++ and OpenJAUS, in the folders `junior`, `jauspp` and `openjaus33`.
#[must_use]
pub fn captures() -> &'static Path {
    Path::new(concat!(env!("OUT_DIR"), "/captures"))
}

/// A capture by folder and name, in the repository or [outside] it.
///
/// # Panics
/// If it is missing and `JAUS_EVIDENCE=required` is set.
#[must_use]
pub fn capture(file: &str) -> Option<PathBuf> {
    let kept = captures().join(file);
    if kept.is_file() {
        return Some(kept);
    }
    outside(&format!("captures/{file}"))
}

/// A file or folder of evidence outside the repository, such as `jsidl-corpus`. Without it the test
/// proves nothing and must return.
///
/// # Panics
/// If it is missing and `JAUS_EVIDENCE=required` is set.
#[must_use]
pub fn outside(part: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let folder = std::env::var_os("JAUS_SHARED").map_or_else(beside, PathBuf::from);
    let path = folder.join(part);
    if path.exists() {
        return Some(path);
    }
    not_tested(
        &this_test(),
        &format!("{} is not there; set JAUS_SHARED", path.display()),
    );
    None
}

/// The path of the test that runs on this thread, as the test harness names it.
#[must_use]
pub fn this_test() -> String {
    let thread = std::thread::current();
    thread.name().unwrap_or("a test").to_owned()
}

/// Reports that a test proves nothing, with the number of such tests since `cargo test` began. The
/// report bypasses the test harness, which hides the output of passing tests.
///
/// # Panics
/// If `JAUS_EVIDENCE=required` is set.
pub fn not_tested(test: &str, reason: &str) {
    let required = std::env::var("JAUS_EVIDENCE").is_ok_and(|value| value == "required");
    assert!(!required, "{test} has to run here: {reason}");
    let line = format!("{test}: {reason}");
    let count = Record::of_this_run().add(&line);
    let count = count.map_or_else(|_| String::new(), |count| format!(" ({count} so far)"));
    let words = format!("\n*** NOT TESTED{count}: {line}\n\n");
    // If printing fails, the other tests still count.
    let _ = io::stderr().lock().write_all(words.as_bytes());
}

/// The tests of this `cargo test` that proved nothing, each with the reason. Forgets them.
#[must_use]
pub fn take_not_tested() -> Vec<String> {
    Record::of_this_run().take()
}

/// Passes [`run`] to test programs that a test starts.
pub(crate) const RUN: &str = "JAUS_TEST_RUN";

/// Identifies a `cargo test`: its test programs share their parent process.
pub(crate) fn run() -> String {
    std::env::var(RUN).unwrap_or_else(|_| parent_id().to_string())
}

#[cfg(unix)]
fn parent_id() -> u32 {
    std::os::unix::process::parent_id()
}

#[cfg(not(unix))]
fn parent_id() -> u32 {
    std::process::id()
}

/// The tests of one run that proved nothing: a file with the run in its first line, and a line per
/// test. There is one file, which a new run begins anew.
struct Record {
    file: PathBuf,
    run: String,
}

impl Record {
    fn of_this_run() -> Self {
        Self {
            file: Path::new(env!("OUT_DIR")).join("not-tested"),
            run: run(),
        }
    }

    /// Adds a test. Returns the number of tests so far.
    fn add(&self, test: &str) -> io::Result<usize> {
        let mut options = File::options();
        let mut file = options
            .create(true)
            .truncate(false)
            .read(true)
            .write(true)
            .open(&self.file)?;
        // Tests of the same run add to it at the same time.
        file.lock()?;
        let mut text = String::new();
        file.read_to_string(&mut text)?;
        if text.lines().next() != Some(&self.run) {
            file.set_len(0)?;
            file.rewind()?;
            text = format!("{}\n", self.run);
            file.write_all(text.as_bytes())?;
        }
        file.write_all(format!("{test}\n").as_bytes())?;
        Ok(text.lines().count())
    }

    /// Removes the file. Returns the tests.
    fn take(&self) -> Vec<String> {
        let text = fs::read_to_string(&self.file).unwrap_or_default();
        // A file that stays belongs to no later run.
        let _ = fs::remove_file(&self.file);
        let mut lines = text.lines().map(str::to_owned);
        match lines.next() {
            Some(run) if run == self.run => lines.collect(),
            _ => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(file: &str, run: &str) -> Record {
        Record {
            file: Path::new(env!("OUT_DIR")).join(file),
            run: run.to_owned(),
        }
    }

    #[test]
    fn tests_that_prove_nothing_are_counted_over_the_programs_of_a_run() {
        let (one, other) = (record("of-two", "7"), record("of-two", "7"));
        assert_eq!(one.add("a: no tshark").unwrap(), 1);
        assert_eq!(other.add("b: no tshark").unwrap(), 2);
        assert_eq!(one.take(), ["a: no tshark", "b: no tshark"]);
        assert!(!one.file.exists());
        assert_eq!(other.take(), <[&str; 0]>::default());
    }

    #[test]
    fn a_run_that_was_not_summed_up_leaves_nothing_to_the_next() {
        let (before, now) = (record("of-runs", "7"), record("of-runs", "8"));
        before.add("a: no tshark").unwrap();
        before.add("b: no tshark").unwrap();
        assert_eq!(now.add("c: no ip").unwrap(), 1);
        assert_eq!(now.take(), ["c: no ip"]);
        before.add("a: no tshark").unwrap();
        assert_eq!(now.take(), <[&str; 0]>::default());
    }

    #[test]
    fn tests_at_the_same_time_are_all_counted() {
        let record = record("of-threads", "7");
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| record.add("a: no tshark").unwrap());
            }
        });
        assert_eq!(record.take().len(), 8);
    }
}
