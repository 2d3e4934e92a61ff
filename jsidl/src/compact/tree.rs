//! Elements of a definition, whichever form it was written in, and their XML.

use roxmltree::{Document, Node as Xml, ParsingOptions};

use crate::grammar::{self, Edition};
use crate::source::Translation;
use crate::syntax::EXTENSION;

/// Name of a reference in the compact form, which does not say what it refers to.
pub(super) const REFERENCE: &str = "declared_";

/// Prefix of attributes of our own namespace, in both forms.
pub(super) const OWN: &str = "own:";

/// A part of a drawing in the namespace of the language.
const START_ARROW: &str = "pseudo_start_state";

/// Maximum nesting of elements that are read; published definitions need 15.
const DEEPEST: usize = 100;

/// An element with its position in the text that it was read from.
#[derive(Debug, Clone, Default)]
pub(crate) struct Element {
    pub(super) name: &'static str,
    pub(super) at: usize,
    pub(super) attributes: Vec<Attribute>,
    pub(super) children: Vec<Self>,
    pub(super) text: Option<Text>,
    /// Comments before it.
    pub(super) comments: Vec<String>,
    /// Comments after its last child.
    pub(super) trailing: Vec<String>,
}

#[derive(Debug, Clone)]
pub(super) struct Attribute {
    pub(super) name: String,
    pub(super) value: String,
    pub(super) at: usize,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Text {
    pub(super) value: String,
    pub(super) at: usize,
}

impl Element {
    pub(super) fn new(name: &'static str, at: usize) -> Self {
        Self {
            name,
            at,
            ..Self::default()
        }
    }

    /// Adds an attribute or replaces its value.
    pub(super) fn set(&mut self, name: &str, value: impl Into<String>, at: usize) {
        let value = value.into();
        match self.attributes.iter_mut().find(|it| it.name == name) {
            Some(known) => (known.value, known.at) = (value, at),
            None => self.attributes.push(Attribute {
                name: name.to_owned(),
                value,
                at,
            }),
        }
    }

    pub(super) fn with(mut self, name: &str, value: impl Into<String>, at: usize) -> Self {
        self.set(name, value, at);
        self
    }

    pub(super) fn holding(mut self, child: Self) -> Self {
        self.children.push(child);
        self
    }

    pub(super) fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|it| it.name == name)
    }

    /// The value of an attribute; empty if it is absent.
    pub(super) fn value(&self, name: &str) -> &str {
        self.attribute(name).map_or("", |it| &it.value)
    }

    pub(super) fn child(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|it| it.name == name)
    }

    /// Whether it refers to a declaration of a type set.
    pub(super) fn is_reference(&self) -> bool {
        self.name.starts_with(REFERENCE)
            && !self.name.ends_with("_set")
            && !self.name.ends_with("_ref")
    }

    /// The first element with this name in it, from the outside inwards and in order.
    pub(super) fn first(&self, name: &str) -> Option<&Self> {
        let mut children = self.children.iter();
        children.find_map(|it| {
            if it.answers(name) {
                Some(it)
            } else {
                it.first(name)
            }
        })
    }

    /// As [`first`](Self::first), to change it.
    pub(super) fn first_mut(&mut self, name: &str) -> Option<&mut Self> {
        for child in &mut self.children {
            if child.answers(name) {
                return Some(child);
            }
            if let Some(found) = child.first_mut(name) {
                return Some(found);
            }
        }
        None
    }

    /// Whether it has this name, or is a reference that may get it.
    fn answers(&self, name: &str) -> bool {
        self.name == name || self.name == REFERENCE && name.starts_with(REFERENCE)
    }

    /// Sorts the children of all elements as the standard does.
    pub(super) fn in_order(&mut self) {
        if let Some(known) = grammar::element(self.name) {
            let position = |child: &Self| {
                let name = if child.name == REFERENCE {
                    "declared_record"
                } else {
                    child.name
                };
                let field = || known.part("declared_fixed_field");
                let part = known.part(name).or_else(|| {
                    if child.name == REFERENCE {
                        field()
                    } else {
                        None
                    }
                });
                part.map_or(usize::MAX, |(position, _)| position)
            };
            self.children.sort_by_key(position);
        }
        self.children.iter_mut().for_each(Self::in_order);
    }

    /// The elements of an XML text, or the position and the reason why it has none. Elements of
    /// other namespaces are left out, such as the drawing data of JSIDL+.
    pub(super) fn from_xml(text: &str) -> Result<Self, (usize, String)> {
        let options = ParsingOptions {
            allow_dtd: false,
            ..ParsingOptions::default()
        };
        let document = Document::parse_with_options(text, options)
            .map_err(|error| (0, format!("not well-formed XML: {error}")))?;
        let mut root = of_xml(document.root_element(), 0)?;
        let mut before = document.root_element().prev_siblings().skip(1);
        let namespace = document.root_element().tag_name().namespace();
        if namespace == Some(Edition::V1_0.namespace()) {
            root.set("xmlns", Edition::V1_0.namespace(), root.at);
        }
        while let Some(comment) = before.next().filter(Xml::is_comment) {
            root.comments
                .insert(0, comment.text().unwrap_or_default().to_owned());
        }
        let mut after = document.root_element().next_siblings().skip(1);
        while let Some(comment) = after.next().filter(Xml::is_comment) {
            root.trailing
                .push(comment.text().unwrap_or_default().to_owned());
        }
        Ok(root)
    }

    /// Its XML without indentation, as a whole document.
    pub(super) fn to_xml(&self) -> Translation {
        let mut writer = Writer::default();
        writer
            .text
            .push_str("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
        let mut root = self.clone();
        if !root.attributes.iter().any(|it| it.name == "xmlns") {
            root.set("xmlns", Edition::V1_1.namespace(), root.at);
        }
        if root.has_own() {
            root.set("xmlns:own", EXTENSION, root.at);
        }
        writer.element(&root);
        writer.translation()
    }

    /// Whether it, or an element in it, has an attribute of our own namespace.
    fn has_own(&self) -> bool {
        let is_own = |it: &Attribute| it.name.starts_with(OWN);
        self.attributes.iter().any(is_own) || self.children.iter().any(Self::has_own)
    }

    /// Its XML as a part of a document.
    pub(super) fn to_part(&self) -> String {
        let mut writer = Writer::default();
        writer.element(self);
        // It is written into a comment of the compact form.
        writer.text.replace("*/", "&#42;/")
    }
}

