//! Writes layouts as Lua tables for `runtime/read.lua`.
//!
//! Every table begins with the kind of shape and the number of its field; each method documents the
//! further entries.

use super::fields::{Fields, Kind, within};
use super::text;
use crate::model::{
    Array, BitField, Choice, Count, Format, Group, Item, List, Meaning, Message, Number, Rounding,
    Scalar, Shape, Signed, Unsigned, Variant, is_message_format,
};

/// The header, body and footer that exist.
pub(super) fn sections(message: &Message, prefix: &str, fields: &mut Fields) -> String {
    let mut emitter = Emitter { prefix, fields };
    let sections = [&message.header, &message.body, &message.footer];
    let sections: Vec<_> = sections
        .into_iter()
        .flatten()
        .map(|item| emitter.item(item))
        .collect();
    sections.join(",")
}

struct Emitter<'a> {
    prefix: &'a str,
    fields: &'a mut Fields,
}

impl Emitter<'_> {
    fn item(&mut self, item: &Item) -> String {
        let shape = self.shape(item);
        if item.optional {
            format!("{{\"optional\",{shape}}}")
        } else {
            shape
        }
    }

    fn items(&mut self, items: &[Item]) -> String {
        let items: Vec<_> = items.iter().map(|item| self.item(item)).collect();
        items.join(",")
    }

    fn shape(&mut self, item: &Item) -> String {
        let name = &item.name;
        match &item.shape {
            Shape::Group(group) => self.group(name, group),
            Shape::List(list) => self.list(name, list),
            Shape::Variant(variant) => self.variant(name, variant),
            Shape::Scalar(scalar) => {
                let field = self.scalar_field(name, scalar);
                number(&field.to_string(), scalar)
            }
            Shape::Bits(bits) => self.bits(name, bits),
            Shape::FixedString { length } => {
                let field = self.field(name, Kind::Text, None);
                format!("{{\"fixed string\",{field},{length}}}")
            }
            Shape::VariableString { count } => {
                let field = self.field(name, Kind::Text, None);
                let (size, limits) = (count.unsigned.size(), limits(count));
                format!("{{\"string\",{field},{size}{limits}}}")
            }
            Shape::Blob { count, format } => {
                let field = self.field(name, Kind::Octets, None);
                let (size, message) = (count.unsigned.size(), is_message_format(format));
                // Field, size and limits of the count, whether the content is a message.
                let (min, max) = limits_or_nil(count);
                format!("{{\"blob\",{field},{size},{min},{max},{message}}}")
            }
            Shape::FormattedBlob { formats, count } => self.formatted(name, formats, count),
            Shape::Measure { choices } => self.measure(name, choices),
            Shape::Array(array) => self.array(name, array),
        }
    }

    /// Presence vector's size or `nil`, members.
    fn group(&mut self, name: &str, group: &Group) -> String {
        let field = self.field(name, Kind::None, None);
        let presence = group
            .presence
            .map_or_else(|| "nil".to_owned(), |width| width.size().to_string());
        let members = self.items(&group.members);
        format!("{{\"group\",{field},{presence},{{{members}}}}}")
    }

    /// The count's size, element, limits.
    fn list(&mut self, name: &str, list: &List) -> String {
        let field = self.field(name, Kind::Uint, None);
        let element = self.item(&list.element);
        let (size, limits) = (list.count.unsigned.size(), limits(&list.count));
        format!("{{\"list\",{field},{size},{element}{limits}}}")
    }

    /// The tag's size, alternatives.
    fn variant(&mut self, name: &str, variant: &Variant) -> String {
        let alternatives = variant.alternatives.iter().map(|item| item.name.as_str());
        let names = self.fields.names_of((0..).zip(alternatives));
        let field = self.field(name, Kind::Uint, names);
        let (size, alternatives) = (variant.tag.size(), self.items(&variant.alternatives));
        format!("{{\"variant\",{field},{size},{{{alternatives}}}}}")
    }

    /// The size, then field, lowest and highest bit of every part.
    fn bits(&mut self, name: &str, bits: &BitField) -> String {
        let field = self.field(name, bits.base.into(), None);
        let parts = bits.fields.iter().map(|part| {
            let wide = part.to.saturating_sub(part.from) >= 32;
            let kind = if wide { Kind::Uint64 } else { Kind::Uint };
            let names = self.fields.names(kind, &part.values.values);
            let field = self.field(&part.name, kind, names);
            format!("{{{field},{},{}}}", part.from, part.to)
        });
        let parts: Vec<_> = parts.collect();
        let size = bits.base.size();
        format!("{{\"bits\",{field},{size},{{{}}}}}", parts.join(","))
    }

    /// The count's size, the field of the format, which formats are messages, the count's limits.
    fn formatted(&mut self, name: &str, formats: &[Format], count: &Count) -> String {
        let field = self.field(name, Kind::Octets, None);
        let named = formats.iter().map(|f| (f.index.into(), &*f.name));
        let names = self.fields.names_of(named);
        let format = self.field(&format!("{name}_format"), Kind::Uint, names);
        let messages = formats
            .iter()
            .filter(|format| is_message_format(&format.name));
        let messages: Vec<_> = messages
            .map(|format| format!("[{}]=true", format.index))
            .collect();
        let (size, messages, limits) = (count.unsigned.size(), messages.join(","), limits(count));
        format!("{{\"formatted\",{field},{size},{format},{{{messages}}}{limits}}}")
    }

    /// The field of the index, then the value's shape for every index.
    fn measure(&mut self, name: &str, choices: &[Choice]) -> String {
        let field = self.field(name, Kind::Real, None);
        let named = choices.iter().map(|choice| {
            let name = choice.name.as_ref().unwrap_or(&choice.scalar.units);
            (choice.index.into(), name.as_str())
        });
        let names = self.fields.names_of(named);
        let index = self.field(&format!("{name}_index"), Kind::Uint, names);
        let choices = choices
            .iter()
            .map(|choice| format!("[{}]={}", choice.index, number("false", &choice.scalar)));
        let choices: Vec<_> = choices.collect();
        format!("{{\"measure\",{field},{index},{{{}}}}}", choices.join(","))
    }

    /// The total number of elements, then the element.
    fn array(&mut self, name: &str, array: &Array) -> String {
        let field = self.field(name, Kind::None, None);
        let element = self.item(&array.element);
        let sizes = array.dimensions.iter().map(|&size| u64::from(size));
        let elements = sizes.fold(1, u64::saturating_mul);
        format!("{{\"array\",{field},{elements},{element}}}")
    }

    fn scalar_field(&mut self, name: &str, scalar: &Scalar) -> usize {
        match &scalar.meaning {
            Meaning::Scaled(_) => self.field(name, Kind::Real, None),
            Meaning::Plain => self.field(name, scalar.number.into(), None),
            Meaning::Values(set) => {
                let kind = scalar.number.into();
                let names = match kind {
                    Kind::Real => None,
                    _ => self.fields.names(kind, &set.values),
                };
                self.field(name, kind, names)
            }
        }
    }

    fn field(&mut self, name: &str, kind: Kind, values: Option<usize>) -> usize {
        let filter = within(self.prefix, name);
        self.fields.field(filter, name, kind, values)
    }
}

