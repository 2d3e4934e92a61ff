//! Compares messages by wire layout and field names.

use crate::model::{Item, Message, Shape};

/// Same names and same octets. Descriptions, limits of counts and value sets may differ.
pub(super) fn same_message(a: &Message, b: &Message) -> bool {
    a.code == b.code
        && a.name == b.name
        && same_section(a.header.as_ref(), b.header.as_ref())
        && same_section(a.body.as_ref(), b.body.as_ref())
        && same_section(a.footer.as_ref(), b.footer.as_ref())
}

fn same_section(a: Option<&Item>, b: Option<&Item>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => same_item(a, b),
        (None, None) => true,
        _ => false,
    }
}

pub(crate) fn same_item(a: &Item, b: &Item) -> bool {
    a.name == b.name && a.optional == b.optional && same_shape(&a.shape, &b.shape)
}

fn same_items(a: &[Item], b: &[Item]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same_item(a, b))
}

pub(crate) fn same_shape(a: &Shape, b: &Shape) -> bool {
    match (a, b) {
        (Shape::Group(a), Shape::Group(b)) => {
            a.presence == b.presence && same_items(&a.members, &b.members)
        }
        (Shape::List(a), Shape::List(b)) => {
            a.count.unsigned == b.count.unsigned && same_item(&a.element, &b.element)
        }
        (Shape::Variant(a), Shape::Variant(b)) => {
            a.tag == b.tag && same_items(&a.alternatives, &b.alternatives)
        }
        (Shape::Scalar(a), Shape::Scalar(b)) => {
            a.number == b.number && same_scale(&a.meaning, &b.meaning)
        }
        (Shape::Bits(a), Shape::Bits(b)) => {
            let bits = |bits: &crate::model::BitField| -> Vec<(String, u8, u8)> {
                let fields = bits.fields.iter();
                fields.map(|f| (f.name.clone(), f.from, f.to)).collect()
            };
            a.base == b.base && bits(a) == bits(b)
        }
        (Shape::FixedString { length: a }, Shape::FixedString { length: b }) => a == b,
        (Shape::VariableString { count: a }, Shape::VariableString { count: b })
        | (Shape::Blob { count: a, .. }, Shape::Blob { count: b, .. }) => a.unsigned == b.unsigned,
        (
            Shape::FormattedBlob { formats, count },
            Shape::FormattedBlob {
                formats: other_formats,
                count: other_count,
            },
        ) => formats == other_formats && count.unsigned == other_count.unsigned,
        (Shape::Measure { choices: a }, Shape::Measure { choices: b }) => {
            a.len() == b.len()
                && a.iter().zip(b).all(|(a, b)| {
                    a.index == b.index
                        && a.scalar.number == b.scalar.number
                        && same_scale(&a.scalar.meaning, &b.scalar.meaning)
                })
        }
        (Shape::Array(a), Shape::Array(b)) => {
            a.dimensions == b.dimensions && same_item(&a.element, &b.element)
        }
        _ => false,
    }
}

fn same_scale(a: &crate::model::Meaning, b: &crate::model::Meaning) -> bool {
    use crate::model::Meaning::Scaled;
    match (a, b) {
        (Scaled(a), Scaled(b)) => a == b,
        (Scaled(_), _) | (_, Scaled(_)) => false,
        _ => true,
    }
}
