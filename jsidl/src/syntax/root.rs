//! Reads whole files: services, type sets and constant sets.

use roxmltree::{Document, Node as Xml, ParsingOptions};

use super::element::{Belongs, Children, NUMBERS, Reader, belongs};
use super::limits;
use super::{
    ConstDef, ConstSet, Constant, Declaration, Program, ServiceDef, ServiceRef, SetRef, TypeSet,
};
use crate::diagnostic::Report;
use crate::grammar::strict;
use crate::model::{Id, Version};
use crate::source::{Source, Span};

/// Treatment of an XML file that is no JSIDL.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Strictness {
    /// Named by the user: an error.
    Named,
    /// Found in a directory: skipped with a warning.
    Found,
}

/// Reads one text and adds what it declares to the program.
pub(crate) fn read(
    source: &Source,
    strictness: Strictness,
    program: &mut Program,
    report: &mut Report,
) {
    if let Some(document) = parse(source, report) {
        let mut reader = Reader { source, report };
        reader.root(document.root_element(), strictness, program);
    }
}

/// Reports what the standard does not permit in a text; nothing if it is no definition.
pub(crate) fn check_strictly(source: &Source, report: &mut Report) {
    let mut known = Report::default();
    if let Some(document) = parse(source, &mut known) {
        strict::check(document.root_element(), source, report);
    }
}

/// Whether a text is XML with a root element of the language; if not, it is reported.
pub(crate) fn is_definition(source: &Source, report: &mut Report) -> bool {
    let Some(document) = parse(source, report) else {
        return false;
    };
    let root = document.root_element();
    let known = belongs(root) != Belongs::Foreign && ROOTS.contains(&root.tag_name().name());
    if !known {
        let mut reader = Reader { source, report };
        reader.stranger(root, Strictness::Named);
    }
    known
}

fn parse<'s>(source: &'s Source, report: &mut Report) -> Option<Document<'s>> {
    let text = source.xml();
    if let Some((at, what)) = limits::excess(text) {
        report.error(source.span(at), what);
        return None;
    }
    // A node takes at least three octets of text, so the size limit also bounds the nodes.
    let options = ParsingOptions {
        allow_dtd: false,
        ..ParsingOptions::default()
    };
    Document::parse_with_options(text, options)
        .map_err(|error| {
            report.error(malformed_at(source, &error), malformed(&error));
        })
        .ok()
}

fn malformed(error: &roxmltree::Error) -> String {
    match error {
        roxmltree::Error::DtdDetected => {
            "a document type declaration is ignored and not needed in JSIDL: remove it".into()
        }
        error => {
            // The parser's message ends with the position, which the diagnostic has already.
            let pos = error.pos();
            let text = error.to_string();
            let text = text
                .strip_suffix(&format!(" at {}:{}", pos.row, pos.col))
                .unwrap_or(&text);
            format!("not well-formed XML: {text}")
        }
    }
}

fn malformed_at(source: &Source, error: &roxmltree::Error) -> Span {
    let pos = error.pos();
    let before = source
        .xml()
        .split_inclusive('\n')
        .take(pos.row as usize - usize::from(pos.row > 0));
    let line: usize = before.map(str::len).sum();
    let rest = source.xml().get(line..).unwrap_or("");
    let column = (pos.col as usize).saturating_sub(1);
    let within = rest
        .char_indices()
        .nth(column)
        .map_or(rest.len(), |(at, _)| at);
    source.span(line + within)
}

/// Permitted root elements.
const ROOTS: [&str; 4] = [
    "service_def",
    "declared_type_set",
    "declared_const_set",
    "service_set",
];

/// Maximum number of sets that one set refers to; published ones refer to at most 10.
const MOST_REFERENCES: usize = 200;

