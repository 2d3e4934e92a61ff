//! Links between texts lead to files and headings, and the book has all pages.

use std::collections::BTreeSet;
use std::fs;

use super::{prose, root, texts};

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

/// Whether a link leads out of the repository. Those are listed and not followed: a test needs no network.
fn is_external(link: &str) -> bool {
    link.starts_with("http://") || link.starts_with("https://")
}

#[test]
fn every_link_between_texts_leads_to_a_file_and_a_heading() {
    let mut broken = Vec::new();
    for text in texts() {
        for link in links(&prose(&text.content)) {
            if is_external(link) {
                println!("not followed: {link} in {}", text.name());
                continue;
            }
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target = match file {
                "" => text.path.clone(),
                file => text.path.parent().unwrap().join(file),
            };
            let has_heading = || {
                fs::read_to_string(&target).is_ok_and(|it| fragments(&prose(&it)).contains(heading))
            };
            if !target.exists() || !heading.is_empty() && !has_heading() {
                broken.push(format!("{}: {link}", text.name()));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn the_book_has_every_page() {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap();
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
