//! Findings in texts of the compact form stand where the mistake is, and hostile texts are refused
//! in bounded time and depth.

use jsidl::{Loaded, Loader, Severity};
use proptest::prelude::*;

fn load(text: &str) -> Loaded {
    let mut loader = Loader::new();
    loader.catalogue().text("x.csd", text);
    loader.load()
}

fn findings(text: &str) -> Vec<String> {
    load(text)
        .diagnostics
        .iter()
        .map(ToString::to_string)
        .collect()
}

fn in_type_set(declarations: &str) -> String {
    format!("typeset T (id = urn.me.T, version = 1.0) {{\n{declarations}\n}}\n")
}

#[track_caller]
fn finds(declarations: &str, expected: &[&str]) {
    assert_eq!(findings(&in_type_set(declarations)), expected);
}

#[test]
fn a_mistake_of_the_form_is_found_where_it_is_and_the_rest_is_read_on() {
    finds(
        "field uint8 A bushel;\nrecord R { field uint8 B one };\nfield int8 C one;",
        &[
            "x.csd:2:15: error: expected a unit such as `one` or `meter_per_second`, but there is `bushel`",
            "x.csd:3:30: error: expected `;`, but there is `}`",
        ],
    );
    finds(
        "record R {",
        &["x.csd:4:1: error: expected `}`, but the text ends"],
    );
    finds(
        "field uint8 A one \"open;",
        &["x.csd:2:19: error: a text is not closed: add `\"`"],
    );
}

#[test]
fn a_mistake_of_the_language_is_found_where_it_is() {
    finds(
        "field uint8 A one {\n  \"On\" = 300;\n};",
        &["x.csd:3:10: error: the value `On` is 300, but the `field_type` holds 0 to 255"],
    );
}

#[test]
fn a_reference_to_nothing_is_an_error() {
    finds(
        "record R {\n  other.Thing Thing;\n}",
        &["x.csd:3:3: error: `other.Thing` is not declared: declare it, or add the file that does"],
    );
}

#[test]
fn a_count_whose_width_nobody_says_is_a_warning() {
    finds(
        "vstring S [0, 255];",
        &[
            "x.csd:2:11: warning: this counts with a `unsigned short integer`, as in the JAUS Tool Set: if the count has \
           another width, add `//@ count_field field_type_unsigned=\"unsigned byte\"` before the construct",
        ],
    );
    finds("vstring S [0, 100];", &[]);
    finds(
        "//@ count_field field_type_unsigned=\"unsigned byte\"\nvstring S [0, 255];",
        &[],
    );
}

#[test]
fn a_service_with_several_versions_is_taken_in_the_newest_with_a_warning() {
    let service = |amendment: &str| {
        format!(
            "service S (id = urn.me.S, version = 1.0) {{\n  references {{\n{amendment}    inherits_from import \
             urn.jaus.jss.core.Events as events;\n  }}\n  messages {{ input {{ }} output {{ }} }}\n}}\n"
        )
    };
    let loaded = load(&service(""));
    let found: Vec<_> = loaded.diagnostics.iter().collect();
    assert!(
        found.iter().all(|it| it.severity == Severity::Warning),
        "{}",
        loaded.diagnostics
    );
    assert!(
        found[0].message.contains("the newest, 1.1, is used"),
        "{}",
        found[0]
    );
    let loaded = load(&service("    //@ version=\"1.0\"\n"));
    assert!(loaded.diagnostics.is_empty(), "{}", loaded.diagnostics);
    let service = loaded
        .library
        .versions("urn:me:S")
        .next()
        .expect("it is there");
    let base = service.inherits_from.as_ref().expect("a base");
    assert_eq!(base.id.to_string(), "urn:jaus:jss:core:Events 1.0");
}

#[test]
fn an_amendment_that_amends_nothing_is_an_error() {
    finds(
        "field uint8 A //@ optional=\"true\"\none;",
        &["x.csd:2:15: error: `//@` stands before the construct that it amends: move it there"],
    );
    finds(
        "//@ dimension name=\"D\"\nfield uint8 A one;",
        &["x.csd:2:1: error: the construct has no `dimension`"],
    );
    finds(
        "//@ what is this\nfield uint8 A one;",
        &["x.csd:2:1: error: expected the name of an element, if any, and `name=\"value\"` pairs"],
    );
}

#[test]
fn xml_in_the_compact_form_is_checked_where_it_stands() {
    finds(
        "/*@ <fixed_field name=\"A\" optional=\"false\" field_type=\"uint8\" field_units=\"one\"/> */",
        &[
            "x.csd:2:56: error: `uint8` is not a value of `field_type`: use `byte`, `short integer`, `integer`, `long \
           integer`, `unsigned byte`, `unsigned short integer`, `unsigned integer`, `unsigned long integer`, `float`, \
           `long float`",
        ],
    );
}

/// Whether a text has errors by itself.
fn is_refused(text: &str) -> bool {
    let mut loader = Loader::new();
    loader.text("x.csd", text);
    loader.load().diagnostics.has_errors()
}

#[test]
fn deep_nesting_is_refused() {
    for (open, close) in [
        ("sequence S {", "}"),
        ("variant V [0, 1] { vtag: ", "}"),
        ("{", "}"),
        ("state S {", "}"),
    ] {
        for count in [41, 20_000] {
            let text = in_type_set(&format!("{}{}", open.repeat(count), close.repeat(count)));
            assert!(is_refused(&text), "{open}");
        }
    }
    let text = in_type_set(&"(".repeat(500_000));
    assert!(is_refused(&text));
}

#[test]
fn a_chain_of_names_without_an_end_is_refused() {
    let text = in_type_set("a b;\nb a;\nrecord R { a x; }");
    assert!(load(&text).diagnostics.has_errors());
}

/// Pieces of which mistaken texts consist.
const PIECES: [&str; 34] = [
    "service S (id = urn.me.S, version = 1.0) {",
    "typeset T (id = urn.me.T, version = 1.0) {",
    "constants C {",
    "}",
    ";",
    "record R {",
    "list L [0, 9] {",
    "variant V [0, 1] {",
    "vtag:",
    "field uint8 A one",
    "\"On\" = 1;",
    "[0, 9]",
    "<0, 1> round",
    "{",
    "(",
    ")",
    "##why##",
    "//@ optional=\"true\"\n",
    "/*@ <body name=\"B\"/> */",
    "optional",
    "a.b c;",
    "A x [3];",
    "message 0x0001 M {",
    "body B {",
    "messages {",
    "input {",
    "protocol {",
    "state_machine M (start A) {",
    "state A {",
    "internal transition a.B (M m) {",
    "guard: a(m) && !b();",
    "actions { f(m, 'x'); }",
    "-> A;",
    "// note\n",
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn any_sequence_of_pieces_is_answered_with_findings(pieces in prop::collection::vec(0..PIECES.len(), 0..60)) {
        let text: String = pieces.iter().map(|it| format!("{} ", PIECES[*it])).collect();
        let mut loader = Loader::new();
        loader.text("x.csd", &text);
        for finding in loader.load().diagnostics.iter() {
            prop_assert!(finding.to_string().starts_with("x.csd:"), "{}", finding);
        }
        let _ = jsidl::format::compact("x.csd", &text);
    }

    #[test]
    fn any_text_is_answered_with_findings(text in "(service|typeset|constants) .{0,200}") {
        let mut loader = Loader::new();
        loader.text("x.csd", &text);
        let _ = loader.load();
    }
}
