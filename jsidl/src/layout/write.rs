//! Writes nodes in the canonical layout.

use super::WIDTH;
use super::nodes::{Attribute, Content, Element, Kind, Node};

/// The order of attributes: name, kind, limits. Others follow in document order, then the
/// interpretation and the namespaces.
const ORDER: &[&str] = &[
    "name",
    "id",
    "version",
    "message_id",
    "is_command",
    "deprecated",
    "is_stateless",
    "state_machine_name",
    "state_name",
    "initial_state",
    "state",
    "type",
    "value",
    "condition",
    "transition",
    "index",
    "enum_index",
    "enum_const",
    "from_index",
    "to_index",
    "optional",
    "declared_type_ref",
    "const_type",
    "const_value",
    "field_type",
    "field_type_unsigned",
    "field_units",
    "field_format",
    "string_length",
    "size",
    "min_count",
    "max_count",
    "real_lower_limit",
    "real_upper_limit",
    "integer_function",
    "lower_limit",
    "lower_limit_type",
    "upper_limit",
    "upper_limit_type",
    "offset_to_lower_limit",
];

/// Short elements that share one line with their content, if it fits.
const INLINE: &[&str] = &["action", "send_action", "simple", "push", "pop"];

/// Extra indentation of a tag's continuation lines, in blanks.
const CONTINUED: usize = 4;

