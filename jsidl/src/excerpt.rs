//! Formats findings for people: with source lines, the position marked, secondary locations below.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use annotate_snippets::{Annotation, AnnotationKind, Group, Level, Origin, Renderer, Snippet};

use crate::diagnostic::{Diagnostic, Diagnostics, Severity};
use crate::model::Location;

/// Lines between two positions beyond which each gets its own excerpt.
const FAR: u32 = 200;

/// Format of excerpts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Style {
    /// With terminal escape sequences for colours.
    pub colours: bool,
    /// Characters per line; longer source lines are cut around the position.
    pub width: usize,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            colours: false,
            width: 120,
        }
    }
}

impl Diagnostics {
    /// Formats a finding with its source lines; ends with a line break. A finding of another load
    /// has no source lines.
    pub fn excerpt(&self, finding: &Diagnostic, style: Style) -> String {
        let level = match finding.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
        };
        let mut group = Group::with_title(level.primary_title(finding.message.as_str()));
        for excerpt in self.places(finding) {
            group = if excerpt.text.is_empty() {
                group.element(Origin::path(excerpt.path.display().to_string()))
            } else {
                group.element(excerpt.snippet())
            };
        }
        let renderer = if style.colours {
            Renderer::styled()
        } else {
            Renderer::plain()
        };
        let mut text = renderer.term_width(style.width).render(&[group]);
        text.push('\n');
        text
    }

    /// The locations of a finding, neighbours in one excerpt, the primary one first.
    fn places<'a>(&'a self, finding: &'a Diagnostic) -> Vec<Excerpt<'a>> {
        let first = Mark {
            location: &finding.location,
            kind: AnnotationKind::Primary,
            label: None,
        };
        let notes = finding.notes.iter().map(|note| Mark {
            location: &note.location,
            kind: AnnotationKind::Context,
            label: Some(note.message.as_str()),
        });
        let mut excerpts: Vec<Excerpt<'a>> = Vec::new();
        for mark in std::iter::once(first).chain(notes) {
            match excerpts.iter_mut().find(|excerpt| excerpt.is_near(&mark)) {
                Some(excerpt) => excerpt.marks.push(mark),
                None => excerpts.push(Excerpt {
                    path: &mark.location.file,
                    text: text_of(self.texts(), &mark.location.file),
                    marks: vec![mark],
                }),
            }
        }
        excerpts
    }
}

fn text_of<'a>(texts: &'a BTreeMap<Arc<Path>, Arc<str>>, path: &Path) -> &'a str {
    texts.get(path).map_or("", |text| text)
}

/// A marked position in an excerpt.
struct Mark<'a> {
    location: &'a Location,
    kind: AnnotationKind,
    label: Option<&'a str>,
}

/// Consecutive lines of one file.
struct Excerpt<'a> {
    path: &'a Path,
    text: &'a str,
    marks: Vec<Mark<'a>>,
}

impl<'a> Excerpt<'a> {
    fn is_near(&self, mark: &Mark<'_>) -> bool {
        let near = |m: &Mark<'_>| m.location.line.abs_diff(mark.location.line) <= FAR;
        *self.path == *mark.location.file && self.marks.iter().any(near)
    }

    fn snippet(self) -> Snippet<'a, Annotation<'a>> {
        let lines = || self.marks.iter().map(|mark| mark.location.line);
        let (first, last) = (lines().min().unwrap_or(1), lines().max().unwrap_or(1));
        let source = lines_of(self.text, first, last);
        let annotations = self.marks.iter().map(|mark| {
            let annotation = mark.kind.span(range(source, first, mark.location));
            match mark.label {
                Some(label) => annotation.label(label),
                None => annotation,
            }
        });
        Snippet::source(source)
            .path(self.path.display().to_string())
            .line_start(first as usize)
            .annotations(annotations.collect::<Vec<_>>())
    }
}

/// Lines `first` to `last` (inclusive, from 1) of a text.
fn lines_of(text: &str, first: u32, last: u32) -> &str {
    let start_of = |line: u32| {
        let before = text.split_inclusive('\n').take(line as usize);
        before.map(str::len).sum::<usize>()
    };
    let lines = &text[start_of(first.saturating_sub(1))..start_of(last)];
    lines.trim_end_matches(['\n', '\r'])
}

/// Octet range of a location in a text that begins at line `first`: the name of a tag, the value of
/// an attribute, or everything up to the next blank.
fn range(source: &str, first: u32, location: &Location) -> Range<usize> {
    let lines = source.split_inclusive('\n');
    let before = lines.take(location.line.saturating_sub(first) as usize);
    let line: usize = before.map(str::len).sum();
    let rest = &source[line..];
    let mut characters = rest.char_indices().map(|(at, _)| at);
    let column = location.column.saturating_sub(1) as usize;
    let start = line + characters.nth(column).unwrap_or(rest.len());
    let quoted = source[..start].chars().next_back();
    let ends = |c: char| match quoted {
        Some(quote @ ('"' | '\'')) => c == quote || c == '\n',
        _ => c.is_whitespace() || matches!(c, '>' | '/' | '='),
    };
    let length = source[start..].find(ends);
    start..length.map_or(source.len(), |length| start + length)
}
