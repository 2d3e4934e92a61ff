//! Reads records, sequences, lists, variants and arrays.

use roxmltree::Node as Xml;

use super::element::{Children, Reader};
use super::{Construct, CountField, Dimension, Kind, Node, Target};
use crate::model::GroupKind;
use crate::source::{Span, Spanned};

impl Reader<'_> {
    /// Reads a field, a composite or a reference to one. `None` for anything else, which is
    /// reported.
    pub(super) fn node(&mut self, xml: Xml<'_, '_>) -> Option<Node> {
        let (construct, declared) = Construct::of(xml.tag_name().name())?;
        let before = self.report.errors();
        let name = self.name(xml);
        let optional = self.flag(xml, "optional");
        let kind = if declared {
            self.reference(xml, construct).map(Kind::Reference)
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

    /// Reads the target of a `declared_…` element: by default the declaration with its own name.
    pub(super) fn reference(&mut self, xml: Xml<'_, '_>, construct: Construct) -> Option<Target> {
        self.enter(xml);
        let path = match self.attribute(xml, "declared_type_ref") {
            Some(path) if path.value.is_empty() => self.required(xml, "declared_type_ref")?,
            Some(path) => path,
            None => self.attribute(xml, "name")?,
        };
        Some(Target { construct, path })
    }

    fn construct(&mut self, xml: Xml<'_, '_>, construct: Construct) -> Option<Kind> {
        match construct {
            Construct::Record => Some(self.group(xml, GroupKind::Record)),
            Construct::Sequence => Some(self.group(xml, GroupKind::Sequence)),
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
            | Construct::EventDef
            | Construct::ValueSet => None,
        }
    }

    fn group(&mut self, xml: Xml<'_, '_>, kind: GroupKind) -> Kind {
        let before = self.report.errors();
        let children = self.enter(xml);
        let presence = children.find("presence_vector").and_then(|vector| {
            self.enter(vector);
            let value = self.unsigned(vector)?;
            let span = self.span(vector);
            Some(Spanned { value, span })
        });
        let form_is_sound = self.report.errors() == before;
        let members = children.into_iter();
        let members = members.filter(|child| child.tag_name().name() != "presence_vector");
        let mut members: Vec<_> = members.filter_map(|child| self.node(child)).collect();
        // The members are kept nevertheless, so that their references are checked.
        if !form_is_sound {
            members.push(self.faulty(xml));
        }
        Kind::Group {
            kind,
            presence,
            members,
        }
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
        let children = self.enter(xml);
        let count = children.find("count_field");
        let element = self.element_type(children);
        let count = count.and_then(|count| self.count(count));
        Some(Kind::List {
            count: count?,
            element: Box::new(element?),
        })
    }

    fn variant(&mut self, xml: Xml<'_, '_>) -> Option<Kind> {
        let children = self.enter(xml);
        let tag = children.find("vtag_field");
        let alternatives = children.into_iter();
        let alternatives = alternatives.filter(|child| child.tag_name().name() != "vtag_field");
        let alternatives = alternatives.map(|child| {
            let alternative = self.node(child);
            alternative.unwrap_or_else(|| self.faulty(child))
        });
        let alternatives = alternatives.collect();
        Some(Kind::Variant {
            tag: self.count(tag?)?,
            alternatives,
        })
    }

    fn array(&mut self, xml: Xml<'_, '_>) -> Option<Kind> {
        let children = self.enter(xml);
        let dimensions: Vec<_> = children.named("dimension").collect();
        let read = dimensions.into_iter().map(|child| self.dimension(child));
        let dimensions: Vec<_> = read.collect();
        let element = self.element_type(children);
        Some(Kind::Array {
            dimensions: dimensions.into_iter().collect::<Option<_>>()?,
            element: Box::new(element?),
        })
    }

    fn dimension(&mut self, xml: Xml<'_, '_>) -> Option<Dimension> {
        self.enter(xml);
        let name = self.name(xml);
        let size = self.expression(xml, "size");
        Some(Dimension {
            span: self.span(xml),
            name: name?,
            size: size?,
        })
    }

    /// The element type of a list or array.
    fn element_type(&mut self, children: Children<'_, '_>) -> Option<Node> {
        let mut elements = children.into_iter();
        let element = elements.find(|it| Construct::of(it.tag_name().name()).is_some())?;
        self.node(element)
    }

    /// Reads a `count_field` or `vtag_field`.
    pub(super) fn count(&mut self, xml: Xml<'_, '_>) -> Option<CountField> {
        self.enter(xml);
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
