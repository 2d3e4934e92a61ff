//! JSON with enumerated values by name.

use jaus::codec::view::Value;
use jsidl::dynamic::{Leaf, for_each_number};
use jsidl::model::{Meaning, Message, ValueSet};
use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::Value as Json;

/// A view whose enumerated values are written by name, if they have one.
pub(super) struct ByName<'v>(pub(super) &'v Value);

impl Serialize for ByName<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Value::Named(_, name) | Value::SignedNamed(_, name) => serializer.serialize_str(name),
            Value::List(values) => serializer.collect_seq(values.iter().map(ByName)),
            Value::Object(members) => {
                let mut map = serializer.serialize_map(Some(members.len()))?;
                for (name, value) in members {
                    map.serialize_entry(name.as_ref(), &ByName(value))?;
                }
                map.end()
            }
            other => other.serialize(serializer),
        }
    }
}

/// Replaces the enumerated values of a view by their names.
pub(super) fn name_values(message: &Message, view: &mut Json) {
    for_each_number(message, view, &mut |leaf, number| {
        let values = match leaf {
            Leaf::Scalar(scalar) => match &scalar.meaning {
                Meaning::Values(values) => values,
                _ => return,
            },
            Leaf::SubField(field) => &field.values,
            _ => return,
        };
        let raw = number.as_u64().map(i128::from);
        let raw = raw.or_else(|| number.as_i64().map(i128::from));
        if let Some(name) = raw.and_then(|it| name(values, it)) {
            *number = name.into();
        }
    });
}

/// The name of a value, unless the name also stands for an earlier value.
fn name(values: &ValueSet, number: i128) -> Option<&str> {
    let values = || values.values.iter();
    let name = &*values().find(|it| it.index == number)?.name;
    let first = values().find(|it| it.name == name)?;
    (first.index == number).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_written_by_name_also_below_0() {
        let members = [
            ("Gear".into(), Value::SignedNamed(-2, "Reverse")),
            ("Range".into(), Value::Named(3, "Low")),
            ("Speed".into(), Value::Signed(-4)),
        ];
        let view = Value::Object(members.into());
        let written = serde_json::to_value(ByName(&view)).unwrap();
        let wanted = serde_json::json!({ "Gear": "Reverse", "Range": "Low", "Speed": -4 });
        assert_eq!(written, wanted);
    }
}
