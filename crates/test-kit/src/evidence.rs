//! Locates recorded evidence: messages and captures of other stacks, for comparison with ours.
//!
//! Most of it is in the repository, under `tests/evidence`, and always available. Evidence that
//! must not be redistributed is in the folder named by `JAUS_SHARED` (by default `../shared` beside
//! the repository). A test without its evidence bypasses the test harness to report this, with a
//! count, and fails if `JAUS_EVIDENCE=required` is set.

use std::fs::OpenOptions;
use std::io::Write;
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
    let count = count_not_tested().map_or_else(String::new, |count| format!(" ({count} so far)"));
    let words = format!("\n*** NOT TESTED{count}: {test}: {reason}\n\n");
    // If printing fails, the other tests still count.
    let _ = std::io::stderr().lock().write_all(words.as_bytes());
}

/// Counts one more such test, over all programs of the same `cargo test`: they share their parent
/// process.
fn count_not_tested() -> Option<u64> {
    let name = format!("jaus-not-tested-{}", parent_id());
    let path = std::env::temp_dir().join(name);
    let mut options = OpenOptions::new();
    let mut file = options
        .create(true)
        .append(true)
        .read(true)
        .open(path)
        .ok()?;
    // One octet per test.
    file.write_all(b".").ok()?;
    Some(file.metadata().ok()?.len())
}

#[cfg(unix)]
fn parent_id() -> u32 {
    std::os::unix::process::parent_id()
}

#[cfg(not(unix))]
fn parent_id() -> u32 {
    std::process::id()
}
