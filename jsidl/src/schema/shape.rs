//! Schema of each language construct, following the table of the JSON view.

use serde_json::{Map, Value as Json, json};

use super::{describe, number, object};
use crate::model::{Array, Choice, Count, Group, Item, List, Shape, Unsigned, Variant};

/// The schema of a shape.
pub(super) fn of(shape: &Shape) -> Json {
    match shape {
        Shape::Group(definition) => group(definition),
        Shape::List(definition) => list(definition),
        Shape::Variant(definition) => variant(definition),
        Shape::Scalar(scalar) => number::scalar(scalar),
        Shape::Bits(bits) => number::bits(bits),
        Shape::FixedString { length } => text(0, u64::from(*length)),
        Shape::VariableString { count } => text(count.min, count.max),
        Shape::Blob { count, format } => {
            let mut schema = hex(Some(count));
            if !format.is_empty() {
                schema["x-format"] = format.clone().into();
            }
            schema
        }
        Shape::FormattedBlob { formats, count } => {
            let names = formats.iter().map(|f| format!("{} {}", f.index, f.name));
            let names: Vec<_> = names.collect();
            let mut format =
                json!({ "type": "integer", "minimum": 0, "maximum": Unsigned::U8.max() });
            describe(&mut format, &names.join(", "));
            let properties = [("format", format), ("data", hex(Some(count)))];
            closed(properties, &["format", "data"])
        }
        Shape::Measure { choices } => measure(choices),
        Shape::Array(array) => dimension(array, &array.dimensions),
    }
}

fn closed<const N: usize>(properties: [(&str, Json); N], required: &[&str]) -> Json {
    let properties = properties.map(|(key, schema)| (key.to_owned(), schema));
    object(Map::from_iter(properties), required)
}

/// Schema of an item with its author's text.
fn item(item: &Item) -> Json {
    let mut schema = of(&item.shape);
    describe(&mut schema, &item.interpretation);
    schema
}

fn group(group: &Group) -> Json {
    let mut properties = Map::new();
    let mut required = Vec::new();
    for member in &group.members {
        let mut schema = item(member);
        if member.optional {
            // An absent member may also be `null`.
            schema = json!({ "anyOf": [schema, { "type": "null" }] });
        } else {
            required.push(member.name.as_str());
        }
        properties.insert(member.name.clone(), schema);
    }
    object(properties, &required)
}

fn list(list: &List) -> Json {
    let mut schema = json!({ "type": "array", "items": item(&list.element) });
    limits(&mut schema, ["minItems", "maxItems"], &list.count, 1);
    schema
}

fn variant(variant: &Variant) -> Json {
    if variant.alternatives.is_empty() {
        return object(Map::new(), &[]);
    }
    let alternatives = variant.alternatives.iter();
    let alternatives: Vec<_> = alternatives
        .map(|one| closed([(&one.name, item(one))], &[&one.name]))
        .collect();
    json!({ "anyOf": alternatives })
}

/// Text, or octets that are not UTF-8. A character takes at least one octet, so octet limits are
/// loose upper bounds for characters.
fn text(min: u64, max: u64) -> Json {
    let mut schema = json!({ "type": "string", "maxLength": max });
    if min > 0 {
        schema["minLength"] = 1.into();
    }
    json!({ "anyOf": [schema, closed([("hex", hex(None))], &["hex"])] })
}

/// Pairs of hexadecimal digits.
fn hex(count: Option<&Count>) -> Json {
    let mut schema = json!({ "type": "string", "pattern": "^([0-9A-Fa-f]{2})*$" });
    if let Some(count) = count {
        limits(&mut schema, ["minLength", "maxLength"], count, 2);
    }
    schema
}

/// States the limits of a count that actually restrict it.
fn limits(schema: &mut Json, [least, greatest]: [&str; 2], count: &Count, each: u64) {
    if count.min > 0 {
        schema[least] = count.min.saturating_mul(each).into();
    }
    schema[greatest] = count.max.saturating_mul(each).into();
}

fn measure(choices: &[Choice]) -> Json {
    let choice = |choice: &Choice| {
        let units = json!({ "description": choice.scalar.units });
        let properties = [
            ("index", json!({ "const": choice.index })),
            ("units", units),
            ("value", number::scalar(&choice.scalar)),
        ];
        let mut schema = closed(properties, &["index", "value"]);
        if let Some(name) = &choice.name {
            schema["title"] = name.clone().into();
        }
        schema
    };
    let choices: Vec<_> = choices.iter().map(choice).collect();
    json!({ "anyOf": choices })
}

/// Arrays within arrays, the first dimension outermost.
fn dimension(array: &Array, left: &[u32]) -> Json {
    match left.split_first() {
        None => item(&array.element),
        Some((size, inner)) => json!({
            "type": "array",
            "items": dimension(array, inner),
            "minItems": size,
            "maxItems": size,
        }),
    }
}
