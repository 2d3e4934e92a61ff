//! Parses XML into nodes that preserve everything relevant to layout: names, values and texts as
//! written, comments, and blank lines.
//!
//! The text is known to be well-formed, so nothing is validated here.

use std::borrow::Cow;

/// A child of an element or of the document.
#[derive(Debug)]
pub(crate) struct Node<'t> {
    pub(crate) kind: Kind<'t>,
    /// Whether a blank line precedes it.
    pub(crate) apart: bool,
    /// Whether it starts on the last line of its predecessor.
    pub(crate) same_line: bool,
}

#[derive(Debug)]
pub(crate) enum Kind<'t> {
    Element(Element<'t>),
    /// With its `<!--` and `-->`.
    Comment(&'t str),
    /// A processing instruction.
    Instruction(&'t str),
}

#[derive(Debug)]
pub(crate) struct Element<'t> {
    /// With its prefix.
    pub(crate) name: Cow<'t, str>,
    pub(crate) attributes: Vec<Attribute<'t>>,
    pub(crate) content: Content<'t>,
}

impl Element<'_> {
    /// The name without its prefix.
    pub(crate) fn local_name(&self) -> &str {
        self.name.rsplit(':').next().unwrap_or(&self.name)
    }

    /// The prefix with its colon; empty if there is none.
    pub(crate) fn prefix(&self) -> String {
        let length = self.name.len() - self.local_name().len();
        self.name[..length].to_owned()
    }
}

/// As written: character references are not expanded.
#[derive(Debug)]
pub(crate) struct Attribute<'t> {
    pub(crate) name: &'t str,
    pub(crate) value: &'t str,
    pub(crate) quote: char,
}

#[derive(Debug)]
pub(crate) enum Content<'t> {
    Nodes(Vec<Node<'t>>),
    /// Everything between the tags, if that includes text.
    Text(&'t str),
}

/// The nodes of a whole text, without its XML declaration.
pub(crate) fn nodes(text: &str) -> Vec<Node<'_>> {
    let mut reader = Reader { text, at: 0 };
    reader.nodes().0
}

struct Reader<'t> {
    text: &'t str,
    at: usize,
}

impl<'t> Reader<'t> {
    fn rest(&self) -> &'t str {
        &self.text[self.at..]
    }

    /// Takes everything up to and including `end`.
    fn through(&mut self, end: &str) -> &'t str {
        let rest = self.rest();
        let length = rest.find(end).map_or(rest.len(), |at| at + end.len());
        self.at += length;
        &rest[..length]
    }

    /// Takes everything before the first character that `ends`.
    fn before(&mut self, ends: impl Fn(char) -> bool) -> &'t str {
        let rest = self.rest();
        let length = rest.find(ends).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    /// Everything up to the next end tag, and whether there is text between the nodes.
    fn nodes(&mut self) -> (Vec<Node<'t>>, bool) {
        let mut nodes = Vec::new();
        let mut has_text = false;
        loop {
            let space = self.before(|c| c == '<');
            has_text |= !space.trim().is_empty();
            let breaks = space.matches('\n').count();
            let Some(kind) = self.node(&mut has_text) else {
                return (nodes, has_text);
            };
            if matches!(kind, Kind::Instruction(text) if text.starts_with("<?xml ")) {
                continue;
            }
            nodes.push(Node {
                kind,
                apart: breaks > 1 && !nodes.is_empty(),
                same_line: breaks == 0 && !nodes.is_empty(),
            });
        }
    }

    /// Parses the node that begins here; `None` at an end tag and at the end of the text.
    fn node(&mut self, has_text: &mut bool) -> Option<Kind<'t>> {
        let rest = self.rest();
        if rest.is_empty() || rest.starts_with("</") {
            return None;
        }
        if rest.starts_with("<!--") {
            return Some(Kind::Comment(self.through("-->")));
        }
        if rest.starts_with("<![CDATA[") {
            *has_text = true;
            return Some(Kind::Comment(self.through("]]>")));
        }
        if rest.starts_with("<?") {
            return Some(Kind::Instruction(self.through("?>")));
        }
        Some(Kind::Element(self.element()))
    }

    fn element(&mut self) -> Element<'t> {
        self.at += 1;
        let name = self.before(|c| c.is_whitespace() || c == '/' || c == '>');
        let mut attributes = Vec::new();
        loop {
            self.before(|c| !c.is_whitespace());
            if self.rest().starts_with(['/', '>']) || self.rest().is_empty() {
                break;
            }
            attributes.push(self.attribute());
        }
        let empty = self.rest().starts_with('/');
        self.through(">");
        let content = if empty {
            Content::Nodes(Vec::new())
        } else {
            self.content()
        };
        Element {
            name: Cow::Borrowed(name),
            attributes,
            content,
        }
    }

    fn attribute(&mut self) -> Attribute<'t> {
        let name = self.before(|c| c == '=').trim_end();
        self.before(|c| c == '"' || c == '\'');
        let quote = self.rest().chars().next().unwrap_or('"');
        self.at += quote.len_utf8();
        let value = self.before(|c| c == quote);
        self.at += quote.len_utf8();
        Attribute { name, value, quote }
    }

    /// Parses the content between a start tag and its end tag.
    fn content(&mut self) -> Content<'t> {
        let start = self.at;
        let (nodes, has_text) = self.nodes();
        let inner = &self.text[start..self.at];
        self.through(">");
        if has_text {
            Content::Text(inner)
        } else {
            Content::Nodes(nodes)
        }
    }
}
