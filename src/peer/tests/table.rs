use std::fs;
use std::path::{Path, PathBuf};

use jaus_test_kit::snapshot;

use super::super::*;

/// The table of all departures, as Markdown.
fn table() -> String {
    let mut table =
        "| departure | peers | known from | recognised by | our handling | file and test |\n\
                     |---|---|---|---|---|---|\n"
            .to_owned();
    for departure in DEPARTURES {
        let peers: Vec<_> = departure.peers.iter().map(|peer| peer.name()).collect();
        let source = match departure.source {
            Source::Recorded => "recorded",
            Source::Provoked => "provoked",
            Source::Read => "read in its source",
        };
        let recognition = match departure.recognition {
            Recognition::By(signs) => {
                let signs: Vec<_> = signs.iter().map(Sign::to_string).collect();
                signs.join("; or ")
            }
            Recognition::NeedNotBe => "not needed: our handling suits every peer".to_owned(),
            Recognition::Configured => "must be configured: `[[profile]]`".to_owned(),
        };
        table += &format!(
            "| **{}**: {} | {} | {source} | {recognition} | {} | `{}`: `{}` |\n",
            departure.name,
            departure.does,
            peers.join(", "),
            departure.ours,
            departure.place,
            departure.test
        );
    }
    table
}

/// Every Rust file below a directory of the repository.
fn sources(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn each_departure_names_a_file_and_a_test_that_are_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for directory in ["src", "tests", "crates"] {
        sources(&root.join(directory), &mut files);
    }
    let code: String = files
        .iter()
        .map(|file| fs::read_to_string(file).unwrap())
        .collect();
    for Departure {
        name, place, test, ..
    } in DEPARTURES
    {
        assert!(root.join(place).is_file(), "{place}");
        let defined = code.contains(&format!("fn {test}() {{"));
        assert!(defined, "{name}: there is no test {test}");
    }
}

#[test]
fn the_page_shows_the_table_as_it_is() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/peer/departures.md");
    snapshot::check(page, &table());
}

#[test]
fn each_peer_but_the_standard_one_departs_somewhere() {
    for peer in Implementation::ALL {
        assert_eq!(
            peer.departures().count() == 0,
            peer == Implementation::Standard,
            "{peer}"
        );
        assert_eq!(peer.name().parse(), Ok(peer));
    }
    let error = "jaus".parse::<Implementation>().unwrap_err().to_string();
    assert!(
        error.contains("`jaus`") && error.contains("\"jaus++\""),
        "{error}"
    );
}
