//! Reads records, sequences, lists, variants and arrays, and checks which constructs are permitted
//! where.

use roxmltree::Node as Xml;

use super::element::Reader;
use super::{Construct, CountField, Dimension, Kind, Node, Target};
use crate::model::{GroupKind, Unsigned};
use crate::source::{Span, Spanned};

/// Position of a field or composite, which determines what is permitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// Only fields.
    Record,
    /// Fields, but no further array.
    Array,
    /// Only composites: in a sequence, list or variant, or at the top of a section.
    Composite,
    /// Anything: in a type set.
    TypeSet,
}

impl Place {
    const fn admits(self, construct: Construct) -> bool {
        match self {
            Self::Record => construct.is_field(),
            Self::Array => construct.is_field() && !matches!(construct, Construct::Array),
            Self::Composite => construct.is_composite(),
            Self::TypeSet => construct.is_field() || construct.is_composite(),
        }
    }

    const fn allowed(self) -> &'static str {
        match self {
            Self::Record => "fields: put composites into a `sequence` instead",
            Self::Array => "one field",
            Self::Composite => "composites: put fields into a `record`",
            Self::TypeSet => "declarations",
        }
    }
}

/// The attributes of every construct.
const COMMON: [&str; 3] = ["name", "optional", "interpretation"];

