//! Snapshot tests of the Rust emitter, with a small definition for each part of the language. The
//! snapshots are beside the definitions; `BLESS=1 cargo test -p jsidl emitted` updates them.
//!
//! The package `jaus` compiles the snapshots and sends values through them.
use std::path::{Path, PathBuf};
use std::{env, fs};

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
        let text = emitted(&case);
        let expected = case.with_extension("rs");
        if env::var_os("BLESS").is_some() {
            fs::write(&expected, &text).unwrap();
        }
        let agreed = fs::read_to_string(&expected).unwrap_or_default();
        let difference = agreed.lines().zip(text.lines()).position(|(a, b)| a != b);
        assert!(
            agreed == text,
            "{} differs from line {} on; if that is right, run this test with BLESS=1",
            expected.display(),
            difference.unwrap_or(agreed.lines().count().min(text.lines().count())) + 1,
        );
    }
}
