//! Collects Rust text and indents it.

/// Collects lines and indents them by the brackets at their ends.
#[derive(Debug, Default)]
pub(super) struct Writer {
    text: String,
    depth: usize,
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
