//! What the compact form leaves to the files that a text refers to: the constructs of references,
//! the versions of services and sets, and the numbers behind the names of constants.

use std::collections::HashMap;

use super::lexer::Fault;
use super::tree::{Element, REFERENCE};
use super::words;
use crate::grammar;

/// Maximum number of names that a reference goes through.
const LONGEST_CHAIN: usize = 64;

/// Maximum number of findings about the references of a text.
const MOST_FAULTS: usize = 100;

/// The sets and services of a load.
#[derive(Debug, Default)]
pub(crate) struct Known {
    type_sets: HashMap<String, Vec<Set>>,
    const_sets: HashMap<String, Vec<Set>>,
    services: HashMap<String, Vec<(String, String)>>,
}

/// A set and what is declared in it. Constants and types share it in a service.
#[derive(Debug, Default, Clone)]
struct Set {
    urn: String,
    version: String,
    /// URN and version of other sets, by local name.
    type_sets: HashMap<String, (String, String)>,
    const_sets: HashMap<String, (String, String)>,
    /// Element and, for references of the compact form, the path.
    types: HashMap<String, (&'static str, String)>,
    constants: HashMap<String, String>,
}

/// How a URN is looked up: the compact form writes it with dots.
fn key(urn: &str) -> String {
    let plain = |it: char| if it.is_ascii_alphanumeric() { it } else { '.' };
    urn.trim().chars().map(plain).collect()
}

/// A version in order of age.
fn age(version: &str) -> (u32, u32) {
    let (major, minor) = version.split_once('.').unwrap_or((version, "0"));
    (
        major.trim().parse().unwrap_or(0),
        minor.trim().parse().unwrap_or(0),
    )
}

impl Set {
    fn of(element: &Element) -> Self {
        let mut set = Self {
            urn: element.value("id").to_owned(),
            version: element.value("version").to_owned(),
            ..Self::default()
        };
        set.add(element);
        set
    }

    fn add(&mut self, element: &Element) {
        for child in &element.children {
            let name = child.value("name").to_owned();
            let target = (
                child.value("id").to_owned(),
                child.value("version").to_owned(),
            );
            match child.name {
                "declared_type_set_ref" => {
                    self.type_sets.entry(name).or_insert(target);
                }
                "declared_const_set_ref" => {
                    self.const_sets.entry(name).or_insert(target);
                }
                "const_def" => {
                    let value = child.value("const_value").to_owned();
                    self.constants.entry(name).or_insert(value);
                }
                other => {
                    let path = child.value("declared_type_ref").to_owned();
                    self.types.entry(name).or_insert((other, path));
                }
            }
        }
    }
}

impl Known {
    /// Adds what a file declares. The first declaration of an identity counts.
    pub(crate) fn add(&mut self, root: &Element) {
        match root.name {
            "service_def" => {
                let service = (
                    root.value("id").to_owned(),
                    root.value("version").to_owned(),
                );
                self.services
                    .entry(key(&service.0))
                    .or_default()
                    .push(service);
            }
            "declared_type_set" => {
                let set = Set::of(root);
                self.type_sets.entry(key(&set.urn)).or_default().push(set);
            }
            "declared_const_set" => {
                let set = Set::of(root);
                self.const_sets.entry(key(&set.urn)).or_default().push(set);
            }
            "service_set" => root.children.iter().for_each(|it| self.add(it)),
            _ => {}
        }
    }

