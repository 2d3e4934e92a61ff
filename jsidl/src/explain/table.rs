//! Formats rows as an annotated hex dump.

use std::fmt::Write as _;

use super::Row;

/// Octets per line.
const OCTETS: usize = 8;

/// Maximum width of the field column.
const WIDEST_FIELD: usize = 44;

/// Maximum width of the number column.
const WIDEST_RAW: usize = 20;

/// Formats rows in columns: offset, octets, field, number on the wire, meaning. Long runs of octets
/// continue on further lines.
pub fn table(rows: &[Row]) -> String {
    let fields: Vec<_> = rows.iter().map(Row::label).collect();
    let raws: Vec<_> = rows.iter().map(Row::raw_text).collect();
    let widest = |texts: &[String], head: &str, most: usize| {
        let fitting = texts
            .iter()
            .map(|t| t.chars().count())
            .filter(|&n| n <= most);
        fitting.max().unwrap_or(0).max(head.len())
    };
    let field_width = widest(&fields, "field", WIDEST_FIELD);
    let raw_width = widest(&raws, "raw", WIDEST_RAW);
    let last = rows.last().map_or(0, |row| row.offset + row.octets.len());
    let offset_width = last.to_string().len().max("offset".len());

    let mut text = String::new();
    let mut line = |offset: &str, octets: &str, field: &str, raw: &str, meaning: &str| {
        let line = format!(
            "{offset:>offset_width$}  {octets:23}  {field:field_width$}  {raw:>raw_width$}  {meaning}"
        );
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{}", line.trim_end());
    };
    line("offset", "octets", "field", "raw", "meaning");
    for ((row, field), raw) in rows.iter().zip(&fields).zip(&raws) {
        let mut chunks = row.octets.chunks(OCTETS);
        let first = chunks.next().unwrap_or_default();
        let offset = match first {
            [] => String::new(),
            _ => row.offset.to_string(),
        };
        line(&offset, &hex(first), field, raw, &row.meaning());
        for (index, chunk) in chunks.enumerate() {
            let offset = row.offset + (index + 1) * OCTETS;
            line(&offset.to_string(), &hex(chunk), "", "", "");
        }
    }
    text
}

fn hex(octets: &[u8]) -> String {
    let digits: Vec<_> = octets.iter().map(|octet| format!("{octet:02X}")).collect();
    digits.join(" ")
}
