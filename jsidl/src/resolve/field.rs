//! Resolves fields: computes their limits and collects their values.

use super::item::values as entries;
use super::{Resolved, Resolver};
use crate::check::{self, Placed};
use crate::model::{
    BitField, Choice, Count, Format, Meaning, NamedValue, Scalar, Scale, Shape, SubField, Unsigned,
    ValueRange, ValueSet,
};
use crate::syntax::{self, CountField, Expr, ScalarField, ScaleRange, TypeSetIndex, Values};

impl Resolver<'_> {
    /// Resolves a `count_field` or `vtag_field`.
    pub(super) fn count(&mut self, scope: TypeSetIndex, field: &CountField) -> Option<Count> {
        let limit = |resolver: &mut Self, limit: &Option<Expr>, name, default| match limit {
            None => Some(default),
            Some(expression) => {
                let value = resolver.integer(scope, expression, name)?;
                check::count_limit(
                    resolver.report,
                    expression.span,
                    name,
                    value,
                    field.unsigned,
                )
            }
        };
        let min = limit(self, &field.min, "min_count", 0);
        let max = limit(self, &field.max, "max_count", field.unsigned.max());
        check::count(
            self.report,
            field.span,
            Count {
                unsigned: field.unsigned,
                min: min?,
                max: max?,
            },
        )
    }

    /// Resolves the value of a `fixed_field` or `type_and_units_enum`.
    pub(super) fn scalar(&mut self, scope: TypeSetIndex, field: &ScalarField) -> Option<Scalar> {
        check::units(self.report, &field.units);
        let meaning = if let Some(range) = &field.scale {
            let scale = self.scale(scope, range)?;
            check::scale(self.report, range, scale, field.number)?;
            Meaning::Scaled(scale)
        } else if let Some(values) = &field.values {
            let set = self.values(scope, values)?;
            check::values_of_number(self.report, &set, field.number)
                .then_some(Meaning::Values(set.set))?
        } else {
            Meaning::Plain
        };
        Some(Scalar {
            number: field.number,
            units: field.units.value.clone(),
            meaning,
        })
    }

    /// Resolves the value set of a field, declared there or in a type set.
    fn values(&mut self, scope: TypeSetIndex, values: &Values) -> Option<Placed> {
        match values {
            Values::Here(written) => self.value_set(scope, written),
            Values::Declared(target) => match self.follow(scope, target)? {
                Resolved::Values(rated) => {
                    self.spend(1 + entries(&rated.set), target.path.span)?;
                    Some(rated.at(target.path.span))
                }
                _ => None,
            },
        }
    }

    fn scale(&mut self, scope: TypeSetIndex, range: &ScaleRange) -> Option<Scale> {
        let lower = self.value(scope, &range.lower);
        let upper = self.value(scope, &range.upper);
        Some(Scale {
            lower: lower?.real(),
            upper: upper?.real(),
            rounding: range.rounding,
        })
    }

    /// Resolves a `value_set`.
    pub(super) fn value_set(
        &mut self,
        scope: TypeSetIndex,
        set: &syntax::ValueSet,
    ) -> Option<Placed> {
        let ranges: Vec<_> = set
            .ranges
            .iter()
            .map(|range| self.value_range(scope, range))
            .collect();
        let values: Vec<_> = set
            .values
            .iter()
            .map(|value| {
                let index = self.integer(scope, &value.index, "enum_index")?;
                Some(NamedValue {
                    index: check::enum_index(self.report, value.index.span, index)?,
                    name: value.name.clone(),
                    interpretation: value.interpretation.clone(),
                })
            })
            .collect();
        let resolved = ValueSet {
            ranges: ranges.into_iter().collect::<Option<_>>()?,
            values: values.into_iter().collect::<Option<_>>()?,
        };
        check::value_set(self.report, set, &resolved).then(|| Placed::new(set, resolved))
    }

    fn value_range(
        &mut self,
        scope: TypeSetIndex,
        range: &syntax::ValueRange,
    ) -> Option<ValueRange> {
        let lower = self.value(scope, &range.lower);
        let upper = self.value(scope, &range.upper);
        let resolved = ValueRange {
            lower: lower?.real(),
            upper: upper?.real(),
            lower_exclusive: range.lower_exclusive,
            upper_exclusive: range.upper_exclusive,
            interpretation: range.interpretation.clone(),
        };
        check::value_range(self.report, range.span, &resolved).then_some(resolved)
    }

    /// Resolves a `bit_field`.
    pub(super) fn bit_field(
        &mut self,
        scope: TypeSetIndex,
        base: Unsigned,
        fields: &[syntax::SubField],
    ) -> Option<BitField> {
        let names = fields.iter().map(|f| (f.name.as_str(), f.span));
        let unique = self.report.unique("sub-fields", names);
        let resolved: Vec<_> = fields
            .iter()
            .map(|field| self.sub_field(scope, base, field))
            .collect();
        let resolved: Vec<SubField> = resolved.into_iter().collect::<Option<_>>()?;
        let apart = check::overlap(self.report, fields, &resolved);
        (unique && apart).then_some(BitField {
            base,
            fields: resolved,
        })
    }

    fn sub_field(
        &mut self,
        scope: TypeSetIndex,
        base: Unsigned,
        field: &syntax::SubField,
    ) -> Option<SubField> {
        let from = self.integer(scope, &field.from, "from_index");
        let to = self.integer(scope, &field.to, "to_index");
        let values = self.values(scope, &field.values);
        let (from, to) = check::bits(self.report, field, base, from?, to?)?;
        let values = values?;
        check::values_of_bits(self.report, &values, to - from + 1).then(|| SubField {
            name: field.name.clone(),
            from,
            to,
            values: values.set,
            interpretation: field.interpretation.clone(),
        })
    }

    /// Resolves a `fixed_length_string`.
    pub(super) fn fixed_string(&mut self, scope: TypeSetIndex, length: &Expr) -> Option<Shape> {
        let value = self.integer(scope, length, "string_length")?;
        let length = check::size(self.report, length.span, "string_length", value)?;
        Some(Shape::FixedString { length })
    }

    /// Resolves the `format_enum`s of a `variable_format_field`.
    pub(super) fn formats(
        &mut self,
        scope: TypeSetIndex,
        formats: &[syntax::FormatEnum],
    ) -> Option<Vec<Format>> {
        let resolved: Vec<_> = formats
            .iter()
            .map(|format| {
                let index = self.integer(scope, &format.index, "index")?;
                Some(Format {
                    index: check::octet_index(self.report, format.index.span, index)?,
                    name: format.name.clone(),
                })
            })
            .collect();
        let resolved: Vec<Format> = resolved.into_iter().collect::<Option<_>>()?;
        let indices = resolved
            .iter()
            .zip(formats)
            .map(|(f, s)| (f.index.into(), s.span));
        check::unique_indices(self.report, "formats", indices).then_some(resolved)
    }

    /// Resolves the `type_and_units_enum`s of a `variable_field`.
    pub(super) fn choices(
        &mut self,
        scope: TypeSetIndex,
        choices: &[syntax::ChoiceEnum],
    ) -> Option<Vec<Choice>> {
        let resolved: Vec<_> = choices
            .iter()
            .map(|choice| {
                let index = self.integer(scope, &choice.index, "index");
                let scalar = self.scalar(scope, &choice.scalar);
                Some(Choice {
                    index: check::octet_index(self.report, choice.index.span, index?)?,
                    name: choice.name.clone(),
                    scalar: scalar?,
                })
            })
            .collect();
        let resolved: Vec<Choice> = resolved.into_iter().collect::<Option<_>>()?;
        let indices = resolved
            .iter()
            .zip(choices)
            .map(|(c, s)| (c.index.into(), s.span));
        check::unique_indices(self.report, "choices of type and units", indices).then_some(resolved)
    }
}
