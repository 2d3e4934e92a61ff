//! Writes elements in the compact form.
//!
//! Each construct is written, read again and compared with the original. What the compact form
//! cannot say is added as an amendment (`//@ …`), or the construct is written as XML in `/*@ … */`:
//! the JAUS Tool Set takes both for comments.

use super::amendments::amendments;
use super::cursor::{Cursor, Place, Read};
use super::lexer::{Fault, Kind, quoted};
use super::machines::{flat, nested};
use super::tree::{Element, REFERENCE};
use super::writer::{Inexpressible, Writer, Written, explained, tag};

/// Constructs that have no interpretation in the public grammar.
const UNEXPLAINED: [&str; 7] = [
    "service_def",
    "declared_type_set",
    "declared_const_set",
    "message_def",
    "event_def",
    "description",
    "assumptions",
];

/// The text of a definition; `None` if its root has no counterpart.
pub(super) fn document(root: &Element) -> Option<String> {
    let mut root = root.clone();
    let behaviour = root
        .children
        .iter_mut()
        .find(|it| it.name == "protocol_behavior");
    if let Some(behaviour) = behaviour {
        let original = behaviour.clone();
        if !nested(behaviour) {
            *behaviour = original;
        }
    }
    root.in_order();
    comments_first(&mut root);
    references_last(&mut root);
    let mut writer = Writer::default();
    writer.item(&root, Place::File, 0).ok()?;
    Some(writer.text)
}

/// Elements whose children stand on lines of their own.
const BLOCKS: [&str; 26] = [
    "service_def",
    "references",
    "declared_const_set",
    "declared_type_set",
    "message_set",
    "input_set",
    "output_set",
    "internal_events_set",
    "message_def",
    "event_def",
    "header",
    "body",
    "footer",
    "record",
    "sequence",
    "list",
    "variant",
    "bit_field",
    "type_and_units_field",
    "value_set",
    "protocol_behavior",
    "state_machine",
    "state",
    "default_state",
    "transition",
    "default_transition",
];

/// Elements that stand on the line of the construct that they belong to.
const INLINE: [&str; 17] = [
    "count_field",
    "vtag_field",
    "presence_vector",
    "bit_range",
    "value_set",
    "scale_range",
    "type_and_units_field",
    "format_field",
    "dimension",
    "start",
    "internal",
    "simple",
    "push",
    "pop",
    "end_state",
    "parameter",
    "argument",
];

/// Moves comments to the construct that they can stand before. Returns those for the parent.
fn comments_first(element: &mut Element) -> Vec<String> {
    let mut own = Vec::new();
    for child in &mut element.children {
        own.append(&mut comments_first(child));
    }
    if !BLOCKS.contains(&element.name) {
        own.append(&mut element.trailing);
    }
    element.comments.append(&mut own);
    if INLINE.contains(&element.name) {
        std::mem::take(&mut element.comments)
    } else {
        Vec::new()
    }
}

/// Moves references behind the other declarations of type sets, where the grammar wants them.
fn references_last(element: &mut Element) {
    if element.name == "declared_type_set" {
        let is_set = |it: &Element| it.name.ends_with("_set_ref");
        element
            .children
            .sort_by_key(|it| !is_set(it) && it.is_reference());
    }
    element.children.iter_mut().for_each(references_last);
}

impl Writer {
    /// Writes a construct with everything that precedes it.
    pub(super) fn item(&mut self, element: &Element, place: Place, indent: usize) -> Written<()> {
        let kept = self.text.len();
        self.comments(&element.comments, indent);
        match written(element, place, indent) {
            Ok(text) => self.text.push_str(&text),
            Err(Inexpressible) if is_part(place) => self.xml(element, indent),
            Err(Inexpressible) => {
                self.text.truncate(kept);
                return Err(Inexpressible);
            }
        }
        Ok(())
    }

    fn xml(&mut self, element: &Element, indent: usize) {
        let mut bare = element.clone();
        bare.comments.clear();
        flat(&mut bare);
        let part = crate::layout::part(&bare.to_part());
        self.line(indent, "/*@");
        for line in part.lines() {
            self.line(indent, line);
        }
        self.line(indent, "*/");
    }

