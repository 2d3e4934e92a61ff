//! XML → compact form → XML keeps every definition: those of the catalogue, of the public corpus,
//! and the one with every construct of the grammar.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use jaus_test_kit::evidence;
use jsidl::diff::compare;
use jsidl::format::{compact, format};
use jsidl::permission::Permissions;
use jsidl::{Library, Loader, catalogue};
use roxmltree::{Document, Node};

/// What an element says if it leaves an attribute out.
const DEFAULTS: [(&str, &str); 6] = [
    ("optional", "false"),
    ("is_command", "false"),
    ("is_stateless", "false"),
    ("deprecated", "false"),
    ("offset_to_lower_limit", "false"),
    ("min_count", "0"),
];

/// Greatest number of an unsigned type.
fn greatest(kind: &str) -> u64 {
    match kind {
        "unsigned byte" => u8::MAX.into(),
        "unsigned short integer" => u16::MAX.into(),
        "unsigned integer" => u32::MAX.into(),
        _ => u64::MAX,
    }
}

fn fold(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn is_of_the_language(node: &Node<'_, '_>) -> bool {
    let uri = node.tag_name().namespace().unwrap_or_default();
    // The drawing of a start is left out, as all drawings are.
    uri.starts_with("urn:jaus:jsidl:1.") && node.tag_name().name() != "pseudo_start_state"
}

/// The content of an element, sorted where order means nothing.
fn meaning(node: Node<'_, '_>) -> String {
    let name = node.tag_name().name();
    let mut attributes: BTreeMap<&str, String> = BTreeMap::new();
    for given in node.attributes() {
        match given.namespace() {
            None => attributes.insert(given.name(), fold(given.value())),
            // Attributes of our own: none has the name of one of the language.
            Some("urn:jaus-rs:jsidl") => attributes.insert(given.name(), fold(given.value())),
            Some(_) => None,
        };
    }
    if name.ends_with("_field")
        && let Some(kind) = attributes.get("field_type_unsigned").cloned()
        && (name == "count_field" || name == "vtag_field")
    {
        attributes
            .entry("max_count")
            .or_insert_with(|| greatest(&kind).to_string());
    }
    attributes.retain(|name, value| !value.is_empty() && !DEFAULTS.contains(&(*name, value)));
    if node.attribute("optional") == Some("false") && name.starts_with("declared_") {
        attributes.insert("optional", "false".to_owned());
    }
    let text = match name {
        "description" | "assumptions" => fold(
            &node
                .children()
                .filter_map(|it| it.text())
                .collect::<String>(),
        ),
        _ => String::new(),
    };
    let mut children: Vec<_> = node
        .children()
        .filter(Node::is_element)
        .filter(is_of_the_language)
        .map(meaning)
        .collect();
    let ordered = [
        "record",
        "sequence",
        "variant",
        "value_set",
        "transition",
        "default_transition",
        "entry",
        "exit",
        "state",
        "action",
        "send_action",
        "pop",
        "array",
        "protocol_behavior",
        "bit_field",
    ];
    // Only lists whose order is free are sorted; a transition's parts have a prescribed order.
    if !ordered.contains(&name) || name == "state" || name == "transition" {
        children.sort();
    }
    format!("<{name} {attributes:?} {text:?} {}>", children.join(" "))
}

fn meaning_of(text: &str) -> String {
    let document = Document::parse(text).expect("well-formed");
    meaning(document.root_element())
}

/// The definitions of some files in the compact form, each with its own name.
fn in_compact_form(files: &[(PathBuf, String)]) -> Vec<(PathBuf, String)> {
    let written = files.iter().map(|(path, text)| {
        let written = compact(path, text).unwrap_or_else(|findings| panic!("{findings}"));
        let again = format(path.with_extension("csd"), &written)
            .unwrap_or_else(|findings| panic!("{findings}"));
        same_lines(path, &written, &again);
        (path.with_extension("csd"), written)
    });
    written.collect()
}

fn library(files: &[(PathBuf, String)]) -> (Library, String) {
    let mut loader = Loader::new();
    for (path, text) in files {
        loader.text(path, text);
    }
    let loaded = loader.load();
    (loaded.library, loaded.diagnostics.to_string())
}

/// Compares two long texts line by line.
#[track_caller]
fn same_lines(path: &Path, first: &str, second: &str) {
    for (number, (first, second)) in first.lines().zip(second.lines()).enumerate() {
        assert_eq!(first, second, "{}:{}", path.display(), number + 1);
    }
    assert_eq!(
        first.lines().count(),
        second.lines().count(),
        "{}",
        path.display()
    );
}

#[track_caller]
fn keeps_everything(files: &[(PathBuf, String)]) {
    let written = in_compact_form(files);
    let mut loader = Loader::new();
    for (path, text) in &written {
        loader.text(path, text);
    }
    let (back, findings) = loader.xml();
    let errors: Vec<_> = findings.errors().map(ToString::to_string).collect();
    assert_eq!(errors, Vec::<String>::new());
    assert_eq!(back.len(), files.len());
    for ((path, text), (_, back)) in files.iter().zip(&back) {
        let lines = |text: &str| meaning_of(text).replace('<', "\n<");
        same_lines(path, &lines(text), &lines(back));
    }
    let (before, _) = library(files);
    let (after, found) = library(&written);
    assert_eq!(
        before.services().count(),
        after.services().count(),
        "{found}"
    );
    let permissions = |library| Permissions::of(library).to_string();
    assert_eq!(permissions(&before), permissions(&after));
    let changes = compare(&before, &after, |_| true);
    let changes: Vec<_> = changes
        .iter()
        .map(|it| (&it.service, &it.path, &it.message))
        .collect();
    assert!(changes.is_empty(), "{changes:#?}");
}

fn files_of(folder: &Path, found: &mut Vec<(PathBuf, String)>) {
    let mut entries: Vec<_> = fs::read_dir(folder)
        .expect("the folder exists")
        .map(|it| it.expect("readable").path())
        .collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            files_of(&path, found);
        } else if path.extension().is_some_and(|it| it == "xml") {
            let text = fs::read_to_string(&path).expect("UTF-8");
            found.push((path, text.trim_start_matches('\u{feff}').to_owned()));
        }
    }
}

