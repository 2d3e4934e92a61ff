//! The modules of `jsidl::typescript` in Node.js.

use std::path::Path;
use std::process::Command;
use std::{fs, iter};

use jaus_test_kit::evidence;
use jaus_test_kit::tools::{has_program, workspace};
use jsidl::{Library, Loader, typescript};

use super::cases::{self, Case};
use super::{beside, check, directory, run, write_all};
use crate::support::{catalogue, golden};

fn write(directory: &Path, module: &str, library: &Library) {
    write_all(
        &directory.join(module),
        &typescript::files(library, |_| true),
    );
}

/// A directory whose modules Node.js reads as ECMAScript.
fn node_directory(test: &str) -> std::path::PathBuf {
    let directory = directory(test);
    fs::write(directory.join("package.json"), "{ \"type\": \"module\" }").unwrap();
    for name in ["run.js", "own_values.js", "pose.js"] {
        fs::copy(beside(name), directory.join(name)).unwrap();
    }
    directory
}

fn node(directory: &Path, script: &str) -> Command {
    let mut node = Command::new("node");
    node.current_dir(directory).arg(script);
    node
}

/// The definitions of the tests of the Rust emitter, which use every construct.
fn constructs() -> Library {
    let mut loader = Loader::new();
    loader.path(workspace("jsidl/tests/rust"));
    loader.load().library
}

#[test]
fn golden_messages_pass_through_javascript() {
    if !has_program("node") {
        return;
    }
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    let directory = node_directory("golden-js");
    let mut cases: Vec<Case> = Vec::new();
    let mut vectors = 0;
    for (source, rows) in golden::sources() {
        let library = golden::load(&corpus, &source);
        write(&directory, &source, &library);
        for row in &rows {
            let (id, octets) = (golden::id_of(row), golden::octets_of(&row["hex"]));
            let message = golden::message_of(&library, row);
            cases.extend(cases::around(&source, &id, message, &octets));
            vectors += 1;
        }
    }
    assert!(vectors > 2000, "the golden data have 2116 vectors");
    check(&mut node(&directory, "run.js"), &cases);
}

#[test]
fn random_messages_of_every_type_pass_through_javascript() {
    if !has_program("node") {
        return;
    }
    let directory = node_directory("random-js");
    let libraries = [("jaus", catalogue(), 1), ("constructs", constructs(), 8)];
    let mut cases = Vec::new();
    for (module, library, each) in &libraries {
        write(&directory, module, library);
        cases.extend(cases::random(module, library, *each));
    }
    check(&mut node(&directory, "run.js"), &cases);
}

#[test]
fn texts_that_look_like_code_and_extreme_values_pass_through_javascript() {
    if !has_program("node") {
        return;
    }
    let library = super::awkward();
    let directory = node_directory("awkward-js");
    write(&directory, "awkward", &library);
    let cases = cases::random("awkward", &library, 8);
    check(&mut node(&directory, "run.js"), &cases);
}

#[test]
fn javascript_reads_sets_and_checks_values_in_units() {
    if !has_program("node") {
        return;
    }
    let directory = node_directory("values-js");
    for (module, library) in iter::zip(["jaus", "constructs"], [catalogue(), constructs()]) {
        write(&directory, module, &library);
    }
    assert_eq!(run(&mut node(&directory, "own_values.js"), ""), "done\n");
    // The example of the documentation.
    let expected = "53.100000 31 undefined\n\
        true Latitude: 91 is not in -90 to 90 degree\n\
        true ReportGlobalPose: Longitude: octets needed: 4, left: 2 at octet 8\n";
    assert_eq!(run(&mut node(&directory, "pose.js"), ""), expected);
}
