//! Texts of a load; maps an offset in a text to file, line and column.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

/// Place of a declaration: file, line and column (both from 1).
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Location {
    /// The file name as given to the loader.
    pub file: Arc<Path>,
    /// Line, counted from 1.
    pub line: u32,
    /// Column in characters, counted from 1.
    pub column: u32,
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file.display(), self.line, self.column)
    }
}

/// Position in a loaded text: eight octets instead of a whole [`Location`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Span {
    file: u32,
    offset: u32,
}

impl Span {
    /// Whether both lie in the same file.
    pub(crate) fn same_file(self, other: Self) -> bool {
        self.file == other.file
    }
}

/// A value with its position in the source.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spanned<T> {
    pub(crate) value: T,
    pub(crate) span: Span,
}

/// One file, or one text given in memory.
#[derive(Debug)]
pub(crate) struct Source {
    id: u32,
    path: Arc<Path>,
    text: Arc<str>,
    /// Offset of the first octet of every line.
    lines: Vec<u32>,
    /// Number of characters before each block of octets: column lookup costs the same in a text
    /// that is one long line.
    characters: Vec<u32>,
    /// The XML of a text in the compact form.
    translation: Option<Translation>,
}

/// Octets per entry in [`Source::characters`].
const BLOCK: usize = 256;

/// Number of characters that start in these octets of a UTF-8 text.
fn characters(octets: &[u8]) -> u32 {
    let starts = octets.iter().filter(|&octet| octet & 0xC0 != 0x80);
    u32::try_from(starts.count()).unwrap_or(u32::MAX)
}

impl Source {
    /// Its name.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The text without its byte order mark.
    pub(crate) fn text(&self) -> &Arc<str> {
        &self.text
    }

    /// The text as XML: itself, or its translation.
    pub(crate) fn xml(&self) -> &str {
        self.translation.as_ref().map_or(&*self.text, |it| &it.xml)
    }

    /// The position of this octet of the [XML](Self::xml).
    pub(crate) fn span(&self, offset: usize) -> Span {
        let origin = self.translation.as_ref().map(|it| it.origin(offset));
        let offset = origin.unwrap_or(offset);
        let offset = u32::try_from(offset).unwrap_or(u32::MAX);
        Span {
            file: self.id,
            offset,
        }
    }

    /// File, line and column of a position in this text.
    pub(crate) fn location(&self, span: Span) -> Location {
        let offset = span.offset;
        let line = self.lines.partition_point(|&start| start <= offset).max(1);
        let start = self.lines.get(line - 1).copied().unwrap_or(0);
        Location {
            file: Arc::clone(&self.path),
            line: u32::try_from(line).unwrap_or(u32::MAX),
            column: self.characters_before(offset) - self.characters_before(start) + 1,
        }
    }

    fn characters_before(&self, offset: u32) -> u32 {
        let offset = (offset as usize).min(self.text.len());
        let block = offset / BLOCK;
        let known = self.characters.get(block).copied().unwrap_or(0);
        known + characters(&self.text.as_bytes()[block * BLOCK..offset])
    }
}

/// All texts of a load.
#[derive(Debug, Default)]
pub(crate) struct Sources(Vec<Source>);

impl Sources {
    /// Adds a text; a byte order mark at its start is dropped.
    pub(crate) fn add(&mut self, path: &Path, text: &str) -> &Source {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let starts = text.match_indices('\n').map(|(at, _)| at + 1);
        let lines = std::iter::once(0)
            .chain(starts)
            .map(|at| u32::try_from(at).unwrap_or(u32::MAX))
            .collect();
        let blocks = text.as_bytes().chunks(BLOCK);
        let sums = blocks.scan(0, |sum: &mut u32, block| {
            *sum += characters(block);
            Some(*sum)
        });
        let characters = std::iter::once(0).chain(sums).collect();
        let index = self.0.len();
        self.0.push(Source {
            id: u32::try_from(index).unwrap_or(u32::MAX),
            path: Arc::from(path),
            text: Arc::from(text),
            lines,
            characters,
            translation: None,
        });
        &self.0[index]
    }

    /// All texts, in the order in which they were added.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Source> {
        self.0.iter()
    }

    /// The number of texts.
    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }

    /// A text by its place in the order of [`iter`](Self::iter).
    pub(crate) fn at(&self, index: usize) -> &Source {
        &self.0[index]
    }

    /// Sets the XML of a text in the compact form.
    pub(crate) fn translate(&mut self, index: usize, translation: Translation) -> &Source {
        let source = &mut self.0[index];
        source.translation = Some(translation);
        source
    }

    /// File, line and column of a position.
    pub(crate) fn location(&self, span: Span) -> Location {
        self.source(span).location(span)
    }

    /// The file that contains a position.
    pub(crate) fn path(&self, span: Span) -> &Path {
        &self.source(span).path
    }

    /// Name and text of the file that contains a position.
    pub(crate) fn text(&self, span: Span) -> (Arc<Path>, Arc<str>) {
        let source = self.source(span);
        (Arc::clone(&source.path), Arc::clone(&source.text))
    }

    fn source(&self, span: Span) -> &Source {
        &self.0[span.file as usize]
    }
}

/// The XML of a text in the compact form.
#[derive(Debug)]
pub(crate) struct Translation {
    pub(crate) xml: String,
    /// Offsets in the XML, in order, each with the offset in the compact text that it comes from.
    places: Vec<(u32, u32)>,
}

impl Translation {
    /// Pairs of offsets: in the XML, in order, and in the compact text.
    pub(crate) const fn new(xml: String, places: Vec<(u32, u32)>) -> Self {
        Self { xml, places }
    }

    /// The offset in the compact text of an offset in the XML.
    pub(crate) fn origin(&self, offset: usize) -> usize {
        let after = self
            .places
            .partition_point(|(xml, _)| *xml as usize <= offset);
        let place = after.checked_sub(1).and_then(|it| self.places.get(it));
        place.map_or(0, |(_, origin)| *origin as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_characters_from_one_whatever_ends_the_lines() {
        let mut sources = Sources::default();
        let source = sources.add(Path::new("a.xml"), "\u{feff}über\r\nß x\n");
        let at = |needle: &str| {
            let offset = source.text().find(needle).expect("occurs");
            source.location(source.span(offset))
        };
        assert_eq!(at("über").to_string(), "a.xml:1:1");
        assert_eq!(at("r\r").to_string(), "a.xml:1:4");
        assert_eq!(at("x").to_string(), "a.xml:2:3");
    }

    #[test]
    fn columns_are_right_far_into_a_long_line() {
        let mut sources = Sources::default();
        let text = format!("\n{}x", "ü".repeat(1000));
        let source = sources.add(Path::new("a.xml"), &text);
        assert_eq!(source.location(source.span(1)).to_string(), "a.xml:2:1");
        assert_eq!(
            source.location(source.span(1 + 600)).to_string(),
            "a.xml:2:301"
        );
        assert_eq!(
            source.location(source.span(2001)).to_string(),
            "a.xml:2:1001"
        );
        assert_eq!(
            source.location(source.span(2002)).to_string(),
            "a.xml:2:1002"
        );
        let source = sources.add(Path::new("b.xml"), &"x".repeat(2 * BLOCK));
        assert_eq!(source.location(source.span(512)).to_string(), "b.xml:1:513");
    }
}
