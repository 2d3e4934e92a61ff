//! Runs valid and invalid definitions, written for another validator, where they are at hand.
//!
//! Most are fragments: the root is the element under test, which a template puts where it belongs.

#![allow(
    clippy::expect_used,
    reason = "a broken test setup should stop the test"
)]

mod support;

use std::fs;
use std::path::{Path, PathBuf};

use jsidl::{Diagnostic, Diagnostics, Loader};

/// Rules of protocol behaviour, which the compiler does not look at.
const BEHAVIOUR: [&str; 14] = [
    "Action",
    "DefaultState",
    "DefaultTransition",
    "Entry",
    "Exit",
    "ProtocolBehavior",
    "SendAction",
    "Simple",
    "Start",
    "State",
    "StateMachine",
    "Transition",
    "Argument",
    "Guard",
];

/// The surroundings of a fragment whose root is this element.
fn surroundings(element: &str) -> (&'static str, &'static str) {
    match element {
        "service_def" | "service_set" => ("", ""),
        "inherits_from" | "client_of" => ("<references>", "</references>"),
        "input_set" => ("<message_set>", "<output_set/></message_set>"),
        "internal_events_set" | "description" => ("", ""),
        "bit_range" => (
            "<declared_type_set name='T'><bit_field name='B' optional='false' field_type_unsigned='unsigned integer'><sub_field name='S'>",
            "<value_set><value_enum enum_index='0' enum_const='a'/></value_set></sub_field></bit_field></declared_type_set>",
        ),
        "scale_range" | "value_set" => (
            "<declared_type_set name='T'><fixed_field name='F' optional='false' field_type='unsigned integer' field_units='one'>",
            "</fixed_field></declared_type_set>",
        ),
        "value_range" => (
            "<declared_type_set name='T'><fixed_field name='F' optional='false' field_type='integer' field_units='one'><value_set>",
            "</value_set></fixed_field></declared_type_set>",
        ),
        "count_field" => (
            "<declared_type_set name='T'><variable_length_string name='S' optional='false'>",
            "</variable_length_string></declared_type_set>",
        ),
        "vtag_field" => (
            "<declared_type_set name='T'><variant name='V' optional='false'>",
            "</variant></declared_type_set>",
        ),
        "dimension" => (
            "<declared_type_set name='T'><array name='A' optional='false'>",
            "<fixed_field name='F' optional='false' field_type='byte' field_units='one'/></array></declared_type_set>",
        ),
        "format_field" => (
            "<declared_type_set name='T'><variable_format_field name='V' optional='false'>",
            "<count_field field_type_unsigned='unsigned integer'/></variable_format_field></declared_type_set>",
        ),
        _ => ("<declared_type_set name='T'>", "</declared_type_set>"),
    }
}

fn complete(text: &str) -> String {
    let fragment = match text.split_once("?>") {
        Some((_, rest)) if text.contains("<?xml") => rest,
        _ => text,
    };
    let document = roxmltree::Document::parse(fragment).expect("the cases are well-formed");
    let element = document.root_element().tag_name().name();
    let (before, after) = surroundings(element);
    if matches!(element, "service_def" | "service_set") {
        return fragment.to_owned();
    }
    let messages = if element == "input_set" {
        ""
    } else {
        "<message_set><input_set/><output_set/></message_set>"
    };
    format!(
        "<service_def name='S' id='urn:test:S' version='1.0' xmlns='urn:jaus:jsidl:1.0'>{before}{fragment}{after}{messages}</service_def>"
    )
}

fn findings(file: &Path) -> Diagnostics {
    let text = fs::read_to_string(file).expect("the cases are UTF-8");
    let mut loader = Loader::new();
    loader.text(file, &complete(&text));
    loader.load().diagnostics
}

fn cases(kind: &str, folder: &str) -> Vec<PathBuf> {
    let Some(shared) = support::shared() else {
        return Vec::new();
    };
    let folder = shared.join("validator-cases").join(kind).join(folder);
    let mut files: Vec<_> = fs::read_dir(folder)
        .expect("the folder exists")
        .map(|entry| entry.expect("readable").path())
        .filter(|path| path.is_file())
        .collect();
    files.sort();
    files
}

fn rule(file: &Path) -> &str {
    let name = file
        .file_stem()
        .and_then(|s| s.to_str())
        .unwrap_or_default();
    name.trim_end_matches(|c: char| c.is_ascii_digit())
}

/// What the compiler is stricter about, on purpose.
fn tolerated(finding: &Diagnostic) -> bool {
    let message = &finding.message;
    [
        // A message that does not begin with its code cannot be told from others.
        "the header is empty",
        "the header does not begin with the message code",
        // Whether such a vector stands on the wire is said nowhere.
        "has a `presence_vector` but no optional member",
        // The case stands alone, without the files that it refers to.
        "is not loaded",
        "is left out of",
    ]
    .iter()
    .any(|known| message.contains(known))
}

#[test]
fn valid_definitions_have_no_errors() {
    for folder in ["validator", "gui-test", "pbvalidator"] {
        for file in cases("valid", folder) {
            if BEHAVIOUR.contains(&rule(&file)) {
                continue;
            }
            let found = findings(&file);
            let errors: Vec<_> = found.errors().filter(|e| !tolerated(e)).collect();
            assert!(errors.is_empty(), "{}: {errors:#?}", file.display());
        }
    }
}

#[test]
fn invalid_definitions_have_errors() {
    for file in cases("invalid", "validator") {
        let known = match rule(&file) {
            // Only a warning: a vocabulary is complete without the services that offer it.
            "ServiceSet" => true,
            // An absent `optional` is accepted: published definitions rely on that.
            "Variant" => file.ends_with("Variant1.xml"),
            rule => BEHAVIOUR.contains(&rule),
        };
        let found = findings(&file);
        assert!(known || found.has_errors(), "{} passes", file.display());
    }
}

#[test]
fn missing_declarations_are_named() {
    let Some(shared) = support::shared() else {
        return;
    };
    let mut loader = Loader::new();
    loader.path(shared.join("validator-cases/invalid/core-broken-declarations"));
    let found = loader.load().diagnostics;
    let missing: Vec<_> = found
        .errors()
        .filter(|e| e.message.contains("is not declared"))
        .map(|e| e.message.as_str())
        .collect();
    assert_eq!(
        missing,
        [
            "`core.queryClass.QueryConfiguration` is not declared: declare it, or correct the name",
            "`core.queryClass.QuerySubsystemList` is not declared: declare it, or correct the name",
        ]
    );
}
