//! Holds the table against the facts of the public grammar, and renders it for that.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;

use super::{Edition, Element, Occurs, Value, element, elements, units};

/// One line per element and edition, in the notation that the file explains.
fn facts() -> String {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/language/grammar/as5684.txt"
    );
    fs::read_to_string(path).expect("the facts are beside the tests")
}

fn sign(occurs: Occurs) -> &'static str {
    match occurs {
        Occurs::Never | Occurs::Once => "",
        Occurs::Optional => "?",
        Occurs::Any => "*",
        Occurs::Some => "+",
    }
}

fn value(value: Value, edition: Edition) -> String {
    let word = match value {
        Value::Identifier => "identifier",
        Value::Path => "path",
        Value::ParameterType if edition == Edition::V1_0 => "path",
        Value::ParameterType => "parameter-type",
        Value::Text => "text",
        Value::Boolean => "boolean",
        Value::Version => "version",
        Value::VersionPattern => "version-pattern",
        Value::Octets => "octets",
        Value::Octet => "octet",
        Value::Size => "size",
        Value::Long => "long",
        Value::Unit => "unit",
        Value::Word(words) => {
            let words: BTreeSet<_> = words.iter().map(|word| word.replace(' ', "_")).collect();
            let words: Vec<_> = words.into_iter().collect();
            return format!("words({})", words.join("|"));
        }
    };
    word.to_owned()
}

fn line(element: &Element, edition: Edition) -> String {
    let mut line = element.name.to_owned();
    let attributes = element.attributes.iter();
    let attributes = attributes.filter(|it| it.occurs(edition) != Occurs::Never);
    let attributes: BTreeSet<_> = attributes
        .map(|it| {
            let (occurs, value) = (sign(it.occurs(edition)), value(it.value, edition));
            format!("@{}{occurs}={value}", it.name)
        })
        .collect();
    for attribute in attributes {
        let _ = write!(line, " {attribute}");
    }
    let parts = element.parts.iter();
    for part in parts.filter(|it| it.occurs(edition) != Occurs::Never) {
        let choice: BTreeSet<_> = part.elements(edition).collect();
        let choice: Vec<_> = choice.into_iter().collect();
        let occurs = sign(part.occurs(edition));
        let _ = match choice.as_slice() {
            [one] => write!(line, " {one}{occurs}"),
            several => write!(line, " ({}){occurs}", several.join("|")),
        };
    }
    if element.text {
        line.push_str(" #text");
    }
    line
}

/// The elements that can occur in a definition of an edition.
fn reachable(edition: Edition) -> BTreeSet<&'static str> {
    let mut found = BTreeSet::new();
    let mut waiting = vec!["service_def", "declared_type_set", "declared_const_set"];
    while let Some(name) = waiting.pop() {
        if !found.insert(name) {
            continue;
        }
        let parts = element(name).map_or(&[][..], |it| it.parts).iter();
        let parts = parts.filter(|it| it.occurs(edition) != Occurs::Never);
        waiting.extend(parts.flat_map(|it| it.elements(edition)));
    }
    found
}

#[test]
fn the_table_says_what_the_public_grammar_says() {
    for (edition, prefix) in [(Edition::V1_0, "1.0 "), (Edition::V1_1, "1.1 ")] {
        let facts = facts();
        let facts = facts.lines().filter_map(|line| line.strip_prefix(prefix));
        let expected: BTreeSet<_> = facts.map(str::to_owned).collect();
        let reachable = reachable(edition);
        let known = elements().filter(|it| reachable.contains(it.name));
        let mut table: BTreeSet<_> = known.map(|it| line(it, edition)).collect();
        let units: BTreeSet<_> = units(edition).collect();
        let units: Vec<_> = units.into_iter().collect();
        table.insert(format!("units {}", units.join("; ")));
        let missing: Vec<_> = expected.difference(&table).collect();
        let surplus: Vec<_> = table.difference(&expected).collect();
        assert!(
            missing.is_empty() && surplus.is_empty(),
            "edition {prefix}lacks\n{missing:#?}\nand has\n{surplus:#?}"
        );
    }
}
