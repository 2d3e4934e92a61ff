//! Makes the types of a message from the shared plan of typed code.

use std::collections::HashMap;

use heck::ToUpperCamelCase;

use super::definitions::{Arity, Bits, Constant, Definition, Definitions, Element, Field, Source};
use crate::model::{BitField, Item, NamedValue, Number, Scale, Unsigned};
use crate::typed::types::{self, Alternative, Kind, Part, Type};
use crate::typed::{Content, Plan, Set, notes};

/// Elements of the largest array that is an array in ROS 2, too. There it is a part of the struct,
/// and therefore often on the stack.
const LARGEST_ARRAY: u64 = 1024;

/// Adds the types of a message; returns the place of the message's own type.
pub(super) fn message(definitions: &mut Definitions, set: &Set<'_>, plan: &Plan<'_>) -> usize {
    let (version, ident) = plan.definition();
    let name = format!(
        "{}{}V{}p{}",
        set.name.to_upper_camel_case(),
        ident.to_upper_camel_case(),
        version.major,
        version.minor
    );
    let name = definitions.unused(&name);
    let mut nested = Nested {
        definitions,
        outer: name.clone(),
        known: HashMap::new(),
    };
    for definition in &plan.types {
        nested.define(definition);
    }
    let source = match &plan.content {
        Content::Members(..) => Source::Group,
        Content::Whole(_) => Source::Whole,
        Content::Sections(_) => Source::Sections,
    };
    let fields = nested.members(plan.content.fields(), false);
    definitions.add(Definition {
        name,
        notes: notes::message(plan),
        fields,
        source,
    })
}

/// The types of one message.
struct Nested<'d, 'p> {
    definitions: &'d mut Definitions,
    /// The name of the message's type.
    outer: String,
    known: HashMap<&'p str, Known<'p>>,
}

/// What a type of the plan is in the package.
#[derive(Clone, Copy)]
enum Known<'p> {
    Message(usize),
    Scaled(Number, Scale),
    Named(&'p [(String, NamedValue)]),
}

