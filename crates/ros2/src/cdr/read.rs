//! Reads messages, in either byte order. Each value takes at least one octet of the input, so that the
//! input bounds what is allocated.

use std::sync::Arc;

use super::{BIG_ENDIAN, HEADER, LITTLE_ENDIAN, LONGEST, width};
use crate::Value;
use crate::interface::{Field, Interface, Kind, Primitive, Size, TypeName};
use crate::message::Message;

/// The most octets of padding after a message.
const MOST_PADDING: usize = 7;

/// Octets that are no message of the type.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name}: {}octet {offset}: {reason}", shown_path(.path))]
pub struct CdrError {
    /// The message type.
    pub name: TypeName,
    /// The path of the value that cannot be read; empty for the whole message.
    pub path: String,
    /// Where in the octets, the header included.
    pub offset: usize,
    /// What is wrong.
    pub reason: String,
}

fn shown_path(path: &str) -> String {
    match path.is_empty() {
        true => String::new(),
        false => format!("`{path}`: "),
    }
}

/// Decodes a message, with its header.
///
/// # Errors
/// An encoding other than plain CDR, an end before the last field, values that the type does not
/// allow, or octets after the last field. A text must be UTF-8.
pub fn decode(interface: &Arc<Interface>, octets: &[u8]) -> Result<Message, CdrError> {
    let mut reader = Reader {
        octets,
        at: 0,
        is_little: true,
    };
    let values = reader
        .header()
        .and_then(|()| reader.message(interface))
        .and_then(|values| reader.end().map(|()| values));
    let values = values.map_err(|fault| CdrError {
        name: interface.name().clone(),
        path: fault.path,
        offset: fault.offset,
        reason: fault.reason,
    })?;
    Ok(Message::from_fitting(interface.clone(), values))
}

/// An error with the path from the message that is being read.
struct Fault {
    path: String,
    offset: usize,
    reason: String,
}

impl Fault {
    fn within(mut self, name: &str) -> Self {
        let separator = match self.path.is_empty() || self.path.starts_with('[') {
            true => "",
            false => ".",
        };
        self.path = format!("{name}{separator}{}", self.path);
        self
    }
}

struct Reader<'a> {
    octets: &'a [u8],
    /// The next octet; the first one until the header is read.
    at: usize,
    is_little: bool,
}

