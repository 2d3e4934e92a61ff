//! Reads messages, events and their sections, in message sets and in type sets.

use roxmltree::Node as Xml;

use super::composite::Place;
use super::element::{FLAGS, Reader, fold};
use super::{Construct, Content, Declaration, DeclarationKind, EventDef, MessageDef, Section};
use crate::source::Spanned;

impl Reader<'_> {
    /// Reads one element of a type set, a message set or an event set. `None` if it cannot be
    /// declared there, which is reported.
    pub(super) fn declaration(
        &mut self,
        xml: Xml<'_, '_>,
        place: &DeclarationPlace,
    ) -> Option<Declaration> {
        let element = xml.tag_name().name();
        let found = Construct::of(element).filter(|(construct, _)| (place.admits)(*construct));
        let Some((construct, declared)) = found else {
            self.misplaced(xml, place.parent, place.allowed);
            return None;
        };
        if construct.is_field() || construct.is_composite() {
            let node = self.node(xml, Place::TypeSet)?;
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
            self.reference(xml, construct, &["name", "deprecated", "interpretation"])
                .map(DeclarationKind::Reference)
        } else {
            match construct {
                Construct::MessageDef => self.message(xml).map(DeclarationKind::Message),
                Construct::EventDef => self.event(xml).map(DeclarationKind::Event),
                _ => {
                    let content = self.content(xml);
                    let span = self.span(xml);
                    Some(DeclarationKind::Section(
                        construct,
                        Section { span, content },
                    ))
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
        self.only(
            xml,
            &[
                "name",
                "message_id",
                "is_command",
                "deprecated",
                "interpretation",
            ],
        );
        let code = self
            .required(xml, "message_id")
            .and_then(|text| self.code(&text));
        let is_command = self
            .required(xml, "is_command")
            .and_then(|text| self.word(&text, "is_command", &FLAGS));
        let is_deprecated = self.flag(xml, "deprecated");
        let mut description = None;
        let [header, body, footer] = self.sections(xml, &mut description);
        Some(MessageDef {
            code: code?,
            is_command: is_command?,
            is_deprecated: is_deprecated.ok()?.unwrap_or(false),
            description: description.unwrap_or_default(),
            header: header?,
            body: body?,
            footer: footer?,
        })
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
        self.only(xml, &["name", "deprecated", "interpretation"]);
        let [header, body, footer] = self.sections(xml, &mut None);
        Some(EventDef {
            sections: [header?, body?, footer?],
        })
    }

    /// Reads header, body and footer, each `None` if it is missing (which is reported).
    fn sections(
        &mut self,
        xml: Xml<'_, '_>,
        description: &mut Option<String>,
    ) -> [Option<Section>; 3] {
        const SECTIONS: [Construct; 3] = [Construct::Header, Construct::Body, Construct::Footer];
        let parent = xml.tag_name().name().to_owned();
        let mut found = [None, None, None];
        for child in self.children(xml) {
            let element = child.tag_name().name();
            if element == "description" {
                *description = Some(self.description(child));
                continue;
            }
            let construct = Construct::of(element);
            let slot = construct.and_then(|(c, _)| SECTIONS.iter().position(|s| *s == c));
            match slot {
                Some(slot) => self.once(&mut found[slot], child, xml),
                None => self.misplaced(
                    child,
                    &parent,
                    "a `description`, a `header`, a `body` and a `footer`",
                ),
            }
        }
        std::array::from_fn(|slot| match found[slot] {
            Some(child) => Some(self.section(child)),
            None => {
                self.lacks(xml, SECTIONS[slot].element());
                None
            }
        })
    }

    fn section(&mut self, xml: Xml<'_, '_>) -> Section {
        let name = self.name(xml);
        let content = match Construct::of(xml.tag_name().name()) {
            Some((construct, true)) => self
                .reference(xml, construct, &["name", "interpretation"])
                .map_or(Content::Faulty, Content::Reference),
            _ => self.content(xml),
        };
        Section {
            span: self.span(xml),
            content: if name.is_some() {
                content
            } else {
                Content::Faulty
            },
        }
    }

    fn content(&mut self, xml: Xml<'_, '_>) -> Content {
        self.only(xml, &["name", "interpretation"]);
        let children = self.children(xml);
        match children.as_slice() {
            [] => Content::Empty,
            [child] => self
                .node(*child, Place::Composite)
                .map_or(Content::Faulty, |node| Content::Node(Box::new(node))),
            [_, second, ..] => {
                let section = xml.tag_name().name();
                let at = self.span(*second);
                self.report.error(
                    at,
                    format!("`{section}` holds one composite: put all of them into a `sequence`"),
                );
                for child in children {
                    self.node(child, Place::Composite);
                }
                Content::Faulty
            }
        }
    }

    /// The text of a `description`, white space folded.
    pub(super) fn description(&mut self, xml: Xml<'_, '_>) -> String {
        self.only(xml, &[]);
        let texts = xml.descendants().filter(|node| node.is_text());
        let whole: String = texts.filter_map(|node| node.text()).collect();
        fold(&whole)
    }
}

/// The permitted declarations of a set.
pub(super) struct DeclarationPlace {
    pub(super) parent: &'static str,
    pub(super) admits: fn(Construct) -> bool,
    pub(super) allowed: &'static str,
}
