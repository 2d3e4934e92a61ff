//! What tests use of this machine: the files of the workspace, and programs that it may not have.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::evidence::not_tested;

/// The path of a file of the workspace, given from its top level.
#[must_use]
pub fn workspace(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(path)
}

/// Whether there is a `tshark`. Without it the test proves nothing, and is to return.
///
/// # Panics
/// If there is none and `JAUS_EVIDENCE=required` is set.
#[must_use]
pub fn has_tshark() -> bool {
    let there = Command::new("tshark").arg("--version").output().is_ok();
    if !there {
        let thread = std::thread::current();
        not_tested(
            thread.name().unwrap_or("a test"),
            "there is no tshark; install it",
        );
    }
    there
}
