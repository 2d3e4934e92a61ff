//! Reads messages, events and their sections, in message sets and in type sets.

use roxmltree::Node as Xml;

use super::element::{Children, EXTENSION, Faulty, Reader, fold};
use super::{Construct, Content, Declaration, DeclarationKind, EventDef, MessageDef, Section};
use crate::grammar;
use crate::permission::Permission;
use crate::source::Spanned;

impl Reader<'_> {
    /// Reads one element of a type set, a message set or an event set. `None` if it is a field or
    /// composite without a kind, which is reported.
    pub(super) fn declaration(&mut self, xml: Xml<'_, '_>) -> Option<Declaration> {
        let (construct, declared) = Construct::of(xml.tag_name().name())?;
        if construct.is_field() || construct.is_composite() {
            let node = self.node(xml)?;
            return Some(Declaration {
                span: node.span,
                name: node.name.clone(),
                sound: node.sound,
                kind: DeclarationKind::Node(node),
            });
        }
        let before = self.report.errors();
        let name = self.name(xml);
        let kind = if declared {
            self.reference(xml, construct)
                .map(DeclarationKind::Reference)
        } else {
            match construct {
                Construct::MessageDef => self.message(xml).map(DeclarationKind::Message),
                Construct::EventDef => self.event(xml).map(DeclarationKind::Event),
                Construct::ValueSet => self.value_set(xml).map(DeclarationKind::Values),
                _ => {
                    let content = self.content(xml);
                    let section = Section {
                        span: self.span(xml),
                        name: name.clone().unwrap_or_default(),
                        content,
                    };
                    Some(DeclarationKind::Section(construct, section))
                }
            }
        };
        Some(Declaration {
            span: self.span(xml),
            name: name.unwrap_or_default(),
            kind: kind.unwrap_or(DeclarationKind::Faulty),
            sound: self.report.errors() == before,
        })
    }

    fn message(&mut self, xml: Xml<'_, '_>) -> Option<MessageDef> {
        let children = self.enter(xml);
        let code = self
            .required(xml, "message_id")
            .and_then(|text| self.code(&text));
        // Optional since edition 1.1.
        let is_command = self.flag(xml, "is_command");
        let is_deprecated = self.flag(xml, "deprecated");
        let permission = self.permission(xml);
        let stops = self.flag(xml, (EXTENSION, "stops"));
        let description = children.find("description");
        let [header, body, footer] = self.sections(&children);
        Some(MessageDef {
            code: code?,
            is_command: is_command.ok()?.unwrap_or(false),
            is_deprecated: is_deprecated.ok()?.unwrap_or(false),
            permission: permission.ok()?,
            stops: stops.ok()?.unwrap_or(false),
            destination: self.attribute(xml, (EXTENSION, "destination")),
            description: description
                .map(|it| self.description(it))
                .unwrap_or_default(),
            header: header?,
            body: body?,
            footer: footer?,
        })
    }

    /// Reads the attributes `permission`, `authority` and `granted` of our own namespace.
    fn permission(&mut self, xml: Xml<'_, '_>) -> Result<Option<Permission>, Faulty> {
        let [word, mut authority, mut granted] =
            ["permission", "authority", "granted"].map(|it| self.attribute(xml, (EXTENSION, it)));
        let words = Permission::WORDS;
        let known = words.each_ref().map(|(word, it)| (*word, it));
        let permission = match &word {
            Some(word) => Some(self.word(word, "permission", &known).ok_or(Faulty)?.clone()),
            None => None,
        };
        let permission = match permission {
            Some(Permission::Control { .. }) => Some(Permission::Control {
                authority: authority.take().map(|it| it.value),
            }),
            Some(Permission::Answer { .. }) => {
                let Some(field) = granted.take() else {
                    let message = "an answer lacks the attribute `granted`: name the field that is 0 if \
                                   control is granted";
                    self.report.error(self.span(xml), message);
                    return Err(Faulty);
                };
                Some(Permission::Answer {
                    granted: field.value,
                })
            }
            other => other,
        };
        if let Some(field) = authority.or(granted) {
            let message = "`authority` belongs to `permission=\"control\"`, and `granted` to \
                           `permission=\"answer\"`: remove it";
            self.report.error(field.span, message);
            return Err(Faulty);
        }
        Ok(permission)
    }

    fn code(&mut self, text: &Spanned<String>) -> Option<u16> {
        let digits = &text.value;
        let sound = digits.len() == 4 && digits.chars().all(|c| c.is_ascii_hexdigit());
        let code = u16::from_str_radix(digits, 16).ok().filter(|_| sound);
        if code.is_none() {
            self.report.error(
                text.span,
                format!(
                    "`{digits}` cannot be a message id: write two octets as four hexadecimal \
                     digits, for example `2B00`"
                ),
            );
        }
        code
    }

    fn event(&mut self, xml: Xml<'_, '_>) -> Option<EventDef> {
        let children = self.enter(xml);
        let [header, body, footer] = self.sections(&children);
        Some(EventDef {
            sections: [header?, body?, footer?],
        })
    }

    /// Reads header, body and footer, each `None` if it is missing.
    fn sections(&mut self, children: &Children<'_, '_>) -> [Option<Section>; 3] {
        [Construct::Header, Construct::Body, Construct::Footer].map(|construct| {
            let declared = format!("declared_{}", construct.element());
            let found = children.find(construct.element());
            let found = found.or_else(|| children.find(&declared))?;
            Some(self.section(found))
        })
    }

    fn section(&mut self, xml: Xml<'_, '_>) -> Section {
        let name = self.name(xml);
        let content = match Construct::of(xml.tag_name().name()) {
            Some((construct, true)) => self
                .reference(xml, construct)
                .map_or(Content::Faulty, Content::Reference),
            _ => self.content(xml),
        };
        Section {
            span: self.span(xml),
            content: match name {
                Some(_) => content,
                None => Content::Faulty,
            },
            name: name.unwrap_or_default(),
        }
    }

    fn content(&mut self, xml: Xml<'_, '_>) -> Content {
        let before = self.report.errors();
        let child = self.enter(xml).into_iter().next();
        let node = child.map(|child| self.node(child));
        match node {
            Some(Some(node)) => Content::Node(Box::new(node)),
            None if self.report.errors() == before => Content::Empty,
            _ => Content::Faulty,
        }
    }

    /// The text of a `description`, white space folded.
    pub(super) fn description(&mut self, xml: Xml<'_, '_>) -> String {
        if let Some(element) = grammar::element(xml.tag_name().name()) {
            self.known_attributes(xml, element);
        }
        let texts = xml.descendants().filter(|node| node.is_text());
        let whole: String = texts.filter_map(|node| node.text()).collect();
        fold(&whole)
    }
}
