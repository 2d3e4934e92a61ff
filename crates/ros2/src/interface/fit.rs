//! The values that a type has: which ones fit, and those of a new message.

use std::sync::Arc;

use super::{Field, Interface, Kind, Primitive, Size};
use crate::Value;

/// The range of an integer type.
fn range(primitive: Primitive) -> Option<(i128, i128)> {
    let unsigned = |bits: u32| (0, (1_i128 << bits) - 1);
    let signed = |bits: u32| (-(1_i128 << (bits - 1)), (1_i128 << (bits - 1)) - 1);
    Some(match primitive {
        Primitive::Byte | Primitive::Uint8 => unsigned(8),
        Primitive::Uint16 => unsigned(16),
        Primitive::Uint32 => unsigned(32),
        Primitive::Uint64 => unsigned(64),
        Primitive::Int8 => signed(8),
        Primitive::Int16 => signed(16),
        Primitive::Int32 => signed(32),
        Primitive::Int64 => signed(64),
        Primitive::Bool | Primitive::Float32 | Primitive::Float64 => return None,
    })
}

/// The value as it is stored for this type: each type has one variant, and a `float32` is rounded. A
/// nested message is taken as it is.
///
/// # Errors
/// The reason why the value does not fit.
pub(crate) fn fit<N>(value: Value, kind: &Kind<N>) -> Result<Value, String> {
    match (kind, value) {
        (Kind::Primitive(primitive), value) => fit_primitive(value, *primitive),
        (Kind::String { most }, Value::String(text)) => fit_text(text, *most),
        (Kind::Message(_), Value::Message(fields)) => Ok(Value::Message(fields)),
        (Kind::String { .. }, value) => Err(format!("{} is not a text", value.kind())),
        (Kind::Message(_), value) => Err(format!("{} is not a message", value.kind())),
    }
}

fn fit_text(text: String, most: Option<usize>) -> Result<Value, String> {
    if text.contains('\0') {
        return Err("a text of ROS cannot contain NUL".to_owned());
    }
    match most {
        Some(most) if text.len() > most => Err(format!(
            "the text has {} octets, and at most {most} are allowed",
            text.len()
        )),
        _ => Ok(Value::String(text)),
    }
}

fn fit_primitive(value: Value, primitive: Primitive) -> Result<Value, String> {
    let Some((least, greatest)) = range(primitive) else {
        return match (primitive, &value) {
            (Primitive::Bool, Value::Bool(_)) => Ok(value),
            (Primitive::Bool, _) => Err(format!("{} is not a truth value", value.kind())),
            _ => match value.as_float() {
                Some(number) if primitive == Primitive::Float32 => {
                    Ok(Value::Float(rounded(number)))
                }
                Some(number) => Ok(Value::Float(number)),
                None => Err(format!("{} is not a number", value.kind())),
            },
        };
    };
    let number = match value {
        Value::Unsigned(number) => i128::from(number),
        Value::Signed(number) => i128::from(number),
        other => return Err(format!("{} is not an integer", other.kind())),
    };
    if !(least..=greatest).contains(&number) {
        return Err(format!("{number} is not from {least} to {greatest}"));
    }
    let fitted = match least {
        0 => u64::try_from(number).map(Value::Unsigned),
        _ => i64::try_from(number).map(Value::Signed),
    };
    fitted.map_err(|error| error.to_string())
}

/// The nearest `float32`.
#[expect(clippy::cast_possible_truncation, reason = "rounding is meant")]
fn rounded(number: f64) -> f64 {
    f64::from(number as f32)
}

/// The value of a field in a new message.
pub(crate) fn default_of(field: &Field) -> Value {
    if let Some(default) = &field.default {
        return default.clone();
    }
    match field.size {
        Size::One => zero_of(&field.kind),
        Size::Fixed(count) => Value::Sequence(vec![zero_of(&field.kind); count]),
        Size::AtMost(_) | Size::Any => Value::Sequence(Vec::new()),
    }
}

/// A new value of a type: zero, an empty text, or a new message.
pub(crate) fn zero_of(kind: &Kind) -> Value {
    match kind {
        Kind::Primitive(primitive) => match primitive {
            Primitive::Bool => Value::Bool(false),
            Primitive::Float32 | Primitive::Float64 => Value::Float(0.0),
            Primitive::Byte
            | Primitive::Uint8
            | Primitive::Uint16
            | Primitive::Uint32
            | Primitive::Uint64 => Value::Unsigned(0),
            Primitive::Int8 | Primitive::Int16 | Primitive::Int32 | Primitive::Int64 => {
                Value::Signed(0)
            }
        },
        Kind::String { .. } => Value::String(String::new()),
        Kind::Message(nested) => Value::Message(defaults(nested)),
    }
}

/// The values of a new message.
pub(crate) fn defaults(interface: &Arc<Interface>) -> Vec<Value> {
    interface.fields.iter().map(default_of).collect()
}
