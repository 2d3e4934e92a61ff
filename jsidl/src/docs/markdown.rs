//! Writes pages as Markdown with tables, as code hosts display them.

use std::fmt::Write as _;

use super::block::{Block, Inline, Line, Page, StateBox, Table};

/// A whole page.
pub(super) fn page(page: &Page) -> String {
    let mut out = String::new();
    blocks(&mut out, &page.blocks);
    if page.name != "index" {
        out.push_str("[Services and messages](index.md)\n");
    }
    out
}

fn blocks(out: &mut String, blocks: &[Block]) {
    for item in blocks {
        block(out, item);
        out.push('\n');
    }
}

fn block(out: &mut String, block: &Block) {
    // Writing to a String cannot fail.
    let _ = match block {
        Block::Heading {
            level,
            text,
            anchor,
        } => {
            if let Some(anchor) = anchor {
                let _ = writeln!(out, "<a id=\"{}\"></a>\n", super::html::escaped(anchor));
            }
            writeln!(out, "{} {}", "#".repeat(usize::from(*level)), line(text))
        }
        Block::Paragraph(words) => writeln!(out, "{}", line(words)),
        Block::Facts(facts) => {
            for (what, fact) in facts {
                let fact: Vec<_> = fact.iter().map(line).collect();
                let _ = writeln!(out, "- **{}**: {}", escaped(what), fact.join(", "));
            }
            Ok(())
        }
        Block::Table(contents) => {
            table(out, contents);
            Ok(())
        }
        Block::Details {
            summary,
            blocks: inner,
        } => {
            let _ = writeln!(
                out,
                "<details>\n<summary>{}</summary>\n",
                super::html::escaped(summary)
            );
            blocks(out, inner);
            writeln!(out, "</details>")
        }
        Block::Source { language, text } => {
            // A fence longer than any run of backticks in the text.
            let runs = text.split(|c| c != '`').map(str::len);
            let fence = "`".repeat(3.max(runs.max().unwrap_or(0) + 1));
            writeln!(out, "{fence}{language}\n{}\n{fence}", text.trim_end())
        }
        Block::States(boxes) => {
            states(out, boxes, 0);
            Ok(())
        }
    };
}

fn table(out: &mut String, table: &Table) {
    let _ = writeln!(out, "| {} |", table.head.join(" | "));
    let _ = writeln!(out, "|{}", "---|".repeat(table.head.len()));
    for row in &table.rows {
        for cell in &row.cells {
            let lines: Vec<_> = cell.iter().map(line).collect();
            let _ = write!(out, "| {} ", lines.join("<br>"));
        }
        out.push_str("|\n");
    }
}

fn states(out: &mut String, boxes: &[StateBox], depth: usize) {
    let indent = "  ".repeat(depth);
    for state in boxes {
        let first = if state.first { " (first)" } else { "" };
        let _ = writeln!(out, "{indent}- **{}**{first}", escaped(&state.name));
        for entry in &state.lines {
            let _ = writeln!(out, "{indent}  - {}", line(entry));
        }
        states(out, &state.children, depth + 1);
    }
}

fn line(line: &Line) -> String {
    line.iter().map(inline).collect()
}

fn inline(inline: &Inline) -> String {
    match inline {
        Inline::Text(words) | Inline::Muted(words) => escaped(words),
        Inline::Code(name) if name.contains(['`', '|', '\\']) => escaped(name),
        Inline::Code(name) => format!("`{name}`"),
        Inline::Badge(word) => format!("*{}*", escaped(word)),
        Inline::Link { text, to } => format!("[{}]({})", escaped(text), to.address("md")),
    }
}

/// Escapes text for Markdown.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '[' | ']' | '*' | '_' | '`' | '\\' | '#' | '|' | '~' => {
                escaped.push('\\');
                escaped.push(c);
            }
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '&' => escaped.push_str("&amp;"),
            c => escaped.push(c),
        }
    }
    escaped
}
