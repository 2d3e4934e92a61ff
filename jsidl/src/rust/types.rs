//! Determines the Rust types of a message, between the model and the generated text.
//!
//! Nested types of a message are in a module with the message's name. A type that another message
//! has already defined in the same way is reused.

use std::collections::HashMap;

use heck::ToUpperCamelCase;

use super::dimension::Dimension;
use super::ident::Names;
use crate::fingerprint;
use crate::model::{
    Array, BitField, Choice, Count, Group, Item, Meaning, NamedValue, Number, Scalar, Scale, Shape,
    SubField, Unsigned, ValueSet, Variant,
};

/// The type of a member.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Type {
    /// A plain number.
    Number(Number),
    /// A newtype over a number: scaled, enumerated or bit field.
    Newtype {
        ident: String,
        number: Number,
        scale: Option<(Scale, String)>,
    },
    /// A record with members of fixed size.
    Record {
        ident: String,
        size: usize,
        fields: Vec<(String, usize)>,
    },
    /// A string of fixed length.
    FixedText(u32),
    /// A counted string.
    Text(Count),
    /// Counted octets.
    Blob(Count),
    /// Counted octets in one of several formats.
    Formatted { format: String, count: Count },
    /// A type with its own layout.
    Composite { ident: String, least: usize },
    /// A counted sequence.
    List { count: Count, element: Box<Self> },
    /// A sequence of fixed length.
    Array {
        dimensions: Vec<u32>,
        element: Box<Self>,
    },
}

/// A member of a struct.
#[derive(Debug, Clone)]
pub(super) struct Field<'m> {
    pub(super) item: &'m Item,
    pub(super) ident: String,
    pub(super) ty: Type,
}

/// A nested type.
#[derive(Debug)]
pub(super) struct Definition<'m> {
    pub(super) ident: String,
    pub(super) kind: Kind<'m>,
}

/// What a nested type is.
#[derive(Debug)]
pub(super) enum Kind<'m> {
    /// Defined by another message, at this path from the root of the set.
    Reused(String),
    Struct {
        item: &'m Item,
        group: &'m Group,
        fields: Vec<Field<'m>>,
    },
    Variant {
        item: &'m Item,
        variant: &'m Variant,
        alternatives: Vec<Field<'m>>,
    },
    Measure {
        item: &'m Item,
        choices: Vec<(&'m Choice, String, Type)>,
    },
    Scaled {
        name: &'m str,
        number: Number,
        scale: Scale,
        unit: &'m str,
    },
    Enumeration {
        name: String,
        number: Number,
        values: Vec<(String, NamedValue)>,
        set: Option<&'m ValueSet>,
    },
    Bits {
        item: &'m Item,
        bits: &'m BitField,
        fields: Vec<SubType<'m>>,
    },
}

/// A sub-field of a bit field: its accessor, and its type if it has named values.
#[derive(Debug)]
pub(super) struct SubType<'m> {
    pub(super) field: &'m SubField,
    pub(super) ident: String,
    /// The function that replaces it.
    pub(super) replace: String,
    pub(super) enumeration: Option<String>,
}

/// The nested types of one message.
#[derive(Debug)]
pub(super) struct Nested<'m, 's> {
    /// Types of other messages: fingerprint to path from the root of the set.
    shared: &'s mut HashMap<String, String>,
    /// Path of this message's module from the root of the set.
    module: String,
    names: Names,
    known: HashMap<String, String>,
    pub(super) definitions: Vec<Definition<'m>>,
}

impl<'m, 's> Nested<'m, 's> {
    pub(super) fn new(shared: &'s mut HashMap<String, String>, module: String) -> Self {
        Self {
            shared,
            module,
            names: Names::default(),
            known: HashMap::new(),
            definitions: Vec::new(),
        }
    }

