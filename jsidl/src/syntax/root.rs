//! Reads whole files: services, type sets and constant sets.

use roxmltree::{Document, Node as Xml, ParsingOptions};

use super::element::{Belongs, Reader, belongs};
use super::limits;
use super::message::DeclarationPlace;
use super::{ConstDef, ConstSet, Construct, Declaration, Program, ServiceDef, SetRef, TypeSet};
use crate::diagnostic::Report;
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
    let text = source.text();
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
        .text()
        .split_inclusive('\n')
        .take(pos.row as usize - usize::from(pos.row > 0));
    let line: usize = before.map(str::len).sum();
    let rest = source.text().get(line..).unwrap_or("");
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

const TYPE_SET: DeclarationPlace = DeclarationPlace {
    parent: "declared_type_set",
    admits: |_| true,
    allowed: "declarations of messages, sections, composites and fields",
};

const INPUT_SET: DeclarationPlace = DeclarationPlace {
    parent: "input_set",
    admits: |construct| matches!(construct, Construct::MessageDef),
    allowed: "messages",
};

const OUTPUT_SET: DeclarationPlace = DeclarationPlace {
    parent: "output_set",
    ..INPUT_SET
};

const EVENT_SET: DeclarationPlace = DeclarationPlace {
    parent: "internal_events_set",
    admits: |construct| matches!(construct, Construct::EventDef),
    allowed: "events",
};

