//! Converts JSON to a [`Value`].
//!
//! The definition determines what is expected at every position; errors state it.

use serde_json::{Map, Value as Json};

use super::hex::from_hex;
use super::{HEX, JsonError, JsonProblem, RESERVED, SECTIONS};
use crate::dynamic::error::{Fault, Step};
use crate::dynamic::scale::Steps;
use crate::dynamic::{Raw, Value};
use crate::model::{
    Array, BitField, Choice, Format, Group, Item, Meaning, Message, Number, Scalar, Scale, Shape,
    Signed, SubField, Unsigned, ValueSet, Variant,
};

/// Converts the JSON view of a message.
///
/// Members of groups may come in any order; optional ones may be absent or `null`. Counts are
/// checked by [`encode`](crate::dynamic::encode), not here.
///
/// # Errors
/// If the JSON does not fit the definition: the error names the field and the expectation.
pub fn from_json(message: &Message, json: &Json) -> Result<Value, JsonError> {
    let value = if message.header.is_none() && message.footer.is_none() {
        match &message.body {
            Some(body) => shape(&body.shape, json),
            None => object(json).and_then(|object| {
                known(object, |_| false, std::iter::empty)?;
                Ok(Value::Group(Vec::new()))
            }),
        }
    } else {
        sections(message, json)
    };
    value.map_err(|fault| fault.reading(&message.name))
}

type Read<T> = Result<T, Fault<JsonProblem>>;

fn sections(message: &Message, json: &Json) -> Read<Value> {
    let object = object(json)?;
    known(
        object,
        |key| SECTIONS.contains(&key),
        || SECTIONS.into_iter(),
    )?;
    let section = |(key, section): (&str, &Option<Item>)| match (section, object.get(key)) {
        (Some(item), Some(json)) => shape(&item.shape, json).map(Some),
        (Some(_), None) => Err(JsonProblem::Missing.into()),
        (None, Some(json)) => Err(expected("nothing", json)),
        (None, None) => Ok(None),
    };
    let sections = [&message.header, &message.body, &message.footer];
    let slots = SECTIONS.into_iter().zip(sections);
    slots
        .map(|(key, item)| section((key, item)).map_err(|fault| fault.member(key)))
        .collect::<Read<_>>()
        .map(Value::Group)
}

fn shape(shape: &Shape, json: &Json) -> Read<Value> {
    match shape {
        Shape::Group(definition) => group(definition, json),
        Shape::List(list) => {
            let elements = json.as_array().ok_or_else(|| expected("an array", json))?;
            elements
                .iter()
                .enumerate()
                .map(element(&list.element))
                .collect::<Read<_>>()
                .map(Value::List)
        }
        Shape::Variant(definition) => variant(definition, json),
        Shape::Scalar(scalar) => number(scalar, json).map(Value::Number),
        Shape::Bits(definition) => bits(definition, json).map(Value::Bits),
        Shape::FixedString { .. } => {
            let mut octets = text(json)?;
            let end = octets
                .iter()
                .rposition(|&octet| octet != 0)
                .map_or(0, |last| last + 1);
            octets.truncate(end);
            Ok(Value::Text(octets))
        }
        Shape::VariableString { .. } => text(json).map(Value::Text),
        Shape::Blob { .. } => hex(json).map(Value::Blob),
        Shape::FormattedBlob { formats, .. } => formatted(formats, json),
        Shape::Measure { choices } => measure(choices, json),
        Shape::Array(definition) => array(definition, json),
    }
}

fn element(item: &Item) -> impl Fn((usize, &Json)) -> Read<Value> {
    |(index, json)| shape(&item.shape, json).map_err(|fault| fault.under(Step::Element(index)))
}

fn group(group: &Group, json: &Json) -> Read<Value> {
    let object = object(json)?;
    let names = || group.members.iter().map(|member| member.name.as_str());
    known(object, |key| names().any(|name| name == key), names)?;
    let slot = |member: &Item| match object.get(&member.name) {
        None => absent(member),
        Some(Json::Null) if member.optional => Ok(None),
        Some(json) => shape(&member.shape, json).map(Some),
    };
    let slots = group.members.iter();
    slots
        .map(|member| slot(member).map_err(|fault| fault.member(&member.name)))
        .collect::<Read<_>>()
        .map(Value::Group)
}

