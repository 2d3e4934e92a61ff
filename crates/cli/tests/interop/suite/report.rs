//! Writes the table as Markdown for people and as JUnit XML for build servers.

use std::fmt::Write as _;
use std::path::Path;

use jaus_view::junit::{self, Case, CaseResult, Suite};

use crate::suite::scenario::Scenario;
use crate::suite::verdict::{Cell, Column, Verdict};

/// A party's name and the version that it reports.
pub(crate) type Version = (String, String);

/// Writes both files into the directory, and returns the table.
pub(crate) fn write(
    directory: &Path,
    versions: &[Version],
    columns: &[Column],
) -> std::io::Result<String> {
    let table = markdown(directory, versions, columns);
    std::fs::write(directory.join("report.md"), &table)?;
    let suites: Vec<Suite> = columns.iter().map(suite).collect();
    let xml = junit::document("interoperability", &suites);
    std::fs::write(directory.join("report.xml"), xml)?;
    Ok(table)
}

/// The table: a row for each scenario, a column for each direction, and the reasons below.
fn markdown(directory: &Path, versions: &[Version], columns: &[Column]) -> String {
    let mut text = String::from("# Interoperability\n\n");
    for (name, version) in versions {
        line(&mut text, &format!("- {name}: {version}"));
    }
    line(&mut text, "\nWho asks → who answers.\n");
    let (columns, empty): (Vec<_>, Vec<_>) =
        columns.iter().partition(|column| is_applicable(column));
    let heads = columns.iter().map(|column| format!(" {} |", title(column)));
    line(
        &mut text,
        &format!("| scenario |{}", heads.collect::<String>()),
    );
    line(&mut text, &format!("|---|{}", "---|".repeat(columns.len())));
    let mut notes = Notes::default();
    for scenario in scenarios(&columns) {
        let mut row = format!("| {} |", scenario.title());
        for column in &columns {
            let cell = column.cells.iter().find(|cell| cell.scenario == scenario);
            row += &cell.map_or_else(
                || "  |".to_owned(),
                |cell| format!(" {} |", notes.of(directory, cell)),
            );
        }
        line(&mut text, &row);
    }
    for column in empty {
        let why = column
            .cells
            .first()
            .map_or_else(String::new, |cell| notes.of(directory, cell));
        line(
            &mut text,
            &format!("\n{}: {why} for every scenario", title(column)),
        );
    }
    if !notes.0.is_empty() {
        line(&mut text, "");
    }
    for (number, note) in notes.0.iter().enumerate() {
        line(&mut text, &format!("{}. {note}", number + 1));
    }
    text
}

/// Whether any scenario of a column applies.
fn is_applicable(column: &Column) -> bool {
    let mut cells = column.cells.iter();
    cells.any(|cell| !matches!(cell.verdict, Verdict::NotApplicable(_)))
}

/// The scenarios of these columns, in order.
fn scenarios(columns: &[&Column]) -> impl Iterator<Item = Scenario> {
    let has = |scenario: &Scenario| {
        let mut cells = columns.iter().flat_map(|column| &column.cells);
        cells.any(|cell| cell.scenario == *scenario)
    };
    Scenario::all().into_iter().filter(has)
}

/// The reasons, each once.
#[derive(Default)]
struct Notes(Vec<String>);

impl Notes {
    /// Text of a cell.
    fn of(&mut self, directory: &Path, cell: &Cell) -> String {
        match &cell.verdict {
            Verdict::Passed => format!("pass, {:.1} s", cell.took.as_secs_f64()),
            Verdict::Failed(reason) => {
                let number = self.number(reason.clone());
                match &cell.recording {
                    Some(file) => {
                        let file = file.strip_prefix(directory).unwrap_or(file);
                        format!("[FAIL]({}) [{number}]", file.display())
                    }
                    None => format!("FAIL [{number}]"),
                }
            }
            Verdict::NotApplicable(reason) => format!("n/a [{}]", self.number(reason.clone())),
        }
    }

    fn number(&mut self, note: String) -> usize {
        let known = self.0.iter().position(|known| *known == note);
        known.unwrap_or_else(|| {
            self.0.push(note);
            self.0.len() - 1
        }) + 1
    }
}

fn title(column: &Column) -> String {
    format!("{} → {}", column.actor, column.answerer)
}

fn suite(column: &Column) -> Suite {
    let name = title(column);
    let cases = column.cells.iter().map(|cell| Case {
        name: cell.scenario.title(),
        class: format!("interop.{}.{}", column.peer, cell.scenario.key()),
        took: cell.took,
        result: match &cell.verdict {
            Verdict::Passed => CaseResult::Passed(None),
            Verdict::NotApplicable(reason) => CaseResult::Skipped(reason.clone()),
            Verdict::Failed(reason) => CaseResult::Failed {
                reason: reason.clone(),
                details: cell.recording.as_ref().map_or_else(String::new, |file| {
                    format!("{name}; what was said: {}", file.display())
                }),
            },
        },
    });
    Suite {
        cases: cases.collect(),
        name: name.clone(),
    }
}

fn line(text: &mut String, line: &str) {
    // Writing into a string cannot fail.
    let _ = writeln!(text, "{line}");
}
