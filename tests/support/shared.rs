//! Where the evidence lies that is not part of the repository.

use std::path::{Path, PathBuf};

/// The directory of captures, if it is there: in the directory that `JAUS_SHARED` names (default:
/// `../shared`). Its absence is a failure if `CI` is set, and said loudly otherwise.
pub(crate) fn captures() -> Option<PathBuf> {
    let shared = std::env::var_os("JAUS_SHARED").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared"),
        PathBuf::from,
    );
    let captures = shared.join("captures");
    let there = captures.is_dir();
    assert!(
        there || std::env::var_os("CI").is_none(),
        "CI needs the captures: {} is not there; set JAUS_SHARED",
        captures.display()
    );
    if !there {
        eprintln!(
            "NOTHING WAS TESTED: {} is not there; set JAUS_SHARED",
            captures.display()
        );
    }
    there.then_some(captures)
}
