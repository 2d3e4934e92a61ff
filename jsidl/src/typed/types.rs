//! Types of members, and the nested types of a message.

use std::collections::HashMap;

use heck::ToUpperCamelCase;

use super::names::{self, Names, Spelling};
use crate::fingerprint;
use crate::model::{
    BitField, Choice, Count, Group, Item, Meaning, NamedValue, Number, Scalar, Scale, Shape,
    SubField, Unsigned, ValueRange, ValueSet, Variant,
};

/// The type of a member.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Type {
    /// A plain number.
    Number(Number),
    /// A number with named values.
    Named { ident: String, number: Number },
    /// A scaled integer.
    Scaled { ident: String },
    /// A group, variant, measure or bit field.
    Defined { ident: String },
    /// A string of fixed length.
    FixedText(u32),
    /// A counted string.
    Text(Count),
    /// Counted octets.
    Blob(Count),
    /// Counted octets in one of several formats; the formats are a type of named values.
    Formatted { formats: String, count: Count },
    /// A counted sequence.
    List { count: Count, element: Box<Self> },
    /// A sequence of fixed length; the first dimension varies fastest.
    Array {
        dimensions: Vec<u32>,
        element: Box<Self>,
    },
}

/// A member, or an alternative of a variant.
#[derive(Debug, Clone)]
pub(crate) struct Field<'m> {
    pub(crate) item: &'m Item,
    /// The name in the definition and in error paths.
    pub(crate) name: &'m str,
    pub(crate) ident: String,
    pub(crate) ty: Type,
    /// The name of the accessor in engineering units, if the member is a scaled integer.
    pub(crate) in_units: Option<String>,
}

/// A nested type.
#[derive(Debug)]
pub(crate) struct Definition<'m> {
    pub(crate) ident: String,
    pub(crate) kind: Kind<'m>,
}

/// What a nested type is.
#[derive(Debug)]
pub(crate) enum Kind<'m> {
    Group {
        item: &'m Item,
        presence: Option<Unsigned>,
        fields: Vec<Field<'m>>,
    },
    Variant {
        item: &'m Item,
        tag: Unsigned,
        alternatives: Vec<Field<'m>>,
    },
    Measure {
        item: &'m Item,
        choices: Vec<Alternative<'m>>,
    },
    Scaled {
        name: &'m str,
        number: Number,
        scale: Scale,
        units: &'m str,
    },
    Named {
        name: String,
        number: Number,
        values: Vec<(String, NamedValue)>,
        set: Option<&'m ValueSet>,
    },
    Bits {
        item: &'m Item,
        bits: &'m BitField,
        parts: Vec<Part<'m>>,
    },
}

/// A choice of a measure.
#[derive(Debug)]
pub(crate) struct Alternative<'m> {
    pub(crate) choice: &'m Choice,
    pub(crate) ident: String,
    pub(crate) ty: Type,
}

/// A sub-field of a bit field.
#[derive(Debug)]
pub(crate) struct Part<'m> {
    pub(crate) field: &'m SubField,
    pub(crate) ident: String,
    /// The smallest integer that holds it.
    pub(crate) width: Unsigned,
    /// Its type of named values, if it has any.
    pub(crate) values: Option<String>,
    /// The least and the greatest value that the definition permits.
    pub(crate) limits: (u64, u64),
}

/// The nested types of one message.
#[derive(Debug)]
pub(crate) struct Nested<'m> {
    spelling: &'static Spelling,
    names: Names,
    known: HashMap<String, String>,
    pub(crate) definitions: Vec<Definition<'m>>,
}

impl<'m> Nested<'m> {
    /// No types yet, inside the type with this name.
    pub(crate) fn new(spelling: &'static Spelling, outer: &str) -> Self {
        Self {
            spelling,
            names: Names::beside(spelling, outer),
            known: HashMap::new(),
            definitions: Vec::new(),
        }
    }

    /// Items as fields with identifiers and types.
    pub(crate) fn fields(&mut self, items: impl IntoIterator<Item = &'m Item>) -> Vec<Field<'m>> {
        self.named(items.into_iter().map(|item| (&*item.name, item)))
    }

    /// As [`fields`](Self::fields), with names.
    pub(crate) fn named(
        &mut self,
        items: impl IntoIterator<Item = (&'m str, &'m Item)>,
    ) -> Vec<Field<'m>> {
        let mut names = Names::new(self.spelling);
        let fields = items.into_iter().map(|(name, item)| Field {
            item,
            name,
            ident: names.member(name),
            ty: self.item(item),
            in_units: None,
        });
        let mut fields: Vec<_> = fields.collect();
        for field in &mut fields {
            if let Shape::Scalar(Scalar {
                meaning: Meaning::Scaled(_),
                units,
                ..
            }) = &field.item.shape
            {
                let name = format!("{} {}", field.name, names::unit(units));
                field.in_units = Some(names.member(&name));
            }
        }
        fields
    }

