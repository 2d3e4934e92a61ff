//! Our own definitions: they are sound, they say on the wire what the public ones say, and they
//! say it to people in words of their own.

mod support;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use jsidl::model::{Item, Meaning, Message, Scalar, Service, Shape};
use jsidl::{Library, Loader};

fn load(paths: &[PathBuf]) -> Library {
    let mut loader = Loader::new();
    for path in paths {
        loader.path(path);
    }
    let loaded = loader.load();
    for diagnostic in loaded.diagnostics.iter() {
        eprintln!("{diagnostic}");
    }
    assert!(!loaded.diagnostics.has_errors());
    loaded.library
}

fn ours() -> Library {
    let library = load(&[Path::new(env!("CARGO_MANIFEST_DIR")).join("services")]);
    assert!(library.services().next().is_some());
    library
}

/// The public definitions that ours follow, newest first.
fn public(corpus: &Path) -> [Library; 2] {
    [
        ["ffi/urn.jaus.jss.core", "ffi/urn.jaus.jss.mobility"],
        ["jts/urn.jaus.jss.core-v1.0", "jts/urn.jaus.jss.mobility"],
    ]
    .map(|folders| load(&folders.map(|folder| corpus.join(folder))))
}

#[test]
fn every_service_of_the_core_and_mobility_sets_is_there() {
    let library = ours();
    let versions = |set: &str| {
        let prefix = format!("urn:jaus:jss:{set}:");
        let ids = library.services().map(|service| service.id.clone());
        ids.filter(|id| id.urn.starts_with(&prefix)).count()
    };
    assert_eq!(versions("core"), 8 + 7, "1.1, and 1.0 without List Manager");
    assert_eq!(
        versions("mobility"),
        21 + 3,
        "1.1, and the layouts that were published before"
    );
    let own = library
        .services()
        .filter(|it| it.id.urn.starts_with("urn:jaus-rs:ground:"));
    assert!(own.count() >= 3, "our own set");
    for service in library.services() {
        let root = library
            .lineage(service)
            .last()
            .map(|root| root.name.clone());
        assert_eq!(
            root.as_deref(),
            Some("Transport"),
            "{} descends from it",
            service.id
        );
    }
}

#[test]
fn every_message_and_field_says_what_it_is_for() {
    for service in ours().services() {
        assert!(!service.description.is_empty(), "{}", service.id);
        for message in service.messages() {
            assert!(
                !message.description.is_empty(),
                "{} {}",
                service.id,
                message.name
            );
            each_field(message, &mut |item| {
                assert!(
                    !item.interpretation.is_empty(),
                    "{} {}",
                    message.name,
                    item.name
                );
            });
        }
    }
}

#[test]
fn every_message_of_the_newest_public_definitions_is_the_same_on_the_wire() {
    let Some(shared) = support::shared() else {
        return;
    };
    let ours = ours();
    let public = public(&shared.join("jsidl-corpus"));
    let mut compared = 0;
    // The layouts that one public source of 1.0 has, and the other has not.
    let told_apart = ["GlobalVectorDriver", "LocalVectorDriver"];
    for theirs in public.iter().flat_map(Library::services) {
        let Some(service) = ours.service(&theirs.id) else {
            continue;
        };
        if service.id.version.minor == 0 && told_apart.contains(&service.name.as_str()) {
            continue;
        }
        assert_eq!(layouts(service), layouts(theirs), "{}", service.id);
        let base = |service: &Service| service.inherits_from.as_ref().map(|base| base.id.clone());
        assert_eq!(base(service), base(theirs), "{}", service.id);
        compared += 1;
    }
    assert_eq!(compared, 8 + 21 + 7);
}

#[test]
fn no_sentence_is_taken_from_the_public_definitions() {
    let Some(shared) = support::shared() else {
        return;
    };
    let mut theirs = BTreeSet::new();
    for library in public(&shared.join("jsidl-corpus")) {
        for text in texts(&library) {
            theirs.extend(runs(&text));
        }
    }
    let taken: BTreeMap<_, _> = texts(&ours())
        .into_iter()
        .flat_map(|text| {
            runs(&text)
                .map(|run| (run, text.clone()))
                .collect::<Vec<_>>()
        })
        .filter(|(run, _)| theirs.contains(run))
        .collect();
    assert_eq!(taken, BTreeMap::new());
}

