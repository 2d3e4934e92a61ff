//! Each rule of the public grammar is read as the XML that it stands for.
//!
//! `rules.txt` lists the rules and keywords of that grammar, `productions.txt` has examples for each.

use std::collections::BTreeSet;

use jsidl::Loader;
use jsidl::format::{compact, format};

const RULES: &str = include_str!("rules.txt");
const PRODUCTIONS: &str = include_str!("productions.txt");

/// What the examples refer to.
const AROUND: [&str; 3] = [
    "constants Other (id = urn.me.Other, version = 1.0) { uint8 MOST = 7 one; }",
    "typeset Basics (id = urn.me.Basics, version = 1.0) {
       using constants urn.me.Other as others;
       field uint16 Speed meter_per_second;
       record Rec { field uint8 A one; }
       header Head { } body Nothing { } footer Foot { }
     }",
    "service Base (id = urn.me.Base, version = 1.0) { messages { input { } output { } } }",
];

struct Production<'t> {
    rules: Vec<&'t str>,
    text: &'t str,
    xml: &'t str,
}

fn productions() -> Vec<Production<'static>> {
    let sections = PRODUCTIONS.split("\n== ").skip(1);
    let read = sections.map(|section| {
        let (rules, rest) = section.split_once('\n').expect("rules");
        let (text, xml) = rest.split_once("\n--\n").expect("a text and its XML");
        Production {
            rules: rules.split(' ').collect(),
            text,
            xml: xml.trim(),
        }
    });
    read.collect()
}

/// A whole file around an example, and the same around its XML.
fn whole(production: &Production<'_>) -> (String, String) {
    let space = "xmlns=\"urn:jaus:jsidl:1.1\"";
    let xml = production.xml;
    match production.text.split_once('\n') {
        Some(("types", text)) => (
            format!(
                "typeset T (id = urn.me.T, version = 1.0) {{ using constants urn.me.Other as others;\nusing typeset \
                 urn.me.Basics as basics;\n{text} }}"
            ),
            format!(
                "<declared_type_set {space} name=\"T\" id=\"urn:me:T\" version=\"1.0\"><declared_const_set_ref \
                 name=\"others\" id=\"urn:me:Other\" version=\"1.0\"/><declared_type_set_ref name=\"basics\" \
                 id=\"urn:me:Basics\" version=\"1.0\"/>{xml}</declared_type_set>"
            ),
        ),
        Some(("protocol", text)) => (
            format!(
                "service S (id = urn.me.S, version = 1.0) {{ messages {{ input {{ }} output {{ }} }} protocol {{\n{text} }} }}"
            ),
            format!(
                "<service_def {space} name=\"S\" id=\"urn:me:S\" version=\"1.0\"><message_set><input_set/>\
                 <output_set/></message_set><protocol_behavior>{xml}\
                 </protocol_behavior></service_def>"
            ),
        ),
        _ => {
            let end = xml.find([' ', '>']).expect("a tag");
            let (tag, rest) = xml.split_at(end);
            (production.text.to_owned(), format!("{tag} {space}{rest}"))
        }
    }
}

fn to_xml(text: &str) -> String {
    let mut loader = Loader::new();
    for (number, around) in AROUND.iter().enumerate() {
        loader.text(format!("around{number}.csd"), around);
    }
    loader.text("x.csd", text);
    let (documents, findings) = loader.xml();
    assert!(!findings.has_errors(), "{findings}\n{text}");
    let own = documents
        .into_iter()
        .find(|(path, _)| path.ends_with("x.csd"));
    own.expect("it is translated").1
}

#[test]
fn every_rule_of_the_public_grammar_has_an_example_with_its_keywords() {
    let productions = productions();
    for line in RULES.lines().filter(|it| !it.starts_with('#')) {
        let mut words = line.split(' ');
        let rule = words.next().expect("a rule");
        let examples: Vec<_> = productions
            .iter()
            .filter(|it| it.rules.contains(&rule))
            .collect();
        assert!(!examples.is_empty(), "no example for `{rule}`");
        for word in words {
            let mut texts = productions.iter().map(|it| whole(it).0);
            assert!(
                texts.any(|it| it.contains(word)),
                "no `{word}` in an example"
            );
        }
    }
    let known: BTreeSet<_> = RULES
        .lines()
        .filter_map(|it| it.split(' ').next())
        .collect();
    for rule in productions.iter().flat_map(|it| &it.rules) {
        assert!(known.contains(rule), "`{rule}` is not a rule");
    }
}

#[test]
fn every_rule_is_read_as_the_xml_that_it_stands_for() {
    for production in productions() {
        let (text, xml) = whole(&production);
        let expected = format("x.xml", &xml).expect("a definition");
        assert_eq!(to_xml(&text), expected, "{:?}", production.rules);
    }
}

#[test]
fn every_example_is_written_as_a_text_with_the_same_meaning() {
    for production in productions() {
        let (text, _) = whole(&production);
        let laid_out = compact("x.csd", &text).expect("a definition");
        assert_eq!(to_xml(&laid_out), to_xml(&text), "{laid_out}");
        assert_eq!(compact("x.csd", &laid_out).as_ref(), Ok(&laid_out));
    }
}

#[test]
fn comments_are_kept_in_both_directions() {
    let text = "// About the set.\ntypeset T (id = urn.me.T, version = 1.0) {\n  // About A.\n  field uint8 A one;\n  // \
                The end.\n}\n";
    let xml = to_xml(text);
    for comment in [
        "<!-- About the set. -->",
        "<!-- About A. -->",
        "<!-- The end. -->",
    ] {
        assert!(xml.contains(comment), "{xml}");
    }
    assert_eq!(compact("x.xml", &xml).as_deref(), Ok(text));
}
