//! Standard output by lines, and messages on standard error.

use std::borrow::Cow;
use std::fmt::{self, Display};
use std::io::{self, IsTerminal, StdoutLock, Write};

use jaus_text::{is_unprintable, push_json};

use super::failure::Failure;

/// Environment variable by which `jaus up` tells its parts that their output goes to a log, not to
/// a terminal: they show no secrets in it.
pub const OUTPUT_IS_LOG: &str = "JAUS_OUTPUT_IS_LOG";

/// For example `no errors`, `1 error`, `2 errors`.
pub fn counted(count: usize, what: &str) -> String {
    match count {
        0 => format!("no {what}s"),
        1 => format!("1 {what}"),
        count => format!("{count} {what}s"),
    }
}

/// A size with a fitting unit, for example `812 B`, `1.5 kB` or `20.0 MB`.
pub fn size(octets: u64) -> String {
    let mut size = octets as f64;
    if size < 1000.0 {
        return format!("{octets} B");
    }
    let mut units = ["kB", "MB", "GB", "TB"].into_iter().peekable();
    loop {
        size /= 1000.0;
        let unit = units.next().unwrap_or("TB");
        // Rounding must not make 1000.0 of it.
        if size < 999.95 || units.peek().is_none() {
            return format!("{size:.1} {unit}");
        }
    }
}

/// Standard output. Every line is flushed when [`line`](Self::line) returns.
pub struct Output {
    out: StdoutLock<'static>,
    /// Whether colours may be in it.
    colours: bool,
}

impl Default for Output {
    fn default() -> Self {
        Self::new()
    }
}

impl Output {
    /// Opens standard output.
    pub fn new() -> Self {
        let out = io::stdout().lock();
        let colours = colours_wanted(&out);
        Self { out, colours }
    }

    /// Prints text that is no line: a screen.
    pub fn part(&mut self, text: &str) -> Result<(), Failure> {
        self.write(format_args!("{text}"))
    }

    /// Prints a line, or several. Unprintable characters other than line ends, tabs and colours of a
    /// terminal are escaped as in JSON. Text from the network goes through
    /// [`quoted`](jaus_text::quoted), so that it adds no lines and no colours.
    pub fn line(&mut self, text: impl Display) -> Result<(), Failure> {
        let text = text.to_string();
        let shown = printable(&text, self.colours);
        self.write(format_args!("{shown}\n"))
    }

    fn write(&mut self, text: fmt::Arguments<'_>) -> Result<(), Failure> {
        self.out
            .write_fmt(text)
            .and_then(|()| self.out.flush())
            .map_err(|error| match error.kind() {
                io::ErrorKind::BrokenPipe => Failure::OutputClosed,
                _ => Failure::new(format!("cannot write to standard output: {error}")),
            })
    }
}

/// Wraps text into lines of 80 columns; all but the first start with this indentation.
pub fn wrapped(text: &str, indent: usize) -> String {
    let mut lines = String::new();
    let mut column = indent;
    // Non-breaking spaces keep phrases together.
    for word in text.split_ascii_whitespace() {
        let length = word.chars().count();
        if column > indent && column + 1 + length > WIDTH {
            lines.push_str(&format!("\n{:indent$}", ""));
            column = indent;
        } else if column > indent {
            lines.push(' ');
            column += 1;
        }
        lines.push_str(word);
        column += length;
    }
    lines.replace('\u{a0}', " ")
}

/// Default width of a terminal, in columns.
const WIDTH: usize = 80;

/// Prints a message on standard error. Errors are ignored.
pub fn say(words: impl Display) {
    say_as("jaus", words);
}

/// The same, for a program other than `jaus`.
pub fn say_as(program: &str, words: impl Display) {
    say_lines(format_args!("{program}: {words}"));
}

/// Prints lines on standard error. Errors are ignored.
pub fn say_lines(lines: impl Display) {
    let lines = lines.to_string();
    let mut stderr = io::stderr().lock();
    let lines = printable(&lines, colours_wanted(&stderr));
    let _ = writeln!(stderr, "{lines}");
}

/// Lines of output in printable characters. The others are escaped as in JSON, so that JSON keeps its
/// value; except for line ends, tabs and, if wanted, the colours of our own lines.
fn printable(text: &str, colours: bool) -> Cow<'_, str> {
    let is_hidden = |c| is_unprintable(c) && !matches!(c, '\n' | '\t');
    if !text.contains(is_hidden) {
        return text.into();
    }
    let mut shown = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let colour = colour_at(rest).filter(|_| colours);
        match colour {
            Some(sequence) => shown.push_str(sequence),
            None if is_hidden(first) => push_json(&mut shown, first),
            None => shown.push(first),
        }
        rest = &rest[colour.map_or(first.len_utf8(), str::len)..];
    }
    shown.into()
}

/// The sequence for a colour at the beginning of a text, such as `ESC [ 3 1 m`: bold, dim, or a colour
/// of letters. None hides them.
fn colour_at(text: &str) -> Option<&str> {
    let parameters = text.strip_prefix("\x1b[")?;
    let end = parameters.find(|c: char| !c.is_ascii_digit())?;
    let colour = parameters[..end].parse();
    let is_colour =
        parameters[end..].starts_with('m') && matches!(colour, Ok(0_u8..=2 | 30..=37 | 90..=97));
    is_colour.then(|| &text[..text.len() - parameters.len() + end + 1])
}

/// Whether to use colours: on a terminal, unless NO_COLOR (<https://no-color.org>) is set.
pub fn colours_wanted(stream: &impl IsTerminal) -> bool {
    stream.is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_a_fitting_unit() {
        for (octets, text) in [
            (0, "0 B"),
            (999, "999 B"),
            (1_000, "1.0 kB"),
            (999_949, "999.9 kB"),
            (999_960, "1.0 MB"),
            (20_000_000, "20.0 MB"),
            (u64::MAX, "18446744.1 TB"),
        ] {
            assert_eq!(size(octets), text);
        }
    }

    #[test]
    fn only_colours_reach_the_terminal_as_control_sequences() {
        for (text, shown) in [
            (
                "\x1b[31mred\x1b[0m\tand\nnext",
                "\x1b[31mred\x1b[0m\tand\nnext",
            ),
            ("\x1b[8mhidden\x1b[41m", r"\u001b[8mhidden\u001b[41m"),
            ("\x1b]0;title\x07", r"\u001b]0;title\u0007"),
            ("\x1b[2Jclear\r", r"\u001b[2Jclear\u000d"),
            (
                "\u{9b}31m \u{7f} \u{202e}gpj.exe\u{200b}",
                r"\u009b31m \u007f \u202egpj.exe\u200b",
            ),
            ("\x1b", r"\u001b"),
            ("\x1b[1", r"\u001b[1"),
            ("Müller · 5 µs", "Müller · 5 µs"),
        ] {
            assert_eq!(printable(text, true), shown, "{text:?}");
        }
        assert_eq!(printable("\x1b[31mred", false), r"\u001b[31mred");
    }

    #[test]
    fn json_with_a_hostile_name_stays_the_same_value() {
        let json = serde_json::json!({ "name": "\u{202e}gpj\u{9b}2J\u{7f}\r\n\u{e0041}" });
        let printed = printable(&json.to_string(), true).into_owned();
        assert!(!printed.contains(is_unprintable), "{printed}");
        assert_eq!(
            serde_json::from_str::<serde_json::Value>(&printed).unwrap(),
            json
        );
    }
}
