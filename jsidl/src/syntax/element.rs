//! Cursor over XML elements with the rules of JSIDL: two namespaces for the same elements, runs of
//! white space in attributes, and reports of all mistakes at once.

use std::sync::Arc;

use roxmltree::{ExpandedName, Node as Xml};

use super::{Expr, VersionPattern};
use crate::diagnostic::Report;
use crate::expr::Expression;
use crate::grammar::{self, Edition, Element, Occurs, Part};
use crate::model::{Id, Location, Number, Signed, Unsigned};
use crate::source::{Source, Span, Spanned};
use crate::spelling::shortened;

/// JSIDL+: wraps several services into one file and adds data of a diagram editor.
const PLUS: &str = "urn:jaus:jsidl:plus";

/// Namespace of our attributes beyond JSIDL.
pub(crate) const EXTENSION: &str = "urn:jaus-rs:jsidl";

/// Maximum length of names and URNs: findings repeat them.
const LONGEST_NAME: usize = 200;

/// Replaces runs of white space by single blanks and trims.
pub(super) fn fold(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Reads the elements of one text.
pub(super) struct Reader<'r> {
    pub(super) source: &'r Source,
    pub(super) report: &'r mut Report,
}

/// The children of an element, as far as the grammar permits them.
pub(super) struct Children<'a, 'x>(Vec<Xml<'a, 'x>>);

impl<'a, 'x> Children<'a, 'x> {
    /// The first child with this name.
    pub(super) fn find(&self, name: &str) -> Option<Xml<'a, 'x>> {
        self.named(name).next()
    }

    pub(super) fn all(&self) -> impl Iterator<Item = Xml<'a, 'x>> + '_ {
        self.0.iter().copied()
    }

    /// The children with this name.
    pub(super) fn named<'n>(&'n self, name: &'n str) -> impl Iterator<Item = Xml<'a, 'x>> + 'n {
        let all = self.0.iter().copied();
        all.filter(move |child| child.tag_name().name() == name)
    }
}

impl<'a, 'x> IntoIterator for Children<'a, 'x> {
    type Item = Xml<'a, 'x>;
    type IntoIter = std::vec::IntoIter<Xml<'a, 'x>>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

/// Namespace of an element.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Belongs {
    Jsidl,
    Plus,
    Foreign,
}

pub(super) fn belongs(xml: Xml<'_, '_>) -> Belongs {
    match xml.tag_name().namespace() {
        Some(uri) if Edition::of_namespace(uri).is_some() => Belongs::Jsidl,
        Some(PLUS) => Belongs::Plus,
        _ => Belongs::Foreign,
    }
}

