//! Checks the links between the texts, and that the book has all pages.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The texts at the top level and all pages of the book.
fn texts() -> Vec<PathBuf> {
    let of = |directory: PathBuf| {
        fs::read_dir(directory)
            .unwrap()
            .map(|it| it.unwrap().path())
    };
    let files = of(root()).chain(of(root().join("docs")));
    files
        .filter(|it| it.extension().is_some_and(|it| it == "md"))
        .collect()
}

/// A text without its code blocks, whose lines are not links or headings.
fn prose(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let mut is_code = false;
    let lines = text.lines().filter(|line| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence
    });
    lines.map(|line| format!("{line}\n")).collect()
}

/// The targets of a text's links and pictures.
fn links(text: &str) -> impl Iterator<Item = &str> {
    let behind = text.split("](").skip(1);
    behind.filter_map(|rest| Some(rest.split_once(')')?.0))
}

/// The fragments by which a text's headings are reached, as mdBook and GitHub write them.
fn fragments(text: &str) -> BTreeSet<String> {
    let headings = text.lines().filter_map(|line| {
        line.trim_start_matches('#')
            .strip_prefix(' ')
            .filter(|_| line.starts_with('#'))
    });
    headings.map(fragment).collect()
}

fn fragment(heading: &str) -> String {
    let kept = heading.trim().chars().filter_map(|c| match c {
        ' ' => Some('-'),
        c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c.to_ascii_lowercase()),
        _ => None,
    });
    kept.collect()
}

#[test]
fn every_link_between_texts_leads_to_a_file_and_a_heading() {
    let mut broken = Vec::new();
    for path in texts() {
        for link in links(&prose(&path)) {
            if link.starts_with("http://") || link.starts_with("https://") {
                continue;
            }
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target = match file {
                "" => path.clone(),
                file => path.parent().unwrap().join(file),
            };
            let is_there = match heading {
                "" => target.exists(),
                heading => target.exists() && fragments(&prose(&target)).contains(heading),
            };
            if !is_there {
                broken.push(format!("{}: {link}", path.display()));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn the_book_has_every_page() {
    let summary = prose(&root().join("docs/SUMMARY.md"));
    let listed: BTreeSet<_> = links(&summary).map(str::to_owned).collect();
    let pages = fs::read_dir(root().join("docs")).unwrap();
    let pages: BTreeSet<_> = pages
        .map(|it| it.unwrap().file_name().into_string().unwrap())
        .filter(|it| it.ends_with(".md") && it != "SUMMARY.md")
        .collect();
    assert_eq!(listed, pages);
}

#[test]
fn a_heading_s_fragment_is_what_books_and_forges_make_of_it() {
    for (heading, expected) in [
        ("Junior, JAUS Tool Set, fkie", "junior-jaus-tool-set-fkie"),
        ("`jaus watch` and others", "jaus-watch-and-others"),
        ("A - B", "a---b"),
    ] {
        assert_eq!(fragment(heading), expected);
    }
}