/// A number: its type, and its units unless it has none. Scaled: size, limits, units, rounding.
fn number(field: &str, scalar: &Scalar) -> String {
    let units = match scalar.units.as_str() {
        "one" | "" => "nil".to_owned(),
        units => text::quoted(units),
    };
    match (&scalar.meaning, scalar.number) {
        (Meaning::Scaled(scale), kind) => {
            let (kind, lower, upper) = (type_of(kind), scale.lower, scale.upper);
            let rounding = match scale.rounding {
                Rounding::Round => "",
                Rounding::Floor => ",\"floor\"",
                Rounding::Ceiling => ",\"ceiling\"",
            };
            format!("{{\"scaled\",{field},\"{kind}\",{lower:?},{upper:?},{units}{rounding}}}")
        }
        (_, kind) => {
            let kind = type_of(kind);
            if units == "nil" {
                format!("{{\"number\",{field},\"{kind}\"}}")
            } else {
                format!("{{\"number\",{field},\"{kind}\",{units}}}")
            }
        }
    }
}

const fn type_of(number: Number) -> &'static str {
    match number {
        Number::Unsigned(Unsigned::U8) => "u1",
        Number::Unsigned(Unsigned::U16) => "u2",
        Number::Unsigned(Unsigned::U32) => "u4",
        Number::Unsigned(Unsigned::U64) => "u8",
        Number::Signed(Signed::I8) => "i1",
        Number::Signed(Signed::I16) => "i2",
        Number::Signed(Signed::I32) => "i4",
        Number::Signed(Signed::I64) => "i8",
        Number::F32 => "f4",
        Number::F64 => "f8",
    }
}

/// Limits as further table entries; empty if every representable count is valid.
fn limits(count: &Count) -> String {
    if count.min == 0 && count.max == count.unsigned.max() {
        String::new()
    } else {
        format!(",{},{}", count.min, count.max)
    }
}

fn limits_or_nil(count: &Count) -> (String, String) {
    if limits(count).is_empty() {
        ("nil".to_owned(), "nil".to_owned())
    } else {
        (count.min.to_string(), count.max.to_string())
    }
}