fn of_xml(xml: Xml<'_, '_>, depth: usize) -> Result<Element, (usize, String)> {
    let at = xml.range().start;
    let name = xml.tag_name().name();
    let Some(known) = grammar::element(name) else {
        return Err((at, format!("`{name}` is not an element of JSIDL")));
    };
    if depth > DEEPEST {
        return Err((
            at,
            format!("elements are nested more than {DEEPEST} deep: flatten them"),
        ));
    }
    let mut element = Element::new(known.name, at);
    for given in xml.attributes() {
        let Some(name) = name_of(&given) else {
            continue;
        };
        let value = given
            .value()
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        element.set(&name, value, given.range_value().start);
    }
    if known.text {
        let texts = xml.children().filter(Xml::is_text);
        let value: String = texts.filter_map(|it| it.text()).collect();
        let at = xml.first_child().map_or(at, |it| it.range().start);
        element.text = Some(Text { value, at });
        return Ok(element);
    }
    let mut comments = Vec::new();
    for child in xml.children() {
        if child.is_comment() {
            comments.push(child.text().unwrap_or_default().to_owned());
        } else if child.is_element()
            && Edition::of_namespace(child.tag_name().namespace().unwrap_or_default()).is_some()
            && child.tag_name().name() != START_ARROW
        {
            let mut child = of_xml(child, depth + 1)?;
            child.comments = std::mem::take(&mut comments);
            element.children.push(child);
        }
    }
    element.trailing = comments;
    Ok(element)
}

/// The name of an attribute of the language or of our own namespace.
pub(super) fn name_of(attribute: &roxmltree::Attribute<'_, '_>) -> Option<String> {
    match attribute.namespace() {
        None => Some(attribute.name().to_owned()),
        Some(EXTENSION) => Some(format!("{OWN}{}", attribute.name())),
        Some(_) => None,
    }
}

#[derive(Default)]
struct Writer {
    text: String,
    places: Vec<(u32, u32)>,
}

impl Writer {
    /// What follows comes from this offset.
    fn mark(&mut self, origin: usize) {
        let offset = |at: usize| u32::try_from(at).unwrap_or(u32::MAX);
        self.places.push((offset(self.text.len()), offset(origin)));
    }

    fn translation(self) -> Translation {
        Translation::new(self.text, self.places)
    }

    fn comments(&mut self, comments: &[String]) {
        for comment in comments {
            let text = comment.replace("--", "- -");
            let text = text.trim();
            self.text.push_str(&format!("<!-- {text} -->\n"));
        }
    }

    fn element(&mut self, element: &Element) {
        self.comments(&element.comments);
        self.mark(element.at);
        self.text.push('<');
        self.text.push_str(element.name);
        for attribute in &element.attributes {
            self.text.push(' ');
            self.text.push_str(&attribute.name);
            self.text.push_str("=\"");
            self.mark(attribute.at);
            escape(&mut self.text, &attribute.value, true);
            self.text.push('"');
        }
        if let Some(text) = &element.text {
            self.text.push('>');
            self.mark(text.at);
            escape(&mut self.text, &text.value, false);
        } else if element.children.is_empty() && element.trailing.is_empty() {
            self.text.push_str("/>\n");
            return;
        } else {
            self.text.push_str(">\n");
            for child in &element.children {
                self.element(child);
            }
            self.comments(&element.trailing);
        }
        self.mark(element.at);
        self.text.push_str("</");
        self.text.push_str(element.name);
        self.text.push_str(">\n");
    }
}

/// Adds a text with the characters that XML reserves as references.
fn escape(out: &mut String, text: &str, in_quotes: bool) {
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' if in_quotes => out.push_str("&quot;"),
            '\u{0}'..='\u{8}'
            | '\u{b}'
            | '\u{c}'
            | '\u{e}'..='\u{1f}'
            | '\u{fffe}'
            | '\u{ffff}' => {
                // XML has no way to write them.
                out.push('\u{fffd}');
            }
            _ => out.push(character),
        }
    }
}
