//! Statistics for readers: medians, spreads and ratios.

use std::time::Duration;

/// The median; the upper one of an even number of values.
pub(crate) fn median<T: PartialOrd + Copy>(values: &[T]) -> T {
    percentile(values, 50)
}

/// The given percentile.
pub(crate) fn percentile<T: PartialOrd + Copy>(values: &[T], percent: usize) -> T {
    let mut sorted = values.to_vec();
    sorted.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
    sorted[(sorted.len() * percent / 100).min(sorted.len() - 1)]
}

pub(crate) fn micros(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}

/// Median and spread over the runs.
pub(crate) fn spread(values: &[f64], digits: usize) -> String {
    let (low, high) = (percentile(values, 0), percentile(values, 100));
    format!(
        "{:.digits$} [{low:.digits$}..{high:.digits$}]",
        median(values)
    )
}

/// The median over the runs of the quotient within each run.
pub(crate) fn quotient(values: &[f64], baseline: &[f64]) -> f64 {
    let quotients: Vec<_> = values.iter().zip(baseline).map(|(v, b)| v / b).collect();
    median(&quotients)
}

/// The same as text.
pub(crate) fn ratio(values: &[f64], baseline: &[f64]) -> String {
    format!("{:.2} ×", quotient(values, baseline))
}