    fn compose(&mut self, element: &Element, place: Place, indent: usize) -> Written<()> {
        let is_inline = matches!(element.name, "inherits_from" | "client_of");
        if !UNEXPLAINED.contains(&element.name) && place != Place::Alternative && !is_inline {
            self.interpretation(element, indent);
        }
        match element.name {
            "service_def" => {
                let head = format!("service {} {}", element.value("name"), identity(element));
                self.block(&head, element, Place::Service, indent, "")
            }
            "description" | "assumptions" => {
                self.prose(element, indent);
                Ok(())
            }
            "references" => self.block("references", element, Place::References, indent, ""),
            "inherits_from" | "client_of" => {
                let explained = explained(element);
                let head = format!("{} {explained}import", element.name);
                self.alias(&head, element, indent)
            }
            "declared_const_set_ref" => self.alias("using constants", element, indent),
            "declared_type_set_ref" => self.alias("using typeset", element, indent),
            "declared_const_set" => self.block(
                &set_head("constants", element),
                element,
                Place::ConstSet,
                indent,
                "",
            ),
            "declared_type_set" => self.block(
                &set_head("typeset", element),
                element,
                Place::TypeSet,
                indent,
                "",
            ),
            "const_def" => self.constant(element, indent),
            "message_set" => self.block("messages", element, Place::Messages, indent, ""),
            "input_set" => self.block("input", element, Place::TypeSet, indent, ""),
            "output_set" => self.block("output", element, Place::TypeSet, indent, ""),
            "internal_events_set" => self.block("eventset", element, Place::Events, indent, ""),
            "message_def" => {
                let command = if element.value("is_command") == "true" {
                    "command "
                } else {
                    ""
                };
                let code = element.value("message_id");
                let head = format!("{command}message 0x{code} {}", element.value("name"));
                self.block(&head, element, Place::Message, indent, "")
            }
            "event_def" => self.block(
                &format!("event {}", element.value("name")),
                element,
                Place::Message,
                indent,
                "",
            ),
            "header" | "body" | "footer" => {
                let head = format!("{} {}", element.name, element.value("name"));
                self.block(&head, element, Place::Member, indent, "")
            }
            "declared_message_def" => self.declared("message", element, indent),
            "declared_event_def" => self.declared("eventset", element, indent),
            "declared_header" => self.declared("header", element, indent),
            "declared_body" => self.declared("body", element, indent),
            "declared_footer" => self.declared("footer", element, indent),
            _ if element.name == REFERENCE || element.is_reference() => {
                self.reference(element, place, indent)
            }
            _ if self.behaviour(element, indent)? => Ok(()),
            _ => self.field(element, place, indent),
        }
    }

    /// `head {`, the children, and `}` with an end.
    pub(super) fn block(
        &mut self,
        head: &str,
        element: &Element,
        place: Place,
        indent: usize,
        end: &str,
    ) -> Written<()> {
        self.line(indent, &format!("{head} {{"));
        for child in &element.children {
            self.item(child, place, indent + 2)?;
        }
        self.comments(&element.trailing, indent + 2);
        self.line(indent, &format!("}}{end}"));
        Ok(())
    }

    fn prose(&mut self, element: &Element, indent: usize) {
        let text = element.text.as_ref().map_or("", |it| &it.value);
        let lines: Vec<_> = text.trim().lines().map(str::trim).collect();
        let whole = quoted(&lines.join("\n"));
        let mut lines = whole.lines();
        let first = lines.next().unwrap_or("\"\"");
        let mut written = format!("{} {first}", element.name);
        for line in lines {
            self.line(indent, &written);
            written = format!("  {line}");
        }
        self.line(indent, &format!("{written};"));
    }

    fn alias(&mut self, head: &str, element: &Element, indent: usize) -> Written<()> {
        let line = format!(
            "{head} {} as {};",
            dotted(element.value("id")),
            element.value("name")
        );
        self.line(indent, &line);
        Ok(())
    }

    fn constant(&mut self, element: &Element, indent: usize) -> Written<()> {
        let number = super::words::number_word(element.value("const_type")).ok_or(Inexpressible)?;
        let unit = super::words::unit_word(element.value("field_units"));
        let (name, value) = (element.value("name"), element.value("const_value"));
        self.line(indent, &format!("{number} {name} = {value} {unit};"));
        Ok(())
    }

