//! Output for readers: medians, ratios and Markdown tables.

use std::fs;
use std::time::Duration;

/// Prints the machine's model and load.
pub(crate) fn machine() {
    let model = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = model
        .lines()
        .find_map(|line| line.strip_prefix("model name"))
        .map_or("unknown processor", |rest| {
            rest.trim_start_matches([' ', '\t', ':'])
        });
    let processors = std::thread::available_parallelism().map_or(0, usize::from);
    let load = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let load: Vec<_> = load.split(' ').take(3).collect();
    println!("{processors} × {model}; load {}\n", load.join(" "));
}

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
pub(crate) fn ratio(values: &[f64], baseline: &[f64]) -> String {
    let quotients: Vec<_> = values.iter().zip(baseline).map(|(v, b)| v / b).collect();
    format!("{:.2} ×", median(&quotients))
}

/// A table row.
pub(crate) fn row<const N: usize>(cells: [&str; N]) {
    println!("| {} |", cells.join(" | "));
}

/// A table head: the first column is text, the others are numbers.
pub(crate) fn head<const N: usize>(title: &str, cells: [&str; N]) {
    println!("\n## {title}\n");
    row(cells);
    println!("|---|{}", "--:|".repeat(N - 1));
}
