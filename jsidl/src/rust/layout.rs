//! The fields of a message with the definitions of their types, for code about what a message
//! contains.

use std::collections::HashMap;

use super::messages;
use super::types::{Field, Kind, Nested, Type};
use crate::model::{Item, Meaning, Message, Number, Scalar, Shape, Unsigned};

/// The fields of a message, and all types inside it by their names in the message's module.
pub(super) struct Layout<'m> {
    pub(super) fields: Vec<Field<'m>>,
    /// The presence vector of the message's own fields.
    pub(super) presence: Option<Unsigned>,
    definitions: HashMap<String, Kind<'m>>,
}

impl<'m> Layout<'m> {
    /// The layout of a message that is only a body.
    pub(super) fn of(message: &'m Message) -> Option<Self> {
        if message.header.is_some() || message.footer.is_some() {
            return None;
        }
        // Types that other messages define, too, have the same names in this message's module.
        let mut shared = HashMap::new();
        let mut nested = Nested::new(&mut shared, String::new());
        let fields = messages::fields(message, &mut nested);
        let presence = match message.body.as_ref().map(|body| &body.shape) {
            Some(Shape::Group(group)) => group.presence,
            _ => None,
        };
        let definitions = nested.definitions.into_iter();
        let definitions = definitions.map(|it| (it.ident, it.kind)).collect();
        Some(Self {
            fields,
            presence,
            definitions,
        })
    }

    /// The definition of a record, sequence or variant.
    pub(super) fn definition(&self, ty: &Type) -> Option<&Kind<'m>> {
        match ty {
            Type::Composite { ident, .. } | Type::Record { ident, .. } => {
                self.definitions.get(ident)
            }
            _ => None,
        }
    }
}

/// The bits of a field that is a plain unsigned integer.
pub(super) fn unsigned_bits(item: &Item) -> Option<usize> {
    match &item.shape {
        Shape::Scalar(Scalar {
            number: Number::Unsigned(unsigned),
            meaning,
            ..
        }) => match meaning {
            Meaning::Values(set) if !set.values.is_empty() => None,
            Meaning::Scaled(_) => None,
            _ => Some(8 * unsigned.size()),
        },
        _ => None,
    }
}
