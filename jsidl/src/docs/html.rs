//! Writes pages as HTML: one file each, with style and script, without external resources.

use std::fmt::Write as _;

use super::block::{Block, Inline, Line, Page, Row, StateBox, Table};

const STYLE: &str = include_str!("style.css");

/// Shows the search box, which needs this script, and hides rows that do not match.
const SCRIPT: &str = include_str!("search.js");

/// A whole page.
pub(super) fn page(page: &Page) -> String {
    let mut out =
        String::from("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n");
    out.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n");
    out.push_str("<meta name=\"color-scheme\" content=\"light dark\"/>\n");
    let _ = write!(
        out,
        "<title>{}</title>\n<style>\n{STYLE}</style>\n",
        escaped(&page.title)
    );
    out.push_str("</head>\n<body>\n<div class=\"page\">\n<nav>\n");
    out.push_str("<p class=\"home\"><a href=\"index.html\">Services and messages</a></p>\n<ul>\n");
    for entry in &page.contents {
        let _ = writeln!(out, "<li>{}</li>", line(entry));
    }
    out.push_str("</ul>\n</nav>\n<main>\n");
    if page.searchable {
        out.push_str(
            "<p class=\"search\" hidden=\"hidden\"><input type=\"search\" placeholder=\"Search for \
             a name, code or word\" aria-label=\"Search\"/></p>\n",
        );
    }
    blocks(&mut out, &page.blocks);
    out.push_str("</main>\n</div>\n");
    if page.searchable {
        let _ = write!(out, "<script>\n{SCRIPT}</script>\n");
    }
    out.push_str("</body>\n</html>\n");
    out
}

fn blocks(out: &mut String, blocks: &[Block]) {
    for item in blocks {
        block(out, item);
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
            let content = line(text);
            match anchor.as_deref().map(escaped) {
                Some(anchor) => writeln!(
                    out,
                    "<h{level} id=\"{anchor}\"><a href=\"#{anchor}\">{content}</a></h{level}>"
                ),
                None => writeln!(out, "<h{level}>{content}</h{level}>"),
            }
        }
        Block::Paragraph(words) => writeln!(out, "<p>{}</p>", line(words)),
        Block::Facts(facts) => {
            out.push_str("<dl>\n");
            for (what, fact) in facts {
                let _ = writeln!(out, "<dt>{}</dt><dd>{}</dd>", escaped(what), lines(fact));
            }
            writeln!(out, "</dl>")
        }
        Block::Table(contents) => {
            table(out, contents);
            Ok(())
        }
        Block::Details {
            summary,
            blocks: inner,
        } => {
            let _ = writeln!(out, "<details>\n<summary>{}</summary>", escaped(summary));
            blocks(out, inner);
            writeln!(out, "</details>")
        }
        Block::Source { text, .. } => writeln!(out, "<pre><code>{}</code></pre>", escaped(text)),
        Block::States(boxes) => {
            states(out, boxes);
            Ok(())
        }
    };
}

fn table(out: &mut String, table: &Table) {
    let _ = writeln!(
        out,
        "<div class=\"wide\"><table class=\"{}\">\n<thead><tr>",
        table.class
    );
    for head in table.head {
        let _ = write!(out, "<th scope=\"col\">{}</th>", escaped(head));
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in &table.rows {
        table_row(out, row, table.head);
    }
    out.push_str("</tbody>\n</table></div>\n");
}

fn table_row(out: &mut String, row: &Row, head: &[&str]) {
    let class = if row.heading { " class=\"group\"" } else { "" };
    let _ = write!(out, "<tr{class} style=\"--depth:{}\">", row.depth);
    for (cell, head) in row.cells.iter().zip(head) {
        // On a narrow screen a row becomes a block, with the column's name in it.
        let content = lines(cell);
        let _ = if content.is_empty() {
            write!(out, "<td></td>")
        } else {
            write!(
                out,
                "<td data-head=\"{}\"><div>{content}</div></td>",
                escaped(head)
            )
        };
    }
    out.push_str("</tr>\n");
}

fn states(out: &mut String, boxes: &[StateBox]) {
    out.push_str("<div class=\"states\">\n");
    for state in boxes {
        let class = if state.first { "state first" } else { "state" };
        let _ = writeln!(
            out,
            "<div class=\"{class}\"><h5>{}</h5>",
            escaped(&state.name)
        );
        if !state.lines.is_empty() {
            out.push_str("<ul>\n");
            for entry in &state.lines {
                let _ = writeln!(out, "<li>{}</li>", line(entry));
            }
            out.push_str("</ul>\n");
        }
        if !state.children.is_empty() {
            states(out, &state.children);
        }
        out.push_str("</div>\n");
    }
    out.push_str("</div>\n");
}

fn lines(lines: &[Line]) -> String {
    let lines: Vec<_> = lines.iter().map(|words| line(words)).collect();
    lines.join("<br/>")
}

fn line(line: &[Inline]) -> String {
    line.iter().map(inline).collect()
}

fn inline(inline: &Inline) -> String {
    match inline {
        Inline::Text(words) => escaped(words),
        Inline::Code(name) => format!("<code>{}</code>", escaped(name)),
        Inline::Muted(words) => format!("<span class=\"muted\">{}</span>", escaped(words)),
        Inline::Badge(word) => format!("<span class=\"badge\">{}</span>", escaped(word)),
        Inline::Link { text, to } => {
            format!(
                "<a href=\"{}\">{}</a>",
                escaped(&to.address("html")),
                escaped(text)
            )
        }
    }
}

/// Escapes text for elements and quoted attributes.
pub(super) fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c => escaped.push(c),
        }
    }
    escaped
}
