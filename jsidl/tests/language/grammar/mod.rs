//! Every construct of the public grammar is read, checked strictly, formatted and executed.
//!
//! `as5684.txt` holds the facts of the public grammar; `every.xml` has each of its elements and
//! attributes.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use jsidl::behaviour::{ActionKind, Name, TransitionKind};
use jsidl::machine::{Machine, Outcome, Run, Stimulus};
use jsidl::model::{Meaning, Shape};
use jsidl::{Library, Loader};
use roxmltree::Document;

const EVERY: &str = include_str!("every.xml");

/// An element of edition 1.1: its attributes and children, each with its sign.
struct Fact {
    element: String,
    attributes: Vec<(String, bool)>,
    children: Vec<(Vec<String>, bool)>,
}

fn facts() -> Vec<Fact> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/language/grammar");
    let text = fs::read_to_string(folder.join("as5684.txt")).expect("it is there");
    let lines = text.lines().filter_map(|line| line.strip_prefix("1.1 "));
    let lines = lines.filter(|line| !line.starts_with("units "));
    lines.map(fact).collect()
}

fn fact(line: &str) -> Fact {
    let mut words = line.split(' ');
    let element = words.next().expect("an element").to_owned();
    let (mut attributes, mut children) = (Vec::new(), Vec::new());
    for word in words.filter(|word| *word != "#text") {
        if let Some(attribute) = word.strip_prefix('@') {
            let (name, _) = attribute.split_once('=').expect("a value");
            let bare = name.trim_end_matches('?');
            attributes.push((bare.to_owned(), bare == name));
        } else {
            let choice = word.trim_end_matches(['?', '*', '+']);
            let mandatory = !word.ends_with(['?', '*']);
            let names = choice.trim_matches(['(', ')']).split('|');
            children.push((names.map(str::to_owned).collect(), mandatory));
        }
    }
    Fact {
        element,
        attributes,
        children,
    }
}

fn findings(text: &str) -> Vec<String> {
    let mut loader = Loader::new();
    loader.strict().text("every.xml", text);
    let found = loader.load().diagnostics;
    found.iter().map(|it| it.message.clone()).collect()
}

fn library() -> Library {
    let mut loader = Loader::new();
    loader.text("every.xml", EVERY);
    loader.load().library
}

#[test]
fn every_element_and_attribute_is_read_without_a_finding() {
    let document = Document::parse(EVERY).expect("it is well-formed");
    for fact in facts() {
        let all: Vec<_> = document.descendants().collect();
        let named: Vec<_> = all
            .iter()
            .filter(|it| it.has_tag_name(name_of(&fact.element)))
            .collect();
        // A declared event has no counterpart to refer to.
        if fact.element == "declared_event_def" {
            continue;
        }
        assert!(!named.is_empty(), "no `{}`", fact.element);
        for (attribute, _) in &fact.attributes {
            let mut elements = named.iter();
            assert!(
                elements.any(|it| it.has_attribute(attribute.as_str())),
                "no `{attribute}` in a `{}`",
                fact.element
            );
        }
    }
    assert_eq!(findings(EVERY), Vec::<String>::new());
}

fn name_of(element: &str) -> (&str, &str) {
    ("urn:jaus:jsidl:1.1", element)
}

/// The text without a part of it.
fn without(range: std::ops::Range<usize>) -> String {
    format!("{}{}", &EVERY[..range.start], &EVERY[range.end..])
}

#[test]
fn a_strict_check_misses_every_mandatory_attribute_and_child() {
    let document = Document::parse(EVERY).expect("it is well-formed");
    for fact in facts() {
        let found = document
            .descendants()
            .find(|it| it.has_tag_name(name_of(&fact.element)));
        let Some(xml) = found else { continue };
        for (attribute, _) in fact.attributes.iter().filter(|(_, mandatory)| *mandatory) {
            let given = xml
                .attribute_node(attribute.as_str())
                .expect("it is mandatory");
            let message = format!(
                "`{}` lacks the attribute `{attribute}`: add it",
                fact.element
            );
            let found = findings(&without(given.range()));
            assert!(found.contains(&message), "{message}: {found:#?}");
        }
        for (children, _) in fact.children.iter().filter(|(_, mandatory)| *mandatory) {
            let of_choice = |name: &str| children.iter().any(|child| child == name);
            let mut text = EVERY.to_owned();
            let inner = xml.children().filter(|it| of_choice(it.tag_name().name()));
            let inner: Vec<_> = inner.map(|it| it.range()).collect();
            for range in inner.into_iter().rev() {
                text.replace_range(range, "");
            }
            let start = format!("`{}` ", fact.element);
            let about = |it: &String| {
                let lacks = it.contains("lacks") || it.contains("has no element type");
                it.starts_with(&start) && lacks
            };
            let found = findings(&text);
            assert!(
                found.iter().any(about),
                "{start}without {children:?}: {found:#?}"
            );
        }
    }
}

#[test]
fn a_strict_check_finds_elements_out_of_order() {
    let swapped = EVERY.replacen("<assumptions>None.</assumptions>", "", 1);
    let swapped = swapped.replacen(
        "<description>What the lamp extends.</description>",
        "<assumptions>None.</assumptions><description>What the lamp extends.</description>",
        1,
    );
    assert_eq!(
        findings(&swapped),
        ["`description` comes before `assumptions` in `service_def`: move it up"]
    );
}