    /// Members as fields with identifiers and types.
    pub(super) fn fields(&mut self, items: impl IntoIterator<Item = &'m Item>) -> Vec<Field<'m>> {
        let mut names = Names::default();
        items
            .into_iter()
            .map(|item| Field {
                item,
                ident: names.snake(&item.name),
                ty: self.item(item),
            })
            .collect()
    }

    /// The type of an item, defined if necessary.
    pub(super) fn item(&mut self, item: &'m Item) -> Type {
        match &item.shape {
            Shape::Group(group) => self.group(item, group),
            Shape::List(list) => {
                let element = Box::new(self.item(&list.element));
                Type::List {
                    count: list.count,
                    element,
                }
            }
            Shape::Variant(variant) => self.variant(item, variant),
            Shape::Scalar(scalar) => self.scalar(&item.name, &item.name, scalar),
            Shape::Bits(bits) => self.bits(item, bits),
            Shape::FixedString { length } => Type::FixedText(*length),
            Shape::VariableString { count } => Type::Text(*count),
            Shape::Blob { count, .. } => Type::Blob(*count),
            Shape::FormattedBlob { formats, count } => {
                let values = formats.iter().map(|format| NamedValue {
                    index: format.index.into(),
                    name: format.name.clone(),
                    interpretation: String::new(),
                });
                let name = format!("{} Format", item.name);
                let number = Number::Unsigned(Unsigned::U8);
                let format = self.enumeration(name, number, values.collect(), None);
                Type::Formatted {
                    format,
                    count: *count,
                }
            }
            Shape::Measure { choices } => self.measure(item, choices),
            Shape::Array(array) => self.array(array),
        }
    }

    /// Defines a type once per name and content; `make` is called only if it is new.
    fn define(
        &mut self,
        name: &str,
        content: &str,
        make: impl FnOnce(&mut Self) -> Kind<'m>,
    ) -> String {
        let key = shared_key(name, content);
        if let Some(ident) = self.known.get(&key) {
            return ident.clone();
        }
        let ident = self.names.camel(name);
        self.known.insert(key.clone(), ident.clone());
        // Built even if it is reused, so that its nested types get their names here, too.
        let kind = make(self);
        let kind = match self.shared.get(&key) {
            Some(path) => Kind::Reused(path.clone()),
            None => {
                self.shared.insert(key, format!("{}::{ident}", self.module));
                kind
            }
        };
        self.definitions.push(Definition {
            ident: ident.clone(),
            kind,
        });
        ident
    }

    fn group(&mut self, item: &'m Item, group: &'m Group) -> Type {
        let content = fingerprint::content(&item.shape);
        let mut types = Vec::new();
        let ident = self.define(&item.name, &content, |nested| {
            let fields = nested.fields(&group.members);
            types = fields.iter().map(|field| field.ty.clone()).collect();
            Kind::Struct {
                item,
                group,
                fields,
            }
        });
        if types.is_empty() {
            types = group
                .members
                .iter()
                .map(|member| self.item(member))
                .collect();
        }
        if group.presence.is_none()
            && !types.is_empty()
            && let Some(size) = types.iter().map(Type::size).sum()
        {
            let members = group.members.iter().zip(&types);
            let fields = members
                .flat_map(|(member, ty)| ty.named_sizes(&member.name))
                .collect();
            return Type::Record {
                ident,
                size,
                fields,
            };
        }
        let optional = |(member, ty): (&Item, &Type)| if member.optional { 0 } else { ty.least() };
        let members = total(group.members.iter().zip(&types).map(optional));
        Type::Composite {
            ident,
            least: at_least(members, group.presence.map_or(0, Unsigned::size)),
        }
    }

    fn variant(&mut self, item: &'m Item, variant: &'m Variant) -> Type {
        let content = fingerprint::content(&item.shape);
        let ident = self.define(&item.name, &content, |nested| {
            let mut names = Names::default();
            let alternatives = variant.alternatives.iter();
            let alternatives = alternatives
                .map(|item| Field {
                    item,
                    ident: names.camel(&item.name),
                    ty: nested.item(item),
                })
                .collect();
            Kind::Variant {
                item,
                variant,
                alternatives,
            }
        });
        let alternatives = variant.alternatives.iter();
        let least = alternatives
            .map(|item| self.item(item).least())
            .min()
            .unwrap_or(0);
        Type::Composite {
            ident,
            least: at_least(least, variant.tag.size()),
        }
    }

    fn measure(&mut self, item: &'m Item, choices: &'m [Choice]) -> Type {
        let content = fingerprint::content(&item.shape);
        let ident = self.define(&item.name, &content, |nested| {
            let mut names = Names::default();
            let choices = choices.iter().map(|choice| {
                let name = choice.name.as_deref().unwrap_or(&choice.scalar.units);
                let ident = names.camel(name);
                let ty =
                    nested.scalar(&format!("{} {name}", item.name), &item.name, &choice.scalar);
                (choice, ident, ty)
            });
            Kind::Measure {
                item,
                choices: choices.collect(),
            }
        });
        let sizes = choices.iter().map(|choice| choice.scalar.number.size());
        Type::Composite {
            ident,
            least: 1 + sizes.min().unwrap_or(0),
        }
    }

    /// The type of a number. `name` is the type's name, `field` the name in errors.
    fn scalar(&mut self, name: &str, field: &'m str, scalar: &'m Scalar) -> Type {
        let content = fingerprint::scalar(scalar);
        match (&scalar.meaning, scalar.number) {
            (Meaning::Scaled(scale), number) => {
                let unit = &scalar.units;
                let ident = self.define(name, &content, |_| Kind::Scaled {
                    name: field,
                    number,
                    scale: *scale,
                    unit,
                });
                let scale = Some((*scale, unit.clone()));
                Type::Newtype {
                    ident,
                    number: scalar.number,
                    scale,
                }
            }
            (Meaning::Values(set), Number::Unsigned(_) | Number::Signed(_))
                if !set.values.is_empty() =>
            {
                let values = set.values.clone();
                let ident = self.enumeration(name.to_owned(), scalar.number, values, Some(set));
                Type::Newtype {
                    ident,
                    number: scalar.number,
                    scale: None,
                }
            }
            _ => Type::Number(scalar.number),
        }
    }

    fn enumeration(
        &mut self,
        name: String,
        number: Number,
        values: Vec<NamedValue>,
        set: Option<&'m ValueSet>,
    ) -> String {
        let content = fingerprint::values(number, &values, set);
        self.define(&name.clone(), &content, |_| {
            let mut names = Names::default();
            let named = |value: NamedValue| (names.shouty(&value.name), value);
            Kind::Enumeration {
                name,
                number,
                values: values.into_iter().map(named).collect(),
                set,
            }
        })
    }

    fn bits(&mut self, item: &'m Item, bits: &'m BitField) -> Type {
        let content = fingerprint::content(&item.shape);
        let ident = self.define(&item.name, &content, |nested| {
            let mut names = Names::reserving(&["raw", "names", "at"]);
            let fields = bits.fields.iter().map(|field| {
                let (ident, [replace]) = names.snake_family(&field.name, ["with_"]);
                let number = Number::Unsigned(width(field));
                let values = &field.values;
                let enumeration = (!values.values.is_empty()).then(|| {
                    let name = format!("{} {}", item.name, field.name);
                    nested.enumeration(name, number, values.values.clone(), Some(values))
                });
                SubType {
                    field,
                    ident,
                    replace,
                    enumeration,
                }
            });
            Kind::Bits {
                item,
                bits,
                fields: fields.collect(),
            }
        });
        Type::Newtype {
            ident,
            number: Number::Unsigned(bits.base),
            scale: None,
        }
    }

    fn array(&mut self, array: &'m Array) -> Type {
        let element = Box::new(self.item(&array.element));
        Type::Array {
            dimensions: array.dimensions.clone(),
            element,
        }
    }
}

/// The fingerprint of a type with its name.
pub(super) fn shared_key(name: &str, content: &str) -> String {
    format!("{} {content}", name.to_upper_camel_case())
}

/// The smallest integer that holds a sub-field.
pub(super) fn width(field: &SubField) -> Unsigned {
    match field.to - field.from {
        0..8 => Unsigned::U8,
        8..16 => Unsigned::U16,
        16..32 => Unsigned::U32,
        _ => Unsigned::U64,
    }
}

impl Type {
    /// The size on the wire, if it is constant and the runtime can read it as one value.
    pub(super) fn size(&self) -> Option<usize> {
        match self {
            Self::Number(number) | Self::Newtype { number, .. } => Some(number.size()),
            Self::Record { size, .. } => Some(*size),
            Self::Array { element, .. } => match self.dimensions()[..] {
                [
                    Dimension {
                        length,
                        on_heap: false,
                    },
                ] => element.size().map(|size| size * length as usize),
                _ => None,
            },
            _ => None,
        }
    }

