//! The page's own tests: modules that need no browser, run by Node.js with virtual time.

use std::path::Path;
use std::process::Command;

use jaus_test_kit::evidence::{not_tested, this_test};

#[test]
fn the_modules_of_the_page_pass_their_tests() {
    if let Err(error) = Command::new("node").arg("--version").output() {
        return not_tested(&this_test(), &format!("node: {error}"));
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/page");
    let entries = std::fs::read_dir(folder).unwrap();
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.to_string_lossy().ends_with(".test.mjs"));
    assert!(!files.is_empty());
    let run = Command::new("node").arg("--test").args(&files).output();
    let run = run.unwrap();
    let report = String::from_utf8_lossy(&run.stdout);
    assert!(run.status.success(), "{report}");
}
