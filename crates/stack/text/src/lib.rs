//! Text from outside, made fit for a terminal, a log, a report or a page.
//!
//! Names, reasons, service URNs and other texts of peers are stored and forwarded as received. They are
//! escaped once, on the way out, where a person or a program reads them:
//!
//! | item | for |
//! |---|---|
//! | [`visible`] | a field of the log, a label of a metric, text among other text |
//! | [`quoted`] | a name in a line of output, which must show where it ends |
//! | [`visible_json`] | a JSON document, which keeps its value |
//! | [`is_unprintable`] | writers with escapes of their own, such as XML |
//!
//! Letters of all scripts, accents and symbols stay as they are.
#![forbid(unsafe_code)]

use std::borrow::Cow;
use std::fmt::Write as _;

/// Most characters of one text that are shown; `…` marks where the rest is cut off.
pub const LONGEST: usize = 1000;

/// Mark of a cut.
const CUT: char = '…';

/// Whether a character does something other than show itself: a control character (C0, DEL, C1), one
/// that separates lines, changes the direction of the text after it, or is not visible at all.
///
/// ```
/// use jaus_text::is_unprintable;
///
/// assert!("\x1b\n\u{9b}\u{202e}\u{200b}\u{2028}".chars().all(is_unprintable));
/// assert!(!"Müller 火星 · 5 µs".contains(is_unprintable));
/// ```
#[must_use]
pub fn is_unprintable(c: char) -> bool {
    c.is_control() || is_format(c) || is_noncharacter(c)
}

/// Line separators, controls of direction, and characters of no or blank appearance: Unicode's
/// `Default_Ignorable_Code_Point`, its `Zl` and `Zp`, and the controls of direction and annotation.
const fn is_format(c: char) -> bool {
    matches!(c,
        '\u{AD}' | '\u{34F}' | '\u{61C}' | '\u{115F}' | '\u{1160}' | '\u{17B4}' | '\u{17B5}'
        | '\u{180B}'..='\u{180F}' | '\u{200B}'..='\u{200F}' | '\u{2028}'..='\u{202E}'
        | '\u{2060}'..='\u{206F}' | '\u{2800}' | '\u{3164}' | '\u{FE00}'..='\u{FE0F}' | '\u{FEFF}'
        | '\u{FFA0}' | '\u{FFF0}'..='\u{FFFB}' | '\u{1BCA0}'..='\u{1BCA3}'
        | '\u{1D173}'..='\u{1D17A}' | '\u{E0000}'..='\u{E0FFF}')
}

/// Code points that are no characters, which XML forbids.
const fn is_noncharacter(c: char) -> bool {
    matches!(c, '\u{FDD0}'..='\u{FDEF}') || c as u32 & 0xFFFE == 0xFFFE
}

/// The text with each [unprintable](is_unprintable) character as an escape such as `\u{1b}` or `\n`, cut
/// after [`LONGEST`] characters with a mark.
///
/// ```
/// assert_eq!(jaus_text::visible("\x1b[2Ja\nb"), r"\u{1b}[2Ja\nb");
/// ```
#[must_use]
pub fn visible(text: &str) -> Cow<'_, str> {
    shortened(text, LONGEST)
}

/// As [`visible`], cut after this many characters.
#[must_use]
pub fn shortened(text: &str, most: usize) -> Cow<'_, str> {
    let end = text.char_indices().nth(most).map(|(end, _)| end);
    let kept = &text[..end.unwrap_or(text.len())];
    if end.is_none() && !kept.contains(is_unprintable) {
        return text.into();
    }
    let mut shown = String::with_capacity(kept.len());
    kept.chars().for_each(|c| push(&mut shown, c));
    shown.extend(end.map(|_| CUT));
    shown.into()
}

/// A name for a line of output: unchanged, or if a character of it is
/// [unprintable](is_unprintable), [`visible`] and in double quotes, so that the escapes are known for
/// escapes.
///
/// ```
/// assert_eq!(jaus_text::quoted("Müller"), "Müller");
/// assert_eq!(jaus_text::quoted("a\nfake line"), r#""a\nfake line""#);
/// ```
#[must_use]
pub fn quoted(text: &str) -> Cow<'_, str> {
    let shown = visible(text);
    match text.contains(is_unprintable) {
        true => format!("\"{}\"", shown.replace('"', "\\\"")).into(),
        false => shown,
    }
}

