//! What a page holds, before it is HTML or Markdown: the two are written from the same blocks.

use std::fmt::Write as _;

/// A page of the documentation.
pub(super) struct Page {
    /// File name without ending.
    pub(super) name: String,
    /// For the head of the page.
    pub(super) title: String,
    /// What may be jumped to, at the side of the page.
    pub(super) contents: Vec<Line>,
    /// What it shows.
    pub(super) blocks: Vec<Block>,
    /// Whether the rows of its tables can be searched.
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
    /// Facts, each with what it is.
    Facts(Vec<(&'static str, Cell)>),
    /// A table.
    Table(Table),
    /// Something that most readers pass over.
    Details { summary: String, blocks: Vec<Self> },
    /// Source text of another language.
    Source {
        /// Its name in a fence of Markdown.
        language: &'static str,
        text: String,
    },
    /// States, those within others inside them.
    States(Vec<StateBox>),
}

/// A table of [`Block::Table`].
pub(super) struct Table {
    /// What style it has.
    pub(super) class: &'static str,
    pub(super) head: &'static [&'static str],
    pub(super) rows: Vec<Row>,
}

/// A row of a [`Table`].
pub(super) struct Row {
    /// How deep the thing lies within others.
    pub(super) depth: usize,
    /// Whether it is a heading of the rows that follow.
    pub(super) heading: bool,
    pub(super) cells: Vec<Cell>,
}

impl Row {
    /// An ordinary row, each cell of one line.
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
    /// Whether the machine, or the state around it, begins here.
    pub(super) first: bool,
    /// What happens in it, an entry for each.
    pub(super) lines: Vec<Line>,
    pub(super) children: Vec<Self>,
}

/// A piece of a line.
#[derive(Clone)]
pub(super) enum Inline {
    /// Words.
    Text(String),
    /// A name or number of the language.
    Code(String),
    /// What matters less.
    Muted(String),
    /// A label.
    Badge(&'static str),
    /// Leads somewhere else.
    Link { text: String, to: Target },
}

/// A place in the documentation.
#[derive(Clone)]
pub(super) struct Target {
    /// The page's name; the same page if it is empty.
    pub(super) page: String,
    /// The place on it.
    pub(super) anchor: Option<String>,
}

impl Target {
    /// Relative to a page beside it, where pages are files with this extension.
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