impl Reader<'_> {
    fn root(&mut self, xml: Xml<'_, '_>, strictness: Strictness, program: &mut Program) {
        let name = xml.tag_name().name();
        match (belongs(xml), name) {
            (Belongs::Jsidl | Belongs::Plus, "service_set") => {
                for child in self.children(xml) {
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
        self.only(
            xml,
            &["name", "id", "version", "deprecated", "interpretation"],
        );
        let before = self.report.errors();
        let name = self.name(xml);
        let id = self.id(xml);
        let parts = self.service_parts(xml);
        let (inherits_from, client_of) = match parts.references {
            Some(references) => self.references(references),
            None => (None, Vec::new()),
        };
        let sound = self.report.errors() == before;
        let types = self.inner_types(xml, &parts, program);
        let [inputs, outputs] = self.message_set(xml, parts.messages);
        let events = parts.events.map(|events| {
            self.only(events, &[]);
            self.declarations(events, &EVENT_SET)
        });
        let behaviour = parts.behaviour.map(|behaviour| self.behaviour(behaviour));
        ServiceDef {
            span: self.span(xml),
            id: id.unwrap_or_else(stand_in),
            name: name.unwrap_or_default(),
            description: parts.description,
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

    fn service_parts<'a, 'x>(&mut self, xml: Xml<'a, 'x>) -> ServiceParts<'a, 'x> {
        let mut parts = ServiceParts::default();
        for child in self.children(xml) {
            match child.tag_name().name() {
                "description" => parts.description = self.description(child),
                "references" => self.once(&mut parts.references, child, xml),
                "declared_type_set" => self.once(&mut parts.types, child, xml),
                "declared_const_set" => self.once(&mut parts.constants, child, xml),
                "message_set" => self.once(&mut parts.messages, child, xml),
                "internal_events_set" => self.once(&mut parts.events, child, xml),
                // Free text.
                "assumptions" => {}
                "protocol_behavior" => self.once(&mut parts.behaviour, child, xml),
                _ => self.misplaced(
                    child,
                    "service_def",
                    "`description`, `assumptions`, `references`, `declared_const_set`, \
                     `declared_type_set`, `message_set`, `internal_events_set` and \
                     `protocol_behavior`",
                ),
            }
        }
        parts
    }

    /// Reads the sets inside a service; the type set uses the constants directly.
    fn inner_types(
        &mut self,
        xml: Xml<'_, '_>,
        parts: &ServiceParts<'_, '_>,
        program: &mut Program,
    ) -> usize {
        let read = parts.types.and_then(|xml| self.type_set(xml));
        let mut set = read.unwrap_or_else(|| TypeSet::empty(self.span(xml)));
        if let Some(constants) = parts.constants.and_then(|xml| self.const_set(xml)) {
            set.constants = Some(program.const_sets.len());
            program.const_sets.push(constants);
        }
        program.type_sets.push(set);
        program.type_sets.len() - 1
    }

    fn message_set(
        &mut self,
        service: Xml<'_, '_>,
        messages: Option<Xml<'_, '_>>,
    ) -> [Vec<Declaration>; 2] {
        let Some(xml) = messages else {
            self.lacks(service, "message_set");
            return Default::default();
        };
        self.only(xml, &[]);
        let (mut inputs, mut outputs) = (None, None);
        for child in self.children(xml) {
            match child.tag_name().name() {
                "input_set" => self.once(&mut inputs, child, xml),
                "output_set" => self.once(&mut outputs, child, xml),
                _ => self.misplaced(child, "message_set", "an `input_set` and an `output_set`"),
            }
        }
        [(inputs, INPUT_SET), (outputs, OUTPUT_SET)].map(|(set, place)| match set {
            Some(set) => {
                self.only(set, &[]);
                self.declarations(set, &place)
            }
            None => {
                self.lacks(xml, place.parent);
                Vec::new()
            }
        })
    }

    fn declarations(&mut self, xml: Xml<'_, '_>, place: &DeclarationPlace) -> Vec<Declaration> {
        self.children(xml)
            .into_iter()
            .filter_map(|child| self.declaration(child, place))
            .collect()
    }

    fn references(&mut self, xml: Xml<'_, '_>) -> (Option<SetRef>, Vec<SetRef>) {
        self.only(xml, &[]);
        let mut base = None;
        let mut clients = Vec::new();
        for child in self.children(xml) {
            match child.tag_name().name() {
                "inherits_from" => self.once(&mut base, child, xml),
                "client_of" => clients.extend(self.set_ref(child)),
                _ => self.misplaced(child, "references", "`inherits_from` and `client_of`"),
            }
        }
        (base.and_then(|base| self.set_ref(base)), clients)
    }

    fn set_ref(&mut self, xml: Xml<'_, '_>) -> Option<SetRef> {
        self.only(xml, &["name", "id", "version", "interpretation"]);
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
        self.only(xml, &["name", "id", "version", "interpretation"]);
        let name = self.name(xml);
        let mut set = TypeSet::empty(self.span(xml));
        for child in self.children(xml) {
            match child.tag_name().name() {
                "declared_type_set_ref" => self.another(child, &mut set.type_sets),
                "declared_const_set_ref" => self.another(child, &mut set.const_sets),
                _ => set.declarations.extend(self.declaration(child, &TYPE_SET)),
            }
        }
        name.map(|_| set)
    }

    fn const_set(&mut self, xml: Xml<'_, '_>) -> Option<ConstSet> {
        self.only(xml, &["name", "id", "version", "interpretation"]);
        let name = self.name(xml);
        let mut const_sets = Vec::new();
        let mut definitions = Vec::new();
        for child in self.children(xml) {
            match child.tag_name().name() {
                "declared_const_set_ref" => self.another(child, &mut const_sets),
                "const_def" => definitions.extend(self.const_def(child)),
                _ => self.misplaced(child, "declared_const_set", "`const_def`s"),
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
        self.only(
            xml,
            &[
                "name",
                "const_type",
                "const_value",
                "field_units",
                "interpretation",
            ],
        );
        let name = self.name(xml);
        let number = self.number(xml, "const_type");
        let value = self.expression(xml, "const_value");
        Some(ConstDef {
            name: name?,
            number: number?,
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

/// The children of a `service_def`, before they are read.
#[derive(Default)]
struct ServiceParts<'a, 'x> {
    description: String,
    references: Option<Xml<'a, 'x>>,
    types: Option<Xml<'a, 'x>>,
    constants: Option<Xml<'a, 'x>>,
    messages: Option<Xml<'a, 'x>>,
    events: Option<Xml<'a, 'x>>,
    behaviour: Option<Xml<'a, 'x>>,
}
