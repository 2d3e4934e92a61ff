//! Where the evidence lies: what others have said and written, against which tests hold what we say
//! and write.
//!
//! Most of it is in the repository, under `tests/evidence`, and is always there. What may not be
//! passed on lies in the folder that `JAUS_SHARED` names (`../shared` beside the repository, if it
//! is not set). A test whose evidence is missing says so past the test harness, with a count, and
//! fails where `JAUS_EVIDENCE=required` is set.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The messages that the encoders of the JAUS Tool Set have written, `*.jsonl`.
#[must_use]
pub fn golden() -> &'static Path {
    Path::new(concat!(env!("OUT_DIR"), "/golden"))
}

/// The recordings of Junior, JAUS++ and OpenJAUS, in the folders `junior`, `jauspp` and
/// `openjaus33`.
#[must_use]
pub fn captures() -> &'static Path {
    Path::new(concat!(env!("OUT_DIR"), "/captures"))
}

/// A recording by its folder and name, in the repository or [outside] it.
///
/// # Panics
/// If it is in neither and `JAUS_EVIDENCE=required` is set.
#[must_use]
pub fn capture(file: &str) -> Option<PathBuf> {
    let kept = captures().join(file);
    if kept.is_file() {
        return Some(kept);
    }
    outside(&format!("captures/{file}"))
}

/// A file or folder of the evidence that is not in the repository, such as `jsidl-corpus`. Without it
/// the test proves nothing, and is to return.
///
/// # Panics
/// If it is not there and `JAUS_EVIDENCE=required` is set.
#[must_use]
pub fn outside(part: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let folder = std::env::var_os("JAUS_SHARED").map_or_else(beside, PathBuf::from);
    let path = folder.join(part);
    if path.exists() {
        return Some(path);
    }
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test");
    not_tested(
        test,
        &format!("{} is not there; set JAUS_SHARED", path.display()),
    );
    None
}

/// Says that a test proves nothing here, past the test harness, which keeps the words of a test that
/// passes; and how many did not in all, since `cargo test` began.
///
/// # Panics
/// If `JAUS_EVIDENCE=required` is set.
pub fn not_tested(test: &str, reason: &str) {
    let required = std::env::var("JAUS_EVIDENCE").is_ok_and(|value| value == "required");
    assert!(!required, "{test} has to run here: {reason}");
    let count = count_not_tested().map_or_else(String::new, |count| format!(" ({count} so far)"));
    let words = format!("\n*** NOT TESTED{count}: {test}: {reason}\n\n");
    // Where nothing can be printed, the other tests still count.
    let _ = std::io::stderr().lock().write_all(words.as_bytes());
}

/// One more test, of all programs that the same `cargo test` has started: they have their parent in
/// common.
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
    // An octet for each.
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
