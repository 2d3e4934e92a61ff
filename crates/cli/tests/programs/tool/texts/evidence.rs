//! The tests that the pages about security name exist.

use std::fs;
use std::path::Path;

use jaus_test_kit::tools::workspace;

use super::texts;

/// Pages that name tests as evidence.
const PAGES: [&str; 2] = ["docs/security.md", "docs/hardening.md"];
/// Folders with tests.
const SOURCES: [&str; 4] = ["src", "tests", "crates", "jsidl/tests"];

/// The quoted names of tests in the tables of a page, without their modules: words joined by at least
/// three underscores.
fn named(page: &str) -> impl Iterator<Item = &str> {
    let rows = page.lines().filter(|line| line.starts_with('|'));
    let quoted = rows.flat_map(|row| row.split('`').skip(1).step_by(2));
    let names = quoted.filter_map(|it| it.rsplit("::").next());
    names.filter(|name| {
        let is_name = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        is_name && name.matches('_').count() >= 3
    })
}

/// Appends all Rust below a folder.
fn read(folder: &Path, rust: &mut String) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            read(&path, rust);
        } else if path.extension().is_some_and(|it| it == "rs") {
            rust.push_str(&fs::read_to_string(&path).unwrap());
        }
    }
}

#[test]
fn every_test_that_a_page_names_as_evidence_exists() {
    let mut rust = String::new();
    for folder in SOURCES {
        read(&workspace(folder), &mut rust);
    }
    let (mut count, mut missing) = (0, Vec::new());
    for text in texts().iter().filter(|it| PAGES.contains(&&*it.name())) {
        for name in named(&text.content) {
            count += 1;
            if !rust.contains(&format!("fn {name}(")) {
                missing.push(format!("{}: {name}", text.name()));
            }
        }
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
    assert!(count > 30, "{count}");
}
