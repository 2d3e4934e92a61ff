//! Writes messages, in little endian.

use super::{HEADER, LITTLE_ENDIAN, width};
use crate::Value;
use crate::interface::{Field, Interface, Kind, Primitive, Size};
use crate::message::Message;

/// Encodes a message, with its header.
#[must_use]
pub fn encode(message: &Message) -> Vec<u8> {
    let mut octets = vec![0, LITTLE_ENDIAN, 0, 0];
    write_message(&mut octets, message.interface(), message.fields());
    octets
}

fn write_message(octets: &mut Vec<u8>, interface: &Interface, values: &[Value]) {
    if interface.fields().is_empty() {
        // The member that ROS adds to a message without fields.
        octets.push(0);
    }
    for (field, value) in interface.fields().iter().zip(values) {
        write_field(octets, field, value);
    }
}

fn write_field(octets: &mut Vec<u8>, field: &Field, value: &Value) {
    let elements = match value {
        Value::Sequence(elements) => elements,
        one => return write_one(octets, &field.kind, one),
    };
    if !matches!(field.size, Size::Fixed(_)) {
        write_length(octets, elements.len());
    }
    for element in elements {
        write_one(octets, &field.kind, element);
    }
}

fn write_one(octets: &mut Vec<u8>, kind: &Kind, value: &Value) {
    match (kind, value) {
        (Kind::Message(nested), Value::Message(values)) => write_message(octets, nested, values),
        (Kind::Primitive(primitive), value) => write_number(octets, *primitive, value),
        (_, Value::String(text)) => {
            write_length(octets, text.len() + 1);
            octets.extend_from_slice(text.as_bytes());
            octets.push(0);
        }
        // A `Message` has no value of another type than its field's.
        _ => {}
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "a float32 is stored as one"
)]
fn write_number(octets: &mut Vec<u8>, primitive: Primitive, value: &Value) {
    let number = match value {
        Value::Bool(value) => u64::from(*value).to_le_bytes(),
        Value::Unsigned(value) => value.to_le_bytes(),
        Value::Signed(value) => value.to_le_bytes(),
        Value::Float(value) if primitive == Primitive::Float32 => {
            u64::from((*value as f32).to_bits()).to_le_bytes()
        }
        Value::Float(value) => value.to_le_bytes(),
        Value::String(_) | Value::Sequence(_) | Value::Message(_) => [0; 8],
    };
    let width = width(primitive);
    align(octets, width);
    octets.extend_from_slice(&number[..width]);
}

/// Writes the length of a sequence or a text. No message in memory has 2³² values.
fn write_length(octets: &mut Vec<u8>, length: usize) {
    align(octets, 4);
    let length = u32::try_from(length).unwrap_or(u32::MAX);
    octets.extend_from_slice(&length.to_le_bytes());
}

fn align(octets: &mut Vec<u8>, width: usize) {
    let end = HEADER + (octets.len() - HEADER).next_multiple_of(width);
    octets.resize(end, 0);
}
