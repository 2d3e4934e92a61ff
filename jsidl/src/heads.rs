//! The head of a message: the fields that stand at fixed places, behind the code, before the first field of
//! another size in each message.

use crate::model::{GroupKind, Item, Meaning, Message, Number, Shape, Unsigned};

/// A number that a query and its report have in common: places in octets from the beginning of the messages,
/// with their codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Echo {
    pub(crate) query: usize,
    pub(crate) report: usize,
    pub(crate) octets: usize,
}

/// The whole numbers at the heads of a query and of its report that have the same name and encoding: a report
/// with other values answers another query.
pub(crate) fn echoes(query: &Message, report: &Message) -> Vec<Echo> {
    let (asked, told) = (head(query), head(report));
    let numbers = asked
        .iter()
        .filter_map(|(field, at)| Some((field, *at, whole(&field.shape)?)));
    let echoes = numbers.filter_map(|(field, query, number)| {
        let is_same =
            |it: &&(&Item, usize)| it.0.name == field.name && whole(&it.0.shape) == Some(number);
        let (_, report) = told.iter().find(is_same)?;
        Some(Echo {
            query,
            report: *report,
            octets: number.size(),
        })
    });
    echoes.collect()
}

/// The place of a field of one octet at the head of a message.
pub(crate) fn place_of(message: &Message, field: &str) -> Option<usize> {
    let is_octet = |shape: &Shape| matches!(shape, Shape::Scalar(it) if it.number == Number::Unsigned(Unsigned::U8));
    let head = head(message);
    let (field, place) = head.into_iter().find(|(it, _)| it.name == field)?;
    is_octet(&field.shape).then_some(place)
}

/// The fields at the head of a message, with their places in octets from its beginning.
fn head(message: &Message) -> Vec<(&Item, usize)> {
    let mut fields = Vec::new();
    if let Some(body) = message.body.as_ref().filter(|_| message.header.is_none())
        && let Some(members) = fixed_members(body)
    {
        let mut place = size_of::<u16>();
        for member in members {
            fields.push((member, place));
            let Some(size) = fixed_size(&member.shape) else {
                break;
            };
            place += size;
        }
    }
    fields
}

/// The encoding of a whole number that is no part of a measurement.
fn whole(shape: &Shape) -> Option<Number> {
    match shape {
        Shape::Scalar(it) if !matches!(it.meaning, Meaning::Scaled(_)) => {
            it.number.integers().map(|_| it.number)
        }
        _ => None,
    }
}

/// The members of a record without a presence vector.
fn fixed_members(item: &Item) -> Option<&[Item]> {
    match &item.shape {
        Shape::Group(group) if group.presence.is_none() && group.kind == GroupKind::Record => {
            Some(&group.members)
        }
        _ => None,
    }
}

/// Octets on the wire; `None` if they vary.
pub(crate) fn fixed_size(shape: &Shape) -> Option<usize> {
    match shape {
        Shape::Scalar(scalar) => Some(scalar.number.size()),
        Shape::Bits(bits) => Some(bits.base.size()),
        Shape::FixedString { length } => usize::try_from(*length).ok(),
        Shape::Group(group) if group.presence.is_none() => {
            group.members.iter().map(|it| fixed_size(&it.shape)).sum()
        }
        Shape::Array(array) => {
            let elements = array.dimensions.iter().try_fold(1_usize, |all, &it| {
                all.checked_mul(usize::try_from(it).ok()?)
            })?;
            fixed_size(&array.element.shape)?.checked_mul(elements)
        }
        _ => None,
    }
}
