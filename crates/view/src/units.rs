//! JSON for people: numbers with units.

use jsidl::dynamic::{Leaf, for_each_number};
use jsidl::model::Message;
use serde_json::{Map, Value as Json};

use super::definition::{ServiceName, parse_version};
use super::dictionary::Dictionary;
use super::words::symbol;

impl Dictionary {
    /// Adds units to the body of an object with a message, if its definition is in the library.
    pub(super) fn add_units(&self, object: &mut Map<String, Json>) {
        if let Some(model) = self.model_of(object)
            && let Some(body) = object.get_mut("body")
        {
            add_units(model, body);
        }
    }

    /// The definition of the message in an object as a [`Line`](super::Line) serializes; `None` if
    /// the library has none, or the object names no message.
    pub fn model_of(&self, object: &Map<String, Json>) -> Option<&Message> {
        let text = |key: &str| object.get(key)?.as_str();
        let code = u16::from_str_radix(text("code")?, 16).ok()?;
        let service = ServiceName {
            urn: text("service")?.to_owned(),
            version: text("version").and_then(|it| parse_version(it).ok()),
        };
        let name = text("message")?;
        let mut fitting = self.candidates(code).chain(self.of_ra(code));
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
