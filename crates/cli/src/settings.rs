//! Reads settings files (TOML), with errors that name file, line, key, value and the remedy.

use std::fmt::{self, Display};
use std::fs;
use std::ops::Range;
use std::path::Path;

use jaus::node::Config;
use serde_json::Value as Json;
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue, Deserializer, Error};

use super::failure::Failure;
use super::identity::Identity;

/// Keys of the programs; all others are the node's.
const OWN: [&str; 5] = ["id", "name", "kind", "metrics", "log_level"];

/// The table with the flags of a single-component program.
const COMPONENT: &str = "component";
/// The table with the settings of the secure link.
pub const SECURE: &str = "secure";
/// The table with the settings of the audit log.
pub const AUDIT: &str = "audit";

/// Reads a settings file: identity and settings of the node.
pub fn read(path: &Path) -> Result<(Identity, Config), Failure> {
    let text = fs::read_to_string(path).map_err(|error| Failure::file(path, &error))?;
    parse(&text).map_err(|mistake| Failure::new(format!("{}:{mistake}", path.display())))
}

/// A table of a settings file, or the default without one.
///
/// # Errors
/// An unreadable file, or an invalid table.
pub fn section<T: serde::de::DeserializeOwned + Default>(
    path: &Path,
    name: &str,
) -> Result<T, Failure> {
    let text = fs::read_to_string(path).map_err(|error| Failure::file(path, &error))?;
    let read = || {
        let mut table = DeTable::parse(&text)?;
        let section = table.get_mut().remove(name);
        let read = section.map(|it| T::deserialize(toml::de::ValueDeserializer::from(it)));
        read.unwrap_or_else(|| Ok(T::default()))
    };
    read().map_err(|error: Error| {
        let mistake = Mistake::of(&error, &text);
        Failure::new(format!("{}:{mistake}", path.display()))
    })
}

/// The flags in the table `[component]` of a settings file, as command line arguments: a key is a
/// flag's long name, `true` a flag without a value, a list a repeated flag.
///
/// # Errors
/// An unreadable file, or a value that no flag can have.
pub fn flags(path: &Path) -> Result<Vec<String>, Failure> {
    let text = fs::read_to_string(path).map_err(|error| Failure::file(path, &error))?;
    flags_in(&text).map_err(|mistake| Failure::new(format!("{}:{mistake}", path.display())))
}

fn flags_in(text: &str) -> Result<Vec<String>, Mistake> {
    let table = DeTable::parse(text).map_err(|error| Mistake::of(&error, text))?;
    let Some(component) = table.get_ref().get(COMPONENT) else {
        return Ok(Vec::new());
    };
    let mistake =
        |place: Range<usize>, problem: &str| Mistake::at(Some(place), text, problem.to_owned());
    let DeValue::Table(entries) = component.get_ref() else {
        let problem = "write a section, [component]";
        return Err(mistake(component.span(), problem));
    };
    let mut flags = Vec::new();
    for (key, value) in entries {
        let given = flag(key.get_ref(), value);
        flags.extend(given.map_err(|(place, problem)| mistake(place, problem))?);
    }
    Ok(flags)
}

/// Converts one key of a table of flags to command line arguments.
///
/// # Errors
/// The position of a value that no flag can have, and the reason.
pub fn flag(
    name: &str,
    value: &Spanned<DeValue<'_>>,
) -> Result<Vec<String>, (Range<usize>, &'static str)> {
    let single = std::slice::from_ref(value);
    let values = match value.get_ref() {
        DeValue::Array(values) => &values[..],
        _ => single,
    };
    let mut flags = Vec::new();
    for value in values {
        match value.get_ref() {
            DeValue::Boolean(true) => flags.push(format!("--{name}")),
            DeValue::Boolean(false) => {}
            DeValue::String(text) => flags.push(format!("--{name}={text}")),
            DeValue::Integer(number) => flags.push(format!("--{name}={number}")),
            DeValue::Float(number) => flags.push(format!("--{name}={number}")),
            DeValue::Datetime(_) | DeValue::Array(_) | DeValue::Table(_) => {
                let problem =
                    "a flag's value is a string, a number, true or false, or a list of them";
                return Err((value.span(), problem));
            }
        }
    }
    Ok(flags)
}

