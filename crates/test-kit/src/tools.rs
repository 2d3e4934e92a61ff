//! Workspace files, and optional programs of this machine.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::evidence::{not_tested, this_test};

/// The path of a workspace file, relative to the top level.
#[must_use]
pub fn workspace(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(path)
}

/// Whether `tshark` is installed. Without it the test proves nothing and must return.
///
/// # Panics
/// If it is missing and `JAUS_EVIDENCE=required` is set.
#[must_use]
pub fn has_tshark() -> bool {
    has_program("tshark")
}

/// Whether a program that answers `--version` is installed. Without it the test proves nothing and
/// must return.
///
/// # Panics
/// If it is missing and `JAUS_EVIDENCE=required` is set.
#[must_use]
pub fn has_program(program: &str) -> bool {
    let there = Command::new(program).arg("--version").output().is_ok();
    if !there {
        not_tested(&this_test(), &format!("there is no {program}; install it"));
    }
    there
}