impl Reader<'_> {
    /// Reads a field, a composite or a reference to one. `None` for anything else, which is
    /// reported.
    pub(super) fn node(&mut self, xml: Xml<'_, '_>, place: Place) -> Option<Node> {
        let element = xml.tag_name().name();
        let Some((construct, declared)) =
            Construct::of(element).filter(|(construct, _)| place.admits(*construct))
        else {
            let parent = xml.parent().map_or("", |p| p.tag_name().name()).to_owned();
            self.misplaced(xml, &parent, place.allowed());
            return None;
        };
        let before = self.report.errors();
        let name = self.name(xml);
        let optional = self.flag(xml, "optional");
        let kind = if declared {
            self.reference(xml, construct, &COMMON).map(Kind::Reference)
        } else {
            self.construct(xml, construct)
        };
        Some(Node {
            span: self.span(xml),
            name: name.unwrap_or_default(),
            optional: optional.unwrap_or_default(),
            interpretation: self.attribute(xml, "interpretation").map(|a| a.value),
            kind: kind.unwrap_or(Kind::Faulty),
            sound: self.report.errors() == before,
        })
    }

    /// Reads the target of a `declared_…` element.
    pub(super) fn reference(
        &mut self,
        xml: Xml<'_, '_>,
        construct: Construct,
        attributes: &[&str],
    ) -> Option<Target> {
        self.only(xml, &[attributes, &["declared_type_ref"]].concat());
        for child in self.children(xml) {
            let element = xml.tag_name().name().to_owned();
            self.misplaced(child, &element, "nothing");
        }
        let path = self.required(xml, "declared_type_ref")?;
        Some(Target { construct, path })
    }

    fn construct(&mut self, xml: Xml<'_, '_>, construct: Construct) -> Option<Kind> {
        let own: &[&str] = match construct {
            Construct::FixedField => &["field_type", "field_units"],
            Construct::BitField => &["field_type_unsigned"],
            Construct::FixedLengthString => &["string_length"],
            Construct::VariableLengthField => &["field_format"],
            _ => &[],
        };
        self.only(xml, &[&COMMON, own].concat());
        match construct {
            Construct::Record => self.group(xml, GroupKind::Record),
            Construct::Sequence => self.group(xml, GroupKind::Sequence),
            Construct::List => self.list(xml),
            Construct::Variant => self.variant(xml),
            Construct::Array => self.array(xml),
            Construct::FixedField => self.scalar(xml).map(Kind::Scalar),
            Construct::BitField => self.bit_field(xml),
            Construct::VariableField => self.variable_field(xml),
            Construct::FixedLengthString => self.fixed_string(xml),
            Construct::VariableLengthString => self.variable_string(xml),
            Construct::VariableLengthField => self.blob(xml),
            Construct::VariableFormatField => self.formatted_blob(xml),
            Construct::Header
            | Construct::Body
            | Construct::Footer
            | Construct::MessageDef
            | Construct::EventDef => None,
        }
    }

    fn group(&mut self, xml: Xml<'_, '_>, kind: GroupKind) -> Option<Kind> {
        let place = match kind {
            GroupKind::Record => Place::Record,
            GroupKind::Sequence => Place::Composite,
        };
        let mut sound = true;
        let mut presence: Option<Spanned<Unsigned>> = None;
        let mut members = Vec::new();
        for child in self.children(xml) {
            if child.tag_name().name() != "presence_vector" {
                let member = self.node(child, place);
                sound &= member.is_some();
                members.extend(member);
            } else if presence.is_some() {
                self.repeated(child, xml.tag_name().name());
                sound = false;
            } else {
                self.only(child, &["field_type_unsigned"]);
                let unsigned = self.unsigned(child);
                sound &= unsigned.is_some();
                presence = unsigned.map(|value| Spanned {
                    value,
                    span: self.span(child),
                });
            }
        }
        // The members are kept nevertheless, so that their references are checked.
        if !sound {
            members.push(self.faulty(xml));
        }
        Some(Kind::Group {
            kind,
            presence,
            members,
        })
    }

    fn faulty(&self, xml: Xml<'_, '_>) -> Node {
        Node {
            span: self.span(xml),
            name: String::new(),
            optional: None,
            interpretation: None,
            kind: Kind::Faulty,
            sound: false,
        }
    }

    fn list(&mut self, xml: Xml<'_, '_>) -> Option<Kind> {
        let mut count = None;
        let mut elements = Vec::new();
        for child in self.children(xml) {
            if child.tag_name().name() == "count_field" {
                self.once(&mut count, child, xml);
            } else {
                elements.push(child);
            }
        }
        let element = self.sole(xml, &elements, Place::Composite);
        let count = self.count(xml, "count_field", count);
        Some(Kind::List {
            count: count?,
            element: Box::new(element?),
        })
    }

    fn variant(&mut self, xml: Xml<'_, '_>) -> Option<Kind> {
        let mut tag = None;
        let mut alternatives = Vec::new();
        for child in self.children(xml) {
            if child.tag_name().name() == "vtag_field" {
                self.once(&mut tag, child, xml);
            } else {
                let alternative = self.node(child, Place::Composite);
                alternatives.push(alternative.unwrap_or_else(|| self.faulty(child)));
            }
        }
        Some(Kind::Variant {
            tag: self.count(xml, "vtag_field", tag)?,
            alternatives,
        })
    }

    fn array(&mut self, xml: Xml<'_, '_>) -> Option<Kind> {
        let mut sound = true;
        let mut dimensions = Vec::new();
        let mut elements = Vec::new();
        for child in self.children(xml) {
            if child.tag_name().name() == "dimension" {
                self.only(child, &["name", "size", "interpretation"]);
                let dimension = self.dimension(child);
                sound &= dimension.is_some();
                dimensions.extend(dimension);
            } else {
                elements.push(child);
            }
        }
        if sound && dimensions.is_empty() {
            self.lacks(xml, "dimension");
            sound = false;
        }
        let element = self.sole(xml, &elements, Place::Array)?;
        sound.then(|| Kind::Array {
            dimensions,
            element: Box::new(element),
        })
    }

    fn dimension(&mut self, xml: Xml<'_, '_>) -> Option<Dimension> {
        let name = self.name(xml);
        let size = self.expression(xml, "size");
        Some(Dimension {
            span: self.span(xml),
            name: name?,
            size: size?,
        })
    }

    /// The one element of a list or array.
    fn sole(&mut self, xml: Xml<'_, '_>, elements: &[Xml<'_, '_>], place: Place) -> Option<Node> {
        let name = xml.tag_name().name();
        let at = self.span(xml);
        match elements {
            [element] => self.node(*element, place),
            [] => {
                let element = if place == Place::Array {
                    "a field"
                } else {
                    "a composite"
                };
                let message = format!("`{name}` has no element type: add {element}");
                self.report.error(at, message);
                None
            }
            [_, second, ..] => {
                let at = self.span(*second);
                let message =
                    format!("`{name}` has one element type only: put the others elsewhere");
                self.report.error(at, message);
                for element in elements {
                    self.node(*element, place);
                }
                None
            }
        }
    }

    /// Keeps the first of several elements where one is permitted.
    pub(super) fn once<'a, 'x>(
        &mut self,
        slot: &mut Option<Xml<'a, 'x>>,
        found: Xml<'a, 'x>,
        parent: Xml<'_, '_>,
    ) {
        if slot.is_some() {
            self.repeated(found, parent.tag_name().name());
        } else {
            *slot = Some(found);
        }
    }

    /// Reads a mandatory `count_field` or `vtag_field`.
    pub(super) fn count(
        &mut self,
        parent: Xml<'_, '_>,
        element: &str,
        found: Option<Xml<'_, '_>>,
    ) -> Option<CountField> {
        let Some(xml) = found else {
            self.lacks(parent, element);
            return None;
        };
        self.only(
            xml,
            &[
                "field_type_unsigned",
                "min_count",
                "max_count",
                "interpretation",
            ],
        );
        let unsigned = self.unsigned(xml);
        let min = self.optional_expression(xml, "min_count");
        let max = self.optional_expression(xml, "max_count");
        Some(CountField {
            span: self.span(xml),
            unsigned: unsigned?,
            min: min.ok()?,
            max: max.ok()?,
        })
    }

    /// The position of the first of several attributes, or else of the element.
    pub(super) fn span_of(&self, xml: Xml<'_, '_>, attribute: &str) -> Span {
        self.attribute(xml, attribute)
            .map_or_else(|| self.span(xml), |a| a.span)
    }
}