fn absent(member: &Item) -> Read<Option<Value>> {
    if member.optional {
        Ok(None)
    } else {
        Err(JsonProblem::Missing.into())
    }
}

fn variant(variant: &Variant, json: &Json) -> Read<Value> {
    let object = object(json)?;
    let names = || variant.alternatives.iter().map(|item| item.name.as_str());
    known(object, |key| names().any(|name| name == key), names)?;
    let mut chosen = object.iter();
    match (chosen.next(), chosen.next()) {
        (Some((key, json)), None) => {
            let alternatives = variant.alternatives.iter().enumerate();
            let found = alternatives.into_iter().find(|(_, item)| item.name == *key);
            let (tag, item) = found.ok_or_else(|| expected("an alternative", json))?;
            let value = shape(&item.shape, json).map_err(|fault| fault.member(key))?;
            Ok(Value::Variant {
                tag: tag as u64,
                value: Some(Box::new(value)),
            })
        }
        (None, _) if variant.alternatives.is_empty() => Ok(Value::Variant {
            tag: 0,
            value: None,
        }),
        _ => Err(expected(
            format!("an object with one key out of {}", listed(names())),
            json,
        )),
    }
}

/// The scale of a scaled integer, and its steps.
fn scaled(scalar: &Scalar) -> Option<(&Scale, Steps)> {
    match &scalar.meaning {
        Meaning::Scaled(scale) => Some((scale, Steps::of(scale, scalar.number)?)),
        _ => None,
    }
}

fn number(scalar: &Scalar, json: &Json) -> Read<Raw> {
    if let Some((scale, steps)) = scaled(scalar) {
        let range = || {
            format!(
                "a number from {} to {} {}",
                scale.lower, scale.upper, scalar.units
            )
        };
        let value = json.as_f64().ok_or_else(|| expected(range(), json))?;
        let raw = steps.raw(value).ok_or_else(|| JsonProblem::OutOfRange {
            value,
            lower: scale.lower,
            upper: scale.upper,
            units: scalar.units.clone(),
        })?;
        return Ok(raw);
    }
    let values = match &scalar.meaning {
        Meaning::Values(values) => Some(values),
        _ => None,
    };
    let named = values.and_then(|values| named_value(values, json));
    match scalar.number {
        Number::Unsigned(width) => match named
            .and_then(|raw| u64::try_from(raw).ok())
            .or(json.as_u64())
        {
            Some(raw) if raw <= width.max() => Ok(Raw::Unsigned(raw)),
            _ => Err(expected(integer(0, width.max(), values), json)),
        },
        Number::Signed(width) => {
            let (least, greatest) = limits(width);
            match named
                .and_then(|raw| i64::try_from(raw).ok())
                .or(json.as_i64())
            {
                Some(raw) if (least..=greatest).contains(&raw) => Ok(Raw::Signed(raw)),
                _ => Err(expected(integer(least, greatest, values), json)),
            }
        }
        Number::F32 => {
            let value = named.map_or_else(|| real(json), |raw| Ok(raw as f64))?;
            let narrow = value as f32;
            if value.is_finite() && narrow.is_infinite() {
                return Err(expected("a number in the range of a float", json));
            }
            Ok(Raw::F32(narrow))
        }
        Number::F64 => named
            .map_or_else(|| real(json), |raw| Ok(raw as f64))
            .map(Raw::F64),
    }
}

fn real(json: &Json) -> Read<f64> {
    match json.as_str() {
        Some("NaN") => Ok(f64::NAN),
        Some("Infinity") => Ok(f64::INFINITY),
        Some("-Infinity") => Ok(f64::NEG_INFINITY),
        _ => json
            .as_f64()
            .ok_or_else(|| expected("a number, \"NaN\", \"Infinity\" or \"-Infinity\"", json)),
    }
}