#[test]
fn a_strict_check_holds_to_the_edition_of_the_namespace() {
    let old = EVERY.replace("urn:jaus:jsidl:1.1", "urn:jaus:jsidl:1.0");
    let found: BTreeSet<_> = findings(&old).into_iter().collect();
    for expected in [
        "`message_def` lacks the attribute `is_command`: add it",
        "the standard does not permit `percent` as `field_units`: use a unit of the standard",
        "the standard has no `internal` in `transition` of this edition: remove it",
        "the standard has no `value_set` in `declared_type_set` of this edition: remove it",
        "the standard has no attribute `deprecated` in `message_def`: remove it",
    ] {
        assert!(found.contains(expected), "{expected}: {found:#?}");
    }
}

#[test]
fn named_value_sets_reach_the_fields_that_refer_to_them() {
    let library = library();
    let (_, message) = library.by_code(0x0D01).next().expect("SetMood is there");
    assert!(!message.is_command);
    let body = message.body.as_ref().expect("it has a body");
    let Shape::Group(record) = &body.shape else {
        panic!("the body is a record");
    };
    let Shape::Scalar(mood) = &record.members[0].shape else {
        panic!("a mood is a number");
    };
    let Meaning::Values(values) = &mood.meaning else {
        panic!("a mood has names");
    };
    let named: Vec<_> = values
        .values
        .iter()
        .map(|it| (it.index, &*it.name))
        .collect();
    assert_eq!(named, [(-1, "Low"), (0, "Normal")]);
}

#[test]
fn a_wildcard_means_the_newest_version() {
    let library = library();
    let lamp = library
        .versions("urn:test:Lamp")
        .next()
        .expect("it is there");
    let base = lamp.inherits_from.as_ref().expect("it has a base");
    assert_eq!(base.id.to_string(), "urn:test:Base 1.2");
}

/// A run of the lamp's machine with its actions so far.
fn run(machine: &Machine<'_>, steps: &[Stimulus<'_>], holds: &[&str]) -> (String, Vec<String>) {
    let mut done = Vec::new();
    let mut act = |action: &jsidl::behaviour::Action| {
        let sends = if action.kind == ActionKind::Send {
            "send "
        } else {
            ""
        };
        done.push(format!("{sends}{}", action.name));
    };
    let mut ask = |guard: &jsidl::behaviour::Guard| holds.contains(&guard.to_string().as_str());
    let mut run = Run::start(machine, &mut act);
    for stimulus in steps {
        assert_eq!(run.step(*stimulus, &mut ask, &mut act), Outcome::Handled);
    }
    (machine.state(run.state()).path.to_string(), done)
}

#[test]
fn default_transitions_pushes_and_pops_are_executed() {
    let library = library();
    let lamp = library
        .versions("urn:test:Lamp")
        .next()
        .expect("it is there");
    let machines = library.machines(lamp);
    let [machine] = machines.as_slice() else {
        panic!("{} machines", machines.len());
    };
    let timeout = Stimulus::event("Timeout");
    assert_eq!(
        run(machine, &[timeout], &[]),
        ("Paused".into(), vec!["light".into(), "send Timeout".into()])
    );
    // The push remembers the state of its `simple`; the pop is followed by an event.
    assert_eq!(
        run(machine, &[timeout, timeout], &[]),
        (
            "Ready.Lit".into(),
            ["light", "send Timeout", "light", "brighten"]
                .map(str::to_owned)
                .to_vec()
        )
    );
    // A default transition of the state comes before that of its default state …
    let unknown = Stimulus::event("Unknown");
    let (state, done) = run(machine, &[unknown], &["isStrict()"]);
    assert_eq!(
        (state.as_str(), &*done),
        (
            "Ready.Dark",
            &["light".to_owned(), "complain".to_owned()][..]
        )
    );
    // … and that of the machine comes last.
    let (state, done) = run(machine, &[timeout, unknown], &[]);
    assert_eq!(
        (state.as_str(), done.last().map(String::as_str)),
        ("Paused", Some("ignore"))
    );
}

#[test]
fn drawings_name_what_they_show() {
    let library = library();
    let lamp = library
        .versions("urn:test:Lamp")
        .next()
        .expect("it is there");
    let machines = library.machines(lamp);
    let drawing = jsidl::machine::dot(&machines[0]);
    for label in [
        "any other event [isStrict()] / complain",
        "Timeout, with return to Ready.Lit",
        "Timeout, then return and Resume(7)",
        "exit / send Timeout(1)",
    ] {
        assert!(drawing.contains(label), "{label}: {drawing}");
    }
    let pops = machines[0]
        .states()
        .flat_map(|(_, state)| &state.transitions);
    let pops = pops.filter(|it| matches!(it.item.kind, TransitionKind::Pop(Some(_))));
    assert_eq!(pops.count(), 1);
    assert!(
        machines[0]
            .find(&Name::parse("Paused").expect("a name"))
            .is_some()
    );
}

#[test]
fn generated_machines_have_default_transitions_pushes_and_pops() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/language/grammar/every.xml");
    let build = jsidl::build::Build::new()
        .path(file)
        .module("every", "urn:test:");
    let (files, diagnostics) = build.generate();
    assert_eq!(diagnostics.to_string(), "");
    let code = &files[0].1;
    for line in [
        "self.remembered.push(State::ReadyLit);",
        "self.on_resume(7, behaviour);",
        "behaviour.complain();",
        "behaviour.ignore();",
        "behaviour.timeout(",
    ] {
        assert!(code.contains(line), "{line}: {code}");
    }
}