/// All runs of six words in a text.
fn runs(text: &str) -> impl Iterator<Item = Vec<String>> {
    let words = text
        .split(|c: char| !c.is_alphanumeric())
        .filter(|word| !word.is_empty());
    let words: Vec<_> = words.map(str::to_lowercase).collect();
    words
        .windows(6)
        .map(<[String]>::to_vec)
        .collect::<Vec<_>>()
        .into_iter()
}

fn texts(library: &Library) -> Vec<String> {
    let mut texts = Vec::new();
    for service in library.services() {
        texts.push(service.description.clone());
        for message in service.messages() {
            texts.push(message.description.clone());
            each_field(message, &mut |item| texts.push(item.interpretation.clone()));
        }
    }
    texts
}

fn each_field(message: &Message, visit: &mut impl FnMut(&Item)) {
    message
        .body
        .iter()
        .for_each(|body| each_field_of(body, visit));
}

fn each_field_of(item: &Item, visit: &mut impl FnMut(&Item)) {
    match &item.shape {
        Shape::Group(group) => group
            .members
            .iter()
            .for_each(|member| each_field_of(member, visit)),
        Shape::List(list) => each_field_of(&list.element, visit),
        Shape::Variant(variant) => {
            variant
                .alternatives
                .iter()
                .for_each(|chosen| each_field_of(chosen, visit));
        }
        _ => visit(item),
    }
}

/// What a service says on the wire, in the words of the definitions: everything but the texts and
/// the limits of counts, in which ours are more tolerant.
fn layouts(service: &Service) -> BTreeMap<(u16, String), String> {
    let messages = service.messages().map(|message| {
        let body = message.body.as_ref().map(layout);
        (
            (message.code, message.name.clone()),
            format!("{} {body:?}", message.is_command),
        )
    });
    messages.collect()
}

fn layout(item: &Item) -> String {
    let optional = if item.optional { "?" } else { "" };
    let all = |items: &[Item]| items.iter().map(layout).collect::<Vec<_>>().join(" ");
    let shape = match &item.shape {
        Shape::Group(group) => format!("{:?}({})", group.presence, all(&group.members)),
        Shape::List(list) => format!("{:?}[{}]", list.count.unsigned, layout(&list.element)),
        Shape::Variant(variant) => format!("{:?}<{}>", variant.tag, all(&variant.alternatives)),
        Shape::Scalar(number) => scalar(number),
        Shape::Bits(bits) => {
            let fields = bits
                .fields
                .iter()
                .map(|f| format!("{}:{}..{}", f.name, f.from, f.to));
            format!("{:?} {:?}", bits.base, fields.collect::<Vec<_>>())
        }
        Shape::FixedString { length } => format!("text {length}"),
        Shape::VariableString { count } => format!("text {:?}", count.unsigned),
        Shape::Blob { count, format } => format!("{format} {:?}", count.unsigned),
        Shape::FormattedBlob { formats, count } => format!("{formats:?} {:?}", count.unsigned),
        Shape::Measure { choices } => {
            let choices = choices.iter().map(|choice| {
                format!(
                    "{} {:?} {}",
                    choice.index,
                    choice.name,
                    scalar(&choice.scalar)
                )
            });
            choices.collect::<Vec<_>>().join(" ")
        }
        shape => format!("{shape:?}"),
    };
    format!("{}{optional}={shape}", item.name)
}

fn scalar(scalar: &Scalar) -> String {
    let meaning = match &scalar.meaning {
        Meaning::Plain => String::new(),
        Meaning::Scaled(scale) => format!("{scale:?}"),
        Meaning::Values(set) => {
            let values: BTreeMap<_, _> = set
                .values
                .iter()
                .map(|value| (value.index, value.name.replace("FEATURE _", "FEATURE_")))
                .collect();
            format!("{values:?}")
        }
    };
    format!("{:?} {} {meaning}", scalar.number, scalar.units)
}
