//! The grammar of JSIDL as data: for each element its attributes and children, in both editions of
//! the language.
//!
//! The reader accepts what this table lists and reports everything else. It is more lenient than
//! the standard: published definitions leave out mandatory parts and put elements in any order.
//! [`strict`] holds a text against the standard, as a schema validator does.

mod elements;
#[cfg(test)]
mod facts;
mod machines;
mod notation;
pub(crate) mod strict;
mod values;

pub(crate) use values::{Value, is_unit, units};

/// The editions of the language, each with a namespace of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Edition {
    /// AS5684
    V1_0,
    /// AS5684A
    V1_1,
}

impl Edition {
    const ALL: [Self; 2] = [Self::V1_0, Self::V1_1];

    /// The namespace of its elements.
    pub(crate) const fn namespace(self) -> &'static str {
        match self {
            Self::V1_0 => "urn:jaus:jsidl:1.0",
            Self::V1_1 => "urn:jaus:jsidl:1.1",
        }
    }

    /// The edition with this namespace.
    pub(crate) fn of_namespace(uri: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|it| it.namespace() == uri)
    }
}

/// How often an attribute or a child occurs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Occurs {
    /// Not in this edition.
    Never,
    /// At most once.
    Optional,
    /// Exactly once.
    Once,
    /// Any number of times.
    Any,
    /// At least once.
    Some,
}

impl Occurs {
    pub(crate) const fn is_mandatory(self) -> bool {
        matches!(self, Self::Once | Self::Some)
    }

    pub(crate) const fn is_repeated(self) -> bool {
        matches!(self, Self::Any | Self::Some)
    }
}

/// An attribute of an element.
#[derive(Debug)]
pub(crate) struct Attribute {
    pub(crate) name: &'static str,
    pub(crate) value: Value,
    /// In edition 1.0 and in 1.1. Attributes that neither has are accepted by the reader only.
    occurs: [Occurs; 2],
}

impl Attribute {
    pub(crate) const fn occurs(&self, edition: Edition) -> Occurs {
        self.occurs[edition as usize]
    }
}

/// Children of an element at one position of its content: one element, or a choice of several.
#[derive(Debug)]
pub(crate) struct Part {
    elements: &'static [&'static str],
    /// Further elements since edition 1.1.
    newer: &'static [&'static str],
    /// In edition 1.0 and in 1.1. Children that neither has are accepted by the reader only.
    occurs: [Occurs; 2],
    /// Whether the reader copes without a mandatory part, because published definitions lack it.
    pub(crate) dispensable: bool,
    /// The finding for an element that the part has no room for, after the parent's name.
    pub(crate) surplus: Option<&'static str>,
    /// The finding for a missing part, after the parent's name.
    pub(crate) missing: Option<&'static str>,
}

impl Part {
    pub(crate) const fn occurs(&self, edition: Edition) -> Occurs {
        self.occurs[edition as usize]
    }

    /// The permitted elements of an edition.
    pub(crate) fn elements(&self, edition: Edition) -> impl Iterator<Item = &'static str> {
        let newer = match edition {
            Edition::V1_0 => &[][..],
            Edition::V1_1 => self.newer,
        };
        self.elements.iter().chain(newer).copied()
    }

    pub(crate) fn holds(&self, element: &str, edition: Edition) -> bool {
        self.elements(edition).any(|it| it == element)
    }
}

/// An element and its content.
#[derive(Debug)]
pub(crate) struct Element {
    pub(crate) name: &'static str,
    pub(crate) attributes: &'static [Attribute],
    /// In the order of the standard.
    pub(crate) parts: &'static [Part],
    /// Whether it holds text instead of elements.
    pub(crate) text: bool,
    /// A description of its content, for findings.
    pub(crate) holds: &'static str,
}

impl Element {
    pub(crate) fn attribute(&self, name: &str) -> Option<&'static Attribute> {
        self.attributes.iter().find(|it| it.name == name)
    }

    /// The part that holds an element in the newest edition, with its position.
    pub(crate) fn part(&self, element: &str) -> Option<(usize, &'static Part)> {
        let mut parts = self.parts.iter().enumerate();
        parts.find(|(_, part)| part.holds(element, Edition::V1_1))
    }
}

/// All elements of the language.
pub(crate) fn elements() -> impl Iterator<Item = &'static Element> {
    elements::ELEMENTS.iter().chain(machines::ELEMENTS)
}

/// The element with this name.
pub(crate) fn element(name: &str) -> Option<&'static Element> {
    elements().find(|it| it.name == name)
}