    /// Names and sizes of the fields in a value of fixed size.
    pub(super) fn named_sizes(&self, name: &str) -> Vec<(String, usize)> {
        match self {
            Self::Record { fields, .. } => {
                let inside = |(field, size): &(String, usize)| (format!("{name}.{field}"), *size);
                fields.iter().map(inside).collect()
            }
            _ => vec![(name.to_owned(), self.size().unwrap_or(0))],
        }
    }

    /// Minimum size of a value in octets, at most [`MOST`].
    pub(super) fn least(&self) -> usize {
        match self {
            Self::FixedText(length) => *length as usize,
            Self::Text(count) | Self::Blob(count) => counted(count, 1),
            Self::Formatted { count, .. } => at_least(1, counted(count, 1)),
            Self::Composite { least, .. } => *least,
            Self::List { count, element } => counted(count, element.least()),
            Self::Array {
                dimensions,
                element,
            } => dimensions.iter().fold(element.least(), |octets, &length| {
                octets.saturating_mul(length as usize).min(MOST)
            }),
            Self::Number(_) | Self::Newtype { .. } | Self::Record { .. } => {
                self.size().unwrap_or(0)
            }
        }
    }

    /// The Rust type, seen from where its module is called `prefix` (`report_x::` or nothing).
    pub(super) fn rust(&self, prefix: &str) -> String {
        self.named(&|ident| format!("{prefix}{ident}"))
    }

