//! Snapshot tests of the Rust emitter, with a small definition for each part of the language. The
//! snapshots are beside the definitions.
//!
//! The package `jaus` compiles the snapshots and sends values through them.
use std::fs;
use std::path::{Path, PathBuf};

use jaus_test_kit::snapshot;
use jsidl::build::Build;

fn emitted(definitions: &Path) -> String {
    let build = Build::new()
        .path(definitions)
        .module("case", "urn:example:");
    let (mut files, diagnostics) = build.generate();
    assert_eq!(diagnostics.to_string(), "");
    files.remove(0).1
}

#[test]
fn every_part_of_the_language_is_emitted_as_agreed() {
    let directory = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/rust");
    let mut cases: Vec<_> = fs::read_dir(directory)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    cases.retain(|path| path.is_dir() || path.extension().is_some_and(|e| e == "xml"));
    assert!(cases.len() >= 9, "{cases:?}");
    for case in cases {
        snapshot::check(case.with_extension("rs"), &emitted(&case));
    }
}