/// A JSON document in printable characters: the others, which can only be in its strings, become
/// escapes of JSON, so that it keeps its value. Line ends and tabs between the values stay.
#[must_use]
pub fn visible_json(json: &str) -> Cow<'_, str> {
    let is_hidden = |c| is_unprintable(c) && !matches!(c, '\n' | '\t');
    if !json.contains(is_hidden) {
        return json.into();
    }
    let mut shown = String::with_capacity(json.len());
    for c in json.chars() {
        match is_hidden(c) {
            true => push_json(&mut shown, c),
            false => shown.push(c),
        }
    }
    shown.into()
}

/// Appends a character as [`visible`] shows it.
fn push(shown: &mut String, c: char) {
    match is_unprintable(c) {
        true => shown.extend(c.escape_default()),
        false => shown.push(c),
    }
}

/// Appends a character as JSON escapes it: as two surrogates if it needs more than four digits.
pub fn push_json(shown: &mut String, c: char) {
    for unit in c.encode_utf16(&mut [0; 2]) {
        // A string takes any text.
        let _ = write!(shown, "\\u{unit:04x}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A text of each kind that must not be shown as it is.
    const HOSTILE: [&str; 12] = [
        "\x1b]0;title\x07",
        "\x1b[2J\x1b[31m",
        "\u{9b}31m",
        "\x7f\x08\x00",
        "a\r\nforged line",
        "a\u{85}b",
        "\u{202e}gpj.exe\u{2066}\u{2069}",
        "\u{200e}\u{200f}\u{61c}",
        "in\u{200b}vis\u{ad}i\u{2060}ble\u{feff}",
        "\u{2028}line\u{2029}",
        "\u{e0041}tag\u{fe0f}\u{e0100}",
        "\u{fffe}\u{10ffff}\u{fdd0}",
    ];

    #[test]
    fn hostile_text_becomes_visible_in_every_form() {
        for text in HOSTILE {
            for shown in [visible(text), quoted(text), shortened(text, 5)] {
                assert!(!shown.contains(is_unprintable), "{text:?}: {shown:?}");
            }
            assert!(quoted(text).starts_with('"'), "{text:?}");
        }
    }

    #[test]
    fn printable_text_of_all_scripts_stays() {
        for text in [
            "urn:jaus:jss:core:Events",
            "Müller \"2\" · 5 µs \\ n\u{303}",
            "火星　探査車",
            "مركبة רכב ровер ρόβερ",
            "🚜 → ✔",
        ] {
            assert_eq!(visible(text), text);
            assert_eq!(quoted(text), text);
            assert_eq!(visible_json(text), text);
        }
    }

    #[test]
    fn escapes_say_which_character_it_was() {
        for (text, shown) in [
            ("a\nfake line", r#""a\nfake line""#),
            ("\x1b]0;t\x07\r\u{9b}", r#""\u{1b}]0;t\u{7}\r\u{9b}""#),
            ("\u{202e}revoR\u{2028}", r#""\u{202e}revoR\u{2028}""#),
            ("\x1b\" and more", r#""\u{1b}\" and more""#),
        ] {
            assert_eq!(quoted(text), shown);
        }
    }

    #[test]
    fn long_text_is_cut_with_a_mark() {
        let long = "ü".repeat(LONGEST + 1);
        let shown = visible(&long);
        assert_eq!(shown.chars().count(), LONGEST + 1);
        assert!(shown.ends_with('…'), "{shown}");
        assert_eq!(visible(&long[2..]), &long[2..], "as long as allowed");
        assert_eq!(shortened("\x1babc", 2), r"\u{1b}a…");
        assert_eq!(quoted(&long), shown, "not quoted: nothing is escaped");
    }

    #[test]
    fn invalid_utf_8_is_shown_as_replacements() {
        let text = String::from_utf8_lossy(b"a\xff\x9b\xf0\x9f");
        assert_eq!(visible(&text), "a\u{fffd}\u{fffd}\u{fffd}");
    }

    #[test]
    fn a_json_document_keeps_its_value() {
        let value = serde_json::json!({ "name": HOSTILE.concat(), "Müller": [1, "火"] });
        for json in [value.to_string(), format!("{value:#}")] {
            let shown = visible_json(&json);
            assert!(
                !shown.replace('\n', "").contains(is_unprintable),
                "{shown:?}"
            );
            assert_eq!(
                serde_json::from_str::<serde_json::Value>(&shown).unwrap(),
                value
            );
        }
    }
}
