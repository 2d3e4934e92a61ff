//! Random hostile definitions through every generator: each gives an answer, and an output that grows with
//! its input. `.ci/full compile-fuzz` limits time and memory, too.

use std::ops::Range;

use jsidl::docs::{self, Format};
use jsidl::model::Service;
use jsidl::ros::{Package, PackageName};
use jsidl::{Library, Loader, cpp, lua, machine, rust, schema, typescript};

use crate::chance::Chance;
use crate::{definitions, number};

/// Numbers at the limits of types, and beyond.
const NUMBERS: &[&str] = &[
    "-1",
    "0",
    "1",
    "255",
    "256",
    "65536",
    "1048576",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "-9223372036854775808",
    "99999999999999999999999999",
    "1e308",
    "1e400",
    "-0",
    "NaN",
    "0x10",
];

/// Texts in place of names, types and references.
const TEXTS: &[&str] = &[
    "",
    " ",
    "a b",
    "::",
    "../../etc/x",
    "&#10;",
    "\u{202E}x",
    "*/",
    "]]&gt;",
    "&quot;);",
    "${x}",
    "\u{1F600}",
    "JAUS MESSAGE",
    "unsigned long integer",
    "true",
];

/// A legal definition, changed in several places.
fn hostile(seed: u64) -> String {
    let mut chance = Chance::new(!seed);
    let text = definitions::random(seed).remove(0);
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for _ in 0..=chance.below(8) {
        change(&mut lines, &mut chance);
    }
    lines.join("\n")
}

fn change(lines: &mut Vec<String>, chance: &mut Chance) {
    let place = chance.below(lines.len() as u64) as usize;
    let element = element(lines, place);
    match chance.below(9) {
        0 if element.len() < lines.len() => drop(lines.drain(element)),
        // Elsewhere, often where it does not belong.
        1 => {
            let part: Vec<_> = lines.drain(element).collect();
            let place = chance.below(lines.len() as u64 + 1) as usize;
            lines.splice(place..place, part);
        }
        // The same again, at most so often that the definition stays small.
        2..=4 => {
            let part = lines[element].to_vec();
            let most = (400 / part.len() as u64).clamp(2, 100);
            for number in 0..chance.below(most) {
                let copy = part.iter().map(|line| renamed(line, number));
                lines.splice(place..place, copy.collect::<Vec<_>>());
            }
        }
        5 | 6 => replace_value(&mut lines[place], chance, NUMBERS),
        7 => replace_value(&mut lines[place], chance, TEXTS),
        _ => {
            let long = "Long".repeat(1 + chance.below(500) as usize);
            replace_value(&mut lines[place], chance, &[&long]);
        }
    }
    if lines.is_empty() {
        lines.push(String::new());
    }
}

/// The lines of the element that begins in a line; that line alone if none does.
fn element(lines: &[String], place: usize) -> Range<usize> {
    let mut depth = 0;
    for (number, line) in lines.iter().enumerate().skip(place) {
        let (ends, alone) = (line.matches("</").count(), line.matches("/>").count());
        depth += line.matches('<').count() as i64 - 2 * ends as i64 - alone as i64;
        match depth {
            0 => return place..number + 1,
            ..0 => break,
            _ => {}
        }
    }
    place..place + 1
}

/// A line whose element has another name, so that it need not collide with the first.
fn renamed(line: &str, number: u64) -> String {
    line.replacen(r#" name=""#, &format!(r#" name="C{number}"#), 1)
}

/// Replaces the value of an attribute.
fn replace_value(line: &mut String, chance: &mut Chance, values: &[&str]) {
    let quotes: Vec<_> = line.match_indices('"').map(|(place, _)| place).collect();
    let pairs = quotes.len() / 2;
    if pairs > 0 {
        let pair = 2 * chance.below(pairs as u64) as usize;
        line.replace_range(quotes[pair] + 1..quotes[pair + 1], chance.of(values));
    }
}

/// The number of octets that all generators write.
fn written(library: &Library) -> usize {
    let services: Vec<&Service> = library.services().map(AsRef::as_ref).collect();
    let files = |files: Vec<(String, String)>| files.iter().map(|(_, text)| text.len()).sum();
    let pages = |format| {
        let pages = docs::pages(library, |_| true, format);
        pages.iter().map(|page| page.text.len()).sum::<usize>()
    };
    let schemas = schema::files(library, |_| true).into_iter();
    let machines = services
        .iter()
        .flat_map(|service| library.machines(service));
    [
        rust::module(library, services.iter().copied(), "::jaus_codec").len(),
        lua::dissector(library).len(),
        files(cpp::files(library, |_| true)),
        files(typescript::files(library, |_| true)),
        files(Package::of(library, |_| true, &PackageName::default()).files()),
        pages(Format::Html),
        pages(Format::Markdown),
        schemas.map(|(_, schema)| schema.to_string().len()).sum(),
        machines
            .map(|it| machine::dot(&it).len() + machine::mermaid(&it).len())
            .sum(),
    ]
    .into_iter()
    .sum()
}

/// Sends hostile definitions through every generator; returns how many had something to generate.
fn all_are_answered(seeds: Range<u64>) -> usize {
    /// What is written whatever the input: the codecs of C++ and TypeScript, the interpreter of Lua, the
    /// frame of pages.
    const FIXED: usize = 400 << 10;
    /// Octets of output for each of input.
    const MOST: usize = 100;
    let mut usable = 0;
    for seed in seeds {
        let text = hostile(seed);
        let mut loader = Loader::new();
        loader.text("hostile.xml", &text);
        let library = loader.load().library;
        usable += usize::from(library.services().next().is_some());
        let octets = written(&library);
        let limit = FIXED + MOST * text.len();
        assert!(
            octets <= limit,
            "seed {seed}: {} to {octets}\n{text}",
            text.len()
        );
    }
    usable
}

#[test]
fn every_generator_answers_hostile_definitions_with_bounded_output() {
    let usable = all_are_answered(0..150);
    assert!(usable > 50, "{usable} of 150 had a service");
}

/// `JAUS_CASES` of them, from the seed `JAUS_SEED`.
#[test]
#[ignore = "takes as long as one wants: see .ci/full"]
fn every_generator_answers_many_hostile_definitions_with_bounded_output() {
    let (first, cases) = (number("JAUS_SEED", 1000), number("JAUS_CASES", 400));
    let usable = all_are_answered(first..first.saturating_add(cases));
    println!("{usable} of {cases} definitions had a service");
}