impl Reader<'_> {
    /// The position of an element.
    pub(super) fn span(&self, xml: Xml<'_, '_>) -> Span {
        self.source.span(xml.range().start)
    }

    /// As [`span`](Self::span), for the model.
    pub(super) fn location(&self, xml: Xml<'_, '_>) -> Location {
        self.source.location(self.span(xml))
    }

    /// Checks the attributes and children of an element against the grammar, and returns the
    /// permitted children.
    pub(super) fn enter<'a, 'x>(&mut self, xml: Xml<'a, 'x>) -> Children<'a, 'x> {
        let mut children = self.elements(xml);
        let Some(element) = grammar::element(xml.tag_name().name()) else {
            return Children(children);
        };
        self.known_attributes(xml, element);
        let mut taken = vec![None; element.parts.len()];
        children.retain(|&child| {
            let name = child.tag_name().name();
            let Some((position, part)) = element.part(name) else {
                self.misplaced(child, element);
                return false;
            };
            let first = taken[position].replace(name);
            let single = matches!(part.occurs(Edition::V1_1), Occurs::Once | Occurs::Optional);
            match first.filter(|_| single) {
                Some(first) => self.surplus(child, element, part, first),
                None => return true,
            }
            false
        });
        for (part, taken) in element.parts.iter().zip(taken) {
            let needed = part.occurs(Edition::V1_1).is_mandatory() && !part.dispensable;
            if needed && taken.is_none() {
                self.missing(xml, part);
            }
        }
        Children(children)
    }

    /// The child elements. Drawing data of JSIDL+ is skipped; other foreign elements and text are
    /// reported.
    fn elements<'a, 'x>(&mut self, xml: Xml<'a, 'x>) -> Vec<Xml<'a, 'x>> {
        let parent = xml.tag_name().name();
        let mut elements = Vec::new();
        for child in xml.children() {
            let at = self.span(child);
            if child.is_element() {
                match belongs(child) {
                    Belongs::Jsidl => elements.push(child),
                    Belongs::Plus if child.tag_name().name() == "service_set" => {
                        elements.push(child);
                    }
                    Belongs::Plus => {}
                    Belongs::Foreign => {
                        let name = child.tag_name().name();
                        let [old, new] = [Edition::V1_0, Edition::V1_1].map(Edition::namespace);
                        self.report.error(at, format!(
                            "`{name}` is not an element of JSIDL: its namespace must be `{old}` or \
                             `{new}`",
                        ));
                    }
                }
            } else if child.is_text() && child.text().is_some_and(|t| !t.trim().is_empty()) {
                self.report.error(
                    at,
                    format!(
                        "text has no meaning inside `{parent}`: remove it, or make it a comment"
                    ),
                );
            }
        }
        elements
    }

    /// Reports unknown attributes.
    pub(super) fn known_attributes(&mut self, xml: Xml<'_, '_>, element: &Element) {
        for attribute in xml.attributes() {
            let name = attribute.name();
            if attribute.namespace().is_some() || element.attribute(name).is_some() {
                continue;
            }
            let known: Vec<_> = element.attributes.iter().map(|it| it.name).collect();
            let advice = if known.is_empty() {
                "remove it".to_owned()
            } else {
                format!("it has `{}`", known.join("`, `"))
            };
            let at = self.source.span(attribute.range().start);
            let message = format!("`{}` has no attribute `{name}`: {advice}", element.name);
            self.report.error(at, message);
        }
    }

    fn misplaced(&mut self, child: Xml<'_, '_>, parent: &Element) {
        let name = child.tag_name().name();
        let at = self.span(child);
        let message = format!(
            "`{name}` is not allowed in `{}`, which holds {}",
            parent.name, parent.holds
        );
        self.report.error(at, message);
    }

    /// Reports a child after the `first` one of a part that occurs once.
    fn surplus(&mut self, child: Xml<'_, '_>, parent: &Element, part: &Part, first: &str) {
        let name = child.tag_name().name();
        let at = self.span(child);
        let message = match part.surplus {
            Some(finding) => format!("`{}` {finding}", parent.name),
            None if first == name => {
                format!("`{}` has more than one `{name}`: keep one", parent.name)
            }
            None => format!("`{}` has `{first}` and `{name}`: keep one", parent.name),
        };
        self.report.error(at, message);
    }

    fn missing(&mut self, parent: Xml<'_, '_>, part: &Part) {
        let name = parent.tag_name().name();
        let at = self.span(parent);
        let child = part.elements(Edition::V1_1).next().unwrap_or_default();
        let message = match part.missing {
            Some(finding) => format!("`{name}` {finding}"),
            None => format!("`{name}` lacks the element `{child}`: add it"),
        };
        self.report.error(at, message);
    }

    /// An attribute's text, white space folded.
    pub(super) fn attribute<'n, 'm>(
        &self,
        xml: Xml<'_, '_>,
        name: impl Into<ExpandedName<'n, 'm>>,
    ) -> Option<Spanned<String>> {
        let attribute = xml.attribute_node(name)?;
        Some(Spanned {
            value: fold(attribute.value()),
            span: self.source.span(attribute.range_value().start),
        })
    }

    /// A mandatory, nonempty attribute.
    pub(super) fn required(&mut self, xml: Xml<'_, '_>, name: &str) -> Option<Spanned<String>> {
        let found = self.attribute(xml, name);
        let element = xml.tag_name().name();
        match found {
            Some(found) if !found.value.is_empty() => Some(found),
            Some(found) => {
                self.report.error(
                    found.span,
                    format!("the attribute `{name}` of `{element}` is empty: give it a value"),
                );
                None
            }
            None => {
                let at = self.span(xml);
                self.report.error(
                    at,
                    format!("`{element}` lacks the attribute `{name}`: add it"),
                );
                None
            }
        }
    }

    /// The text of an optional attribute, empty if there is none.
    pub(super) fn text(&self, xml: Xml<'_, '_>, name: &str) -> String {
        self.attribute(xml, name)
            .map(|a| a.value)
            .unwrap_or_default()
    }

    /// The attribute `name`, an identifier.
    pub(super) fn name(&mut self, xml: Xml<'_, '_>) -> Option<String> {
        let name = self.required(xml, "name")?;
        self.identifier(name)
    }

    /// Checks that a text is an identifier.
    pub(super) fn identifier(&mut self, name: Spanned<String>) -> Option<String> {
        let text = &name.value;
        let advice = if text.len() > LONGEST_NAME {
            format!("use at most {LONGEST_NAME} characters")
        } else if !begins_like_a_name(text)
            || !text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        {
            "use letters, digits and underscores, not starting with a digit".to_owned()
        } else {
            return Some(name.value);
        };
        let message = format!("`{}` cannot be a name: {advice}", shortened(text));
        self.report.error(name.span, message);
        None
    }

    /// Looks an attribute's text up among the permitted words.
    pub(super) fn word<T: Copy>(
        &mut self,
        attribute: &Spanned<String>,
        what: &str,
        words: &[(&str, T)],
    ) -> Option<T> {
        let found = words.iter().find(|(word, _)| *word == attribute.value);
        if found.is_none() {
            let words: Vec<_> = words.iter().map(|(word, _)| *word).collect();
            self.report.error(
                attribute.span,
                format!(
                    "`{}` is not a value of `{what}`: use `{}`",
                    attribute.value,
                    words.join("`, `")
                ),
            );
        }
        found.map(|(_, value)| *value)
    }

    /// A Boolean attribute. `Ok(None)` if it is absent.
    pub(super) fn flag<'n, 'm>(
        &mut self,
        xml: Xml<'_, '_>,
        name: impl Into<ExpandedName<'n, 'm>>,
    ) -> Result<Option<bool>, Faulty> {
        let name = name.into();
        match self.attribute(xml, name) {
            None => Ok(None),
            Some(text) => self
                .word(&text, name.name(), &FLAGS)
                .map(Some)
                .ok_or(Faulty),
        }
    }

    /// The type in `field_type_unsigned`.
    pub(super) fn unsigned(&mut self, xml: Xml<'_, '_>) -> Option<Unsigned> {
        let text = self.required(xml, "field_type_unsigned")?;
        self.word(&text, "field_type_unsigned", &UNSIGNED)
    }

    /// A type in `field_type` or `const_type`.
    pub(super) fn number(&mut self, xml: Xml<'_, '_>, attribute: &str) -> Option<Number> {
        let text = self.required(xml, attribute)?;
        self.word(&text, attribute, &NUMBERS)
    }

    /// A required attribute that holds a constant expression.
    pub(super) fn expression(&mut self, xml: Xml<'_, '_>, name: &str) -> Option<Expr> {
        let text = self.required(xml, name)?;
        self.parse(&text, name)
    }

    /// As [`expression`](Self::expression), for an attribute that may be absent.
    pub(super) fn optional_expression(
        &mut self,
        xml: Xml<'_, '_>,
        name: &str,
    ) -> Result<Option<Expr>, Faulty> {
        match self.attribute(xml, name) {
            None => Ok(None),
            Some(text) => self.parse(&text, name).map(Some).ok_or(Faulty),
        }
    }

    fn parse(&mut self, text: &Spanned<String>, name: &str) -> Option<Expr> {
        match Expression::parse(&text.value) {
            Ok(value) => Some(Spanned {
                value,
                span: text.span,
            }),
            Err(reason) => {
                self.report.error(
                    text.span,
                    format!("`{name}` must be a number or a constant expression: {reason}"),
                );
                None
            }
        }
    }

    /// The attributes `id` and `version`.
    pub(super) fn id(&mut self, xml: Xml<'_, '_>) -> Option<Id> {
        let urn = self.urn(xml);
        let text = self.required(xml, "version")?;
        let pattern = self.version(&text)?;
        let version = pattern.exact();
        if version.is_none() {
            let message = format!(
                "`{}` cannot be a version: a wildcard does not select a definition: write the version",
                text.value
            );
            self.report.error(text.span, message);
        }
        Some(Id {
            urn: urn?,
            version: version?,
        })
    }

    /// As [`id`](Self::id), for a reference to a service: the version may have wildcards.
    pub(super) fn id_pattern(&mut self, xml: Xml<'_, '_>) -> Option<(Arc<str>, VersionPattern)> {
        let urn = self.urn(xml);
        let text = self.required(xml, "version")?;
        let version = self.version(&text);
        Some((urn?, version?))
    }

    fn urn(&mut self, xml: Xml<'_, '_>) -> Option<Arc<str>> {
        let urn = self.required(xml, "id")?;
        if let Some(raw) = xml.attribute("id")
            && raw.trim() != raw
        {
            self.report.warning(
                urn.span,
                format!("the id `{}` has surrounding spaces: remove them", urn.value),
            );
        }
        self.sound_urn(urn).map(Into::into)
    }

    fn sound_urn(&mut self, urn: Spanned<String>) -> Option<String> {
        let text = &urn.value;
        let sound = text.len() <= LONGEST_NAME
            && begins_like_a_name(text)
            && text
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || "_-:.".contains(c));
        if sound {
            return Some(urn.value);
        }
        let text = shortened(text);
        self.report.error(
            urn.span,
            format!("`{text}` cannot be an id: write a URN such as `urn:jaus:jss:core:Discovery`"),
        );
        None
    }

    fn version(&mut self, text: &Spanned<String>) -> Option<VersionPattern> {
        let part = |part: &str| -> Option<Option<u8>> {
            if part == "*" {
                return Some(None);
            }
            let plain = part == "0" || !part.starts_with(['0', '+']);
            part.parse().ok().filter(|_| plain).map(Some)
        };
        let parsed = text.value.split_once('.').and_then(|(major, minor)| {
            Some(VersionPattern {
                major: part(major)?,
                minor: part(minor)?,
            })
        });
        if parsed.is_none() {
            let message = format!(
                "`{}` cannot be a version: write two numbers from 0 to 255, for example `1.0`",
                text.value
            );
            self.report.error(text.span, message);
        }
        parsed
    }
}

fn begins_like_a_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
}

/// An error that is already reported.
#[derive(Debug, Clone, Copy)]
pub(super) struct Faulty;

/// Words of a Boolean attribute.
pub(super) const FLAGS: [(&str, bool); 4] =
    [("true", true), ("false", false), ("1", true), ("0", false)];

const UNSIGNED: [(&str, Unsigned); 4] = [
    ("unsigned byte", Unsigned::U8),
    ("unsigned short integer", Unsigned::U16),
    ("unsigned integer", Unsigned::U32),
    ("unsigned long integer", Unsigned::U64),
];

pub(super) const NUMBERS: [(&str, Number); 10] = [
    ("byte", Number::Signed(Signed::I8)),
    ("short integer", Number::Signed(Signed::I16)),
    ("integer", Number::Signed(Signed::I32)),
    ("long integer", Number::Signed(Signed::I64)),
    ("unsigned byte", Number::Unsigned(Unsigned::U8)),
    ("unsigned short integer", Number::Unsigned(Unsigned::U16)),
    ("unsigned integer", Number::Unsigned(Unsigned::U32)),
    ("unsigned long integer", Number::Unsigned(Unsigned::U64)),
    ("float", Number::F32),
    ("long float", Number::F64),
];
