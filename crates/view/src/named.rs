//! JSON for people and programs: enumerated values by name, and numbers with units.

use jaus::codec::view::Value;
use jsidl::dynamic::{Leaf, for_each_number};
use jsidl::model::{Meaning, Message, ValueSet};
use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::{Map, Value as Json};

use super::definition::{ServiceName, parse_version};
use super::dictionary::Dictionary;
use super::words::symbol;

/// A view whose enumerated values are written by name, if they have one.
pub(super) struct ByName<'v>(pub(super) &'v Value);

impl Serialize for ByName<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Value::Named(_, name) => serializer.serialize_str(name),
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
        if let Some(name) = number.as_u64().and_then(|it| name(values, it)) {
            *number = name.into();
        }
    });
}

/// The name of a value, unless the name also stands for an earlier value.
fn name(values: &ValueSet, number: u64) -> Option<&str> {
    let values = || values.values.iter();
    let name = &*values().find(|it| it.index == number)?.name;
    let first = values().find(|it| it.name == name)?;
    (first.index == number).then_some(name)
}

impl Dictionary {
    /// Adds units to the body of an object with a message, if its definition is in the library.
    pub(super) fn add_units(&self, object: &mut Map<String, Json>) {
        if let Some(model) = self.model_of(object)
            && let Some(body) = object.get_mut("body")
        {
            add_units(model, body);
        }
    }

    /// The definition of the message in an object as a [`Line`](super::Line) serializes.
    fn model_of(&self, object: &Map<String, Json>) -> Option<&Message> {
        let text = |key: &str| object.get(key)?.as_str();
        let code = u16::from_str_radix(text("code")?, 16).ok()?;
        let service = ServiceName {
            urn: text("service")?.to_owned(),
            version: text("version").and_then(|it| parse_version(it).ok()),
        };
        let name = text("message")?;
        let mut fitting = self.candidates(code);
        let definition = fitting.find(|it| it.name() == name && it.belongs_to(&service))?;
        self.model(definition)
    }
}

/// Adds the symbols of their units to the numbers of a view, which become texts.
fn add_units(message: &Message, view: &mut Json) {
    for_each_number(message, view, &mut |leaf, number| {
        if let Leaf::Scalar(scalar) = leaf
            && number.is_number()
            && !["", "one"].contains(&&*scalar.units)
        {
            *number = format!("{number} {}", symbol(&scalar.units)).into();
        }
    });
}
