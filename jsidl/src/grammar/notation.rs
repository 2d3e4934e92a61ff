//! Constructors of the table.

use super::{Attribute, Element, Occurs, Part, Value};

pub(super) const NAME: Attribute = one("name", Value::Identifier);
pub(super) const PATH_NAME: Attribute = one("name", Value::Path);
pub(super) const INTERPRETATION: Attribute = opt("interpretation", Value::Text);

pub(super) const fn element(
    name: &'static str,
    attributes: &'static [Attribute],
    parts: &'static [Part],
    holds: &'static str,
) -> Element {
    Element {
        name,
        attributes,
        parts,
        text: false,
        holds,
    }
}

pub(super) const fn empty(name: &'static str, attributes: &'static [Attribute]) -> Element {
    element(name, attributes, &[], "nothing")
}

pub(super) const fn text(name: &'static str) -> Element {
    Element {
        text: true,
        ..element(name, &[], &[], "text")
    }
}

/// A mandatory attribute.
pub(super) const fn one(name: &'static str, value: Value) -> Attribute {
    Attribute {
        name,
        value,
        occurs: [Occurs::Once; 2],
    }
}

/// An optional attribute.
pub(super) const fn opt(name: &'static str, value: Value) -> Attribute {
    Attribute {
        name,
        value,
        occurs: [Occurs::Optional; 2],
    }
}

/// An attribute that only the reader accepts.
pub(super) const fn beyond(name: &'static str) -> Attribute {
    Attribute {
        name,
        value: Value::Text,
        occurs: [Occurs::Never; 2],
    }
}

pub(super) const fn part(elements: &'static [&'static str], occurs: Occurs) -> Part {
    Part {
        elements,
        newer: &[],
        occurs: [occurs; 2],
        dispensable: false,
        surplus: None,
        missing: None,
    }
}

impl Attribute {
    /// Absent from edition 1.0.
    pub(super) const fn since_1_1(self) -> Self {
        self.in_1_0(Occurs::Never)
    }

    pub(super) const fn in_1_0(mut self, occurs: Occurs) -> Self {
        self.occurs[0] = occurs;
        self
    }
}

impl Part {
    pub(super) const fn in_1_0(mut self, occurs: Occurs) -> Self {
        self.occurs[0] = occurs;
        self
    }

    pub(super) const fn since_1_1(self) -> Self {
        self.in_1_0(Occurs::Never)
    }

    pub(super) const fn newer(mut self, elements: &'static [&'static str]) -> Self {
        self.newer = elements;
        self
    }

    pub(super) const fn dispensable(mut self) -> Self {
        self.dispensable = true;
        self
    }

    pub(super) const fn surplus(mut self, finding: &'static str) -> Self {
        self.surplus = Some(finding);
        self
    }

    pub(super) const fn missing(mut self, finding: &'static str) -> Self {
        self.missing = Some(finding);
        self
    }
}