    /// The set with this version, or the newest one.
    fn chosen<'k>(
        sets: &'k HashMap<String, Vec<Set>>,
        target: &(String, String),
    ) -> Option<&'k Set> {
        let (urn, version) = target;
        let all = sets.get(&key(urn))?;
        let exact = all.iter().find(|it| it.version == *version);
        exact.or_else(|| all.iter().max_by_key(|it| age(&it.version)))
    }

    fn type_set<'k>(&'k self, set: &'k Set, alias: &str) -> Option<&'k Set> {
        if let Some(target) = set.type_sets.get(alias) {
            return Self::chosen(&self.type_sets, target);
        }
        // Published definitions use names that only a set to which they refer declares.
        let mut lenders = set
            .type_sets
            .values()
            .filter_map(|it| Self::chosen(&self.type_sets, it));
        let target = lenders.find_map(|it| it.type_sets.get(alias))?;
        Self::chosen(&self.type_sets, target)
    }

    /// The element that a path names, seen from a set.
    fn construct(&self, set: &Set, path: &str) -> Option<&'static str> {
        let (mut set, mut path) = (set, path);
        for _ in 0..LONGEST_CHAIN {
            let (alias, rest) = match path.split_once('.') {
                Some((alias, rest)) => (alias, rest),
                None => {
                    let (element, target) = set.types.get(path)?;
                    if *element != REFERENCE {
                        let bare = element.strip_prefix(REFERENCE);
                        return grammar::element(bare.unwrap_or(element)).map(|it| it.name);
                    }
                    path = target;
                    continue;
                }
            };
            set = self.type_set(set, alias)?;
            path = rest;
        }
        None
    }

    /// The value of a constant, seen from a set.
    fn constant<'k>(&'k self, set: &'k Set, path: &str) -> Option<&'k str> {
        let (mut set, mut path) = (set, path);
        for _ in 0..LONGEST_CHAIN {
            let Some((alias, rest)) = path.split_once('.') else {
                return set.constants.get(path).map(String::as_str);
            };
            let constants = set.const_sets.get(alias);
            let constants = constants.and_then(|it| Self::chosen(&self.const_sets, it));
            set = constants.or_else(|| self.type_set(set, alias))?;
            path = rest;
        }
        None
    }

    /// Completes a text of the compact form. Returns errors and warnings.
    pub(crate) fn complete(&self, root: &mut Element) -> (Vec<Fault>, Vec<Fault>) {
        let mut scope = Set::default();
        for set in [&*root].into_iter().chain(&root.children) {
            if matches!(set.name, "declared_type_set" | "declared_const_set") {
                scope.add(set);
            }
        }
        let mut task = Completion {
            known: self,
            scope,
            errors: Vec::new(),
            warnings: Vec::new(),
        };
        task.element(root);
        task.errors.truncate(MOST_FAULTS);
        task.warnings.truncate(MOST_FAULTS);
        (task.errors, task.warnings)
    }
}

/// Makes a comment of an interpretation that the element has no attribute for.
fn unexplained(element: &mut Element) {
    let known = grammar::element(element.name);
    let has_none = known.is_some_and(|it| it.attribute("interpretation").is_none());
    let given = element
        .attributes
        .iter()
        .position(|it| it.name == "interpretation");
    if let Some(given) = given.filter(|_| has_none) {
        let text = element.attributes.remove(given).value;
        element.comments.push(text);
    }
}

/// Adds empty sections, which the compact form may leave out.
fn add_sections(element: &mut Element) {
    for (section, name, declared) in [
        ("header", "Header", "declared_header"),
        ("body", "Body", "declared_body"),
        ("footer", "Footer", "declared_footer"),
    ] {
        let has = element.child(section).or(element.child(declared)).is_some();
        if !has {
            let at = element.at;
            element
                .children
                .push(Element::new(section, at).with("name", name, at));
        }
    }
    element.in_order();
}

struct Completion<'k> {
    known: &'k Known,
    scope: Set,
    errors: Vec<Fault>,
    warnings: Vec<Fault>,
}

