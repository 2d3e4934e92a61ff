//! Converts values of the dynamic codec to the fields of ROS 2 messages.

use super::definitions::{Arity, Definition, Definitions, Element, Field, Source};
use super::value::Value;
use crate::dynamic::{self, EncodeProblem, Fault, Raw, Step, Steps, mismatch, slots, unfit};
use crate::model::Number;

type Converted<T = Value> = Result<T, Fault<EncodeProblem>>;

/// Converts values to fields of these types.
#[derive(Clone, Copy)]
pub(super) struct Conversion<'p> {
    definitions: &'p Definitions,
}

impl<'p> Conversion<'p> {
    pub(super) const fn new(definitions: &'p Definitions) -> Self {
        Self { definitions }
    }

    /// The fields of a type, from the value of the message or the part that it stands for.
    pub(super) fn message(self, place: usize, value: &dynamic::Value) -> Converted {
        let definition = self.definitions.get(place);
        let Some(Definition { fields, source, .. }) = definition else {
            return Err(mismatch("nothing", value));
        };
        let values = match (source, value) {
            (Source::Group, _) => {
                let slots = slots(value, fields.len() as u64)?.iter();
                self.slots(fields, slots.map(Option::as_ref))?
            }
            (Source::Sections, dynamic::Value::Group(slots)) => {
                self.slots(fields, slots.iter().flatten().map(Some))?
            }
            (Source::Whole, _) => {
                let values = fields.iter().map(|field| self.field(field, value));
                values.collect::<Converted<_>>()?
            }
            (Source::Variant, dynamic::Value::Variant { tag, value }) => {
                self.variant(fields, *tag, value.as_deref())?
            }
            (Source::Measure(indexes), dynamic::Value::Measure { index, number }) => {
                let chosen = indexes.iter().position(|it| it == index);
                let problem = EncodeProblem::Index { index: *index };
                let value = dynamic::Value::Number(*number);
                let chosen = chosen.ok_or(problem)?;
                self.choice(fields, (*index).into(), chosen, &value)?
            }
            (Source::Formatted, dynamic::Value::Formatted { format, octets }) => {
                vec![Value::Unsigned((*format).into()), sequence(octets)]
            }
            (Source::Bits(places), dynamic::Value::Bits(raw)) => {
                let places = places.iter().map(|place| place.of(*raw));
                let parts = fields.iter().zip(places);
                let parts = parts.map(|(field, bits)| match field.element {
                    Element::Bool => Value::Bool(bits != 0),
                    _ => Value::Unsigned(bits),
                });
                parts.collect()
            }
            (source, value) => return Err(mismatch(source.kind(), value)),
        };
        Ok(Value::Message(values))
    }

    /// A value for each field, from as many slots.
    fn slots<'v>(
        self,
        fields: &[Field],
        slots: impl Iterator<Item = Option<&'v dynamic::Value>>,
    ) -> Converted<Vec<Value>> {
        let values = fields.iter().zip(slots).map(|(field, slot)| {
            let value = match slot {
                Some(value) => self.field(field, value),
                None if field.arity == Arity::Optional => Ok(Value::Sequence(Vec::new())),
                None => Err(EncodeProblem::Missing.into()),
            };
            value.map_err(|fault| fault.member(&field.path))
        });
        values.collect()
    }

    fn variant(
        self,
        fields: &[Field],
        tag: u64,
        value: Option<&dynamic::Value>,
    ) -> Converted<Vec<Value>> {
        let alternatives = fields.len().saturating_sub(1);
        let chosen = usize::try_from(tag).ok();
        let chosen = chosen.and_then(|chosen| fields.get(1..)?.get(chosen).zip(Some(chosen)));
        match (chosen, value) {
            (Some((field, chosen)), Some(value)) => {
                let values = self.choice(fields, tag, chosen, value);
                values.map_err(|fault| fault.member(&field.path))
            }
            (None, None) if alternatives == 0 => Ok(vec![Value::Unsigned(tag)]),
            _ => Err(EncodeProblem::Tag { tag, alternatives }.into()),
        }
    }

    /// The selector, and the fields after it, of which one has the value.
    fn choice(
        self,
        fields: &[Field],
        selector: u64,
        chosen: usize,
        value: &dynamic::Value,
    ) -> Converted<Vec<Value>> {
        let mut values = vec![Value::Unsigned(selector)];
        for (place, field) in fields.iter().skip(1).enumerate() {
            values.push(if place == chosen {
                self.field(field, value)?
            } else {
                Value::Sequence(Vec::new())
            });
        }
        Ok(values)
    }

    fn field(self, field: &Field, value: &dynamic::Value) -> Converted {
        match (field.arity, value) {
            (Arity::One, value) => self.element(&field.element, value),
            (Arity::Optional, value) => {
                let value = self.element(&field.element, value)?;
                Ok(Value::Sequence(vec![value]))
            }
            (Arity::Many, dynamic::Value::List(values) | dynamic::Value::Array(values)) => {
                self.elements(&field.element, values)
            }
            (Arity::Exactly(expected), dynamic::Value::Array(values)) => {
                if values.len() as u64 != expected {
                    let found = values.len();
                    return Err(EncodeProblem::Slots { expected, found }.into());
                }
                self.elements(&field.element, values)
            }
            (_, value) => Err(mismatch("a list or an array", value)),
        }
    }

    fn elements(self, element: &Element, values: &[dynamic::Value]) -> Converted {
        let values = values.iter().enumerate().map(|(place, value)| {
            let value = self.element(element, value);
            value.map_err(|fault| fault.under(Step::Element(place)))
        });
        values.collect::<Converted<_>>().map(Value::Sequence)
    }

    fn element(self, element: &Element, value: &dynamic::Value) -> Converted {
        match (element, value) {
            (Element::Message(place), value) => self.message(*place, value),
            (Element::Number(kind), dynamic::Value::Number(raw)) => number(*kind, *raw),
            (Element::Scaled(kind, scale), dynamic::Value::Number(raw)) => {
                let shown = Steps::of(scale, *kind).and_then(|steps| steps.shown(*raw));
                shown.map(Value::Float).ok_or_else(|| unfit(*raw, *kind))
            }
            (Element::Text, dynamic::Value::Text(octets)) => Ok(Value::String(text(octets))),
            (Element::Octets, dynamic::Value::Blob(octets)) => Ok(sequence(octets)),
            (element, value) => Err(mismatch(element.kind(), value)),
        }
    }
}

fn number(kind: Number, raw: Raw) -> Converted {
    match (kind, raw) {
        (Number::Unsigned(_), Raw::Unsigned(raw)) => Ok(Value::Unsigned(raw)),
        (Number::Signed(_), Raw::Signed(raw)) => Ok(Value::Signed(raw)),
        (Number::F32, Raw::F32(raw)) => Ok(Value::Float(raw.into())),
        (Number::F64, Raw::F64(raw)) => Ok(Value::Float(raw)),
        (kind, raw) => Err(unfit(raw, kind)),
    }
}

/// `uint8[]`
fn sequence(octets: &[u8]) -> Value {
    Value::Sequence(octets.iter().map(|&octet| octet.into()).collect())
}

/// Strings of ROS 2 are UTF-8, and their readers stop at a zero.
fn text(octets: &[u8]) -> String {
    String::from_utf8_lossy(octets).replace('\0', "\u{FFFD}")
}