/// A whole document.
pub(crate) fn document(nodes: &[Node<'_>]) -> String {
    let mut writer = Writer {
        text: "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_owned(),
    };
    writer.nodes(nodes, 0);
    writer.text
}

/// Nodes that are not a whole document.
pub(crate) fn part(nodes: &[Node<'_>]) -> String {
    let mut writer = Writer {
        text: String::new(),
    };
    writer.nodes(nodes, 0);
    writer.text
}

struct Writer {
    text: String,
}

impl Writer {
    fn line(&mut self, indent: usize, line: &str) {
        if !line.is_empty() {
            self.text.extend(std::iter::repeat_n(' ', indent));
            self.text.push_str(line);
        }
        self.text.push('\n');
    }

    fn nodes(&mut self, nodes: &[Node<'_>], indent: usize) {
        for node in nodes {
            if node.apart {
                self.text.push('\n');
            }
            match &node.kind {
                Kind::Element(element) => self.element(element, indent),
                Kind::Comment(comment) if node.same_line && self.has_room_for(comment) => {
                    self.text.pop();
                    self.text.push(' ');
                    self.text.push_str(comment);
                    self.text.push('\n');
                }
                Kind::Comment(comment) => self.comment(comment, indent),
                Kind::Instruction(instruction) => self.line(indent, instruction),
            }
        }
    }

    /// Whether a comment fits behind the last line.
    fn has_room_for(&self, comment: &str) -> bool {
        let last = self.text.lines().next_back().unwrap_or_default();
        !comment.contains('\n') && width(last) + 1 + width(comment) <= WIDTH
    }

    /// Continuation lines of a comment keep their relative indentation.
    fn comment(&mut self, comment: &str, indent: usize) {
        let (first, rest) = comment.split_once('\n').unwrap_or((comment, ""));
        self.line(indent, first.trim_end());
        let lines: Vec<_> = rest.lines().map(untabbed).collect();
        let closes = |line: &str| line.trim() == "-->";
        let inner = || lines.iter().filter(|line| !closes(line));
        let common = common_indent(inner());
        for line in &lines {
            if closes(line) {
                self.line(indent, "-->");
            } else {
                let line = line.get(common..).unwrap_or_default().trim_end();
                self.line(indent + "<!-- ".len(), line);
            }
        }
    }

    fn element(&mut self, element: &Element<'_>, indent: usize) {
        let lines = tag(element, indent);
        let name = &element.name;
        match &element.content {
            Content::Nodes(nodes) if nodes.is_empty() => self.tag(&lines, indent, "/>"),
            Content::Nodes(nodes) => {
                if let Some(line) = in_line(element, &lines, nodes)
                    && indent + width(&line) <= WIDTH
                {
                    self.line(indent, &line);
                    return;
                }
                self.tag(&lines, indent, ">");
                self.nodes(nodes, indent + 2);
                self.line(indent, &format!("</{name}>"));
            }
            Content::Text(text) => {
                let paragraph = paragraph(text);
                if let ([start], [words]) = (&lines[..], &paragraph[..]) {
                    let line = format!("{start}>{words}</{name}>");
                    if indent + width(&line) <= WIDTH {
                        self.line(indent, &line);
                        return;
                    }
                }
                self.tag(&lines, indent, ">");
                for line in &paragraph {
                    self.filled(line, indent + 2);
                }
                self.line(indent, &format!("</{name}>"));
            }
        }
    }

    /// The lines of a start tag without its end, then the end.
    fn tag(&mut self, lines: &[String], indent: usize, end: &str) {
        for (position, line) in lines.iter().enumerate() {
            let indent = indent + if position == 0 { 0 } else { CONTINUED };
            let end = if position + 1 == lines.len() { end } else { "" };
            self.line(indent, &format!("{line}{end}"));
        }
    }

    /// Writes a line of text, wrapped if it is too long.
    fn filled(&mut self, line: &str, indent: usize) {
        let words = line.trim_start();
        let indent = indent + line.len() - words.len();
        if indent + width(words) <= WIDTH {
            self.line(indent, words);
            return;
        }
        for line in fill(
            words.split_whitespace().map(str::to_owned),
            WIDTH - indent.min(WIDTH),
        ) {
            self.line(indent, &line);
        }
    }
}

/// A start tag without its end, attributes in order, wrapped if it is too long.
fn tag(element: &Element<'_>, indent: usize) -> Vec<String> {
    let mut attributes: Vec<_> = element.attributes.iter().collect();
    attributes.sort_by_key(|attribute| rank(attribute.name));
    // Reserve room for the end of the tag, at most two characters.
    let room = WIDTH.saturating_sub(indent + CONTINUED + 2);
    let mut parts = vec![format!("<{}", element.name)];
    for attribute in attributes {
        let attribute = attribute_text(attribute);
        if width(&attribute) <= room {
            parts.push(attribute);
        } else {
            parts.extend(attribute.split(' ').map(str::to_owned));
        }
    }
    let whole = parts.join(" ");
    if indent + width(&whole) + 2 <= WIDTH {
        return vec![whole];
    }
    fill(parts.into_iter(), room)
}

/// Joins parts with blanks into lines of at most `room` characters.
fn fill(parts: impl Iterator<Item = String>, room: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for part in parts {
        match lines.last_mut() {
            Some(line) if width(line) + 1 + width(&part) <= room => {
                line.push(' ');
                line.push_str(&part);
            }
            _ => lines.push(part),
        }
    }
    lines
}

fn rank(name: &str) -> usize {
    match name {
        "interpretation" => ORDER.len() + 1,
        _ if name.starts_with("xmlns") => ORDER.len() + 2,
        _ => {
            let place = ORDER.iter().position(|known| *known == name);
            place.unwrap_or(ORDER.len())
        }
    }
}

fn attribute_text(attribute: &Attribute<'_>) -> String {
    let quote = if attribute.value.contains('"') {
        attribute.quote
    } else {
        '"'
    };
    let words: Vec<_> = attribute.value.split_whitespace().collect();
    format!("{}={quote}{}{quote}", attribute.name, words.join(" "))
}

/// An element with only small children, on one line.
fn in_line(element: &Element<'_>, start: &[String], nodes: &[Node<'_>]) -> Option<String> {
    let [start] = start else { return None };
    if !INLINE.contains(&&*element.name) {
        return None;
    }
    let mut line = format!("{start}>");
    for node in nodes {
        let Kind::Element(child) = &node.kind else {
            return None;
        };
        match (&child.content, &tag(child, 0)[..]) {
            (Content::Nodes(nodes), [child]) if nodes.is_empty() => {
                line.push_str(child);
                line.push_str("/>");
            }
            _ => return None,
        }
    }
    line.push_str("</");
    line.push_str(&element.name);
    line.push('>');
    Some(line)
}

/// The lines of a text without common indentation and with at most one blank line in a row.
fn paragraph(text: &str) -> Vec<String> {
    let lines: Vec<_> = text.lines().map(untabbed).collect();
    // Text on the line of the tag is not indented.
    let common = common_indent(lines.iter().skip(1));
    let mut paragraph: Vec<String> = Vec::new();
    for (position, line) in lines.iter().enumerate() {
        let line = match position {
            0 => line.trim(),
            _ => line.get(common..).unwrap_or_default().trim_end(),
        };
        if !line.is_empty() || paragraph.last().is_some_and(|last| !last.is_empty()) {
            paragraph.push(line.to_owned());
        }
    }
    while paragraph.last().is_some_and(String::is_empty) {
        paragraph.pop();
    }
    paragraph
}

/// The least indentation of the lines that are not blank.
fn common_indent<'l>(lines: impl Iterator<Item = &'l String>) -> usize {
    let written = lines.filter(|line| !line.trim().is_empty());
    written
        .map(|line| line.len() - line.trim_start_matches(' ').len())
        .min()
        .unwrap_or(0)
}

/// A line with its indentation converted to blanks.
fn untabbed(line: &str) -> String {
    let words = line.trim_start();
    let indentation = &line[..line.len() - words.len()];
    format!(
        "{}{words}",
        indentation.replace('\t', "    ").replace('\r', "")
    )
}

fn width(text: &str) -> usize {
    text.chars().count()
}
