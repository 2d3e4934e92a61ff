//! Lines of the compact form, and what several constructs write alike.

use super::cursor::Place;
use super::tree::Element;
use crate::layout::WIDTH;

/// A construct that the compact form cannot say.
pub(super) struct Inexpressible;

pub(super) type Written<T> = Result<T, Inexpressible>;

#[derive(Default)]
pub(super) struct Writer {
    pub(super) text: String,
}

impl Writer {
    pub(super) fn line(&mut self, indent: usize, line: &str) {
        if !line.is_empty() {
            self.text.extend(std::iter::repeat_n(' ', indent));
            self.text.push_str(line);
        }
        self.text.push('\n');
    }

    pub(super) fn comments(&mut self, comments: &[String], indent: usize) {
        for line in comments.iter().flat_map(|it| it.lines()) {
            let line = line.trim();
            if !line.is_empty() {
                // `//@` would be an amendment.
                self.line(indent, &format!("// {line}"));
            }
        }
    }

    /// Writes an interpretation on lines of its own.
    pub(super) fn interpretation(&mut self, element: &Element, indent: usize) {
        let text = element.value("interpretation");
        if text.is_empty() || text.contains("##") || text.starts_with('#') || text.ends_with('#') {
            return;
        }
        let words = format!("##{text}##");
        let mut line = String::new();
        for word in words.split(' ') {
            if !line.is_empty() && indent + line.chars().count() + 1 + word.chars().count() > WIDTH
            {
                self.line(indent, &line);
                line.clear();
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
        self.line(indent, &line);
    }
}

/// An interpretation within a line, before a blank.
pub(super) fn explained(element: &Element) -> String {
    match element.value("interpretation") {
        text if text.is_empty() || text.contains('#') => String::new(),
        text => format!("##{text}## "),
    }
}

/// What a variant writes before an alternative.
pub(super) fn tag(element: &Element, place: Place) -> String {
    match place {
        Place::Alternative => format!("vtag: {}", explained(element)),
        _ => String::new(),
    }
}
