//! The types of the package: what their files say, and the values that they stand for.

use std::collections::HashSet;

use crate::model::{Number, Scale, Unsigned};

/// A type: the content of its file, and the value that it stands for.
#[derive(Debug)]
pub(super) struct Definition {
    /// Such as `CoreReportStatusV1p0`.
    pub(super) name: String,
    /// The paragraphs about the type.
    pub(super) notes: Vec<String>,
    pub(super) fields: Vec<Field>,
    pub(super) source: Source,
}

/// The value of the dynamic codec that becomes the fields of a type.
#[derive(Debug)]
pub(super) enum Source {
    /// A group: a field for each slot.
    Group,
    /// The group of header, body and footer: a field for each slot that is not empty.
    Sections,
    /// Any value: it becomes the only field.
    Whole,
    /// A variant: its tag, then a field for each alternative.
    Variant,
    /// A measure: its index, then a field for each choice. The indexes of the choices.
    Measure(Vec<u8>),
    /// Octets in a format: the format, then the octets.
    Formatted,
    /// A bit field: a field for each place.
    Bits(Vec<Bits>),
}

impl Source {
    /// The kind of value, in JSIDL terms.
    pub(super) const fn kind(&self) -> &'static str {
        match self {
            Self::Group | Self::Sections => "a record or sequence",
            Self::Whole => "any value",
            Self::Variant => "a variant",
            Self::Measure(_) => "a variable field",
            Self::Formatted => "a variable format field",
            Self::Bits(_) => "a bit field",
        }
    }
}

/// Bits of a bit field.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bits {
    pub(super) mask: u64,
    /// The bit that becomes the lowest one.
    pub(super) from: u8,
}

impl Bits {
    /// These bits of a bit field.
    pub(super) fn of(self, raw: u64) -> u64 {
        (raw & self.mask).checked_shr(self.from.into()).unwrap_or(0)
    }
}

/// A field of a type.
#[derive(Debug)]
pub(super) struct Field {
    pub(super) ident: String,
    /// The name in the definition, for errors.
    pub(super) path: String,
    pub(super) element: Element,
    pub(super) arity: Arity,
    /// The paragraphs about the field.
    pub(super) notes: Vec<String>,
    pub(super) constants: Vec<Constant>,
}

impl Field {
    /// An unsigned integer that the definition does not name.
    pub(super) fn unsigned(ident: String, number: Unsigned, note: &str) -> Self {
        Self {
            path: ident.clone(),
            ident,
            element: Element::Number(Number::Unsigned(number)),
            arity: Arity::One,
            notes: vec![note.to_owned()],
            constants: Vec::new(),
        }
    }
}

/// The type of a field, or of its elements.
#[derive(Debug, Clone)]
pub(super) enum Element {
    Bool,
    Number(Number),
    /// A scaled integer.
    Scaled(Number, Scale),
    Text,
    /// `uint8[]`, so that it cannot be an element.
    Octets,
    /// A type of the package, by its place.
    Message(usize),
}

impl Element {
    /// The kind of value, in JSIDL terms.
    pub(super) const fn kind(&self) -> &'static str {
        match self {
            Self::Bool | Self::Message(_) => "a composite",
            Self::Number(_) | Self::Scaled(..) => "a number",
            Self::Text => "a string",
            Self::Octets => "a variable length field",
        }
    }
}

/// How many elements a field has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Arity {
    One,
    Optional,
    Many,
    Exactly(u64),
}

/// A named value of a field.
#[derive(Debug)]
pub(super) struct Constant {
    pub(super) name: String,
    pub(super) number: Number,
    pub(super) value: i128,
    /// The paragraphs about the value.
    pub(super) notes: Vec<String>,
}

/// All types of a package. Each one uses only those before it.
#[derive(Debug, Default)]
pub(super) struct Definitions {
    all: Vec<Definition>,
    /// Their names in lower case, because file systems may not distinguish the case.
    taken: HashSet<String>,
}

impl Definitions {
    pub(super) fn all(&self) -> &[Definition] {
        &self.all
    }

    pub(super) fn get(&self, place: usize) -> Option<&Definition> {
        self.all.get(place)
    }

    /// Reserves a name: this one, or one with a number if it is in use.
    pub(super) fn unused(&mut self, name: &str) -> String {
        let mut candidate = name.to_owned();
        let mut number = 2;
        while !self.taken.insert(candidate.to_ascii_lowercase()) {
            candidate = format!("{name}{number}");
            number += 1;
        }
        candidate
    }

    /// Adds a type with a reserved name; returns its place.
    pub(super) fn add(&mut self, mut definition: Definition) -> usize {
        let mut taken = HashSet::new();
        let fields = definition.fields.iter_mut();
        for constant in fields.flat_map(|field| &mut field.constants) {
            let base = constant.name.clone();
            let mut number = 2;
            while !taken.insert(constant.name.clone()) {
                constant.name = format!("{base}_{number}");
                number += 1;
            }
        }
        self.all.push(definition);
        self.all.len() - 1
    }
}
