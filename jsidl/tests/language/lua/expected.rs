//! The expected tshark output for a message: our decoded value, field by field in wire order.

use jsidl::dynamic::{Raw, Steps, Value};
use jsidl::model::{Item, Meaning, Message, Scalar, Shape};
use roxmltree::Node;

use super::tshark::name;

/// The content of a field as our codec decodes it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Content {
    Integer(i128),
    Real(f64),
    /// A single-precision number; any decimal that parses to it matches.
    Single(f32),
    Text(String),
    Octets(Vec<u8>),
    /// A record, a sequence or an array.
    There,
}

pub(crate) type Field = (String, Content);

/// All fields of a message; their names begin with `prefix`.
pub(crate) fn fields(prefix: &str, message: &Message, value: &Value) -> Vec<Field> {
    let mut walk = Walk {
        prefix: format!("{prefix}{}", plain(&message.name)),
        fields: Vec::new(),
    };
    let Some(body) = &message.body else {
        return Vec::new();
    };
    match (&body.shape, value) {
        // The members of the body are directly below the message.
        (Shape::Group(group), Value::Group(slots)) => walk.members(&group.members, slots),
        _ => walk.item(body, value),
    }
    walk.fields
}

struct Walk {
    prefix: String,
    fields: Vec<Field>,
}

fn plain(name: &str) -> String {
    let name = name.to_ascii_lowercase();
    name.replace(|c: char| !c.is_ascii_alphanumeric(), "_")
}

impl Walk {
    fn push(&mut self, name: &str, content: Content) {
        let filter = format!("{}.{}", self.prefix, plain(name));
        self.fields.push((filter, content));
    }

    fn members(&mut self, members: &[Item], slots: &[Option<Value>]) {
        for (member, slot) in members.iter().zip(slots) {
            if let Some(value) = slot {
                self.item(member, value);
            }
        }
    }

    fn item(&mut self, item: &Item, value: &Value) {
        let name = &item.name;
        match (&item.shape, value) {
            (Shape::Group(group), Value::Group(slots)) => {
                self.push(name, Content::There);
                self.members(&group.members, slots);
            }
            (Shape::List(list), Value::List(elements)) => {
                self.push(name, Content::Integer(elements.len() as i128));
                elements.iter().for_each(|e| self.item(&list.element, e));
            }
            (Shape::Array(array), Value::Array(elements)) => {
                self.push(name, Content::There);
                elements.iter().for_each(|e| self.item(&array.element, e));
            }
            (Shape::Variant(variant), Value::Variant { tag, value }) => {
                self.push(name, Content::Integer((*tag).into()));
                if let Some(value) = value {
                    let chosen = usize::try_from(*tag).unwrap();
                    self.item(&variant.alternatives[chosen], value);
                }
            }
            (Shape::Scalar(scalar), Value::Number(raw)) => {
                self.push(name, number(scalar, *raw));
            }
            (Shape::Bits(bits), Value::Bits(whole)) => {
                self.push(name, Content::Integer((*whole).into()));
                for part in &bits.fields {
                    let mask = (1_u128 << (part.to - part.from + 1)) - 1;
                    let bits = u128::from(*whole) >> part.from & mask;
                    self.push(&part.name, Content::Integer(bits.try_into().unwrap()));
                }
            }
            (_, Value::Text(octets)) => {
                let text = String::from_utf8_lossy(octets);
                let text = text.split('\0').next().unwrap_or_default();
                self.push(name, Content::Text(text.to_owned()));
            }
            (_, Value::Blob(octets)) => self.push(name, Content::Octets(octets.clone())),
            (_, Value::Formatted { format, octets }) => {
                self.push(name, Content::Octets(octets.clone()));
                let format = Content::Integer((*format).into());
                self.push(&format!("{name}_format"), format);
            }
            (Shape::Measure { choices }, Value::Measure { index, number: raw }) => {
                let choice = choices
                    .iter()
                    .find(|choice| choice.index == *index)
                    .unwrap();
                let value = match number(&choice.scalar, *raw) {
                    Content::Integer(integer) => Content::Real(integer as f64),
                    other => other,
                };
                self.push(name, value);
                self.push(&format!("{name}_index"), Content::Integer((*index).into()));
            }
            (shape, value) => panic!("{name}: {value:?} for {shape:?}"),
        }
    }
}

fn number(scalar: &Scalar, raw: Raw) -> Content {
    match (&scalar.meaning, scalar.number, raw) {
        (Meaning::Scaled(scale), number, raw) => {
            let shown = Steps::of(scale, number).and_then(|steps| steps.shown(raw));
            Content::Real(shown.unwrap())
        }
        (_, _, Raw::Unsigned(integer)) => Content::Integer(integer.into()),
        (_, _, Raw::Signed(integer)) => Content::Integer(integer.into()),
        (_, _, Raw::F32(real)) => Content::Single(real),
        (_, _, Raw::F64(real)) => Content::Real(real),
    }
}

/// The fields below an item of PDML, without those of messages within the message.
pub(crate) fn shown<'a, 'p>(item: Node<'a, 'p>, prefix: &str, fields: &mut Vec<Node<'a, 'p>>) {
    for child in item.children().filter(|child| name(*child) != "jaus") {
        if name(child).starts_with(prefix) {
            fields.push(child);
        }
        shown(child, prefix, fields);
    }
}

/// Whether an item of PDML agrees with our codec.
pub(crate) fn agrees(item: Node<'_, '_>, (filter, content): &Field) -> bool {
    const KINDS: [&str; 8] = [
        "uint", "uint64", "int", "int64", "real", "text", "octets", "none",
    ];
    let called = match name(item).strip_prefix(filter) {
        Some("") => true,
        Some(rest) => KINDS
            .iter()
            .any(|kind| rest.strip_prefix('_') == Some(kind)),
        None => false,
    };
    let show = item.attribute("show").unwrap_or_default();
    called
        && match content {
            Content::Integer(integer) => show.parse() == Ok(*integer),
            Content::Real(real) if real.is_nan() => show.contains("nan"),
            Content::Single(real) if real.is_nan() => show.contains("nan"),
            Content::Single(real) => show.parse() == Ok(*real),
            // Wireshark prints 15 significant digits.
            Content::Real(real) => {
                show.parse() == Ok(*real) || show.parse() == format!("{real:.14e}").parse::<f64>()
            }
            // Wireshark escapes and replaces unprintable characters.
            Content::Text(text) => show == text || text.contains(|c: char| !is_printed(c)),
            Content::Octets(octets) => {
                let digits: String = octets.iter().map(|octet| format!("{octet:02x}")).collect();
                item.attribute("value").unwrap_or_default() == digits
            }
            Content::There => show.is_empty(),
        }
}

fn is_printed(character: char) -> bool {
    character.is_ascii_graphic() || character == ' '
}
