//! Rules for numbers, value sets and bit fields.

use crate::diagnostic::Report;
use crate::grammar::{self, Edition};
use crate::model::{Number, Scale, SubField, Unsigned, ValueRange, ValueSet};
use crate::source::{Span, Spanned};
use crate::spelling::{nearest, shortened};
use crate::syntax::{self, ScaleRange};

use super::unique_indices;

/// Units are those of the standard.
pub(crate) fn units(report: &mut Report, units: &Spanned<String>) {
    if grammar::is_unit(&units.value) {
        return;
    }
    let known = grammar::units(Edition::V1_1);
    let advice = match nearest(&units.value, known) {
        Some(unit) => format!("did you mean `{unit}`?"),
        None => "write one of the standard, or `one`".to_owned(),
    };
    let message = format!("`{}` is not a unit: {advice}", shortened(&units.value));
    report.error(units.span, message);
}

/// Scales need an integer of at most four octets, and two different limits in order. A signed one
/// has its zero at the centre of the range.
pub(crate) fn scale(
    report: &mut Report,
    range: &ScaleRange,
    scale: Scale,
    number: Number,
) -> Option<()> {
    let span = range.span;
    let advice = match number {
        Number::Unsigned(_) if range.centred => Some(
            "only a signed integer's range is centred on zero: change the `field_type`, or \
             remove the attribute `bias`",
        ),
        Number::F32 | Number::F64 => {
            Some("a `scale_range` needs an integer: change the `field_type`, or remove the range")
        }
        Number::Unsigned(_) | Number::Signed(_) => None,
    };
    if let Some(message) = advice {
        report.error(span, message);
        return None;
    }
    if matches!(number, Number::Signed(_)) && !range.centred {
        report.warning(
            span,
            "the standard has no rule for a `scale_range` of a signed integer: 0 is taken as the \
             centre of the range, but other tools may differ; use an unsigned `field_type`",
        );
    }
    if number.size() == 8 {
        let name = number.name();
        report.error(
            span,
            format!(
                "a floating-point number cannot resolve the steps of a scaled `{name}`: use `{}`",
                name.replace("long ", "")
            ),
        );
        return None;
    }
    if scale.lower < scale.upper && (scale.upper - scale.lower).is_finite() {
        return Some(());
    }
    report.error(
        span,
        format!(
            "the limits of the scale are {} and {}: the lower one must be less than the upper one",
            scale.lower, scale.upper
        ),
    );
    None
}

/// A range has at least one value.
pub(crate) fn value_range(report: &mut Report, span: Span, range: &ValueRange) -> bool {
    let exclusive = range.lower_exclusive || range.upper_exclusive;
    let empty = range.lower > range.upper || (exclusive && range.lower >= range.upper);
    if empty {
        report.error(
            span,
            format!(
                "no value lies between {} and {}: the lower limit must be less than the upper one",
                range.lower, range.upper
            ),
        );
    }
    !empty
}

/// The index of a named value fits eight octets.
pub(crate) fn enum_index(report: &mut Report, span: Span, index: i128) -> Option<i128> {
    let sound = (i64::MIN.into()..=u64::MAX.into()).contains(&index);
    if !sound {
        report.error(
            span,
            format!("`enum_index` is {index}, which no number of eight octets holds"),
        );
    }
    sound.then_some(index)
}

/// The index of a format or unit fits one octet.
pub(crate) fn octet_index(report: &mut Report, span: Span, index: i128) -> Option<u8> {
    let sound = u8::try_from(index).ok();
    if sound.is_none() {
        report.error(
            span,
            format!("`index` is {index}, but it is one octet on the wire: use 0 to 255"),
        );
    }
    sound
}

/// A value set is not empty, and its values differ.
pub(crate) fn value_set(report: &mut Report, set: &syntax::ValueSet, resolved: &ValueSet) -> bool {
    if resolved.ranges.is_empty() && resolved.values.is_empty() {
        report.error(
            set.span,
            "the `value_set` is empty: add a `value_range` or a `value_enum`, or remove it",
        );
        return false;
    }
    let indices = resolved
        .values
        .iter()
        .zip(&set.values)
        .map(|(v, s)| (v.index, s.span));
    unique_indices(report, "values", indices) && not_shifted(report, set, resolved)
}