    /// The Rust type, with nested types by the paths that a function gives.
    pub(super) fn named(&self, path: &dyn Fn(&str) -> String) -> String {
        match self {
            Self::Number(number) => number_type(*number).to_owned(),
            Self::Newtype { ident, .. }
            | Self::Record { ident, .. }
            | Self::Composite { ident, .. } => path(ident),
            Self::FixedText(_) | Self::Text(_) => "codec::Text".to_owned(),
            Self::Blob(_) => "codec::Bytes".to_owned(),
            Self::Formatted { format, .. } => format!("codec::FormattedBlob<{}>", path(format)),
            Self::List { element, .. } => format!("codec::List<{}>", element.named(path)),
            Self::Array { element, .. } => self.array_of(&element.named(path)),
        }
    }

    /// Whether `Default` can be derived; the standard library implements it for arrays up to 32.
    pub(super) fn derives_default(&self) -> bool {
        match self {
            Self::Array { element, .. } => {
                let mut dimensions = self.dimensions().into_iter();
                dimensions.all(|it| it.on_heap || it.length <= 32) && element.derives_default()
            }
            _ => true,
        }
    }
}

/// The highest minimum size that is stated. Larger ones, which no message reaches, are rounded down to
/// it: it fits the `usize` of every target.
const MOST: usize = i32::MAX as usize;

/// The sum of two minimum sizes.
fn at_least(one: usize, other: usize) -> usize {
    one.saturating_add(other).min(MOST)
}

/// The sum of several minimum sizes.
pub(super) fn total(sizes: impl Iterator<Item = usize>) -> usize {
    sizes.fold(0, at_least)
}

fn counted(count: &Count, size: usize) -> usize {
    let elements = usize::try_from(count.min).unwrap_or(usize::MAX);
    at_least(elements.saturating_mul(size), count.unsigned.size())
}

/// A number's type in Rust.
pub(super) const fn number_type(number: Number) -> &'static str {
    use crate::model::Signed;
    match number {
        Number::Unsigned(unsigned) => unsigned_type(unsigned),
        Number::Signed(Signed::I8) => "i8",
        Number::Signed(Signed::I16) => "i16",
        Number::Signed(Signed::I32) => "i32",
        Number::Signed(Signed::I64) => "i64",
        Number::F32 => "f32",
        Number::F64 => "f64",
    }
}

/// An unsigned integer's type in Rust.
pub(super) const fn unsigned_type(unsigned: Unsigned) -> &'static str {
    match unsigned {
        Unsigned::U8 => "u8",
        Unsigned::U16 => "u16",
        Unsigned::U32 => "u32",
        Unsigned::U64 => "u64",
    }
}
