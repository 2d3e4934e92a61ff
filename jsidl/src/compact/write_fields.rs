//! Writes composites, fields and values in the compact form.

use super::cursor::Place;
use super::tree::Element;
use super::words;
use super::writer::{Inexpressible, Writer, Written, tag};

impl Writer {
    pub(super) fn field(&mut self, element: &Element, place: Place, indent: usize) -> Written<()> {
        let tag = tag(element, place);
        let optional = if element.value("optional") == "true" {
            "optional "
        } else {
            ""
        };
        let head = format!("{tag}{optional}");
        let name = element.value("name");
        match element.name {
            "record" | "sequence" => {
                let mut bare = element.clone();
                bare.children.retain(|it| it.name != "presence_vector");
                self.block(
                    &format!("{head}{} {name}", element.name),
                    &bare,
                    Place::Member,
                    indent,
                    "",
                )
            }
            "list" | "variant" => {
                let inner = if element.name == "list" {
                    Place::Member
                } else {
                    Place::Alternative
                };
                let mut bare = element.clone();
                let count = bare
                    .children
                    .iter()
                    .position(|it| it.name.ends_with("t_field") || it.name == "vtag_field");
                let count = bare.children.remove(count.ok_or(Inexpressible)?);
                let head = format!("{head}{} {name}{}", element.name, limits(&count));
                let end = if element.name == "variant" { ";" } else { "" };
                self.block(&head, &bare, inner, indent, end)
            }
            "fixed_field" => {
                let line = format!("{head}field {} {name} {}", number(element)?, unit(element));
                self.meaning(&line, element, indent)
            }
            "bit_field" => {
                let number = words::number_word(element.value("field_type_unsigned"))
                    .ok_or(Inexpressible)?;
                self.block(
                    &format!("{head}bit_field {number} {name}"),
                    element,
                    Place::BitField,
                    indent,
                    ";",
                )
            }
            "sub_field" => {
                let range = element.child("bit_range").ok_or(Inexpressible)?;
                let line = format!(
                    "{name} [{}:{}]",
                    range.value("from_index"),
                    range.value("to_index")
                );
                self.meaning(&line, element, indent)
            }
            "variable_field" => {
                let choices = element.child("type_and_units_field").ok_or(Inexpressible)?;
                self.block(
                    &format!("{head}variable_field {name}"),
                    choices,
                    Place::VariableField,
                    indent,
                    ";",
                )
            }
            "type_and_units_enum" => {
                let name = if name.is_empty() { "_" } else { name };
                let line = format!(
                    "tag {}: {name} {} {}",
                    element.value("index"),
                    number(element)?,
                    unit(element)
                );
                self.meaning(&line, element, indent)
            }
            "value_range" => {
                self.line(indent, &format!("{};", range(element)));
                Ok(())
            }
            "value_enum" => {
                let name = super::lexer::quoted(element.value("enum_const"));
                self.line(
                    indent,
                    &format!("{name} = {};", element.value("enum_index")),
                );
                Ok(())
            }
            "array" => self.array(&head, element, indent),
            _ => self.text_or_blob(&head, element, indent),
        }
    }

    fn text_or_blob(&mut self, head: &str, element: &Element, indent: usize) -> Written<()> {
        let name = element.value("name");
        let count = || element.child("count_field").ok_or(Inexpressible);
        match element.name {
            "fixed_length_string" => {
                self.line(
                    indent,
                    &format!("{head}string {name} [{}];", element.value("string_length")),
                );
            }
            "variable_length_string" => {
                self.line(
                    indent,
                    &format!("{head}vstring {name}{};", limits(count()?)),
                );
            }
            "variable_length_field" => {
                let format = format_of(element);
                self.line(
                    indent,
                    &format!("{head}vfield {format} {name}{};", limits(count()?)),
                );
            }
            "variable_format_field" => {
                let mut all = element.child("format_field").ok_or(Inexpressible)?.clone();
                all.children.insert(0, count()?.clone());
                self.block(
                    &format!("{head}variable_format_field {name}"),
                    &all,
                    Place::VariableFormatField,
                    indent,
                    ";",
                )?;
            }
            "count_field" => {
                let number = words::number_word(element.value("field_type_unsigned"))
                    .ok_or(Inexpressible)?;
                let (least, most) = ends(element);
                self.line(indent, &format!("{number} tag [{least}, {most}];"));
            }
            "format_enum" => {
                self.line(
                    indent,
                    &format!("tag {}: {};", element.value("index"), format_of(element)),
                );
            }
            _ => return Err(Inexpressible),
        }
        Ok(())
    }