fn parse(text: &str) -> Result<(Identity, Config), Mistake> {
    let wrong = |error: Error| Mistake::of(&error, text);
    let table = DeTable::parse(text).map_err(wrong)?;
    let known = serde_json::to_value(Config::default()).unwrap_or_default();
    let besides = [&OWN[..], &[COMPONENT, SECURE, AUDIT]].concat();
    if let Some(unknown) = unknown_key(table.get_ref(), &known, &besides, "") {
        return Err(unknown.in_text(text));
    }
    let place = table.span();
    let mut table = table;
    for other in [COMPONENT, SECURE, AUDIT] {
        table.get_mut().remove(other);
    }
    let is_own = |(key, _): &(Spanned<DeString<'_>>, _)| OWN.contains(&key.get_ref().as_ref());
    let (own, node): (Vec<_>, Vec<_>) = table.into_inner().into_iter().partition(is_own);
    let part = |entries: Vec<_>| {
        let table: DeTable<'_> = entries.into_iter().collect();
        Deserializer::from(Spanned::new(place.clone(), table))
    };
    let identity = serde::Deserialize::deserialize(part(own)).map_err(wrong)?;
    let node = serde::Deserialize::deserialize(part(node)).map_err(wrong)?;
    Ok((identity, node))
}

/// A mistake with its position. Displays as `LINE: …`, to follow the file's name.
#[derive(Debug)]
pub struct Mistake {
    line: usize,
    /// The line in the file, key and value, or the part of it around the mistake.
    written: String,
    problem: String,
}

impl Mistake {
    /// A mistake at a position of the text, if that is known.
    pub fn at(place: Option<Range<usize>>, text: &str, problem: String) -> Self {
        let before = place.map_or("", |place| text.get(..place.start).unwrap_or(text));
        let line = before.matches('\n').count();
        let column = before.len() - before.rfind('\n').map_or(0, |end| end + 1);
        let written = text.lines().nth(line).unwrap_or_default();
        let indent = written.len() - written.trim_start().len();
        Self {
            line: line + 1,
            written: around(written.trim(), column.saturating_sub(indent)),
            problem: without_middle(problem),
        }
    }

    /// The mistake that serde or the parser reports, with the remedy.
    pub fn of(error: &Error, text: &str) -> Self {
        let problem = error.message().replace('\n', "; ");
        let problem = match remedy(&problem) {
            Some(remedy) => format!("{problem}: {remedy}"),
            None => problem,
        };
        Self::at(error.span(), text, problem)
    }
}

impl Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: `{}`: {}", self.line, self.written, self.problem)
    }
}

/// Maximum number of characters of a line in a message.
const SHOWN: usize = 80;
/// Those of them that stand before the mistake.
const BEFORE: usize = 30;
/// Maximum number of characters of a problem, which may quote a key or a value.
const PROBLEM: usize = 1000;

/// The part of a line around an octet of it.
fn around(line: &str, place: usize) -> String {
    let length = line.chars().count();
    if length <= SHOWN {
        return line.to_owned();
    }
    let before = line.get(..place).unwrap_or(line).chars().count();
    let first = before.saturating_sub(BEFORE).min(length - SHOWN);
    let part: String = line.chars().skip(first).take(SHOWN).collect();
    let mark = |is_cut| if is_cut { "…" } else { "" };
    format!("{}{part}{}", mark(first > 0), mark(first + SHOWN < length))
}

/// The beginning and the end of a long problem: the remedy is at the end.
fn without_middle(problem: String) -> String {
    let length = problem.chars().count();
    if length <= PROBLEM {
        return problem;
    }
    let part = |skipped| problem.chars().skip(skipped).take(PROBLEM / 2);
    let (begin, end) = (part(0), part(length - PROBLEM / 2));
    begin.chain(['…']).chain(end).collect()
}

/// The remedy, for types that serde names in programmers' terms.
fn remedy(problem: &str) -> Option<&'static str> {
    let (_, expected) = problem.rsplit_once("expected ")?;
    Some(match expected {
        "u8" => "write a whole number from 0 to 255",
        "u16" => "write a whole number from 0 to 65535",
        "u32" | "u64" | "usize" => "write a whole number, 0 or more",
        "a boolean" => "write true or false",
        "a string" | "a borrowed string" => "write a string in double quotes",
        "a sequence" => "write a list in brackets, such as [\"…\", \"…\"]",
        _ if expected.starts_with("struct ") => "write a section, with its name in brackets",
        _ => return None,
    })
}

/// An unknown key.
struct Unknown {
    place: Range<usize>,
    problem: String,
}

impl Unknown {
    fn in_text(self, text: &str) -> Mistake {
        Mistake::at(Some(self.place), text, self.problem)
    }
}

/// The first unknown key. `known` is an example with all keys; where it has no table, any content
/// is accepted here and checked on reading.
fn unknown_key(
    table: &DeTable<'_>,
    known: &Json,
    besides: &[&str],
    section: &str,
) -> Option<Unknown> {
    let known = known.as_object()?;
    for (key, value) in table {
        let (place, key) = (key.span(), key.get_ref().as_ref());
        if besides.contains(&key) {
            continue;
        }
        let Some(inner) = known.get(key) else {
            let names = known
                .keys()
                .map(String::as_str)
                .chain(besides.iter().copied());
            return Some(Unknown {
                place,
                problem: unknown_words(key, section, names),
            });
        };
        let deeper = inner_table(value)
            .and_then(|table| unknown_key(table, inner, &[], &format!("{section}{key}.")));
        if deeper.is_some() {
            return deeper;
        }
    }
    None
}