impl<'p> Nested<'_, 'p> {
    fn define(&mut self, definition: &'p types::Definition<'_>) {
        let notes = || notes::definition(&definition.kind);
        let name = definition.ident.as_str();
        let known = match &definition.kind {
            Kind::Scaled { number, scale, .. } => Known::Scaled(*number, *scale),
            Kind::Named { values, .. } => Known::Named(values),
            Kind::Group { fields, .. } => {
                let fields = self.members(fields, false);
                Known::Message(self.add(name, notes(), fields, Source::Group))
            }
            Kind::Variant {
                tag, alternatives, ..
            } => {
                let mut fields = self.members(alternatives, true);
                let indexes = (0..alternatives.len()).map(|place| place as i128);
                let note = "The alternative that is present.";
                fields.insert(0, selector("kind", *tag, note, &fields, indexes));
                Known::Message(self.add(name, notes(), fields, Source::Variant))
            }
            Kind::Measure { choices, .. } => {
                let mut fields: Vec<_> = choices.iter().map(|it| self.choice(it)).collect();
                let indexes: Vec<_> = choices.iter().map(|it| it.choice.index).collect();
                let numbers = indexes.iter().map(|&index| index.into());
                let note = "The type and unit that are present.";
                fields.insert(0, selector("index", Unsigned::U8, note, &fields, numbers));
                Known::Message(self.add(name, notes(), fields, Source::Measure(indexes)))
            }
            Kind::Bits { bits, parts, .. } => {
                let (fields, places) = self.bits(bits, parts);
                Known::Message(self.add(name, notes(), fields, Source::Bits(places)))
            }
        };
        self.known.insert(name, known);
    }

    /// Adds a type inside the message.
    fn add(&mut self, name: &str, notes: Vec<String>, fields: Vec<Field>, source: Source) -> usize {
        let name = format!("{}{}", self.outer, name.to_upper_camel_case());
        let name = self.definitions.unused(&name);
        self.definitions.add(Definition {
            name,
            notes,
            fields,
            source,
        })
    }

    /// The members of a group, or the alternatives of a variant.
    fn members(&mut self, members: &[types::Field<'_>], is_variant: bool) -> Vec<Field> {
        let members = members.iter().zip(notes::members(members));
        let fields = members.map(|(member, notes)| {
            let (element, arity) = if member.item.optional || is_variant {
                (self.single(&member.ty, member.item), Arity::Optional)
            } else {
                self.resolve(&member.ty, member.item)
            };
            let name = (member.ident.as_str(), member.name);
            self.field(name, &member.ty, (element, arity), notes)
        });
        fields.collect()
    }

    /// A field with its identifier, and its name in the definition.
    fn field(
        &self,
        (ident, path): (&str, &str),
        ty: &Type,
        (element, arity): (Element, Arity),
        mut notes: Vec<String>,
    ) -> Field {
        if matches!(element, Element::Text) {
            notes.push("Octets that are not UTF-8, and zeros, become U+FFFD.".to_owned());
        }
        let constants = match element {
            Element::Number(_) => self.constants(ident, ty),
            _ => Vec::new(),
        };
        Field {
            ident: ident.to_owned(),
            path: path.to_owned(),
            element,
            arity,
            notes,
            constants,
        }
    }

    /// The type of an item, without its optionality.
    fn resolve(&mut self, ty: &Type, item: &Item) -> (Element, Arity) {
        match ty {
            Type::List { element, .. } => (self.single(element, content(item)), Arity::Many),
            Type::Array {
                dimensions,
                element,
            } => {
                let sizes = dimensions.iter().map(|&size| u64::from(size));
                let count = sizes.fold(1, u64::saturating_mul);
                let arity = match count {
                    1..=LARGEST_ARRAY => Arity::Exactly(count),
                    _ => Arity::Many,
                };
                (self.single(element, content(item)), arity)
            }
            Type::Formatted { formats, .. } => {
                let place = self.formatted(formats, item);
                (Element::Message(place), Arity::One)
            }
            Type::Text(_) | Type::FixedText(_) => (Element::Text, Arity::One),
            Type::Blob(_) => (Element::Octets, Arity::One),
            Type::Number(_) | Type::Named { .. } | Type::Scaled { .. } | Type::Defined { .. } => {
                (self.plain(ty), Arity::One)
            }
        }
    }

    /// The type of an element: one of its own if it is a sequence itself.
    fn single(&mut self, ty: &Type, item: &Item) -> Element {
        let (element, arity) = self.resolve(ty, item);
        let ident = match (&element, arity) {
            (Element::Octets, Arity::One) => "octets",
            (_, Arity::One) => return element,
            _ => "elements",
        };
        let name = (ident, item.name.as_str());
        let field = self.field(name, ty, (element, arity), notes::item(item));
        let note = format!("{}, as an element of a sequence.", item.name);
        Element::Message(self.add(&item.name, vec![note], vec![field], Source::Whole))
    }

    /// A number, or a type that is defined before.
    fn plain(&self, ty: &Type) -> Element {
        match ty {
            Type::Number(number) | Type::Named { number, .. } => Element::Number(*number),
            Type::Scaled { ident } | Type::Defined { ident } => match self.known.get(&**ident) {
                Some(Known::Scaled(number, scale)) => Element::Scaled(*number, *scale),
                Some(Known::Message(place)) => Element::Message(*place),
                // The plan defines each type before its use, and one of this kind.
                Some(Known::Named(_)) | None => Element::Octets,
            },
            // Not plain: the plan has none in a choice.
            _ => Element::Octets,
        }
    }

    fn formatted(&mut self, formats: &str, item: &Item) -> usize {
        let number = Number::Unsigned(Unsigned::U8);
        let note = "The format of the octets. Others than the named ones are preserved.";
        let mut format = Field::unsigned("format".to_owned(), Unsigned::U8, note);
        format.constants = self.named("format", number, formats);
        let data = Field {
            ident: "data".to_owned(),
            path: "data".to_owned(),
            element: Element::Octets,
            arity: Arity::One,
            notes: notes::item(item),
            constants: Vec::new(),
        };
        let note = format!("{}: octets in one of several formats.", item.name);
        self.add(
            &item.name,
            vec![note],
            vec![format, data],
            Source::Formatted,
        )
    }

    fn choice(&self, alternative: &Alternative<'_>) -> Field {
        let (choice, ty) = (alternative.choice, &alternative.ty);
        let name = (alternative.ident.as_str(), choice.scalar.units.as_str());
        let notes = vec![notes::choice(choice.index, &choice.scalar)];
        self.field(name, ty, (self.plain(ty), Arity::Optional), notes)
    }

    /// A field for each part of a bit field, and one for the other bits.
    fn bits(&self, bits: &BitField, parts: &[Part<'_>]) -> (Vec<Field>, Vec<Bits>) {
        let mut fields: Vec<_> = parts.iter().map(|part| self.part(part)).collect();
        let places = parts.iter().map(|part| Bits {
            mask: part.field.mask(),
            from: part.field.from,
        });
        let mut places: Vec<_> = places.collect();
        let named = places.iter().fold(0, |mask, place| mask | place.mask);
        let reserved = bits.base.max() & !named;
        if reserved != 0 {
            let ident = unused("reserved", &fields);
            let note = format!("The bits without a name, in place: {reserved:#x}.");
            fields.push(Field::unsigned(ident, bits.base, &note));
            places.push(Bits {
                mask: reserved,
                from: 0,
            });
        }
        (fields, places)
    }

    fn part(&self, part: &Part<'_>) -> Field {
        let number = Number::Unsigned(part.width);
        let is_bool = part.field.from == part.field.to && part.values.is_none();
        let values = part.values.as_deref();
        Field {
            ident: part.ident.clone(),
            path: part.field.name.clone(),
            element: if is_bool {
                Element::Bool
            } else {
                Element::Number(number)
            },
            arity: Arity::One,
            notes: notes::part(part.field, part.limits),
            constants: values.map_or_else(Vec::new, |it| self.named(&part.ident, number, it)),
        }
    }

    /// The named values of a type, or of the elements of an array.
    fn constants(&self, field: &str, ty: &Type) -> Vec<Constant> {
        match ty {
            Type::Named { ident, number } => self.named(field, *number, ident),
            Type::Array { element, .. } => self.constants(field, element),
            _ => Vec::new(),
        }
    }

    fn named(&self, field: &str, number: Number, ident: &str) -> Vec<Constant> {
        let Some(Known::Named(values)) = self.known.get(ident) else {
            return Vec::new();
        };
        let (least, most) = number.integers().unwrap_or_default();
        let values = values.iter();
        let values = values.filter(|(_, value)| (least..=most).contains(&value.index));
        let constants = values.map(|(name, value)| Constant {
            name: format!("{field}_{name}").to_ascii_uppercase(),
            number,
            value: value.index,
            notes: vec![notes::value(value).join(" ")],
        });
        constants.collect()
    }
}

/// The item in a list or an array.
fn content(item: &Item) -> &Item {
    item.shape.items().next().unwrap_or(item)
}

/// The field that says which of the alternatives is present.
fn selector(
    name: &str,
    number: Unsigned,
    note: &str,
    alternatives: &[Field],
    indexes: impl Iterator<Item = i128>,
) -> Field {
    let ident = unused(name, alternatives);
    let constants = alternatives.iter().zip(indexes);
    let constants = constants.map(|(alternative, value)| Constant {
        name: format!("{ident}_{}", alternative.ident).to_ascii_uppercase(),
        number: Number::Unsigned(number),
        value,
        notes: Vec::new(),
    });
    Field {
        constants: constants.collect(),
        ..Field::unsigned(ident.clone(), number, note)
    }
}

/// A name that no field has.
fn unused(name: &str, fields: &[Field]) -> String {
    let mut candidate = name.to_owned();
    let mut number = 2;
    while fields.iter().any(|field| field.ident == candidate) {
        candidate = format!("{name}_{number}");
        number += 1;
    }
    candidate
}
