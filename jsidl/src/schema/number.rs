//! Schemas of numbers: range, named values and units.

use serde_json::{Map, Value as Json, json};

use super::{describe, object};
use crate::model::{BitField, Meaning, Number, Scalar, SubField, ValueSet};

/// The key of the bits that no sub-field owns.
const RESERVED: &str = "_reserved";

/// A `fixed_field`, or the value of a `variable_field`.
pub(super) fn scalar(scalar: &Scalar) -> Json {
    let mut schema = match (&scalar.meaning, scalar.number) {
        (Meaning::Scaled(scale), _) => {
            json!({ "type": "number", "minimum": scale.lower, "maximum": scale.upper })
        }
        (Meaning::Values(values), number) => named(plain(number), values),
        (_, number) => plain(number),
    };
    if !scalar.units.is_empty() && scalar.units != "one" {
        schema["x-units"] = scalar.units.clone().into();
    }
    schema
}

fn plain(number: Number) -> Json {
    match number {
        Number::Unsigned(width) => integer(width.max()),
        Number::Signed(_) => {
            let (least, greatest) = number.integers().unwrap_or((0, 0));
            // The limits fit: no signed number has more than 64 bits.
            json!({ "type": "integer", "minimum": least as i64, "maximum": greatest as i64 })
        }
        Number::F32 | Number::F64 => {
            json!({ "anyOf": [{ "type": "number" }, { "enum": ["NaN", "Infinity", "-Infinity"] }] })
        }
    }
}

fn integer(greatest: u64) -> Json {
    json!({ "type": "integer", "minimum": 0, "maximum": greatest })
}

/// A number or the name of a value. Unnamed numbers occur and are preserved.
fn named(number: Json, values: &ValueSet) -> Json {
    if values.values.is_empty() {
        return number;
    }
    let mut names: Vec<&str> = values.values.iter().map(|value| &*value.name).collect();
    names.sort_unstable();
    names.dedup();
    let listed = values.values.iter();
    let listed: Vec<_> = listed.map(|v| format!("{} {}", v.index, v.name)).collect();
    let mut schema = json!({ "anyOf": [number, { "enum": names }] });
    schema["x-values"] = listed.into();
    if !values.ranges.is_empty() {
        let ranges = values.ranges.iter().map(ToString::to_string);
        schema["x-ranges"] = ranges.collect::<Vec<_>>().into();
    }
    schema
}

/// A `bit_field`: an object of its sub-fields, each 0 if omitted.
pub(super) fn bits(bits: &BitField) -> Json {
    let mut properties = Map::new();
    let mut owned = 0;
    for field in &bits.fields {
        owned |= field.mask();
        properties.insert(field.name.clone(), sub_field(field));
    }
    let free = bits.base.max() & !owned;
    if free != 0 && !properties.contains_key(RESERVED) {
        let mut schema = integer(free);
        describe(&mut schema, "Bits that no sub-field owns, in place.");
        properties.insert(RESERVED.to_owned(), schema);
    }
    object(properties, &[])
}

fn sub_field(field: &SubField) -> Json {
    let greatest = field.mask().checked_shr(field.from.into()).unwrap_or(0);
    let mut schema = named(integer(greatest), &field.values);
    describe(&mut schema, &field.interpretation);
    schema
}