fn inner_table<'t, 'i>(value: &'t Spanned<DeValue<'i>>) -> Option<&'t DeTable<'i>> {
    match value.get_ref() {
        DeValue::Table(table) => Some(table),
        _ => None,
    }
}

/// The remedy for an unknown key: the most similar key, or all keys.
pub fn unknown_words<'k>(
    key: &str,
    section: &str,
    names: impl Iterator<Item = &'k str> + Clone,
) -> String {
    match nearest(key, names.clone()) {
        Some(nearest) => {
            format!("there is no setting `{section}{key}`; did you mean `{section}{nearest}`?")
        }
        None => {
            let all: Vec<&str> = names.collect();
            format!(
                "there is no setting `{section}{key}`; choose from {}",
                all.join(", ")
            )
        }
    }
}

/// The most similar name to a misspelt one.
pub fn nearest<'k>(misspelt: &str, names: impl Iterator<Item = &'k str>) -> Option<&'k str> {
    /// Minimum similarity of a misspelling.
    const ALIKE: f64 = 0.75;
    let alike = names.map(|name| (strsim::jaro_winkler(misspelt, name), name));
    let best = alike.max_by(|(a, _), (b, _)| a.total_cmp(b));
    best.filter(|(likeness, _)| *likeness >= ALIKE)
        .map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mistake(text: &str) -> String {
        parse(text).map(|_| ()).unwrap_err().to_string()
    }

    #[test]
    fn a_file_holds_who_we_are_and_the_settings_of_the_node() {
        let text = "id = \"101.1.7\"\nname = \"Rover\"\nttl = 3\nmax_message = \"4 MiB\"\n\
                    [mailbox]\noctets = \"64KiB\"";
        let (identity, config) = parse(text).unwrap();
        assert_eq!(identity.name.as_deref(), Some("Rover"));
        assert_eq!((config.ttl, config.max_message), (3, 4 << 20));
        assert_eq!(config.mailbox.octets, 65_536);
    }

    #[test]
    fn an_unknown_key_is_told_with_its_line_and_the_nearest_key() {
        assert_eq!(
            mistake("id = \"1.1\"\n\nprot = 3794"),
            "3: `prot = 3794`: there is no setting `prot`; did you mean `port`?"
        );
        assert_eq!(
            mistake("ttl = 1\n[mailbox]\nmesages = 4"),
            "3: `mesages = 4`: there is no setting `mailbox.mesages`; did you mean \
             `mailbox.messages`?"
        );
        let nothing_alike = mistake("zzz = 1");
        assert!(
            nothing_alike.contains("choose from ") && nothing_alike.contains("port, "),
            "{nothing_alike}"
        );
        assert!(mistake("nmae = \"x\"").contains("did you mean `name`?"));
    }

    #[test]
    fn a_wrong_value_is_told_with_its_line_and_what_would_be_right() {
        for (text, parts) in [
            (
                "port = 3794\nttl = 300",
                &["2: `ttl = 300`: ", "from 0 to 255"][..],
            ),
            (
                "ttl = \"many\"",
                &["1: `ttl = \"many\"`: ", "from 0 to 255"],
            ),
            ("peers = \"10.0.0.2\"", &["1: ", "a list in brackets"]),
            (
                "max_message = \"4 miles\"",
                &["1: ", "`4 miles` is not a size", "4MiB"],
            ),
            (
                "group = \"10.0.0.1\"",
                &["1: ", "224.0.0.0 to 239.255.255.255"],
            ),
            ("id = \"101\"", &["1: `id = \"101\"`: "]),
            ("kind = \"boat\"", &["1: ", "`vehicle`"]),
            ("mailbox = 4", &["1: `mailbox = 4`: ", "write a section"]),
            ("port = ", &["1: "]),
        ] {
            let said = mistake(text);
            for part in parts {
                assert!(said.contains(part), "{text}: {said}");
            }
        }
    }

    #[test]
    fn a_long_line_is_cut_around_the_mistake() {
        let long = "x".repeat(400_000);
        for text in [
            format!("ttl = 1\nname = \"{long}\" ttl = 2"),
            format!("ttl = \"{long}\""),
            format!("{long} = 3"),
            format!("group = \"{long}\""),
        ] {
            let said = mistake(&text);
            assert!(said.chars().count() < 1200, "{} octets", said.len());
        }
        let spaces = " ".repeat(400_000);
        let said = mistake(&format!(
            "mailbox = {{ messages = 1, {spaces}mesages = 4 }}"
        ));
        assert!(said.contains("  mesages = 4 }`: "), "{said}");
        assert_eq!(
            mistake(&format!("   ttl = 300 # {long}"))
                .split(": ")
                .nth(1)
                .unwrap(),
            format!("`ttl = 300 # {}…`", "x".repeat(68))
        );
    }
}