impl Reader<'_> {
    fn root(&mut self, xml: Xml<'_, '_>, strictness: Strictness, program: &mut Program) {
        let name = xml.tag_name().name();
        match (belongs(xml), name) {
            (Belongs::Jsidl | Belongs::Plus, "service_set") => {
                for child in self.enter(xml) {
                    if child.tag_name().name() != "description" {
                        self.root(child, strictness, program);
                    }
                }
            }
            (Belongs::Jsidl, "service_def") => {
                let service = self.service(xml, program);
                program.services.push(service);
            }
            (Belongs::Jsidl, "declared_type_set") => {
                let id = self.id(xml);
                if let Some(mut set) = self.type_set(xml) {
                    set.id = id;
                    program.type_sets.push(set);
                }
            }
            (Belongs::Jsidl, "declared_const_set") => {
                let id = self.id(xml);
                if let Some(mut set) = self.const_set(xml) {
                    set.id = id;
                    program.const_sets.push(set);
                }
            }
            _ => self.stranger(xml, strictness),
        }
    }

    fn stranger(&mut self, xml: Xml<'_, '_>, strictness: Strictness) {
        let at = self.span(xml);
        let name = xml.tag_name().name();
        let foreign = belongs(xml) == Belongs::Foreign;
        if foreign && ROOTS.contains(&name) {
            let message = format!(
                "`{name}` is not in the namespace of JSIDL: add `xmlns=\"urn:jaus:jsidl:1.1\"`"
            );
            self.report.error(at, message);
        } else if foreign && strictness == Strictness::Found {
            let message = format!("ignored: `{name}` is not the root element of a JSIDL file");
            self.report.warning(at, message);
        } else {
            let roots = ROOTS.join("`, `");
            let message = format!(
                "`{name}` is not the root element of a JSIDL file: expected one of `{roots}`"
            );
            self.report.error(at, message);
        }
    }

    fn service(&mut self, xml: Xml<'_, '_>, program: &mut Program) -> ServiceDef {
        let before = self.report.errors();
        let children = self.enter(xml);
        let name = self.name(xml);
        let id = self.id(xml);
        let references = children.find("references");
        let (inherits_from, client_of) =
            references.map_or_else(Default::default, |it| self.references(it));
        let sound = self.report.errors() == before;
        let types = self.inner_types(xml, &children, program);
        let messages = children.find("message_set");
        let [inputs, outputs] = messages.map_or_else(Default::default, |it| self.message_set(it));
        let events = children.find("internal_events_set");
        let events = events.map(|events| self.declarations(events));
        let behaviour = children.find("protocol_behavior");
        let behaviour = behaviour.map(|behaviour| self.behaviour(behaviour));
        let description = children.find("description");
        ServiceDef {
            span: self.span(xml),
            id: id.unwrap_or_else(stand_in),
            name: name.unwrap_or_default(),
            description: description
                .map(|it| self.description(it))
                .unwrap_or_default(),
            inherits_from,
            client_of,
            types,
            inputs,
            outputs,
            events: events.unwrap_or_default(),
            behaviour: behaviour.unwrap_or_default(),
            sound,
        }
    }

    /// Reads the sets inside a service; the type set uses the constants directly.
    fn inner_types(
        &mut self,
        xml: Xml<'_, '_>,
        children: &Children<'_, '_>,
        program: &mut Program,
    ) -> usize {
        let types = children.find("declared_type_set");
        let read = types.and_then(|xml| self.type_set(xml));
        let mut set = read.unwrap_or_else(|| TypeSet::empty(self.span(xml)));
        let constants = children.find("declared_const_set");
        if let Some(constants) = constants.and_then(|xml| self.const_set(xml)) {
            set.constants = Some(program.const_sets.len());
            program.const_sets.push(constants);
        }
        program.type_sets.push(set);
        program.type_sets.len() - 1
    }

    fn message_set(&mut self, xml: Xml<'_, '_>) -> [Vec<Declaration>; 2] {
        let children = self.enter(xml);
        ["input_set", "output_set"].map(|set| {
            let set = children.find(set);
            set.map_or_else(Vec::new, |set| self.declarations(set))
        })
    }

    fn declarations(&mut self, xml: Xml<'_, '_>) -> Vec<Declaration> {
        let children = self.enter(xml).into_iter();
        children
            .filter_map(|child| self.declaration(child))
            .collect()
    }

    fn references(&mut self, xml: Xml<'_, '_>) -> (Option<ServiceRef>, Vec<ServiceRef>) {
        let children = self.enter(xml);
        let base = children.find("inherits_from");
        let base = base.and_then(|base| self.service_ref(base));
        let clients = children.named("client_of");
        (
            base,
            clients.filter_map(|it| self.service_ref(it)).collect(),
        )
    }

    fn service_ref(&mut self, xml: Xml<'_, '_>) -> Option<ServiceRef> {
        self.enter(xml);
        let name = self.name(xml);
        let (urn, version) = self.id_pattern(xml)?;
        Some(ServiceRef {
            span: self.span(xml),
            name: name?,
            urn,
            version,
        })
    }

    fn set_ref(&mut self, xml: Xml<'_, '_>) -> Option<SetRef> {
        self.enter(xml);
        let name = self.name(xml);
        let id = self.id(xml);
        Some(SetRef {
            span: self.span(xml),
            name: name?,
            id: id?,
        })
    }

    /// Adds a reference to another set, under a unique alias.
    fn another(&mut self, xml: Xml<'_, '_>, references: &mut Vec<SetRef>) {
        let at = self.span(xml);
        if references.len() >= MOST_REFERENCES {
            let message = format!("a set may refer to {MOST_REFERENCES} other sets: split it");
            self.report.error(at, message);
            return;
        }
        let Some(reference) = self.set_ref(xml) else {
            return;
        };
        if let Some(first) = references.iter().find(|r| r.name == reference.name) {
            let message = format!(
                "there are two sets with the alias `{}`: rename one",
                first.name
            );
            self.report
                .error(at, message)
                .note(first.span, "the other one");
        } else {
            references.push(reference);
        }
    }

    fn type_set(&mut self, xml: Xml<'_, '_>) -> Option<TypeSet> {
        let children = self.enter(xml);
        let name = self.name(xml);
        let mut set = TypeSet::empty(self.span(xml));
        for child in children {
            match child.tag_name().name() {
                "declared_type_set_ref" => self.another(child, &mut set.type_sets),
                "declared_const_set_ref" => self.another(child, &mut set.const_sets),
                _ => set.declarations.extend(self.declaration(child)),
            }
        }
        name.map(|_| set)
    }

    fn const_set(&mut self, xml: Xml<'_, '_>) -> Option<ConstSet> {
        let children = self.enter(xml);
        let name = self.name(xml);
        let mut const_sets = Vec::new();
        let mut definitions = Vec::new();
        for child in children {
            if child.tag_name().name() == "const_def" {
                definitions.extend(self.const_def(child));
            } else {
                self.another(child, &mut const_sets);
            }
        }
        Some(ConstSet {
            span: self.span(xml),
            name: name?,
            id: None,
            const_sets,
            definitions,
        })
    }

    fn const_def(&mut self, xml: Xml<'_, '_>) -> Option<ConstDef> {
        self.enter(xml);
        let name = self.name(xml);
        let kind = self.required(xml, "const_type")?;
        let span = self.span_of(xml, "const_value");
        let value = if kind.value == "string" {
            // A text may be empty.
            Some(Constant::Text)
        } else {
            let number = self.word(&kind, "const_type", &NUMBERS);
            let value = self.expression(xml, "const_value");
            number
                .zip(value)
                .map(|(number, value)| Constant::Number(number, value))
        };
        Some(ConstDef {
            span,
            name: name?,
            units: self.attribute(xml, "field_units"),
            value: value?,
        })
    }
}

/// Placeholder of an unreadable identity.
fn stand_in() -> Id {
    Id {
        urn: "(unreadable)".into(),
        version: Version { major: 0, minor: 0 },
    }
}
