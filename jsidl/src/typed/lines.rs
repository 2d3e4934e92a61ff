//! Indented text of a language with braces.

/// Lines at a nesting depth.
#[derive(Debug)]
pub(crate) struct Lines {
    text: String,
    depth: usize,
    indentation: &'static str,
}

impl Lines {
    pub(crate) const fn new(indentation: &'static str) -> Self {
        Self {
            text: String::new(),
            depth: 0,
            indentation,
        }
    }

    pub(crate) fn line(&mut self, line: impl AsRef<str>) {
        let line = line.as_ref();
        if !line.is_empty() {
            let indentation = std::iter::repeat_n(self.indentation, self.depth);
            self.text.extend(indentation);
            self.text.push_str(line);
        }
        self.text.push('\n');
    }

    /// A line that begins a block.
    pub(crate) fn open(&mut self, line: impl AsRef<str>) {
        self.line(line);
        self.depth += 1;
    }

    /// The line that ends a block.
    pub(crate) fn close(&mut self, line: impl AsRef<str>) {
        self.end();
        self.line(line);
    }

    /// The end of a block that has no line for it.
    pub(crate) const fn end(&mut self) {
        self.depth = self.depth.saturating_sub(1);
    }

    /// Columns that are left in a line of 100.
    pub(crate) fn width(&self) -> usize {
        (100_usize.saturating_sub(self.depth * self.indentation.len())).max(40)
    }

    pub(crate) fn finish(self) -> String {
        self.text
    }
}

/// A literal of a string in double quotes, for JavaScript and C++: ASCII as it is, other characters
/// as the language wants them.
pub(crate) fn quoted(text: &str, other: impl Fn(&mut String, char)) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    for character in text.chars() {
        match character {
            '"' | '\\' => out.extend(['\\', character]),
            plain if plain == ' ' || plain.is_ascii_graphic() => out.push(plain),
            special => other(&mut out, special),
        }
    }
    out.push('"');
    out
}

/// Whether a character of a comment would be invisible or change the order in which text is shown.
/// Compilers warn of some of them, or refuse them, also in comments.
pub(crate) const fn is_misleading(c: char) -> bool {
    matches!(
        c,
        '\0'..='\x1F' | '\x7F'..='\u{9F}' | '\u{200B}'..='\u{200F}' | '\u{2028}'..='\u{202E}'
            | '\u{2060}'..='\u{206F}' | '\u{FEFF}'
    )
}
