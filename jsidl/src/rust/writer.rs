//! Collects Rust text and indents it.

use crate::typed::lines::is_misleading;

/// Characters in a line of code.
const WIDTH: usize = 100;

/// Collects lines and indents them by the brackets at their ends.
#[derive(Debug, Default)]
pub(super) struct Writer {
    text: String,
    depth: usize,
    uses_deprecated: bool,
}

impl Writer {
    /// Writes lines; a closing bracket at the start of a line decreases the indentation, an opening
    /// one at the end increases it.
    pub(super) fn push(&mut self, lines: impl AsRef<str>) {
        for line in lines.as_ref().lines() {
            self.line(line.trim());
        }
    }

    fn line(&mut self, line: &str) {
        let comment = line.starts_with("//");
        let line = match comment {
            true => &*line.replace(is_misleading, ""),
            false => line,
        };
        if !comment && line.starts_with(['}', ')', ']']) {
            self.depth = self.depth.saturating_sub(1);
        }
        if !line.is_empty() {
            self.text.extend(std::iter::repeat_n("    ", self.depth));
            self.text.push_str(line);
        }
        self.text.push('\n');
        if !comment && line.ends_with(['{', '(', '[']) {
            self.depth += 1;
        }
    }

    /// Writes items between brackets, separated by commas: in one line if they fit, otherwise in as few
    /// as possible.
    pub(super) fn list(&mut self, open: &str, items: &[impl AsRef<str>], close: &str) {
        let width = WIDTH.saturating_sub(4 * self.depth);
        let items: Vec<_> = items.iter().map(AsRef::as_ref).collect();
        let is_import = open.ends_with("::{");
        let pad = if open.ends_with('{') && !is_import && !items.is_empty() {
            " "
        } else {
            ""
        };
        let line = format!("{open}{pad}{}{pad}{close}", items.join(", "));
        if line.len() <= width {
            return self.line(&line);
        }
        self.line(open);
        let mut line = String::new();
        for item in items {
            if !line.is_empty() && line.len() + item.len() + 6 > width {
                self.line(&std::mem::take(&mut line));
            }
            let gap = if line.is_empty() { "" } else { " " };
            line.push_str(&format!("{gap}{item},"));
        }
        self.line(&line);
        self.line(close);
    }

    /// Sets whether the text may use deprecated items.
    pub(super) const fn uses_deprecated(&mut self, uses: bool) {
        self.uses_deprecated = uses;
    }

    /// Lets the next item use deprecated ones, if there are any.
    pub(super) fn allow_deprecated(&mut self) {
        if self.uses_deprecated {
            self.line("#[allow(deprecated)]");
        }
    }

    /// Turns a lint off for the next item, and lets it use deprecated ones, if there are any.
    pub(super) fn allow(&mut self, lint: &str) {
        match self.uses_deprecated {
            true => self.line(&format!("#[allow({lint}, deprecated)]")),
            false => self.line(&format!("#[allow({lint})]")),
        }
    }

    /// Writes a public import of items from a module. A crate need not use all of them.
    pub(super) fn import(&mut self, module: &str, items: &[String]) {
        self.line("#[doc(inline)]");
        self.allow("unused_imports");
        match items {
            [item] => self.line(&format!("pub use {module}::{item};")),
            _ => self.list(&format!("pub use {module}::{{"), items, "};"),
        }
    }

    /// Whether a module or another block has begun.
    pub(super) const fn is_in_module(&self) -> bool {
        self.depth > 0
    }

    /// Writes the terms of an expression in as few lines as possible.
    pub(super) fn terms(&mut self, terms: &[String], operator: &str) {
        let width = WIDTH.saturating_sub(4 * self.depth);
        let mut line = String::new();
        for (place, term) in terms.iter().enumerate() {
            let operator = if place == 0 { "" } else { operator };
            if !line.is_empty() && line.len() + operator.len() + term.len() + 1 > width {
                self.line(&std::mem::take(&mut line));
            }
            let gap = if line.is_empty() { "" } else { " " };
            line.push_str(&format!("{gap}{operator}{term}"));
        }
        self.line(&line);
    }

    /// Adds a blank line, unless a block has just begun.
    pub(super) fn gap(&mut self) {
        let begun = self.text.is_empty() || self.text.ends_with(['{', '(', '[']);
        let last = self.text.trim_end_matches('\n');
        if !begun && !last.ends_with(['{', '(', '[']) && !self.text.ends_with("\n\n") {
            self.text.push('\n');
        }
    }

    /// Writes documentation, wrapped to a readable width. Empty paragraphs are left out.
    pub(super) fn doc<'a>(&mut self, paragraphs: impl IntoIterator<Item = &'a str>) {
        let mut first = true;
        for paragraph in paragraphs.into_iter().filter(|text| !text.is_empty()) {
            if !first {
                self.line("///");
            }
            first = false;
            let width = 96_usize.saturating_sub(4 * self.depth).max(40);
            for line in fold(paragraph, width) {
                self.line(&format!("/// {line}"));
            }
        }
    }

    /// The collected text.
    pub(super) fn finish(self) -> String {
        self.text
    }
}

/// Wraps text at blanks into lines of at most `width` characters.
fn fold(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.is_empty() => line.push_str(word),
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
