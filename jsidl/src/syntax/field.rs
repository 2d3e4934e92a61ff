//! Reads fields: numbers, bit fields, strings, octets, and their value sets.

use roxmltree::Node as Xml;

use super::element::Reader;
use super::{ChoiceEnum, FormatEnum, Kind, ScalarField, ScaleRange, SubField, ValueEnum};
use super::{ValueRange, ValueSet};
use crate::model::Rounding;

/// Namespace of our attributes beyond JSIDL.
const EXTENSION: &str = "urn:jaus-rs:jsidl";

impl Reader<'_> {
    /// Reads type, units and meaning of a `fixed_field` or `type_and_units_enum`.
    pub(super) fn scalar(&mut self, xml: Xml<'_, '_>) -> Option<ScalarField> {
        let number = self.number(xml, "field_type");
        let units = self.required(xml, "field_units");
        let (mut scale, mut values) = (None, None);
        for child in self.children(xml) {
            match child.tag_name().name() {
                "scale_range" => self.once(&mut scale, child, xml),
                "value_set" => self.once(&mut values, child, xml),
                _ => {
                    let parent = xml.tag_name().name().to_owned();
                    self.misplaced(child, &parent, "a `scale_range` or a `value_set`");
                }
            }
        }
        let scale = scale.map(|xml| self.scale_range(xml));
        let values = values.map(|xml| self.value_set(xml));
        Some(ScalarField {
            number: number?,
            units: units?.value,
            scale: transpose(scale)?,
            values: transpose(values)?,
        })
    }

    fn scale_range(&mut self, xml: Xml<'_, '_>) -> Option<ScaleRange> {
        const ROUNDINGS: [(&str, Rounding); 3] = [
            ("round", Rounding::Round),
            ("floor", Rounding::Floor),
            ("ceiling", Rounding::Ceiling),
        ];
        self.only(
            xml,
            &[
                "real_lower_limit",
                "real_upper_limit",
                "integer_function",
                "interpretation",
            ],
        );
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
        self.only(xml, &["offset_to_lower_limit"]);
        let offset = self.flag(xml, "offset_to_lower_limit");
        let mut sound = offset.is_ok();
        let (mut ranges, mut values) = (Vec::new(), Vec::new());
        for child in self.children(xml) {
            match child.tag_name().name() {
                "value_range" => {
                    let range = self.value_range(child);
                    sound &= range.is_some();
                    ranges.extend(range);
                }
                "value_enum" => {
                    let value = self.value_enum(child);
                    sound &= value.is_some();
                    values.extend(value);
                }
                _ => {
                    self.misplaced(child, "value_set", "`value_range` and `value_enum`");
                    sound = false;
                }
            }
        }
        sound.then(|| ValueSet {
            span: self.span(xml),
            offset_to_lower_limit: offset.ok().flatten().unwrap_or(false),
            ranges,
            values,
        })
    }

    fn value_range(&mut self, xml: Xml<'_, '_>) -> Option<ValueRange> {
        self.only(
            xml,
            &[
                "lower_limit",
                "lower_limit_type",
                "upper_limit",
                "upper_limit_type",
                "interpretation",
            ],
        );
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
        self.only(xml, &["enum_index", "enum_const", "interpretation"]);
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
        let base = self.unsigned(xml);
        let mut sound = true;
        let mut fields = Vec::new();
        for child in self.children(xml) {
            if child.tag_name().name() == "sub_field" {
                let field = self.sub_field(child);
                sound &= field.is_some();
                fields.extend(field);
            } else {
                self.misplaced(child, "bit_field", "`sub_field`s");
                sound = false;
            }
        }
        if sound && fields.is_empty() {
            self.lacks(xml, "sub_field");
            sound = false;
        }
        Some(Kind::Bits {
            base: base.filter(|_| sound)?,
            fields,
        })
    }

    fn sub_field(&mut self, xml: Xml<'_, '_>) -> Option<SubField> {
        self.only(xml, &["name", "interpretation"]);
        let name = self.name(xml);
        let (mut range, mut values) = (None, None);
        for child in self.children(xml) {
            match child.tag_name().name() {
                "bit_range" => self.once(&mut range, child, xml),
                "value_set" => self.once(&mut values, child, xml),
                _ => self.misplaced(child, "sub_field", "a `bit_range` and a `value_set`"),
            }
        }
        if range.is_none() {
            self.lacks(xml, "bit_range");
        }
        if values.is_none() {
            self.lacks(xml, "value_set");
        }
        let values = values.and_then(|xml| self.value_set(xml));
        let range = range?;
        self.only(range, &["from_index", "to_index", "interpretation"]);
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
        let field = self.only_child(xml, "type_and_units_field")?;
        self.only(field, &[]);
        let mut sound = true;
        let mut choices = Vec::new();
        for child in self.children(field) {
            if child.tag_name().name() == "type_and_units_enum" {
                let choice = self.choice(child);
                sound &= choice.is_some();
                choices.extend(choice);
            } else {
                self.misplaced(child, "type_and_units_field", "`type_and_units_enum`s");
                sound = false;
            }
        }
        if sound && choices.is_empty() {
            self.lacks(field, "type_and_units_enum");
            sound = false;
        }
        sound.then_some(Kind::Measure { choices })
    }

    fn choice(&mut self, xml: Xml<'_, '_>) -> Option<ChoiceEnum> {
        self.only(
            xml,
            &[
                "name",
                "index",
                "field_type",
                "field_units",
                "interpretation",
            ],
        );
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
        for child in self.children(xml) {
            self.misplaced(child, "fixed_length_string", "nothing");
        }
        let length = self.expression(xml, "string_length")?;
        Some(Kind::FixedString { length })
    }

    /// Reads a `variable_length_string`.
    pub(super) fn variable_string(&mut self, xml: Xml<'_, '_>) -> Option<Kind> {
        let found = self.only_child(xml, "count_field")?;
        let count = self.count(xml, "count_field", Some(found))?;
        Some(Kind::VariableString { count })
    }

    /// Reads a `variable_length_field`.
    pub(super) fn blob(&mut self, xml: Xml<'_, '_>) -> Option<Kind> {
        let format = self.required(xml, "field_format");
        let found = self.only_child(xml, "count_field")?;
        let count = self.count(xml, "count_field", Some(found));
        Some(Kind::Blob {
            count: count?,
            format: format?.value,
        })
    }

    /// Reads a `variable_format_field`.
    pub(super) fn formatted_blob(&mut self, xml: Xml<'_, '_>) -> Option<Kind> {
        let (mut format, mut count) = (None, None);
        for child in self.children(xml) {
            match child.tag_name().name() {
                "format_field" => self.once(&mut format, child, xml),
                "count_field" => self.once(&mut count, child, xml),
                _ => self.misplaced(
                    child,
                    "variable_format_field",
                    "a `format_field` and a `count_field`",
                ),
            }
        }
        if format.is_none() {
            self.lacks(xml, "format_field");
        }
        let count = self.count(xml, "count_field", count);
        let formats = format.and_then(|xml| self.formats(xml));
        Some(Kind::FormattedBlob {
            formats: formats?,
            count: count?,
        })
    }

    fn formats(&mut self, xml: Xml<'_, '_>) -> Option<Vec<FormatEnum>> {
        self.only(xml, &[]);
        let mut sound = true;
        let mut formats = Vec::new();
        for child in self.children(xml) {
            if child.tag_name().name() != "format_enum" {
                self.misplaced(child, "format_field", "`format_enum`s");
                sound = false;
                continue;
            }
            self.only(child, &["index", "field_format", "interpretation"]);
            let index = self.expression(child, "index");
            let name = self.required(child, "field_format");
            match (index, name) {
                (Some(index), Some(name)) => formats.push(FormatEnum {
                    span: index.span,
                    index,
                    name: name.value,
                }),
                _ => sound = false,
            }
        }
        if sound && formats.is_empty() {
            self.lacks(xml, "format_enum");
            sound = false;
        }
        sound.then_some(formats)
    }

    /// The only permitted, mandatory child of an element.
    fn only_child<'a, 'x>(&mut self, xml: Xml<'a, 'x>, element: &str) -> Option<Xml<'a, 'x>> {
        let mut found = None;
        for child in self.children(xml) {
            if child.tag_name().name() == element {
                self.once(&mut found, child, xml);
            } else {
                let parent = xml.tag_name().name().to_owned();
                self.misplaced(child, &parent, &format!("one `{element}`"));
            }
        }
        if found.is_none() {
            self.lacks(xml, element);
        }
        found
    }
}

/// `None` if it was present but unreadable.
fn transpose<T>(read: Option<Option<T>>) -> Option<Option<T>> {
    match read {
        None => Some(None),
        Some(read) => read.map(Some),
    }
}
