//! Reads the text of a `.msg` file.

use super::{Constant, Field, Kind, LONGEST_NAME, Primitive, Size, TypeName, literal};
use super::{is_lower_case, shown};

/// The most octets of a `.msg` text.
const LONGEST_TEXT: usize = 1 << 18;
/// The most fields and the most constants of a message type.
const MOST_FIELDS: usize = 4096;
/// The greatest size of an array, and of the bound of a sequence or a text.
const GREATEST_SIZE: usize = u32::MAX as usize;

/// A message type as its `.msg` text says it: nested types are names.
#[derive(Clone, Debug, PartialEq)]
pub struct Definition {
    pub(super) name: TypeName,
    pub(super) fields: Vec<Field<TypeName>>,
    pub(super) constants: Vec<Constant>,
}

/// A `.msg` text that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name}, line {line}: {reason}")]
pub struct ParseError {
    /// The message type.
    pub name: TypeName,
    /// The line, from 1.
    pub line: usize,
    /// What is wrong, and what to write.
    pub reason: String,
}

impl Definition {
    /// Reads the `.msg` text of a message type.
    ///
    /// # Errors
    /// The first line that does not follow ROS's rules, or a text that is too long. `wstring` is not
    /// supported.
    pub fn parse(name: TypeName, text: &str) -> Result<Self, ParseError> {
        let mut definition = Self {
            name,
            fields: Vec::new(),
            constants: Vec::new(),
        };
        if text.len() > LONGEST_TEXT {
            let reason = format!("the text is longer than {LONGEST_TEXT} octets");
            return Err(definition.error(1, reason));
        }
        for (index, line) in text.lines().enumerate() {
            let added = definition.add(without_comment(line).trim());
            added.map_err(|reason| definition.error(index + 1, reason))?;
        }
        Ok(definition)
    }

    fn error(&self, line: usize, reason: String) -> ParseError {
        let name = self.name.clone();
        ParseError { name, line, reason }
    }

    fn add(&mut self, line: &str) -> Result<(), String> {
        if line.is_empty() {
            return Ok(());
        }
        let (kind, rest) = line
            .split_once([' ', '\t'])
            .ok_or("write a type and a name, such as float64 x")?;
        let (kind, size) = self.kind(kind)?;
        let rest = rest.trim_start();
        let is_in_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let end = rest.find(|c| !is_in_name(c)).unwrap_or(rest.len());
        let (name, rest) = rest.split_at(end);
        let value = rest.trim_start();
        match value.strip_prefix('=') {
            Some(value) => self.add_constant(name, value.trim_start(), &kind, size),
            None if value.len() == rest.len() && !value.is_empty() => Err(format!(
                "`{}` cannot follow the name: write a space and a value, or = and a value",
                shown(value)
            )),
            None => self.add_field(name, value, kind, size),
        }
    }

    fn add_field(
        &mut self,
        name: &str,
        value: &str,
        kind: Kind<TypeName>,
        size: Size,
    ) -> Result<(), String> {
        if !is_lower_case(name) {
            return Err(format!(
                "`{}` is not the name of a field: write it in lower case, with single underscores \
                 between words",
                shown(name)
            ));
        }
        if self.fields.iter().any(|field| field.name == name) {
            return Err(format!("there are two fields `{name}`: rename one"));
        }
        if self.fields.len() == MOST_FIELDS {
            return Err(format!("there are more than {MOST_FIELDS} fields"));
        }
        let default = match value.is_empty() {
            true => None,
            false => Some(literal::of_field(value, &kind, size)?),
        };
        self.fields.push(Field {
            name: name.to_owned(),
            kind,
            size,
            default,
        });
        Ok(())
    }