fn limits(signed: Signed) -> (i64, i64) {
    match signed {
        Signed::I8 => (i8::MIN.into(), i8::MAX.into()),
        Signed::I16 => (i16::MIN.into(), i16::MAX.into()),
        Signed::I32 => (i32::MIN.into(), i32::MAX.into()),
        Signed::I64 => (i64::MIN, i64::MAX),
    }
}

/// The expectation for an integer.
fn integer(
    least: impl std::fmt::Display,
    greatest: impl std::fmt::Display,
    values: Option<&ValueSet>,
) -> String {
    let integer = format!("an integer from {least} to {greatest}");
    let named = values.map_or(&[][..], |values| &values.values);
    if named.is_empty() {
        return integer;
    }
    let names: Vec<_> = named
        .iter()
        .map(|value| format!("\"{}\"", value.name))
        .collect();
    format!("{integer} or one of {}", names.join(", "))
}

fn named_value(values: &ValueSet, json: &Json) -> Option<i128> {
    let text = json.as_str()?;
    values
        .values
        .iter()
        .find(|value| value.name == text)
        .map(|value| value.index)
}

fn bits(bits: &BitField, json: &Json) -> Read<u64> {
    let object = object(json)?;
    let names = || bits.fields.iter().map(|field| field.name.as_str());
    known(
        object,
        |key| key == RESERVED || names().any(|name| name == key),
        names,
    )?;
    let owned = bits
        .fields
        .iter()
        .fold(0, |owned, field| owned | field.mask());
    let mut raw = 0;
    if let Some(json) = object
        .get(RESERVED)
        .filter(|_| !names().any(|name| name == RESERVED))
    {
        let free = bits.base.max() & !owned;
        raw = json
            .as_u64()
            .filter(|raw| raw & !free == 0)
            .ok_or_else(|| {
                expected(format!("an integer with no bits but {free:#x}"), json).member(RESERVED)
            })?;
    }
    for field in &bits.fields {
        if let Some(json) = object.get(&field.name) {
            raw |= sub_field(field, json).map_err(|fault| fault.member(&field.name))?;
        }
    }
    Ok(raw)
}

/// The bits of a sub-field, in position.
fn sub_field(field: &SubField, json: &Json) -> Read<u64> {
    let greatest = field.mask().checked_shr(field.from.into()).unwrap_or(0);
    let named = named_value(&field.values, json).and_then(|it| u64::try_from(it).ok());
    let value = named.or(json.as_u64());
    match value.filter(|value| *value <= greatest) {
        Some(value) => Ok(value.checked_shl(field.from.into()).unwrap_or(0)),
        None => Err(expected(integer(0, greatest, Some(&field.values)), json)),
    }
}

fn text(json: &Json) -> Read<Vec<u8>> {
    match json {
        Json::String(text) => Ok(text.clone().into_bytes()),
        Json::Object(object) if object.len() == 1 && object.contains_key(HEX) => hex(&object[HEX]),
        _ => Err(expected("text or {\"hex\": …}", json)),
    }
}

fn hex(json: &Json) -> Read<Vec<u8>> {
    let octets = json.as_str().and_then(from_hex);
    octets.ok_or_else(|| expected("text of hexadecimal digits, two for each octet", json))
}

fn formatted(formats: &[Format], json: &Json) -> Read<Value> {
    let keys = ["format", "data"];
    let object = object(json)?;
    known(object, |key| keys.contains(&key), || keys.into_iter())?;
    let json = required(object, "format")?;
    let named = formats.iter().find(|it| json.as_str() == Some(&it.name));
    let format = match named {
        Some(format) => format.index,
        None => octet(json).map_err(|fault| fault.member("format"))?,
    };
    let octets = hex(required(object, "data")?).map_err(|fault| fault.member("data"))?;
    Ok(Value::Formatted { format, octets })
}