    /// An array of one dimension whose elements are declared elsewhere.
    fn array(&mut self, head: &str, element: &Element, indent: usize) -> Written<()> {
        let [inner, dimension] = element.children.as_slice() else {
            return Err(Inexpressible);
        };
        if !inner.is_reference() {
            return Err(Inexpressible);
        }
        let (path, name) = (inner.value("declared_type_ref"), element.value("name"));
        self.line(
            indent,
            &format!("{head}{path} {name} [{}];", dimension.value("size")),
        );
        Ok(())
    }

    /// A line that ends with a scale or values.
    fn meaning(&mut self, line: &str, element: &Element, indent: usize) -> Written<()> {
        let mut parts = element.children.iter().filter(|it| it.name != "bit_range");
        let meaning = parts.next();
        if parts.next().is_some() {
            return Err(Inexpressible);
        }
        match meaning {
            None => self.line(indent, &format!("{line};")),
            Some(scale) if scale.name == "scale_range" => {
                let explained = explanation(scale);
                let (lower, upper) = (
                    scale.value("real_lower_limit"),
                    scale.value("real_upper_limit"),
                );
                let function = scale.value("integer_function");
                self.line(
                    indent,
                    &format!("{line}{explained} <{lower}, {upper}> {function};"),
                );
            }
            Some(set) if set.name == "value_set" => {
                let offset = if set.value("offset_to_lower_limit") == "true" {
                    " offset"
                } else {
                    ""
                };
                self.block(line, set, Place::ValueSet, indent, &format!("{offset};"))?;
            }
            Some(_) => return Err(Inexpressible),
        }
        Ok(())
    }
}

fn number(element: &Element) -> Written<&'static str> {
    words::number_word(element.value("field_type")).ok_or(Inexpressible)
}

fn unit(element: &Element) -> String {
    words::unit_word(element.value("field_units"))
}

/// A word or a text.
fn format_of(element: &Element) -> String {
    let name = element.value("field_format");
    words::format_word(name).map_or_else(|| super::lexer::quoted(name), str::to_owned)
}

/// An interpretation within a line, after a blank.
fn explanation(element: &Element) -> String {
    match element.value("interpretation") {
        text if text.is_empty() || text.contains('#') => String::new(),
        text => format!(" ##{text}##"),
    }
}

/// The limits of a count; those of its type where there are none.
fn ends(count: &Element) -> (String, String) {
    let least = count.attribute("min_count").map_or("0", |it| &it.value);
    let most = count.attribute("max_count").map(|it| it.value.clone());
    let most =
        most.unwrap_or_else(|| words::greatest(count.value("field_type_unsigned")).to_string());
    (least.to_owned(), most)
}

fn limits(count: &Element) -> String {
    let (least, most) = ends(count);
    if count
        .attribute("max_count")
        .or(count.attribute("field_type_unsigned"))
        .is_none()
    {
        // Neither a limit nor a type, from which it would follow.
        let least = count.attribute("min_count").map(|_| format!(" [{least}]"));
        return explanation(count) + &least.unwrap_or_default();
    }
    format!("{} [{least}, {most}]", explanation(count))
}

/// `[lower, upper]`; parentheses exclude a limit.
fn range(element: &Element) -> String {
    let excludes = |limit: &str| element.value(limit) == "exclusive";
    let open = if excludes("lower_limit_type") {
        "("
    } else {
        "["
    };
    let close = if excludes("upper_limit_type") {
        ")"
    } else {
        "]"
    };
    format!(
        "{open}{}, {}{close}",
        element.value("lower_limit"),
        element.value("upper_limit")
    )
}
