//! Converts a [`Value`] to JSON.

use serde_json::{Map, Value as Json, json};

use super::hex::to_hex;
use super::{HEX, RESERVED, SECTIONS};
use crate::dynamic::encode::{mismatch, missing, slots, unfit};
use crate::dynamic::error::{EncodeError, EncodeProblem, Fault, Step};
use crate::dynamic::scale::Steps;
use crate::dynamic::{Raw, Value};
use crate::model::{
    Array, BitField, Group, Item, Meaning, Message, Number, Scalar, Shape, Variant,
};

/// The JSON view of a message's value; see the table at the head of this module's documentation.
///
/// # Errors
/// If the value does not fit the definition. Values from [`decode`](crate::dynamic::decode) always
/// fit, unless two members of one group share a name.
pub fn to_json(message: &Message, value: &Value) -> Result<Json, EncodeError> {
    let view = if message.header.is_none() && message.footer.is_none() {
        match &message.body {
            Some(body) => shape(&body.shape, value),
            None => slots(value, 0).map(|_| json!({})),
        }
    } else {
        sections(message, value)
    };
    view.map_err(|fault| fault.encoding(&message.name))
}

type View = Result<Json, Fault<EncodeProblem>>;

fn sections(message: &Message, value: &Value) -> View {
    let sections = [&message.header, &message.body, &message.footer];
    let slots = slots(value, sections.len() as u64)?;
    let mut object = Map::new();
    for ((key, section), slot) in SECTIONS.into_iter().zip(sections).zip(slots) {
        match (section, slot) {
            (Some(item), Some(value)) => {
                let view = shape(&item.shape, value).map_err(|fault| fault.member(key))?;
                object.insert(key.to_owned(), view);
            }
            (Some(item), None) => return Err(missing(item)),
            (None, Some(value)) => return Err(mismatch("nothing", value)),
            (None, None) => {}
        }
    }
    Ok(Json::Object(object))
}

fn shape(shape: &Shape, value: &Value) -> View {
    match (shape, value) {
        (Shape::Group(definition), Value::Group(_)) => group(definition, value),
        (Shape::List(list), Value::List(values)) => {
            let views = values
                .iter()
                .enumerate()
                .map(|(at, value)| element(&list.element, at, value));
            views.collect::<Result<_, _>>().map(Json::Array)
        }
        (Shape::Variant(definition), Value::Variant { tag, value }) => {
            variant(definition, *tag, value.as_deref())
        }
        (Shape::Scalar(scalar), Value::Number(raw)) => number(scalar, *raw),
        (Shape::Bits(definition), Value::Bits(raw)) => bits(definition, *raw),
        (Shape::FixedString { .. } | Shape::VariableString { .. }, Value::Text(octets)) => {
            Ok(text(octets))
        }
        (Shape::Blob { .. }, Value::Blob(octets)) => Ok(to_hex(octets).into()),
        (Shape::FormattedBlob { .. }, Value::Formatted { format, octets }) => {
            Ok(json!({ "format": format, "data": to_hex(octets) }))
        }
        (Shape::Measure { choices }, Value::Measure { index, number: raw }) => {
            let choice = choices.iter().find(|choice| choice.index == *index);
            let scalar = &choice.ok_or(EncodeProblem::Index { index: *index })?.scalar;
            let value = number(scalar, *raw)?;
            Ok(json!({ "index": index, "units": scalar.units, "value": value }))
        }
        (Shape::Array(definition), Value::Array(values)) => array(definition, values),
        (shape, value) => Err(mismatch(shape.kind(), value)),
    }
}

fn group(group: &Group, value: &Value) -> View {
    let slots = slots(value, group.members.len() as u64)?;
    let mut object = Map::new();
    for (member, slot) in group.members.iter().zip(slots) {
        let Some(value) = slot else {
            if member.optional {
                continue;
            }
            return Err(missing(member));
        };
        let view = shape(&member.shape, value).map_err(|fault| fault.member(&member.name))?;
        if object.insert(member.name.clone(), view).is_some() {
            return Err(Fault::from(EncodeProblem::SameName).member(&member.name));
        }
    }
    Ok(Json::Object(object))
}