#[test]
fn every_definition_of_the_catalogue_comes_back() {
    let entries = catalogue::entries().iter();
    let files: Vec<_> = entries
        .map(|it| (PathBuf::from(it.path), it.text()))
        .collect();
    assert!(files.len() > 100, "{} files", files.len());
    keeps_everything(&files);
}

#[test]
fn every_construct_of_the_grammar_comes_back() {
    let text = include_str!("../language/grammar/every.xml");
    let document = Document::parse(text).expect("well-formed");
    let parts = document.root_element().children().filter(Node::is_element);
    // One definition in each file.
    let parts = parts.filter(|it| it.tag_name().name() != "description");
    let files: Vec<_> = parts
        .enumerate()
        .map(|(number, part)| {
            let part = &text[part.range()];
            let end = part.find([' ', '\n', '>']).expect("a tag");
            let (tag, rest) = part.split_at(end);
            let text = format!("{tag} xmlns=\"urn:jaus:jsidl:1.1\"{rest}");
            (PathBuf::from(format!("part{number}.xml")), text)
        })
        .collect();
    keeps_everything(&files);
}

#[test]
fn the_public_corpus_comes_back() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    for source in ["jts", "fkie", "ffi", "jts-examples"] {
        let mut files = Vec::new();
        files_of(&corpus.join(source), &mut files);
        files.retain(|(_, text)| {
            let root = Document::parse(text)
                .ok()
                .map(|it| it.root_element().tag_name().name().to_owned());
            root.is_some_and(|it| it != "service_set") && format("x.xml", text).is_ok()
        });
        assert!(!files.is_empty(), "{source}");
        keeps_everything(&files);
    }
}
