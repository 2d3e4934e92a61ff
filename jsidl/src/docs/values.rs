//! Describes the values of a number.

use super::block::{Cell, Line, code, muted, text};
use crate::dynamic::Steps;
use crate::model::{Meaning, Number, Scalar, Scale, ValueRange, ValueSet, shortened};

/// Range and resolution, or the named values.
pub(super) fn of(scalar: &Scalar) -> Cell {
    match (&scalar.meaning, scalar.number) {
        (Meaning::Scaled(scale), number) => scaled(scale, number),
        (Meaning::Values(set), _) => of_set(set),
        _ => Vec::new(),
    }
}

fn scaled(scale: &Scale, kind: Number) -> Cell {
    let [lower, upper] = [scale.lower, scale.upper].map(|limit| shortened(limit, PLACES));
    let limits = format!("{lower} to {upper}");
    let steps = Steps::of(scale, kind);
    let steps = steps.map(|steps| format!("in steps of {}", significant(steps.step())));
    let steps = steps.map(|steps| vec![muted(steps)]);
    [vec![text(limits)]].into_iter().chain(steps).collect()
}

/// Named values, one per line, and ranges.
pub(super) fn of_set(set: &ValueSet) -> Cell {
    let ranges = set.ranges.iter().map(range);
    let named = set.values.iter().map(|value| {
        let line = vec![text(format!("{} ", value.index)), code(&value.name)];
        explained(line, &value.interpretation)
    });
    named.chain(ranges).collect()
}

fn range(range: &ValueRange) -> Line {
    let limits = format!("{range:.PLACES$}");
    explained(vec![text(limits)], &range.interpretation)
}

fn explained(mut line: Line, words: &str) -> Line {
    if !words.is_empty() {
        line.push(muted(format!(" {words}")));
    }
    line
}

/// Decimal places of limits, so that π does not show excess digits.
const PLACES: usize = 6;

/// Three significant digits.
fn significant(value: f64) -> String {
    if !(1e-3..1e6).contains(&value) {
        return format!("{value:.2e}");
    }
    let decimals = (2.0 - value.log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}
