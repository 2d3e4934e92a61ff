//! Reads fields: numbers, bit fields, strings, octets, and their value sets.

use roxmltree::Node as Xml;

use super::element::{Children, EXTENSION, Reader};
use super::{
    ChoiceEnum, Construct, FormatEnum, Kind, ScalarField, ScaleRange, SubField, ValueEnum,
    ValueRange, ValueSet, Values,
};
use crate::model::Rounding;

impl Reader<'_> {
    /// Reads type, units and meaning of a `fixed_field` or `type_and_units_enum`.
    pub(super) fn scalar(&mut self, xml: Xml<'_, '_>) -> Option<ScalarField> {
        let before = self.report.errors();
        let children = self.enter(xml);
        let number = self.number(xml, "field_type");
        let units = self.required(xml, "field_units");
        let scale = children.find("scale_range");
        let scale = scale.map(|xml| self.scale_range(xml));
        let values = self.values(&children);
        let units = units?;
        // Further mistakes of the whole field are reported, but not its parts alone.
        if self.report.errors() > before {
            return None;
        }
        Some(ScalarField {
            number: number?,
            units,
            scale: scale.flatten(),
            values,
        })
    }

    /// Reads a `value_set` or `declared_value_set`.
    fn values(&mut self, children: &Children<'_, '_>) -> Option<Values> {
        if let Some(declared) = children.find("declared_value_set") {
            self.name(declared);
            let target = self.reference(declared, Construct::ValueSet);
            return target.map(Values::Declared);
        }
        let set = children.find("value_set")?;
        self.value_set(set).map(Values::Here)
    }

    fn scale_range(&mut self, xml: Xml<'_, '_>) -> Option<ScaleRange> {
        const ROUNDINGS: [(&str, Rounding); 3] = [
            ("round", Rounding::Round),
            ("floor", Rounding::Floor),
            ("ceiling", Rounding::Ceiling),
        ];
        self.enter(xml);
        let lower = self.expression(xml, "real_lower_limit");
        let upper = self.expression(xml, "real_upper_limit");
        let rounding = self
            .required(xml, "integer_function")
            .and_then(|text| self.word(&text, "integer_function", &ROUNDINGS));
        let centred = self.centred(xml);
        Some(ScaleRange {
            span: self.span(xml),
            lower: lower?,
            upper: upper?,
            rounding: rounding?,
            centred: centred?,
        })
    }

    /// Reads the attribute `bias` of our own namespace, which makes the zero of a signed integer
    /// the centre of its range: the Reference Architecture has such numbers, JSIDL cannot express
    /// them.
    fn centred(&mut self, xml: Xml<'_, '_>) -> Option<bool> {
        let Some(bias) = self.attribute(xml, (EXTENSION, "bias")) else {
            return Some(false);
        };
        self.word(&bias, "bias", &[("centre", true)])
    }

    /// Reads a `value_set`.
    pub(super) fn value_set(&mut self, xml: Xml<'_, '_>) -> Option<ValueSet> {
        let before = self.report.errors();
        let children = self.enter(xml);
        let offset = self.flag(xml, "offset_to_lower_limit");
        let (mut ranges, mut values) = (Vec::new(), Vec::new());
        for child in children {
            if child.tag_name().name() == "value_range" {
                ranges.extend(self.value_range(child));
            } else {
                values.extend(self.value_enum(child));
            }
        }
        (self.report.errors() == before).then(|| ValueSet {
            span: self.span(xml),
            offset_to_lower_limit: offset.ok().flatten().unwrap_or(false),
            ranges,
            values,
        })
    }

    fn value_range(&mut self, xml: Xml<'_, '_>) -> Option<ValueRange> {
        self.enter(xml);
        let lower = self.expression(xml, "lower_limit");
        let upper = self.expression(xml, "upper_limit");
        let lower_exclusive = self.exclusive(xml, "lower_limit_type");
        let upper_exclusive = self.exclusive(xml, "upper_limit_type");
        Some(ValueRange {
            span: self.span(xml),
            lower: lower?,
            upper: upper?,
            lower_exclusive: lower_exclusive?,
            upper_exclusive: upper_exclusive?,
            interpretation: self.text(xml, "interpretation"),
        })
    }

    fn exclusive(&mut self, xml: Xml<'_, '_>, attribute: &str) -> Option<bool> {
        let text = self.required(xml, attribute)?;
        self.word(
            &text,
            attribute,
            &[("inclusive", false), ("exclusive", true)],
        )
    }

    fn value_enum(&mut self, xml: Xml<'_, '_>) -> Option<ValueEnum> {
        self.enter(xml);
        let index = self.expression(xml, "enum_index");
        let name = self.required(xml, "enum_const");
        Some(ValueEnum {
            span: self.span_of(xml, "enum_index"),
            index: index?,
            name: name?.value,
            interpretation: self.text(xml, "interpretation"),
        })
    }

    /// Reads a `bit_field`.
    pub(super) fn bit_field(&mut self, xml: Xml<'_, '_>) -> Option<Kind> {
        let before = self.report.errors();
        let children = self.enter(xml).into_iter();
        let base = self.unsigned(xml);
        let fields = children.filter_map(|child| self.sub_field(child)).collect();
        let base = base.filter(|_| self.report.errors() == before)?;
        Some(Kind::Bits { base, fields })
    }

    fn sub_field(&mut self, xml: Xml<'_, '_>) -> Option<SubField> {
        let children = self.enter(xml);
        let name = self.name(xml);
        let values = self.values(&children);
        let range = children.find("bit_range")?;
        self.enter(range);
        let from = self.expression(range, "from_index");
        let to = self.expression(range, "to_index");
        Some(SubField {
            span: self.span(xml),
            name: name?,
            from: from?,
            to: to?,
            values: values?,
            interpretation: self.text(xml, "interpretation"),
        })
    }

    /// Reads a `variable_field`.
    pub(super) fn variable_field(&mut self, xml: Xml<'_, '_>) -> Option<Kind> {
        let before = self.report.errors();
        let field = self.enter(xml).find("type_and_units_field")?;
        let children = self.enter(field).into_iter();
        let choices = children.filter_map(|child| self.choice(child)).collect();
        (self.report.errors() == before).then_some(Kind::Measure { choices })
    }

    fn choice(&mut self, xml: Xml<'_, '_>) -> Option<ChoiceEnum> {
        let index = self.expression(xml, "index");
        let name = match self.attribute(xml, "name") {
            None => Some(None),
            Some(name) => self.identifier(name).map(Some),
        };
        let scalar = self.scalar(xml);
        Some(ChoiceEnum {
            span: self.span_of(xml, "index"),
            index: index?,
            name: name?,
            scalar: scalar?,
        })
    }

    /// Reads a `fixed_length_string`.
    pub(super) fn fixed_string(&mut self, xml: Xml<'_, '_>) -> Option<Kind> {
        self.enter(xml);
        let length = self.expression(xml, "string_length")?;
        Some(Kind::FixedString { length })
    }

    /// Reads a `variable_length_string`.
    pub(super) fn variable_string(&mut self, xml: Xml<'_, '_>) -> Option<Kind> {
        let found = self.enter(xml).find("count_field")?;
        let count = self.count(found)?;
        Some(Kind::VariableString { count })
    }

    /// Reads a `variable_length_field`.
    pub(super) fn blob(&mut self, xml: Xml<'_, '_>) -> Option<Kind> {
        let children = self.enter(xml);
        let format = self.required(xml, "field_format");
        let count = self.count(children.find("count_field")?);
        Some(Kind::Blob {
            count: count?,
            format: format?.value,
        })
    }

    /// Reads a `variable_format_field`.
    pub(super) fn formatted_blob(&mut self, xml: Xml<'_, '_>) -> Option<Kind> {
        let children = self.enter(xml);
        let count = children.find("count_field");
        let count = count.and_then(|xml| self.count(xml));
        let formats = children.find("format_field");
        let formats = formats.and_then(|xml| self.formats(xml));
        Some(Kind::FormattedBlob {
            formats: formats?,
            count: count?,
        })
    }

    fn formats(&mut self, xml: Xml<'_, '_>) -> Option<Vec<FormatEnum>> {
        let before = self.report.errors();
        let mut formats = Vec::new();
        for child in self.enter(xml) {
            self.enter(child);
            let index = self.expression(child, "index");
            let name = self.required(child, "field_format");
            if let (Some(index), Some(name)) = (index, name) {
                formats.push(FormatEnum {
                    span: index.span,
                    index,
                    name: name.value,
                });
            }
        }
        (self.report.errors() == before).then_some(formats)
    }
}
