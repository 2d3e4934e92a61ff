//! Tables of a benchmark, printed and, on request, written to the book.

use std::fmt::Display;
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::SystemTime;

use crate::tools::workspace;

/// The environment variable with which benchmarks write their tables to `docs/figures`.
pub const WRITE: &str = "JAUS_WRITE_FIGURES";

/// The tables of one measurement, in Markdown.
#[derive(Debug)]
pub struct Figures {
    name: String,
    command: String,
    text: String,
    load: String,
    start: SystemTime,
}

impl Figures {
    /// Begins a measurement. `name` is that of its file, and `command` repeats it.
    #[must_use]
    pub fn new(name: &str, command: &str) -> Self {
        Self {
            name: name.to_owned(),
            command: command.to_owned(),
            text: String::new(),
            load: load(),
            start: SystemTime::now(),
        }
    }

    /// A line of text.
    pub fn line(&mut self, text: impl Display) {
        println!("{text}");
        self.text.push_str(&format!("{text}\n"));
    }

    /// The title and the first row of a table, whose first column is text.
    pub fn table<const N: usize>(&mut self, title: &str, columns: [&str; N]) {
        self.line(format_args!("\n#### {title}\n"));
        self.row(columns);
        self.line(format_args!("|---|{}", "--:|".repeat(N - 1)));
    }

    /// A row of a table.
    pub fn row<const N: usize>(&mut self, cells: [&str; N]) {
        self.line(format_args!("| {} |", cells.join(" | ")));
    }

    /// An aim, and the results that are compared with it: whether each meets it.
    pub fn aim<'n>(&mut self, aim: &str, results: impl IntoIterator<Item = (&'n str, bool)>) {
        let of = |(name, is_met)| match (name, is_met) {
            ("", true) => "met".to_owned(),
            ("", false) => "missed".to_owned(),
            (name, true) => format!("met by {name}"),
            (name, false) => format!("missed by {name}"),
        };
        let results: Vec<_> = results.into_iter().map(of).collect();
        self.line(format_args!("\nAim: {aim}; {}.", results.join(", ")));
    }

    /// The median time of a benchmark of criterion in nanoseconds, if this run has measured it.
    #[must_use]
    pub fn criterion(&self, group: &str, function: &str) -> Option<f64> {
        let directory = target().join("criterion").join(group);
        // Criterion replaces the slashes of a function's name.
        let file = directory.join(function.replace('/', "_"));
        let file = file.join("new/estimates.json");
        let measured = fs::metadata(&file).ok()?.modified().ok()?;
        if measured < self.start {
            return None;
        }
        median(&fs::read_to_string(file).ok()?)
    }

    /// Writes the file if that is requested.
    ///
    /// # Panics
    /// If it cannot be written.
    pub fn finish(self) {
        let head = format!(
            "*{}, commit {}, `{}`; {}, {}; load {} at the start and {} at the end.*\n",
            output("date", &["+%-d %B %Y"]).unwrap_or_default(),
            commit(),
            self.command,
            machine(),
            compiler(),
            self.load,
            load(),
        );
        println!("\n{head}");
        if std::env::var_os(WRITE).is_some() {
            let directory = workspace("docs/figures");
            fs::create_dir_all(&directory).unwrap();
            let file = directory.join(format!("{}.md", self.name));
            let text = format!("{head}\n{}\n", self.text.trim());
            fs::write(&file, text).unwrap();
            println!("written to {}", file.display());
        }
    }
}

/// The median in criterion's estimates.
fn median(estimates: &str) -> Option<f64> {
    let (_, median) = estimates.split_once("\"median\":")?;
    let (_, estimate) = median.split_once("\"point_estimate\":")?;
    let end = estimate.find([',', '}'])?;
    estimate[..end].parse().ok()
}

fn target() -> PathBuf {
    let set = std::env::var_os("CARGO_TARGET_DIR");
    set.map_or_else(|| workspace("target"), PathBuf::from)
}

/// Processors and their model.
fn machine() -> String {
    let processors = std::thread::available_parallelism().map_or(0, usize::from);
    let models = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = models
        .lines()
        .find_map(|line| line.strip_prefix("model name"));
    let model = model.map_or("unknown processor", |rest| {
        rest.trim_start_matches([' ', '\t', ':'])
    });
    format!("{processors} × {model}")
}

/// The number of processes that wanted a processor during the last minute, on average.
fn load() -> String {
    let load = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    load.split(' ').next().unwrap_or_default().to_owned()
}

/// The commit, and whether anything but other figures differs from it.
fn commit() -> String {
    let commit = output("git", &["rev-parse", "--short", "HEAD"]);
    let changes = output(
        "git",
        &["status", "--porcelain", "--", ".", ":!docs/figures"],
    );
    let commit = commit.unwrap_or_else(|| "unknown".to_owned());
    match changes {
        Some(changes) if !changes.is_empty() => format!("{commit} with changes"),
        _ => commit,
    }
}

/// Such as `rustc 1.95.0`.
fn compiler() -> String {
    let version = output("rustc", &["--version"]).unwrap_or_default();
    let name = version.split(" (").next().unwrap_or_default();
    name.to_owned()
}

/// What a program prints, if it can run.
fn output(program: &str, arguments: &[&str]) -> Option<String> {
    let mut command = Command::new(program);
    let output = command.args(arguments).current_dir(workspace(".")).output();
    let output = output.ok().filter(|output| output.status.success())?;
    Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

#[test]
fn the_median_is_read_from_criterion_s_estimates() {
    let estimates = r#"{"mean":{"confidence_interval":{"lower_bound":1.0},"point_estimate":2.0},
        "median":{"confidence_interval":{"lower_bound":4.0},"point_estimate":5.25,"e":1.0}}"#;
    assert_eq!(median(estimates), Some(5.25));
    assert_eq!(median("{}"), None);
}