impl Reader<'_> {
    fn fault(&self, reason: impl Into<String>) -> Fault {
        Fault {
            path: String::new(),
            offset: self.at,
            reason: reason.into(),
        }
    }

    fn header(&mut self) -> Result<(), Fault> {
        if self.octets.len() > LONGEST {
            let long = self.octets.len();
            return Err(self.fault(format!("{long} octets are more than {LONGEST}")));
        }
        self.is_little = match self.octets {
            [0, LITTLE_ENDIAN, _, _, ..] => true,
            [0, BIG_ENDIAN, _, _, ..] => false,
            [first, second, _, _, ..] => {
                let reason = format!("the encoding {first:02x} {second:02x} is not plain CDR");
                return Err(self.fault(reason));
            }
            _ => return Err(self.fault("there is no header")),
        };
        self.at = HEADER;
        Ok(())
    }

    /// Whether nothing but padding follows.
    fn end(&self) -> Result<(), Fault> {
        match self.octets.len() - self.at {
            0..=MOST_PADDING => Ok(()),
            more => Err(self.fault(format!("{more} octets follow after the last field"))),
        }
    }

    fn message(&mut self, interface: &Interface) -> Result<Vec<Value>, Fault> {
        if interface.fields().is_empty() {
            // The member that ROS adds to a message without fields.
            self.take(1)?;
        }
        let left = self.octets.len() - self.at;
        let mut values = Vec::with_capacity(interface.fields().len().min(left));
        for field in interface.fields() {
            let value = self.field(field);
            values.push(value.map_err(|fault| fault.within(&field.name))?);
        }
        Ok(values)
    }

    fn field(&mut self, field: &Field) -> Result<Value, Fault> {
        let count = match field.size {
            Size::One => return self.one(&field.kind),
            Size::Fixed(count) => count,
            Size::Any => self.length()?,
            Size::AtMost(most) => {
                let count = self.length()?;
                if count > most {
                    let reason = format!("{count} elements, and at most {most} are allowed");
                    return Err(self.fault(reason));
                }
                count
            }
        };
        let left = self.octets.len() - self.at;
        if count > left {
            return Err(self.fault(format!("{count} elements do not fit in {left} octets")));
        }
        let mut elements = Vec::new();
        for index in 0..count {
            let element = self.one(&field.kind);
            elements.push(element.map_err(|fault| fault.within(&format!("[{index}]")))?);
        }
        Ok(Value::Sequence(elements))
    }

    fn one(&mut self, kind: &Kind) -> Result<Value, Fault> {
        match kind {
            Kind::Primitive(primitive) => self.number(*primitive),
            Kind::String { most } => self.text(*most),
            Kind::Message(nested) => self.message(nested).map(Value::Message),
        }
    }

    fn number(&mut self, primitive: Primitive) -> Result<Value, Fault> {
        let raw = self.raw(width(primitive))?;
        let signed = |bits: u32| (raw << (64 - bits)).cast_signed() >> (64 - bits);
        Ok(match primitive {
            Primitive::Bool if raw > 1 => {
                return Err(self.fault(format!("{raw} is not a truth value, which is 0 or 1")));
            }
            Primitive::Bool => Value::Bool(raw == 1),
            Primitive::Byte
            | Primitive::Uint8
            | Primitive::Uint16
            | Primitive::Uint32
            | Primitive::Uint64 => Value::Unsigned(raw),
            Primitive::Int8 => Value::Signed(signed(8)),
            Primitive::Int16 => Value::Signed(signed(16)),
            Primitive::Int32 => Value::Signed(signed(32)),
            Primitive::Int64 => Value::Signed(signed(64)),
            #[expect(clippy::cast_possible_truncation, reason = "the number has 32 bits")]
            Primitive::Float32 => Value::Float(f32::from_bits(raw as u32).into()),
            Primitive::Float64 => Value::Float(f64::from_bits(raw)),
        })
    }

    /// Reads a number of up to eight octets, aligned to its size.
    fn raw(&mut self, width: usize) -> Result<u64, Fault> {
        let start = HEADER + (self.at - HEADER).next_multiple_of(width);
        self.take(start - self.at)?;
        let is_little = self.is_little;
        let octets = self.take(width)?;
        let mut number = [0; 8];
        number[..width].copy_from_slice(octets);
        if !is_little {
            number[..width].reverse();
        }
        Ok(u64::from_le_bytes(number))
    }

    /// Reads a text; one without its NUL, of length 0, is empty.
    fn text(&mut self, most: Option<usize>) -> Result<Value, Fault> {
        let length = self.length()?;
        let Some(end) = length.checked_sub(1) else {
            return Ok(Value::String(String::new()));
        };
        if most.is_some_and(|most| end > most) {
            return Err(self.fault(format!("the text has {end} octets, which are too many")));
        }
        let octets = self.take(length)?;
        let text = match octets.split_last() {
            Some((0, text)) if !text.contains(&0) => text,
            _ => return Err(self.fault("the text does not end with its only NUL")),
        };
        match std::str::from_utf8(text) {
            Ok(text) => Ok(Value::String(text.to_owned())),
            Err(_) => Err(self.fault("the text is not UTF-8")),
        }
    }

    fn length(&mut self) -> Result<usize, Fault> {
        let length = self.raw(4)?;
        usize::try_from(length).map_err(|error| self.fault(error.to_string()))
    }

    fn take(&mut self, count: usize) -> Result<&[u8], Fault> {
        let left = self.octets.len() - self.at;
        if count > left {
            return Err(self.fault(format!("{count} octets are needed, and {left} are left")));
        }
        let taken = &self.octets[self.at..self.at + count];
        self.at += count;
        Ok(taken)
    }
}
