//! The wire layout of a message as plain text, for terminals and scripts.

use super::block::{Inline, Line, Row};
use super::layout;
use crate::model::Message;

/// A row of a message's layout: a field, a count, a presence vector, or a heading.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LayoutRow {
    /// Nesting depth.
    pub depth: usize,
    /// The field with its path, and the bit that requests it if it is optional.
    pub field: String,
    /// The author's text; empty if there is none.
    pub description: String,
    /// The type; empty for a heading.
    pub kind: String,
    /// The unit; empty if there is none.
    pub unit: String,
    /// Range and resolution, or the named values.
    pub values: Vec<String>,
}

/// The rows of a message's layout, in the order of the wire.
#[must_use]
pub fn layout_rows(message: &Message) -> Vec<LayoutRow> {
    let table = layout::table(message);
    table.rows.iter().map(LayoutRow::of).collect()
}

impl LayoutRow {
    fn of(row: &Row) -> Self {
        let lines = |cell: usize| row.cells.get(cell).map_or(&[][..], Vec::as_slice);
        let first = |cell: usize| lines(cell).first().map_or_else(String::new, plain);
        Self {
            depth: row.depth,
            field: first(2),
            description: lines(2).get(1).map_or_else(String::new, plain),
            kind: first(3),
            unit: first(4),
            values: lines(5).iter().map(plain).collect(),
        }
    }
}

/// The text of a line.
fn plain(line: &Line) -> String {
    let parts = line.iter().map(|part| match part {
        Inline::Text(text) | Inline::Code(text) | Inline::Muted(text) => text.as_str(),
        Inline::Badge(text) => text,
        Inline::Link { text, .. } => text,
    });
    parts.collect()
}