/// Values are on the wire as they are. The standard counts those of a set with
/// `offset_to_lower_limit` from the lowest one, but the code that the JAUS Tool Set generates does
/// not, so two peers would disagree unless the lowest value is 0.
fn not_shifted(report: &mut Report, set: &syntax::ValueSet, resolved: &ValueSet) -> bool {
    let ranges = resolved.ranges.iter().map(|range| range.lower);
    let values = resolved.values.iter().map(|value| value.index as f64);
    let lowest = ranges.chain(values).fold(f64::INFINITY, f64::min);
    let shifted = set.offset_to_lower_limit && lowest != 0.0;
    if shifted {
        report.error(
            set.span,
            format!(
                "`offset_to_lower_limit` would count the values from {lowest} on the wire, but the \
                 code of the JAUS Tool Set sends them as they are, so that peers disagree: set it to \
                 `false`, and state the numbers that are on the wire"
            ),
        );
    }
    !shifted
}

/// A resolved value set, and the places of its values.
#[derive(Debug, Clone)]
pub(crate) struct Placed {
    pub(crate) set: ValueSet,
    /// Positions of the ranges, then of the values.
    places: Vec<Span>,
}

impl Placed {
    pub(crate) fn new(written: &syntax::ValueSet, set: ValueSet) -> Self {
        let ranges = written.ranges.iter().map(|range| range.span);
        let values = written.values.iter().map(|value| value.span);
        Self {
            places: ranges.chain(values).collect(),
            set,
        }
    }

    /// The same, for a field that refers to it from another position.
    pub(crate) fn at(&self, span: Span) -> Self {
        Self {
            places: vec![span; self.places.len()],
            ..self.clone()
        }
    }
}

/// The values fit the type of the field.
pub(crate) fn values_of_number(report: &mut Report, values: &Placed, number: Number) -> bool {
    let Some((least, greatest)) = number.integers() else {
        return true;
    };
    within(report, values, least, greatest, "the `field_type`")
}

/// The values fit the bits of a sub-field.
pub(crate) fn values_of_bits(report: &mut Report, values: &Placed, bits: u8) -> bool {
    let greatest = (1_i128 << bits) - 1;
    let holder = format!("a sub-field of {bits} bits");
    within(report, values, 0, greatest, &holder)
}

fn within(report: &mut Report, values: &Placed, least: i128, greatest: i128, holder: &str) -> bool {
    let holds = |value: f64| (least as f64..=greatest as f64).contains(&value);
    let ranges = values.set.ranges.iter().map(|range| {
        let fits = holds(range.lower) && holds(range.upper);
        (!fits).then(|| format!("the range is {} to {}", range.lower, range.upper))
    });
    let named = values.set.values.iter().map(|value| {
        let fits = holds(value.index as f64);
        (!fits).then(|| format!("the value `{}` is {}", value.name, value.index))
    });
    let mut sound = true;
    for (text, place) in ranges.chain(named).zip(&values.places) {
        if let Some(text) = text {
            let message = format!("{text}, but {holder} holds {least} to {greatest}");
            report.error(*place, message);
            sound = false;
        }
    }
    sound
}
/// The bits of a sub-field lie within the bit field, the lower bound first.
pub(crate) fn bits(
    report: &mut Report,
    field: &syntax::SubField,
    base: Unsigned,
    from: i128,
    to: i128,
) -> Option<(u8, u8)> {
    let last = base.size() * 8 - 1;
    let name = &field.name;
    if from > to {
        report.error(
            field.from.span,
            format!("the bits of `{name}` range from {from} to {to}: swap them"),
        );
        return None;
    }
    let inside = from >= 0 && usize::try_from(to).is_ok_and(|to| to <= last);
    if !inside {
        report.error(
            field.from.span,
            format!(
                "the bits {from} to {to} of `{name}` are outside the `bit_field`, whose bits are \
                 0 to {last}"
            ),
        );
        return None;
    }
    Some((u8::try_from(from).ok()?, u8::try_from(to).ok()?))
}

/// No bit belongs to two sub-fields.
pub(crate) fn overlap(
    report: &mut Report,
    written: &[syntax::SubField],
    resolved: &[SubField],
) -> bool {
    let mut sound = true;
    for (index, field) in resolved.iter().enumerate() {
        let shared = |other: &SubField| other.from <= field.to && field.from <= other.to;
        let Some(other) = resolved[..index].iter().position(shared) else {
            continue;
        };
        let (name, owner) = (&field.name, &resolved[other].name);
        let bit = field.from.max(resolved[other].from);
        report
            .error(
                written[index].from.span,
                format!("bit {bit} of `{name}` belongs to `{owner}` already: move one of them"),
            )
            .note(written[other].from.span, "the other one");
        sound = false;
        // With more sub-fields than bits, overlaps are certain and already reported.
        if index >= 64 {
            break;
        }
    }
    sound
}