fn element(item: &Item, index: usize, value: &Value) -> View {
    shape(&item.shape, value).map_err(|fault| fault.under(Step::Element(index)))
}

fn variant(variant: &Variant, tag: u64, value: Option<&Value>) -> View {
    let alternatives = variant.alternatives.len();
    let chosen = usize::try_from(tag)
        .ok()
        .and_then(|tag| variant.alternatives.get(tag));
    match (chosen, value) {
        (Some(item), Some(value)) => {
            let view = shape(&item.shape, value).map_err(|fault| fault.member(&item.name))?;
            Ok(Json::Object(Map::from_iter([(item.name.clone(), view)])))
        }
        (None, None) if alternatives == 0 => Ok(json!({})),
        _ => Err(EncodeProblem::Tag { tag, alternatives }.into()),
    }
}

fn number(scalar: &Scalar, raw: Raw) -> View {
    if let Meaning::Scaled(scale) = &scalar.meaning {
        let shown = Steps::of(scale, scalar.number).and_then(|steps| steps.shown(raw));
        return shown.map(real).ok_or_else(|| unfit(raw, scalar.number));
    }
    Ok(match (&scalar.meaning, scalar.number, raw) {
        (_, Number::Unsigned(_), Raw::Unsigned(raw)) => raw.into(),
        (_, Number::Signed(_), Raw::Signed(raw)) => raw.into(),
        (_, Number::F32, Raw::F32(raw)) => real(widened(raw)),
        (_, Number::F64, Raw::F64(raw)) => real(raw),
        (_, number, raw) => return Err(unfit(raw, number)),
    })
}

/// JSON has no representation of infinite numbers and NaN.
fn real(number: f64) -> Json {
    match number {
        n if n.is_nan() => "NaN".into(),
        f64::INFINITY => "Infinity".into(),
        f64::NEG_INFINITY => "-Infinity".into(),
        n => n.into(),
    }
}

/// The `f64` whose shortest decimal is that of the `f32`: 0.1, not 0.10000000149011612.
fn widened(number: f32) -> f64 {
    let decimal = number.to_string().parse().unwrap_or(f64::from(number));
    if decimal as f32 == number {
        decimal
    } else {
        f64::from(number)
    }
}

fn bits(bits: &BitField, raw: u64) -> View {
    let mut object = Map::new();
    let mut reserved = raw;
    for field in &bits.fields {
        let value = (raw & field.mask())
            .checked_shr(field.from.into())
            .unwrap_or(0);
        reserved &= !field.mask();
        if object.insert(field.name.clone(), value.into()).is_some() {
            return Err(Fault::from(EncodeProblem::SameName).member(&field.name));
        }
    }
    if reserved != 0 {
        object.insert(RESERVED.to_owned(), reserved.into());
    }
    Ok(Json::Object(object))
}

fn text(octets: &[u8]) -> Json {
    match std::str::from_utf8(octets) {
        Ok(text) => text.into(),
        Err(_) => json!({ HEX: to_hex(octets) }),
    }
}

fn array(array: &Array, values: &[Value]) -> View {
    let (expected, found) = (array.elements(), values.len());
    if expected != found as u64 {
        return Err(EncodeProblem::Slots { expected, found }.into());
    }
    dimension(&array.element, &array.dimensions, 1, 0, values)
}

/// The elements from `first` along the outermost remaining dimension, `stride` apart.
fn dimension(item: &Item, left: &[u32], stride: usize, first: usize, values: &[Value]) -> View {
    let Some((&size, inner)) = left.split_first() else {
        return shape(&item.shape, &values[first]);
    };
    let size = size as usize;
    let view = |index| {
        dimension(item, inner, stride * size, first + index * stride, values)
            .map_err(|fault| fault.under(Step::Element(index)))
    };
    (0..size)
        .map(view)
        .collect::<Result<_, _>>()
        .map(Json::Array)
}