    /// The type of an item, defined if necessary.
    fn item(&mut self, item: &'m Item) -> Type {
        match &item.shape {
            Shape::Group(group) => self.group(item, group),
            Shape::List(list) => Type::List {
                count: list.count,
                element: Box::new(self.item(&list.element)),
            },
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
                let number = Number::Unsigned(Unsigned::U8);
                let name = format!("{} Format", item.name);
                Type::Formatted {
                    formats: self.values(name, number, values.collect(), None),
                    count: *count,
                }
            }
            Shape::Measure { choices } => self.measure(item, choices),
            Shape::Array(array) => Type::Array {
                dimensions: array.dimensions.clone(),
                element: Box::new(self.item(&array.element)),
            },
        }
    }

    /// Defines a type once per name and content, after the types that it uses.
    fn define(
        &mut self,
        name: &str,
        content: &str,
        make: impl FnOnce(&mut Self) -> Kind<'m>,
    ) -> String {
        let key = format!("{} {content}", name.to_upper_camel_case());
        if let Some(ident) = self.known.get(&key) {
            return ident.clone();
        }
        let ident = self.names.type_name(name);
        self.known.insert(key, ident.clone());
        let kind = make(self);
        self.definitions.push(Definition {
            ident: ident.clone(),
            kind,
        });
        ident
    }

    fn group(&mut self, item: &'m Item, group: &'m Group) -> Type {
        let content = fingerprint::content(&item.shape);
        let ident = self.define(&item.name, &content, |nested| Kind::Group {
            item,
            presence: group.presence,
            fields: nested.fields(&group.members),
        });
        Type::Defined { ident }
    }

    fn variant(&mut self, item: &'m Item, variant: &'m Variant) -> Type {
        let content = fingerprint::content(&item.shape);
        let ident = self.define(&item.name, &content, |nested| Kind::Variant {
            item,
            tag: variant.tag,
            alternatives: nested.fields(&variant.alternatives),
        });
        Type::Defined { ident }
    }

    fn measure(&mut self, item: &'m Item, choices: &'m [Choice]) -> Type {
        let content = fingerprint::content(&item.shape);
        let ident = self.define(&item.name, &content, |nested| {
            let mut names = Names::new(nested.spelling);
            let choices = choices.iter().map(|choice| {
                let name = choice.name.as_deref().unwrap_or(&choice.scalar.units);
                let type_name = format!("{} {name}", item.name);
                Alternative {
                    choice,
                    ident: names.member(name),
                    ty: nested.scalar(&type_name, &item.name, &choice.scalar),
                }
            });
            let choices = choices.collect();
            Kind::Measure { item, choices }
        });
        Type::Defined { ident }
    }

    /// The type of a number. `name` is the type's name, `field` the name in errors.
    fn scalar(&mut self, name: &str, field: &'m str, scalar: &'m Scalar) -> Type {
        match (&scalar.meaning, scalar.number) {
            (Meaning::Scaled(scale), number) => {
                let content = fingerprint::scalar(scalar);
                let ident = self.define(name, &content, |_| Kind::Scaled {
                    name: field,
                    number,
                    scale: *scale,
                    units: &scalar.units,
                });
                Type::Scaled { ident }
            }
            (Meaning::Values(set), number @ (Number::Unsigned(_) | Number::Signed(_)))
                if !set.values.is_empty() =>
            {
                let ident = self.values(name.to_owned(), number, set.values.clone(), Some(set));
                Type::Named { ident, number }
            }
            (_, number) => Type::Number(number),
        }
    }

    fn values(
        &mut self,
        name: String,
        number: Number,
        mut values: Vec<NamedValue>,
        set: Option<&'m ValueSet>,
    ) -> String {
        let content = fingerprint::values(number, &values, set);
        values.retain(|value| {
            let (_, greatest) = number.integers().unwrap_or_default();
            value.index <= greatest
        });
        self.define(&name.clone(), &content, |nested| {
            let mut names = Names::new(nested.spelling);
            let values = values.into_iter();
            Kind::Named {
                name,
                number,
                values: values.map(|it| (names.value(&it.name), it)).collect(),
                set,
            }
        })
    }

    fn bits(&mut self, item: &'m Item, bits: &'m BitField) -> Type {
        let content = fingerprint::content(&item.shape);
        let ident = self.define(&item.name, &content, |nested| {
            let mut names = Names::beside(nested.spelling, "raw");
            let parts = bits.fields.iter().map(|field| {
                let width = width(field);
                let set = &field.values;
                let values = (!set.values.is_empty()).then(|| {
                    let name = format!("{} {}", item.name, field.name);
                    let number = Number::Unsigned(width);
                    nested.values(name, number, set.values.clone(), Some(set))
                });
                Part {
                    field,
                    ident: names.member(&field.name),
                    width,
                    values,
                    limits: limits(field),
                }
            });
            let parts = parts.collect();
            Kind::Bits { item, bits, parts }
        });
        Type::Defined { ident }
    }
}

/// The smallest integer that holds a sub-field.
const fn width(field: &SubField) -> Unsigned {
    match field.to.saturating_sub(field.from) {
        0..8 => Unsigned::U8,
        8..16 => Unsigned::U16,
        16..32 => Unsigned::U32,
        _ => Unsigned::U64,
    }
}

/// The range that the definition permits, limited to the available bits.
fn limits(field: &SubField) -> (u64, u64) {
    let greatest = field.mask().checked_shr(field.from.into()).unwrap_or(0);
    let named = field.values.values.iter();
    let named = named.map(|value| u64::try_from(value.index).unwrap_or(0));
    let named = named.map(|index| (index, index));
    let ranges = field.values.ranges.iter().map(integers);
    let stated = named
        .chain(ranges)
        .reduce(|(a, b), (c, d)| (a.min(c), b.max(d)));
    let (least, most) = stated.unwrap_or((0, greatest));
    (least.min(greatest), most.min(greatest))
}

/// The least and the greatest integer in a range. (The conversions saturate.)
fn integers(range: &ValueRange) -> (u64, u64) {
    let least = range.lower.max(0.0).ceil() as u64;
    let greatest = range.upper.max(0.0).floor() as u64;
    let above = range.lower_exclusive && range.lower >= 0.0 && least as f64 == range.lower;
    let below = range.upper_exclusive && greatest as f64 == range.upper;
    (
        least.saturating_add(above.into()),
        greatest.saturating_sub(below.into()),
    )
}
