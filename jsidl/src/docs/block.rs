//! Content of a page, independent of HTML and Markdown.

use std::fmt::Write as _;

/// A page of the documentation.
pub(super) struct Page {
    /// File name without extension.
    pub(super) name: String,
    /// Title in the page's head.
    pub(super) title: String,
    /// Navigation at the side of the page.
    pub(super) contents: Vec<Line>,
    /// Content.
    pub(super) blocks: Vec<Block>,
    /// Whether the rows of its tables are searchable.
    pub(super) searchable: bool,
}

/// Text on one line.
pub(super) type Line = Vec<Inline>;

/// The lines of a table's cell.
pub(super) type Cell = Vec<Line>;

/// A part of a page.
pub(super) enum Block {
    /// A heading; level 1 is the title.
    Heading {
        level: u8,
        text: Line,
        anchor: Option<String>,
    },
    /// A paragraph.
    Paragraph(Line),
    /// Name and value pairs.
    Facts(Vec<(&'static str, Cell)>),
    /// A table.
    Table(Table),
    /// A collapsed section.
    Details { summary: String, blocks: Vec<Self> },
    /// Source text of another language.
    Source {
        /// Its name in a Markdown code fence.
        language: &'static str,
        text: String,
    },
    /// States, with nested substates.
    States(Vec<StateBox>),
}

/// A table of [`Block::Table`].
pub(super) struct Table {
    /// Its style.
    pub(super) class: &'static str,
    pub(super) head: &'static [&'static str],
    pub(super) rows: Vec<Row>,
}

/// A row of a [`Table`].
pub(super) struct Row {
    /// Nesting depth of the row's item.
    pub(super) depth: usize,
    /// Whether it is a heading of the following rows.
    pub(super) heading: bool,
    pub(super) cells: Vec<Cell>,
}

impl Row {
    /// An ordinary row with one line per cell.
    pub(super) fn of(cells: impl IntoIterator<Item = Line>) -> Self {
        Self {
            depth: 0,
            heading: false,
            cells: cells.into_iter().map(|line| vec![line]).collect(),
        }
    }
}

/// A state of a machine.
pub(super) struct StateBox {
    pub(super) name: String,
    /// Whether the machine, or the enclosing state, begins here.
    pub(super) first: bool,
    /// Its transitions and actions, one entry each.
    pub(super) lines: Vec<Line>,
    pub(super) children: Vec<Self>,
}

/// A part of a line.
#[derive(Clone)]
pub(super) enum Inline {
    /// Words.
    Text(String),
    /// A name or number of the language.
    Code(String),
    /// Less important text.
    Muted(String),
    /// A label.
    Badge(&'static str),
    /// A link.
    Link { text: String, to: Target },
}

/// Target of a link.
#[derive(Clone)]
pub(super) struct Target {
    /// The page's name; empty for the same page.
    pub(super) page: String,
    /// The anchor on the page.
    pub(super) anchor: Option<String>,
}

impl Target {
    /// The relative address of a page with this file extension.
    pub(super) fn address(&self, extension: &str) -> String {
        let mut address = String::new();
        if !self.page.is_empty() {
            address = format!("{}.{extension}", self.page);
        }
        if let Some(anchor) = &self.anchor {
            let _ = write!(address, "#{anchor}");
        }
        address
    }
}

pub(super) fn text(words: impl Into<String>) -> Inline {
    Inline::Text(words.into())
}

pub(super) fn code(name: impl Into<String>) -> Inline {
    Inline::Code(name.into())
}

pub(super) fn muted(words: impl Into<String>) -> Inline {
    Inline::Muted(words.into())
}

pub(super) fn link(words: impl Into<String>, page: &str, anchor: Option<String>) -> Inline {
    Inline::Link {
        text: words.into(),
        to: Target {
            page: page.to_owned(),
            anchor,
        },
    }
}

pub(super) fn heading(level: u8, words: impl Into<String>, anchor: Option<String>) -> Block {
    Block::Heading {
        level,
        text: vec![text(words)],
        anchor,
    }
}