impl Completion<'_> {
    fn element(&mut self, element: &mut Element) {
        unexplained(element);
        match element.name {
            "event_def" | "message_def" => add_sections(element),
            REFERENCE => self.reference(element),
            "inherits_from" | "client_of" | "declared_type_set_ref" | "declared_const_set_ref" => {
                self.identity(element);
            }
            "count_field" | "vtag_field" => self.count(element),
            "type_and_units_enum" | "format_enum" => self.number(element, "index"),
            "fixed_length_string" => self.deep_constant(element, "string_length"),
            "value_range" => {
                self.deep_constant(element, "lower_limit");
                self.deep_constant(element, "upper_limit");
            }
            "scale_range" => {
                self.deep_constant(element, "real_lower_limit");
                self.deep_constant(element, "real_upper_limit");
            }
            _ => {}
        }
        for child in &mut element.children {
            self.element(child);
        }
    }

    fn reference(&mut self, element: &mut Element) {
        let path = element.value("declared_type_ref").to_owned();
        let name = self.known.construct(&self.scope, &path);
        let declared = name.and_then(|it| grammar::element(&format!("{REFERENCE}{it}")));
        element.name = match declared {
            Some(declared) => declared.name,
            None => {
                let message =
                    format!("`{path}` is not declared: declare it, or add the file that does");
                self.errors.push(Fault::new(element.at, message));
                "declared_record"
            }
        };
    }

    /// URN and version of a service or a set.
    fn identity(&mut self, element: &mut Element) {
        if element.attribute("version").is_some() {
            return;
        }
        let urn = element.value("id").to_owned();
        let sets = |sets: &HashMap<String, Vec<Set>>| {
            let found = sets.get(&key(&urn)).into_iter().flatten();
            found
                .map(|it| (it.urn.clone(), it.version.clone()))
                .collect::<Vec<_>>()
        };
        let found = match element.name {
            "declared_type_set_ref" => sets(&self.known.type_sets),
            "declared_const_set_ref" => sets(&self.known.const_sets),
            _ => self
                .known
                .services
                .get(&key(&urn))
                .cloned()
                .unwrap_or_default(),
        };
        let Some((urn, version)) = found.iter().max_by_key(|(_, version)| age(version)) else {
            let message = format!(
                "no version of `{urn}` is loaded, and the compact form does not say which is meant: add its file, or \
                 `//@ version=\"1.0\"` before this"
            );
            self.errors.push(Fault::new(element.at, message));
            element.set("version", "0.0", element.at);
            return;
        };
        if found.iter().any(|(_, other)| other != version) {
            let message = format!(
                "`{urn}` has several versions: the newest, {version}, is used; add `//@ version=\"{version}\"` before this"
            );
            self.warnings.push(Fault::new(element.at, message));
        }
        element.set("id", urn.as_str(), element.at);
        element.set("version", version.as_str(), element.at);
    }

    /// Replaces the name of a constant by its value, as the JAUS Tool Set does.
    fn number(&mut self, element: &mut Element, attribute: &str) {
        let Some(given) = element
            .attributes
            .iter_mut()
            .find(|it| it.name == attribute)
        else {
            return;
        };
        if given.value.trim().parse::<u64>().is_ok() {
            return;
        }
        match self.known.constant(&self.scope, given.value.trim()) {
            Some(value) => value.clone_into(&mut given.value),
            None => {
                let message = format!(
                    "the constant `{}` is not declared: declare it, or write its value",
                    given.value
                );
                self.errors.push(Fault::new(given.at, message));
            }
        }
    }

    /// As [`number`](Self::number), for a path through several sets, which the standard lacks.
    fn deep_constant(&mut self, element: &mut Element, attribute: &str) {
        let value = element.value(attribute);
        let is_path = value
            .chars()
            .all(|it| it.is_ascii_alphanumeric() || it == '_' || it == '.');
        if is_path
            && !value.starts_with(|it: char| it.is_ascii_digit() || it == '.')
            && value.matches('.').count() > 1
        {
            self.number(element, attribute);
        }
    }

    /// The type of a count or a tag, which follows from its limits.
    fn count(&mut self, element: &mut Element) {
        for limit in ["min_count", "max_count"] {
            self.deep_constant(element, limit);
        }
        if element.attribute("field_type_unsigned").is_some() {
            return;
        }
        let limit = |name: &str| {
            let value = element.value(name);
            let value = self.known.constant(&self.scope, value).unwrap_or(value);
            value.trim().parse::<u64>().ok()
        };
        let least = limit("min_count").unwrap_or(0);
        let at = element.at;
        let kind = match limit("max_count") {
            Some(most) => {
                let kind = words::counted(least, most);
                if kind != words::smallest(most) {
                    let message = format!(
                        "this counts with a `{kind}`, as in the JAUS Tool Set: if the count has another width, add \
                         `//@ {} field_type_unsigned=\"{}\"` before the construct",
                        element.name,
                        words::smallest(most)
                    );
                    self.warnings.push(Fault::new(at, message));
                }
                kind
            }
            None => {
                let message = format!(
                    "without an upper limit this counts with an `unsigned integer`: if the count has another width, add \
                     `//@ {} field_type_unsigned=\"…\"` before the construct",
                    element.name
                );
                self.warnings.push(Fault::new(at, message));
                "unsigned integer"
            }
        };
        element.set("field_type_unsigned", kind, at);
    }
}