fn measure(choices: &[Choice], json: &Json) -> Read<Value> {
    let keys = ["index", "units", "value"];
    let object = object(json)?;
    known(object, |key| keys.contains(&key), || keys.into_iter())?;
    let json = required(object, "index")?;
    let index = octet(json).map_err(|fault| fault.member("index"))?;
    let choice = choices
        .iter()
        .find(|choice| choice.index == index)
        .ok_or_else(|| {
            let of = |choice: &Choice| format!("{} ({})", choice.index, choice.scalar.units);
            let known: Vec<_> = choices.iter().map(of).collect();
            expected(format!("one of {}", known.join(", ")), json).member("index")
        })?;
    let value = required(object, "value")?;
    let number = number(&choice.scalar, value).map_err(|fault| fault.member("value"))?;
    Ok(Value::Measure { index, number })
}

fn octet(json: &Json) -> Read<u8> {
    let octet = json.as_u64().and_then(|n| u8::try_from(n).ok());
    octet.ok_or_else(|| expected(integer(0, Unsigned::U8.max(), None), json))
}

fn array(array: &Array, json: &Json) -> Read<Value> {
    let mut elements = Vec::new();
    dimension(&array.element, &array.dimensions, json, &mut elements)?;
    let total = elements.len();
    let mut placed: Vec<_> = elements
        .into_iter()
        .enumerate()
        .map(|(position, value)| (wire_position(position, total, &array.dimensions), value))
        .collect();
    placed.sort_by_key(|&(position, _)| position);
    Ok(Value::Array(
        placed.into_iter().map(|(_, value)| value).collect(),
    ))
}

/// Wire position of an element (first dimension fastest), for its position in the text (last
/// dimension fastest).
fn wire_position(mut position: usize, total: usize, dimensions: &[u32]) -> usize {
    let mut stride = total;
    let mut on_the_wire = 0;
    for size in dimensions.iter().rev().map(|&size| size as usize) {
        stride /= size;
        on_the_wire += position % size * stride;
        position /= size;
    }
    on_the_wire
}

/// Collects the elements in text order: the last dimension fastest.
fn dimension(item: &Item, left: &[u32], json: &Json, elements: &mut Vec<Value>) -> Read<()> {
    let Some((&size, inner)) = left.split_first() else {
        elements.push(shape(&item.shape, json)?);
        return Ok(());
    };
    let array = json
        .as_array()
        .filter(|array| array.len() as u64 == u64::from(size));
    let array = array.ok_or_else(|| expected(format!("an array of {size}"), json))?;
    for (index, json) in array.iter().enumerate() {
        dimension(item, inner, json, elements)
            .map_err(|fault| fault.under(Step::Element(index)))?;
    }
    Ok(())
}

fn required<'a>(object: &'a Map<String, Json>, key: &str) -> Read<&'a Json> {
    object
        .get(key)
        .ok_or_else(|| Fault::from(JsonProblem::Missing).member(key))
}

fn object(json: &Json) -> Read<&Map<String, Json>> {
    json.as_object().ok_or_else(|| expected("an object", json))
}

/// Refuses unknown keys, and lists the known ones.
fn known<'a, I: Iterator<Item = &'a str>>(
    object: &Map<String, Json>,
    knows: impl Fn(&str) -> bool,
    names: impl Fn() -> I,
) -> Read<()> {
    match object.keys().find(|key| !knows(key)) {
        None => Ok(()),
        Some(key) => Err(JsonProblem::UnknownKey {
            key: key.clone(),
            known: listed(names()),
        }
        .into()),
    }
}

fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let listed = names.collect::<Vec<_>>().join(", ");
    if listed.is_empty() {
        "none".to_owned()
    } else {
        listed
    }
}

fn expected(what: impl Into<String>, json: &Json) -> Fault<JsonProblem> {
    JsonProblem::Expected {
        expected: what.into(),
        found: described(json),
    }
    .into()
}

/// The value, short enough for a sentence.
fn described(json: &Json) -> String {
    const LONGEST: usize = 40;
    match json {
        Json::Array(elements) => format!("an array of {}", elements.len()),
        Json::Object(members) if members.is_empty() => "an empty object".to_owned(),
        Json::Object(_) => "an object".to_owned(),
        Json::String(text) if text.chars().count() > LONGEST => {
            format!("\"{}…\"", text.chars().take(LONGEST).collect::<String>())
        }
        other => other.to_string(),
    }
}