    fn declared(&mut self, head: &str, element: &Element, indent: usize) -> Written<()> {
        let line = format!(
            "{head} {} {};",
            element.value("declared_type_ref"),
            reference_name(element)
        );
        self.line(indent, &line);
        Ok(())
    }

    fn reference(&mut self, element: &Element, place: Place, indent: usize) -> Written<()> {
        let tag = tag(element, place);
        let optional = if element.value("optional") == "true" {
            "optional "
        } else {
            ""
        };
        let path = element.value("declared_type_ref");
        self.line(
            indent,
            &format!("{tag}{optional}{path} {};", reference_name(element)),
        );
        Ok(())
    }
}

/// A construct with the amendments that it needs.
fn written(element: &Element, place: Place, indent: usize) -> Written<String> {
    let compose = |element: &Element| -> Written<String> {
        let mut writer = Writer::default();
        writer.compose(element, place, indent)?;
        Ok(writer.text)
    };
    let read = |text: &str| read_at(text, place).map_err(|_| Inexpressible);
    let whole = compose(element)?;
    // The children that stand on lines of their own are compared when they are written.
    let amendments = match hollow(element) {
        Some(hollow) => amendments(&hollow, &read(&compose(&hollow)?)?),
        None => amendments(element, &read(&whole)?),
    };
    let mut writer = Writer::default();
    for amendment in amendments.ok_or(Inexpressible)? {
        writer.line(indent, &format!("//@ {amendment}"));
    }
    writer.text.push_str(&whole);
    Ok(writer.text)
}

/// A construct without the children that say nothing about it; `None` if all do.
fn hollow(element: &Element) -> Option<Element> {
    let is_whole = matches!(
        element.name,
        "record" | "sequence" | "bit_field" | "value_set" | "transition" | "default_transition"
    );
    if is_whole || !BLOCKS.contains(&element.name) || element.attribute("initial_state").is_some() {
        return None;
    }
    let own = |it: &&Element| matches!(it.name, "count_field" | "vtag_field" | "start");
    Some(Element {
        name: element.name,
        at: element.at,
        attributes: element.attributes.clone(),
        children: element.children.iter().filter(own).cloned().collect(),
        ..Element::default()
    })
}

/// The name of a reference: not the name of its type.
fn reference_name(element: &Element) -> String {
    let name = element.value("name");
    if name == element.value("declared_type_ref") {
        format!("{name}{}", super::words::SAME_NAME)
    } else {
        name.to_owned()
    }
}

/// Whether a construct in this place may be written as XML.
fn is_part(place: Place) -> bool {
    !matches!(
        place,
        Place::File | Place::Messages | Place::Protocol | Place::Transition
    )
}

/// A URN with dots.
fn dotted(urn: &str) -> String {
    let mut dotted = String::new();
    for part in urn.split([':', '.']) {
        if !dotted.is_empty() {
            dotted.push('.');
        }
        if !part.starts_with(|it: char| it.is_ascii_alphabetic() || it == '_') {
            dotted.push('_');
        }
        dotted.extend(
            part.chars()
                .map(|it| if it.is_ascii_alphanumeric() { it } else { '_' }),
        );
    }
    dotted
}

fn identity(element: &Element) -> String {
    let version = element.value("version");
    let is_plain = version.starts_with(|it: char| it.is_ascii_digit())
        && version.ends_with(|it: char| it.is_ascii_digit())
        && version.chars().all(|it| it.is_ascii_digit() || it == '.');
    let version = if is_plain { version } else { "0.0" };
    format!(
        "(id = {}, version = {version})",
        dotted(element.value("id"))
    )
}

fn set_head(word: &str, element: &Element) -> String {
    let name = element.value("name");
    if element.attribute("id").is_some() {
        format!("{word} {name} {}", identity(element))
    } else {
        format!("{word} {name}")
    }
}

/// Reads one construct in its place.
fn read_at(text: &str, place: Place) -> Read<Element> {
    let mut cursor = Cursor::new(text)?;
    let mut found = cursor.constructs(place)?;
    if let Some(fault) = cursor.faults.pop() {
        return Err(fault);
    }
    match found.pop() {
        Some(mut element) if found.is_empty() && cursor.kind() == Kind::End => {
            element.in_order();
            Ok(element)
        }
        _ => Err(Fault::new(0, "not one construct")),
    }
}
