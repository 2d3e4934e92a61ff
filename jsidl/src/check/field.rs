//! Rules for numbers, value sets and bit fields.

use crate::diagnostic::Report;
use crate::model::{Number, Scale, SubField, Unsigned, ValueRange, ValueSet};
use crate::source::Span;
use crate::syntax::{self, ScalarField, ScaleRange};

use super::unique_indices;

/// A number is scaled or enumerated, not both.
pub(crate) fn one_meaning(report: &mut Report, field: &ScalarField) -> Option<()> {
    match (&field.scale, &field.values) {
        (Some(scale), Some(_)) => {
            report.error(
                scale.span,
                "a field has a `scale_range` or a `value_set`, not both: remove one",
            );
            None
        }
        _ => Some(()),
    }
}

/// Scales need an unsigned integer, or one with its zero at the centre of the range, and two
/// different limits in order.
pub(crate) fn scale(
    report: &mut Report,
    range: &ScaleRange,
    scale: Scale,
    number: Number,
) -> Option<()> {
    let span = range.span;
    match number {
        Number::Unsigned(_) if range.centred => {
            report.error(
                span,
                "only a signed integer's range is centred on zero: change the `field_type`, or \
                 remove the attribute `bias`",
            );
            return None;
        }
        Number::Unsigned(_) => {}
        Number::Signed(_) if range.centred => {}
        Number::Signed(_) | Number::F32 | Number::F64 => {
            report.error(
                span,
                "a `scale_range` needs an unsigned integer: change the `field_type`, or remove \
                 the range",
            );
            return None;
        }
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

/// The index of a named value is not negative.
pub(crate) fn enum_index(report: &mut Report, span: Span, index: i128) -> Option<u64> {
    let sound = u64::try_from(index).ok();
    if sound.is_none() {
        report.error(
            span,
            format!("`enum_index` is {index}, but must not be negative"),
        );
    }
    sound
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

/// The values fit the type of the field.
pub(crate) fn values_of_number(
    report: &mut Report,
    set: &syntax::ValueSet,
    resolved: &ValueSet,
    number: Number,
) -> bool {
    let Some((least, greatest)) = number.integers() else {
        return true;
    };
    within(report, set, resolved, least, greatest, "the `field_type`")
}

/// The values fit the bits of a sub-field.
pub(crate) fn values_of_bits(
    report: &mut Report,
    set: &syntax::ValueSet,
    resolved: &ValueSet,
    bits: u8,
) -> bool {
    let greatest = (1_i128 << bits) - 1;
    within(
        report,
        set,
        resolved,
        0,
        greatest,
        &format!("a sub-field of {bits} bits"),
    )
}
fn within(
    report: &mut Report,
    set: &syntax::ValueSet,
    resolved: &ValueSet,
    least: i128,
    greatest: i128,
    holder: &str,
) -> bool {
    let holds = |value: f64| (least as f64..=greatest as f64).contains(&value);
    let mut sound = true;
    let mut complain = |span: Span, text: String| {
        report.error(
            span,
            format!("{text}, but {holder} holds {least} to {greatest}"),
        );
        sound = false;
    };
    for (range, written) in resolved.ranges.iter().zip(&set.ranges) {
        if !holds(range.lower) || !holds(range.upper) {
            complain(
                written.span,
                format!("the range is {} to {}", range.lower, range.upper),
            );
        }
    }
    for (value, written) in resolved.values.iter().zip(&set.values) {
        if !holds(value.index as f64) {
            complain(
                written.span,
                format!("the value `{}` is {}", value.name, value.index),
            );
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