    fn add_constant(
        &mut self,
        name: &str,
        value: &str,
        kind: &Kind<TypeName>,
        size: Size,
    ) -> Result<(), String> {
        if !is_upper_case(name) {
            return Err(format!(
                "`{}` is not the name of a constant: write it in upper case, with single \
                 underscores between words",
                shown(name)
            ));
        }
        if matches!(kind, Kind::Message(_)) || size != Size::One {
            return Err("a constant is one number, truth value or text".to_owned());
        }
        if self.constants.iter().any(|constant| constant.name == name) {
            return Err(format!("there are two constants `{name}`: rename one"));
        }
        if self.constants.len() == MOST_FIELDS {
            return Err(format!("there are more than {MOST_FIELDS} constants"));
        }
        self.constants.push(Constant {
            name: name.to_owned(),
            value: literal::of_kind(value, kind)?,
        });
        Ok(())
    }

    /// Reads a type, such as `float64[36]`.
    fn kind(&self, text: &str) -> Result<(Kind<TypeName>, Size), String> {
        let (element, size) = match text.split_once('[') {
            None => (text, Size::One),
            Some((element, size)) => {
                let size = size
                    .strip_suffix(']')
                    .ok_or("the size of an array ends with ]")?;
                (element, array(size)?)
            }
        };
        Ok((self.element(element)?, size))
    }

    fn element(&self, text: &str) -> Result<Kind<TypeName>, String> {
        if let Some(primitive) = primitive(text) {
            return Ok(Kind::Primitive(primitive));
        }
        if text == "string" {
            return Ok(Kind::String { most: None });
        }
        if let Some(most) = text.strip_prefix("string<=") {
            let most = Some(size(most)?);
            return Ok(Kind::String { most });
        }
        let advice = match text {
            "wstring" => "wstring is not supported: use string",
            "time" => "there is no type time in ROS 2: write builtin_interfaces/Time",
            "duration" => "there is no type duration in ROS 2: write builtin_interfaces/Duration",
            _ => {
                let name = match text.contains('/') {
                    true => text.parse(),
                    false => TypeName::new(self.name.package(), text),
                };
                return name.map(Kind::Message).map_err(|_| unknown_type(text));
            }
        };
        Err(advice.to_owned())
    }
}

fn unknown_type(text: &str) -> String {
    format!(
        "`{}` is not a type: write for example float64, string or geometry_msgs/Pose",
        shown(text)
    )
}

fn primitive(text: &str) -> Option<Primitive> {
    Some(match text {
        "bool" => Primitive::Bool,
        "byte" => Primitive::Byte,
        "int8" => Primitive::Int8,
        "uint8" | "char" => Primitive::Uint8,
        "int16" => Primitive::Int16,
        "uint16" => Primitive::Uint16,
        "int32" => Primitive::Int32,
        "uint32" => Primitive::Uint32,
        "int64" => Primitive::Int64,
        "uint64" => Primitive::Uint64,
        "float32" => Primitive::Float32,
        "float64" => Primitive::Float64,
        _ => return None,
    })
}

/// Reads what is between the brackets of an array.
fn array(text: &str) -> Result<Size, String> {
    match text.strip_prefix("<=") {
        Some(most) => size(most).map(Size::AtMost),
        None if text.is_empty() => Ok(Size::Any),
        None => size(text).map(Size::Fixed),
    }
}

fn size(text: &str) -> Result<usize, String> {
    let is_number = !text.is_empty() && text.bytes().all(|digit| digit.is_ascii_digit());
    text.parse()
        .ok()
        .filter(|size| is_number && (1..=GREATEST_SIZE).contains(size))
        .ok_or_else(|| {
            let text = shown(text);
            format!("`{text}` is not a size: write a number from 1 to {GREATEST_SIZE}")
        })
}

fn is_upper_case(name: &str) -> bool {
    name.len() <= LONGEST_NAME
        && name.starts_with(|first: char| first.is_ascii_uppercase())
        && name
            .chars()
            .all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_')
        && !name.contains("__")
        && !name.ends_with('_')
}

/// The line up to the first `#` outside quotes.
fn without_comment(line: &str) -> &str {
    let (mut quote, mut is_escaped) = (None, false);
    for (at, c) in line.char_indices() {
        match (quote, c) {
            _ if is_escaped => is_escaped = false,
            (Some(_), '\\') => is_escaped = true,
            (Some(open), _) if open == c => quote = None,
            (None, '#') => return &line[..at],
            (None, '"' | '\'') => quote = Some(c),
            _ => {}
        }
    }
    line
}
